//! Payloads: what is written is read, what is read is written, and any bytes are refused or read.

use crate::LIMITS;
use crate::headers::SEQUENCE;
use crate::read_back::ReadBack;
use arbitrary::{Arbitrary, Unstructured};
use splatstream_format::arbitrary_stream::{ArbitraryGop, ArbitraryStream, sequence_parameters};
use splatstream_format::entropy::layout::{Layout, ShCoding};
use splatstream_format::entropy::model::{read_models, write_models};
use splatstream_format::payload::{
    Codebook, Increment, Index, OperatingPoints, Refinement, SectionBytes, Transform, Weights,
    write_increment,
};
use splatstream_format::syntax::{Profile, SequenceParameters, UnitType};
use splatstream_format::{Limits, Result};

/// The first byte of the input chooses what the others are.
pub fn run(data: &[u8]) {
    let Some((choice, data)) = data.split_first() else { return };
    if choice % 9 == 0 {
        // Fails only where the bytes do not suffice.
        if let Ok(stream) = ArbitraryStream::arbitrary(&mut Unstructured::new(data)) {
            comes_back(&stream);
        }
        return;
    }
    let (head, payload) = data.split_at_checked(SEQUENCE).unwrap_or((data, &[]));
    let Ok(sequence) = sequence_parameters(&mut Unstructured::new(head)) else { return };
    match choice % 9 {
        1 => writes_back(payload, Transform::parse(payload, 0, &sequence), |read| read.to_bytes(&sequence)),
        2 => writes_back(payload, Codebook::parse(payload, 0, &LIMITS), Codebook::to_bytes),
        3 => writes_back(payload, Index::parse(payload, 0), Index::to_bytes),
        4 => {
            let read = Refinement::parse(payload, 0, &sequence, &LIMITS);
            writes_back(payload, read, |read| read.to_bytes(&sequence));
        }
        5 => models(payload),
        6 => writes_back(payload, Weights::parse(payload, 0), Weights::to_bytes),
        7 => writes_back(payload, OperatingPoints::parse(payload, 0), OperatingPoints::to_bytes),
        _ => {
            let read = Increment::parse(payload, 0, &sequence, &LIMITS);
            writes_back(payload, read, |read| written(read, &sequence));
        }
    }
}

/// What is accepted has one form.
fn writes_back<T>(payload: &[u8], read: Result<T>, write: impl FnOnce(&T) -> Result<Vec<u8>>) {
    if let Ok(read) = read {
        assert_eq!(write(&read).as_deref(), Ok(payload));
    }
}

/// The bytes of an increment that was read.
fn written(read: &Increment<'_>, sequence: &SequenceParameters) -> Result<Vec<u8>> {
    let sections = read.sections.iter().map(|section| SectionBytes {
        lanes_log2: section.lanes_log2,
        model: section.model.to_vec(),
        blocks: section.blocks.iter().map(|(block, _)| block.to_vec()).collect(),
    });
    write_increment(&read.header, sequence, &sections.collect::<Vec<_>>())
}

/// Models have several forms; the one that is written stands for the same models.
fn models(data: &[u8]) {
    let [dc_rank, coding, sh_rank, section @ ..] = data else { return };
    let (dc_rank, sh_rank) = (dc_rank % 3 + 1, sh_rank % 45 + 1);
    let coding = match coding % 3 {
        0 => ShCoding::None,
        1 => ShCoding::Coefficients { rank: sh_rank },
        _ => ShCoding::VectorQuantised { stages: sh_rank % 4 + 1 },
    };
    let alphabets = Layout::new(dc_rank, coding).alphabets();
    let first = vec![None; alphabets.len()];
    let Ok(models) = read_models(section, 0, &alphabets, &first, &mut ()) else { return };
    let written = write_models(&models, &alphabets, None);
    assert_eq!(read_models(&written, 0, &alphabets, &first, &mut ()).as_ref(), Ok(&models));
    let reused = write_models(&models, &alphabets, Some(&models));
    let reusable: Vec<_> = models.iter().map(Some).collect();
    assert_eq!(read_models(&reused, 0, &alphabets, &reusable, &mut ()).as_ref(), Ok(&models));
}

/// A stream that obeys the syntax is written, and read again unit by unit.
fn comes_back(stream: &ArbitraryStream) {
    let bytes = stream.to_bytes().expect("a valid stream can be written");
    let start = (Profile::Intra, stream.level);
    let mut units = ReadBack::start(&bytes, &Limits::default(), start, &stream.sequence);
    stream.gops.iter().for_each(|made| gop(&mut units, made, &stream.sequence));
    if stream.has_index {
        let index = units.next(UnitType::Index);
        let index = Index::parse(index.payload, index.payload_at).expect("an index");
        assert_eq!(index.entries.len(), stream.gops.len());
    }
    units.end();
}

fn gop(units: &mut ReadBack<'_>, made: &ArbitraryGop, sequence: &SequenceParameters) {
    units.next(UnitType::GopHeader);
    if let Some(private) = &made.private {
        assert_eq!(units.next(UnitType::User(200)).payload, private);
    }
    units.transforms(&made.transforms, sequence);
    for codebook in &made.codebooks {
        let unit = units.next(UnitType::Codebook);
        assert_eq!(Codebook::parse(unit.payload, unit.payload_at, &LIMITS).as_ref(), Ok(codebook));
    }
    for frame in &made.frames {
        assert_eq!(
            units.next(UnitType::FrameHeader).payload,
            frame.header.to_bytes().expect("a frame header")
        );
        for refinement in &frame.refinements {
            let unit = units.next(UnitType::Refinement);
            let read = Refinement::parse(unit.payload, unit.payload_at, sequence, &LIMITS);
            let read = read.expect("a refinement");
            assert_eq!((read.header, read.model), (refinement.header, refinement.model.as_slice()));
            let blocks = read.blocks.iter().map(|(block, _)| *block);
            assert!(blocks.eq(refinement.blocks.iter().map(Vec::as_slice)), "blocks come back");
        }
    }
}
