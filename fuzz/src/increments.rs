//! Streams of profile Dynamic that obey the syntax: they come back as they were written, and decoding them, through
//! sections that are right up to their values or not at all, keeps its laws.

use crate::decode::choice;
use crate::{LIMITS, laws};
use arbitrary::{Arbitrary, Unstructured};
use splatstream_format::arbitrary_stream::dynamic::{ArbitraryIncrement, DynamicGop, DynamicStream};
use splatstream_format::payload::{Codebook, Increment, OperatingPoints, Transform};
use splatstream_format::syntax::{FrameHeader, GopHeader, Profile, SequenceParameters, UnitType};
use splatstream_format::unit::{Stream, Unit};

/// The input is what the stream is made of.
pub fn run(data: &[u8]) {
    // Fails only where the bytes do not suffice.
    let Ok(stream) = DynamicStream::arbitrary(&mut Unstructured::new(data)) else { return };
    let bytes = stream.to_bytes().expect("a valid stream can be written");
    comes_back(&stream, &bytes);
    laws::hold(&bytes, choice(data));
}

/// Unit by unit what was written.
fn comes_back(stream: &DynamicStream, bytes: &[u8]) {
    let opened = Stream::open(bytes, &LIMITS).expect("it starts with a file header");
    assert_eq!((opened.header().level, opened.header().profile()), (stream.level, Profile::Dynamic));
    let units: Vec<Unit<'_>> = opened.units().collect::<Result<_, _>>().expect("units lie back to back");
    let mut units = Payloads { units: units.iter() };
    let unit = units.next(UnitType::SequenceParameters);
    let sequence = SequenceParameters::parse_payload(unit.payload, unit.payload_at, Profile::Dynamic);
    assert_eq!(sequence, Ok(stream.sequence));
    stream.gops.iter().for_each(|gop| units.gop(gop, &stream.sequence));
    if let Some(points) = &stream.points {
        let unit = units.next(UnitType::OperatingPoints);
        let read = OperatingPoints::parse(unit.payload, unit.payload_at).expect("a list");
        assert_eq!(read.entries, *points);
    }
    if stream.has_index {
        units.next(UnitType::Index);
    }
    units.next(UnitType::End);
    assert_eq!(units.units.next(), None);
}

/// The units of a stream, to be compared with what they were made of.
struct Payloads<'u, 'a> {
    units: core::slice::Iter<'u, Unit<'a>>,
}

impl<'u, 'a> Payloads<'u, 'a> {
    fn next(&mut self, expected: UnitType) -> &'u Unit<'a> {
        let unit = self.units.next().expect("there are more units");
        assert_eq!(unit.header.unit_type(), expected);
        unit
    }

    fn gop(&mut self, gop: &DynamicGop, sequence: &SequenceParameters) {
        let unit = self.next(UnitType::GopHeader);
        let read = GopHeader::parse_payload(unit.payload, unit.payload_at, Profile::Dynamic);
        assert_eq!(read, Ok(gop.header));
        for transform in &gop.transforms {
            let unit = self.next(UnitType::Transform);
            assert_eq!(Transform::parse(unit.payload, unit.payload_at, sequence).as_ref(), Ok(transform));
        }
        for frame in &gop.frames {
            for made in &frame.codebooks {
                let unit = self.next(UnitType::Codebook);
                let read = Codebook::parse(unit.payload, unit.payload_at, &LIMITS);
                assert_eq!(read.as_ref(), Ok(&made.codebook));
                assert_eq!(unit.header.temporal_layer, made.temporal_layer);
            }
            let unit = self.next(UnitType::FrameHeader);
            let read = FrameHeader::parse_payload(unit.payload, unit.payload_at, Profile::Dynamic);
            assert_eq!(read, Ok(frame.header));
            frame.increments.iter().for_each(|made| self.increment(made, sequence));
        }
    }

    fn increment(&mut self, made: &ArbitraryIncrement, sequence: &SequenceParameters) {
        let unit = self.next(UnitType::Increment);
        let place = (unit.header.spatial_layer, unit.header.refinement);
        assert_eq!(place, (made.spatial_layer, made.refinement));
        let read = Increment::parse(unit.payload, unit.payload_at, sequence, &LIMITS).expect("an increment");
        assert_eq!((read.header, read.sections.len()), (made.header, made.sections.len()));
        for (read, made) in read.sections.iter().zip(&made.sections) {
            assert_eq!((read.lanes_log2, read.model), (made.lanes_log2, made.model.as_slice()));
            let blocks = read.blocks.iter().map(|(block, _)| *block);
            assert!(blocks.eq(made.blocks.iter().map(Vec::as_slice)), "blocks come back");
        }
    }
}
