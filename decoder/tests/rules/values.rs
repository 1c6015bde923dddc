//! 7.3 to 7.8: values to canonical planes, their ranges, and every tool at its extremes.

use crate::crafted::expect::{assert_decodes, assert_refused_in, confined, decode, planes};
use crate::crafted::sample::{self, plain};
use crate::crafted::scene::{Gaussian, Scene, Shape, Unit, codebook, diagonal};
use splatstream_format::payload::Transform;
use splatstream_format::syntax::SequenceParameters;
use splatstream_format::syntax::UnitType::Refinement;

const BLOCK: (splatstream_format::syntax::UnitType, usize, u64) = (Refinement, 0, 20);

fn five() -> Scene {
    plain(sample::gaussians(5, 8, 3, 0))
}

fn unsorted(scene: &mut Scene) {
    scene.sequence.sequence_flags = 0;
}

// covers: SS-PO-001, SS-AT-001, SS-AT-002, SS-AT-003, SS-AT-005, SS-AT-006, SS-EC-006
#[test]
fn a_value_out_of_its_range_is_refused() {
    assert_refused_in(
        &five(),
        &[
            confined("a code of 2^30", "CONSTRAINT", "7.3", BLOCK)
                .scene(|s| s.first().delta = 1 << 30)
                .or_later(),
            confined("a sum of 2^30", "CONSTRAINT", "7.3", BLOCK)
                .scene(|s| {
                    s.unit(0).gaussians.iter_mut().for_each(|gaussian| gaussian.delta = 0);
                    s.unit(0).gaussians[1].delta = (1 << 30) - 5;
                    s.unit(0).gaussians[4].delta = 5;
                })
                .or_later(),
            confined("a code of 2^27 with shift 1", "CONSTRAINT", "7.3", BLOCK)
                .scene(|s| {
                    s.unit(0).position_shift = 1;
                    s.first().delta = 1 << 27;
                })
                .or_later(),
            confined("largest deltas", "CONSTRAINT", "7.3", BLOCK)
                .scene(|s| {
                    s.sequence.position_bits = 20;
                    s.unit(0).gaussians.iter_mut().for_each(|gaussian| gaussian.delta = (1 << 60) - 1);
                })
                .or_later(),
            confined("v_log_scale[0] 32768", "OUT_OF_RANGE", "7.4", BLOCK)
                .scene(|s| s.first().log_scale[0] = 32768)
                .or_later(),
            confined("v_log_scale[0] -32769", "OUT_OF_RANGE", "7.4", BLOCK)
                .scene(|s| s.first().log_scale[0] = -32769)
                .or_later(),
            confined("q[1] -32769", "OUT_OF_RANGE", "7.4", BLOCK)
                .scene(|s| s.first().log_scale = [-32768, 1, 0])
                .or_later(),
            confined("q[2] 32768", "OUT_OF_RANGE", "7.4", BLOCK)
                .scene(|s| {
                    unsorted(s);
                    s.first().log_scale = [32767, 0, -1];
                })
                .or_later(),
            confined("v_log_scale[1] 40000, every q in its range", "OUT_OF_RANGE", "7.4", BLOCK)
                .scene(|s| s.first().log_scale = [32767, 40000, 0])
                .or_later(),
            confined("v_log_scale[2] -32769, every q in its range", "OUT_OF_RANGE", "7.4", BLOCK)
                .scene(|s| {
                    unsorted(s);
                    s.first().log_scale = [0, 10000, -32769];
                })
                .or_later(),
            confined("axis 1 larger than axis 0", "CONSTRAINT", "7.4", BLOCK)
                .scene(|s| s.first().log_scale[1] = -1)
                .or_later(),
            confined("axis 2 larger than axis 1", "CONSTRAINT", "7.4", BLOCK)
                .scene(|s| s.unit(0).gaussians[4].log_scale[2] = -1)
                .or_later(),
            confined("opacity 32768", "OUT_OF_RANGE", "7.5", BLOCK)
                .scene(|s| s.first().opacity = 32768)
                .or_later(),
            confined("opacity -32769", "OUT_OF_RANGE", "7.5", BLOCK)
                .scene(|s| s.first().opacity = -32769)
                .or_later(),
            confined("opacity out of range with its bias", "OUT_OF_RANGE", "7.5", BLOCK)
                .scene(|s| {
                    s.unit(0).shapes.insert(4, Shape { bias: 32767, ..Shape::default() });
                    s.first().opacity = 32768;
                })
                .or_later(),
            confined("v_rotation 32768", "OUT_OF_RANGE", "7.6", BLOCK)
                .scene(|s| s.first().rotation[0] = 32768)
                .or_later(),
            confined("rotation -32768", "OUT_OF_RANGE", "7.6", BLOCK)
                .scene(|s| {
                    s.first().rotation[2] = -32768;
                    s.first().log_scale = [0, 90, 0];
                })
                .or_later(),
            confined("rotation 4096 << 3", "OUT_OF_RANGE", "7.6", BLOCK)
                .scene(|s| {
                    s.first().rotation[1] = 4096;
                    s.first().log_scale = [0, 3, 0];
                })
                .or_later(),
            confined("rotation -8192 << 2", "OUT_OF_RANGE", "7.6", BLOCK)
                .scene(|s| {
                    s.first().rotation[1] = -8192;
                    s.first().log_scale = [0, 3, 1];
                })
                .or_later(),
            confined("dc component 8192", "OUT_OF_RANGE", "7.7", BLOCK)
                .scene(|s| s.first().dc[2] = 8192)
                .or_later(),
            confined("dc component -8192", "OUT_OF_RANGE", "7.7", BLOCK)
                .scene(|s| s.first().dc[0] = -8192)
                .or_later(),
            // Planes in their order.
            confined("a position before a log-scale", "CONSTRAINT", "7.3", BLOCK)
                .scene(|s| {
                    s.unit(0).gaussians[4].delta = 1 << 40;
                    s.first().log_scale[0] = 32768;
                })
                .or_later(),
            confined("the order of axis 1 before the range of axis 2", "CONSTRAINT", "7.4", BLOCK)
                .scene(|s| {
                    s.unit(0).gaussians[4].log_scale[1] = -1;
                    s.first().log_scale = [-32768, 0, 1];
                })
                .or_later(),
            confined("opacity before rotation", "OUT_OF_RANGE", "7.5", BLOCK)
                .scene(|s| {
                    s.unit(0).gaussians[4].opacity = 33000;
                    s.first().rotation[0] = 33000;
                })
                .or_later(),
            confined("rotation before dc", "OUT_OF_RANGE", "7.6", BLOCK)
                .scene(|s| {
                    s.unit(0).gaussians[4].rotation[2] = 33000;
                    s.first().dc[0] = 9000;
                })
                .or_later(),
        ],
    );
}

// covers: SS-SH-002, SS-SH-003
#[test]
fn sh_components_and_indices_have_their_ranges() {
    let sh_plane = |n: usize| (Refinement, n, 20);
    assert_refused_in(
        &sample::scene(),
        &[
            confined("sh component 8192", "OUT_OF_RANGE", "7.7", sh_plane(0))
                .scene(|s| s.first().sh[1] = 8192)
                .or_later(),
            confined("sh component -8192", "OUT_OF_RANGE", "7.7", sh_plane(0))
                .scene(|s| s.first().sh[0] = -8192)
                .or_later(),
            confined("entry 3 of three", "OUT_OF_RANGE", "7.8", sh_plane(1))
                .scene(|s| s.unit(1).gaussians[2].sh[0] = 3)
                .or_later(),
            confined("entry 65535 of two", "OUT_OF_RANGE", "7.8", sh_plane(1))
                .scene(|s| s.unit(1).gaussians[0].sh[1] = 65535)
                .or_later(),
            confined("dc before sh", "OUT_OF_RANGE", "7.7", sh_plane(1))
                .scene(|s| {
                    s.unit(1).gaussians[0].sh[0] = 3;
                    s.unit(1).gaussians[2].dc[2] = -8192;
                })
                .or_later(),
        ],
    );
}

// covers: SS-PO-001, SS-PO-002, SS-PO-003
#[test]
fn positions_are_morton_codes_on_lattices_of_every_size() {
    for bits in 1..=20_u8 {
        for shift in [0, 1, bits / 2, bits - 1].into_iter().filter(|&shift| shift < bits) {
            let last = (1_u64 << (3 * (bits - shift))) - 1;
            let mut all = sample::gaussians(4, 1, 3, 0);
            for (gaussian, delta) in all.iter_mut().zip([0, last / 3, 0, last - last / 3]) {
                gaussian.delta = delta;
            }
            let mut scene = plain(all);
            scene.sequence.position_bits = bits;
            scene.unit(0).position_shift = shift;
            assert_decodes(&format!("{bits} bits, shift {shift}"), &scene);
        }
    }
    // By hand: bits 0, 1, 2 of the code are the lowest bits of x, y, z; equal codes are equal positions.
    let mut scene = five();
    for (gaussian, delta) in scene.unit(0).gaussians.iter_mut().zip([1, 1, 2, 4, 0]) {
        gaussian.delta = delta;
    }
    let decoded = decode(&scene.bytes()).frames.remove(0).planes;
    assert_eq!(decoded.position, [[1, 0, 0, 2, 2], [0, 1, 0, 0, 0], [0, 0, 1, 0, 0]].map(Vec::from));
    scene.unit(0).position_shift = 3;
    let decoded = decode(&scene.bytes()).frames.remove(0).planes;
    assert_eq!(decoded.position, [[12, 4, 4, 20, 20], [4, 12, 4, 4, 4], [4, 4, 12, 4, 4]].map(Vec::from));
}

// covers: SS-AT-001, SS-AT-002, SS-AT-003, SS-AT-005, SS-AT-006, SS-PM-002
#[test]
fn values_at_both_ends_of_their_ranges_are_accepted() {
    let extreme = |log_scale, opacity, rotation, dc| Gaussian {
        delta: 0,
        log_scale,
        opacity,
        rotation,
        dc: vec![dc; 3],
        sh: Vec::new(),
    };
    let sorted = vec![
        extreme([32767, 32767, 0], 32767, [32767, -32767, 0], 8191),
        extreme([-32768, 0, 0], -32768, [-4095, 4095, 1], -8191),
        extreme([0, 32767, 1], 0, [0, 32767, -32767], 0),
    ];
    assert_decodes("sorted axes", &plain(sorted));
    let mut unsorted_axes = vec![
        extreme([32767, 32767, 32767], 0, [0; 3], 0),
        extreme([-32768, -32768, -32767], 0, [0; 3], 0),
        extreme([0, -32767, 32767], 0, [0; 3], 0),
        extreme([5, -4, -3], 0, [7, -7, 7], 0),
    ];
    unsorted_axes[1].rotation = [4095, -4095, 0];
    let mut scene = plain(unsorted_axes);
    unsorted(&mut scene);
    assert_decodes("axes as they come", &scene);
    // The bias takes part of the way.
    for bias in [-32768, 32767] {
        let mut scene = five();
        for plane in 1..11 {
            scene.unit(0).shapes.insert(plane, Shape { bias, ..Shape::default() });
        }
        assert_decodes(&format!("bias {bias}"), &scene);
    }
}

// covers: SS-AT-004, SS-AT-005
#[test]
fn rotations_are_coarser_below_each_threshold() {
    for thresholds in [[0, 0, 0], [9, 0, 0], [9, 5, 0], [9, 5, 5], [255, 255, 255], [12, 8, 4]] {
        for sorted in [true, false] {
            let mut all = Vec::new();
            for d in -3..15 {
                let log_scale = [7, d, 0];
                let gaussian =
                    Gaussian { log_scale, rotation: [1, -3, 100], dc: vec![0; 3], ..Gaussian::default() };
                all.push(gaussian);
            }
            if sorted {
                all.retain(|gaussian| gaussian.log_scale[1] >= 0);
            }
            let mut scene = plain(all);
            scene.sequence.sequence_flags = SequenceParameters::flags(sorted, false);
            scene.sequence.rotation_threshold = thresholds;
            assert_decodes(&format!("{thresholds:?}"), &scene);
        }
    }
    // By hand, thresholds 12, 8, 4 and d = 12, 11, 7, 3.
    let mut scene = five();
    for (gaussian, d) in scene.unit(0).gaussians.iter_mut().zip([12, 11, 7, 3, 3]) {
        gaussian.log_scale = [0, d, 0];
        gaussian.rotation = [5, 0, 0];
    }
    let decoded = decode(&scene.bytes()).frames.remove(0).planes;
    assert_eq!(decoded.rotation[0], [5, 10, 20, 40, 40]);
}

/// A transform of extremes: every weight and mean at an end of its range.
fn extreme_transform(id: u8, kind: u8, dimension: u8, rank: u8) -> Transform {
    let mut transform = diagonal(id, kind, dimension, rank, 0, 1 << 30);
    for (place, weight) in transform.basis.iter_mut().enumerate() {
        *weight = if place % 2 == 0 { 4096 } else { -4096 };
    }
    transform.mean.iter_mut().step_by(2).for_each(|mean| *mean = -(1 << 30));
    transform
}

// covers: SS-AT-007, SS-TF-004, SS-SH-002
#[test]
fn transforms_of_every_rank_at_the_ends_of_their_ranges_stay_within_32_bits() {
    for (degree, dimension) in [(1, 9_u8), (2, 24), (3, 45)] {
        for rank in [1, 2, dimension / 2, dimension] {
            for dc_rank in 1..=3 {
                let mut scene = sample::scene();
                scene.sequence.sh_degree = degree;
                let transforms =
                    vec![extreme_transform(3, 0, 3, dc_rank), extreme_transform(4, 1, dimension, rank)];
                scene.gops.truncate(1);
                scene.gops[0].frames.truncate(1);
                scene.gops[0].transforms = transforms;
                scene.gops[0].codebooks.clear();
                scene.sequence.frame_count = 1;
                let mut all = sample::gaussians(10, 5, dc_rank.into(), rank.into());
                for (place, gaussian) in all.iter_mut().enumerate() {
                    let sign = if place % 2 == 0 { 1 } else { -1 };
                    gaussian.dc.fill(8191 * sign);
                    for (k, component) in gaussian.sh.iter_mut().enumerate() {
                        *component = if k % 2 == 0 { 8191 * sign } else { -8191 * sign };
                    }
                }
                let like = Unit { sh_mode: 1, ..Unit::default() };
                let mut frame = scene.divided(&all, &like);
                frame.sh_transform = 4;
                scene.gops[0].frames = vec![frame];
                assert_decodes(&format!("degree {degree}, rank {rank}, dc rank {dc_rank}"), &scene);
            }
        }
    }
}

// covers: SS-AT-007
#[test]
fn the_sum_is_rounded_once_and_halves_go_up() {
    // Weight 1 and components c: Round(c, 6). Weights 1 and 1: Round(a + b, 6), not two roundings.
    let mut scene = five();
    let mut transform = diagonal(3, 0, 3, 3, 0, 0);
    transform.basis = vec![1, 0, 0, 1, 0, 0, 0, 0, 0];
    scene.gops[0].transforms = vec![transform];
    let pairs = [(32, 0), (-32, 0), (-33, 0), (20, 12), (-16, -17)];
    for (gaussian, (a, b)) in scene.unit(0).gaussians.iter_mut().zip(pairs) {
        gaussian.dc = vec![a, b, 0];
    }
    let decoded = decode(&scene.bytes()).frames.remove(0).planes;
    assert_eq!(decoded.dc[0], [1, 0, -1, 1, -1]);
    assert_decodes("rounding", &scene);
}

// covers: SS-SH-001
#[test]
fn without_sh_the_mean_of_the_transform_is_not_applied() {
    let mut scene = sample::scene();
    scene.gops[0].transforms[1].mean.fill(77);
    let decoded = decode(&scene.bytes());
    assert_eq!(decoded.end, None);
    let last_unit = |plane: &Vec<i32>| plane[5..].iter().all(|&value| value == 0);
    let first_unit = |plane: &Vec<i32>| plane[..2].iter().all(|&value| value != 0);
    let sh = &decoded.frames[0].planes.sh;
    assert_eq!(sh.len(), 9);
    assert!(sh.iter().all(last_unit));
    assert!(sh[2..].iter().all(first_unit));
    assert_eq!(planes(&decoded.frames[0].planes), scene.planes(0, 0, 2));
}

// covers: SS-SH-003
#[test]
fn entries_of_one_to_four_stages_are_added_and_clamped() {
    let books = [[0, 1, -2, 3], [8191, -8191, 300, -300], [32767, -32768, 1, 1], [-5, 5, 8000, -8000]];
    for stages in 1..=4 {
        let mut scene = sample::scene();
        scene.gops[0].codebooks =
            (0..4).map(|id| codebook(id, 2, 2, books[usize::from(id)].to_vec())).collect();
        scene.gops[0].frames[1] = scene.gops[0].frames[0].clone();
        for frame in &mut scene.gops[0].frames {
            let unit = &mut frame.units[1];
            unit.codebook_ids = (0..stages).rev().collect();
            for (place, gaussian) in unit.gaussians.iter_mut().enumerate() {
                gaussian.sh = (0..stages).map(|stage| ((place >> stage) & 1) as i64).collect();
            }
        }
        assert_decodes(&format!("{stages} stages"), &scene);
    }
}

// covers: SS-EC-001
#[test]
fn every_length_of_value_decodes_with_every_number_of_direct_tokens() {
    for direct_log2 in 2..=7 {
        let mut all = Vec::new();
        for bit in 0..15 {
            for value in [(1 << bit) - 1, -(1 << bit), (1 << bit) + (1 << bit) / 2] {
                let gaussian = Gaussian { opacity: value, dc: vec![0; 3], ..Gaussian::default() };
                all.push(gaussian);
            }
        }
        let mut delta = 1;
        for gaussian in &mut all {
            gaussian.delta = delta;
            delta = (delta * 2 + 1) % (1 << 54);
        }
        let mut scene = plain(all);
        scene.sequence.position_bits = 20;
        let shape = |direct_log2| Shape { direct_log2, ..Shape::default() };
        scene.unit(0).shapes.insert(0, shape(direct_log2.min(5)));
        (1..11).for_each(|plane| drop(scene.unit(0).shapes.insert(plane, shape(direct_log2))));
        assert_decodes(&format!("direct_log2 {direct_log2}"), &scene);
    }
    let mut indices = sample::scene();
    indices.gops[0].codebooks[0] = codebook(7, 2, 2, (0..65536).map(|entry| (entry % 999) as i16).collect());
    let unit = indices.unit(1);
    unit.gaussians.iter_mut().zip([0, 9000, 32767]).for_each(|(gaussian, index)| gaussian.sh[0] = index);
    assert_decodes("a codebook of 32768 entries", &indices);
}
