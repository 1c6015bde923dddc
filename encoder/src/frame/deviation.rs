//! By how much Gaussians differ from those of their source, carried from frame to frame.
//!
//! Pictures of frames that are each near to their source may still flicker: each frame is rounded otherwise, and what stands still moves
//! by the difference of two errors. So each Gaussian that goes on is not brought to what its source has, but to that and half of
//! what its reference differs from its own source. Of two errors that are made one after the other the pictures then show
//! the first for a while, and less of a change; what need not change takes no bits. Errors do not add up, for of
//! each a half is left in the next frame, and a quarter in the one after.
//!
//! Values of a fitted I frame differ from those of its source on purpose, so that errors make up for each other. There all of the
//! difference stays, and nothing is added to it: what stands still takes no bits and stays as good as it was, and what
//! changes takes the difference along.
#![expect(
    clippy::indexing_slicing,
    reason = "rows are those of the lists and of the matching; attributes and axes are constants"
)]
#![expect(clippy::arithmetic_side_effects, reason = "differences of floats; counts of Gaussians in memory")]

use super::axis_matching::{Namings, Pose};
use super::compensation::shown;
use super::difference::{Stays, projected};
use super::target::Target;
use super::unit::UnitCoder;
use crate::error::Error;
use crate::matching::Matching;
use rayon::prelude::*;
use splatstream_decoder::list::{FINE, GaussianList};
use splatstream_decoder::steps::{Stage, step};
use splatstream_format::payload::Transform;
use splatstream_format::syntax::SequenceParameters;
use splatstream_gaussians::{GaussianFrame, PlanesMut};

/// How much of a difference that nobody wanted stays in the next frame. An error counts as much as a change of it then.
const STAYS: f32 = 0.5;

/// Nothing stays of the pose of a Gaussian whose w is smaller than the root of so many steps: with all but x, y and z left out, a part
/// of a step in them is many in w, and beyond half a turn everything has the other sign.
const NEAR_HALF_A_TURN: f32 = 5.0;

/// Nor does anything of the pose of a Gaussian that changes by more steps from one frame to the next: what changes so much does not flicker.
const MOST_CHANGED: f32 = 4.0;

/// What each Gaussian of some lists differs by from its source, one list after the other.
pub(crate) struct Deviation {
    /// Grid steps.
    pub(crate) position: [Vec<f32>; 3],
    pub(crate) log_scale: [Vec<f32>; 3],
    /// Quaternion x, y, z.
    rotation: [Vec<f32>; 3],
    pub(crate) opacity: Vec<f32>,
    /// dc and, where values were fitted, sh.
    pub(crate) colours: Vec<Vec<f32>>,
    /// Whether values were fitted to pictures.
    pub(crate) is_fitted: bool,
}

impl Deviation {
    /// Of the lists of a frame, of which Gaussians have these rows in the file of the target; nothing of those that have none there.
    ///
    /// # Errors
    /// Lists whose planes make no frame.
    pub(crate) fn of(
        (lists, rows): (&[GaussianList], &[Vec<u32>]),
        target: &Target,
        coder: &UnitCoder<'_>,
        is_fitted: bool,
    ) -> Result<Self, Error> {
        let places = target.places(&rows.concat());
        let decoded = shown(lists, coder.sequence)?;
        let source = &target.frame;
        let apart = |now: &[f32], wanted: &[f32]| -> Vec<f32> {
            let of_row =
                |(now, place): (&f32, &Option<u32>)| place.map_or(0.0, |at| now - wanted[at as usize]);
            now.par_iter().zip(&places).map(of_row).collect()
        };
        let position = [0, 1, 2].map(|axis: usize| {
            let fine = lists.iter().flat_map(|list| &list.position_fine[axis]);
            let now: Vec<f32> = fine.map(|&fine| fine as f32 / FINE as f32).collect();
            apart(&now, &target.position[axis])
        });
        let poses = poses(lists, (&decoded, source), &places, (coder, is_fitted));
        let of_poses =
            |part: &(dyn Fn(&Pose) -> f32 + Sync)| poses.par_iter().map(part).collect::<Vec<f32>>();
        let harmonics = if is_fitted { source.sh().len() } else { 0 };
        let colours = decoded.dc().iter().zip(source.dc());
        let colours = colours.chain(decoded.sh().iter().zip(source.sh()).take(harmonics));
        Ok(Self {
            position,
            log_scale: [0, 1, 2].map(|axis: usize| of_poses(&|pose| pose.log_scale[axis])),
            rotation: [1, 2, 3].map(|part: usize| of_poses(&|pose| pose.rotation[part])),
            opacity: apart(decoded.opacity_logit(), source.opacity_logit()),
            colours: colours.map(|(now, wanted)| apart(now, wanted)).collect(),
            is_fitted,
        })
    }

    /// Of what follows: of Gaussians that go on, and of new ones, which are not fitted.
    pub(crate) fn followed(&self, parents: &[Option<u32>]) -> Self {
        let of = |plane: &Vec<f32>| -> Vec<f32> {
            parents.iter().map(|parent| parent.map_or(0.0, |parent| plane[parent as usize])).collect()
        };
        Self {
            position: self.position.each_ref().map(of),
            log_scale: self.log_scale.each_ref().map(of),
            rotation: self.rotation.each_ref().map(of),
            opacity: of(&self.opacity),
            colours: self.colours.iter().map(of).collect(),
            is_fitted: self.is_fitted,
        }
    }

    /// What a frame shall become where its Gaussians continue those of a reference, of which these are the lists: what its source has, and of
    /// what each differed by as much as stays. It is written as the reference is.
    pub(crate) fn added_to(
        &self,
        target: &Target,
        (lists, matching): (&[GaussianList], &Matching),
        coder: &UnitCoder<'_>,
    ) -> Target {
        let mut sum = target.clone();
        let stays = if self.is_fitted { 1.0 } else { STAYS };
        let namings = Namings::new();
        let rows = lists.iter().zip(0_u8..);
        let rows = rows.flat_map(|(list, number)| (0..list.len()).map(move |row| (list, number, row)));
        let PlanesMut { mut log_scale, mut rotation, opacity_logit, dc, sh, .. } = sum.frame.planes_mut();
        let mut colours: Vec<&mut [f32]> = dc.into_iter().chain(sh).collect();
        for ((list, number, row), (from, partner)) in rows.zip(matching.target_of.iter().enumerate()) {
            let Some(index) = partner.map(|index| index as usize) else { continue };
            let of_source = self.source_of(from, (list, row), coder);
            let pose = Pose {
                log_scale: log_scale.each_ref().map(|plane| plane[index]),
                rotation: rotation.each_ref().map(|plane| plane[index]),
            };
            let sizes = sizes((list, row), number, coder);
            let pose = namings.nearest(pose, of_source, sizes);
            let holds = is_clear_of_half_a_turn(&pose, sizes) && is_near(&pose, &of_source, sizes);
            let of_pose = if self.is_fitted || holds { stays } else { 0.0 };
            let scales = log_scale.iter_mut().zip(pose.log_scale).zip(&self.log_scale);
            scales.for_each(|((plane, value), own)| plane[index] = value + of_pose * own[from]);
            let places = sum.position.iter_mut().zip(&self.position);
            places.for_each(|(plane, own)| plane[index] += stays * own[from]);
            let turned =
                [0, 1, 2].map(|part: usize| pose.rotation[part + 1] + of_pose * self.rotation[part][from]);
            rotation.iter_mut().zip(unit(turned)).for_each(|(plane, part)| plane[index] = part);
            opacity_logit[index] += stays * self.opacity[from];
            for (plane, own) in colours.iter_mut().zip(&self.colours) {
                plane[index] += stays * own[from];
            }
        }
        sum
    }

    /// What stays of that of a Gaussian of the reference in what [follows](Self::added_to), with dc as components of a transform.
    pub(crate) fn stays(&self, from: usize, sequence: &SequenceParameters, dc: &Transform) -> Stays {
        let of =
            |planes: &[Vec<f32>; 3], step: f32| planes.each_ref().map(|plane| STAYS * plane[from] / step);
        let colour = [0, 1, 2].map(|plane: usize| STAYS * self.colours[plane][from] / sequence.dc_step());
        let mut attributes = Vec::with_capacity(10);
        attributes.extend(of(&self.log_scale, sequence.log_scale_step()));
        attributes.push(STAYS * self.opacity[from] / sequence.opacity_step());
        attributes.extend(of(&self.rotation, sequence.rotation_step()));
        attributes.extend(projected(dc, &colour));
        Stays { position: of(&self.position, 1.0), attributes }
    }

    /// The pose that a Gaussian would have if it were that of its source.
    fn source_of(&self, from: usize, (list, row): (&GaussianList, usize), coder: &UnitCoder<'_>) -> Pose {
        let sequence = coder.sequence;
        let log_scale = [0, 1, 2].map(|axis: usize| {
            let now = list.planes.log_scale[axis][row] as f32;
            sequence.log_scale_offset() + sequence.log_scale_step() * now - self.log_scale[axis][from]
        });
        let part = |axis: usize| {
            let now = list.planes.rotation[axis][row] as f32;
            sequence.rotation_step() * now - self.rotation[axis][from]
        };
        Pose { log_scale, rotation: unit([0, 1, 2].map(part)) }
    }
}

/// By how much the poses of decoded Gaussians differ from those of their source, written as they are: each has its row in the source,
/// or nothing to differ from. What is round has no rotation, whatever that of its source is.
fn poses(
    lists: &[GaussianList],
    (decoded, source): (&GaussianFrame, &GaussianFrame),
    places: &[Option<u32>],
    (coder, is_fitted): (&UnitCoder<'_>, bool),
) -> Vec<Pose> {
    let namings = Namings::new();
    let of_frame = |frame: &GaussianFrame, row: usize| Pose {
        log_scale: frame.log_scale().each_ref().map(|plane| plane[row]),
        rotation: frame.rotation().each_ref().map(|plane| plane[row]),
    };
    let rows: Vec<(&GaussianList, u8, usize)> = lists
        .iter()
        .zip(0..)
        .flat_map(|(list, number)| (0..list.len()).map(move |row| (list, number, row)))
        .collect();
    let apart =
        |((row, place), &(list, number, of_list)): ((usize, &Option<u32>), &(&GaussianList, u8, usize))| {
            let none = Pose { log_scale: [0.0; 3], rotation: [0.0; 4] };
            let Some(place) = place else { return none };
            let now = of_frame(decoded, row);
            let wanted = of_frame(source, *place as usize);
            let sizes = sizes((list, of_list), number, coder);
            let wanted = namings.nearest(wanted, now, sizes);
            let [a, b, c] = now.log_scale;
            let turns = is_fitted || is_clear_of_half_a_turn(&now, sizes);
            let turns = turns && !(a == b && b == c);
            Pose {
                log_scale: [0, 1, 2].map(|axis: usize| now.log_scale[axis] - wanted.log_scale[axis]),
                rotation: [0, 1, 2, 3].map(|part: usize| match turns {
                    true => now.rotation[part] - wanted.rotation[part],
                    false => 0.0,
                }),
            }
        };
    places.par_iter().enumerate().zip(&rows).map(apart).collect()
}

/// Whether w is so large that small errors of x, y and z are small ones of w. `sizes`: the steps of log-scales and rotations.
fn is_clear_of_half_a_turn(pose: &Pose, (_, step): (f32, f32)) -> bool {
    pose.rotation[0] * pose.rotation[0] >= NEAR_HALF_A_TURN * step
}

/// Whether two poses are nearly the same, written alike. `sizes`: the steps of log-scales and rotations.
fn is_near(a: &Pose, b: &Pose, sizes: (f32, f32)) -> bool {
    let scales = (0..3).all(|axis| (a.log_scale[axis] - b.log_scale[axis]).abs() <= MOST_CHANGED * sizes.0);
    let turns = (1..4).all(|part| (a.rotation[part] - b.rotation[part]).abs() <= MOST_CHANGED * sizes.1);
    scales && turns
}

/// The steps of log-scales and rotations that a Gaussian of a list is coded with.
fn sizes((list, row): (&GaussianList, usize), number: u8, coder: &UnitCoder<'_>) -> (f32, f32) {
    let rule = coder.steps(coder.grains.of(number).of_changes().attribute_step);
    let now = list.planes.log_scale.each_ref().map(|plane| plane[row]);
    let of_turns = step(rule.of(Stage::Rotation, now, list.planes.opacity[row])) as f32;
    let of_scales = step(rule.of_largest()) as f32;
    (coder.sequence.log_scale_step() * of_scales, coder.sequence.rotation_step() * of_turns)
}

/// The rotation of length 1 that has these parts after w, which is not negative; parts that are too long are made shorter.
fn unit([x, y, z]: [f32; 3]) -> [f32; 4] {
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
        let none = Deviation {
            position: Default::default(),
            log_scale: Default::default(),
            rotation: Default::default(),
            opacity: Vec::new(),
            colours: vec![Vec::new(); 3],
            is_fitted: true,
        };
        let followed = none.followed(&[None, None]);
        assert_eq!(followed.position, [const { [0.0; 2] }; 3].map(Vec::from));
        assert!(followed.colours.iter().all(|plane| plane == &[0.0; 2]));
    }
}
