//! The first pass: what holds for all frames. Steps and grids, SH degree, sorted axes or not.

use crate::canonical::{canonicalise, visible};
use crate::entropy_cost::entropy_of;
use crate::error::Error;
use crate::grid::{MAX_COLOUR, MAX_DIFFERING, MAX_LOG_SCALE, MAX_OPACITY, check_reach, nearest_integer};
use crate::laws::{FEATURE_SHIFT, finest};
use crate::reach::{Core, Extent, Reach};
use crate::settings::{Settings, Size, Structure};
use crate::source::FrameSource;
use rayon::prelude::*;
use splatstream_decoder::colour::COMPONENT_RANGE;
use splatstream_format::Limits;
use splatstream_format::payload::SceneDescription;
use splatstream_format::syntax::{MAX_REFINEMENTS, Profile, SequenceParameters};
use splatstream_gaussians::{GaussianFrame, sh_coefficients};

/// Gaussians on which sorted and unsorted axes are compared.
const TRIAL: usize = 1 << 14;
/// Gaussians that a thread looks at at once, at least.
const AT_ONCE: usize = 1 << 14;

/// What the first pass found out.
pub(crate) struct Analysis {
    /// The parameters of the sequence.
    pub(crate) parameters: SequenceParameters,
    /// The lowest level that holds every frame.
    pub(crate) level: u8,
    /// Gaussians of the largest frame that can be seen.
    pub(crate) largest: usize,
    /// SH degree of the source.
    pub(crate) source_sh_degree: u8,
    /// Bits per Gaussian of scale and rotation with sorted axes, and as they come.
    pub(crate) axes_trial: [f64; 2],
    /// The corners of the box of all Gaussians that can be seen, scene units.
    pub(crate) bounds: Option<[[f32; 3]; 2]>,
    /// Gaussians of each frame, as it is read.
    pub(crate) counts: Vec<u32>,
}

impl Analysis {
    /// What the stream says of its scene: what the settings say, and the bounds.
    pub(crate) fn description(&self, settings: &Settings) -> SceneDescription {
        SceneDescription { bounds: self.bounds, ..settings.description.clone() }
    }
}

/// Looks at every frame once.
///
/// # Errors
/// A source that cannot be read or has no frame, settings and frames the bitstream cannot carry.
pub(crate) fn analyse(source: &mut dyn FrameSource, settings: &Settings) -> Result<Analysis, Error> {
    Survey::of(source, settings)?.analysis(settings, source.len())
}

/// What was seen of the frames of a sequence.
pub(crate) struct Survey {
    pub(crate) scene: Scene,
    /// The frame with the most Gaussians that can be seen, and their number.
    pub(crate) largest: (u32, usize),
    /// The SH degree that the frames need, and the one that they have.
    pub(crate) degree: u8,
    pub(crate) source_degree: u8,
    /// That of the frames with Gaussians, if there are any.
    antialiased: Option<bool>,
    axes_trial: [f64; 2],
    /// Gaussians of each frame.
    counts: Vec<u32>,
}

impl Survey {
    /// Looks at every frame once.
    ///
    /// # Errors
    /// As [`analyse`].
    pub(crate) fn of(source: &mut dyn FrameSource, settings: &Settings) -> Result<Self, Error> {
        check(settings)?;
        if source.is_empty() {
            return Err(Error::NoFrames);
        }
        let mut survey = Self {
            scene: Scene::new(),
            largest: (0, 0),
            degree: 0,
            source_degree: 0,
            antialiased: None,
            axes_trial: [0.0; 2],
            counts: Vec::new(),
        };
        for number in 0..source.len() {
            let frame = source.frame(number).map_err(|source| Error::Source { frame: number, source })?;
            survey.add(&frame, number, settings)?;
        }
        Ok(survey)
    }

    fn add(&mut self, frame: &GaussianFrame, number: u32, settings: &Settings) -> Result<(), Error> {
        self.counts.push(u32::try_from(frame.len()).unwrap_or(u32::MAX));
        let shown = visible(frame, settings.keep_invisible);
        check_reach(frame, &shown, (settings.steps.log_scale, settings.steps.opacity), number)?;
        if shown.len() > self.largest.1 {
            self.largest = (number, shown.len());
        }
        self.scene.add(frame, &shown);
        self.source_degree = self.source_degree.max(frame.sh_degree());
        self.degree = self.degree.max(needed_degree(frame, settings.steps.sh));
        if !frame.is_empty() && *self.antialiased.get_or_insert(frame.antialiased()) != frame.antialiased() {
            return Err(Error::Antialiasing { frame: number, value: frame.antialiased() });
        }
        if number == 0 {
            self.axes_trial = try_axes(frame, &shown, settings);
        }
        Ok(())
    }

    /// Frames that were looked at.
    pub(crate) fn frames(&self) -> usize {
        self.counts.len()
    }

    /// What holds for so many frames like these; 0: the number is not known.
    ///
    /// # Errors
    /// More Gaussians than a stream can carry.
    pub(crate) fn analysis(&self, settings: &Settings, frames: u32) -> Result<Analysis, Error> {
        let degree = settings.sh_degree.unwrap_or(self.degree).min(self.source_degree);
        let [sorted, unsorted] = self.axes_trial;
        // A Gaussian that changes keeps the names of its axes, so that predicted frames are not sorted.
        let sorts = settings.tools.axis_sort && settings.profile() == Profile::Intra;
        let canonical_axes = sorts && sorted <= unsorted;
        let antialiased = self.antialiased.unwrap_or(false);
        let flags = SequenceParameters::flags(canonical_axes, antialiased, settings.whole_anchor());
        let parameters = self.scene.parameters(settings, frames, degree, flags);
        let level = level(&parameters, self.largest)?;
        Ok(Analysis {
            parameters,
            level,
            largest: self.largest.1,
            source_sh_degree: self.source_degree,
            axes_trial: self.axes_trial,
            bounds: self.scene.extent.bounds(),
            counts: self.counts.clone(),
        })
    }
}

/// The lowest level for frames of which the largest has so many Gaussians.
fn level(sequence: &SequenceParameters, (frame, count): (u32, usize)) -> Result<u8, Error> {
    let highest = Limits::of_level(*Limits::LEVELS.end());
    let gaussians = u32::try_from(count).ok().filter(|&count| count <= highest.max_gaussians);
    let Some(gaussians) = gaussians else {
        return Err(Error::TooManyGaussians { frame, count, max: highest.max_gaussians });
    };
    let rate = sequence.gaussian_rate(gaussians);
    let asked = Limits { max_gaussians: gaussians, max_gaussian_rate: rate, ..Limits::of_level(1) };
    let max = highest.max_gaussian_rate;
    Limits::lowest_level(asked).ok_or(Error::TooManyPerSecond { frame, count, max })
}

/// Whether a stream can carry what the settings ask for.
///
/// # Errors
/// The first setting that none can.
pub(crate) fn check(settings: &Settings) -> Result<(), Error> {
    let percents = &settings.refinements;
    let increasing = percents.iter().zip(percents.iter().skip(1)).all(|(a, b)| a < b);
    let first = percents.first().is_some_and(|&first| first > 0);
    if !increasing || !first || percents.last() != Some(&100) || percents.len() > 10 {
        return Err(Error::Refinements(percents.clone()));
    }
    let setting = |name, value: String, allowed| Err(Error::Setting { name, value, allowed });
    if let Some(decibels) = settings.psnr.filter(|decibels| !(20.0..=90.0).contains(decibels)) {
        return setting("psnr", decibels.to_string(), "20 to 90");
    }
    match settings.size {
        Some(Size::BitsPerGaussian(bits)) if !(bits > 0.0 && bits.is_finite()) => {
            return setting("size", format!("{bits} bits per Gaussian"), "a finite number above 0");
        }
        Some(Size::Bytes(0)) => return setting("size", "0 bytes".into(), "1 or more"),
        _ => {}
    }
    if !(1.0..=20.0).contains(&settings.steps.position_bits) {
        return setting("position_bits", settings.steps.position_bits.to_string(), "1 to 20");
    }
    if let Some(decibels) = settings.prune {
        if !(20.0..=90.0).contains(&decibels) {
            return setting("prune", decibels.to_string(), "20 to 90");
        }
        if settings.structure != Structure::Intra {
            let allowed = "pruning of a single frame, or of a sequence without predicted frames (all-intra)";
            return setting("prune", format!("{decibels} dB in a sequence with predicted frames"), allowed);
        }
    }
    if !(settings.tolerance > 0.0 && settings.tolerance.is_finite()) {
        return setting("tolerance", format!("{} dB", settings.tolerance), "a finite number above 0");
    }
    if let Some(finetune) = &settings.finetune {
        finetune.check(settings)?;
    }
    if settings.gop == 0 {
        return setting("gop", "0".into(), "1 or more");
    }
    if !(1..=16).contains(&settings.neighbours) {
        return setting("neighbours", settings.neighbours.to_string(), "1 to 16");
    }
    if !(1..=4).contains(&settings.spatial_layers) {
        return setting("spatial_layers", settings.spatial_layers.to_string(), "1 to 4");
    }
    if let Structure::Predicted { layers } = settings.structure
        && !(1..=4).contains(&layers)
    {
        return setting("temporal layers", layers.to_string(), "1 to 4");
    }
    if !(6..=16).contains(&settings.block_log2) {
        return setting("block_log2", settings.block_log2.to_string(), "6 to 16");
    }
    if settings.sh_degree.is_some_and(|degree| degree > 3) {
        return setting("sh_degree", format!("{:?}", settings.sh_degree), "0 to 3");
    }
    Ok(())
}

/// The highest band of which some coefficient may not round to 0; steps of large Gaussians are finer than the usual one.
#[expect(clippy::arithmetic_side_effects, reason = "a degree is 1 to 3; values on a grid are clamped")]
#[expect(clippy::indexing_slicing, reason = "a frame has the planes of its degree")]
fn needed_degree(frame: &GaussianFrame, step: f32) -> u8 {
    let needed = |degree: &u8| {
        let planes = 3 * sh_coefficients(degree - 1)..3 * sh_coefficients(*degree);
        frame.sh()[planes].iter().flatten().any(|value| value.abs() > 0.25 * step)
    };
    (1..=frame.sh_degree()).rev().find(needed).unwrap_or(0)
}

/// Zero-order bits of scale and rotation with sorted axes and as they come, on a sample.
#[expect(clippy::indexing_slicing, reason = "axes are constants, and rows are those of the frame")]
#[expect(clippy::arithmetic_side_effects, reason = "a degree is 1 to 3; values on a grid are clamped")]
fn try_axes(frame: &GaussianFrame, shown: &[u32], settings: &Settings) -> [f64; 2] {
    let sample: Vec<u32> = shown.iter().step_by(shown.len().div_ceil(TRIAL).max(1)).copied().collect();
    [true, false].map(|sort| {
        let canonical = canonicalise(frame.select(&sample), sort);
        let round = |plane: &Vec<f32>, step: f32| -> Vec<i32> {
            plane.iter().map(|&value| nearest_integer(value / step)).collect()
        };
        let scales = canonical.log_scale().each_ref().map(|plane| round(plane, settings.steps.log_scale));
        let differences = |a: usize, b: usize| -> Vec<i32> {
            scales[a].iter().zip(&scales[b]).map(|(a, b)| a - b).collect()
        };
        let [_, x, y, z] = canonical.rotation();
        let rotation: f64 =
            [x, y, z].map(|plane| entropy_of(&round(plane, settings.steps.rotation))).iter().sum();
        let scale = entropy_of(&scales[0]) + entropy_of(&differences(0, 1)) + entropy_of(&differences(1, 2));
        (scale + rotation) / sample.len().max(1) as f64
    })
}

/// What the parameters of a sequence follow from.
pub(crate) struct Scene {
    pub(crate) extent: Extent,
    cores: Vec<Core>,
    /// Positions and squared opacities of some Gaussians of the first frame that has any.
    sample: Vec<([f32; 3], f32)>,
    /// [Where grids](origins) of log-scales and of opacities start.
    pub(crate) origins: [f32; 2],
    /// Farthest values from them, and the largest colours: log-scale, opacity, dc, sh.
    pub(crate) reach: [f32; 4],
}

impl Scene {
    /// Of no frame.
    pub(crate) fn new() -> Self {
        Self {
            extent: Extent::NONE,
            cores: Vec::new(),
            sample: Vec::new(),
            origins: [0.0; 2],
            reach: [0.0; 4],
        }
    }

    /// Adds the Gaussians of a frame that can be seen.
    #[expect(clippy::indexing_slicing, reason = "axes are constants, and rows are those of the frame")]
    pub(crate) fn add(&mut self, frame: &GaussianFrame, shown: &[u32]) {
        if shown.is_empty() {
            return;
        }
        if self.cores.is_empty() {
            self.sample = Reach::sample(frame, shown);
            self.origins = origins(frame, shown);
        }
        let (extent, core) = rayon::join(|| self.extent.with(frame, shown), || Core::of(frame, shown));
        self.extent = extent;
        self.cores.push(core);
        let rows = || shown.par_iter().with_min_len(AT_ONCE);
        let farthest = |planes: &[&[f32]], from: f32| {
            let of_row = |&row: &u32| {
                let values = planes.iter().map(|plane| plane[row as usize]);
                values.map(|value| (value - from).abs()).fold(0.0, f32::max)
            };
            rows().map(of_row).reduce(|| 0.0, f32::max)
        };
        let norm = |planes: &[&[f32]]| {
            let square = |plane: &&[f32], row: u32| {
                let value = plane[row as usize].clamp(-MAX_COLOUR, MAX_COLOUR);
                value * value
            };
            let of_row = |&row: &u32| planes.iter().map(|plane| square(plane, row)).sum::<f32>();
            rows().map(of_row).reduce(|| 0.0, f32::max).sqrt()
        };
        let [scale, opacity] = self.origins;
        let reach = [
            farthest(&frame.log_scale().each_ref().map(Vec::as_slice), scale),
            farthest(&[frame.opacity_logit()], opacity),
            norm(&frame.dc().each_ref().map(Vec::as_slice)),
            norm(&frame.sh().iter().map(Vec::as_slice).collect::<Vec<_>>()),
        ];
        self.reach = [0, 1, 2, 3].map(|at: usize| self.reach[at].max(reach[at]));
    }

    /// The parameters of a sequence of so many frames.
    pub(crate) fn parameters(
        &self,
        settings: &Settings,
        frames: u32,
        sh_degree: u8,
        sequence_flags: u8,
    ) -> SequenceParameters {
        let mut refinement_percent = [0; MAX_REFINEMENTS as usize];
        // There are no more: `check` has counted them.
        refinement_percent.iter_mut().zip(&settings.refinements).for_each(|(to, &percent)| *to = percent);
        let steps = &settings.steps;
        let [scale, opacity, dc, sh] = self.reach;
        // Parts of a rotation are at most 1; with finer steps those of two that are opposite could not be told apart.
        let rotation = steps.rotation.max(1.0 / MAX_DIFFERING);
        // What lies beside the mean of colours adds a little. Finer steps than components of colour can have would cut colours off.
        let most = *COMPONENT_RANGE.end() as f32;
        let colour = |step: f32, norm: f32| {
            let reach = 1.25 * norm;
            finest(step.max(reach / most), reach, most)
        };
        let mut parameters = SequenceParameters {
            sh_degree,
            spatial_layer_count: settings.spatial_layer_count(),
            temporal_layer_count: settings.temporal_layers().max(1),
            refinement_count: settings.refinements.len() as u8,
            refinement_percent,
            block_log2: settings.block_log2,
            sequence_flags,
            feature_shift: FEATURE_SHIFT,
            frame_count: frames,
            ticks_per_second: settings.ticks.0,
            ticks_per_frame: settings.ticks.1,
            log_scale_offset: self.origins[0].to_bits(),
            log_scale_step: finest(steps.log_scale.max(scale / MAX_LOG_SCALE), scale, MAX_DIFFERING)
                .to_bits(),
            rotation_step: finest(rotation, 1.0, MAX_DIFFERING).to_bits(),
            opacity_offset: self.origins[1].to_bits(),
            opacity_step: finest(steps.opacity.max(opacity / MAX_OPACITY), opacity, MAX_DIFFERING).to_bits(),
            dc_step: colour(steps.dc, dc).to_bits(),
            sh_step: colour(steps.sh, sh).to_bits(),
            ..SequenceParameters::PLAIN
        };
        let core = Core::of_all(&self.cores);
        let side = self.cores.first().map_or(0.0, |core| 2.0 * core.half);
        let reach = Reach { extent: self.extent, core, side, sample: self.sample.clone() };
        reach.put_into(&mut parameters, steps);
        settings.laws.put_into(&mut parameters);
        parameters
    }
}

/// What the grids of log-scales and of opacities start from: a value that many Gaussians share, of which no step makes an error that
/// all of them have; and where there is none the mean, so that what is coded is near 0. Of log-scales the largest of
/// each Gaussian counts.
#[expect(clippy::indexing_slicing, reason = "axes are constants, and rows are those of the frame")]
fn origins(frame: &GaussianFrame, shown: &[u32]) -> [f32; 2] {
    let origin = |value: &(dyn Fn(usize) -> f32 + Sync)| {
        let of_sample = shown.iter().step_by(shown.len().div_ceil(SAMPLE).max(1));
        shared(of_sample.map(|&row| value(row as usize)).collect()).unwrap_or_else(|| {
            let sum: f64 = shown.iter().map(|&row| f64::from(value(row as usize))).sum();
            (sum / shown.len().max(1) as f64) as f32
        })
    };
    let [a, b, c] = frame.log_scale();
    let (size, opacity) = rayon::join(
        || origin(&|row| a[row].max(b[row]).max(c[row])),
        || origin(&|row| frame.opacity_logit()[row]),
    );
    [size, opacity]
}

/// Values of which the commonest is looked for, at most.
const SAMPLE: usize = 1 << 14;
/// A value is common if it is more than one of so many.
const RARE: usize = 20;

/// The commonest of some values, if it is common.
fn shared(mut values: Vec<f32>) -> Option<f32> {
    let rare = values.len() / RARE;
    values.sort_unstable_by(f32::total_cmp);
    let commonest = values.chunk_by(|a, b| a == b).max_by_key(|same| same.len())?;
    commonest.first().filter(|_| commonest.len() > rare.max(1)).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grids_start_from_a_value_that_many_share() {
        let spread: Vec<f32> = (0..1000).map(|number| number as f32).collect();
        assert_eq!(shared(spread.clone()), None);
        assert_eq!(shared([spread, vec![-4.6; 60]].concat()), Some(-4.6));
        assert_eq!(shared(vec![2.0]), None);
        assert_eq!(shared(Vec::new()), None);
    }
}
