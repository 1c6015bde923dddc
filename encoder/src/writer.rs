//! Units on their way out.

use crate::error::Error;
use crate::report::GopReport;
use crate::shard::Shard;
use crate::verification::Verifier;
use splatstream_decoder::operating_point::Tally;
use splatstream_format::payload::{Index, SceneDescription};
use splatstream_format::syntax::{
    EndOfStream, GopHeader, IndexEntry, Profile, SequenceParameters, UnitHeader, UnitId, UnitType,
};
use splatstream_format::unit::{Unit, write_file_header, write_unit};
use std::io::Write;

/// Where coded GOPs go. Frames are counted in the sequence.
pub(crate) trait GopSink {
    /// Starts a GOP with a frame. It gets its number where it is written.
    fn gop(&mut self, header: &GopHeader, frame: u32) -> Result<(), Error>;

    /// Takes a unit of the GOP that was started last.
    fn unit(&mut self, id: UnitId, payload: Vec<u8>) -> Result<(), Error>;
}

/// GOPs that are coded and not written yet.
#[derive(Default)]
pub(crate) struct Coded {
    gops: Vec<CodedGop>,
}

struct CodedGop {
    header: GopHeader,
    /// Its first frame.
    frame: u32,
    units: Vec<(UnitId, Vec<u8>)>,
}

impl GopSink for Coded {
    fn gop(&mut self, header: &GopHeader, frame: u32) -> Result<(), Error> {
        self.gops.push(CodedGop { header: *header, frame, units: Vec::new() });
        Ok(())
    }

    fn unit(&mut self, id: UnitId, payload: Vec<u8>) -> Result<(), Error> {
        if let Some(gop) = self.gops.last_mut() {
            gop.units.push((id, payload));
        }
        Ok(())
    }
}

impl Coded {
    /// Bytes of the units.
    pub(crate) fn bytes(&self) -> usize {
        let units = self.gops.iter().flat_map(|gop| &gop.units);
        units.map(|(_, payload)| UnitHeader::SIZE.saturating_add(payload.len())).sum()
    }

    /// Writes all of it.
    pub(crate) fn write_to(self, writer: &mut UnitWriter<'_>) -> Result<(), Error> {
        for CodedGop { header, frame, units } in self.gops {
            writer.gop(&header, frame)?;
            units.into_iter().try_for_each(|(id, payload)| GopSink::unit(writer, id, payload))?;
        }
        Ok(())
    }
}

/// What stands before the first GOP, besides the sequence parameters.
pub(crate) struct Head<'h> {
    pub(crate) level: u8,
    pub(crate) description: Option<&'h SceneDescription>,
    pub(crate) shard: Option<&'h Shard>,
}

/// Writes units, and keeps what the end of the stream says about them.
pub(crate) struct UnitWriter<'a> {
    sink: &'a mut dyn Write,
    record: &'a mut Record,
}

/// What is known of the units that have been written. A stream that is written GOP by GOP goes on with it.
pub(crate) struct Record {
    profile: Profile,
    sequence: SequenceParameters,
    /// The frame of the sequence that the stream begins with.
    first: u32,
    /// Bytes written.
    pub(crate) offset: u64,
    units: u32,
    /// frame_header units.
    frames: u32,
    /// Where GOPs start.
    index: Vec<IndexEntry>,
    /// The GOPs that have been started.
    pub(crate) gops: Vec<GopReport>,
    /// What the units add to the operating points.
    tally: Tally,
    /// Is shown everything that is written, if there is one.
    pub(crate) verifier: Option<Verifier>,
}

impl Record {
    /// Of nothing, of a stream that begins with a frame of a sequence.
    pub(crate) fn new(profile: Profile, sequence: &SequenceParameters, first: u32) -> Self {
        Self {
            profile,
            sequence: *sequence,
            first,
            offset: 0,
            units: 0,
            frames: 0,
            index: Vec::new(),
            gops: Vec::new(),
            tally: Tally::new(profile),
            verifier: None,
        }
    }
}

impl<'a> UnitWriter<'a> {
    /// Begins or goes on with the stream of a record.
    pub(crate) fn new(sink: &'a mut dyn Write, record: &'a mut Record) -> Self {
        Self { sink, record }
    }

    /// What stands before the first GOP.
    pub(crate) fn start(&mut self, &Head { level, description, shard }: &Head<'_>) -> Result<(), Error> {
        let mut head = write_file_header(self.record.profile, level)?;
        self.bytes(&head)?;
        let (id, sequence) = (UnitId::stream(UnitType::SequenceParameters), self.record.sequence.to_bytes()?);
        self.unit(id, &sequence)?;
        if let Some(verifier) = &mut self.record.verifier {
            write_unit(&mut head, id, &sequence)?;
            verifier.head(&head);
        }
        if let Some(description) = description {
            self.unit(UnitId::stream(UnitType::SceneDescription), &description.to_bytes()?)?;
        }
        shard.map_or(Ok(()), |shard| self.unit(UnitId::stream(Shard::UNIT_TYPE), &shard.to_bytes()))
    }

    /// Passes on what was written: who reads a stream while it is made has each GOP when it is coded.
    pub(crate) fn pass_on(&mut self) -> Result<(), Error> {
        self.sink.flush()?;
        Ok(())
    }

    /// What stands after the last GOP.
    pub(crate) fn finish(mut self) -> Result<(), Error> {
        if let Some(verifier) = &mut self.record.verifier {
            verifier.end_gop()?;
        }
        if self.record.profile == Profile::Dynamic {
            let points = self.record.tally.list().to_bytes()?;
            self.unit(UnitId::stream(UnitType::OperatingPoints), &points)?;
        }
        let index_offset = self.record.offset;
        let index = Index { entries: core::mem::take(&mut self.record.index) };
        self.unit(UnitId::stream(UnitType::Index), &index.to_bytes()?)?;
        let end =
            EndOfStream { frame_count: self.record.frames, unit_count: self.record.units, index_offset };
        self.unit(UnitId::stream(UnitType::End), &end.to_bytes()?)
    }

    /// Writes a unit.
    #[expect(clippy::arithmetic_side_effects, reason = "units and bytes that were written")]
    pub(crate) fn unit(&mut self, id: UnitId, payload: &[u8]) -> Result<(), Error> {
        let header = UnitHeader::new(id, payload)?;
        self.record.frames += u32::from(id.unit_type == UnitType::FrameHeader);
        self.unit_as_it_is(&header, payload)
    }

    /// Writes a unit with the header that it has.
    #[expect(clippy::arithmetic_side_effects, reason = "units and bytes that were written")]
    pub(crate) fn unit_as_it_is(&mut self, header: &UnitHeader, payload: &[u8]) -> Result<(), Error> {
        self.record.units += 1;
        self.record.tally.unit(&Unit { at: 0, header: *header, payload, payload_at: 0 });
        if let Some(verifier) = &mut self.record.verifier {
            verifier.unit(header, payload)?;
        }
        self.bytes(&header.to_bytes()?)?;
        self.bytes(payload)
    }

    #[expect(clippy::arithmetic_side_effects, reason = "units and bytes that were written")]
    fn bytes(&mut self, bytes: &[u8]) -> Result<(), Error> {
        self.sink.write_all(bytes)?;
        self.record.offset += bytes.len() as u64;
        Ok(())
    }
}

impl GopSink for UnitWriter<'_> {
    /// Starts a GOP. The sequence parameters are repeated before each but the first: a stream of which the beginning is
    /// lost or damaged can still be decoded.
    fn gop(&mut self, header: &GopHeader, frame: u32) -> Result<(), Error> {
        let gops = self.record.index.len();
        if gops > 0 {
            self.unit(UnitId::stream(UnitType::SequenceParameters), &self.record.sequence.to_bytes()?)?;
        }
        self.record.gops.push(GopReport { first: frame, frames: header.gop_frame_count });
        let (header, frame) =
            (GopHeader { gop_index: gops as u32, ..*header }, frame.saturating_sub(self.record.first));
        self.record.index.push(IndexEntry { frame, reserved_zero: 0, offset: self.record.offset });
        if let Some(verifier) = &mut self.record.verifier {
            verifier.start_gop(&header, frame)?;
        }
        self.unit(UnitId::of_frame(UnitType::GopHeader, frame), &header.to_bytes()?)
    }

    fn unit(&mut self, id: UnitId, payload: Vec<u8>) -> Result<(), Error> {
        let frame = id.frame.saturating_sub(self.record.first);
        Self::unit(self, UnitId { frame, ..id }, &payload)
    }
}
