//! Laws of the syntax: what is written is read back, what is read is written back, and nothing panics.
#![cfg(feature = "arbitrary")]
#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "a panic is a failed test")]

mod sample;

use arbitrary::{Arbitrary, Unstructured};
use proptest::prelude::{ProptestConfig, any};
use proptest::{collection::vec, prop_assert, prop_assert_eq, proptest};
use splatstream_format::arbitrary_stream::{self as random, ArbitraryIncrement, ArbitraryStream};
use splatstream_format::payload::{
    Codebook, CodedSection, FramePayload, Increment, Index, Layer, Network, OperatingPoints, Part,
    SceneDescription, SectionBytes, Transform, Weights, leb128, write_increment, write_leb128,
};
use splatstream_format::syntax::{
    CodebookHeader, EndOfStream, FileHeader, FixedRecord, FrameHeader, GopHeader, IncrementHeader,
    IndexEntry, IndexHeader, ListSizes, NetworkHeader, Profile, SceneDescriptionHeader, SequenceParameters,
    TransformKind, UnitHeader, UnitId, UnitType, WeightsHeader,
};
use splatstream_format::unit::{Landmark, Stream, Unit};
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
            changed in 0..$Record::SIZE,
            value: u8,
        ) {
            // Close to valid, or anything.
            let mut raw = if valid { near(&seed) } else { seed };
            raw.resize($Record::SIZE, 0);
            raw[changed] = value;
            let record = $Record::take(&mut &raw[..]).unwrap();
            let read: Result<$Record> = $parse(&raw);
            prop_assert_eq!(read.map(|_| raw.clone()), record.to_bytes());
            let mut written = Vec::new();
            record.put(&mut written);
            prop_assert_eq!(written, raw);
        }
    )+ } };
}

/// Bytes of a sequence_parameters record that is accepted; other records find small numbers in them.
fn near(seed: &[u8]) -> Vec<u8> {
    made(seed, |u| random::sequence_parameters(u, Profile::Dynamic)).to_bytes().unwrap()
}

reading_and_writing_refuse_alike! {
    file_headers FileHeader(|raw: &[u8]| FileHeader::parse(raw).map(|(record, _)| record));
    unit_headers UnitHeader(|raw: &[u8]| UnitHeader::parse(raw, 0).map(|(record, _)| record));
    sequence_parameters SequenceParameters(|raw: &[u8]| SequenceParameters::parse_payload(raw, 0, Profile::Dynamic));
    gop_headers GopHeader(|raw: &[u8]| GopHeader::parse_payload(raw, 0, Profile::Dynamic));
    frame_headers FrameHeader(|raw: &[u8]| FrameHeader::parse_payload(raw, 0));
    codebook_headers CodebookHeader(|raw: &[u8]| CodebookHeader::parse_payload(raw, 0));
    index_headers IndexHeader(|raw: &[u8]| IndexHeader::parse_payload(raw, 0));
    index_entries IndexEntry(|raw: &[u8]| IndexEntry::parse_payload(raw, 0));
    end_units EndOfStream(|raw: &[u8]| EndOfStream::parse_payload(raw, 0));
    scene_headers SceneDescriptionHeader(|raw: &[u8]| SceneDescriptionHeader::parse_payload(raw, 0));
    weights_headers WeightsHeader(|raw: &[u8]| WeightsHeader::parse_payload(raw, 0));
}

proptest! {
    #[test]
    fn sequence_parameters_come_back(seed in vec(any::<u8>(), 0..200), at in 0..u64::MAX / 2) {
        let sequence = made(&seed, |u| random::sequence_parameters(u, Profile::Dynamic));
        let bytes = sequence.to_bytes().unwrap();
        prop_assert_eq!(SequenceParameters::parse_payload(&bytes, at, Profile::Dynamic), Ok(sequence));
    }

    #[test]
    fn transforms_come_back(seed in vec(any::<u8>(), 0..600), sh: bool, id in 0_u8..16) {
        let mut u = Unstructured::new(&seed);
        let sequence = random::sequence_parameters(&mut u, Profile::Dynamic).unwrap();
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
    fn scene_descriptions_come_back(seed in vec(any::<u8>(), 0..600), at in 0..u64::MAX / 2) {
        let scene = made(&seed, random::scene_description);
        let bytes = scene.to_bytes().unwrap();
        prop_assert_eq!(SceneDescription::parse(&bytes, at), Ok(scene));
    }

    // covers: SS-IN-001
    #[test]
    fn headers_of_increments_are_refused_alike_when_read_and_when_written(
        seed in vec(any::<u8>(), 0..40),
        flags: u16,
        digest: u64,
        predicted: bool,
        at in 0..u64::MAX / 2,
    ) {
        let sequence = sample::sequence();
        let profile = if predicted { Profile::Dynamic } else { Profile::Intra };
        let bytes = [&(flags & 0x3FF).to_le_bytes()[..], &digest.to_le_bytes(), &seed].concat();
        let Ok((header, rest)) = IncrementHeader::parse(&bytes, at, &sequence, profile) else { return Ok(()) };
        let size = bytes.len() - rest.len();
        prop_assert_eq!(header.size(), size);
        prop_assert_eq!(header.to_bytes(&sequence).unwrap(), &bytes[..size]);
        // The fewest flags are enough, and none of them can be spared.
        let least = header.with_flags();
        prop_assert_eq!(least.increment_flags & !header.increment_flags, 0);
        let written = least.to_bytes(&sequence).unwrap();
        prop_assert_eq!(IncrementHeader::parse(&written, at, &sequence, profile), Ok((least, &[][..])));
        for bit in (0..10).map(|bit| 1 << bit).filter(|bit| least.increment_flags & bit != 0) {
            let spared = IncrementHeader { increment_flags: least.increment_flags & !bit, ..least };
            prop_assert_eq!(spared.to_bytes(&sequence).unwrap_err().kind.code(), "CONSTRAINT");
        }
        let new_at = if header.new_count > 0 { header.at(at, "new_count") } else { at };
        let sizes = ListSizes {
            parents: header.parent_count,
            intra: header.remove_count == 0,
            size: Some(header.list_size().wrapping_add(1)),
            max_size: u32::MAX,
        };
        let most = header.move_count.max(header.update_count).max(header.remove_count);
        if most <= header.parent_count {
            prop_assert_eq!(header.validate_counts(at, &sizes).unwrap_err().at, new_at);
            let sizes = ListSizes { size: None, ..sizes };
            prop_assert_eq!(header.validate_counts(at, &sizes), Ok(()));
        }
    }

    #[test]
    fn indexes_come_back(steps in vec(any::<(u16, u32)>(), 0..20)) {
        let mut at = (0, 0);
        let entries = steps.into_iter().map(|(frames, bytes)| {
            at = (at.0 + 1 + u32::from(frames), at.1 + 1 + u64::from(bytes));
            at
        });
        let entry = |(frame, offset)| IndexEntry { frame, reserved_zero: 0, offset };
        let index = Index { entries: entries.map(entry).collect() };
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
        changed in 0..NetworkHeader::SIZE,
        value: u8,
        spare in 0..3_usize,
    ) {
        let Weights::Carried(network) = made(&seed, random::weights) else { return Ok(()) };
        let mut raw = network.to_bytes().unwrap()[..NetworkHeader::SIZE].to_vec();
        raw[changed] = value;
        let header = NetworkHeader::take(&mut &raw[..]).unwrap();
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
        let layer = &mut layers[changed % 11];
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

    // covers: SS-RU-001
    #[test]
    fn prefixes_grow_to_the_whole_frame(seed in vec(any::<u8>(), 0..200), gaussians: u32) {
        let sequence = made(&seed, |u| random::sequence_parameters(u, Profile::Dynamic));
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
        let _ = FramePayload::parse(&bytes, u64::MAX, &sequence, &limits);
        let _ = SceneDescription::parse(&bytes, u64::MAX);
        let _ = Landmark::GopHeader.find(&bytes, 0);
        let _ = Index::parse(&bytes, u64::MAX);
        let _ = Increment::parse(&bytes, u64::MAX, &sequence, Profile::Dynamic, &limits);
        let _ = OperatingPoints::parse(&bytes, u64::MAX);
        let _ = Weights::parse(&bytes, u64::MAX);
        // After a good beginning.
        let mut units = sample::units();
        units.insert(sample::INCREMENT, (UnitId::stream(UnitType::from_code(unit_type)), bytes));
        for profile in [Profile::Intra, Profile::Dynamic] {
            inspect(&sample::stream_of(profile, &units), &limits, &mut |_| ());
        }
    }
}

/// A section as it is written.
fn section(coded: &CodedSection<'_>) -> SectionBytes {
    SectionBytes {
        lanes_log2: coded.lanes_log2,
        model: coded.model.to_vec(),
        blocks: coded.blocks.iter().map(|(block, _)| block.to_vec()).collect(),
    }
}

/// The increments of a stream in order.
fn increments(stream: &ArbitraryStream) -> impl Iterator<Item = &ArbitraryIncrement> {
    stream.gops.iter().flat_map(|gop| &gop.frames).flat_map(|frame| &frame.increments)
}

// covers: SS-IN-005, SS-IN-006, SS-IN-007, SS-PA-006
#[test]
fn counts_fit_the_parents_and_the_list() {
    let header = IncrementHeader { parent_count: 300, move_count: 9, new_count: 4, ..IncrementHeader::PLAIN };
    let sizes = ListSizes { parents: 300, intra: true, size: Some(304), max_size: 304 };
    let refused = |header: IncrementHeader, sizes: ListSizes| {
        let error = header.with_flags().validate_counts(100, &sizes).err();
        error.map(|error| (error.kind.code(), error.at))
    };
    assert_eq!(refused(header, sizes), None);
    assert_eq!(refused(header, ListSizes { parents: 301, ..sizes }), Some(("MISMATCH", 110)));
    assert_eq!(refused(header, ListSizes { size: None, max_size: 303, ..sizes }), Some(("MISMATCH", 113)));
    assert_eq!(refused(IncrementHeader { move_count: 301, ..header }, sizes), Some(("MISMATCH", 112)));
    assert_eq!(refused(IncrementHeader { update_count: 301, ..header }, sizes), Some(("MISMATCH", 113)));
    let removing = IncrementHeader { remove_count: 4, new_count: 8, ..header };
    assert_eq!(refused(removing, sizes), Some(("MISMATCH", 113)));
    assert_eq!(refused(removing, ListSizes { intra: false, ..sizes }), None);
    // Without new Gaussians the flags stand for them.
    let shorter = IncrementHeader { new_count: 0, ..header };
    assert_eq!(refused(shorter, sizes), Some(("MISMATCH", 100)));
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
        let is_critical = matches!(code, 1..=6 | 8 | 9);
        assert_eq!(unit_type.is_critical(), is_critical);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    // covers: SS-BS-011
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

    // covers: SS-IN-011
    #[test]
    fn units_are_read_as_they_were_written(seed in vec(any::<u8>(), 0..6000)) {
        let made = stream(&seed);
        let bytes = made.to_bytes().unwrap();
        let limits = Limits::default();
        let opened = Stream::open(&bytes, &limits).unwrap();
        let profile = made.profile;
        prop_assert_eq!(opened.header().profile(), profile);
        let units: Vec<Unit<'_>> = opened.units().map(Result::unwrap).collect();
        let of_type = |kind: UnitType| units.iter().filter(move |unit| unit.header.unit_type() == kind);
        let first = of_type(UnitType::SequenceParameters).next().unwrap();
        let read = SequenceParameters::parse_payload(first.payload, first.payload_at, profile);
        prop_assert_eq!(read, Ok(made.sequence));
        let gops = of_type(UnitType::GopHeader)
            .map(|unit| GopHeader::parse_payload(unit.payload, unit.payload_at, profile).unwrap());
        prop_assert!(gops.eq(made.gops.iter().map(|gop| gop.header)));
        let weights = of_type(UnitType::Weights)
            .map(|unit| Weights::parse(unit.payload, unit.payload_at).unwrap());
        prop_assert!(weights.eq(made.gops.iter().filter_map(|gop| gop.weights.clone())));
        prop_assert_eq!(of_type(UnitType::Increment).count(), increments(&made).count());
        for (unit, made_of) in of_type(UnitType::Increment).zip(increments(&made)) {
            let layer_and_list = (unit.header.spatial_layer, unit.header.refinement);
            prop_assert_eq!(layer_and_list, (made_of.spatial_layer, made_of.refinement));
            unit.header.validate_layers(unit.at, &made.sequence).unwrap();
            let read = Increment::parse(unit.payload, unit.payload_at, &made.sequence, profile, &limits).unwrap();
            prop_assert_eq!(read.header, made_of.header);
            prop_assert!(read.sections.iter().map(section).eq(made_of.sections.iter().cloned()));
            for coded in &read.sections {
                let at = |offset: u64| usize::try_from(offset).unwrap();
                prop_assert_eq!(&bytes[at(coded.model_at)..][..coded.model.len()], coded.model);
                for (block, block_at) in &coded.blocks {
                    prop_assert_eq!(&bytes[at(*block_at)..][..block.len()], *block);
                }
            }
            prop_assert_eq!(write_increment(&read.header, &made.sequence, &made_of.sections).unwrap(), unit.payload);
        }
        let frames = made.gops.iter().flat_map(|gop| &gop.frames);
        for (unit, made_of) in of_type(UnitType::FrameHeader).zip(frames) {
            let read = FramePayload::parse(unit.payload, unit.payload_at, &made.sequence, &limits).unwrap();
            prop_assert_eq!(read.header.gaussian_count, made_of.header.gaussian_count);
            prop_assert_eq!(read.carried_digest, made_of.carried_digest);
            let cells = read.cells.as_ref().map(|cells| (cells.cell_log2, section(&cells.coded)));
            let made_of = made_of.cells.as_ref().map(|cells| (cells.cell_log2, cells.section.clone()));
            prop_assert_eq!(cells, made_of);
        }
        let list = of_type(UnitType::OperatingPoints).next();
        let list = list.map(|unit| OperatingPoints::parse(unit.payload, unit.payload_at).unwrap().entries);
        prop_assert_eq!(list, made.points);
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
        for (offset, value) in changes {
            let offset = offset % bytes.len();
            bytes[offset] = value;
        }
        if seal {
            sample::seal_file_header(&mut bytes);
            sample::seal_unit_header(&mut bytes, sample::FILE_HEADER);
        }
        inspect(&bytes, &Limits::default(), &mut |_| ());
    }
}
