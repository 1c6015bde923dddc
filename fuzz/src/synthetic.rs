//! Streams that obey the syntax: they come back as they were written, and decoding them, through sections that are right
//! up to their values or not at all, keeps its laws.

use crate::decode::choice;
use crate::{LIMITS, laws};
use arbitrary::{Arbitrary, Unstructured};
use splatstream_format::arbitrary_stream::{
    ArbitraryFrame, ArbitraryGop, ArbitraryIncrement, ArbitraryStream,
};
use splatstream_format::payload::{
    Codebook, FramePayload, Increment, OperatingPoints, SceneDescription, SectionBytes, Transform, Weights,
};
use splatstream_format::syntax::{GopHeader, Profile, SequenceParameters, UnitType};
use splatstream_format::unit::{Stream, Unit, Units};

/// The input is what the stream is made of.
pub fn run(data: &[u8]) {
    // Fails only where the bytes do not suffice.
    let Ok(stream) = ArbitraryStream::arbitrary(&mut Unstructured::new(data)) else { return };
    let bytes = stream.to_bytes().expect("a valid stream can be written");
    comes_back(&stream, &bytes);
    laws::hold(&bytes, choice(data));
}

/// Unit by unit what was written.
fn comes_back(made: &ArbitraryStream, bytes: &[u8]) {
    let stream = Stream::open(bytes, &LIMITS).expect("it starts with a file header");
    assert_eq!((stream.header().profile(), stream.header().level), (made.profile, made.level));
    let (profile, sequence) = (made.profile, &made.sequence);
    let mut left = Left { units: stream.units(), profile, sequence };
    left.sequence();
    if let Some(scene) = &made.scene {
        let unit = left.next(UnitType::SceneDescription);
        assert_eq!(SceneDescription::parse(unit.payload, unit.payload_at).as_ref(), Ok(scene));
    }
    made.gops.iter().for_each(|made| left.gop(made));
    if let Some(points) = &made.points {
        let unit = left.next(UnitType::OperatingPoints);
        let read = OperatingPoints::parse(unit.payload, unit.payload_at).expect("a list");
        assert_eq!(read.entries, *points);
    }
    if made.has_index {
        left.next(UnitType::Index);
    }
    left.next(UnitType::End);
    assert_eq!(left.units.next(), None);
}

/// The units that are not yet compared. What differs is a panic.
struct Left<'a, 'm> {
    units: Units<'a>,
    profile: Profile,
    sequence: &'m SequenceParameters,
}

impl<'a> Left<'a, '_> {
    /// The next unit, which is of the type expected.
    fn next(&mut self, expected: UnitType) -> Unit<'a> {
        let unit = self.units.next().expect("there are more units").expect("units are intact");
        assert_eq!(unit.header.unit_type(), expected);
        unit
    }

    fn sequence(&mut self) {
        let unit = self.next(UnitType::SequenceParameters);
        let read = SequenceParameters::parse_payload(unit.payload, unit.payload_at, self.profile);
        assert_eq!(read.as_ref(), Ok(self.sequence));
    }

    fn gop(&mut self, made: &ArbitraryGop) {
        if made.repeats_sequence {
            self.sequence();
        }
        let unit = self.next(UnitType::GopHeader);
        let read = GopHeader::parse_payload(unit.payload, unit.payload_at, self.profile);
        assert_eq!(read, Ok(made.header));
        if let Some(private) = &made.private {
            assert_eq!(self.next(UnitType::User(200)).payload, private);
        }
        for transform in &made.transforms {
            let unit = self.next(UnitType::Transform);
            let read = Transform::parse(unit.payload, unit.payload_at, self.sequence);
            assert_eq!(read.as_ref(), Ok(transform));
        }
        if let Some(weights) = &made.weights {
            let unit = self.next(UnitType::Weights);
            assert_eq!(Weights::parse(unit.payload, unit.payload_at).as_ref(), Ok(weights));
        }
        made.frames.iter().for_each(|made| self.frame(made));
    }

    fn frame(&mut self, made: &ArbitraryFrame) {
        for made in &made.codebooks {
            let unit = self.next(UnitType::Codebook);
            let read = Codebook::parse(unit.payload, unit.payload_at, &LIMITS);
            assert_eq!(read.as_ref(), Ok(&made.codebook));
            assert_eq!(unit.header.temporal_layer, made.temporal_layer);
        }
        let unit = self.next(UnitType::FrameHeader);
        let read = FramePayload::parse(unit.payload, unit.payload_at, self.sequence, &LIMITS);
        let read = read.expect("a frame header");
        // The writer says in the flags what follows.
        assert_eq!(
            (read.header.gaussian_count, read.carried_digest),
            (made.header.gaussian_count, made.carried_digest)
        );
        assert_eq!(read.cells.is_some(), made.cells.is_some());
        if let (Some(read), Some(made)) = (&read.cells, &made.cells) {
            assert_eq!((read.coded.count, read.cell_log2), (made.cell_count, made.cell_log2));
            is_section(&read.coded.blocks, read.coded.model, &made.section);
        }
        made.increments.iter().for_each(|made| self.increment(made));
    }

    fn increment(&mut self, made: &ArbitraryIncrement) {
        let unit = self.next(UnitType::Increment);
        assert_eq!(
            (unit.header.spatial_layer, unit.header.refinement),
            (made.spatial_layer, made.refinement)
        );
        let read = Increment::parse(unit.payload, unit.payload_at, self.sequence, self.profile, &LIMITS);
        let read = read.expect("an increment");
        assert_eq!((read.header, read.sections.len()), (made.header, made.sections.len()));
        for (read, made) in read.sections.iter().zip(&made.sections) {
            assert_eq!(read.lanes_log2, made.lanes_log2);
            is_section(&read.blocks, read.model, made);
        }
    }
}

fn is_section(blocks: &[(&[u8], u64)], model: &[u8], made: &SectionBytes) {
    assert_eq!(model, made.model);
    let blocks = blocks.iter().map(|(block, _)| *block);
    assert!(blocks.eq(made.blocks.iter().map(Vec::as_slice)), "blocks come back");
}
