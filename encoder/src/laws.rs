//! How the steps of a Gaussian follow from its size, its opacity, its shape and its place in the order of importance.
//!
//! A change of a Gaussian costs pictures about the square of its opacity times the area that it covers, and less where
//! others hide it. If errors added up, steps would go with the inverse square root of that. They do not: what lies
//! behind makes up for a part, views that nobody measured show something else, and a step that is far too coarse for
//! its attribute saves nothing more. Measured on real scenes, steps that go with the inverse fourth root of what pictures
//! show cost least. A decoder knows sizes, opacities and shapes; what is hidden it learns from the refinements, which
//! are in the order of importance and have steps of their own.
#![expect(
    clippy::indexing_slicing,
    reason = "exponents are those of the tables; parts are cut from the order"
)]

use crate::quantile::ranked;
use crate::refinements::parts;
use crate::steps::Steps;
use rayon::prelude::*;
use splatstream_decoder::steps::STEPS;
use splatstream_format::syntax::{MAX_ATTRIBUTE_STEP, MAX_REFINEMENTS, SequenceParameters};
use splatstream_gaussians::GaussianFrame;
use splatstream_render::contribution::Worth;

/// The exponent of the steps that are asked for: finer ones have room below it, coarser ones above.
const NOMINAL: u8 = 5;
/// Lower exponents for attributes whose values would not fit with finer steps.
const FALLBACKS: [u8; 4] = [NOMINAL, 3, 1, 0];
/// log2 of the step of the nominal exponent.
pub(crate) const FEATURE_SHIFT: u8 = 3;

/// The powers of area, of opacity and of e^anisotropy that steps go with. The classes of importance already have most
/// of what area and opacity tell of the contribution.
const AREA_POWER: f32 = 0.15;
const OPACITY_POWER: f32 = 0.2;
const ANISOTROPY_POWER: f32 = 0.5;
/// The power of what pictures show of the Gaussians of a refinement.
const ENERGY_POWER: f64 = 0.23;
/// What pictures show of a Gaussian at least, of what those of the first refinement show on average: hidden ones are
/// hidden in the views at hand, and others may show them. No refinement is coarser by more than 8 half octaves for it.
const LEAST_ENERGY: f64 = 1e-5;

/// How steps follow from what is known of a Gaussian. All of them are as asked for where nothing else is said.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Laws {
    /// Steps go with the area of a Gaussian to minus this.
    pub area: f32,
    /// Steps of rotation and colour go with its opacity to minus this.
    pub opacity: f32,
    /// Steps of the rotation go with e^anisotropy to minus this; anisotropy is the natural log of the largest semi-axis
    /// by the smallest.
    pub anisotropy: f32,
    /// The natural log of the area (product of the two largest semi-axes) at which steps are as asked for.
    pub area_reference: f32,
    /// The anisotropy from which the step of the rotation is as asked for.
    pub anisotropy_reference: f32,
    /// Half octaves by which the steps of each refinement are coarser.
    pub coarser: [u8; MAX_REFINEMENTS as usize],
}

impl Laws {
    /// For a scene whose Gaussians have the order of importance `order`, of which pictures show so much, and
    /// refinements up to these percentages.
    pub(crate) fn of(frame: &GaussianFrame, order: &[u32], shown: &[Worth], refinements: &[u8]) -> Self {
        if frame.is_empty() {
            return Self::default();
        }
        let shapes: Vec<(f32, f32)> = (0..frame.len()).into_par_iter().map(|row| shape(frame, row)).collect();
        let count = shapes.len() as f64;
        let mean = shapes.iter().map(|(area, _)| f64::from(*area)).sum::<f64>() / count;
        let mut anisotropies: Vec<f32> = shapes.iter().map(|(_, anisotropy)| *anisotropy).collect();
        let reference = ranked(&mut anisotropies, 90, f32::total_cmp).unwrap_or_default();
        Self {
            area: AREA_POWER,
            opacity: OPACITY_POWER,
            anisotropy: ANISOTROPY_POWER,
            area_reference: mean as f32,
            anisotropy_reference: reference,
            coarser: coarser(order, shown, refinements),
        }
    }

    /// The elements of the sequence that say so, of log-scales and opacities with steps and offsets of the sequence.
    pub(crate) fn put_into(&self, sequence: &mut SequenceParameters) {
        let scale = f64::from(sequence.log_scale_step());
        let opacity = f64::from(sequence.opacity_step());
        let weight = |power: f32, step: f64| {
            let half_octaves = 2.0 * f64::from(power) * step * core::f64::consts::LOG2_E;
            libm::round(half_octaves * f64::from(1 << 14)).clamp(0.0, 8191.0) as u16
        };
        let reference =
            |value: f32, step: f64, most: f64| libm::round(f64::from(value) / step).clamp(-most, most) as i32;
        sequence.size_weight = [weight(self.area, scale); 5];
        sequence.opacity_weight = [weight(self.opacity, opacity); 3];
        sequence.anisotropy_weight = weight(self.anisotropy, scale);
        let area = self.area_reference - 2.0 * sequence.log_scale_offset();
        sequence.size_reference = reference(area, scale, 65_535.0);
        // Opacity grows with its logit up to about 0.
        sequence.opacity_reference = reference(-sequence.opacity_offset(), opacity, 32_767.0);
        sequence.anisotropy_reference = reference(self.anisotropy_reference, scale, 65_535.0).max(0);
    }

    /// The exponents of the steps of a refinement.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "counts in memory; exponents are at most 13 and positions have 1 bit or more"
    )]
    pub(crate) fn attribute_step(
        &self,
        steps: &Steps,
        sequence: &SequenceParameters,
        refinement: u8,
    ) -> [u8; 5] {
        let coarser = self.coarser[usize::from(refinement)];
        let of = [
            (steps.log_scale, sequence.log_scale_step()),
            (steps.opacity, sequence.opacity_step()),
            (steps.rotation, sequence.rotation_step()),
            (steps.dc, sequence.dc_step()),
            (steps.sh, sequence.sh_step()),
        ];
        of.map(|(asked, finest)| {
            let times = libm::roundf(asked / finest) as i32;
            let nominal = FALLBACKS.into_iter().find(|&e| STEPS[usize::from(e)] <= times).unwrap_or(0);
            (nominal + coarser).min(MAX_ATTRIBUTE_STEP)
        })
    }

    /// Low bits of positions that a refinement leaves out: one for two half octaves, rounded up.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "counts in memory; exponents are at most 13 and positions have 1 bit or more"
    )]
    pub(crate) fn position_shift(&self, sequence: &SequenceParameters, refinement: u8) -> u8 {
        let coarser = self.coarser[usize::from(refinement)];
        coarser.div_ceil(2).min(sequence.position_bits - 1)
    }
}

/// The finest step of an attribute for which a step is asked for, so that values up to `reach` take at most `most` of
/// them.
pub(crate) fn finest(asked: f32, reach: f32, most: f32) -> f32 {
    let steps = FALLBACKS.map(|exponent| asked / STEPS[usize::from(exponent)] as f32);
    steps.into_iter().find(|&step| reach / step <= most).unwrap_or(asked)
}

/// The natural logs of the area of a Gaussian and of its anisotropy.
fn shape(frame: &GaussianFrame, row: usize) -> (f32, f32) {
    let [a, b, c] = frame.log_scale().each_ref().map(|plane| plane[row]);
    let (least, most) = (a.min(b).min(c), a.max(b).max(c));
    (a + b + c - least, most - least)
}

/// How much coarser each refinement is than the first, in half octaves, by the mean of the logarithm of what pictures
/// show of its Gaussians.
fn coarser(order: &[u32], shown: &[Worth], refinements: &[u8]) -> [u8; MAX_REFINEMENTS as usize] {
    let mut coarser = [0; MAX_REFINEMENTS as usize];
    let mut first = None;
    for (slot, part) in coarser.iter_mut().zip(parts(refinements, order.len())) {
        let rows = &order[part];
        let of_row = |&row: &u32| shown.get(row as usize).map_or(0.0, |worth| worth.energy);
        let least = first.map_or(f64::MIN_POSITIVE, |(mean, _)| LEAST_ENERGY * mean);
        let count = rows.len().max(1) as f64;
        let mean = rows.iter().map(of_row).sum::<f64>() / count;
        // Logarithms take long, and are summed in the order of the rows.
        let logs: Vec<f64> = rows.par_iter().map(|row| libm::log2(of_row(row).max(least))).collect();
        let log = logs.iter().sum::<f64>() / count;
        let &mut (_, of_first) = first.get_or_insert((mean, log));
        *slot = libm::round((2.0 * ENERGY_POWER * (of_first - log)).max(0.0)) as u8;
    }
    coarser
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn refinements_are_coarser_by_what_pictures_show_less() {
        let energies = [vec![2048.0; 50], vec![8.0; 30], vec![0.0; 20]].concat();
        let shown: Vec<Worth> =
            energies.into_iter().map(|energy| Worth { energy, ..Worth::default() }).collect();
        let order: Vec<u32> = (0..100).collect();
        let expected = [0, 4, 8, 0, 0, 0, 0, 0, 0, 0];
        assert_eq!(coarser(&order, &shown, &[50, 80, 100]), expected);
    }

    #[test]
    fn steps_are_finer_where_values_fit() {
        assert_eq!(finest(0.8, 10.0, 8191.0), 0.1);
        assert_eq!(finest(0.008, 20.0, 8191.0), 0.004);
        assert_eq!(finest(0.001, 20.0, 8191.0), 0.001);
    }
}
