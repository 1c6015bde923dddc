//! By how much values that were fitted to pictures differ from those of their source, carried from frame to frame.
//!
//! Values of a fitted I frame differ from those of its source so that errors make up for each other. A frame that is predicted
//! from it would pay for every difference if it went back to its own source. So each Gaussian that goes on is brought to what its
//! source has, plus what it differed by when it was fitted: what stands still takes no bits and stays as good as it was, and
//! what changes takes the difference along. Nothing adds up from frame to frame, for the difference is that of the I frame.
#![expect(
    clippy::indexing_slicing,
    reason = "rows are those of the lists and of the matching; attributes and axes are constants"
)]
#![expect(clippy::arithmetic_side_effects, reason = "differences of floats; counts of Gaussians in memory")]

use super::axis_matching::{Namings, Pose};
use super::compensation::shown;
use super::target::Target;
use super::unit::UnitCoder;
use crate::error::Error;
use crate::matching::Matching;
use splatstream_decoder::list::GaussianList;
use splatstream_decoder::steps::{Stage, step};
use splatstream_format::syntax::SequenceParameters;
use splatstream_gaussians::{GaussianFrame, PlanesMut};

/// What each Gaussian of some lists differs by from its source, one list after the other.
pub(crate) struct Deviation {
    /// Grid steps.
    pub(crate) position: [Vec<f32>; 3],
    /// The other planes, of which w stays 0.
    pub(crate) values: GaussianFrame,
}

impl Deviation {
    /// Of the lists of an I frame. `members`: the place of each Gaussian in the target, list by list.
    ///
    /// # Errors
    /// Lists whose planes make no frame.
    pub(crate) fn of_intra(
        (lists, members): (&[GaussianList], &[Vec<u32>]),
        target: &Target,
        sequence: &SequenceParameters,
    ) -> Result<Self, Error> {
        let indices = members.concat();
        let source = target.frame.select(&indices);
        let mut values = shown(lists, sequence)?;
        let is_round: Vec<bool> = {
            let [a, b, c] = values.log_scale();
            (0..values.len()).map(|row| a[row] == b[row] && b[row] == c[row]).collect()
        };
        let planes = values.planes_mut();
        let [w, turns @ ..] = planes.rotation;
        w.fill(0.0);
        let own =
            planes.log_scale.into_iter().chain([planes.opacity_logit]).chain(planes.dc).chain(planes.sh);
        let of_source = source.log_scale().iter().map(Vec::as_slice).chain([source.opacity_logit()]);
        let colours = source.dc().iter().chain(source.sh()).map(Vec::as_slice);
        own.zip(of_source.chain(colours)).for_each(|(own, source)| subtract(own, source));
        for (own, source) in turns.into_iter().zip(source.rotation().iter().skip(1)) {
            subtract(own, source);
            // What is round has no rotation, whatever that of its source is.
            own.iter_mut().zip(&is_round).filter(|(_, is_round)| **is_round).for_each(|(own, _)| *own = 0.0);
        }
        let position = [0, 1, 2].map(|axis: usize| {
            let codes = lists.iter().flat_map(|list| &list.planes.position[axis]);
            let pairs = codes.zip(&indices);
            pairs.map(|(&code, &index)| code as f32 - target.position[axis][index as usize]).collect()
        });
        Ok(Self { position, values })
    }

    /// Of what follows: of Gaussians that go on, and of new ones, which are not fitted.
    ///
    /// # Errors
    /// Planes that make no frame.
    pub(crate) fn followed(&self, parents: &[Option<u32>]) -> Result<Self, Error> {
        let of = |plane: &[f32]| -> Vec<f32> {
            parents.iter().map(|parent| parent.map_or(0.0, |parent| plane[parent as usize])).collect()
        };
        let mut planes = self.values.clone().into_planes();
        planes.iter_mut().for_each(|plane| *plane = of(plane));
        let values = GaussianFrame::from_planes(self.values.sh_degree(), planes)?;
        Ok(Self { position: self.position.each_ref().map(|plane| of(plane)), values })
    }

    /// What a frame shall become where its Gaussians continue those of a reference, of which these are the lists: what its source has, and what each differed
    /// by. It is written as the reference is.
    pub(crate) fn added_to(
        &self,
        target: &Target,
        (lists, matching): (&[GaussianList], &Matching),
        coder: &UnitCoder<'_>,
    ) -> Target {
        let mut sum = target.clone();
        let namings = Namings::new();
        let rows = lists.iter().zip(0_u8..);
        let rows = rows.flat_map(|(list, number)| (0..list.len()).map(move |row| (list, number, row)));
        let values = &self.values;
        let PlanesMut { mut log_scale, mut rotation, opacity_logit, dc, sh, .. } = sum.frame.planes_mut();
        let mut colours: Vec<&mut [f32]> = dc.into_iter().chain(sh).collect();
        let own_colours: Vec<&[f32]> = values.dc().iter().chain(values.sh()).map(Vec::as_slice).collect();
        for ((list, number, row), (from, partner)) in rows.zip(matching.target_of.iter().enumerate()) {
            let Some(index) = partner.map(|index| index as usize) else { continue };
            let of_source = self.source_of(from, (list, row), coder);
            let pose = Pose {
                log_scale: log_scale.each_ref().map(|plane| plane[index]),
                rotation: rotation.each_ref().map(|plane| plane[index]),
            };
            let pose = namings.nearest(pose, of_source, sizes((list, row), number, coder));
            let scales = log_scale.iter_mut().zip(pose.log_scale).zip(values.log_scale());
            scales.for_each(|((plane, value), own)| plane[index] = value + own[from]);
            let places = sum.position.iter_mut().zip(&self.position);
            places.for_each(|(plane, own)| plane[index] += own[from]);
            let turned = [0, 1, 2, 3].map(|part: usize| pose.rotation[part] + values.rotation()[part][from]);
            rotation.iter_mut().zip(unit(turned)).for_each(|(plane, part)| plane[index] = part);
            opacity_logit[index] += values.opacity_logit()[from];
            for (plane, own) in colours.iter_mut().zip(&own_colours) {
                plane[index] += own[from];
            }
        }
        sum
    }

    /// The pose that a Gaussian would have if it were that of its source.
    fn source_of(&self, from: usize, (list, row): (&GaussianList, usize), coder: &UnitCoder<'_>) -> Pose {
        let sequence = coder.sequence;
        let log_scale = [0, 1, 2].map(|axis: usize| {
            let now = list.planes.log_scale[axis][row] as f32;
            sequence.log_scale_offset() + sequence.log_scale_step() * now
                - self.values.log_scale()[axis][from]
        });
        let part = |axis: usize| {
            let now = list.planes.rotation[axis][row] as f32;
            sequence.rotation_step() * now - self.values.rotation()[axis + 1][from]
        };
        Pose { log_scale, rotation: unit([0.0, part(0), part(1), part(2)]) }
    }
}

/// The steps of log-scales and rotations that a Gaussian of a list is coded with.
fn sizes((list, row): (&GaussianList, usize), number: u8, coder: &UnitCoder<'_>) -> (f32, f32) {
    let rule = coder.steps(coder.grains.of(number).attribute_step);
    let now = list.planes.log_scale.each_ref().map(|plane| plane[row]);
    let of_turns = step(rule.of(Stage::Rotation, now, list.planes.opacity[row])) as f32;
    let of_scales = step(rule.of_largest()) as f32;
    (coder.sequence.log_scale_step() * of_scales, coder.sequence.rotation_step() * of_turns)
}

fn subtract(values: &mut [f32], others: &[f32]) {
    values.iter_mut().zip(others).for_each(|(value, other)| *value -= other);
}

/// The rotation of length 1 that has these parts after w, which is not negative; parts that are too long are made shorter.
fn unit([_, x, y, z]: [f32; 4]) -> [f32; 4] {
    let square = x * x + y * y + z * z;
    match square < 1.0 {
        true => [(1.0 - square).sqrt(), x, y, z],
        false => {
            let length = square.sqrt();
            [0.0, x / length, y / length, z / length]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn new_gaussians_differ_by_nothing_where_there_were_none_before() {
        let none = Deviation { position: Default::default(), values: GaussianFrame::default() };
        let followed = none.followed(&[None, None]).unwrap();
        assert_eq!(followed.position, [const { [0.0; 2] }; 3].map(Vec::from));
        assert!(followed.values.planes().dc.iter().all(|plane| plane == &[0.0; 2]));
    }
}
