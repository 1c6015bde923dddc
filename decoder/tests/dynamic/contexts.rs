//! 8.5: which sources the planes of the sections may use, and what contexts come of them.

use crate::crafted::expect::decode_with;
use crate::crafted::scene::{Gaussian, Shape};
use crate::stream::cells::Cell;
use crate::stream::sample::{frame, gaussian, gop, unit};
use crate::stream::scene::{Scene, Unit};
use splatstream_decoder::process::Options;
use splatstream_format::entropy::layout::{Attribute, Layout, PlaneInfo, Section, ShCoding};
use splatstream_format::entropy::model::{ContextAxis, Source};
use splatstream_format::entropy::token::Alphabet;
use splatstream_format::syntax::IncrementHeader;

/// Many entries in every section, of different values; `sh_mode` 1 or 2.
fn scene(sh_mode: u8) -> Scene {
    let sh = |number: i64| if sh_mode == 1 { vec![number, -3] } else { vec![number % 3, number % 2] };
    let one = |number: i64| Gaussian { sh: sh(number), ..gaussian((number * number) as u64, number % 7) };
    let intra = Unit { new: (1..71).map(|number| gaussian(20, number)).collect(), ..Unit::default() };
    let stages = if sh_mode == 2 { (2, [7, 1, 255, 255]) } else { (0, [255; 4]) };
    let cell = |step: u64| Cell {
        code: step * step,
        stale: (step % 3 / 2) as i64,
        translation: [5, -3, step as i64],
        turn: [step as i64 * 9, 0, -7],
    };
    let unit = Unit {
        header: IncrementHeader {
            cell_log2: 1,
            predictor_block_log2: 0,
            neighbour_count: 3,
            sh_mode,
            vq_stage_count: stages.0,
            codebook_ids: stages.1,
            ..IncrementHeader::PLAIN
        },
        cells: (0..40).map(cell).collect(),
        modes: (0..70).map(|place| [0, 2, 1, 3, 4][place % 5]).collect(),
        moves: (0..28).map(|step| [step % 5, 1, step % 3]).collect(),
        updates: (0..28).map(one).collect(),
        predictors: (0..66).map(|place| place % 3).collect(),
        new: (0..66).map(one).collect(),
        lanes_log2: 2,
        ..Unit::default()
    };
    gop(&[100], vec![frame(0, vec![intra]), frame(1, vec![unit])])
}

fn planes(section: Section, sh_mode: u8) -> Vec<PlaneInfo> {
    let sh = if sh_mode == 1 {
        ShCoding::Coefficients { rank: 2 }
    } else {
        ShCoding::VectorQuantised { stages: 2 }
    };
    Layout::of_section(section, 3, sh).planes().to_vec()
}

/// The tables of 8.5, in their words; `p` is the place of the plane in its section.
fn is_available(source: u8, plane: PlaneInfo, p: usize) -> bool {
    let PlaneInfo { section, attribute, place, alphabet } = plane;
    let is_index = alphabet == Alphabet::Index;
    let first_index = is_index && place == 0;
    let in_new = section == Section::New;
    // The places of log_scale 1, log_scale 2, opacity and rotation 0 in section new.
    let from = |first: usize| in_new && p >= first;
    match source {
        0 => true,
        1 => !is_index,
        2 => alphabet == Alphabet::Attribute,
        3 if in_new => p >= 2 && !first_index,
        3 => p != 0 && attribute != Attribute::Stale && !first_index,
        4 => place >= 1,
        5 => from(2),
        6 => from(3),
        7 | 8 => from(4),
        9 => from(5),
        10 => from(1),
        _ => false,
    }
}

// covers: SS-EC-007, SS-PM-003, SS-EC-005
#[test]
fn a_plane_may_use_the_sources_of_8_5_and_no_others() {
    let strict = Options::default();
    for sh_mode in [1, 2] {
        let base = scene(sh_mode);
        assert_eq!(decode_with(&base.bytes(), &strict).verdict(), None);
        for section in Section::ALL {
            let all = planes(section, sh_mode).into_iter().enumerate();
            // The second time for what is new: planes of indices.
            for (p, plane) in all.filter(|(_, plane)| sh_mode == 1 || plane.alphabet == Alphabet::Index) {
                for source in Source::ALL.into_iter().filter(|&source| source != Source::None) {
                    let mut scene = base.clone();
                    let axis = ContextAxis { source, thresholds: vec![-1, 1, 6, 40] };
                    let shape = Shape { axes: [axis, ContextAxis::NONE], ..Shape::default() };
                    unit(&mut scene).shapes.insert((section, p), shape);
                    let found = decode_with(&scene.bytes(), &strict).verdict().map(|error| error.kind.code());
                    let expected =
                        if is_available(source.code(), plane, p) { None } else { Some("CONSTRAINT") };
                    assert_eq!(found, expected, "{plane:?} {source:?}");
                }
            }
        }
    }
}

// covers: SS-EC-007, SS-EC-005, SS-PM-002
#[test]
fn biases_and_two_sources_at_once_code_the_same_values() {
    let plain = scene(1);
    let expected = decode_with(&plain.bytes(), &Options::default());
    let mut coded = plain.clone();
    for section in Section::ALL {
        for (p, plane) in planes(section, 1).into_iter().enumerate() {
            let usable = |source: &Source| is_available(source.code(), plane, p);
            let last = Source::ALL.into_iter().rfind(usable).unwrap();
            let axis = |source, thresholds: &[i32]| ContextAxis { source, thresholds: thresholds.to_vec() };
            let axes = [axis(Source::NeighbourSum, &[-9, 0, 2]), axis(last, &[0, 5])];
            let bias = if plane.is_position() { 0 } else { [-3, 0, 2, 100][p % 4] };
            let shape = Shape { bias, direct_log2: 2 + (p % 4) as u8, axes, tables: None };
            unit(&mut coded).shapes.insert((section, p), shape);
        }
    }
    let decoded = decode_with(&coded.bytes(), &Options::default());
    assert_eq!(decoded.verdict(), None);
    let shown = |frames: &[splatstream_decoder::process::DecodedFrame]| frames[1].planes.clone();
    assert_eq!(shown(&decoded.frames), shown(&expected.frames));
}
