//! Laws of the syntax: what is written is read back, what is read is written back, and nothing panics.
#![cfg(feature = "arbitrary")]
#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "a panic is a failed test")]

mod sample;

use arbitrary::{Arbitrary, Unstructured};
use deku::{DekuContainerRead, DekuContainerWrite};
use proptest::prelude::{ProptestConfig, any};
use proptest::{collection::vec, prop_assert, prop_assert_eq, proptest};
use splatstream_format::arbitrary_stream::{self as random, ArbitraryStream};
use splatstream_format::payload::{
    Codebook, Increment, Index, Layer, Network, OperatingPoints, Part, Refinement, Transform, Weights,
    leb128, write_leb128,
};
use splatstream_format::syntax::{
    CodebookHeader, EndOfStream, FileHeader, FrameHeader, GopHeader, IndexEntry, IndexHeader, NetworkHeader,
    Profile, SequenceParameters, TransformKind, UnitHeader, UnitId, UnitType, WeightsHeader,
};
use splatstream_format::unit::Stream;
use splatstream_format::{Limits, Result, inspect::inspect};

/// A value made of random bytes; zeros follow where they end.
fn made<T>(seed: &[u8], make: impl FnOnce(&mut Unstructured<'_>) -> arbitrary::Result<T>) -> T {
    make(&mut Unstructured::new(seed)).unwrap()
}

/// A stream made of random bytes.
fn stream(seed: &[u8]) -> ArbitraryStream {
    ArbitraryStream::arbitrary(&mut Unstructured::new(seed)).unwrap()
}

/// A record that is refused when read is refused when written, for the same reason.
macro_rules! reading_and_writing_refuse_alike {
    ($($law:ident $Record:ident($parse:expr);)+) => { proptest! { $(
        // covers: SS-ER-001
        #[test]
        fn $law(
            valid in any::<bool>(),
            seed in vec(any::<u8>(), 0..200),
            place in 0..$Record::SIZE,
            value: u8,
        ) {
            // Close to valid, or anything.
            let mut raw = if valid { near(&seed) } else { seed };
            raw.resize($Record::SIZE, 0);
            raw[place] = value;
            let (_, record) = $Record::from_bytes((&raw, 0)).unwrap();
            let read: Result<$Record> = $parse(&raw);
            prop_assert_eq!(read.map(|_| raw.clone()), record.to_bytes());
            prop_assert_eq!(DekuContainerWrite::to_bytes(&record).unwrap(), raw);
        }
    )+ } };
}

/// Bytes of a sequence_parameters record that is accepted; other records find small numbers in them.
fn near(seed: &[u8]) -> Vec<u8> {
    made(seed, random::sequence_parameters).to_bytes().unwrap()
}

reading_and_writing_refuse_alike! {
    file_headers FileHeader(|raw: &[u8]| FileHeader::parse(raw).map(|(record, _)| record));
    unit_headers UnitHeader(|raw: &[u8]| UnitHeader::parse(raw, 0, Profile::Dynamic).map(|(record, _)| record));
    sequence_parameters SequenceParameters(|raw: &[u8]| SequenceParameters::parse_payload(raw, 0, Profile::Dynamic));
    gop_headers GopHeader(|raw: &[u8]| GopHeader::parse_payload(raw, 0, Profile::Dynamic));
    frame_headers FrameHeader(|raw: &[u8]| FrameHeader::parse_payload(raw, 0, Profile::Dynamic));
    codebook_headers CodebookHeader(|raw: &[u8]| CodebookHeader::parse_payload(raw, 0));
    index_headers IndexHeader(|raw: &[u8]| IndexHeader::parse_payload(raw, 0));
    index_entries IndexEntry(|raw: &[u8]| IndexEntry::parse_payload(raw, 0));
    end_units EndOfStream(|raw: &[u8]| EndOfStream::parse_payload(raw, 0));
    weights_headers WeightsHeader(|raw: &[u8]| WeightsHeader::parse_payload(raw, 0));
}

proptest! {
    #[test]
    fn sequence_parameters_come_back(seed in vec(any::<u8>(), 0..200), at in 0..u64::MAX / 2) {
        let sequence = made(&seed, random::sequence_parameters);
        let bytes = sequence.to_bytes().unwrap();
        prop_assert_eq!(SequenceParameters::parse_payload(&bytes, at, Profile::Intra), Ok(sequence));
    }

    #[test]
    fn transforms_come_back(seed in vec(any::<u8>(), 0..600), sh: bool, id in 0_u8..16) {
        let mut u = Unstructured::new(&seed);
        let sequence = random::sequence_parameters(&mut u).unwrap();
        let kind = if sh && sequence.sh_degree > 0 { TransformKind::Sh } else { TransformKind::Dc };
        let transform = random::transform(&mut u, id, kind, &sequence).unwrap();
        let bytes = transform.to_bytes(&sequence).unwrap();
        prop_assert_eq!(transform.rows().len(), usize::from(transform.header.rank));
        prop_assert_eq!(Transform::parse(&bytes, 7, &sequence), Ok(transform));
    }

    #[test]
    fn codebooks_come_back(seed in vec(any::<u8>(), 0..600), id in 0_u8..16, components in 1_u8..=45) {
        let codebook = made(&seed, |u| random::codebook(u, id, components));
        let bytes = codebook.to_bytes().unwrap();
        prop_assert_eq!(codebook.rows().len(), codebook.header.entry_count() as usize);
        prop_assert_eq!(Codebook::parse(&bytes, 7, &Limits::default()), Ok(codebook));
    }

    #[test]
    fn refinements_come_back(seed in vec(any::<u8>(), 0..1000), gaussians in 0_u32..2000, at in 0..1_u64 << 60) {
        let mut u = Unstructured::new(&seed);
        let sequence = random::sequence_parameters(&mut u).unwrap();
        let written = random::refinement(&mut u, &sequence, gaussians, &[1, 2], true).unwrap();
        let bytes = written.to_bytes(&sequence).unwrap();
        let read = Refinement::parse(&bytes, at, &sequence, &Limits::default()).unwrap();
        prop_assert_eq!(read.to_bytes(&sequence), Ok(bytes.clone()));
        prop_assert_eq!((read.header, read.model), (written.header, written.model.as_slice()));
        let section = |at_section: u64, length: usize| {
            let start = usize::try_from(at_section - at).unwrap();
            &bytes[start..start + length]
        };
        prop_assert_eq!(section(read.model_at, read.model.len()), read.model);
        prop_assert_eq!(read.blocks.len(), written.blocks.len());
        for ((block, block_at), written) in read.blocks.iter().zip(&written.blocks) {
            prop_assert_eq!(block, written);
            prop_assert_eq!(section(*block_at, block.len()), *block);
        }
    }

    #[test]
    fn indexes_come_back(entries in vec(any::<(u32, u64)>(), 0..20)) {
        let entry = |(frame, offset)| IndexEntry { frame, reserved_zero: 0, offset };
        let index = Index { entries: entries.into_iter().map(entry).collect() };
        prop_assert_eq!(Index::parse(&index.to_bytes().unwrap(), 9), Ok(index));
    }

    #[test]
    fn weights_come_back(seed in vec(any::<u8>(), 0..600), at in 0..u64::MAX / 2) {
        let weights = made(&seed, random::weights);
        let bytes = weights.to_bytes().unwrap();
        prop_assert_eq!(Weights::parse(&bytes, at), Ok(weights));
    }

    // covers: SS-WT-001
    #[test]
    fn a_digest_comes_back_and_names_nothing_that_is_not_registered(digest: [u8; 32], at in 0..u64::MAX / 2) {
        let weights = Weights::Registered(digest);
        let bytes = weights.to_bytes().unwrap();
        prop_assert_eq!((bytes.len(), &bytes[1..]), (33, &digest[..]));
        prop_assert_eq!(Weights::parse(&bytes, at), Ok(weights.clone()));
        let error = weights.network(at).unwrap_err();
        prop_assert_eq!((error.kind.code(), error.at), ("RESERVED", at + 1));
    }

    // covers: SS-WT-003, SS-WT-004
    #[test]
    fn networks_are_refused_alike_when_read_and_when_made(
        seed in vec(any::<u8>(), 0..100),
        place in 0..NetworkHeader::SIZE,
        value: u8,
        spare in 0..3_usize,
    ) {
        let Weights::Carried(network) = made(&seed, random::weights) else { return Ok(()) };
        let mut raw = network.to_bytes().unwrap()[..NetworkHeader::SIZE].to_vec();
        raw[place] = value;
        let (_, header) = NetworkHeader::from_bytes((&raw, 0)).unwrap();
        // Sizes out of range are refused whatever is there: no need to have as much.
        let of = if header.validate(0).is_ok() { header } else { network.header };
        let layers = Part::ALL.map(|part| {
            let (weights, bias) = part.lengths(&of);
            Layer { weights: vec![-7; weights], bias: vec![300; bias] }
        });
        let parameters: usize = layers.iter().map(|layer| layer.weights.len() + 2 * layer.bias.len()).sum();
        raw.resize(NetworkHeader::SIZE + parameters, 0);
        let read = Network::parse(&raw, 0);
        let same = Network::new(header, layers.clone());
        prop_assert_eq!(read.as_ref().map(|read| read.header), same.as_ref().map(|made| made.header));
        // A value more or less in one of the parts.
        let mut layers = layers;
        let layer = &mut layers[place % 11];
        match spare {
            0 => layer.weights.push(1),
            1 => layer.bias.push(1),
            _ if layer.weights.pop().is_none() => layer.bias.push(1),
            _ => {}
        }
        let refused = Network::new(header, layers).unwrap_err().kind.code();
        prop_assert_eq!(refused, same.map_or_else(|error| error.kind.code(), |_| "CONSTRAINT"));
        if read.is_ok() {
            let parameters_at = NetworkHeader::SIZE as u64;
            raw.push(0);
            let error = Network::parse(&raw, 0).unwrap_err();
            prop_assert_eq!((error.kind.code(), error.at), ("TRAILING_BYTES", raw.len() as u64 - 1));
            raw.truncate(raw.len() - 2);
            let error = Network::parse(&raw, 0).unwrap_err();
            prop_assert_eq!((error.kind.code(), error.at), ("SHORT_SECTION", parameters_at));
        }
    }

    // covers: SS-RU-006
    #[test]
    fn prefixes_grow_to_the_whole_frame(seed in vec(any::<u8>(), 0..200), gaussians: u32) {
        let sequence = made(&seed, random::sequence_parameters);
        let added = (0..sequence.refinement_count).map(|r| sequence.refinement_length(r, gaussians));
        prop_assert_eq!(added.map(u64::from).sum::<u64>(), u64::from(gaussians));
        for (r, percent) in (0..sequence.refinement_count).zip(sequence.refinement_percent) {
            let prefix = u64::from(sequence.prefix_length(r, gaussians));
            let share = u64::from(percent) * u64::from(gaussians);
            prop_assert!(100 * prefix >= share && 100 * prefix < share + 100);
        }
    }

    #[test]
    fn a_number_comes_back_in_its_shortest_form(value: u32, tail: [u8; 3]) {
        let mut bytes = Vec::new();
        write_leb128(value, &mut bytes);
        let bits = u64::from(32 - value.leading_zeros());
        prop_assert_eq!(bytes.len() as u64, bits.div_ceil(7).max(1));
        bytes.extend(tail);
        prop_assert_eq!(leb128(&bytes, 0, "n", "4.3"), Ok((value, tail.as_slice())));
    }

    #[test]
    fn an_accepted_number_writes_back_to_the_same_bytes(bytes in vec(any::<u8>(), 0..7)) {
        if let Ok((value, rest)) = leb128(&bytes, 0, "n", "4.3") {
            let mut written = Vec::new();
            write_leb128(value, &mut written);
            prop_assert_eq!(written, &bytes[..bytes.len() - rest.len()]);
        }
    }

    #[test]
    fn any_bytes_are_read_without_a_panic(bytes in vec(any::<u8>(), 0..400), unit_type in 1_u8..=11) {
        inspect(&bytes, &Limits::default(), &mut |_| ());
        let sequence = sample::sequence();
        let limits = Limits::default();
        let _ = Transform::parse(&bytes, 0, &sequence);
        let _ = Codebook::parse(&bytes, 0, &limits);
        let _ = Refinement::parse(&bytes, u64::MAX, &sequence, &limits);
        let _ = Index::parse(&bytes, u64::MAX);
        let _ = Increment::parse(&bytes, u64::MAX, &sequence, &limits);
        let _ = OperatingPoints::parse(&bytes, u64::MAX);
        let _ = Weights::parse(&bytes, u64::MAX);
        // Behind a good beginning.
        let mut units = sample::units();
        units.insert(6, (UnitId::stream(UnitType::from_code(unit_type)), bytes));
        for profile in [Profile::Intra, Profile::Dynamic] {
            inspect(&sample::stream_of(profile, &units), &limits, &mut |_| ());
        }
    }
}

#[test]
fn every_code_of_a_unit_is_one_type() {
    for code in 0..=u8::MAX {
        let unit_type = UnitType::from_code(code);
        assert_eq!(unit_type.code(), code);
        let name = match code {
            0 => "forbidden",
            1..=11 => unit_type.name(),
            12..=127 => "reserved",
            128.. => "user",
        };
        assert_eq!((unit_type.name(), unit_type.is_known()), (name, matches!(code, 1..=11)));
        let in_intra = matches!(code, 1..=8 | 11);
        assert_eq!(unit_type.is_known_in(Profile::Intra), in_intra);
        assert_eq!(unit_type.is_known_in(Profile::Dynamic), unit_type.is_known());
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    // covers: SS-BS-007
    #[test]
    fn an_arbitrary_stream_is_accepted(seed in vec(any::<u8>(), 0..6000)) {
        let stream = stream(&seed);
        let bytes = stream.to_bytes().unwrap();
        prop_assert_eq!(inspect(&bytes, &Limits::default(), &mut |_| ()), None);
        let units: Result<Vec<_>> = Stream::open(&bytes, &Limits::default()).unwrap().units().collect();
        let units = units.unwrap();
        let last = units.last().unwrap();
        let end = EndOfStream::parse_payload(last.payload, last.payload_at).unwrap();
        let frames = units.iter().filter(|unit| unit.header.unit_type() == UnitType::FrameHeader).count();
        prop_assert_eq!(end.frame_count as usize, frames);
        prop_assert_eq!(end.unit_count as usize, units.len() - 1);
        let index = units.iter().find(|unit| unit.header.unit_type() == UnitType::Index);
        prop_assert_eq!(end.index_offset, index.map_or(0, |unit| unit.at));
    }

    #[test]
    fn the_elements_of_a_stream_are_all_its_bits_in_order(seed in vec(any::<u8>(), 0..6000)) {
        let bytes = stream(&seed).to_bytes().unwrap();
        let mut next = 0;
        let mut gap = None;
        inspect(&bytes, &Limits::default(), &mut |element| {
            if element.at_bit != next {
                gap = gap.take().or(Some(element.clone()));
            }
            next = element.at_bit + element.bits;
        });
        prop_assert!(gap.is_none(), "{gap:?} does not start where the element before ends");
        prop_assert_eq!(next, bytes.len() as u64 * 8);
    }

    #[test]
    fn a_changed_arbitrary_stream_is_read_without_a_panic(
        seed in vec(any::<u8>(), 0..4000),
        changes in vec(any::<(usize, u8)>(), 1..5),
        seal: bool,
    ) {
        let mut bytes = stream(&seed).to_bytes().unwrap();
        for (place, value) in changes {
            let place = place % bytes.len();
            bytes[place] = value;
        }
        if seal {
            sample::seal_file_header(&mut bytes);
            sample::seal_unit_header(&mut bytes, sample::FILE_HEADER);
        }
        inspect(&bytes, &Limits::default(), &mut |_| ());
    }
}
