//! Laws of the syntax of profile Dynamic, on streams that obey it.
#![cfg(feature = "arbitrary")]
#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "a panic is a failed test")]

use arbitrary::{Arbitrary, Unstructured};
use proptest::prelude::{ProptestConfig, any};
use proptest::{collection::vec, prop_assert, prop_assert_eq, proptest};
use splatstream_format::arbitrary_stream::dynamic::{ArbitraryIncrement, DynamicStream};
use splatstream_format::payload::{Increment, OperatingPoints, Weights};
use splatstream_format::syntax::{GopHeader, Profile, SequenceParameters, UnitType};
use splatstream_format::unit::{Stream, Unit};
use splatstream_format::{Limits, inspect::inspect};

fn stream(seed: &[u8]) -> DynamicStream {
    DynamicStream::arbitrary(&mut Unstructured::new(seed)).unwrap()
}

/// The increments of a stream in order.
fn increments(stream: &DynamicStream) -> impl Iterator<Item = &ArbitraryIncrement> {
    stream.gops.iter().flat_map(|gop| &gop.frames).flat_map(|frame| &frame.increments)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    // covers: SS-IN-001, SS-IN-002
    #[test]
    fn increments_are_read_as_they_were_written(seed in vec(any::<u8>(), 0..4000)) {
        let made = stream(&seed);
        let bytes = made.to_bytes().unwrap();
        let limits = Limits::default();
        let opened = Stream::open(&bytes, &limits).unwrap();
        prop_assert_eq!(opened.header().profile(), Profile::Dynamic);
        let units: Vec<Unit<'_>> = opened.units().map(Result::unwrap).collect();
        let of_type = |kind: UnitType| units.iter().filter(move |unit| unit.header.unit_type() == kind);
        let first = of_type(UnitType::SequenceParameters).next().unwrap();
        let read = SequenceParameters::parse_payload(first.payload, first.payload_at, Profile::Dynamic);
        prop_assert_eq!(read, Ok(made.sequence));
        let gops = of_type(UnitType::GopHeader)
            .map(|unit| GopHeader::parse_payload(unit.payload, unit.payload_at, Profile::Dynamic).unwrap());
        prop_assert!(gops.eq(made.gops.iter().map(|gop| gop.header)));
        let weights = of_type(UnitType::Weights)
            .map(|unit| Weights::parse(unit.payload, unit.payload_at).unwrap());
        prop_assert!(weights.eq(made.gops.iter().filter_map(|gop| gop.weights.clone())));
        prop_assert_eq!(of_type(UnitType::Increment).count(), increments(&made).count());
        for (unit, made_of) in of_type(UnitType::Increment).zip(increments(&made)) {
            let place = (unit.header.spatial_layer, unit.header.refinement);
            prop_assert_eq!(place, (made_of.spatial_layer, made_of.refinement));
            unit.header.validate_layers(unit.at, &made.sequence).unwrap();
            let read = Increment::parse(unit.payload, unit.payload_at, &made.sequence, &limits).unwrap();
            prop_assert_eq!(read.header, made_of.header);
            prop_assert_eq!(read.sections.len(), made_of.sections.len());
            for (read, made_of) in read.sections.iter().zip(&made_of.sections) {
                prop_assert_eq!((read.lanes_log2, read.model), (made_of.lanes_log2, made_of.model.as_slice()));
                let blocks = read.blocks.iter().map(|(block, _)| *block);
                prop_assert!(blocks.eq(made_of.blocks.iter().map(Vec::as_slice)));
            }
        }
        let list = of_type(UnitType::OperatingPoints).next();
        let list = list.map(|unit| OperatingPoints::parse(unit.payload, unit.payload_at).unwrap().entries);
        prop_assert_eq!(list, made.points);
    }

    #[test]
    fn the_inspector_shows_every_bit_and_finds_no_fault(seed in vec(any::<u8>(), 0..4000)) {
        let bytes = stream(&seed).to_bytes().unwrap();
        let (mut next, mut gap) = (0, None);
        let error = inspect(&bytes, &Limits::default(), &mut |element| {
            if element.at_bit != next {
                gap = gap.take().or(Some(element.clone()));
            }
            next = element.at_bit + element.bits;
        });
        prop_assert_eq!(error, None);
        prop_assert!(gap.is_none(), "{gap:?} does not start where the element before ends");
        prop_assert_eq!(next, bytes.len() as u64 * 8);
    }

    #[test]
    fn a_changed_stream_is_read_without_a_panic(
        seed in vec(any::<u8>(), 0..3000),
        changes in vec(any::<(usize, u8)>(), 1..5),
    ) {
        let mut bytes = stream(&seed).to_bytes().unwrap();
        for (place, value) in changes {
            let place = place % bytes.len();
            bytes[place] = value;
        }
        inspect(&bytes, &Limits::default(), &mut |_| ());
    }
}
