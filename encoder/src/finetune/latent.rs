//! The values of an I frame that pictures may change, and what a decoder makes of them.
#![expect(
    clippy::arithmetic_side_effects,
    reason = "values and differences on the grid are below 2^26; counts of what is in memory"
)]
#![expect(
    clippy::indexing_slicing,
    reason = "rows are those of the frame that all planes are of; transforms have a weight for each plane"
)]

use super::receivers::Receiver;
use crate::error::Error;
use crate::frame::grain::Grain;
use crate::frame::residuals::Wanted;
use crate::frame::unit::UnitCoder;
use crate::grid::Place;
use core::ops::Range;
use rayon::prelude::*;
use splatstream_decoder::frame::QuantizedFrame;
use splatstream_decoder::increment::residual::{AttributeValues, Attributes};
use splatstream_decoder::list::{GaussianList, canonical};
use splatstream_decoder::output::{Companding, to_gaussians};
use splatstream_decoder::position::refine;
use splatstream_decoder::steps::{Stage, step};
use splatstream_format::payload::Transform;
use splatstream_gaussians::{GaussianFrame, Planes};
use splatstream_render::gradient::Gradients;

/// A basis entry of 1.
const UNIT: f32 = 4096.0;

/// A decoded w below which the slope through it is not followed: it would be beyond all measure.
const LEAST_W: f32 = 1e-3;

/// The Gaussians of a list: rows of the latent values, and how finely they are coded.
#[derive(Clone)]
pub(super) struct List {
    pub(super) rows: Range<usize>,
    pub(super) grain: Grain,
    /// What a lower layer has made of them; none: they are new.
    pub(super) parents: Option<GaussianList>,
    /// Whether an operating point that counts shows its values.
    pub(super) is_fitted: bool,
}

/// The values of a frame beside those of its source.
///
/// What is off and what a step is stand where the values of a frame do, but for colour: there they are of components of the
/// transforms. The w of a rotation follows from the rest and has none.
pub(super) struct Latent<'a> {
    pub(super) coder: &'a UnitCoder<'a>,
    pub(super) source: &'a GaussianFrame,
    pub(super) lists: Vec<List>,
    /// What a step of each value is, in the unit of the attribute, as it was with the values of the source.
    steps: Planes,
    /// Steps that each value is away from that of the source.
    pub(super) offsets: GaussianFrame,
}

/// What a decoder has.
pub(super) struct Decoded {
    /// All Gaussians as this layer has them.
    pub(super) frame: GaussianFrame,
    /// The same list by list, in integers.
    lists: Vec<QuantizedFrame>,
    /// Coded values of the planes after the position, list after list.
    pub(super) values: Vec<Vec<i32>>,
    /// Coded moves, list after list, where there are parents.
    pub(super) moves: Vec<Vec<i32>>,
}

/// A list as it is decoded.
struct Part {
    position: [Vec<u32>; 3],
    moves: Vec<Vec<i32>>,
    values: Vec<Vec<i32>>,
    attributes: Attributes,
}

impl<'a> Latent<'a> {
    /// Of a canonical frame whose Gaussians stand in the order of the lists.
    ///
    /// # Errors
    /// What the decoder's own checks refuse.
    pub(super) fn new(
        coder: &'a UnitCoder<'a>,
        source: &'a GaussianFrame,
        lists: Vec<List>,
    ) -> Result<Self, Error> {
        let zeros = || Gradients::zero(source).into_planes();
        let offsets = GaussianFrame::from_planes(source.sh_degree(), zeros())?;
        let mut latent = Self { coder, source, lists, steps: zeros(), offsets };
        latent.measure_steps()?;
        Ok(latent)
    }

    /// What a step of each value is, in the unit of the attribute.
    pub(super) fn steps(&self) -> &Planes {
        &self.steps
    }

    /// The values of the source with steps twice as long.
    ///
    /// # Errors
    /// What the decoder's own checks refuse.
    pub(super) fn an_octave_coarser(&self) -> Result<Self, Error> {
        let position_bits = self.coder.sequence.position_bits;
        let coarser =
            |list: &List| List { grain: list.grain.an_octave_coarser(position_bits), ..list.clone() };
        Self::new(self.coder, self.source, self.lists.iter().map(coarser).collect())
    }

    /// The values, as an encoder takes those of a source.
    ///
    /// # Errors
    /// None of planes that are those of a frame.
    pub(super) fn frame(&self) -> Result<GaussianFrame, Error> {
        let mut planes = self.source.clone().into_planes();
        let (offsets, steps) = (self.offsets.planes(), &self.steps);
        let shapes = planes.position.iter_mut().chain(&mut planes.log_scale);
        let shapes = shapes.chain(&mut planes.rotation).chain([&mut planes.opacity_logit]);
        let moves = offsets.position.iter().chain(offsets.log_scale).chain(offsets.rotation);
        let moves = moves.chain([offsets.opacity_logit]);
        let sizes = steps.position.iter().chain(&steps.log_scale).chain(&steps.rotation);
        let sizes = sizes.chain([&steps.opacity_logit]);
        for ((plane, offsets), steps) in shapes.zip(moves).zip(sizes) {
            let moves = offsets.par_iter().zip(steps);
            plane.par_iter_mut().zip(moves).for_each(|(value, (offset, step))| *value += offset * step);
        }
        let colours = [
            (planes.dc.as_mut_slice(), offsets.dc.as_slice(), steps.dc.as_slice()),
            (planes.sh.as_mut_slice(), offsets.sh, steps.sh.as_slice()),
        ];
        for (transform, (planes, offsets, steps)) in self.transforms().into_iter().zip(colours) {
            let Some(transform) = transform else { continue };
            planes.par_iter_mut().enumerate().for_each(|(plane, values)| {
                for (weights, (offsets, steps)) in transform.rows().zip(offsets.iter().zip(steps)) {
                    let weight = f32::from(weights[plane]) / UNIT;
                    let moves = offsets.iter().zip(steps);
                    values.iter_mut().zip(moves).for_each(|(value, (offset, step))| {
                        *value += weight * (offset * step);
                    });
                }
            });
        }
        let frame = GaussianFrame::from_planes(self.source.sh_degree(), planes)?;
        Ok(frame.with_antialiased(self.source.antialiased()))
    }

    /// What a decoder makes of the values.
    ///
    /// # Errors
    /// What the decoder's own checks refuse.
    pub(super) fn decoded(&self) -> Result<Decoded, Error> {
        let wanted = Wanted::new(&self.frame()?, None, self.coder);
        let sequence = self.coder.sequence;
        let mut planes = QuantizedFrame::zeroed(0, usize::from(sequence.sh_dimension()));
        let [mut values, mut moves] = [const { Vec::<Vec<i32>>::new() }; 2];
        let mut lists = Vec::new();
        for part in self.parts(&wanted)? {
            for (planes, own) in [(&mut values, &part.values), (&mut moves, &part.moves)] {
                planes.resize(own.len(), Vec::new());
                planes.iter_mut().zip(own).for_each(|(plane, own)| plane.extend(own));
            }
            let own = part.into_planes();
            planes.append(&own);
            lists.push(own);
        }
        Ok(Decoded { frame: to_gaussians(planes, sequence)?, lists, values, moves })
    }

    /// The lists that a receiver has.
    pub(super) fn received<'b>(
        &'b self,
        decoded: &'b Decoded,
        receiver: &Receiver,
    ) -> Vec<&'b QuantizedFrame> {
        let lists = self.lists.iter().zip(&decoded.lists).zip(&receiver.lists);
        let list = |((list, own), &is_own): ((&'b List, &'b QuantizedFrame), &bool)| match &list.parents {
            Some(parents) if !is_own => &parents.planes,
            _ => own,
        };
        lists.map(list).collect()
    }

    /// Whether a receiver has all that this layer has.
    pub(super) fn is_complete(&self, receiver: &Receiver) -> bool {
        receiver.lists.len() == self.lists.len() && receiver.lists.iter().all(|&is_own| is_own)
    }

    /// The rows of the values that a receiver sees of this layer.
    pub(super) fn seen(&self, receiver: &Receiver) -> Vec<Range<usize>> {
        let lists = self.lists.iter().zip(&receiver.lists);
        lists.filter(|(_, is_own)| **is_own).map(|(list, _)| list.rows.clone()).collect()
    }

    /// The lists as a decoder has them, for a layer above to refine.
    ///
    /// # Errors
    /// What the decoder's own checks refuse.
    pub(super) fn lists(&self) -> Result<Vec<GaussianList>, Error> {
        let parts = self.parts(&Wanted::new(&self.frame()?, None, self.coder))?;
        let list = |part: Part| {
            let rotation_fine = part.attributes.rotation_fine.clone();
            GaussianList { rotation_fine, ..GaussianList::of_planes(part.into_planes(), true) }
        };
        Ok(parts.into_iter().map(list).collect())
    }

    fn parts(&self, wanted: &Wanted) -> Result<Vec<Part>, Error> {
        self.lists.par_iter().map(|list| self.part(list, wanted)).collect()
    }

    /// A list of new Gaussians, decoded. Their order does not matter to what they become.
    fn part(&self, list: &List, wanted: &Wanted) -> Result<Part, Error> {
        let coder = self.coder;
        let rows: Vec<u32> = list.rows.clone().map(|row| row as u32).collect();
        if let Some(parents) = &list.parents {
            return refined(coder, parents, &wanted.select(&rows), list.grain);
        }
        let Grain { position_shift: shift, attribute_step } = list.grain;
        let values = wanted.direct(&rows, &coder.steps(attribute_step), coder);
        let sh_planes = usize::from(coder.sequence.sh_dimension());
        let mut attributes = Attributes::unpredicted(rows.len(), &coder.colour, sh_planes);
        attributes.add(AttributeValues(&values), &coder.coding(attribute_step), 0)?;
        let nearest = |place: &Place| refine(place.code(shift), shift);
        let places = wanted.position.each_ref().map(|plane| &plane[list.rows.clone()]);
        let position = places.map(|plane| plane.iter().map(nearest).collect());
        Ok(Part { position, moves: Vec::new(), values, attributes })
    }

    fn measure_steps(&mut self) -> Result<(), Error> {
        let sequence = self.coder.sequence;
        let parts = self.parts(&Wanted::new(self.source, None, self.coder))?;
        let companding = Companding::new(sequence);
        let last = (1_u32 << sequence.position_bits) - 1;
        for (list, part) in self.lists.iter().zip(&parts) {
            let (rows, rule) = (list.rows.clone(), self.coder.steps(list.grain.attribute_step));
            for (steps, codes) in self.steps.position.iter_mut().zip(&part.position) {
                let length = |&code: &u32| {
                    let low = code.min(last - 1);
                    let points = companding.expand(low + 1) - companding.expand(low);
                    sequence.position_step() * (points << list.grain.position_shift) as f32
                };
                steps[rows.clone()].iter_mut().zip(codes).for_each(|(step, code)| *step = length(code));
            }
            let set = |planes: &mut [Vec<f32>], stage: Stage, unit: f32| {
                let exponents = part.attributes.exponents(stage, &rule);
                for plane in planes {
                    let steps = plane[rows.clone()].iter_mut().enumerate();
                    steps.for_each(|(row, slot)| *slot = unit * step(exponents.at(row)) as f32);
                }
            };
            let Planes { log_scale, rotation, opacity_logit, dc, sh, .. } = &mut self.steps;
            set(&mut log_scale[1..], Stage::LogScale, sequence.log_scale_step());
            log_scale[0][rows.clone()].fill(sequence.log_scale_step() * step(rule.of_largest()) as f32);
            set(&mut rotation[1..], Stage::Rotation, sequence.rotation_step());
            set(core::slice::from_mut(opacity_logit), Stage::Opacity, sequence.opacity_step());
            set(dc, Stage::Dc, sequence.dc_step());
            set(sh, Stage::Sh, sequence.sh_step());
        }
        Ok(())
    }

    fn transforms(&self) -> [Option<&'a Transform>; 2] {
        [Some(self.coder.colour.dc), self.coder.colour.sh]
    }

    /// What a decoder makes of the values, as steps away from the source where those of the values stand; 0 for the w of
    /// rotations.
    pub(super) fn rounded(&self, decoded: &GaussianFrame) -> Planes {
        let mut away = decoded.clone().into_planes();
        let source = self.source.planes();
        let planes: Vec<_> = away.iter_mut().zip(source.iter()).collect();
        planes.into_par_iter().for_each(|(away, source)| {
            away.iter_mut().zip(source).for_each(|(away, source)| *away -= source);
        });
        self.to_components(&mut away);
        let planes: Vec<_> = away.iter_mut().zip(self.steps.iter()).collect();
        planes.into_par_iter().for_each(|(away, steps)| {
            let in_steps = |away: f32, step: f32| if step > 0.0 { away / step } else { 0.0 };
            away.iter_mut().zip(steps).for_each(|(away, &step)| *away = in_steps(*away, step));
        });
        away
    }

    /// Takes colours to the components of their transforms.
    fn to_components(&self, planes: &mut Planes) {
        for (transform, colours) in
            self.transforms().into_iter().zip([planes.dc.as_mut_slice(), &mut planes.sh])
        {
            let Some(transform) = transform else { continue };
            let of_component = |weights: &[i16]| -> Vec<f32> {
                let mut sums = vec![0.0; colours.first().map_or(0, Vec::len)];
                for (plane, &weight) in colours.iter().zip(weights) {
                    let weight = f32::from(weight) / UNIT;
                    sums.iter_mut().zip(plane).for_each(|(sum, value)| *sum += weight * value);
                }
                sums
            };
            let rows: Vec<&[i16]> = transform.rows().collect();
            let components: Vec<Vec<f32>> = rows.into_par_iter().map(of_component).collect();
            colours.iter_mut().for_each(|plane| plane.fill(0.0));
            colours.iter_mut().zip(components).for_each(|(plane, component)| *plane = component);
        }
    }

    /// Makes of what a loss gains with each value of the decoded frame what it gains with a step of each latent value: as if
    /// nothing were rounded.
    pub(super) fn to_steps(&self, decoded: &GaussianFrame, gradients: &mut Gradients) {
        let planes = gradients.planes_mut();
        // w makes the length 1.
        let [w, parts @ ..] = decoded.rotation();
        let [by_w, by_parts @ ..] = &mut planes.rotation;
        for (by_part, part) in by_parts.iter_mut().zip(parts) {
            for (slope, ((&by_w, &part), &w)) in by_part.iter_mut().zip(by_w.iter().zip(part).zip(w)) {
                *slope -= if w > LEAST_W { by_w * part / w } else { 0.0 };
            }
        }
        by_w.fill(0.0);
        self.to_components(planes);
        let scaled: Vec<(&mut Vec<f32>, &Vec<f32>)> = planes.iter_mut().zip(self.steps.iter()).collect();
        scaled.into_par_iter().for_each(|(slopes, steps)| {
            slopes.iter_mut().zip(steps).for_each(|(slope, step)| *slope *= step);
        });
    }
}

/// A list of a lower layer, brought near what is wanted.
fn refined(
    coder: &UnitCoder<'_>,
    parents: &GaussianList,
    wanted: &Wanted,
    grain: Grain,
) -> Result<Part, Error> {
    let Grain { position_shift: shift, attribute_step } = grain;
    let last = (1 << coder.sequence.position_bits) - 1;
    let moves = wanted.moves(parents, shift, last);
    let mut position = parents.planes.position.clone();
    for (plane, moves) in position.iter_mut().zip(&moves) {
        for (code, &steps) in plane.iter_mut().zip(moves) {
            let moved = code.checked_add_signed(steps << shift);
            *code = moved.ok_or(Error::Fault("a position is moved beyond its grid"))?;
        }
    }
    let rows: Vec<u32> = (0..parents.len() as u32).collect();
    let mut attributes = Attributes::of_list(parents, &rows);
    let values = wanted.updates(attributes.clone(), attribute_step, coder)?;
    attributes.add(AttributeValues(&values), &coder.coding(attribute_step), 0)?;
    Ok(Part { position, moves, values, attributes })
}

impl Part {
    /// The planes that are output.
    fn into_planes(self) -> QuantizedFrame {
        let Attributes { log_scale, opacity, rotation_fine, dc, sh, .. } = self.attributes;
        let rotation = rotation_fine.map(|plane| plane.into_iter().map(canonical).collect());
        QuantizedFrame { position: self.position, log_scale, opacity, rotation, dc, sh }
    }
}
