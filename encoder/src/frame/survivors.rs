//! Predicted frames: what becomes of each Gaussian of the reference.

use super::Target;
use super::align::{Namings, Pose};
use super::judge::Judge;
use crate::settings::Steps;
use crate::vq;
use rayon::prelude::*;
use splatstream_decoder::colour::COMPONENT_RANGE;
use splatstream_decoder::list::{FINE, GaussianList};
use splatstream_format::payload::{Codebook, Transform};
use splatstream_format::syntax::SequenceParameters;

/// Largest difference, in steps, that is left as it is. A Gaussian that moves smoothly keeps the error of its intra
/// frame, up to half a step; sending each change as soon as it rounds to a step costs three times the bits.
pub(crate) const LEFT: f32 = 0.75;

/// The largest move that the attribute alphabet carries is 2^16 - 1 steps.
const REACH: f32 = 65_000.0;

/// A difference rounded to steps; 0 up to the difference that is left.
fn kept(difference: f32, left: f32) -> i32 {
    if difference.abs() <= left { 0 } else { crate::grid::nearest_integer(difference) }
}

/// What becomes of a parent.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Fate {
    /// The value of its mode.
    pub(crate) mode: i32,
    /// Position residual, if the mode has one.
    pub(crate) moved: [i32; 3],
    /// Residuals of log-scales, opacity, rotation, dc and sh, if the mode has them.
    pub(crate) updated: Vec<i32>,
}

/// Removed: nothing continues it.
const REMOVED: i32 = 4;

/// Attributes before dc: log-scales, opacity, rotation.
const COLOUR: usize = 7;

/// How far a Gaussian is from its partner, in steps.
pub(crate) struct Apart {
    pub(crate) position: [f32; 3],
    /// Log-scales, opacity, rotation, components of dc and of sh.
    pub(crate) attributes: Vec<f32>,
    /// Where the components of sh begin.
    colours: usize,
    /// The partner, written like the Gaussian, and the Gaussian.
    pub(crate) pose: Pose,
    pub(crate) reference: Pose,
    /// The opacity of the partner.
    pub(crate) logit: f32,
}

impl Apart {
    /// Components of sh.
    pub(crate) fn sh(&self) -> &[f32] {
        &self.attributes[self.colours..]
    }
}

/// What is sent of the differences, in steps.
pub(crate) struct Kept {
    pub(crate) moved: [i32; 3],
    pub(crate) attributes: Vec<i32>,
    /// The entry of the codebook of SH residuals, if there is one.
    pub(crate) entry: Option<i32>,
}

/// What survivors are measured with.
pub(crate) struct Survivors<'a> {
    pub(crate) target: &'a Target,
    pub(crate) sequence: &'a SequenceParameters,
    pub(crate) steps: &'a Steps,
    pub(crate) dc: &'a Transform,
    pub(crate) sh: Option<&'a Transform>,
    pub(crate) namings: Namings,
    /// What pictures say; none: all differences count.
    pub(crate) judge: Option<Judge>,
    /// The codebook of SH residuals, if they are vector quantised: the second stage, after that of whole values.
    pub(crate) book: Option<&'a Codebook>,
}

impl Survivors<'_> {
    /// The fates of the Gaussians of a list, already displaced. `start`: index of the first in the reference. `coarse`:
    /// pictures hardly show them, their steps are twice as large.
    pub(crate) fn fates(
        &self,
        list: &GaussianList,
        start: usize,
        partner: &[Option<u32>],
        coarse: bool,
    ) -> Vec<Fate> {
        let fate = |(row, partner): (usize, &Option<u32>)| match *partner {
            Some(index) => self.fate(list, row, index, coarse),
            None if self.goes_on(start + row, None) => Fate::default(),
            None => Fate { mode: REMOVED, ..Fate::default() },
        };
        partner.par_iter().enumerate().map(fate).collect()
    }

    /// Whether a Gaussian of the reference is in the frame.
    pub(crate) fn goes_on(&self, from: usize, partner: Option<u32>) -> bool {
        partner.is_some() || self.judge.as_ref().is_some_and(|judge| judge.may_stay(from))
    }

    fn fate(&self, list: &GaussianList, row: usize, index: u32, coarse: bool) -> Fate {
        let index = index as usize;
        let last = ((1 << self.sequence.position_bits) - 1) * FINE;
        let apart = self.apart(list, row, index);
        let Kept { moved, attributes, entry } = match &self.judge {
            None => self.all_kept(&apart, [LEFT, if coarse { 2.0 * LEFT } else { LEFT }]),
            Some(judge) => judge.kept(self, &apart, index),
        };
        let moved = [0, 1, 2].map(|axis: usize| {
            let now = list.position_fine[axis][row];
            // A fraction of a step is left between the outermost point and the end of the grid.
            moved[axis].clamp(-(now / FINE), (last - now) / FINE)
        });
        let updated = self.residuals(list, row, &attributes, entry);
        let mode = i32::from(moved != [0; 3]) + 2 * i32::from(updated.iter().any(|&value| value != 0));
        Fate { mode, moved, updated }
    }

    /// All differences but those up to so many steps: of position, of attributes.
    pub(crate) fn all_kept(&self, apart: &Apart, left: [f32; 2]) -> Kept {
        Kept {
            moved: apart.position.map(|steps| kept(steps, left[0])),
            attributes: apart.attributes.iter().map(|&steps| kept(steps, left[1])).collect(),
            entry: self.book.map(|book| vq::nearest_entry(book, apart.sh())),
        }
    }

    /// Whether a Gaussian is so far from its partner that no residual brings it there.
    pub(crate) fn is_out_of_reach(&self, list: &GaussianList, row: usize, index: u32) -> bool {
        (0..3).any(|axis| {
            let now = list.position_fine[axis][row] as f32 / FINE as f32;
            (self.target.position[axis][index as usize] - now).abs() > REACH
        })
    }

    /// How far a Gaussian is from its partner. Pictures show what fractions are rounded to; who goes by attributes
    /// lets a fraction be, which motion has brought.
    fn apart(&self, list: &GaussianList, row: usize, index: usize) -> Apart {
        let (scale_step, turn_step) = (self.sequence.log_scale_step(), self.sequence.rotation_step());
        let planes = &list.planes;
        let now = planes.log_scale.each_ref().map(|plane| plane[row]);
        let turn = match self.judge {
            None => list.rotation_fine.each_ref().map(|plane| plane[row] as f32 / FINE as f32),
            Some(_) => planes.rotation.each_ref().map(|plane| plane[row] as f32),
        };
        let (pose, reference) = self.poses(index, now, turn);
        let round = now[0] == now[1] && now[1] == now[2];
        let mut attributes = Vec::with_capacity(10 + planes.sh.len());
        attributes.extend([0, 1, 2].map(|axis: usize| {
            let exact = (pose.log_scale[axis] - self.sequence.log_scale_offset()) / scale_step;
            exact - now[axis] as f32
        }));
        let logit = self.target.frame.opacity_logit()[index];
        let opacity = (logit - self.sequence.opacity_offset()) / self.sequence.opacity_step();
        attributes.push(opacity - planes.opacity[row] as f32);
        attributes.extend(
            [0, 1, 2].map(
                |axis: usize| {
                    if round { 0.0 } else { pose.rotation[axis + 1] / turn_step - turn[axis] }
                },
            ),
        );
        let dc = |plane: usize| {
            self.target.frame.dc()[plane][index] / self.sequence.dc_step()
                - planes.dc[plane][row] as f32 / 64.0
        };
        attributes.extend(projected(self.dc, &[dc(0), dc(1), dc(2)]));
        let colours = attributes.len();
        if let Some(transform) = self.sh {
            let sh = |plane: usize| {
                let wanted = self.target.frame.sh().get(plane).map_or(0.0, |values| values[index]);
                wanted / self.sequence.sh_step() - planes.sh[plane][row] as f32 / 64.0
            };
            let differences: Vec<f32> = (0..planes.sh.len()).map(sh).collect();
            attributes.extend(projected(transform, &differences));
        }
        let position = [0, 1, 2].map(|axis: usize| {
            let now = match self.judge {
                None => list.position_fine[axis][row] as f32 / FINE as f32,
                Some(_) => planes.position[axis][row] as f32,
            };
            self.target.position[axis][index] - now
        });
        Apart { position, attributes, colours, pose, reference, logit }
    }

    /// The residuals that change attributes by these steps.
    fn residuals(&self, list: &GaussianList, row: usize, steps: &[i32], entry: Option<i32>) -> Vec<i32> {
        let now = list.planes.log_scale.each_ref().map(|plane| plane[row]);
        let wanted = [0, 1, 2].map(|axis: usize| now[axis] + steps[axis]);
        let mut residuals = super::intra::scale_residuals(now, wanted, 0).to_vec();
        residuals.extend(&steps[3..COLOUR]);
        let colours = COLOUR + usize::from(self.dc.header.rank);
        let coded = if entry.is_some() { &steps[COLOUR..colours] } else { &steps[COLOUR..] };
        residuals.extend(coded.iter().map(|part| part.clamp(COMPONENT_RANGE.start(), COMPONENT_RANGE.end())));
        residuals.extend(entry.into_iter().flat_map(|entry| [0, entry]));
        residuals
    }

    /// SH residuals as components, of every `stride`-th pair: rows of the transform's rank.
    pub(crate) fn sh_rows(&self, lists: &[GaussianList], partner: &[Option<u32>], stride: usize) -> Vec<f32> {
        let Some(transform) = self.sh else { return Vec::new() };
        let indices = lists.iter().flat_map(|list| (0..list.len()).map(move |row| (list, row)));
        let pairs =
            indices.zip(partner).filter_map(|((list, row), index)| Some((list, row, (*index)? as usize)));
        let differences = |(list, row, index): (&GaussianList, usize, usize)| -> Vec<f32> {
            let plane = |(plane, values): (usize, &Vec<i32>)| {
                let wanted = self.target.frame.sh().get(plane).map_or(0.0, |values| values[index]);
                wanted / self.sequence.sh_step() - values[row] as f32 / 64.0
            };
            list.planes.sh.iter().enumerate().map(plane).collect()
        };
        pairs
            .step_by(stride.max(1))
            .flat_map(|pair| projected(transform, &differences(pair)).collect::<Vec<_>>())
            .collect()
    }

    /// The target written like its reference, and the reference.
    fn poses(&self, index: usize, now: [i32; 3], turn: [f32; 3]) -> (Pose, Pose) {
        let frame = &self.target.frame;
        let target = Pose {
            log_scale: frame.log_scale().each_ref().map(|plane| plane[index]),
            rotation: frame.rotation().each_ref().map(|plane| plane[index]),
        };
        let (scale_step, turn_step) = (self.sequence.log_scale_step(), self.sequence.rotation_step());
        let [x, y, z] = turn.map(|part| part * turn_step);
        let w = (1.0 - (x * x + y * y + z * z)).max(0.0).sqrt();
        let log_scale = now.map(|q| self.sequence.log_scale_offset() + scale_step * q as f32);
        let reference = Pose { log_scale, rotation: [w, x, y, z] };
        (self.namings.nearest(target, reference, (self.steps.log_scale, self.steps.rotation)), reference)
    }
}

/// Differences in steps as components of a transform.
fn projected<'t>(transform: &'t Transform, differences: &'t [f32]) -> impl Iterator<Item = f32> + 't {
    const UNIT: f32 = 4096.0;
    transform.rows().map(move |row| {
        row.iter().zip(differences).map(|(&weight, difference)| f32::from(weight) / UNIT * difference).sum()
    })
}
