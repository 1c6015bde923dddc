//! Steps against the slopes: Adam, with steps that become shorter with the cosine of the time.

use super::Schedule;
use super::parameters::Layout;

/// What is kept of the mean slope, and of the mean of its square, from step to step. Slopes of rounded networks are
/// noisy and change with every weight that turns to the next integer: a long memory of their size does no good.
const KEPT: [f32; 2] = [0.9, 0.99];

/// Added to the root of the mean square: a slope that small is none.
const LEAST: f32 = 1e-7;

/// The last steps, of the first.
const LAST: f64 = 0.02;

/// A slope is cut to this many times the mean length before it.
const LONGEST: f32 = 2.0;

/// The state between steps.
#[derive(Debug)]
pub(super) struct Descent {
    /// For each parameter the mean slope, and that of its square.
    means: Vec<[f32; 2]>,
    /// What one unit of each parameter does.
    scales: Vec<f32>,
    /// What of the means is still missing: 0.9 and 0.99 to the power of the steps.
    missing: [f32; 2],
    /// The mean length of the slopes.
    length: Option<f32>,
    rate: f64,
    done: usize,
    steps: usize,
}

impl Descent {
    /// The steps of a schedule for a number of samples.
    pub(super) fn new(layout: &Layout, schedule: &Schedule<'_>, samples: usize) -> Self {
        Self {
            means: vec![[0.0; 2]; layout.len()],
            scales: layout.scales(),
            missing: [1.0; 2],
            length: None,
            rate: schedule.learning_rate.into(),
            done: 0,
            steps: samples.div_ceil(schedule.batch).saturating_mul(schedule.epochs).max(1),
        }
    }

    /// Takes a step.
    pub(super) fn step(&mut self, parameters: &mut [f32], slopes: &[f32]) {
        let rate = self.next_rate();
        let cut = self.cut(slopes);
        self.missing.iter_mut().zip(KEPT).for_each(|(missing, kept)| *missing *= kept);
        let [first, second] = self.missing.map(|missing| 1.0 / (1.0 - missing));
        for (((value, slope), scale), means) in
            parameters.iter_mut().zip(slopes).zip(&self.scales).zip(&mut self.means)
        {
            let slope = slope * scale * cut;
            let [mean, square] = means;
            *mean += (slope - *mean) * (1.0 - KEPT[0]);
            *square += (slope * slope - *square) * (1.0 - KEPT[1]);
            *value -= rate * scale * (*mean * first) / ((*square * second).sqrt() + LEAST);
        }
    }

    #[expect(clippy::arithmetic_side_effects, reason = "a count of steps")]
    fn next_rate(&mut self) -> f32 {
        let part = self.done as f64 / self.steps as f64;
        self.done += 1;
        let wave = 0.5 + 0.5 * libm::cos(core::f64::consts::PI * part);
        (self.rate * (LAST + (1.0 - LAST) * wave)) as f32
    }

    /// What a slope that is much longer than those before it is multiplied by. How long slopes are depends on the
    /// units of the colours: there is no length that would always be too much.
    fn cut(&mut self, slopes: &[f32]) -> f32 {
        let squares = slopes.iter().zip(&self.scales).map(|(slope, scale)| (slope * scale) * (slope * scale));
        let length = squares.sum::<f32>().sqrt();
        let usual = self.length.unwrap_or(length);
        let cut = if length > LONGEST * usual { LONGEST * usual / length } else { 1.0 };
        self.length = Some(usual + (length * cut - usual) * (1.0 - KEPT[0]));
        cut
    }
}
