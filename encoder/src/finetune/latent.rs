//! The values of an I frame that pictures may change, and what a decoder makes of them.
#![expect(
    clippy::arithmetic_side_effects,
    reason = "values and differences on the grid are below 2^26; counts of what is in memory"
)]
#![expect(
    clippy::indexing_slicing,
    reason = "rows are those of the frame that all planes are of; planes are counted by the transforms"
)]

use crate::error::Error;
use crate::frame::residuals::Wanted;
use crate::frame::unit::{Grain, UnitCoder};
use core::ops::Range;
use rayon::prelude::*;
use splatstream_decoder::companding::Companding;
use splatstream_decoder::frame::QuantizedFrame;
use splatstream_decoder::increment::residual::{AttributeValues, Attributes};
use splatstream_decoder::list::canonical;
use splatstream_decoder::output::to_gaussians;
use splatstream_decoder::position::refine;
use splatstream_decoder::stage::Stage;
use splatstream_decoder::steps::step;
use splatstream_format::payload::Transform;
use splatstream_gaussians::{GaussianFrame, Planes};

/// The first plane of each attribute, in the order of coded values after the position; dc and sh are in components.
pub(super) const POSITION: usize = 0;
pub(super) const LOG_SCALE: usize = 3;
pub(super) const OPACITY: usize = 6;
pub(super) const ROTATION: usize = 7;
pub(super) const DC: usize = 10;

/// A basis entry of 1.
const UNIT: f32 = 4096.0;

/// The Gaussians of a list: rows of the latent values, and how finely they are coded.
#[derive(Clone)]
pub(super) struct List {
    pub(super) rows: Range<usize>,
    pub(super) grain: Grain,
}

/// The values of a frame, most important Gaussian first, beside those of the source.
pub(super) struct Latent<'a> {
    pub(super) coder: &'a UnitCoder<'a>,
    pub(super) source: &'a GaussianFrame,
    pub(super) lists: Vec<List>,
    /// What a step of each value is, in the unit of the attribute; plane by plane.
    steps: Vec<Vec<f32>>,
    /// Steps that each value is away from that of the source.
    pub(super) offsets: Vec<Vec<f32>>,
}

/// What a decoder has.
pub(super) struct Decoded {
    pub(super) frame: GaussianFrame,
    /// Coded values of the planes after the position, list after list.
    pub(super) values: Vec<Vec<i32>>,
}

/// A list while it is decoded.
struct Part {
    position: [Vec<u32>; 3],
    values: Vec<Vec<i32>>,
    attributes: Attributes,
}

impl<'a> Latent<'a> {
    /// Of a canonical frame whose Gaussians stand in the order of the lists.
    pub(super) fn new(
        coder: &'a UnitCoder<'a>,
        source: &'a GaussianFrame,
        lists: Vec<List>,
    ) -> Result<Self, Error> {
        let planes = DC + ranks(coder).iter().sum::<usize>();
        let offsets = vec![vec![0.0; source.len()]; planes];
        let mut latent = Self { coder, source, lists, steps: Vec::new(), offsets };
        latent.steps = latent.first_steps()?;
        Ok(latent)
    }

    /// The frame with its values where pictures want them.
    pub(super) fn frame(&self) -> Result<GaussianFrame, Error> {
        let mut planes = self.source.planes().clone();
        let add = |plane: &mut Vec<f32>, at: usize| {
            let moves = self.offsets[at].par_iter().zip(&self.steps[at]);
            plane.par_iter_mut().zip(moves).for_each(|(value, (offset, step))| *value += offset * step);
        };
        planes.position.iter_mut().enumerate().for_each(|(axis, plane)| add(plane, POSITION + axis));
        planes.log_scale.iter_mut().enumerate().for_each(|(axis, plane)| add(plane, LOG_SCALE + axis));
        add(&mut planes.opacity_logit, OPACITY);
        planes.rotation.iter_mut().skip(1).enumerate().for_each(|(axis, plane)| add(plane, ROTATION + axis));
        let [dc, sh] = self.transforms();
        let mut first = DC;
        for (transform, planes) in [(dc, planes.dc.as_mut_slice()), (sh, planes.sh.as_mut_slice())] {
            let Some(transform) = transform else { continue };
            planes.par_iter_mut().enumerate().for_each(|(plane, values)| {
                for (component, weights) in transform.rows().enumerate() {
                    let weight = f32::from(weights[plane]) / UNIT;
                    let at = first + component;
                    let moves = self.offsets[at].iter().zip(&self.steps[at]);
                    values.iter_mut().zip(moves).for_each(|(value, (offset, step))| *value += weight * (offset * step));
                }
            });
            first += transform.rows().len();
        }
        let frame = GaussianFrame::from_planes(self.source.sh_degree(), planes)?;
        Ok(frame.with_antialiased(self.source.antialiased()))
    }

    /// What a decoder makes of the values.
    pub(super) fn decoded(&self) -> Result<Decoded, Error> {
        let wanted = Wanted::new(&self.frame()?, None, self.coder);
        let parts = self.parts(&wanted)?;
        let sequence = self.coder.sequence;
        let mut planes = QuantizedFrame::zeroed(0, usize::from(sequence.sh_dimension()));
        let mut values = vec![Vec::new(); self.coder_planes()];
        for Part { position, values: own, attributes } in parts {
            let rotation = attributes.rotation_fine.map(|plane| plane.into_iter().map(canonical).collect());
            let Attributes { log_scale, opacity, dc, sh, .. } = attributes;
            planes.append(&QuantizedFrame { position, log_scale, opacity, rotation, dc, sh });
            values.iter_mut().zip(own).for_each(|(plane, own)| plane.extend(own));
        }
        Ok(Decoded { frame: to_gaussians(planes, sequence)?, values })
    }

    /// Planes of coded values after the position.
    fn coder_planes(&self) -> usize {
        use splatstream_decoder::layout::Section;
        let layout = self.coder.layout(Section::New);
        layout.planes().iter().filter(|plane| !plane.is_position()).count()
    }

    fn parts(&self, wanted: &Wanted) -> Result<Vec<Part>, Error> {
        let part = |list: &List| {
            let rows: Vec<u32> = list.rows.clone().map(|row| row as u32).collect();
            let Grain { position_shift, attribute_step } = list.grain;
            let values = wanted.direct(&rows, &self.coder.steps(attribute_step), self.coder);
            let sh_planes = usize::from(self.coder.sequence.sh_dimension());
            let mut attributes = Attributes::unpredicted(rows.len(), &self.coder.colour, sh_planes);
            attributes.add(AttributeValues(&values), &self.coder.coding(attribute_step), 0)?;
            let position = wanted.position.each_ref().map(|plane| {
                plane[list.rows.clone()].iter().map(|&code| refine(code >> position_shift, position_shift)).collect()
            });
            Ok(Part { position, values, attributes })
        };
        self.lists.par_iter().map(part).collect()
    }

    /// What a step of each value is, where the values are those of the source.
    fn first_steps(&self) -> Result<Vec<Vec<f32>>, Error> {
        let sequence = self.coder.sequence;
        let parts = self.parts(&Wanted::new(self.source, None, self.coder))?;
        let companding = Companding::new(sequence);
        let last = (1_u32 << sequence.position_bits) - 1;
        let mut steps = vec![Vec::new(); self.offsets.len()];
        for (list, part) in self.lists.iter().zip(&parts) {
            let Grain { position_shift, attribute_step } = list.grain;
            for axis in 0..3 {
                let of_code = |&code: &u32| {
                    let low = code.min(last - 1);
                    let length = companding.expand(low + 1) - companding.expand(low);
                    sequence.position_step() * (length << position_shift) as f32
                };
                steps[POSITION + axis].extend(part.position[axis].iter().map(of_code));
            }
            let rule = self.coder.steps(attribute_step);
            let count = list.rows.len();
            let largest = step(rule.of_largest()) as f32 * sequence.log_scale_step();
            steps[LOG_SCALE].extend(core::iter::repeat_n(largest, count));
            let mut extend = |planes: Range<usize>, stage: Stage, unit: f32| {
                let exponents = part.attributes.exponents(stage, &rule);
                for plane in planes {
                    steps[plane].extend((0..count).map(|row| step(exponents.at(row)) as f32 * unit));
                }
            };
            extend(LOG_SCALE + 1..OPACITY, Stage::LogScale, sequence.log_scale_step());
            extend(OPACITY..ROTATION, Stage::Opacity, sequence.opacity_step());
            extend(ROTATION..DC, Stage::Rotation, sequence.rotation_step());
            let sh = DC + ranks(self.coder)[0];
            extend(DC..sh, Stage::Dc, sequence.dc_step());
            extend(sh..self.offsets.len(), Stage::Sh, sequence.sh_step());
        }
        Ok(steps)
    }

    /// What a step of each value is, in the unit of the attribute; plane by plane.
    pub(super) fn steps(&self) -> &[Vec<f32>] {
        &self.steps
    }

    fn transforms(&self) -> [Option<&'a Transform>; 2] {
        let colour = &self.coder.colour;
        [Some(colour.dc), colour.sh.filter(|_| ranks(self.coder)[1] > 0)]
    }

    /// What a loss gains with each value, for each step of it; from what it gains with each value of the decoded frame.
    pub(super) fn slopes(&self, decoded: &GaussianFrame, gradients: &Planes) -> Vec<Vec<f32>> {
        let scaled = |plane: &Vec<f32>, at: usize| -> Vec<f32> {
            plane.par_iter().zip(&self.steps[at]).map(|(slope, step)| slope * step).collect()
        };
        let mut slopes = Vec::with_capacity(self.offsets.len());
        slopes.extend(gradients.position.iter().enumerate().map(|(axis, plane)| scaled(plane, POSITION + axis)));
        slopes.extend(gradients.log_scale.iter().enumerate().map(|(axis, plane)| scaled(plane, LOG_SCALE + axis)));
        slopes.push(scaled(&gradients.opacity_logit, OPACITY));
        // w follows from the other three: it is what makes the length 1.
        let [w, parts @ ..] = decoded.rotation();
        let [by_w, by_parts @ ..] = &gradients.rotation;
        for (axis, (part, by_part)) in parts.iter().zip(by_parts).enumerate() {
            let slope = |row: usize| {
                let through = if w[row] > 1e-3 { by_w[row] * part[row] / w[row] } else { 0.0 };
                (by_part[row] - through) * self.steps[ROTATION + axis][row]
            };
            slopes.push((0..w.len()).into_par_iter().map(slope).collect());
        }
        let [dc, sh] = self.transforms();
        for (transform, planes) in [(dc, gradients.dc.as_slice()), (sh, gradients.sh.as_slice())] {
            let Some(transform) = transform else { continue };
            let first = slopes.len();
            let of_component = |(component, weights): (usize, &[i16])| -> Vec<f32> {
                let mut sums = vec![0.0; decoded.len()];
                for (plane, &weight) in planes.iter().zip(weights) {
                    let weight = f32::from(weight) / UNIT;
                    sums.iter_mut().zip(plane).for_each(|(sum, slope)| *sum += weight * slope);
                }
                sums.iter_mut().zip(&self.steps[first + component]).for_each(|(sum, step)| *sum *= step);
                sums
            };
            let rows: Vec<(usize, &[i16])> = transform.rows().enumerate().collect();
            slopes.extend(rows.into_par_iter().map(of_component).collect::<Vec<_>>());
        }
        slopes
    }
}

/// Components of dc and of sh that are coded as values of their own.
pub(super) fn ranks(coder: &UnitCoder<'_>) -> [usize; 2] {
    use splatstream_decoder::layout::ShCoding;
    let sh = match coder.colour.mode {
        ShCoding::Coefficients { rank } => usize::from(rank),
        ShCoding::None | ShCoding::VectorQuantised { .. } => 0,
    };
    [usize::from(coder.colour.dc.header.rank), sh]
}
