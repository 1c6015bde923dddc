//! Clause 7.6: residuals on top of a prediction, attribute by attribute.
//!
//! Sums do not wrap (annex F.4): values that are not checked yet are below 2^17, their steps at most 6144. There are planes and values
//! for each attribute and Gaussian, which has been established when a unit is [applied](super::apply).

use crate::attribute::{in_range, unsorted};
use crate::colour::{COLOUR_RANGE, Colour, add_inverse};
use crate::cores;
use crate::interrupt::Interrupt;
use crate::layout::ShCoding;
use crate::list::{FINE, FRACTION_BITS, GaussianList};
use crate::stage::Stage;
use crate::steps::{Exponents, StepRule, step};
use core::ops::RangeInclusive;
use splatstream_format::payload::Transform;
use splatstream_format::{Error, Result};

pub use crate::attribute::ATTRIBUTE_RANGE;

/// The values of a fine rotation.
const ROTATION_FINE_RANGE: RangeInclusive<i32> = -32_767 * FINE..=32_767 * FINE;

/// How a unit codes attributes.
#[derive(Debug, Clone, Copy)]
pub struct AttributeCoding<'a> {
    /// The steps of the values.
    pub steps: StepRule,
    /// Whether the axes are sorted.
    pub canonical_axes: bool,
    /// How components become colour.
    pub colour: Colour<'a>,
    /// Ends the work between runs of Gaussians.
    pub interrupt: &'a Interrupt,
}

/// The attributes of a run of Gaussians: predictions at first, then what the residuals make of them.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Attributes {
    /// Log-scales.
    pub log_scale: [Vec<i32>; 3],
    /// Opacity.
    pub opacity: Vec<i32>,
    /// Quaternion x, y, z in 64ths of rotation_step.
    pub rotation_fine: [Vec<i32>; 3],
    /// Red, green, blue.
    pub dc: [Vec<i32>; 3],
    /// SH planes.
    pub sh: Vec<Vec<i32>>,
    /// Of updates: the parents before them, from which steps follow. Steps of new Gaussians follow from what these have
    /// become.
    pub parents: Option<Shapes>,
}

/// What steps follow from.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Shapes {
    /// Log-scales.
    pub log_scale: [Vec<i32>; 3],
    /// Opacity.
    pub opacity: Vec<i32>,
}

/// The value planes of a section that codes attributes, in plane order without the position.
#[derive(Debug, Clone, Copy)]
pub struct AttributeValues<'v>(pub &'v [Vec<i32>]);

/// Index of the first plane of an attribute.
const OPACITY: usize = 3;
const ROTATION: usize = 4;
const DC: usize = 7;

impl<'v> AttributeValues<'v> {
    /// The planes of an attribute.
    pub fn of_stage(self, stage: Stage, colour: &Colour<'_>) -> &'v [Vec<i32>] {
        match stage {
            Stage::LogScale => self.planes(0, OPACITY),
            Stage::Opacity => self.planes(OPACITY, ROTATION),
            Stage::Rotation => self.planes(ROTATION, DC),
            Stage::Dc => self.planes(DC, first_sh(colour)),
            Stage::Sh => self.planes(first_sh(colour), self.0.len()),
        }
    }

    /// The planes in a range; those of colours may be fewer, as the sequence has them, or none.
    fn planes(self, from: usize, to: usize) -> &'v [Vec<i32>] {
        self.0.get(from..to.min(self.0.len())).unwrap_or_default()
    }
}

impl Attributes {
    /// What predictor `none` gives for `count` Gaussians: 0, and the means of the transforms.
    pub fn unpredicted(count: usize, colour: &Colour<'_>, sh_planes: usize) -> Self {
        let zeros = || [(); 3].map(|()| vec![0; count]);
        let mean = |transform: &Transform, plane: usize| transform.mean.get(plane).copied().unwrap_or(0);
        let sh = match (colour.mode, colour.sh) {
            (ShCoding::None, _) | (_, None) => vec![vec![0; count]; sh_planes],
            (_, Some(sh)) => (0..sh_planes).map(|plane| vec![mean(sh, plane); count]).collect(),
        };
        Self {
            log_scale: zeros(),
            opacity: vec![0; count],
            rotation_fine: zeros(),
            dc: [0, 1, 2].map(|plane| vec![mean(colour.dc, plane); count]),
            sh,
            parents: None,
        }
    }

    /// The planes of an attribute.
    pub fn stage(&self, stage: Stage) -> &[Vec<i32>] {
        match stage {
            Stage::LogScale => &self.log_scale,
            Stage::Opacity => core::slice::from_ref(&self.opacity),
            Stage::Rotation => &self.rotation_fine,
            Stage::Dc => &self.dc,
            Stage::Sh => &self.sh,
        }
    }

    /// The same, to be changed.
    pub(crate) fn stage_mut(&mut self, stage: Stage) -> &mut [Vec<i32>] {
        match stage {
            Stage::LogScale => &mut self.log_scale,
            Stage::Opacity => core::slice::from_mut(&mut self.opacity),
            Stage::Rotation => &mut self.rotation_fine,
            Stage::Dc => &mut self.dc,
            Stage::Sh => &mut self.sh,
        }
    }

    /// The attributes of some Gaussians of a list, which predict themselves.
    pub fn of_list(list: &GaussianList, rows: &[u32]) -> Self {
        Self::of_list_unless(Interrupt::NEVER, list, rows)
    }

    /// The same; where an interrupt is requested, the attributes mean nothing.
    pub(crate) fn of_list_unless(interrupt: &Interrupt, list: &GaussianList, rows: &[u32]) -> Self {
        let pick = |plane: &Vec<i32>| -> Vec<i32> {
            let value = |&row: &u32| usize::try_from(row).ok().and_then(|row| plane.get(row)).copied();
            let wanted = if interrupt.is_requested() { &[] } else { rows };
            wanted.iter().map(|row| value(row).unwrap_or(0)).collect()
        };
        let planes = &list.planes;
        let shapes =
            Shapes { log_scale: planes.log_scale.each_ref().map(pick), opacity: pick(&planes.opacity) };
        Self {
            log_scale: shapes.log_scale.clone(),
            opacity: shapes.opacity.clone(),
            rotation_fine: list.rotation_fine.each_ref().map(pick),
            dc: planes.dc.each_ref().map(pick),
            sh: cores::map(rows.len().saturating_mul(planes.sh.len()), planes.sh.iter().collect(), pick),
            parents: Some(shapes),
        }
    }

    /// Writes the attributes back to the Gaussians of the list; [`GaussianList::settle`] has to follow.
    pub(crate) fn write_to(&self, list: &mut GaussianList, rows: &[u32], interrupt: &Interrupt) {
        let write = |(plane, values): (&mut Vec<i32>, &Vec<i32>)| {
            for (&row, &value) in rows.iter().zip(values) {
                if let Some(slot) = usize::try_from(row).ok().and_then(|row| plane.get_mut(row)) {
                    *slot = value;
                }
            }
        };
        let planes = &mut list.planes;
        let to = planes.log_scale.iter_mut().chain([&mut planes.opacity]).chain(&mut list.rotation_fine);
        let to = to.chain(&mut planes.dc).chain(&mut planes.sh);
        let from = self.log_scale.iter().chain([&self.opacity]).chain(&self.rotation_fine);
        let from = from.chain(&self.dc).chain(&self.sh);
        let values = rows.len().saturating_mul(self.sh.len().saturating_add(10));
        cores::for_each(interrupt, values, to.zip(from), write);
    }

    /// Adds the residuals of all attributes.
    ///
    /// # Errors
    /// Invalid if a value leaves its range.
    pub fn add(&mut self, values: AttributeValues<'_>, coding: &AttributeCoding<'_>, at: u64) -> Result<()> {
        Stage::ALL.into_iter().try_for_each(|stage| self.add_stage(stage, values, coding, at))
    }

    /// Adds the residuals of one attribute; those before it in [`Stage::ALL`] have been added.
    ///
    /// # Errors
    /// Invalid if a value leaves its range.
    pub fn add_stage(
        &mut self,
        stage: Stage,
        values: AttributeValues<'_>,
        coding: &AttributeCoding<'_>,
        at: u64,
    ) -> Result<()> {
        match stage {
            Stage::LogScale if self.parents.is_some() => self.update_log_scales(values, coding, at),
            Stage::LogScale => self.add_log_scales(values, coding, at),
            Stage::Opacity => self.add_opacity(values, coding, at),
            Stage::Rotation => self.add_rotation(values, coding, at),
            Stage::Dc => self.add_dc(values, coding, at),
            Stage::Sh => self.add_sh(values, coding, at),
        }
    }

    /// Residuals of the log-scales of parents, each by itself.
    ///
    /// # Errors
    /// Invalid if a value leaves its range, or canonical axes are not sorted.
    fn update_log_scales(
        &mut self,
        values: AttributeValues<'_>,
        coding: &AttributeCoding<'_>,
        at: u64,
    ) -> Result<()> {
        let of_others = self.exponents(Stage::LogScale, &coding.steps);
        let of_largest = Exponents::Same(coding.steps.of_largest());
        let exponents = [&of_largest, &of_others, &of_others];
        let residuals = values.of_stage(Stage::LogScale, &coding.colour).iter();
        for ((plane, residual), exponents) in self.log_scale.iter_mut().zip(residuals).zip(exponents) {
            let residual = exponents.scaled(residual);
            in_range(&residual, &ATTRIBUTE_RANGE, "log_scale", "7.6", at)?;
            add(plane, &residual);
            in_range(plane, &ATTRIBUTE_RANGE, "log_scale", "7.6", at)?;
        }
        let [largest, middle, smallest] = &self.log_scale;
        let mut pairs = largest.iter().zip(middle).chain(middle.iter().zip(smallest));
        match coding.canonical_axes && pairs.any(|(larger, smaller)| larger < smaller) {
            true => Err(unsorted(at)),
            false => Ok(()),
        }
    }

    /// Residuals of the largest log-scale and of the two differences.
    ///
    /// # Errors
    /// Invalid if a value leaves its range, or canonical axes are not sorted.
    fn add_log_scales(
        &mut self,
        values: AttributeValues<'_>,
        coding: &AttributeCoding<'_>,
        at: u64,
    ) -> Result<()> {
        let [first, second, third] = values.of_stage(Stage::LogScale, &coding.colour) else {
            return Err(Error::fault("a plane for each log-scale"));
        };
        let of_largest = step(coding.steps.of_largest());
        let [largest, middle, smallest] = &mut self.log_scale;
        let (mut least, mut reach) = (0, 0..=0);
        for (((a, b), c), ((&u, &v), &w)) in largest
            .iter_mut()
            .zip(middle.iter_mut())
            .zip(smallest.iter_mut())
            .zip(first.iter().zip(second).zip(third))
        {
            let u = u.wrapping_mul(of_largest);
            let start = *a;
            *a = a.wrapping_add(u);
            let step = step(coding.steps.of_log_scale(*a));
            let [v, w] = [v.wrapping_mul(step), w.wrapping_mul(step)];
            reach = u.min(v).min(w).min(*reach.start())..=u.max(v).max(w).max(*reach.end());
            let differences = [start.wrapping_sub(*b).wrapping_add(v), b.wrapping_sub(*c).wrapping_add(w)];
            let [to_middle, to_smallest] = differences;
            *b = a.wrapping_sub(to_middle);
            *c = b.wrapping_sub(to_smallest);
            least = least.min(to_middle).min(to_smallest);
        }
        in_range(&[*reach.start(), *reach.end()], &ATTRIBUTE_RANGE, "log_scale", "7.6", at)?;
        for plane in &self.log_scale {
            in_range(plane, &ATTRIBUTE_RANGE, "log_scale", "7.6", at)?;
        }
        if coding.canonical_axes && least < 0 {
            return Err(unsorted(at));
        }
        Ok(())
    }

    /// Residuals of the opacity.
    ///
    /// # Errors
    /// Invalid if a value leaves its range.
    fn add_opacity(
        &mut self,
        values: AttributeValues<'_>,
        coding: &AttributeCoding<'_>,
        at: u64,
    ) -> Result<()> {
        let exponents = self.exponents(Stage::Opacity, &coding.steps);
        for residual in values.of_stage(Stage::Opacity, &coding.colour) {
            add(&mut self.opacity, &exponents.scaled(residual));
        }
        in_range(&self.opacity, &ATTRIBUTE_RANGE, "opacity", "7.6", at)
    }

    /// The exponents of the steps of an attribute. Of new Gaussians the attributes before it have been reconstructed.
    pub fn exponents(&self, stage: Stage, steps: &StepRule) -> Exponents {
        let (log_scale, opacity) = match &self.parents {
            Some(parents) => (&parents.log_scale, &parents.opacity),
            None => (&self.log_scale, &self.opacity),
        };
        steps.exponents(stage, log_scale.each_ref().map(Vec::as_slice), opacity)
    }

    /// Residuals of the rotation.
    ///
    /// # Errors
    /// Invalid if a value leaves its range.
    fn add_rotation(
        &mut self,
        values: AttributeValues<'_>,
        coding: &AttributeCoding<'_>,
        at: u64,
    ) -> Result<()> {
        let exponents = self.exponents(Stage::Rotation, &coding.steps);
        for (plane, residual) in
            self.rotation_fine.iter_mut().zip(values.of_stage(Stage::Rotation, &coding.colour))
        {
            in_range(residual, &ATTRIBUTE_RANGE, "rotation", "7.6", at)?;
            for (row, (slot, &value)) in plane.iter_mut().zip(residual).enumerate() {
                // A sum that 32 bits do not hold is out of range, whatever takes its place.
                let fine = i64::from(step(exponents.at(row))).wrapping_shl(FRACTION_BITS);
                let change = i64::from(value).wrapping_mul(fine);
                let sum = i64::from(*slot).wrapping_add(change);
                *slot = i32::try_from(sum).unwrap_or(i32::MAX);
            }
            in_range(plane, &ROTATION_FINE_RANGE, "rotation", "7.6", at)?;
        }
        Ok(())
    }

    /// Residuals of dc, in components.
    ///
    /// # Errors
    /// Invalid if a value leaves its range.
    fn add_dc(&mut self, values: AttributeValues<'_>, coding: &AttributeCoding<'_>, at: u64) -> Result<()> {
        let exponents = self.exponents(Stage::Dc, &coding.steps);
        let coded = values.of_stage(Stage::Dc, &coding.colour);
        add_inverse(coding.colour.dc, coded, &exponents, &mut self.dc, coding.interrupt, at)?;
        self.dc.iter().try_for_each(|plane| in_range(plane, &COLOUR_RANGE, "dc", "7.6", at))
    }

    /// Residuals of sh, in components or as entries of codebooks.
    ///
    /// # Errors
    /// Invalid if a value leaves its range.
    fn add_sh(&mut self, values: AttributeValues<'_>, coding: &AttributeCoding<'_>, at: u64) -> Result<()> {
        let planes = values.of_stage(Stage::Sh, &coding.colour);
        let Some(transform) = coding.colour.sh else { return Ok(()) };
        let exponents = self.exponents(Stage::Sh, &coding.steps);
        let entries;
        let coded = match coding.colour.mode {
            ShCoding::None => return Ok(()),
            ShCoding::Coefficients { .. } => planes,
            ShCoding::VectorQuantised { .. } => {
                entries = coding.colour.entries(planes, usize::from(transform.header.rank), at)?;
                entries.as_slice()
            }
        };
        add_inverse(transform, coded, &exponents, &mut self.sh, coding.interrupt, at)?;
        self.sh.iter().try_for_each(|plane| in_range(plane, &COLOUR_RANGE, "sh", "7.6", at))
    }
}

/// The first sh plane.
fn first_sh(colour: &Colour<'_>) -> usize {
    DC.saturating_add(usize::from(colour.dc.header.rank))
}

fn add(plane: &mut [i32], residual: &[i32]) {
    for (slot, &value) in plane.iter_mut().zip(residual) {
        *slot = slot.wrapping_add(value);
    }
}
