//! What a run of Gaussians shall become, on the output lattices, and the residuals that bring it there.

use super::anchor::scale_residuals;
use crate::lattice::{Geometry, Spacing};
use splatstream_decoder::colour::{COMPONENT_RANGE, Colour, inverse};
use splatstream_decoder::home::{FINE, Home};
use splatstream_decoder::increment::residual::{Attributes, Stage};
use splatstream_decoder::layout::ShCoding;
use splatstream_decoder::position::morton;
use splatstream_format::Result;
use splatstream_format::payload::Transform;

/// The integers of Gaussians; all planes of one length.
#[derive(Debug, Clone, Default)]
pub(crate) struct Wanted {
    pub(crate) position: [Vec<u32>; 3],
    log_scale: [Vec<i32>; 3],
    opacity: Vec<i32>,
    rotation: [Vec<i32>; 3],
    /// Steps / 64.
    pub(crate) dc: [Vec<i32>; 3],
    pub(crate) sh: Vec<Vec<i32>>,
    /// Codebook indices, where SH is vector quantised.
    indices: Vec<Vec<i32>>,
}

/// Colours of Gaussians: what they are, and how they are coded without prediction.
pub(crate) struct ColourTarget<'a> {
    /// Planes in PLY's domain, and the step.
    pub(crate) planes: &'a [&'a [f32]],
    pub(crate) step: f32,
    /// Components, or codebook indices.
    pub(crate) components: &'a [Vec<i32>],
}

impl ColourTarget<'_> {
    /// The planes in steps / 64. A Gaussian that takes every second point shall become what its components give; any
    /// other what it is, so that a residual on top of a prediction is rounded once.
    fn planes(&self, transform: &Transform, spacing: &Spacing) -> Result<Vec<Vec<i32>>> {
        let count = self.planes.first().map_or(0, |plane| plane.len());
        let mut coded = vec![vec![0; count]; self.planes.len()];
        inverse(
            transform,
            self.components,
            &mut coded.iter_mut().map(Vec::as_mut_slice).collect::<Vec<_>>(),
            0,
        )?;
        let fine = 64.0 / self.step;
        for (coded, plane) in coded.iter_mut().zip(self.planes) {
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
}

/// Colours nearer to what components give than this, steps / 64, are within the range of components.
const NEAR: f32 = 512.0;

impl Wanted {
    /// Of geometry and colours. Where SH is vector quantised, `sh` has codebook indices.
    ///
    /// # Errors
    /// Components out of range.
    pub(crate) fn new(
        geometry: &Geometry,
        dc: &ColourTarget<'_>,
        sh: &ColourTarget<'_>,
        colour: &Colour<'_>,
        spacing: &Spacing,
    ) -> Result<Self> {
        let count = geometry.opacity.len();
        let red_green_blue = dc.planes(colour.dc, spacing)?;
        let mut planes = red_green_blue.into_iter();
        let mut indices = Vec::new();
        let sh = match (colour.mode, colour.sh) {
            (ShCoding::Coefficients { .. }, Some(transform)) => sh.planes(transform, spacing)?,
            (ShCoding::VectorQuantised { .. }, _) => {
                indices = sh.components.to_vec();
                vec![vec![0; count]; sh.planes.len()]
            }
            _ => vec![vec![0; count]; sh.planes.len()],
        };
        Ok(Self {
            position: geometry.position.clone(),
            log_scale: geometry.log_scale.clone(),
            opacity: geometry.opacity.clone(),
            rotation: geometry.rotation.clone(),
            dc: [(); 3].map(|()| planes.next().unwrap_or_default()),
            sh,
            indices,
        })
    }

    /// Some of the Gaussians.
    pub(crate) fn select(&self, rows: &[u32]) -> Self {
        let pick = |plane: &Vec<i32>| -> Vec<i32> { rows.iter().map(|&row| plane[row as usize]).collect() };
        Self {
            position: self
                .position
                .each_ref()
                .map(|plane| rows.iter().map(|&row| plane[row as usize]).collect()),
            log_scale: self.log_scale.each_ref().map(pick),
            opacity: pick(&self.opacity),
            rotation: self.rotation.each_ref().map(pick),
            dc: self.dc.each_ref().map(pick),
            sh: self.sh.iter().map(pick).collect(),
            indices: self.indices.iter().map(pick).collect(),
        }
    }

    /// The Morton code of a Gaussian on the lattice of every 2^shift-th point.
    pub(crate) fn code(&self, place: u32, shift: u8) -> u64 {
        let [x, y, z] = self.position.each_ref().map(|plane| plane[place as usize] >> shift);
        morton(x, y, z)
    }

    /// Gaussians.
    pub(crate) fn len(&self) -> usize {
        self.opacity.len()
    }

    /// What brings positions near those wanted, in steps of 2^shift, and not beyond the last lattice point.
    pub(crate) fn moves(&self, home: &Home, shift: u8, last: i32) -> Vec<Vec<i32>> {
        let step = |wanted: u32, now: u32| {
            let now = now as i32;
            nearest(wanted as i32 - now, shift).min((last - now) >> shift)
        };
        let of_axis = |(wanted, now): (&Vec<u32>, &Vec<u32>)| {
            wanted.iter().zip(now).map(|(&wanted, &now)| step(wanted, now)).collect()
        };
        self.position.iter().zip(&home.planes.position).map(of_axis).collect()
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
                (ShCoding::VectorQuantised { .. }, _) if is_new => self.indices.clone(),
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
