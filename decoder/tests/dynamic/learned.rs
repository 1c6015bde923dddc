//! 7.17.6: what small networks predict, with numbers found by hand.

use crate::crafted::expect::{decode, planes};
use crate::crafted::scene::{Gaussian, diagonal};
use crate::prediction::{line, scene};
use crate::stream::expect::assert_decodes;
use crate::stream::network::{FULL_ATTENTION, GATED, KNN_BASE, NORMALISED, Network};
use crate::stream::sample::{frame, gop, predicting, unit};
use crate::stream::scene::{Scene, Unit};
use crate::stream::transformer::{SINE, sine};
use splatstream_format::syntax::{IncrementHeader, NO_TRANSFORM, NetworkHeader};

/// The planes of dc 0 and of sh 0.
const DC: usize = 10;
const SH: usize = 13;

/// Eight wide, with nothing that may be left out; every layer drops 6 bits, so that a weight of 64 hands on.
pub(crate) const PLAIN: NetworkHeader = NetworkHeader {
    network_flags: 0,
    width_log2: 3,
    feed_forward_width: 0,
    geometry_width: 0,
    fourier_count: 0,
    rank_count: 1,
    dc_count: 3,
    sh_count: 0,
    token_shift: 0,
    output_shift: 0,
    layer_shift: [6; 8],
};

pub(crate) fn zeros(header: NetworkHeader) -> Network {
    Network::new(header, |_, _, _| 0)
}

/// A network whose outputs are the first places of `pool`.
fn reading(header: NetworkHeader) -> Network {
    let mut network = zeros(header);
    (0..usize::from(header.dc_count)).for_each(|k| network.set("head", k, k, 64));
    network
}

/// The last values that the last frame shows in three planes.
fn shown(scene: &Scene, first: usize) -> [i32; 3] {
    let planes = planes(&decode(&scene.bytes()).frames.last().unwrap().planes);
    [0, 1, 2].map(|i| *planes[first + i].last().unwrap())
}

/// What a network adds to dc of the last new Gaussian, which is the same up to there as with predictor 2.
fn added(name: &str, scene: &Scene, network: Network) -> [i32; 3] {
    let mut scene = scene.clone();
    let header = unit(&mut scene).header;
    unit(&mut scene).predictors.fill(2);
    let base = [3, 6, DC].map(|plane| shown(&scene, plane));
    unit(&mut scene).predictors.fill(3);
    scene.gops[0].network = Some(network);
    assert_decodes(name, &scene);
    let found = [3, 6, DC].map(|plane| shown(&scene, plane));
    assert_eq!(found[..2], base[..2], "{name}: what comes before dc, {header:?}");
    [0, 1, 2].map(|i| found[2][i] - base[2][i])
}

/// Two Gaussians that differ in dc and sh only, and one between them that is like the second.
fn unlike() -> Scene {
    let mut scene =
        scene(&[(8, 0), (12, 0)], &[10], 3, IncrementHeader { bilateral_feature: 255, ..predicting(2) });
    let known = &mut scene.gops[0].frames[0].units[0];
    known.header.sh_mode = 1;
    known.new[0].sh = vec![0, 0];
    (known.new[1].sh, known.new[1].dc) = (vec![64, 0], vec![100, 0, 0]);
    unit(&mut scene).new[0].dc = vec![50, 0, 0];
    scene.gops[0].network = Some(zeros(PLAIN));
    scene
}

// covers: SS-TR-001, SS-TR-008
#[test]
fn a_network_of_zeros_leaves_the_means_by_the_weights_of_dc() {
    let mut scene = unlike();
    assert_decodes("zeros", &scene);
    // dc is (-70 + 6330) / 2 and a residual of 50 * 64; the dc is that of neighbour 1, but sh is a mean all the same.
    assert_eq!((shown(&scene, DC)[0], shown(&scene, SH)), (6330, [626, 9, 9]));
    unit(&mut scene).predictors = vec![2];
    assert_eq!((shown(&scene, DC)[0], shown(&scene, SH)), (6330, [1243, 9, 9]));
}

// covers: SS-TR-001
#[test]
fn with_a_knn_base_it_leaves_the_means_by_distance() {
    let mut scene = scene(&[(8, 0), (14, 0)], &[10], 3, predicting(2));
    scene.gops[0].frames[0].units[0].new[1].dc = vec![100, 0, 0];
    let mut with = |flags: u8, predictor: u8| {
        scene.gops[0].network = Some(zeros(NetworkHeader { network_flags: flags, ..PLAIN }));
        unit(&mut scene).predictors = vec![predictor.into()];
        assert_decodes(&format!("flags {flags}, predictor {predictor}"), &scene);
        shown(&scene, DC)
    };
    assert_eq!(with(KNN_BASE, 3), with(KNN_BASE, 1));
    assert_eq!(with(0, 3), with(0, 2));
    assert_ne!(with(0, 3), with(KNN_BASE, 3));
}

// covers: SS-TR-001
#[test]
fn tokens_are_differences_to_the_new_gaussian_and_its_distance() {
    let mut scene = scene(&[(14, 10)], &[10], 3, predicting(1));
    let read = |scene: &Scene, header: NetworkHeader, token: usize| {
        let mut network = reading(header);
        network.set("embedding", 0, token, 64);
        added(&format!("token {token}"), scene, network)[0]
    };
    // log_scale[0] moves all three; rotations are coarser by 2^3.
    let residual = |log_scale, opacity, rotation| Gaussian {
        log_scale: [log_scale, 0, 0],
        opacity,
        rotation,
        ..line(&[(10, 0)]).remove(0)
    };
    unit(&mut scene).new = vec![residual(5, 7, [1, -2, 3])];
    let tokens: Vec<i32> = (0..11).map(|token| read(&scene, PLAIN, token)).collect();
    // One neighbour is its own mean. D2 is 16: 127 * 16 / 17.
    assert_eq!(tokens, [0, 0, 0, -20, -20, -20, -14, -8, 16, -24, 119]);
    unit(&mut scene).new = vec![residual(-32, 64, [16, -16, 15])];
    let tokens: Vec<i32> = (3..11).map(|token| read(&scene, PLAIN, token)).collect();
    assert_eq!(tokens, [127, 127, 127, -127, -127, 127, -120, 119]);
}

// covers: SS-TR-001
#[test]
fn tokens_of_components_are_differences_to_the_mean_and_may_be_gated() {
    // Weights 4096 and 1507.
    let header = IncrementHeader { bilateral_spatial: 34, ..predicting(2) };
    let mut scene = scene(&[(10, 0), (14, 0)], &[10], 3, header);
    scene.gops[0].frames[0].units[0].new[1].dc = vec![1, 0, 0];
    let read = |header: NetworkHeader, token: usize| {
        let mut network = reading(header);
        network.set("embedding", 0, token, 64);
        added(&format!("{header:?}"), &scene, network)[0]
    };
    // -70 and -6 are -17 and 47 from their mean; so the mean of the tokens is 15.
    assert_eq!(read(PLAIN, 0), 15);
    assert_eq!(read(PLAIN, 1), 0);
    // Halves: -8 and 24.
    assert_eq!(read(NetworkHeader { token_shift: 1, ..PLAIN }, 0), 8);
    // D2 is 0 and 119 of 127, gated 44: 1507 * 119 / 4096.
    assert_eq!(read(PLAIN, 10), 60);
    assert_eq!(read(NetworkHeader { network_flags: GATED, ..PLAIN }, 10), 22);
}

/// A parameter: array, row, place, value.
type Parameter = (&'static str, usize, usize, i64);

/// A change of [`PLAIN`], parameters besides those of [`reading`], and what the network adds to dc in [`two`].
type Hand = (&'static str, fn(&mut NetworkHeader), &'static [Parameter], [i32; 3]);

/// Neighbour 0 at 4 and neighbour 1 at -6; in parts of the larger 85 and -127.
fn two() -> Scene {
    scene(&[(4, 0), (14, 0)], &[10], 3, predicting(2))
}

/// `h[0]` is 0 of neighbour 0 and 64 of neighbour 1.
const RANK: Parameter = ("rank_embedding", 1, 0, 64 * 64);
/// Logits of this size.
const ATTENTION: Parameter = ("attention", 0, 0, 64);
/// What the shares choose is added.
const VALUE: Parameter = ("value", 0, 0, 64);

const HANDS: [Hand; 21] = [
    // Of 85 and 0, below which nothing goes.
    (
        "geometry",
        |h| h.geometry_width = 1,
        &[("geometry", 0, 0, 64), ("geometry_embedding", 0, 0, 64)],
        [43, 0, 0],
    ),
    // 185 is 127, and -27 is 0.
    (
        "geometry bias",
        |h| h.geometry_width = 2,
        &[("geometry", 1, 0, 64), ("geometry_bias", 0, 1, 6400), ("geometry_embedding", 2, 1, 64)],
        [0, 0, 64],
    ),
    ("rank", |h| h.rank_count = 2, &[RANK], [32, 0, 0]),
    ("one rank for all", |_| (), &[("rank_embedding", 0, 1, 640)], [0, 10, 0]),
    ("query", |h| h.rank_count = 2, &[RANK, ("query", 0, 0, -50), ("query", 0, 1, -128)], [-18, -127, 0]),
    // u is 32, the logits 0 and 32; EXP[32] is 1507; the shares 69 and 187; z is 47.
    ("attention", |h| h.rank_count = 2, &[RANK, ATTENTION, VALUE], [79, 0, 0]),
    // Further than the table goes: 256 parts for neighbour 1.
    (
        "much attention",
        |h| (h.rank_count, h.layer_shift[3]) = (2, 1),
        &[RANK, ("attention", 0, 0, 127), VALUE],
        [96, 0, 0],
    ),
    ("value bias", |_| (), &[("value_bias", 0, 1, -640)], [0, -10, 0]),
    // Row 0 sees both alike and becomes 0 + 32; row 1 has shares 30 and 226 and becomes 64 + 57.
    (
        "full attention",
        |h| (h.rank_count, h.network_flags) = (2, FULL_ATTENTION),
        &[RANK, ATTENTION, VALUE],
        [77, 0, 0],
    ),
    // sine(85) is 110 and sine(-127) -127: logits 28 and -32, EXP[60] is 628, the shares 222 and 34.
    ("sine", |h| (h.rank_count, h.fourier_count) = (2, 1), &[RANK, VALUE, ("fourier", 0, 0, 16)], [41, 0, 0]),
    // sine(213) is 64, sine(1) is 2: logits 16 and 1.
    (
        "cosine",
        |h| (h.rank_count, h.fourier_count) = (2, 1),
        &[RANK, VALUE, ("fourier", 0, 1, 16)],
        [57, 0, 0],
    ),
    // sine(170) is 111, sine(-254) is -3: logits 28 and -1.
    (
        "twice the frequency",
        |h| (h.rank_count, h.fourier_count) = (2, 2),
        &[RANK, VALUE, ("fourier", 0, 6, 16)],
        [51, 0, 0],
    ),
    // The other axes do not differ: what they add to both logits is the same.
    (
        "sine of y and cosine of z",
        |h| (h.rank_count, h.fourier_count) = (2, 1),
        &[RANK, VALUE, ("fourier", 0, 2, 127), ("fourier", 0, 5, 127)],
        [64, 0, 0],
    ),
    // 64 and seven 0: the middle is 8, the root of 3584 is 59, the ratio 1110.
    (
        "normalisation",
        |h| h.network_flags = NORMALISED,
        &[
            ("rank_embedding", 0, 0, 64 * 64),
            ("gain", 0, 0, 4),
            ("gain", 0, 1, 4),
            ("gain", 0, 2, 4),
            ("gain_bias", 0, 2, 64),
        ],
        [30, -4, -2],
    ),
    // 2, -2 and six 0: the sum is 8, one less than the square of 3.
    (
        "normalisation below a square",
        |h| h.network_flags = NORMALISED,
        &[
            ("rank_embedding", 0, 0, 128),
            ("rank_embedding", 0, 1, -128),
            ("gain", 0, 0, 4),
            ("gain", 0, 1, 4),
        ],
        [32, -32, 0],
    ),
    // The ratio is 2^16, of nothing.
    (
        "normalisation of equals",
        |h| h.network_flags = NORMALISED,
        &[("gain", 0, 0, 127), ("gain_bias", 0, 1, 160)],
        [0, 5, 0],
    ),
    (
        "feed-forward block",
        |h| h.feed_forward_width = 2,
        &[
            ("rank_embedding", 0, 0, 64 * 64),
            ("widening", 0, 0, 64),
            ("widening", 1, 0, -64),
            ("narrowing", 0, 0, 64),
            ("narrowing", 1, 0, 32),
            ("narrowing", 2, 1, 127),
            ("narrowing_bias", 0, 2, -640),
        ],
        [127, 32, -10],
    ),
    (
        "bias of the block",
        |h| h.feed_forward_width = 1,
        &[("widening_bias", 0, 0, 640), ("narrowing", 0, 0, 64)],
        [10, 0, 0],
    ),
    (
        "head bias",
        |_| (),
        &[("head_bias", 0, 0, 640), ("head_bias", 0, 1, -32), ("head_bias", 0, 2, -33)],
        [10, 0, -1],
    ),
    (
        "the largest outputs",
        |h| (h.output_shift, h.layer_shift[7]) = (4, 1),
        &[("head_bias", 0, 0, 32_767), ("head_bias", 0, 1, -32_768), ("head_bias", 0, 2, 2)],
        [16_368, -16_368, 16],
    ),
    (
        "less than all of dc",
        |h| (h.dc_count, h.sh_count) = (1, 1),
        &[("head_bias", 0, 0, 640), ("head_bias", 0, 1, 640)],
        [10, 0, 0],
    ),
];

// covers: SS-TR-002, SS-TR-003, SS-TR-004, SS-TR-005, SS-TR-006, SS-TR-007, SS-TR-008
#[test]
fn each_layer_of_a_network_computes_what_its_numbers_say() {
    let scene = two();
    for (name, edit, parameters, expected) in HANDS {
        let mut header = PLAIN;
        edit(&mut header);
        let mut network = reading(header);
        for &(array, row, place, value) in parameters {
            network.set(array, row, place, value);
        }
        assert_eq!(added(name, &scene, network), expected, "{name}");
    }
}

// covers: SS-TR-002, SS-TR-003
#[test]
fn ranks_beyond_the_last_row_share_it_and_neighbours_in_the_place_itself_are_near() {
    let three = scene(&[(4, 0), (14, 0), (30, 0)], &[10], 3, predicting(3));
    let mut network = reading(NetworkHeader { rank_count: 2, ..PLAIN });
    network.set("rank_embedding", 0, 0, 640);
    network.set("rank_embedding", 1, 0, 1280);
    // 10, 20, 20.
    assert_eq!(added("ranks", &three, network), [17, 0, 0]);
    let alone = scene(&[(10, 0), (10, 9)], &[10], 3, predicting(2));
    let mut network = reading(NetworkHeader { geometry_width: 1, ..PLAIN });
    network.set("geometry", 0, 0, 127);
    network.set("geometry_bias", 0, 0, 640);
    network.set("geometry_embedding", 0, 0, 64);
    network.set("embedding", 1, 10, 64);
    assert_eq!(added("in the place itself", &alone, network), [10, 0, 0]);
}

/// A network that adds the same to every component.
fn constant(dc_count: u8, sh_count: u8, value: i64) -> Network {
    let mut network = zeros(NetworkHeader { dc_count, sh_count, ..PLAIN });
    (0..usize::from(dc_count + sh_count)).for_each(|k| network.set("head_bias", 0, k, 64 * value));
    network
}

// covers: SS-TR-008
#[test]
fn outputs_go_through_the_transforms_of_the_frame_as_far_as_these_have_components() {
    let mut scene = unlike();
    scene.gops[0].network = Some(constant(2, 4, 100));
    assert_decodes("four outputs for two components", &scene);
    // dc by 4096, sh by 1234, whose rank is 2: Round(123400, 12) is 30.
    assert_eq!((shown(&scene, DC), shown(&scene, SH)), ([6430, 30, -70], [656, 39, 9]));
    let dense = &mut scene.gops[0].transforms[0];
    (dense.header.rank, dense.basis) = (1, vec![4096, -2048, 5]);
    for new in
        scene.gops[0].frames.iter_mut().flat_map(|frame| &mut frame.units).flat_map(|unit| &mut unit.new)
    {
        new.dc.truncate(1);
    }
    assert_decodes("two outputs for one component", &scene);
    // Without outputs dc is 6330, -3270 and -62.
    assert_eq!((shown(&scene, DC), shown(&scene, SH)), ([6430, -3320, -62], [656, 39, 9]));
    scene.gops[0].frames[1].sh_transform = NO_TRANSFORM;
    assert_decodes("no transform", &scene);
    assert_eq!((shown(&scene, DC), shown(&scene, SH)), ([6430, -3320, -62], [626, 9, 9]));
    scene.gops[0].network = Some(constant(0, 16, 100));
    assert_decodes("no transform and no dc", &scene);
    assert_eq!(shown(&scene, DC), [6330, -3270, -62]);
}

// covers: SS-TR-008
#[test]
fn predictions_stay_within_two_to_the_30() {
    for sign in [1, -1] {
        let mut scene = two();
        scene.gops[0].transforms[0] = diagonal(3, 0, 3, 3, 4096, sign * ((1 << 30) - 5));
        scene.gops[0].network = Some(constant(3, 0, i64::from(sign) * 6));
        assert_decodes("clamped", &scene);
        assert_eq!(shown(&scene, DC), [sign << 30; 3]);
        scene.gops[0].network = Some(constant(3, 0, i64::from(sign) * -6));
        assert_decodes("not clamped", &scene);
        assert_eq!(shown(&scene, DC), [sign * ((1 << 30) - 11); 3]);
    }
}

// covers: SS-TR-009
#[test]
fn the_largest_sums_are_exact() {
    let mut known = vec![(4, -9000), (14, 9000)];
    known.extend((0..14).map(|place| (20 + 3 * place, 500 * place - 3000)));
    let mut scene = scene(&known, &[10, 17, 1000], 3, predicting(16));
    for (known, number) in scene.gops[0].frames[0].units[0].new.iter_mut().zip(0..) {
        known.dc = vec![900 * number - 8000, -900 * number + 8000, number];
    }
    for header in [
        NetworkHeader { network_flags: 0, ..WIDEST },
        WIDEST,
        NetworkHeader { network_flags: NORMALISED, layer_shift: [1; 8], ..WIDEST },
        NetworkHeader { layer_shift: [15; 8], ..WIDEST },
    ] {
        let corners: [fn(i64, i64, i64) -> i64; 4] = [
            |_, least, _| least,
            |_, _, most| most,
            |place, least, most| [least, most][(place % 2) as usize],
            |place, least, most| [least, most][(place * place / 7 % 2) as usize],
        ];
        for corner in corners {
            let mut place = 0;
            let network = Network::new(header, |_, least, most| {
                place += 1;
                corner(place, least, most)
            });
            scene.gops[0].network = Some(network);
            assert_decodes("corners", &scene);
        }
    }
}

/// Every element at the end of its range.
const WIDEST: NetworkHeader = NetworkHeader {
    network_flags: FULL_ATTENTION | GATED | NORMALISED,
    width_log2: 6,
    feed_forward_width: 128,
    geometry_width: 32,
    fourier_count: 4,
    rank_count: 16,
    dc_count: 3,
    sh_count: 16,
    token_shift: 0,
    output_shift: 4,
    layer_shift: [8; 8],
};

// covers: SS-TR-010
#[test]
fn the_sine_of_the_decoder_is_that_of_the_text() {
    assert_eq!((SINE.len(), SINE[0], SINE[43], SINE[128]), (129, 0, 64, 127));
    assert!(splatstream_decoder::transformer::SINE.iter().zip(SINE.iter()).all(|(a, b)| i64::from(*a) == *b));
    assert!((-5000..5000).all(|x| i64::from(splatstream_decoder::transformer::sine(x)) == sine(x.into())));
}

// covers: SS-PR-003, SS-PR-008, SS-TR-004
#[test]
fn a_unit_mixes_the_network_with_other_predictors() {
    let network = constant(3, 0, 100);
    let mut mixed = scene(&[(4, 6), (14, 20)], &[10, 11, 12, 13, 14], 3, predicting(2));
    mixed.gops[0].network = Some(network);
    unit(&mut mixed).new.iter_mut().zip(1..).for_each(|(new, opacity)| new.opacity = opacity);
    let dc = |scene: &Scene| {
        assert_decodes("mixed", scene);
        planes(&decode(&scene.bytes()).frames.last().unwrap().planes)[DC][2..].to_vec()
    };
    for (log2, predictors, expected) in [
        (0, vec![3, 2, 3, 1, 0], [30, -70, 30, -70, -70]),
        (1, vec![0, 3, 2], [-70, -70, 30, 30, -70]),
        (2, vec![1, 3], [-70, -70, -70, -70, 30]),
        (16, vec![3], [30; 5]),
    ] {
        unit(&mut mixed).header.predictor_block_log2 = log2;
        unit(&mut mixed).predictors = predictors;
        assert_eq!(dc(&mixed), expected, "{log2}");
    }
}

// covers: SS-PR-001, SS-PR-003
#[test]
fn intra_frames_predict_from_lower_homes_and_layers_with_the_network() {
    let of = |spatial, refinement, x: &[i64], predictor| Unit {
        spatial,
        refinement,
        header: predicting(2),
        new: line(&x.iter().map(|&x| (x, 0)).collect::<Vec<_>>()),
        predictors: vec![predictor; x.len()],
        ..Unit::default()
    };
    // There is nothing to predict from in unit (0, 0): its predictors are not used, and no error.
    let first = of(0, 0, &[10, 20], 3);
    let second = of(0, 1, &[12, 30], 3);
    let upper = Unit { modes: vec![0, 0], ..of(1, 0, &[15], 3) };
    let last = Unit { modes: vec![0, 2], updates: line(&[(0, 5)]), ..of(1, 1, &[16], 3) };
    let mut scene = gop(&[50, 100], vec![frame(0, vec![first, second, upper, last])]);
    scene.sequence.spatial_layer_count = 2;
    scene.gops[0].network = Some(constant(3, 2, 10));
    assert_decodes("intra", &scene);
    let frame = &decode(&scene.bytes()).frames[0];
    // Each step away from the first two adds 10; means of -70 and -60 are -65.
    assert_eq!(planes(&frame.planes)[DC], [-70, -70, -60, -60, -60, -55]);
}
