//! Layers and predicted frames: what the encoder reconstructs is what the decoder reconstructs, near the source.

use crate::common::closeness::{Bounds, assert_close};
use crate::common::dynamic::{Whole, coded, predicted, quick, scene};
use crate::common::{Random, frame_of};
use proptest::prelude::*;
use splatstream_decoder::predictor::Predictor;
use splatstream_encoder::transformer::Architecture;
use splatstream_encoder::{
    NetworkSource, PredictorChoice, Predictors, Preset, Settings, ShChoice, Steps, Structure, Tools,
};
use splatstream_files::builtin::Tracking;
use splatstream_format::payload::{Layer, Network, Part};
use splatstream_format::syntax::FrameType;
use splatstream_gaussians::GaussianFrame;

fn structures() -> impl Iterator<Item = Structure> {
    [Structure::Intra].into_iter().chain((1..=4).map(|layers| Structure::Predicted { layers }))
}

// covers: SS-BS-009, SS-BS-004, SS-DG-003, SS-DG-004
#[test]
fn every_number_of_layers_decodes_to_the_digests_of_the_encoder() {
    for structure in structures() {
        for spatial_layers in 1..=4 {
            if structure == Structure::Intra && spatial_layers == 1 {
                continue;
            }
            for tracking in [Tracking::Tracked, Tracking::Untracked] {
                let settings = Settings { structure, spatial_layers, gop: 5, ..quick() };
                let frames = scene(100, 6, spatial_layers - 1, tracking);
                let what = format!("{spatial_layers} spatial layers, {structure:?}, {tracking:?}");
                coded(&frames, &settings, &what);
            }
        }
    }
}

// covers: SS-GH-003, SS-BS-010
#[test]
fn gops_of_any_length_have_their_frames() {
    let frames = scene(100, 12, 0, Tracking::Tracked);
    for gop in [1, 2, 3, 5, 6, 7, 11, 12, 100] {
        for layers in 1..=4 {
            let what = format!("{gop} frames, {layers} layers");
            let (bytes, report) = coded(&frames, &Settings { gop, ..predicted(layers) }, &what);
            let whole = Whole::new(&bytes);
            let lengths: Vec<u32> = whole.gops.iter().map(|(_, gop)| gop.gop_frame_count).collect();
            let expected: Vec<u32> =
                (0..12).step_by(gop as usize).map(|first: u32| gop.min(12 - first)).collect();
            assert_eq!(lengths, expected, "{what}");
            for (number, frame) in (0..).zip(&report.coded) {
                let intra = number % gop == 0;
                assert_eq!(frame.frame_type == FrameType::Intra, intra, "{what}: frame {number}");
            }
        }
    }
}

#[test]
fn harmonics_of_every_degree_are_coded_either_way() {
    for degree in 0..=3 {
        let frames = scene(150, 4, degree, Tracking::Untracked);
        for sh in [ShChoice::Coefficients, ShChoice::VectorQuantised] {
            for spatial_layers in [1, 3] {
                let steps = Steps { sh: 0.02, ..quick().steps };
                let sh_degree = Some(degree);
                let tools = Tools::default();
                let settings = Settings { sh, steps, sh_degree, spatial_layers, tools, ..predicted(2) };
                let what = format!("degree {degree}, {sh:?}, {spatial_layers} spatial layers");
                let (bytes, report) = coded(&frames, &settings, &what);
                let codebook = degree > 0 && sh == ShChoice::VectorQuantised;
                assert_eq!(report.sh_codebook_entries > 0, codebook, "{what}");
                let whole = Whole::new(&bytes);
                for (frame, source) in whole.all().iter().zip(&frames) {
                    let bounds = Bounds { sh: !codebook, ..Bounds::PREDICTED };
                    let what = format!("{what}: frame {}", frame.index);
                    assert_close(source, &frame.planes, &whole.sequence, bounds, &what);
                }
            }
        }
    }
}

#[test]
fn the_same_bytes_with_one_thread_and_with_two() {
    let frames = scene(2000, 5, 2, Tracking::Untracked);
    let settings = Settings { spatial_layers: 2, ..predicted(2) };
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| coded(&frames, &settings, "threads"))
    };
    assert!(run(1) == run(2));
}

#[test]
fn intra_frames_in_layers_are_within_half_a_step_of_the_source() {
    let frames = scene(300, 2, 1, Tracking::Tracked);
    let steps = Steps { sh: 0.02, ..quick().steps };
    for spatial_layers in 2..=4 {
        let sh = ShChoice::Coefficients;
        let predictors = Predictors::NONE;
        let settings = Settings { spatial_layers, steps, sh, predictors, ..quick() };
        let (bytes, _) = coded(&frames, &settings, "layers");
        let whole = Whole::new(&bytes);
        for (frame, source) in whole.all().iter().zip(&frames) {
            let what = format!("{spatial_layers} layers, frame {}", frame.index);
            assert_close(source, &frame.planes, &whole.sequence, Bounds::INTRA, &what);
        }
    }
}

#[test]
fn predicted_gaussians_are_within_half_a_step_of_the_source() {
    let frames = scene(300, 1, 1, Tracking::Tracked);
    let steps = Steps { sh: 0.02, ..quick().steps };
    let (sh, predictor_choice) = (ShChoice::Coefficients, PredictorChoice::Difference);
    let settings = Settings { steps, sh, predictor_choice, ..predicted(1) };
    let (bytes, report) = coded(&frames, &settings, "predicted");
    assert!(report.coded[0].predicted[1] > 0);
    let whole = Whole::new(&bytes);
    assert_close(&frames[0], &whole.all()[0].planes, &whole.sequence, Bounds::INTRA, "predicted");
}

/// The lowest layer has all Gaussians with coarse steps, and each layer above brings some of the lists to their final ones.
#[test]
fn layers_have_all_gaussians_and_refine_one_list_after_the_other() {
    let frames = scene(300, 1, 0, Tracking::Tracked);
    let (bytes, _) = coded(&frames, &Settings { spatial_layers: 4, ..quick() }, "layers");
    let whole = Whole::new(&bytes);
    let last = whole.sequence.refinement_count - 1;
    let planes: Vec<_> = (0..4).map(|layer| whole.at(layer, 0, last)[0].planes.clone()).collect();
    // Half of a coarse step, of a place in its cell, and half of the finest, to which everything was rounded before.
    let bounds = Bounds { value: 2.0, colour: 2.0, place: 2.5, sh: false };
    for (layer, planes) in planes.iter().enumerate() {
        assert_eq!(planes.len(), 300, "layer {layer}");
        assert_close(&frames[0], planes, &whole.sequence, bounds, &format!("layer {layer}"));
    }
    // The lists end at 20, 50 and 100 per cent, and each layer refines one of them.
    for (refined, lower, upper) in [(0..60, 0, 1), (60..150, 1, 2), (150..300, 2, 3)] {
        let differs = |row: usize| planes[lower].opacity[row] != planes[upper].opacity[row];
        let changed: Vec<usize> = (0..300).filter(|&row| differs(row)).collect();
        assert!(!changed.is_empty() && changed.iter().all(|row| refined.contains(row)), "layer {upper}");
    }
}

/// Gaussians at the far end of the grid, which middles of coarse cells lie beyond.
#[test]
fn the_last_point_of_the_grid_is_reached_through_every_number_of_layers() {
    let mut frames = scene(100, 1, 0, Tracking::Tracked);
    let mut planes = frames.remove(0).into_planes();
    // 2^11 - 1 steps in a box that holds the inner 98 % as well.
    for (row, value) in planes.position[0].iter_mut().enumerate() {
        *value = if row % 2 == 0 { 0.0 } else { 2047.0 };
    }
    planes.position[1].fill(0.0);
    planes.position[2].fill(0.0);
    let frame = GaussianFrame::from_planes(0, planes).unwrap();
    let steps = Steps { position_bits: 2047.0_f32.log2(), ..quick().steps };
    for spatial_layers in 2..=4 {
        let settings = Settings { spatial_layers, steps, ..quick() };
        let (bytes, _) = coded(core::slice::from_ref(&frame), &settings, "the last point");
        let whole = Whole::new(&bytes);
        assert_eq!(whole.sequence.position_bits, 11);
        assert_eq!(whole.all()[0].planes.position[0].iter().max(), Some(&2047), "{spatial_layers} layers");
    }
}

#[test]
fn predicted_frames_are_within_one_and_a_half_steps_of_the_source() {
    let steps = Steps { sh: 0.02, ..quick().steps };
    let tools = Tools::default();
    for tracking in [Tracking::Tracked, Tracking::Untracked] {
        let frames = scene(300, 6, 1, tracking);
        for layers in [1, 3] {
            let sh = ShChoice::Coefficients;
            let settings = Settings { steps, sh, tools, spatial_layers: 2, ..predicted(layers) };
            let (bytes, _) = coded(&frames, &settings, "predicted");
            let whole = Whole::new(&bytes);
            for (frame, source) in whole.all().iter().zip(&frames) {
                let what = format!("{tracking:?}, {layers} layers, frame {}", frame.index);
                assert_close(source, &frame.planes, &whole.sequence, Bounds::PREDICTED, &what);
            }
        }
    }
}

/// A network that nobody has trained: whatever it says, residuals make up for it.
fn any_network() -> Network {
    let header = Architecture { dc_count: 3, sh_count: 9, ..Architecture::default() }.header().unwrap();
    let mut random = Random::new(7);
    let layers = Part::ALL.map(|part| {
        let (weights, biases) = part.lengths(&header);
        Layer {
            weights: (0..weights).map(|_| random.next() as i8).collect(),
            bias: (0..biases).map(|_| random.next() as i16 >> 6).collect(),
        }
    });
    Network::new(header, layers).unwrap()
}

fn settings() -> impl Strategy<Value = Settings> {
    let structure =
        prop_oneof![Just(Structure::Intra), (1_u8..=4).prop_map(|layers| Structure::Predicted { layers })];
    let sh = prop_oneof![Just(ShChoice::Auto), Just(ShChoice::Coefficients), Just(ShChoice::VectorQuantised)];
    let refinements = prop_oneof![Just(vec![100]), Just(vec![10, 20, 30, 50, 100]), Just(vec![1, 99, 100])];
    let predictors = prop_oneof![
        Just((Predictors::NONE, PredictorChoice::Bits)),
        Just((Predictors::ALL, PredictorChoice::Bits)),
        Just((Predictors::ALL, PredictorChoice::Difference)),
        Just((Predictors::always(Predictor::Transformer), PredictorChoice::Difference)),
    ];
    let preset = prop_oneof![Just(Preset::Fast), Just(Preset::Balanced)];
    let importance = Some(splatstream_encoder::Importance::Volume);
    let network = any_network();
    let tools =
        any::<[bool; 5]>().prop_map(|[contexts, table_reuse, adaptive_steps, cell_motion, survivors]| {
            Tools { contexts, table_reuse, adaptive_steps, cell_motion, survivors, ..Tools::default() }
        });
    (structure, 1_u8..=4, sh, refinements, predictors, tools, preset, 1_u32..6).prop_map(
        move |(structure, spatial_layers, sh, refinements, predictors, tools, preset, gop)| Settings {
            structure,
            spatial_layers: if structure == Structure::Intra {
                spatial_layers.max(2)
            } else {
                spatial_layers
            },
            sh,
            refinements,
            predictors: predictors.0,
            predictor_choice: predictors.1,
            network: Some(NetworkSource::Given(Box::new(network.clone()))),
            tools,
            preset,
            gop,
            importance,
            ..quick()
        },
    )
}

/// Frames that continue each other more or less: rows cut off, and every value moved. Where the first has no size, the
/// grid is as fine as can be.
fn frames() -> impl Strategy<Value = Vec<GaussianFrame>> {
    let number = prop_oneof![Just(0.0_f32), Just(1.0), -1.0..1.0_f32, -8.0..8.0_f32];
    let numbers = prop::collection::vec(number, 1..300);
    let counts = prop_oneof![Just(0_usize), Just(1), Just(2), Just(3), Just(65), 100..200_usize];
    let change = prop_oneof![Just(0.0_f32), Just(0.01), Just(0.3), -5.0..5.0_f32];
    (numbers, prop::collection::vec((counts, change), 1..5), 0_u8..=3).prop_map(
        |(numbers, changes, degree)| {
            let moved = |change: f32| numbers.iter().map(|number| number + change).collect::<Vec<_>>();
            changes.iter().map(|(count, change)| frame_of(&moved(*change), *count, degree)).collect()
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 50, ..ProptestConfig::default() })]

    #[test]
    fn any_frames_in_any_structure_decode_to_the_digests_of_the_encoder(frames in frames(), settings in settings()) {
        coded(&frames, &settings, "any");
    }
}
