//! Steps against the slopes: Adam over the values of a frame.
//!
//! Source: Kingma, Ba, "Adam: a method for stochastic optimization", 2015, algorithm 1.

use super::{GradientError, Gradients};
use rayon::prelude::*;
use splatstream_gaussians::{GaussianFrame, Planes, sh_planes};

/// Gaussians that a thread changes at once.
const CHUNK: usize = 4096;

/// How far one step takes each attribute: about so much where the slopes of the last steps agree, less where they do not.
///
/// In units of the attribute: scene units of centres, 1 of log-scales, of components of quaternions, of logits and of
/// coefficients. A rate of 0 leaves the values as they are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rates {
    /// Of centres. A share of the size of the scene: 3D Gaussian splatting starts with 0.00016 of it and ends with a hundredth
    /// of that.
    pub position: f32,
    /// Of log-scales.
    pub log_scale: f32,
    /// Of the components of quaternions, which a caller keeps near length 1.
    pub rotation: f32,
    /// Of opacity logits.
    pub opacity_logit: f32,
    /// Of the coefficients of the constant basis function.
    pub dc: f32,
    /// Of the coefficients of bands 1 and up.
    pub sh: f32,
}

impl Default for Rates {
    /// Those of 3D Gaussian splatting, for a scene of size 1.
    fn default() -> Self {
        Self {
            position: 0.000_16,
            log_scale: 0.005,
            rotation: 0.001,
            opacity_logit: 0.05,
            dc: 0.0025,
            sh: 0.0025 / 20.0,
        }
    }
}

impl Rates {
    /// The rate of each plane, in the order of [`Planes`].
    fn of_planes(&self) -> impl Iterator<Item = f32> {
        let Self { position, log_scale, rotation, opacity_logit, dc, sh } = *self;
        let each = [position, log_scale, rotation, opacity_logit, dc].into_iter().zip([3, 3, 4, 1, 3]);
        each.flat_map(|(rate, planes)| std::iter::repeat_n(rate, planes)).chain(std::iter::repeat(sh))
    }
}

/// Adam: each value goes against the running mean of its slope, over the root of the running mean of its square.
///
/// A Gaussian whose slopes are all 0, because no picture showed it, is left alone, its means too: what is out of sight does
/// not drift, as it would with the means of steps long ago. Each Gaussian counts its own steps, by which the bias of its
/// means towards 0 is corrected, so that new ones start like the first. One with a slope that is not finite is left alone
/// as well.
///
/// The same frame, slopes and rates give the same bits for any number of threads and on every machine.
///
/// ```
/// use splatstream_files::builtin::BuiltinScene;
/// use splatstream_render::camera::{Up, ring};
/// use splatstream_render::gradient::{Adam, Gradients, Loss, Rates};
/// use splatstream_render::{PreparedFrame, render};
///
/// let mut frame = BuiltinScene { gaussians: 100, ..BuiltinScene::default() }.frame(0);
/// let camera = &ring(&frame, Up::default(), 1, 64)[0];
/// let target = render(&frame, camera, [0.0; 3]).colour;
/// frame.planes_mut().dc.into_iter().flatten().for_each(|value| *value += 0.3);
///
/// let mut adam = Adam::new(&frame);
/// let mut losses = Vec::new();
/// for _ in 0..20 {
///     let prepared = PreparedFrame::new(&frame);
///     let drawing = prepared.draw(camera, [0.0; 3]);
///     let judged = Loss::default().between(&target, &drawing.rendering().colour)?;
///     let mut gradients = Gradients::zero(&frame);
///     drawing.backward(&judged.slopes, &mut gradients)?;
///     adam.step(&mut frame, &gradients, &Rates { dc: 0.02, ..Rates::default() })?;
///     losses.push(judged.value);
/// }
/// assert!(losses[19] < 0.5 * losses[0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Adam {
    sh_degree: u8,
    /// Running means of the slopes, biased towards 0.
    first: Planes,
    /// Of their squares.
    second: Planes,
    /// What is left of the zeros that each Gaussian's means began with: the decays to the power of its steps.
    bias: Vec<[f32; 2]>,
}

impl Adam {
    /// What a step leaves of the means.
    const DECAY: [f32; 2] = [0.9, 0.999];
    /// Added to the root of the second mean, so that a value without any slope stays.
    const EPSILON: f32 = 1e-15;

    /// Before the first step of a frame of this size and SH degree.
    #[must_use]
    pub fn new(frame: &GaussianFrame) -> Self {
        let [first, second] = [(); 2].map(|()| Gradients::zero(frame).into_planes());
        Self { sh_degree: frame.sh_degree(), first, second, bias: vec![[1.0; 2]; frame.len()] }
    }

    /// All numbers that the next steps follow from beside the frame, plane by plane, for who writes them down: put back into a
    /// [new](Adam::new) one for a frame of the same size and SH degree, they let it go on with the same bits.
    ///
    /// ```
    /// use splatstream_files::builtin::BuiltinScene;
    /// use splatstream_render::gradient::{Adam, Gradients, Rates};
    ///
    /// let mut frame = BuiltinScene { gaussians: 10, ..BuiltinScene::default() }.frame(0);
    /// let mut slopes = Gradients::zero(&frame);
    /// slopes.planes_mut().opacity_logit.fill(1.0);
    /// let mut adam = Adam::new(&frame);
    /// adam.step(&mut frame, &slopes, &Rates::default())?;
    /// let mut other = Adam::new(&frame);
    /// adam.memory_mut().zip(other.memory_mut()).for_each(|(from, to)| to.copy_from_slice(from));
    /// assert_eq!(adam, other);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn memory_mut(&mut self) -> impl Iterator<Item = &mut [f32]> {
        let means = self.first.iter_mut().chain(self.second.iter_mut()).map(Vec::as_mut_slice);
        means.chain([self.bias.as_flattened_mut()])
    }

    /// Takes one step. Quaternions do not keep their length: [`GaussianFrame::with_unit_rotations`] gives it back.
    ///
    /// # Errors
    /// A frame, or gradients, of another size or SH degree than this; then nothing is changed.
    pub fn step(
        &mut self,
        frame: &mut GaussianFrame,
        gradients: &Gradients,
        rates: &Rates,
    ) -> Result<(), GradientError> {
        self.descend(frame, gradients, rates).map(|_| ())
    }

    /// Takes one step, and then takes each value back to that of `anchor` by a share `hold` of its rate, or all the way where
    /// that is less: the soft threshold of the sum of all changes, each in units of its rate.
    ///
    /// A step has the length of its rate where the slopes of the last steps agree, and less where they do not. So a value
    /// stays exactly what the anchor has unless its slopes agree by more than `hold`, 0 to 1. Gaussians that take no step are
    /// not taken back either.
    ///
    /// Source: Parikh, Boyd, "Proximal algorithms", 2014: the proximal operator of the l1 norm.
    ///
    /// # Errors
    /// As [`Adam::step`], and an anchor of another size or SH degree; then nothing is changed.
    pub fn step_held(
        &mut self,
        frame: &mut GaussianFrame,
        gradients: &Gradients,
        rates: &Rates,
        (anchor, hold): (&GaussianFrame, f32),
    ) -> Result<(), GradientError> {
        gradients.check(anchor)?;
        let scales = self.descend(frame, gradients, rates)?;
        let mut values = frame.planes_mut();
        let values = values.iter_mut().zip(anchor.planes().iter());
        for ((values, anchors), rate) in values.zip(rates.of_planes()) {
            let given = anchors.par_chunks(CHUNK).zip(scales.par_chunks(CHUNK));
            values.par_chunks_mut(CHUNK).zip(given).for_each(|(values, (anchors, scales))| {
                take_back(values, anchors, scales, hold * rate);
            });
        }
        Ok(())
    }

    /// The step itself; gives the factors that correct the means of each Gaussian, as [`Adam::count`] does.
    fn descend(
        &mut self,
        frame: &mut GaussianFrame,
        gradients: &Gradients,
        rates: &Rates,
    ) -> Result<Vec<[f32; 2]>, GradientError> {
        gradients.check(frame)?;
        let (own, needed) = ((self.bias.len(), self.sh_degree), (frame.len(), frame.sh_degree()));
        if own != needed {
            return Err(GradientError::Frame(own.0, own.1, needed.0, needed.1));
        }
        let scales = self.count(gradients.planes());
        let mut values = frame.planes_mut();
        let values = values.iter_mut().zip(gradients.planes().iter());
        let means = self.first.iter_mut().zip(self.second.iter_mut());
        for (((values, slopes), (first, second)), rate) in values.zip(means).zip(rates.of_planes()) {
            let means = first.par_chunks_mut(CHUNK).zip(second.par_chunks_mut(CHUNK));
            let given = slopes.par_chunks(CHUNK).zip(scales.par_chunks(CHUNK));
            values.par_chunks_mut(CHUNK).zip(means).zip(given).for_each(
                |((values, means), (slopes, scales))| {
                    descend(values, means, slopes, scales, rate);
                },
            );
        }
        Ok(scales)
    }

    /// Counts a step of each Gaussian that has slopes; gives the factors that correct its two means, 0 where there is no step.
    fn count(&mut self, slopes: &Planes) -> Vec<[f32; 2]> {
        let mut sums = vec![0.0_f32; self.bias.len()];
        for plane in slopes.iter() {
            sums.par_iter_mut().zip(plane).with_min_len(CHUNK).for_each(|(sum, slope)| *sum += slope.abs());
        }
        let step = |(bias, sum): (&mut [f32; 2], f32)| {
            // Not for 0, infinity and NaN.
            if !(sum > 0.0 && sum < f32::INFINITY) {
                return [0.0; 2];
            }
            bias.iter_mut().zip(Self::DECAY).for_each(|(bias, decay)| *bias *= decay);
            bias.map(|bias| 1.0 / (1.0 - bias))
        };
        self.bias.par_iter_mut().zip(sums).with_min_len(CHUNK).map(step).collect()
    }

    /// For a frame of the Gaussians at `rows`, as [`GaussianFrame::select`] makes it; one that comes twice keeps its means
    /// in both places.
    ///
    /// # Panics
    /// If a row is not below the number of Gaussians.
    #[expect(
        clippy::indexing_slicing,
        reason = "a row that is not there is a fault of the caller, as it says"
    )]
    pub fn select(&mut self, rows: &[u32]) {
        for plane in self.first.iter_mut().chain(self.second.iter_mut()) {
            *plane = rows.iter().map(|&row| plane[row as usize]).collect();
        }
        self.bias = rows.iter().map(|&row| self.bias[row as usize]).collect();
    }

    /// For a frame with `count` new Gaussians at its end, which have taken no step.
    pub fn grow(&mut self, count: usize) {
        let rows = self.bias.len().saturating_add(count);
        self.first.iter_mut().chain(self.second.iter_mut()).for_each(|plane| plane.resize(rows, 0.0));
        self.bias.resize(rows, [1.0; 2]);
    }

    /// For a frame of a higher SH degree, 0 to 3; of a lower one, nothing changes. Coefficients that are new start with the
    /// corrections of their Gaussian's other values: their first steps are up to three times as long as the rate.
    pub fn raise_sh_degree(&mut self, sh_degree: u8) {
        if sh_degree > self.sh_degree {
            self.sh_degree = sh_degree;
            let rows = self.bias.len();
            for planes in [&mut self.first, &mut self.second] {
                planes.sh.resize(sh_planes(sh_degree), vec![0.0; rows]);
            }
        }
    }

    /// Forgets the means of opacities, after a caller has set them to something else.
    pub fn forget_opacities(&mut self) {
        self.first.opacity_logit.fill(0.0);
        self.second.opacity_logit.fill(0.0);
    }
}

/// A step of some values of a plane.
fn descend(
    values: &mut [f32],
    (first, second): (&mut [f32], &mut [f32]),
    slopes: &[f32],
    scales: &[[f32; 2]],
    rate: f32,
) {
    let [keep, keep_square] = Adam::DECAY;
    let means = first.iter_mut().zip(second);
    for (((value, (first, second)), &slope), &[scale, scale_square]) in
        values.iter_mut().zip(means).zip(slopes).zip(scales)
    {
        let next = keep * *first + (1.0 - keep) * slope;
        let next_square = keep_square * *second + (1.0 - keep_square) * (slope * slope);
        let change = rate * (next * scale) / ((next_square * scale_square).sqrt() + Adam::EPSILON);
        let steps = scale > 0.0;
        *first = if steps { next } else { *first };
        *second = if steps { next_square } else { *second };
        *value = if steps { *value - change } else { *value };
    }
}

/// Takes values of Gaussians that took a step back to those of an anchor, by `most` at most.
fn take_back(values: &mut [f32], anchors: &[f32], scales: &[[f32; 2]], most: f32) {
    for ((value, &anchor), &[scale, _]) in values.iter_mut().zip(anchors).zip(scales) {
        let change = *value - anchor;
        let held = if change.abs() <= most { anchor } else { *value - most.copysign(change) };
        *value = if scale > 0.0 { held } else { *value };
    }
}
