//! Speed against size: presets, fitting to pictures and tools, on one front for encoding and on one for decoding.
//!
//! Each is encoded for two qualities around the one of comparison. Its size is what its curve takes for the PSNR that the baseline
//! has in the middle, in views by which no encoder chose anything. Times are of all threads together, so that other work on the
//! machine changes them less than those on the clock.

mod choices;
mod row;

use super::gop;
use super::measure::{decoded, encoded};
use super::picture_comparison::Judge;
use super::sweep::{Group, Sweep, Variant};
use super::timing::Timing;
use super::variant_comparison::pareto_front;
use crate::Error;
use crate::Progress;
pub(crate) use row::{FrontRow, Place};
use splatstream_decoder::operating_point::OperatingPoint;
use splatstream_encoder::Settings;
use splatstream_gaussians::GaussianFrame;
use splatstream_render::metrics::{RatePoint, rate_at_quality};

/// The qualities of a setting lie so far below and above the one of comparison, decibels.
const APART: f32 = 2.0;

/// Where the PSNR of comparison lies outside a curve, another quality is tried that goes so much farther than what is missed,
/// decibels.
const BEYOND: f64 = 0.5;

/// Qualities of a setting, at most.
const MOST_POINTS: usize = 4;

/// Encodings that take longer are timed once, seconds: beside them noise is small.
const LONG: f64 = 2.0;

/// The settings that stand on the front: of single frames, or of a GOP with predicted frames.
pub(crate) fn contenders(sweep: &Sweep, (frames, sh_degree): (u32, u8)) -> Vec<Variant> {
    let is_gop = frames > 1;
    // Frames of predicted GOPs are not fitted to pictures.
    let is_there = |variant: &&Variant| !(is_gop && variant.group == Group::Fitted);
    let mut variants: Vec<Variant> = sweep.efforts.iter().filter(is_there).cloned().collect();
    if is_gop {
        for variant in &mut variants {
            variant.settings = Settings { finetune: None, ..gop::settings(variant.settings.clone(), frames) };
        }
    }
    let baseline = variants.iter().find(|variant| variant.group == Group::Baseline).cloned();
    if let Some(baseline) = baseline.filter(|_| sweep.choices) {
        variants.extend(choices::choices(&baseline.settings, is_gop, sh_degree));
    }
    variants
}

/// A setting at some qualities.
struct Measured<'a> {
    variant: &'a Variant,
    /// PSNR asked for, and what it took.
    points: Vec<(f32, RatePoint)>,
    encode: Timing,
    decode: Timing,
    /// Gaussians coded, over all frames.
    gaussians: u64,
}

/// Measures all settings on some frames, which are the first ones of the judge.
///
/// # Errors
/// The encoder refuses a frame, or there is no camera.
pub(crate) fn measure(
    frames: &mut Vec<GaussianFrame>,
    variants: &[Variant],
    sweep: &Sweep,
    judge: &mut Judge<'_>,
    progress: &dyn Progress,
) -> Result<Vec<FrontRow>, Error> {
    let middle = sweep.quality().decibels();
    let mut all: Vec<Measured<'_>> = Vec::new();
    let mut compared = None;
    for variant in variants {
        progress.step(format!("speed against size: {}", variant.name));
        let mut measured = Measured::new(variant, frames, (middle, sweep.repeat), judge)?;
        // The baseline, which comes first, says where all are compared.
        let psnr = *compared.get_or_insert_with(|| measured.mean_psnr());
        measured.reach(psnr, frames, judge)?;
        progress.advance();
        all.push(measured);
    }
    let mut rows = rows(&all, compared.unwrap_or(f64::NAN), frames);
    let is_effort = |row: &FrontRow| matches!(row.group, Group::Baseline | Group::Preset | Group::Fitted);
    let encoding = places(&rows, is_effort, |row| row.encode.work());
    let decoding = places(&rows, |_| true, |row| row.decode.work());
    for (row, (encoding, decoding)) in rows.iter_mut().zip(encoding.into_iter().zip(decoding)) {
        (row.encoding, row.decoding) = (encoding, decoding);
    }
    Ok(rows)
}

/// What each setting takes at a PSNR, not placed yet. The baseline comes first.
fn rows(all: &[Measured<'_>], psnr_db: f64, frames: &[GaussianFrame]) -> Vec<FrontRow> {
    let of_source: u64 = frames.iter().map(|frame| frame.len() as u64).sum();
    let bits =
        |one: &Measured<'_>| Some(rate_at_quality(&one.curve(), psnr_db)? * 8.0 / of_source.max(1) as f64);
    let of_baseline = all.first().and_then(bits);
    let row = |one: &Measured<'_>| {
        let bpg = bits(one);
        FrontRow {
            name: one.variant.name.clone(),
            group: one.variant.group,
            is_predicted: frames.len() > 1,
            psnr_db,
            bpg,
            more_percent: bpg.zip(of_baseline).map(|(bits, first)| 100.0 * (bits / first - 1.0)),
            gaussians: one.gaussians,
            encode: one.encode,
            decode: one.decode,
            encoding: Place::Apart,
            decoding: Place::Apart,
        }
    };
    all.iter().map(row).collect()
}

/// Where each row stands among those that are compared: less time and fewer bits are better.
fn places(
    rows: &[FrontRow],
    is_compared: impl Fn(&FrontRow) -> bool,
    seconds: impl Fn(&FrontRow) -> f64,
) -> Vec<Place> {
    let cost = |row: &FrontRow| Some((seconds(row), row.bpg?));
    let compared = rows.iter().filter(|row| is_compared(row));
    let compared: Vec<(&FrontRow, (f64, f64))> = compared.filter_map(|row| Some((row, cost(row)?))).collect();
    let better: Vec<(f64, f64)> = compared.iter().map(|(_, (time, bits))| (-time, -bits)).collect();
    let front: Vec<_> = pareto_front(&better).into_iter().filter_map(|place| compared.get(place)).collect();
    let place = |row: &FrontRow| {
        let Some((time, bits)) = cost(row).filter(|_| is_compared(row)) else { return Place::Apart };
        if front.iter().any(|(other, _)| other.name == row.name) {
            return Place::OnFront;
        }
        let beats = front.iter().filter(|(_, other)| other.0 <= time && other.1 <= bits);
        let best = beats.min_by(|(_, a), (_, b)| a.1.total_cmp(&b.1));
        best.map_or(Place::Apart, |(other, _)| Place::BeatenBy(other.name.clone()))
    };
    rows.iter().map(place).collect()
}

impl<'a> Measured<'a> {
    /// At two qualities around the one of comparison.
    fn new(
        variant: &'a Variant,
        frames: &mut Vec<GaussianFrame>,
        (middle, repeat): (f32, u32),
        judge: &mut Judge<'_>,
    ) -> Result<Self, Error> {
        let (mut points, mut encode, mut decode) = (Vec::new(), Vec::new(), Vec::new());
        let mut gaussians = 0;
        for decibels in [middle - APART, middle + APART] {
            let settings = variant.at_decibels(decibels);
            let (stream, count, once) = encoded(frames, &settings, 1)?;
            let again = if once.work() < LONG { repeat.saturating_sub(1) } else { 0 };
            encode.push(once);
            if again > 0 {
                encode.push(encoded(frames, &settings, again)?.2);
            }
            decode.push(decoded(&stream, OperatingPoint::ALL, repeat)?);
            points.push((decibels, rate_point(&stream, judge)?));
            gaussians = count;
        }
        let (encode, decode) = (Timing::over(&encode), Timing::over(&decode));
        Ok(Self { variant, points, encode, decode, gaussians })
    }

    /// Bytes, and PSNR in views by which nothing was chosen.
    fn curve(&self) -> Vec<RatePoint> {
        self.points.iter().map(|&(_, point)| point).collect()
    }

    fn mean_psnr(&self) -> f64 {
        self.points.iter().map(|(_, point)| point.quality).sum::<f64>() / self.points.len().max(1) as f64
    }

    /// Adds qualities until a PSNR lies between two.
    fn reach(
        &mut self,
        psnr: f64,
        frames: &mut Vec<GaussianFrame>,
        judge: &mut Judge<'_>,
    ) -> Result<(), Error> {
        while rate_at_quality(&self.curve(), psnr).is_none() && self.points.len() < MOST_POINTS {
            let apart = |point: &&(f32, RatePoint)| (point.1.quality - psnr).abs();
            let nearest = self.points.iter().min_by(|a, b| apart(a).total_cmp(&apart(b)));
            let Some(&(asked, point)) = nearest else { return Ok(()) };
            let missed = psnr - point.quality;
            let decibels = asked + (missed + BEYOND.copysign(missed)) as f32;
            let (stream, ..) = encoded(frames, &self.variant.at_decibels(decibels.clamp(20.0, 90.0)), 1)?;
            self.points.push((decibels, rate_point(&stream, judge)?));
        }
        Ok(())
    }
}

/// The size of a stream and what it looks like.
fn rate_point(stream: &[u8], judge: &mut Judge<'_>) -> Result<RatePoint, Error> {
    let figures = gop::shown(stream, OperatingPoint::ALL, judge)?.figures(|_| true)?;
    Ok(RatePoint { rate: stream.len() as f64, quality: figures.psnr_db })
}

#[cfg(test)]
mod tests {
    use super::*;
    use splatstream_files::builtin::BuiltinScene;
    use splatstream_render::camera::{Up, ring};

    fn row(name: &str, group: Group, seconds: f64, bpg: Option<f64>) -> FrontRow {
        let timing = Timing { median: seconds, least: seconds, most: seconds, processor: None };
        FrontRow {
            name: name.to_owned(),
            group,
            is_predicted: false,
            psnr_db: 50.0,
            bpg,
            more_percent: None,
            gaussians: 1000,
            encode: timing,
            decode: timing,
            encoding: Place::Apart,
            decoding: Place::Apart,
        }
    }

    #[test]
    fn what_takes_longer_and_is_larger_is_beaten_by_the_smallest_that_is_faster() {
        let rows = [
            row("balanced", Group::Baseline, 2.0, Some(40.0)),
            row("fast", Group::Preset, 0.3, Some(55.0)),
            row("small", Group::Preset, 10.0, Some(39.9)),
            row("fitted", Group::Fitted, 9.0, Some(36.0)),
            row("blurred", Group::Fitted, 9.0, None),
            row("without", Group::Without, 0.1, Some(30.0)),
        ];
        let places = places(&rows, |row| row.group != Group::Without, |row| row.encode.work());
        let beaten = Place::BeatenBy("fitted".to_owned());
        let expected = [Place::OnFront, Place::OnFront, beaten, Place::OnFront, Place::Apart, Place::Apart];
        assert_eq!(places, expected);
    }

    struct Silent;

    impl Progress for Silent {
        fn step(&self, _: String) {}
        fn advance(&self) {}
    }

    fn sweep(efforts: Vec<Variant>, choices: bool) -> Sweep {
        let qualities = vec![splatstream_encoder::Quality::Medium];
        Sweep { variants: Vec::new(), qualities, refinements: vec![50, 100], repeat: 1, efforts, choices }
    }

    fn effort(name: &str, group: Group, preset: splatstream_encoder::Preset) -> Variant {
        let settings = Settings { preset, refinements: vec![50, 100], ..Settings::default() };
        Variant { name: name.to_owned(), group, reorders: false, settings }
    }

    #[test]
    fn settings_are_compared_at_the_psnr_of_the_baseline() {
        use splatstream_encoder::Preset;
        let scene = BuiltinScene { gaussians: 3000, frames: 1, sh_degree: 1, ..BuiltinScene::default() };
        let mut frames = vec![scene.frame(0)];
        let efforts = vec![
            effort("balanced", Group::Baseline, Preset::Balanced),
            effort("fast", Group::Preset, Preset::Fast),
        ];
        let sweep = sweep(efforts, true);
        let mut variants = contenders(&sweep, (1, 1));
        assert_eq!(variants.len(), 2 + 7);
        variants.retain(|variant| ["balanced", "fast", "without contexts"].contains(&variant.name.as_str()));
        let cameras = ring(&frames[0], Up::default(), 2, 60);
        let sources = frames.clone();
        let mut judge = Judge::new(&sources, cameras, None, || ());
        let rows = measure(&mut frames, &variants, &sweep, &mut judge, &Silent).unwrap();
        assert_eq!(rows.len(), variants.len());
        let of = |name: &str| rows.iter().find(|row| row.name == name).unwrap();
        assert_eq!(of("balanced").more_percent, Some(0.0));
        assert!(rows.iter().all(|row| row.bpg.is_some_and(|bits| bits > 1.0)), "{rows:?}");
        // What contexts save costs nothing but time.
        assert!(of("without contexts").bpg > of("balanced").bpg, "{rows:?}");
        assert_eq!(of("without contexts").encoding, Place::Apart);
        assert!(rows.iter().any(|row| row.decoding == Place::OnFront));
    }

    #[test]
    fn a_gop_is_not_fitted_and_has_predictors_to_choose_from() {
        use splatstream_encoder::{Finetune, Preset};
        let mut small = effort("small", Group::Preset, Preset::Small);
        small.settings.finetune = Some(Finetune::default());
        let mut fitted = effort("balanced, 5 iterations", Group::Fitted, Preset::Balanced);
        fitted.settings.finetune = Some(Finetune::default());
        let sweep = sweep(vec![effort("balanced", Group::Baseline, Preset::Balanced), small, fitted], true);
        let variants = contenders(&sweep, (4, 0));
        assert!(variants.iter().all(|variant| variant.settings.finetune.is_none()));
        assert!(variants.iter().all(|variant| variant.group != Group::Fitted));
        let names: Vec<&str> = variants.iter().map(|variant| variant.name.as_str()).collect();
        assert!(names.contains(&"small") && names.contains(&"predictor none"), "{names:?}");
        assert!(!names.contains(&"SH in a codebook"), "there are none: {names:?}");
    }
}
