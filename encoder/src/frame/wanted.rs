//! What a run of Gaussians shall become, on the output grids, and the residuals that bring it there.

use super::intra::scale_residuals;
use super::unit::UnitCoder;
use crate::colour;
use crate::gop_tools::{dc_planes, sh_planes};
use crate::grid::{Geometry, Spacing, geometry};
use rayon::prelude::*;
use splatstream_decoder::colour::{COMPONENT_RANGE, Colour, inverse};
use splatstream_decoder::increment::residual::{Attributes, Stage};
use splatstream_decoder::layout::ShCoding;
use splatstream_decoder::list::{FINE, GaussianList};
use splatstream_decoder::position::morton;
use splatstream_format::Result;
use splatstream_format::payload::{Codebook, Transform};
use splatstream_scene::GaussianFrame;

/// The integers of Gaussians; all planes of one length, or empty where a comment says so.
#[derive(Debug, Clone, Default)]
pub(crate) struct Wanted {
    pub(crate) position: [Vec<u32>; 3],
    log_scale: [Vec<i32>; 3],
    opacity: Vec<i32>,
    rotation: [Vec<i32>; 3],
    /// Components of dc, and of sh or codebook indices: how colours are coded where nothing is known of them.
    components: [Vec<Vec<i32>>; 2],
    /// Colours in steps / 64. Empty where nothing is coded as a difference.
    pub(crate) dc: [Vec<i32>; 3],
    pub(crate) sh: Vec<Vec<i32>>,
}

/// Colours nearer to what components give than this, steps / 64, are within the range of components.
const NEAR: f32 = 512.0;

impl Wanted {
    /// Of a canonical frame whose reach has been checked. `sh_components`: those of sh, if they are known.
    ///
    /// # Errors
    /// Components out of range.
    pub(crate) fn new(
        frame: &GaussianFrame,
        spacing: &Spacing,
        sh_components: Option<Vec<Vec<i32>>>,
        coder: &UnitCoder<'_>,
    ) -> Result<Self> {
        let UnitCoder { sequence, colour, .. } = coder;
        let (dc_step, sh_step) = (sequence.dc_step(), sequence.sh_step());
        let zeros = vec![0.0; frame.len()];
        let (dc_planes, sh_planes) = (dc_planes(frame), sh_planes(frame, sequence, &zeros));
        let dc = colour::components(colour.dc, &dc_planes, dc_step, spacing);
        let books: Vec<&Codebook> = colour.codebooks.iter().flatten().copied().collect();
        let sh = sh_components.unwrap_or_else(|| match (colour.mode, colour.sh) {
            (ShCoding::Coefficients { .. }, Some(transform)) => {
                colour::components(transform, &sh_planes, sh_step, spacing)
            }
            (ShCoding::VectorQuantised { .. }, Some(transform)) => {
                colour::stages(transform, &sh_planes, sh_step, &books)
            }
            _ => Vec::new(),
        });
        let Geometry { position, log_scale, opacity, rotation } = geometry(frame, sequence, spacing);
        let mut wanted = Self { position, log_scale, opacity, rotation, ..Self::default() };
        if coder.has_differences {
            let mut red_green_blue = fine(&dc_planes, dc_step, colour.dc, &dc, spacing)?.into_iter();
            wanted.dc = [(); 3].map(|()| red_green_blue.next().unwrap_or_default());
            wanted.sh = match (colour.mode, colour.sh) {
                (ShCoding::Coefficients { .. }, Some(transform)) => {
                    fine(&sh_planes, sh_step, transform, &sh, spacing)?
                }
                _ => vec![vec![0; frame.len()]; sh_planes.len()],
            };
        }
        wanted.components = [dc, sh];
        Ok(wanted)
    }

    /// The planes of some of the Gaussians without prediction, on the finest grids, in coding order.
    pub(crate) fn direct(&self, rows: &[u32]) -> Vec<Vec<i32>> {
        let [largest, middle, smallest] = &self.log_scale;
        let pick = |plane: &Vec<i32>| -> Vec<i32> { rows.iter().map(|&row| plane[row as usize]).collect() };
        let difference = |a: &[i32], b: &[i32]| -> Vec<i32> {
            rows.iter().map(|&row| a[row as usize] - b[row as usize]).collect()
        };
        let mut planes = vec![pick(largest), difference(largest, middle), difference(middle, smallest)];
        let others: Vec<&Vec<i32>> = [&self.opacity]
            .into_iter()
            .chain(&self.rotation)
            .chain(self.components.iter().flatten())
            .collect();
        planes.par_extend(others.into_par_iter().map(pick));
        planes
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
            components: self.components.each_ref().map(picked),
            dc: self.dc.each_ref().map(pick),
            sh: picked(&self.sh),
        }
    }

    /// The Morton code of a Gaussian on the grid of every 2^shift-th point.
    pub(crate) fn code(&self, index: u32, shift: u8) -> u64 {
        let [x, y, z] = self.position.each_ref().map(|plane| plane[index as usize] >> shift);
        morton(x, y, z)
    }

    /// Gaussians.
    pub(crate) fn len(&self) -> usize {
        self.opacity.len()
    }

    /// What brings positions near those wanted, in steps of 2^shift, and not beyond the last grid point.
    pub(crate) fn moves(&self, list: &GaussianList, shift: u8, last: i32) -> Vec<Vec<i32>> {
        let step = |wanted: u32, now: u32| {
            let now = now as i32;
            nearest(wanted as i32 - now, shift).min((last - now) >> shift)
        };
        let of_axis = |(wanted, now): (&Vec<u32>, &Vec<u32>)| {
            wanted.iter().zip(now).map(|(&wanted, &now)| step(wanted, now)).collect()
        };
        self.position.iter().zip(&list.planes.position).map(of_axis).collect()
    }

    /// The residual planes of one attribute on top of what is known or predicted. `is_new`: for new Gaussians, which
    /// have a codebook index where others keep their SH.
    pub(crate) fn residuals(
        &self,
        stage: Stage,
        now: &Attributes,
        shift: u8,
        colour: &Colour<'_>,
        is_new: bool,
    ) -> Vec<Vec<i32>> {
        match stage {
            Stage::LogScale => self.scale_planes(now, shift),
            Stage::Opacity => vec![differences(&self.opacity, &now.opacity, shift)],
            Stage::Rotation => {
                let fine = |(wanted, now): (&Vec<i32>, &Vec<i32>)| {
                    let shift = shift + FINE.ilog2() as u8;
                    wanted.iter().zip(now).map(|(&w, &n)| nearest(w * FINE - n, shift)).collect()
                };
                self.rotation.iter().zip(&now.rotation_fine).map(fine).collect()
            }
            Stage::Dc => components(colour.dc, &self.dc, &now.dc, shift),
            Stage::Sh => match (colour.mode, colour.sh) {
                (ShCoding::Coefficients { .. }, Some(transform)) => {
                    components(transform, &self.sh, &now.sh, shift)
                }
                (ShCoding::VectorQuantised { .. }, _) if is_new => self.components[1].clone(),
                // Entry 0 is zero.
                (ShCoding::VectorQuantised { stages }, _) => vec![vec![0; self.len()]; usize::from(stages)],
                _ => Vec::new(),
            },
        }
    }

    fn scale_planes(&self, now: &Attributes, shift: u8) -> Vec<Vec<i32>> {
        let at = |planes: &[Vec<i32>; 3], row: usize| planes.each_ref().map(|plane| plane[row]);
        let mut planes = [const { Vec::new() }; 3];
        for row in 0..self.len() {
            let residuals = scale_residuals(at(&now.log_scale, row), at(&self.log_scale, row), shift);
            planes.iter_mut().zip(residuals).for_each(|(plane, value)| plane.push(value));
        }
        planes.to_vec()
    }
}

/// Planes of colour in steps / 64. A Gaussian that takes every second point shall become what its components give; any
/// other what it is, so that a residual on top of a prediction is rounded once.
fn fine(
    planes: &[&[f32]],
    step: f32,
    transform: &Transform,
    components: &[Vec<i32>],
    spacing: &Spacing,
) -> Result<Vec<Vec<i32>>> {
    let count = planes.first().map_or(0, |plane| plane.len());
    let mut coded = vec![vec![0; count]; planes.len()];
    inverse(transform, components, &mut coded.iter_mut().map(Vec::as_mut_slice).collect::<Vec<_>>(), 0)?;
    let fine = 64.0 / step;
    for (coded, plane) in coded.iter_mut().zip(planes) {
        for (row, (slot, &value)) in coded.iter_mut().zip(*plane).enumerate() {
            let exact = libm::rintf(value * fine);
            // Beyond the range of components the coded colour is the nearest.
            let is_near = (exact - *slot as f32).abs() < NEAR;
            if !spacing.is_coarse(row) && is_near {
                *slot = exact as i32;
            }
        }
    }
    Ok(coded)
}

/// x / 2^shift to the nearest integer, halves up.
pub(crate) fn nearest(x: i32, shift: u8) -> i32 {
    if shift == 0 { x } else { (x + (1 << (shift - 1))) >> shift }
}

fn differences(wanted: &[i32], now: &[i32], shift: u8) -> Vec<i32> {
    wanted.iter().zip(now).map(|(&wanted, &now)| nearest(wanted - now, shift)).collect()
}

/// Colour differences as components of a transform, in steps of 2^shift.
fn components(transform: &Transform, wanted: &[Vec<i32>], now: &[Vec<i32>], shift: u8) -> Vec<Vec<i32>> {
    let count = wanted.first().map_or(0, Vec::len);
    // Basis in Q12, colours in 1/64: one step is 2^18.
    let unit = 1_i64 << (18 + shift);
    // In range when a decoder has shifted it back.
    let most = i64::from(COMPONENT_RANGE.end() >> shift);
    let row_sum = |weights: &[i16], row: usize| -> i32 {
        let term = |(&weight, (wanted, now)): (&i16, (&Vec<i32>, &Vec<i32>))| {
            i64::from(weight) * (i64::from(wanted[row]) - i64::from(now[row]))
        };
        let sum: i64 = weights.iter().zip(wanted.iter().zip(now)).map(term).sum();
        (sum + unit / 2).div_euclid(unit).clamp(-most, most) as i32
    };
    transform.rows().map(|weights| (0..count).map(|row| row_sum(weights, row)).collect()).collect()
}
