//! A frame with values on the grids that some steps give: what a decoder would have, and what it would cost.
#![expect(
    clippy::indexing_slicing,
    reason = "rows are those of the frame that all planes are of; parts and axes are constants"
)]

use crate::attribute::Attribute;
use crate::colour::{self, AddWeighted};
use crate::entropy_cost::entropy_of;
use crate::error::Error;
use crate::frame::grain::Grains;
use crate::grid::{Geometry, geometry, nearest_integer};
use crate::pca::Components;
use crate::shape::{Shape, nearest_multiple};
use pulp::Arch;
use rayon::prelude::*;
use splatstream_decoder::output::Companding;
use splatstream_decoder::position::refine;
use splatstream_decoder::steps::{Stage, StepRule, step};
use splatstream_format::syntax::{SequenceParameters, TransformKind};
use splatstream_gaussians::{GaussianFrame, Planes};

/// Gaussians whose colours are made together.
const NEAR: usize = 1 << 11;

/// What some steps make of a scene: the same for all of its views and samples.
pub(crate) struct Grids<'a> {
    bases: &'a [Components; 2],
    /// The refinement of each Gaussian of the scene.
    refinement: &'a [u8],
    sequence: SequenceParameters,
    grains: Grains,
    /// By refinement.
    rules: Vec<StepRule>,
}

impl<'a> Grids<'a> {
    /// Of the parameters of a stream of the scene, and how finely its refinements are coded. `refinement`: that of each Gaussian
    /// of the scene.
    pub(crate) fn new(
        sequence: SequenceParameters,
        grains: Grains,
        bases: &'a [Components; 2],
        refinement: &'a [u8],
    ) -> Self {
        let rules = (0..sequence.refinement_count)
            .map(|refinement| StepRule::new(&sequence, grains.of(refinement).attribute_step))
            .collect();
        Self { bases, refinement, sequence, grains, rules }
    }
}

/// A frame on some grids.
pub(crate) struct Trial<'a> {
    frame: &'a GaussianFrame,
    bases: &'a [Components; 2],
    sequence: &'a SequenceParameters,
    geometry: Geometry,
    /// How each Gaussian is coded.
    coded: Vec<Coded>,
}

/// What the values of a Gaussian depend on.
struct Coded {
    shape: Shape,
    position_shift: u8,
    /// Of rotation, dc and sh.
    exponents: [u8; 3],
}

impl<'a> Trial<'a> {
    /// `rows`: which Gaussians of the scene these are.
    pub(crate) fn new(grids: &'a Grids<'_>, frame: &'a GaussianFrame, rows: &[u32]) -> Self {
        let Grids { bases, refinement, sequence, grains, rules } = grids;
        let geometry = geometry(frame, sequence);
        let code = |row: usize| {
            let refinement = refinement[rows[row] as usize];
            let rule = &rules[usize::from(refinement)];
            let wanted = geometry.log_scale.each_ref().map(|plane| plane[row]);
            let shape = Shape::new(wanted, geometry.opacity[row], rule, true);
            let exponents = [Stage::Rotation, Stage::Dc, Stage::Sh].map(|stage| shape.exponent(stage, rule));
            Coded { shape, position_shift: grains.of(refinement).position_shift, exponents }
        };
        let coded = (0..frame.len()).into_par_iter().map(code).collect();
        Self { frame, bases, sequence, geometry, coded }
    }

    /// The frame with some attributes as a decoder would have them.
    ///
    /// # Errors
    /// Planes that make no frame.
    pub(crate) fn decoded(&self, attributes: &[Attribute]) -> Result<GaussianFrame, Error> {
        let mut planes = self.frame.clone().into_planes();
        for attribute in attributes {
            match attribute {
                Attribute::Position => self.positions(&mut planes),
                Attribute::LogScale => {
                    let (offset, step) = (self.sequence.log_scale_offset(), self.sequence.log_scale_step());
                    for (axis, plane) in planes.log_scale.iter_mut().enumerate() {
                        let value = |coded: &Coded| offset + step * coded.shape.log_scale[axis] as f32;
                        *plane = self.coded.par_iter().map(value).collect();
                    }
                }
                Attribute::Opacity => {
                    let (offset, step) = (self.sequence.opacity_offset(), self.sequence.opacity_step());
                    let value = |coded: &Coded| offset + step * coded.shape.opacity as f32;
                    planes.opacity_logit = self.coded.par_iter().map(value).collect();
                }
                Attribute::Rotation => self.rotations(&mut planes),
                Attribute::Dc => {
                    for (slot, plane) in planes.dc.iter_mut().zip(self.colours(0)) {
                        *slot = plane;
                    }
                }
                Attribute::Sh => planes.sh = self.colours(1),
            }
        }
        let frame = GaussianFrame::from_planes(self.frame.sh_degree(), planes)?;
        Ok(frame.with_antialiased(self.frame.antialiased()))
    }

    fn positions(&self, planes: &mut Planes) {
        let companding = Companding::new(self.sequence);
        let (offset, step) = (self.sequence.position_offset(), self.sequence.position_step());
        for (axis, plane) in planes.position.iter_mut().enumerate() {
            let value = |(coded, &code): (&Coded, &u32)| {
                let code = refine(code >> coded.position_shift, coded.position_shift);
                offset[axis] + step * companding.expand(code) as f32
            };
            *plane = self.coded.par_iter().zip(&self.geometry.position[axis]).map(value).collect();
        }
    }

    #[expect(clippy::arithmetic_side_effects, reason = "values on a grid times its steps, both clamped")]
    fn rotations(&self, planes: &mut Planes) {
        let finest = self.sequence.rotation_step();
        let [w, parts @ ..] = &mut planes.rotation;
        for (part, values) in parts.iter_mut().zip(self.turns()) {
            let value = |(value, coded): (&i32, &Coded)| finest * (value * step(coded.exponents[0])) as f32;
            *part = values.par_iter().zip(&self.coded).map(value).collect();
        }
        let real = |row: usize| {
            let squares: f32 = parts.iter().map(|plane| plane[row] * plane[row]).sum();
            (1.0 - squares).max(0.0).sqrt()
        };
        *w = (0..self.coded.len()).into_par_iter().map(real).collect();
    }

    /// Coded values of the rotation.
    fn turns(&self) -> [Vec<i32>; 3] {
        self.geometry.rotation.each_ref().map(|plane| {
            let value = |(&parts, coded): (&i32, &Coded)| nearest_multiple(parts, coded.exponents[0]);
            plane.par_iter().zip(&self.coded).map(value).collect()
        })
    }

    fn colour_step(&self, which: usize) -> f32 {
        if which == 0 { self.sequence.dc_step() } else { self.sequence.sh_step() }
    }

    /// Coded values of dc, 0, or sh, 1.
    #[expect(clippy::arithmetic_side_effects, reason = "values on a grid times its steps, both clamped")]
    fn components(&self, which: usize) -> Vec<Vec<i32>> {
        let step_of = self.colour_step(which);
        let kind = [TransformKind::Dc, TransformKind::Sh][which];
        let transform = colour::transform(kind, &self.bases[which], step_of);
        let planes: Vec<&[f32]> = match which {
            0 => self.frame.dc().iter().map(Vec::as_slice).collect(),
            _ => self.frame.sh().iter().map(Vec::as_slice).collect(),
        };
        let value = |(&component, coded): (&f32, &Coded)| {
            let steps = component / step(coded.exponents[1 + which]) as f32;
            nearest_integer(steps.clamp(-1e6, 1e6))
        };
        let components = colour::components(&transform, &planes, step_of);
        components.par_iter().map(|plane| plane.iter().zip(&self.coded).map(value).collect()).collect()
    }

    /// Planes of dc, 0, or sh, 1, from their coded values.
    #[expect(clippy::arithmetic_side_effects, reason = "values on a grid times its steps, both clamped")]
    fn colours(&self, which: usize) -> Vec<Vec<f32>> {
        let (basis, finest) = (&self.bases[which], self.colour_step(which));
        let real = |component: &Vec<i32>| -> Vec<f32> {
            let value = |(value, coded): (&i32, &Coded)| (value * step(coded.exponents[1 + which])) as f32;
            component.iter().zip(&self.coded).map(value).collect()
        };
        let components: Vec<Vec<f32>> = self.components(which).par_iter().map(real).collect();
        let arch = Arch::new();
        let plane = |index: usize| {
            let mut plane = vec![basis.mean[index] as f32; self.coded.len()];
            // Some Gaussians after the others, so that their values are near for all components.
            for (part, values) in plane.chunks_mut(NEAR).enumerate() {
                for (row, component) in basis.rows.iter().zip(&components) {
                    let (weight, own) = (row[index] as f32 * finest, &component[part * NEAR..]);
                    arch.dispatch(AddWeighted { weight, values: own, mean: 0.0, sums: values });
                }
            }
            plane
        };
        (0..components.len()).into_par_iter().map(plane).collect()
    }

    /// Low bits of positions that are left out, of all Gaussians and axes together.
    pub(crate) fn position_bits_left_out(&self) -> f64 {
        self.coded.iter().map(|coded| 3.0 * f64::from(coded.position_shift)).sum()
    }

    /// Zero-order bits of an attribute; of positions, which are sorted, none are counted.
    pub(crate) fn bits(&self, attribute: Attribute) -> f64 {
        let shapes =
            |part: usize| -> Vec<i32> { self.coded.iter().map(|coded| coded.shape.values[part]).collect() };
        let of_all = |planes: &[Vec<i32>]| {
            planes.par_iter().map(|plane| entropy_of(plane)).collect::<Vec<f64>>().iter().sum()
        };
        match attribute {
            Attribute::Position => 0.0,
            Attribute::LogScale => of_all(&[0, 1, 2].map(shapes)),
            Attribute::Opacity => of_all(&[shapes(3)]),
            Attribute::Rotation => of_all(&self.turns()),
            Attribute::Dc => of_all(&self.components(0)),
            Attribute::Sh => of_all(&self.components(1)),
        }
    }
}
