//! Streams of the encoder, as small as it makes them.

use crate::{contexts, learned};
use splatstream_encoder::{
    Anchor, PredictorChoice, Preset, Quality, Settings, ShChoice, Steps, Structure, encode,
};
use splatstream_files::builtin::{BuiltinScene, Tracking};
use splatstream_format::Limits;
use splatstream_format::entropy::layout::Section;
use splatstream_format::payload::{Increment, Transform};
use splatstream_format::syntax::{Profile, SequenceParameters, ShMode, UnitType};
use splatstream_format::unit::Stream;

/// Name and bytes; each uses other parts of the syntax.
pub(crate) fn all() -> Vec<(String, Vec<u8>)> {
    intra().into_iter().chain(dynamic()).collect()
}

fn fast() -> Settings {
    Settings { preset: Preset::Fast, steps: Quality::Low.steps(), ..Settings::default() }
}

fn with_sh(degree: u8, sh: ShChoice) -> Settings {
    // A degree and a step with which the scene's faint harmonics are not left out.
    let steps = Steps { sh: 0.02, ..fast().steps };
    let refinements = vec![50, 100];
    Settings { preset: Preset::Balanced, sh_degree: Some(degree), sh, refinements, steps, ..fast() }
}

/// Streams of profile Intra.
fn intra() -> Vec<(String, Vec<u8>)> {
    let settings = [
        ("plain", 0, 1, Settings { refinements: vec![100], ..fast() }),
        ("groups", 1, 3, Settings { refinements: vec![30, 100], gop: 2, ..fast() }),
        ("coefficients", 3, 1, with_sh(3, ShChoice::Coefficients)),
        ("vectors", 2, 1, with_sh(2, ShChoice::VectorQuantised)),
        ("blocks", 0, 1, Settings { block_log2: 6, keep_invisible: true, ..fast() }),
    ];
    let encoded =
        settings.into_iter().map(|(name, sh, frames, settings)| (name, stream(sh, frames, &settings)));
    let by_hand = [("contexts", contexts::stream(&one_refinement()))];
    encoded.chain(by_hand).map(|(name, bytes)| (name.to_owned(), bytes)).collect()
}

/// Streams of profile Dynamic.
fn dynamic() -> Vec<(String, Vec<u8>)> {
    let (structure, predictor_choice) = (Structure::Predicted { layers: 2 }, PredictorChoice::Difference);
    let predicted = Settings { refinements: vec![30, 100], structure, predictor_choice, ..fast() };
    let layers = Settings { spatial_layers: 2, keep_invisible: true, ..predicted.clone() };
    let settings = [
        ("predicted", 0, 5, Settings { gop: 4, ..predicted }),
        ("layers", 1, 2, layers.clone()),
        ("anchors", 0, 4, Settings { anchor: Anchor::Whole, gop: 2, ..layers }),
        ("residual-vectors", 2, 3, Settings { structure, ..with_sh(2, ShChoice::VectorQuantised) }),
    ];
    let encoded = settings.map(|(name, sh, frames, settings)| (name, stream(sh, frames, &settings)));
    let made = [("learned", learned::stream())];
    encoded.into_iter().chain(made).map(|(name, bytes)| (name.to_owned(), bytes)).collect()
}

fn stream(sh_degree: u8, frames: u32, settings: &Settings) -> Vec<u8> {
    let scene = BuiltinScene { gaussians: 100, frames, seed: 7, tracking: Tracking::Tracked, sh_degree };
    let mut bytes = Vec::new();
    let mut frames: Vec<_> = (0..scene.frames).map(|number| scene.frame(number)).collect();
    encode(&mut frames, settings, &mut bytes, &mut |_, _| {}).unwrap();
    bytes
}

/// Everything at once, in blocks of 64.
fn one_refinement() -> SequenceParameters {
    let mut refinement_percent = [0; 10];
    refinement_percent[0] = 100;
    SequenceParameters {
        sh_degree: 1,
        spatial_layer_count: 1,
        temporal_layer_count: 1,
        refinement_count: 1,
        refinement_percent,
        position_bits: 10,
        block_log2: 6,
        sequence_flags: SequenceParameters::flags(true, false, false),
        size_weight: [100; 5],
        opacity_weight: [100; 3],
        anisotropy_weight: 100,
        opacity_reference: 10,
        anisotropy_reference: 20,
        frame_count: 1,
        ticks_per_second: 30,
        ticks_per_frame: 1,
        ..SequenceParameters::PLAIN
    }
}

/// Models of the first increments of streams of profile Intra, after what says which planes they are for.
pub(crate) fn model_sections() -> Vec<Vec<u8>> {
    intra().iter().map(|(_, bytes)| model_section(bytes)).collect()
}

fn model_section(bytes: &[u8]) -> Vec<u8> {
    let (limits, profile) = (Limits::default(), Profile::Intra);
    let units: Vec<_> = Stream::open(bytes, &limits).unwrap().units().map(Result::unwrap).collect();
    let of_type = |unit_type| units.iter().filter(move |unit| unit.header.unit_type() == unit_type);
    let first = of_type(UnitType::SequenceParameters).next().unwrap();
    let sequence = SequenceParameters::parse_payload(first.payload, first.payload_at, profile).unwrap();
    let ranks: Vec<u8> = of_type(UnitType::Transform)
        .map(|unit| Transform::parse(unit.payload, unit.payload_at, &sequence).unwrap().header.rank)
        .collect();
    let unit = of_type(UnitType::Increment).next().unwrap();
    let increment = Increment::parse(unit.payload, unit.payload_at, &sequence, profile, &limits).unwrap();
    let header = &increment.header;
    // As `splatstream_fuzz::records` takes them apart.
    let sh = match header.sh().mode() {
        Some(ShMode::VectorQuantised) => header.vq_stage_count + 2,
        _ => ranks.get(1).map_or(0, |rank| rank - 1),
    };
    let model = increment.section(Section::New).unwrap().model;
    [&[ranks[0] - 1, header.sh_mode, sh], model].concat()
}
