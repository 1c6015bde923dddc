//! Streams of profile Dynamic that obey the syntax: they come back as they were written, and decoding them, through
//! sections that are right up to their values or not at all, keeps its laws.

use crate::decode::choice;
use crate::read_back::ReadBack;
use crate::{LIMITS, laws};
use arbitrary::{Arbitrary, Unstructured};
use splatstream_format::arbitrary_stream::dynamic::{ArbitraryIncrement, DynamicGop, DynamicStream};
use splatstream_format::payload::{Codebook, Increment, OperatingPoints, Weights};
use splatstream_format::syntax::{FrameHeader, GopHeader, Profile, SequenceParameters, UnitType};

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
    let start = (Profile::Dynamic, stream.level);
    let mut units = ReadBack::start(bytes, &LIMITS, start, &stream.sequence);
    stream.gops.iter().for_each(|made| gop(&mut units, made, &stream.sequence));
    if let Some(points) = &stream.points {
        let unit = units.next(UnitType::OperatingPoints);
        let read = OperatingPoints::parse(unit.payload, unit.payload_at).expect("a list");
        assert_eq!(read.entries, *points);
    }
    if stream.has_index {
        units.next(UnitType::Index);
    }
    units.end();
}

fn gop(units: &mut ReadBack<'_>, made: &DynamicGop, sequence: &SequenceParameters) {
    let unit = units.next(UnitType::GopHeader);
    let read = GopHeader::parse_payload(unit.payload, unit.payload_at, Profile::Dynamic);
    assert_eq!(read, Ok(made.header));
    units.transforms(&made.transforms, sequence);
    if let Some(weights) = &made.weights {
        let unit = units.next(UnitType::Weights);
        assert_eq!(Weights::parse(unit.payload, unit.payload_at).as_ref(), Ok(weights));
    }
    for frame in &made.frames {
        for made in &frame.codebooks {
            let unit = units.next(UnitType::Codebook);
            let read = Codebook::parse(unit.payload, unit.payload_at, &LIMITS);
            assert_eq!(read.as_ref(), Ok(&made.codebook));
            assert_eq!(unit.header.temporal_layer, made.temporal_layer);
        }
        let unit = units.next(UnitType::FrameHeader);
        let read = FrameHeader::parse_payload(unit.payload, unit.payload_at, Profile::Dynamic);
        assert_eq!(read, Ok(frame.header));
        frame.increments.iter().for_each(|made| increment(units, made, sequence));
    }
}

fn increment(units: &mut ReadBack<'_>, made: &ArbitraryIncrement, sequence: &SequenceParameters) {
    let unit = units.next(UnitType::Increment);
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
