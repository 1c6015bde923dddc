//! What a run of Gaussians shall become, on the output grids, and the residuals that bring it there.
#![expect(
    clippy::arithmetic_side_effects,
    reason = "values and differences on the grid are below 2^26, steps are 1 or more"
)]
#![expect(
    clippy::indexing_slicing,
    reason = "rows are those of the frame that all planes are of; axes are constants"
)]

use super::unit::UnitCoder;
use crate::colour;
use crate::gop_tools::{dc_planes, sh_planes};
use crate::grid::{Geometry, Place, geometry, nearest_integer};
use crate::shape::{Shape, nearest_multiple, scale_residuals, scale_updates};
use crate::vq;
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;
use splatstream_decoder::colour::{COMPONENT_RANGE, Colour};
use splatstream_decoder::increment::residual::{AttributeValues, Attributes};
use splatstream_decoder::layout::ShCoding;
use splatstream_decoder::list::GaussianList;
use splatstream_decoder::position::morton;
use splatstream_decoder::steps::{Exponents, Stage, StepRule, step};
use splatstream_format::Result;
use splatstream_format::payload::Transform;
use splatstream_gaussians::GaussianFrame;

/// The integers of Gaussians; all planes of one length, or empty where a comment says so. Attributes are in
/// [parts](crate::grid::PARTS) of a step: they are rounded once, when their steps are known.
#[derive(Debug, Clone, Default)]
pub(crate) struct Wanted {
    pub(crate) position: [Vec<Place>; 3],
    log_scale: [Vec<i32>; 3],
    opacity: Vec<i32>,
    rotation: [Vec<i32>; 3],
    /// Components of dc and of sh, steps: how colours are coded where nothing is known of them.
    components: [Vec<Vec<f32>>; 2],
    /// Colours. Empty where nothing is coded as a difference.
    pub(crate) dc: [Vec<i32>; 3],
    pub(crate) sh: Vec<Vec<i32>>,
}

impl Wanted {
    /// Of a canonical frame whose reach has been checked. `sh_components`: those of sh, if they are known.
    pub(crate) fn new(
        frame: &GaussianFrame,
        sh_components: Option<Vec<Vec<f32>>>,
        coder: &UnitCoder<'_>,
    ) -> Self {
        let UnitCoder { sequence, colour, .. } = coder;
        let (dc_step, sh_step) = (sequence.dc_step(), sequence.sh_step());
        let zeros = vec![0.0; frame.len()];
        let (dc_planes, sh_planes) = (dc_planes(frame), sh_planes(frame, sequence, &zeros));
        let dc = colour::components(colour.dc, &dc_planes, dc_step);
        let sh = sh_components.unwrap_or_else(|| match colour.sh {
            Some(transform) => colour::components(transform, &sh_planes, sh_step),
            None => Vec::new(),
        });
        let Geometry { position, log_scale, opacity, rotation } = geometry(frame, sequence);
        let mut wanted = Self { position, log_scale, opacity, rotation, ..Self::default() };
        if coder.has_differences {
            wanted.dc = dc_planes.map(|plane| fine(plane, dc_step));
            wanted.sh = sh_planes.par_iter().map(|plane| fine(plane, sh_step)).collect();
        }
        wanted.components = [dc, sh];
        wanted
    }

    /// The planes of some of the Gaussians without prediction, in coding order.
    pub(crate) fn direct(&self, rows: &[u32], rule: &StepRule, coder: &UnitCoder<'_>) -> Vec<Vec<i32>> {
        let sorted = coder.sequence.canonical_axes();
        let shapes: Vec<Shape> = rows.par_iter().map(|&row| self.shape(row, rule, sorted)).collect();
        let mut planes: Vec<Vec<i32>> =
            (0..4).map(|plane: usize| shapes.iter().map(|shape| shape.values[plane]).collect()).collect();
        let exponents =
            |stage: Stage| -> Vec<u8> { shapes.iter().map(|shape| shape.exponent(stage, rule)).collect() };
        let turned = exponents(Stage::Rotation);
        planes.extend(self.rotation.iter().map(|plane| {
            let value = |((&row, shape), &exponent): ((&u32, &Shape), &u8)| {
                if shape.is_sphere() { 0 } else { nearest_multiple(plane[row as usize], exponent) }
            };
            rows.iter().zip(&shapes).zip(&turned).map(value).collect::<Vec<i32>>()
        }));
        let [dc, sh] = &self.components;
        planes.extend(rounded(dc, rows, &exponents(Stage::Dc)));
        let exponents = exponents(Stage::Sh);
        match coder.colour.mode {
            ShCoding::None => {}
            ShCoding::Coefficients { .. } => planes.extend(rounded(sh, rows, &exponents)),
            ShCoding::VectorQuantised { .. } => {
                let values = scaled_rows(sh, rows, &exponents);
                let books: Vec<_> = coder.colour.codebooks.iter().flatten().copied().collect();
                planes.extend(vq::stages(values, sh.len(), &books));
            }
        }
        planes
    }

    fn shape(&self, row: u32, rule: &StepRule, sorted: bool) -> Shape {
        let row = row as usize;
        Shape::new(self.log_scale.each_ref().map(|plane| plane[row]), self.opacity[row], rule, sorted)
    }

    /// Some of the Gaussians.
    pub(crate) fn select(&self, rows: &[u32]) -> Self {
        let pick = |plane: &Vec<i32>| -> Vec<i32> { rows.iter().map(|&row| plane[row as usize]).collect() };
        let picked = |planes: &Vec<Vec<i32>>| planes.iter().map(pick).collect();
        let position =
            self.position.each_ref().map(|plane| rows.iter().map(|&row| plane[row as usize]).collect());
        Self {
            position,
            log_scale: self.log_scale.each_ref().map(pick),
            opacity: pick(&self.opacity),
            rotation: self.rotation.each_ref().map(pick),
            components: self.components.each_ref().map(|planes| {
                planes.iter().map(|plane| rows.iter().map(|&row| plane[row as usize]).collect()).collect()
            }),
            dc: self.dc.each_ref().map(pick),
            sh: picked(&self.sh),
        }
    }

    /// The Morton code of a Gaussian on the grid of every 2^shift-th point.
    pub(crate) fn code(&self, index: u32, shift: u8) -> u64 {
        let [x, y, z] = self.position.each_ref().map(|plane| plane[index as usize].code(shift));
        morton(x, y, z)
    }

    /// Gaussians.
    pub(crate) fn len(&self) -> usize {
        self.opacity.len()
    }

    /// What brings positions near those wanted, in steps of 2^shift, and not beyond the last grid point.
    pub(crate) fn moves(&self, list: &GaussianList, shift: u8, last: i32) -> Vec<Vec<i32>> {
        let step = |wanted: Place, now: u32| wanted.steps_from(now, shift).min((last - now as i32) >> shift);
        let of_axis = |(wanted, now): (&Vec<Place>, &Vec<u32>)| {
            wanted.iter().zip(now).map(|(&wanted, &now)| step(wanted, now)).collect()
        };
        self.position.iter().zip(&list.planes.position).map(of_axis).collect()
    }

    /// The residual planes of one attribute on top of what is known or predicted; those before it are what residuals have
    /// made of them. `is_new`: for new Gaussians, which have a codebook index where others keep their SH.
    pub(crate) fn residuals(
        &self,
        stage: Stage,
        now: &Attributes,
        rule: &StepRule,
        coder: &UnitCoder<'_>,
        is_new: bool,
    ) -> Vec<Vec<i32>> {
        let exponents = || now.exponents(stage, rule);
        let colour = &coder.colour;
        match stage {
            Stage::LogScale => self.scale_planes(now, rule, coder.sequence.canonical_axes()),
            Stage::Opacity => vec![differences(&self.opacity, &now.opacity, &exponents())],
            Stage::Rotation => {
                let exponents = exponents();
                let fine = |(wanted, now): (&Vec<i32>, &Vec<i32>)| {
                    let pairs = wanted.iter().zip(now).enumerate();
                    pairs.map(|(row, (&w, &n))| nearest_multiple(w - n, exponents.at(row))).collect()
                };
                self.rotation.iter().zip(&now.rotation_fine).map(fine).collect()
            }
            Stage::Dc => components(colour.dc, &self.dc, &now.dc, &exponents()),
            Stage::Sh => match (colour.mode, colour.sh) {
                (ShCoding::Coefficients { .. }, Some(transform)) => {
                    components(transform, &self.sh, &now.sh, &exponents())
                }
                (ShCoding::VectorQuantised { .. }, Some(_)) if is_new => self.indices(&exponents(), colour),
                // Entry 0 is zero.
                (ShCoding::VectorQuantised { stages }, _) => vec![vec![0; self.len()]; usize::from(stages)],
                _ => Vec::new(),
            },
        }
    }

    /// The residual planes of all attributes of Gaussians of which coarser ones are known.
    ///
    /// # Errors
    /// What the decoder's own checks refuse.
    pub(crate) fn updates(
        &self,
        mut now: Attributes,
        attribute_step: [u8; 5],
        coder: &UnitCoder<'_>,
    ) -> Result<Vec<Vec<i32>>> {
        let rule = coder.steps(attribute_step);
        let mut planes = Vec::new();
        for stage in Stage::ALL {
            planes.extend(self.residuals(stage, &now, &rule, coder, false));
            now.add_stage(stage, AttributeValues(&planes), &coder.coding(attribute_step), 0)?;
        }
        Ok(planes)
    }

    /// The codebook indices of all Gaussians.
    fn indices(&self, exponents: &Exponents, colour: &Colour<'_>) -> Vec<Vec<i32>> {
        let [_, sh] = &self.components;
        let rows: Vec<u32> = (0..self.len() as u32).collect();
        let exponents: Vec<u8> = (0..self.len()).map(|row| exponents.at(row)).collect();
        let books: Vec<_> = colour.codebooks.iter().flatten().copied().collect();
        vq::stages(scaled_rows(sh, &rows, &exponents), sh.len(), &books)
    }

    fn scale_planes(&self, now: &Attributes, rule: &StepRule, sorted: bool) -> Vec<Vec<i32>> {
        let at = |planes: &[Vec<i32>; 3], row: usize| planes.each_ref().map(|plane| plane[row]);
        let mut planes = [const { Vec::new() }; 3];
        // What brings parents nearer, each log-scale by itself, or new Gaussians, by differences.
        let residuals_of = if now.parents.is_some() { scale_updates } else { scale_residuals };
        for row in 0..self.len() {
            let residuals = residuals_of(at(&now.log_scale, row), at(&self.log_scale, row), rule, sorted);
            planes.iter_mut().zip(residuals).for_each(|(plane, value)| plane.push(value));
        }
        planes.to_vec()
    }
}

/// Components that are fetched and rounded at a time: they stay in the first-level cache.
const TILE: usize = 1 << 10;

/// Components of some Gaussians to the nearest multiples of their steps.
fn rounded(components: &[Vec<f32>], rows: &[u32], exponents: &[u8]) -> Vec<Vec<i32>> {
    // The same for all planes: the step of each Gaussian, and how many of them a component may have.
    let steps: Vec<f32> = exponents.iter().map(|&exponent| step(exponent) as f32).collect();
    let most: Vec<f32> =
        exponents.iter().map(|&exponent| (COMPONENT_RANGE.end() / step(exponent)) as f32).collect();
    let arch = Arch::new();
    let plane = |plane: &Vec<f32>| {
        let mut values = vec![0; rows.len()];
        let mut fetched = [0.0; TILE];
        let tiles = rows.chunks(TILE).zip(values.chunks_mut(TILE));
        for ((rows, values), (steps, most)) in tiles.zip(steps.chunks(TILE).zip(most.chunks(TILE))) {
            fetched.iter_mut().zip(rows).for_each(|(value, &row)| *value = plane[row as usize]);
            arch.dispatch(Round { fetched: &fetched, steps, most, values });
        }
        values
    };
    components.par_iter().map(plane).collect()
}

/// Rounds values to multiples of steps, no more of them than there may be: with the vectors of the machine, on every one the
/// same.
struct Round<'a> {
    fetched: &'a [f32],
    steps: &'a [f32],
    most: &'a [f32],
    values: &'a mut [i32],
}

impl WithSimd for Round<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { fetched, steps, most, values } = self;
        for (((value, &fetched), &step), &most) in values.iter_mut().zip(fetched).zip(steps).zip(most) {
            *value = nearest_integer((fetched / step).clamp(-most, most));
        }
    }
}

/// The components of some Gaussians in their own steps, Gaussian by Gaussian.
fn scaled_rows(components: &[Vec<f32>], rows: &[u32], exponents: &[u8]) -> Vec<f32> {
    // Whole vectors of many rows fill much memory: no more is taken than they need.
    let mut scaled = Vec::with_capacity(rows.len() * components.len());
    for (&row, &exponent) in rows.iter().zip(exponents) {
        scaled.extend(components.iter().map(|plane| plane[row as usize] / step(exponent) as f32));
    }
    scaled
}

/// A plane of colour in parts of a step.
fn fine(plane: &[f32], step: f32) -> Vec<i32> {
    let scale = crate::grid::PARTS / step;
    let most = (COMPONENT_RANGE.end() * crate::shape::PARTS) as f32;
    plane.par_iter().map(|&value| nearest_integer((value * scale).clamp(-most, most))).collect()
}

fn differences(wanted: &[i32], now: &[i32], exponents: &Exponents) -> Vec<i32> {
    let pairs = wanted.iter().zip(now).enumerate();
    pairs
        .map(|(row, (&wanted, &now))| nearest_multiple(wanted - crate::shape::PARTS * now, exponents.at(row)))
        .collect()
}

/// Colour differences as components of a transform, in steps of each Gaussian.
fn components(
    transform: &Transform,
    wanted: &[Vec<i32>],
    now: &[Vec<i32>],
    exponents: &Exponents,
) -> Vec<Vec<i32>> {
    let count = wanted.first().map_or(0, Vec::len);
    let row_sum = |weights: &[i16], row: usize| -> i32 {
        let step = step(exponents.at(row));
        // Basis in Q12, colours in 1/64: a finest step is 2^18.
        let unit = i64::from(step) << 18;
        let most = i64::from(COMPONENT_RANGE.end() / step);
        let term = |(&weight, (wanted, now)): (&i16, (&Vec<i32>, &Vec<i32>))| {
            i64::from(weight) * (i64::from(wanted[row]) - i64::from(now[row]))
        };
        let sum: i64 = weights.iter().zip(wanted.iter().zip(now)).map(term).sum();
        (sum + unit / 2).div_euclid(unit).clamp(-most, most) as i32
    };
    transform.rows().map(|weights| (0..count).map(|row| row_sum(weights, row)).collect()).collect()
}
