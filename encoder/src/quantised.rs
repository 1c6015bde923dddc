//! A frame with values on the grids that some steps give: what a decoder would have, and what it would cost.
#![expect(
    clippy::indexing_slicing,
    reason = "rows are those of the frame that all planes are of; parts and axes are constants"
)]

use crate::attribute::Attribute;
use crate::colour;
use crate::combination::{self, Combination, TILE, Tile};
use crate::entropy_cost::entropy_of;
use crate::error::Error;
use crate::frame::grain::Grains;
use crate::grid::{Geometry, Place, geometry, nearest_integer};
use crate::pca::Components;
use crate::shape::{Shape, nearest_multiple};
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;
use splatstream_decoder::output::Companding;
use splatstream_decoder::position::refine;
use splatstream_decoder::steps::{Stage, StepRule, step};
use splatstream_format::syntax::{SequenceParameters, TransformKind};
use splatstream_gaussians::{GaussianFrame, Planes};

/// Coded values of colours are below this in magnitude.
const MOST: f32 = 1e6;

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
        let has = |attribute| attributes.contains(&attribute);
        let source = self.frame.planes();
        let dc = || self.colours(0).try_into().unwrap_or_default();
        let planes = Planes {
            position: if has(Attribute::Position) { self.positions() } else { source.position.clone() },
            log_scale: if has(Attribute::LogScale) { self.log_scales() } else { source.log_scale.clone() },
            rotation: if has(Attribute::Rotation) { self.rotations() } else { source.rotation.clone() },
            opacity_logit: if has(Attribute::Opacity) {
                self.opacities()
            } else {
                source.opacity_logit.clone()
            },
            dc: if has(Attribute::Dc) { dc() } else { source.dc.clone() },
            sh: if has(Attribute::Sh) { self.colours(1) } else { source.sh.to_vec() },
        };
        let frame = GaussianFrame::from_planes(self.frame.sh_degree(), planes)?;
        Ok(frame.with_antialiased(self.frame.antialiased()))
    }

    fn positions(&self) -> [Vec<f32>; 3] {
        let companding = Companding::new(self.sequence);
        let (offset, step) = (self.sequence.position_offset(), self.sequence.position_step());
        [0, 1, 2].map(|axis: usize| {
            let value = |(coded, place): (&Coded, &Place)| {
                let code = refine(place.code(coded.position_shift), coded.position_shift);
                offset[axis] + step * companding.expand(code) as f32
            };
            self.coded.par_iter().zip(&self.geometry.position[axis]).map(value).collect()
        })
    }

    fn log_scales(&self) -> [Vec<f32>; 3] {
        let (offset, step) = (self.sequence.log_scale_offset(), self.sequence.log_scale_step());
        [0, 1, 2].map(|axis: usize| {
            let value = |coded: &Coded| offset + step * coded.shape.log_scale[axis] as f32;
            self.coded.par_iter().map(value).collect()
        })
    }

    fn opacities(&self) -> Vec<f32> {
        let (offset, step) = (self.sequence.opacity_offset(), self.sequence.opacity_step());
        self.coded.par_iter().map(|coded| offset + step * coded.shape.opacity as f32).collect()
    }

    #[expect(clippy::arithmetic_side_effects, reason = "values on a grid times its steps, both clamped")]
    fn rotations(&self) -> [Vec<f32>; 4] {
        let finest = self.sequence.rotation_step();
        let [x, y, z]: [Vec<f32>; 3] = self.turns().map(|values| {
            let value = |(value, coded): (&i32, &Coded)| finest * (value * step(coded.exponents[0])) as f32;
            values.par_iter().zip(&self.coded).map(value).collect()
        });
        let real = |row: usize| {
            let squares: f32 = [&x, &y, &z].iter().map(|plane| plane[row] * plane[row]).sum();
            (1.0 - squares).max(0.0).sqrt()
        };
        [(0..self.coded.len()).into_par_iter().map(real).collect(), x, y, z]
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

    /// What makes components, in units of the step, of dc, 0, or sh, 1; and the planes of that.
    fn forwards(&self, which: usize) -> (Combination, Vec<&[f32]>) {
        let step_of = self.colour_step(which);
        let kind = [TransformKind::Dc, TransformKind::Sh][which];
        let transform = colour::transform(kind, &self.bases[which], step_of);
        let planes = if which == 0 { self.frame.dc().as_slice() } else { self.frame.sh() };
        (colour::forwards(&transform, step_of), planes.iter().map(Vec::as_slice).collect())
    }

    /// Coded values of dc, 0, or sh, 1.
    #[expect(clippy::arithmetic_side_effects, reason = "another place of an array")]
    fn components(&self, which: usize) -> Vec<Vec<i32>> {
        let (forwards, planes) = self.forwards(which);
        let value = |(&component, coded): (&f32, &Coded)| {
            nearest_integer((component / step(coded.exponents[1 + which]) as f32).clamp(-MOST, MOST))
        };
        let components = forwards.of(&planes);
        components.par_iter().map(|plane| plane.iter().zip(&self.coded).map(value).collect()).collect()
    }

    /// Planes of dc, 0, or sh, 1, from their coded values: forth, to the nearest steps, and back, as long as values are near.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "sums and products of floats; another place of an array"
    )]
    fn colours(&self, which: usize) -> Vec<Vec<f32>> {
        let (basis, finest) = (&self.bases[which], self.colour_step(which));
        let (forwards, planes) = self.forwards(which);
        let weight = |index: usize| basis.rows.iter().map(|row| row[index] as f32 * finest).collect();
        let backwards = Combination {
            before: Vec::new(),
            weights: (0..planes.len()).map(weight).collect(),
            start: basis.mean.iter().map(|&mean| mean as f32).collect(),
        };
        let arch = Arch::new();
        combination::assembled(self.coded.len(), planes.len(), |first, colours| {
            let mut components = vec![[0.0; TILE]; planes.len()];
            forwards.tile(arch, &planes, first, &mut components);
            let mut steps = [1.0; TILE];
            let coded = self.coded[first..].iter();
            steps.iter_mut().zip(coded).for_each(|(to, coded)| *to = step(coded.exponents[1 + which]) as f32);
            arch.dispatch(Round { steps: &steps, components: &mut components });
            backwards.sums(arch, &components, colours);
        })
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

/// Brings components to the nearest multiples of steps.
struct Round<'a> {
    steps: &'a Tile,
    components: &'a mut [Tile],
}

impl WithSimd for Round<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        for plane in self.components {
            for (component, step) in plane.iter_mut().zip(self.steps) {
                *component = nearest_integer((*component / step).clamp(-MOST, MOST)) as f32 * step;
            }
        }
    }
}
