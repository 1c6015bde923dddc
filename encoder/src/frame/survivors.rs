//! Predicted frames: what becomes of each Gaussian of the reference.
#![expect(
    clippy::indexing_slicing,
    reason = "rows are those of the parents and of the target; attributes and axes are constants"
)]

use super::axis_matching::{LEFT, Namings, Pose};
use super::deviation::Deviation;
use super::difference::{Apart, COLOUR, Kept, OPACITY, ROTATION, Stays, projected};
use super::target::Target;
use super::update_decision::Judge;
use crate::grid::nearest_integer;
use rayon::prelude::*;
use splatstream_decoder::colour::COMPONENT_RANGE;
use splatstream_decoder::list::{FINE, GaussianList};
use splatstream_decoder::steps::{Stage, StepRule, step};
use splatstream_format::payload::{Codebook, Transform};
use splatstream_format::syntax::SequenceParameters;

/// What is sent whatever it takes: differences of more steps than this show.
const MOST: f32 = 1.5;

/// What a bit of a move and one of an update are worth, squared steps. Updates change more Gaussians that show for fewer
/// bits.
const MOVE_BIT: f32 = 0.2;
const UPDATE_BIT: f32 = 0.04;

/// What bits are worth, squared steps of what they bring nearer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct BitPrice {
    pub(crate) moves: f32,
    pub(crate) updates: f32,
}

impl BitPrice {
    /// So many times the usual one.
    pub(crate) fn at(level: f32) -> Self {
        Self { moves: level * MOVE_BIT, updates: level * UPDATE_BIT }
    }
}

/// Bits of a zero among residuals, of one step, and what each doubling adds; and by which an update is named.
const ZERO_BITS: f32 = 0.3;
const FIRST_BITS: f32 = 3.0;
const DOUBLING_BITS: f32 = 1.6;
const NAMED_BITS: f32 = 2.0;

/// The largest move that the attribute alphabet carries is 2^16 - 1 steps.
const REACH: f32 = 65_000.0;

/// A difference rounded to steps; 0 up to the difference that is left.
fn kept(difference: f32) -> i32 {
    if difference.abs() <= LEFT { 0 } else { nearest_integer(difference) }
}

/// Where a parent shall be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Aim {
    /// Grid steps.
    pub(crate) place: [f32; 3],
    /// Whether it is worth a move at all.
    pub(crate) moves: bool,
    /// Whether it is so far from its source that it moves in any case.
    pub(crate) is_far: bool,
}

/// What becomes of a parent.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Fate {
    /// Where it shall be; none: nothing continues it, it is removed.
    pub(crate) aim: Option<Aim>,
    /// Residuals of log-scales, opacity, rotation, dc and sh; empty if it has none.
    pub(crate) updated: Vec<i32>,
}

/// The mode of a parent that is removed.
pub(crate) const REMOVED: i32 = 4;

/// The parents of a unit, and how finely it codes them.
#[derive(Clone, Copy)]
pub(crate) struct Parents<'a> {
    /// Displaced by the cells.
    pub(crate) list: &'a GaussianList,
    /// Where their opacities would go if they went on changing; empty: nowhere.
    pub(crate) opacity: &'a [i32],
    pub(crate) rule: StepRule,
    pub(crate) position_shift: u8,
    /// The same of I frames.
    pub(crate) shift_of_intra: u8,
}

impl Parents<'_> {
    /// The largest move that is left, in steps of moves: so many of I frames.
    #[expect(clippy::arithmetic_side_effects, reason = "moves have the step of I frames or a finer one")]
    fn farthest(&self) -> f32 {
        MOST * (1_u32 << (self.shift_of_intra - self.position_shift)) as f32
    }

    /// The opacity that updates start from.
    fn opacity(&self, row: usize) -> i32 {
        self.opacity.get(row).copied().unwrap_or(self.list.planes.opacity[row])
    }
}

/// What survivors are measured with.
pub(crate) struct Survivors<'a> {
    pub(crate) target: &'a Target,
    pub(crate) sequence: &'a SequenceParameters,
    pub(crate) dc: &'a Transform,
    pub(crate) sh: Option<&'a Transform>,
    pub(crate) namings: Namings,
    /// What bits are worth where no picture says so.
    pub(crate) price: BitPrice,
    /// What pictures say; none: all differences count.
    pub(crate) judge: Option<Judge>,
    /// Without a judge, what pictures say of differences that need not be sent; none: they count by their steps.
    pub(crate) weigher: Option<Judge>,
    /// By how much Gaussians of the reference differ from their source, if the target has kept what stays of that.
    pub(crate) kept: Option<&'a Deviation>,
    /// The codebook of SH residuals, if they are vector quantised: the second stage, after that of whole values.
    pub(crate) book: Option<&'a Codebook>,
}

impl Survivors<'_> {
    /// The fates of parents, of which the first is that with index `start` of the reference.
    #[expect(clippy::arithmetic_side_effects, reason = "counts of attributes; steps are 1 or more")]
    pub(crate) fn fates(&self, parents: Parents<'_>, start: usize, partner: &[Option<u32>]) -> Vec<Fate> {
        let fate = |(row, partner): (usize, &Option<u32>)| match *partner {
            Some(index) => self.fate(parents, row, (start + row, index)),
            None if self.goes_on(start + row, None) => self.unchanged(parents, row),
            None => Fate::default(),
        };
        partner.par_iter().enumerate().map(fate).collect()
    }

    /// Whether a Gaussian of the reference is in the frame.
    pub(crate) fn goes_on(&self, from: usize, partner: Option<u32>) -> bool {
        partner.is_some() || self.judge.as_ref().is_some_and(|judge| judge.may_stay(from))
    }

    /// The fate of a parent that stays although nothing continues it.
    fn unchanged(&self, parents: Parents<'_>, row: usize) -> Fate {
        let place = parents.list.position_fine.each_ref().map(|plane| plane[row] as f32 / FINE as f32);
        Fate { aim: Some(Aim { place, moves: false, is_far: false }), updated: Vec::new() }
    }

    fn fate(&self, parents: Parents<'_>, row: usize, (from, index): (usize, u32)) -> Fate {
        let index = index as usize;
        let apart = self.apart(parents, row, index);
        // However much of an error stays, a Gaussian is left no farther from its source than that.
        let stays = self.kept.map(|kept| kept.stays(from, self.sequence, self.dc)).unwrap_or_default();
        let is_far = apart.is_far(&stays, parents.farthest());
        // Not of every pose something stays.
        let is_unlike = apart.is_unlike(&stays, MOST) || apart.is_unlike(&Stays::default(), MOST);
        let weigher = self.weigher.as_ref().filter(|_| !is_far && !is_unlike);
        let judge = self.judge.as_ref().or(weigher);
        let Kept { moves, attributes, entry } = match judge {
            None => apart.all_kept(self.book),
            Some(judge) => judge.kept(self.sequence, self.book, &apart, index),
        };
        let place = self.target.position.each_ref().map(|plane| plane[index]);
        let update = self.update(parents, row, &attributes, entry);
        let is_worth_it = match judge {
            None => {
                let bits = NAMED_BITS + update.bits();
                let is_cheap = update.gain > self.price.updates * bits;
                is_cheap || is_unlike || update.most > MOST || entry.is_some_and(|entry| entry != 0)
            }
            Some(_) => update.residuals.iter().any(|&value| value != 0),
        };
        Fate {
            aim: Some(Aim { place, moves, is_far }),
            updated: if is_worth_it { update.residuals } else { Vec::new() },
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
    #[expect(clippy::arithmetic_side_effects, reason = "counts of attributes; steps are 1 or more")]
    fn apart(&self, parents: Parents<'_>, row: usize, index: usize) -> Apart {
        let (scale_step, turn_step) = (self.sequence.log_scale_step(), self.sequence.rotation_step());
        let Parents { list, rule, position_shift, .. } = parents;
        let planes = &list.planes;
        let now = planes.log_scale.each_ref().map(|plane| plane[row]);
        let turn = match self.judge {
            None => list.rotation_fine.each_ref().map(|plane| plane[row] as f32 / FINE as f32),
            Some(_) => planes.rotation.each_ref().map(|plane| plane[row] as f32),
        };
        let of = |stage| rule.of(stage, now, parents.opacity(row));
        let steps =
            [rule.of_largest(), of(Stage::Opacity), of(Stage::Rotation), of(Stage::Dc), of(Stage::Sh)]
                .map(|exponent| step(exponent) as f32);
        let (pose, reference) = self.poses(index, now, turn, &steps);
        let round = now[0] == now[1] && now[1] == now[2];
        let mut attributes = Vec::with_capacity(10 + planes.sh.len());
        attributes.extend([0, 1, 2].map(|axis: usize| {
            let exact = (pose.log_scale[axis] - self.sequence.log_scale_offset()) / scale_step;
            exact - now[axis] as f32
        }));
        let logit = self.target.frame.opacity_logit()[index];
        let opacity = (logit - self.sequence.opacity_offset()) / self.sequence.opacity_step();
        attributes.push(opacity - parents.opacity(row) as f32);
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
            attributes.extend(projected(transform, &self.sh_differences(list, row, index)));
        }
        let position = [0, 1, 2].map(|axis: usize| {
            let now = match self.judge {
                None => list.position_fine[axis][row] as f32 / FINE as f32,
                Some(_) => planes.position[axis][row] as f32,
            };
            self.target.position[axis][index] - now
        });
        let move_step = (1_u32 << position_shift) as f32;
        Apart { position, attributes, colours, steps, move_step, pose, reference, logit }
    }

    /// The update that changes attributes by these steps of the sequence, nearly.
    fn update(&self, parents: Parents<'_>, row: usize, changes: &[f32], entry: Option<i32>) -> Update {
        let rule = &parents.rule;
        let now = parents.list.planes.log_scale.each_ref().map(|plane| plane[row]);
        let of = |stage| rule.of(stage, now, parents.opacity(row));
        let of_others = rule.of_log_scale(now[0]);
        let mut update = Update::default();
        for (&change, exponent) in changes.iter().zip([rule.of_largest(), of_others, of_others]) {
            update.add(change, exponent);
        }
        let (dc, sh) = changes[COLOUR..].split_at(usize::from(self.dc.header.rank));
        let sh: &[f32] = if entry.is_some() { &[] } else { sh };
        let rest = [
            (Stage::Opacity, &changes[OPACITY..ROTATION]),
            (Stage::Rotation, &changes[ROTATION..COLOUR]),
            (Stage::Dc, dc),
            (Stage::Sh, sh),
        ];
        for (stage, changes) in rest {
            let exponent = of(stage);
            changes.iter().for_each(|&change| update.add(change, exponent));
        }
        update.residuals.extend(entry.into_iter().flat_map(|entry| [0, entry]));
        update
    }

    /// SH residuals as components, of every `stride`-th pair: rows of the transform's rank.
    pub(crate) fn sh_rows(
        &self,
        lists: &[GaussianList],
        rules: &[StepRule],
        partner: &[Option<u32>],
        stride: usize,
    ) -> Vec<f32> {
        let Some(transform) = self.sh else { return Vec::new() };
        let indices = lists.iter().zip(rules).flat_map(|pair| (0..pair.0.len()).map(move |row| (pair, row)));
        let pairs =
            indices.zip(partner).filter_map(|((list, row), index)| Some((list, row, (*index)? as usize)));
        pairs
            .step_by(stride.max(1))
            .flat_map(|((list, rule), row, index)| {
                let now = list.planes.log_scale.each_ref().map(|plane| plane[row]);
                let step = step(rule.of(Stage::Sh, now, list.planes.opacity[row])) as f32;
                let differences = self.sh_differences(list, row, index);
                projected(transform, &differences).map(|component| component / step).collect::<Vec<_>>()
            })
            .collect()
    }

    /// By how much the harmonics of a Gaussian differ from those of its partner.
    fn sh_differences(&self, list: &GaussianList, row: usize, index: usize) -> Vec<f32> {
        let plane = |(plane, values): (usize, &Vec<i32>)| {
            let wanted = self.target.frame.sh().get(plane).map_or(0.0, |values| values[index]);
            wanted / self.sequence.sh_step() - values[row] as f32 / 64.0
        };
        list.planes.sh.iter().enumerate().map(plane).collect()
    }

    /// The target written like its reference, and the reference. `coded`: the steps that attributes are coded with.
    fn poses(&self, index: usize, now: [i32; 3], turn: [f32; 3], coded: &[f32; 5]) -> (Pose, Pose) {
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
        let sizes = (scale_step * coded[0], turn_step * coded[2]);
        (self.namings.nearest(target, reference, sizes), reference)
    }
}

/// Residuals of one parent.
#[derive(Default)]
struct Update {
    residuals: Vec<i32>,
    /// How much nearer they bring the parent, squared steps.
    gain: f32,
    /// The largest difference without them, steps.
    most: f32,
}

impl Update {
    /// Adds the residual of a difference in steps of the sequence.
    #[expect(clippy::arithmetic_side_effects, reason = "counts of attributes; steps are 1 or more")]
    fn add(&mut self, change: f32, exponent: u8) {
        let step = step(exponent);
        let apart = change / step as f32;
        let most = COMPONENT_RANGE.end() / step;
        let residual = kept(apart).clamp(-most, most);
        let rest = apart - residual as f32;
        self.residuals.push(residual);
        self.gain += apart * apart - rest * rest;
        self.most = self.most.max(apart.abs());
    }

    /// Bits, nearly.
    fn bits(&self) -> f32 {
        let bits = |&value: &i32| match value.unsigned_abs() {
            0 => ZERO_BITS,
            size => FIRST_BITS + DOUBLING_BITS * libm::log2f(size as f32),
        };
        self.residuals.iter().map(bits).sum()
    }
}
