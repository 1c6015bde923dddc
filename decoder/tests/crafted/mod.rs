//! Streams made by hand, in the elements of the syntax: any element can be given any value.
//!
//! A [`scene::Scene`] holds values and becomes a [`Script`], a list of units; both can be edited before bytes are
//! made. Whatever a test does not set is what the specification asks for, by the definitions in [`reference`]
//! and [`contexts`], which follow its text and share no code with the decoder.

pub(crate) mod coding;
pub(crate) mod contexts;
pub(crate) mod expect;
pub(crate) mod reference;
pub(crate) mod sample;
pub(crate) mod scene;

use splatstream_format::payload::Index;
use splatstream_format::syntax::{EndOfStream, IndexEntry, Profile, UnitId, UnitType};
use splatstream_format::unit::{write_file_header, write_unit};

/// Bytes of file_header, and of unit_header.
pub(crate) const FILE_HEADER: usize = 16;
pub(crate) const UNIT_HEADER: usize = 20;

/// One unit of a stream to be.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Part {
    /// A unit with this payload.
    Unit(UnitId, Vec<u8>),
    /// The index of the GOPs before.
    Index,
    /// The end unit that fits the units before.
    End,
    /// A unit whose bytes, header included, are these.
    Bytes(Vec<u8>),
}

/// A stream, unit by unit.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Script {
    pub(crate) profile: Profile,
    pub(crate) level: u8,
    pub(crate) parts: Vec<Part>,
}

impl Part {
    pub(crate) fn unit(unit_type: UnitType, frame: u32, payload: Vec<u8>) -> Self {
        Self::Unit(UnitId::of_frame(unit_type, frame), payload)
    }

    /// A unit of private data that is not critical.
    pub(crate) fn private(payload: &[u8]) -> Self {
        Self::Unit(UnitId::stream(UnitType::User(200)), payload.to_vec())
    }

    fn kind(&self) -> UnitType {
        match self {
            Self::Unit(id, _) => id.unit_type,
            Self::Index => UnitType::Index,
            Self::End => UnitType::End,
            Self::Bytes(bytes) => UnitType::from_code(bytes.first().copied().unwrap_or(0)),
        }
    }
}

impl Script {
    /// The bytes of the stream.
    pub(crate) fn bytes(&self) -> Vec<u8> {
        let mut bytes = write_file_header(self.profile, self.level).unwrap();
        for part in 0..self.parts.len() {
            bytes.extend(self.part_bytes(part));
        }
        bytes
    }

    /// Offset of a part.
    pub(crate) fn at(&self, part: usize) -> u64 {
        let before = (0..part).map(|part| self.part_bytes(part).len()).sum::<usize>();
        (FILE_HEADER + before) as u64
    }

    /// The place of the n-th part of a kind.
    pub(crate) fn find(&self, kind: UnitType, n: usize) -> usize {
        let mut places = (0..self.parts.len()).filter(|&place| self.parts[place].kind() == kind);
        places.nth(n).unwrap_or_else(|| panic!("there is no {} {n}", kind.name()))
    }

    /// The header elements of a unit, to be changed.
    pub(crate) fn id(&mut self, kind: UnitType, n: usize) -> &mut UnitId {
        let part = self.find(kind, n);
        self.solid(part).0
    }

    /// The payload of a unit, to be changed.
    pub(crate) fn payload(&mut self, kind: UnitType, n: usize) -> &mut Vec<u8> {
        let part = self.find(kind, n);
        self.solid(part).1
    }

    /// Gives places of a payload other bytes.
    pub(crate) fn put(&mut self, kind: UnitType, n: usize, at: usize, bytes: impl AsRef<[u8]>) {
        let bytes = bytes.as_ref();
        self.payload(kind, n)[at..at + bytes.len()].copy_from_slice(bytes);
    }

    /// Puts a part before the n-th of a kind.
    pub(crate) fn insert_before(&mut self, kind: UnitType, n: usize, part: Part) {
        let place = self.find(kind, n);
        self.parts.insert(place, part);
    }

    pub(crate) fn remove(&mut self, kind: UnitType, n: usize) -> Part {
        let place = self.find(kind, n);
        self.parts.remove(place)
    }

    /// Flips a bit of the payload without a new check sum.
    pub(crate) fn damage(&mut self, kind: UnitType, n: usize) {
        self.damage_part(self.find(kind, n));
    }

    pub(crate) fn damage_part(&mut self, place: usize) {
        let mut bytes = self.part_bytes(place);
        let last = bytes.len() - 1;
        bytes[last] ^= 1;
        self.parts[place] = Part::Bytes(bytes);
    }

    /// A unit as id and payload; index and end are made of the units before.
    fn solid(&mut self, part: usize) -> (&mut UnitId, &mut Vec<u8>) {
        let payload = match &self.parts[part] {
            Part::Index => Some((UnitType::Index, self.index(part))),
            Part::End => Some((UnitType::End, self.end(part))),
            _ => None,
        };
        if let Some((kind, payload)) = payload {
            self.parts[part] = Part::Unit(UnitId::stream(kind), payload);
        }
        match &mut self.parts[part] {
            Part::Unit(id, payload) => (id, payload),
            other => panic!("{other:?} has no elements to set"),
        }
    }

    fn part_bytes(&self, part: usize) -> Vec<u8> {
        let mut bytes = Vec::new();
        match &self.parts[part] {
            Part::Unit(id, payload) => write_unit(&mut bytes, *id, payload).unwrap(),
            Part::Index => {
                write_unit(&mut bytes, UnitId::stream(UnitType::Index), &self.index(part)).unwrap();
            }
            Part::End => write_unit(&mut bytes, UnitId::stream(UnitType::End), &self.end(part)).unwrap(),
            Part::Bytes(raw) => bytes.clone_from(raw),
        }
        bytes
    }

    fn index(&self, part: usize) -> Vec<u8> {
        let entry = |place: usize| match &self.parts[place] {
            Part::Unit(id, _) if id.unit_type == UnitType::GopHeader => {
                Some(IndexEntry { frame: id.frame, reserved_zero: 0, offset: self.at(place) })
            }
            _ => None,
        };
        Index { entries: (0..part).filter_map(entry).collect() }.to_bytes().unwrap()
    }

    fn end(&self, part: usize) -> Vec<u8> {
        let before = &self.parts[..part];
        let frames = before.iter().filter(|part| part.kind() == UnitType::FrameHeader).count();
        let index = before.iter().position(|part| part.kind() == UnitType::Index);
        EndOfStream {
            frame_count: frames as u32,
            unit_count: part as u32,
            index_offset: index.map_or(0, |place| self.at(place)),
        }
        .to_bytes()
        .unwrap()
    }
}

/// Makes the check sum of the unit header at the start of `bytes` fit again.
pub(crate) fn seal_header(bytes: &mut [u8]) {
    let covered: Vec<u8> = bytes[..6].iter().chain(&bytes[8..UNIT_HEADER]).copied().collect();
    bytes[6..8].copy_from_slice(&crc32(&covered).to_le_bytes()[..2]);
}

/// The check sum of 4.6, by its definition.
pub(crate) fn crc32(bytes: &[u8]) -> u32 {
    let mut crc = u32::MAX;
    for &byte in bytes {
        crc ^= u32::from(byte);
        for _ in 0..8 {
            crc = if crc & 1 == 1 { (crc >> 1) ^ 0xEDB8_8320 } else { crc >> 1 };
        }
    }
    !crc
}
