//! The learned predictor: what the encoder trains and chooses, a decoder reproduces.

use crate::common::dynamic::{coded, predicted, scene};
use crate::common::{decoded, encoded, strict};
use splatstream_decoder::operating_point::{OperatingPoint, extract};
use splatstream_decoder::predictor::Predictor;
use splatstream_decoder::process::Options;
use splatstream_encoder::transformer::Architecture;
use splatstream_encoder::{NetworkSource, PredictorChoice, Predictors, Preset, Settings, ShChoice};
use splatstream_files::builtin::Tracking;
use splatstream_format::Limits;
use splatstream_format::payload::Weights;
use splatstream_format::syntax::UnitType;
use splatstream_format::unit::Stream;
use splatstream_gaussians::GaussianFrame;

/// A network for every new Gaussian, trained on the frames.
fn settings() -> Settings {
    Settings {
        predictors: Predictors::always(Predictor::Transformer),
        network: Some(NetworkSource::Trained(Architecture { sh_count: 4, ..Architecture::default() })),
        sh: ShChoice::Coefficients,
        spatial_layers: 2,
        ..predicted(2)
    }
}

fn frames() -> Vec<GaussianFrame> {
    scene(2000, 4, 1, Tracking::Untracked)
}

fn weights(bytes: &[u8]) -> Vec<Weights> {
    let stream = Stream::open(bytes, &Limits::default()).unwrap();
    let units = stream.units().map(Result::unwrap);
    let weights = units.filter(|unit| unit.header.unit_type() == UnitType::Weights);
    weights.map(|unit| Weights::parse(unit.payload, unit.payload_at).unwrap()).collect()
}

#[test]
fn a_trained_network_is_carried_and_predicts() {
    let (bytes, report) = coded(&frames(), &settings(), "a trained network");
    let learned: u64 = report.coded.iter().map(|frame| frame.predicted[3]).sum();
    let new: u64 = report.coded.iter().map(|frame| u64::from(frame.new)).sum();
    assert!(learned * 2 > new, "{learned} of {new}");
    assert!(matches!(weights(&bytes).as_slice(), [Weights::Carried(_)]));
    // Every operating point decodes alike from its extraction.
    for point in ["s0,t0,r0", "s1,t0,r1", "s1,t1,r0"] {
        let point: OperatingPoint = point.parse().unwrap();
        let direct = decoded(&bytes, &Options { operating_point: point, ..strict() });
        assert_eq!(direct.1.verdict(), None);
        let extracted = extract(&bytes, point, &Limits::default()).unwrap();
        assert_eq!(decoded(&extracted, &strict()).0, direct.0, "{point}");
    }
}

#[test]
fn training_and_choice_do_not_depend_on_threads() {
    let by = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| encoded(frames(), &settings()).0)
    };
    assert!(by(1) == by(2));
}

#[test]
fn a_gop_without_use_for_a_network_has_none() {
    let still = vec![scene(1000, 1, 0, Tracking::Tracked).remove(0); 3];
    let trained = Some(NetworkSource::Trained(Architecture::default()));
    let auto = Settings { network: trained, spatial_layers: 1, ..predicted(1) };
    assert!(weights(&encoded(still.clone(), &auto).0).is_empty());
    let none = Settings { predictors: Predictors::NONE, ..settings() };
    assert!(weights(&encoded(frames(), &none).0).is_empty());
    // Among other predictors there is none, unless much is tried or one is given.
    let fast = Settings { network: None, predictors: Predictors::ALL, preset: Preset::Fast, ..settings() };
    assert!(weights(&encoded(frames(), &fast).0).is_empty());
}

#[test]
fn a_given_network_predicts_another_sequence() {
    let [Weights::Carried(network)] = &weights(&encoded(frames(), &settings()).0)[..] else { panic!() };
    let given = Some(NetworkSource::Given(network.clone()));
    // Of degree 0: what the network says of sh stands for nothing.
    let other = scene(1500, 3, 0, Tracking::Untracked);
    let each = PredictorChoice::Difference;
    let settings = Settings { network: given, predictor_choice: each, ..settings() };
    let (bytes, report) = coded(&other, &settings, "a given network");
    assert!(report.coded.iter().any(|frame| frame.predicted[3] > 0));
    assert_eq!(weights(&bytes), [Weights::Carried(network.clone())]);
}
