//! Valid streams: the encoder is given a small scene and settings, and what it writes is accepted, has the digests of
//! what the encoder reconstructed, and keeps every law of streams.

use crate::decode::choice;
use crate::laws::{self, Decoded, VERIFIED};
use crate::small_scene::scene;
use arbitrary::{Result, Unstructured};
use splatstream_encoder::{
    Anchor, Error, Fidelity, Importance, NetworkSource, PredictorChoice, Predictors, Preset, Quality, Report,
    Settings, ShChoice, Structure, Tools, encode,
};
use splatstream_format::arbitrary_stream;
use splatstream_gaussians::{GaussianFrame, MAX_SH_DEGREE};

/// The input is what scene and settings are made of.
pub fn run(data: &[u8]) {
    let mut u = Unstructured::new(data);
    // Fails only where the bytes do not suffice.
    let Ok((settings, mut frames)) = settings(&mut u).and_then(|settings| Ok((settings, scene(&mut u)?)))
    else {
        return;
    };
    let Some((bytes, report)) = encoded(&mut frames, &settings) else { return };
    assert!(
        encoded(&mut frames, &settings).is_some_and(|again| again.0 == bytes),
        "encoded twice, it differs"
    );
    let decoded = Decoded::of(&bytes, &VERIFIED);
    assert_eq!(decoded.errors, [], "what is encoded decodes");
    assert_eq!(decoded.frames.len(), frames.len());
    let digests = decoded.frames.iter().map(|frame| frame.digest.expect("it was asked for"));
    assert!(digests.eq(report.digests), "frames are not what the encoder reconstructed");
    laws::hold(&bytes, choice(data));
}

/// The stream and its report; none if the scene does not fit on the grids that the settings ask for.
fn encoded(frames: &mut Vec<GaussianFrame>, settings: &Settings) -> Option<(Vec<u8>, Report)> {
    let mut bytes = Vec::new();
    match encode(frames, settings, &mut bytes, &mut |_, _| ()) {
        Ok(report) => Some((bytes, report)),
        Err(Error::OutOfGrid { .. }) => None,
        Err(error) => panic!("{error}"),
    }
}

/// Settings in their ranges. Nothing is rendered and nothing is trained: that takes time, and says nothing of streams.
fn settings(u: &mut Unstructured<'_>) -> Result<Settings> {
    let quality = *u.choose(&[Quality::Low, Quality::Medium, Quality::High, Quality::VisuallyLossless])?;
    let layers = u.int_in_range(0..=4)?;
    Ok(Settings {
        preset: *u.choose(&[Preset::Fast, Preset::Balanced, Preset::Small])?,
        steps: quality.steps(),
        gop: u.int_in_range(1..=4)?,
        anchor: *u.choose(&[Anchor::Nested, Anchor::Whole])?,
        structure: if layers == 0 { Structure::Intra } else { Structure::Predicted { layers } },
        spatial_layers: u.int_in_range(1..=4)?,
        predictors: *u.choose(&[Predictors::ALL, Predictors::NONE])?,
        predictor_choice: *u.choose(&[PredictorChoice::Bits, PredictorChoice::Difference])?,
        neighbours: u.int_in_range(1..=16)?,
        network: Some(network(u)?),
        refinements: refinements(u)?,
        sh_degree: if u.arbitrary()? { Some(u.int_in_range(0..=MAX_SH_DEGREE)?) } else { None },
        sh: *u.choose(&[ShChoice::Auto, ShChoice::Coefficients, ShChoice::VectorQuantised])?,
        keep_invisible: u.arbitrary()?,
        importance: Some(Importance::Volume),
        fidelity: Some(Fidelity::Attributes),
        tools: tools(u)?,
        block_log2: u.int_in_range(6..=16)?,
        ..Settings::default()
    })
}

fn network(u: &mut Unstructured<'_>) -> Result<NetworkSource> {
    if u.arbitrary()? {
        return Ok(NetworkSource::Registered);
    }
    let network = arbitrary_stream::weights(u)?.network(0).expect("what a stream may hold is a network");
    Ok(NetworkSource::Given(Box::new(network)))
}

/// Rising percentages, the last of them 100.
fn refinements(u: &mut Unstructured<'_>) -> Result<Vec<u8>> {
    let mut percents = Vec::new();
    for _ in 0..u.int_in_range(0..=4)? {
        percents.push(u.int_in_range(1..=99)?);
    }
    percents.push(100);
    percents.sort_unstable();
    percents.dedup();
    Ok(percents)
}

fn tools(u: &mut Unstructured<'_>) -> Result<Tools> {
    Ok(Tools {
        contexts: u.arbitrary()?,
        axis_sort: u.arbitrary()?,
        sh_transform: u.arbitrary()?,
        table_reuse: u.arbitrary()?,
        adaptive_steps: u.arbitrary()?,
        cell_motion: u.arbitrary()?,
        survivors: u.arbitrary()?,
    })
}
