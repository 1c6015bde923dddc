//! Random streams: every context source on both axes, against the reference; and the encoder's side of contexts.

use crate::crafted::contexts::BlockValues;
use crate::crafted::expect::assert_decodes;
use crate::crafted::sample::{self, Dice};
use crate::crafted::scene::{Frame, Gaussian, Gop, Scene, Shape, Unit, codebook, diagonal};
use proptest::prelude::*;
use splatstream_decoder::block::CodedBlock;
use splatstream_decoder::context::{delta_contexts, plane_contexts};
use splatstream_format::entropy::layout::{Attribute, Layout, PlaneInfo, ShCoding, is_available};
use splatstream_format::entropy::model::{ContextAxis, Source};
use splatstream_format::syntax::{NO_TRANSFORM, SequenceParameters};
use std::collections::BTreeMap;

fn axis(dice: &mut Dice, plane: PlaneInfo, most: u64) -> ContextAxis {
    let sources: Vec<Source> =
        Source::ALL[1..].iter().copied().filter(|&source| is_available(plane, source)).collect();
    if sources.is_empty() || dice.below(4) == 0 {
        return ContextAxis::NONE;
    }
    let source = sources[dice.below(sources.len() as u64) as usize];
    // Near the values, far from them, and further apart than a table of contexts reaches.
    let reach = [3, 40, 9000, 1 << 30][dice.below(4) as usize];
    let count = 1 + dice.below(most);
    let mut thresholds: Vec<i32> = (0..count).map(|_| dice.within(-reach, reach) as i32).collect();
    thresholds.sort_unstable();
    thresholds.dedup();
    ContextAxis { source, thresholds }
}

fn shape(dice: &mut Dice, plane: PlaneInfo) -> Shape {
    let first = axis(dice, plane, 15);
    let none = first.source == Source::None;
    let second = if none { ContextAxis::NONE } else { axis(dice, plane, 3) };
    let signed = plane.alphabet == splatstream_format::entropy::token::Alphabet::Attribute;
    Shape {
        bias: if signed { dice.within(-20, 20) as i32 } else { 0 },
        direct_log2: 2 + dice.below(4) as u8,
        axes: [first, second],
        tables: None,
    }
}

fn shapes(dice: &mut Dice, layout: &Layout) -> BTreeMap<usize, Shape> {
    layout.planes().iter().enumerate().map(|(place, &plane)| (place, shape(dice, plane))).collect()
}

fn random_scene(seed: u64) -> Scene {
    let mut dice = Dice::new(seed);
    let degree = dice.below(4) as u8;
    let dimension = [0, 9, 24, 45][usize::from(degree)];
    let [dc_rank, rank] = [1 + dice.below(3) as u8, 1 + dice.below(dimension.max(1)) as u8];
    let refinements = 1 + dice.below(3) as u8;
    let mut refinement_percent = [0; 10];
    refinement_percent[..3]
        .copy_from_slice(&[[100, 0, 0], [33, 100, 0], [1, 60, 100]][usize::from(refinements) - 1]);
    let sequence = SequenceParameters {
        sh_degree: degree,
        refinement_count: refinements,
        refinement_percent,
        position_bits: 5 + dice.below(16) as u8,
        sequence_flags: SequenceParameters::flags(true, dice.below(2) == 1),
        frame_count: 0,
        ..sample::sequence()
    };
    let mut transforms = vec![diagonal(3, 0, 3, dc_rank, 3000, 5)];
    let mut codebooks = Vec::new();
    if degree > 0 {
        let mut sh = diagonal(4, 1, dimension as u8, rank, 0, -9);
        sh.basis.iter_mut().for_each(|weight| *weight = dice.within(-4096, 4096) as i16);
        transforms.push(sh);
        let entries = (0..20 * u32::from(rank)).map(|_| dice.within(-128, 127) as i16).collect();
        codebooks.push(codebook(2, rank, 1, entries));
    }
    let modes = if degree > 0 { 3 } else { 1 };
    let mut gaussians = sample::gaussians(dice.below(260) as usize, dice.next(), dc_rank.into(), 0);
    let room = (1 << (3 * u32::from(sequence.position_bits - 3))) / 64;
    gaussians.iter_mut().for_each(|gaussian| gaussian.delta = dice.below(room) >> dice.below(30));
    let scene = Scene { level: 1, sequence, gops: Vec::new(), index: dice.below(2) == 0 };
    let mut frame = scene.divided(&gaussians, &Unit::default());
    frame.sh_transform = if degree > 0 { 4 } else { NO_TRANSFORM };
    let mut gop = Gop { transforms, codebooks, frames: vec![frame.clone()] };
    for unit in &mut frame.units {
        random_unit(&mut dice, unit, &gop, modes, rank);
    }
    gop.frames = vec![frame];
    Scene { gops: vec![gop], ..scene }
}

fn random_unit(dice: &mut Dice, unit: &mut Unit, gop: &Gop, modes: u64, rank: u8) {
    unit.sh_mode = dice.below(modes) as u8;
    unit.position_shift = dice.below(4) as u8;
    unit.lanes_log2 = dice.below(6) as u8;
    unit.codebook_ids = if unit.sh_mode == 2 { vec![2; 1 + dice.below(4) as usize] } else { Vec::new() };
    let (places, range) = match unit.sh_mode {
        1 => (usize::from(rank), (-30, 30)),
        2 => (unit.codebook_ids.len(), (0, 19)),
        _ => (0, (0, 0)),
    };
    for gaussian in &mut unit.gaussians {
        gaussian.sh = (0..places).map(|_| dice.within(range.0, range.1)).collect();
    }
    let frame: &Frame = &gop.frames[0];
    let layout = unit.layout(&gop.tools(frame).unwrap());
    unit.shapes = shapes(dice, &layout);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 120, failure_persistence: None, ..ProptestConfig::default() })]

    // covers: SS-EC-005, SS-EC-002, SS-EC-004, SS-PO-002, SS-SH-001, SS-SH-002, SS-SH-003, SS-OP-003
    #[test]
    fn a_random_stream_decodes_to_the_planes_of_the_reference(seed: u64) {
        assert_decodes("random", &random_scene(seed));
    }

    // covers: SS-EC-005
    #[test]
    fn the_contexts_an_encoder_asks_for_are_those_of_8_5(seed: u64) {
        let mut dice = Dice::new(seed);
        let layout = Layout::new(3, ShCoding::Coefficients { rank: 3 });
        let planes = layout.planes();
        let count = dice.below(70) as usize;
        let run: Vec<Gaussian> = sample::gaussians(count, dice.next(), 3, 3);
        let deltas: Vec<u64> = run.iter().map(|gaussian| gaussian.delta).collect();
        let of_plane = |plane: &PlaneInfo, gaussian: &Gaussian| {
            let place = usize::from(plane.place);
            match plane.attribute {
                Attribute::Position => 0,
                Attribute::LogScale => gaussian.log_scale[place],
                Attribute::Opacity => gaussian.opacity,
                Attribute::Rotation => gaussian.rotation[place],
                Attribute::Dc => gaussian.dc[place],
                Attribute::Sh => gaussian.sh[place],
                _ => unreachable!("not in a refinement"),
            }
        };
        let values: Vec<Vec<i64>> =
            planes.iter().map(|plane| run.iter().map(|gaussian| of_plane(plane, gaussian)).collect()).collect();
        let reference = BlockValues::new(planes, &deltas, &values, &vec![0; planes.len()]);
        let narrow = |plane: &Vec<i64>| plane.iter().map(|&value| value as i32).collect::<Vec<_>>();
        let mut block = CodedBlock::new(deltas.clone());
        block.log_scale = reference.q.each_ref().map(narrow);
        block.opacity = narrow(&reference.o);
        for (place, &plane) in planes.iter().enumerate() {
            let coded = if place == 0 { Vec::new() } else { narrow(&values[place]) };
            let axes = shape(&mut dice, plane).axes;
            let contexts = match plane.attribute {
                Attribute::Position => delta_contexts(&axes, &deltas),
                _ => plane_contexts(&axes, place, &block, &coded),
            };
            let expected: Vec<u8> = (0..count).map(|i| reference.context(&axes, place, i)).collect();
            // No contexts at all stand for context 0.
            let found = if axes[0].source == Source::None { vec![0; count] } else { contexts };
            prop_assert_eq!(found, expected, "plane {} with {:?}", place, axes);
            block.push(plane, coded);
        }
    }
}
