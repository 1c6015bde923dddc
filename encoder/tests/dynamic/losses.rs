//! Lost units of profile Dynamic: what remains is what clause 7.20 says, compared with what is decoded at the
//! operating points, and with a model of the clause that knows nothing of the decoder.

use crate::common::dynamic::{Arrival, Whole, arrived, predicted, range, scene, units};
use crate::common::remains::{assert_remains, remains};
use crate::common::{Random, decoded, encoded, strict};
use splatstream_decoder::process::{Decoder, Options};
use splatstream_encoder::{Settings, Structure, Tools};
use splatstream_format::Limits;
use splatstream_format::syntax::{FrameType, UnitHeader, UnitType};
use splatstream_format::unit::{Stream, Unit};
use splatstream_scene::builtin::Tracking;
use std::collections::BTreeSet;

const TOLERANT: fn() -> Options = || Options { tolerant: true, ..strict() };

/// Seven frames in GOPs of five, untracked so that every kind of section is used.
fn stream(spatial_layers: u8, temporal_layers: u8) -> Vec<u8> {
    let settings = Settings { gop: 5, spatial_layers, ..predicted(temporal_layers) };
    encoded(scene(150, 7, 1, Tracking::Untracked), &settings).0
}

/// Decodes what arrives and compares it with what shall be left.
fn check(whole: &Whole<'_>, arrival: impl Fn(&UnitHeader) -> Arrival, what: &str) {
    let (frames, _) = decoded(&arrived(whole.bytes, &arrival), &TOLERANT());
    assert_remains(&frames, &remains(whole, &arrival, false), what);
}

// covers: SS-LO-001, SS-LO-002, SS-LO-003, SS-LO-004, SS-LO-005, SS-BS-012
#[test]
fn every_increment_removed_or_damaged_in_turn_leaves_what_the_clauses_say() {
    for (spatial, temporal) in [(1, 1), (1, 3), (2, 2), (3, 1)] {
        let bytes = stream(spatial, temporal);
        let whole = Whole::new(&bytes);
        for lost in whole.increments() {
            for how in [Arrival::Missing, Arrival::Damaged] {
                let arrival = |header: &UnitHeader| if *header == lost { how } else { Arrival::Intact };
                let unit = (lost.frame, lost.spatial_layer, lost.refinement);
                check(&whole, arrival, &format!("S {spatial}, T {temporal}: {how:?} {unit:?}"));
            }
        }
    }
}

// covers: SS-LO-002, SS-LO-004
#[test]
fn random_sets_of_predicted_units_and_frames_leave_what_the_clauses_say() {
    let mut random = Random(5);
    for (spatial, temporal) in [(1, 1), (1, 2), (1, 4), (2, 3)] {
        let bytes = stream(spatial, temporal);
        let whole = Whole::new(&bytes);
        let first: BTreeSet<u32> = whole.gops.iter().map(|(first, _)| *first).collect();
        for round in 0..25 {
            let fate = |random: &mut Random| match random.below(12) {
                0 | 1 => Arrival::Damaged,
                2 => Arrival::Missing,
                _ => Arrival::Intact,
            };
            let absent: BTreeSet<u32> =
                (0..7).filter(|frame| !first.contains(frame) && random.below(6) == 0).collect();
            let fates: Vec<_> =
                whole.increments().into_iter().map(|header| (header, fate(&mut random))).collect();
            let arrival = |header: &UnitHeader| {
                let kind = header.unit_type();
                if kind == UnitType::FrameHeader && absent.contains(&header.frame) {
                    return Arrival::Missing;
                }
                let known = fates.iter().find(|(known, _)| known == header);
                match known {
                    Some(_) if absent.contains(&header.frame) => Arrival::Missing,
                    Some((_, fate)) if !first.contains(&header.frame) => *fate,
                    _ => Arrival::Intact,
                }
            };
            check(&whole, arrival, &format!("S {spatial}, T {temporal}: round {round}"));
        }
    }
}

#[test]
fn frames_of_a_temporal_layer_that_never_come_change_nothing_else() {
    let bytes = stream(1, 3);
    let whole = Whole::new(&bytes);
    for most in 0..3 {
        let arrival = |header: &UnitHeader| {
            if header.temporal_layer > most { Arrival::Missing } else { Arrival::Intact }
        };
        check(&whole, arrival, &format!("temporal layers above {most}"));
        assert!(remains(&whole, arrival, false).iter().all(|left| !left.lost && left.level == 3));
    }
}

/// What a frozen frame repeats: the last state it would have referred to, compensation included.
// covers: SS-LO-004, SS-CA-003
#[test]
fn a_frozen_frame_repeats_the_output_of_its_reference() {
    // Compensation is for new Gaussians only.
    let tools = Tools { survivors: false, ..Tools::default() };
    let frames = scene(150, 5, 0, Tracking::Tracked);
    let bytes = with_compensation(&encoded(frames, &Settings { tools, ..predicted(1) }).0, [3, -2]);
    let (whole, summary) = decoded(&bytes, &strict());
    assert_eq!(summary.end, None, "compensation is not part of any digest");
    // Frame 1 has unit 0 alone, frame 2 loses even that one.
    let arrival = |header: &UnitHeader| {
        let increment = header.unit_type() == UnitType::Increment;
        let lost = increment && (header.frame == 1 && header.refinement > 0 || header.frame == 2);
        if lost { Arrival::Missing } else { Arrival::Intact }
    };
    let (frames, _) = decoded(&arrived(&bytes, arrival), &TOLERANT());
    let shown: Vec<_> = frames.iter().map(|frame| frame.clone().into_shown()).collect();
    assert!(shown[1] != frames[1].planes, "compensation applies to frame 1");
    assert!(frames[2].lost.is_some() && frames[1].planes != whole[1].planes);
    assert!(shown[2] == shown[1], "a frozen frame");
    assert!(shown[3] == shown[1], "what refers to a frozen frame");
    assert_eq!(frames[3].frame_type, FrameType::Predicted);
}

/// The stream with compensation in all increments, sealed again.
fn with_compensation(bytes: &[u8], values: [i8; 2]) -> Vec<u8> {
    let mut out = bytes.to_vec();
    for unit in units(bytes).iter().filter(|unit| unit.header.unit_type() == UnitType::Increment) {
        let range = range(unit);
        let table = splatstream_format::syntax::IncrementHeader::TABLE;
        let at = range.start + UnitHeader::SIZE + table.offset("compensation_log_scale");
        out[at..at + 2].copy_from_slice(&values.map(i8::cast_unsigned));
        let header = UnitHeader::new(unit.header.id(), &out[range.start + UnitHeader::SIZE..range.end]);
        out[range.start..range.start + UnitHeader::SIZE]
            .copy_from_slice(&header.unwrap().to_bytes().unwrap());
    }
    out
}

// covers: SS-LO-005
#[test]
fn a_strict_decoder_stops_where_a_tolerant_one_reports_the_first_loss() {
    let bytes = stream(2, 2);
    let whole = Whole::new(&bytes);
    for lost in whole.increments() {
        for how in [Arrival::Missing, Arrival::Damaged] {
            let changed = arrived(&bytes, |header| if *header == lost { how } else { Arrival::Intact });
            let (frames, summary) = decoded(&changed, &TOLERANT());
            let verdict = frames.iter().find_map(|frame| frame.lost).or(summary.end);
            let (before, strict) = decoded(&changed, &strict());
            let unit = (lost.frame, lost.spatial_layer, lost.refinement);
            assert_eq!(strict.end, verdict, "{how:?} {unit:?}");
            assert!(before.iter().zip(&frames).all(|(a, b)| a == b), "{how:?} {unit:?}");
        }
    }
}

#[test]
fn decoding_starts_at_any_gop_header() {
    for structure in
        [Structure::Intra, Structure::Predicted { layers: 1 }, Structure::Predicted { layers: 3 }]
    {
        let settings = Settings { structure, gop: 3, spatial_layers: 2, ..predicted(1) };
        let (bytes, _) = encoded(scene(120, 8, 0, Tracking::Tracked), &settings);
        let whole = Whole::new(&bytes);
        assert!(whole.gops.len() >= 3);
        let stream = Stream::open(&bytes, &Limits::default()).unwrap();
        for (first, _) in &whole.gops {
            let mut decoder = Decoder::starting_inside(stream.header(), strict());
            let mut frames = Vec::new();
            let is_start = |unit: &&Unit<'_>| {
                unit.header.unit_type() == UnitType::GopHeader && unit.header.frame == *first
            };
            let start = whole.units.iter().find(is_start).unwrap().at;
            let here = |unit: &&Unit<'_>| {
                unit.header.unit_type() == UnitType::SequenceParameters || unit.at >= start
            };
            for unit in whole.units.iter().filter(here) {
                frames.extend(decoder.unit(unit).unwrap());
            }
            assert_eq!(frames, whole.all()[*first as usize..], "from frame {first}");
        }
    }
}

#[test]
fn a_lost_refinement_costs_no_other_gop_anything() {
    let bytes = stream(1, 2);
    let whole = Whole::new(&bytes);
    assert!(whole.gops.len() > 1);
    let second = whole.gops[1].0;
    for lost in whole.increments().iter().filter(|header| header.frame < second) {
        let changed =
            arrived(&bytes, |header| if header == lost { Arrival::Damaged } else { Arrival::Intact });
        let (frames, _) = decoded(&changed, &TOLERANT());
        let later = |frame: &&splatstream_decoder::process::DecodedFrame| frame.number >= second;
        assert!(frames.iter().filter(later).eq(whole.all().iter().filter(later)));
    }
}
