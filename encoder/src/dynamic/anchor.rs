//! Intra frames in spatial layers: each layer adds Gaussians and halves the steps of those below it.

use super::compensation::Compensator;
use super::predictors::{Chooser, used};
use super::unit::{Draft, UnitCoder};
use super::wanted::{Wanted, nearest};
use super::{CodedUnit, Reference};
use crate::error::Error;
use splatstream_decoder::digest::{UnitDigest, frame_digest, unit_digest};
use splatstream_decoder::frame::QuantizedFrame;
use splatstream_decoder::frame_state::FrameState;
use splatstream_decoder::home::Home;
use splatstream_decoder::increment::Situation;
use splatstream_decoder::increment::residual::{Attributes, Stage};
use splatstream_decoder::increment::values::SectionValues;
use splatstream_decoder::layout::{Section, ShCoding};
use splatstream_decoder::process::Compensation;
use splatstream_format::entropy::in_force::ModelsOfFrame;
use splatstream_format::syntax::prefix_length;
use std::sync::Arc;

/// Share of the Gaussians, most important first, up to each spatial layer, percent.
const fn shares(layers: u8) -> &'static [u8] {
    match layers {
        0 | 1 => &[100],
        2 => &[60, 100],
        3 => &[50, 75, 100],
        _ => &[40, 60, 80, 100],
    }
}

/// A frame on the finest lattices, in the order of its source.
pub(crate) struct AnchorTarget<'a> {
    pub(crate) number: u32,
    /// Judges what is shown of prefixes; none: they are shown as they are.
    pub(crate) compensator: Option<&'a Compensator>,
    /// Whether other frames refer to this one.
    pub(crate) predicted: bool,
    pub(crate) wanted: &'a Wanted,
    /// Most important first.
    pub(crate) order: &'a [u32],
    /// Row of each Gaussian in its file, and rows of the file.
    pub(crate) rows: &'a [u32],
    pub(crate) row_count: u32,
}

/// An intra frame being coded.
struct Anchor<'a> {
    coder: &'a UnitCoder<'a>,
    target: &'a AnchorTarget<'a>,
    homes: Vec<Home>,
    /// Gaussians of each home, by place in the target.
    members: Vec<Vec<u32>>,
    models: ModelsOfFrame,
    units: Vec<CodedUnit>,
}

/// Codes an intra frame.
///
/// # Errors
/// What the decoder's own checks refuse.
pub(crate) fn code_anchor(
    coder: &UnitCoder<'_>,
    target: &AnchorTarget<'_>,
    predictors: Chooser<'_>,
) -> Result<(Vec<CodedUnit>, Reference), Error> {
    let sequence = coder.sequence;
    let refinements = usize::from(sequence.refinement_count);
    let sh_planes = usize::from(sequence.sh_dimension());
    let mut anchor = Anchor {
        coder,
        target,
        homes: vec![Home::empty(sh_planes); refinements],
        members: vec![Vec::new(); refinements],
        models: ModelsOfFrame::default(),
        units: Vec::new(),
    };
    for layer in 0..sequence.spatial_layer_count {
        anchor.layer(layer, predictors)?;
    }
    let Anchor { homes, members, models, units, .. } = anchor;
    let rows = members.iter().map(|home| home.iter().map(|&place| target.rows[place as usize]).collect());
    let reference = Reference {
        rows: rows.collect(),
        row_count: target.row_count,
        state: FrameState {
            number: target.number,
            compensation: Compensation::default(),
            anchor: Arc::new(homes.clone()),
            carried: homes.iter().cloned().map(Some).collect(),
            homes,
            fields: Vec::new(),
            models: models.first,
        },
    };
    Ok((units, reference))
}

impl Anchor<'_> {
    /// Codes the units of a layer.
    fn layer(&mut self, layer: u8, predictors: Chooser<'_>) -> Result<(), Error> {
        let sequence = self.coder.sequence;
        let layers = sequence.spatial_layer_count;
        let shift = (layers - 1 - layer).min(sequence.position_bits - 1);
        let total = self.target.order.len() as u32;
        let end = prefix_length(shares(layers)[usize::from(layer)], total) as usize;
        let start = match layer {
            0 => 0,
            _ => prefix_length(shares(layers)[usize::from(layer) - 1], total) as usize,
        };
        let mut digests: Vec<UnitDigest> = Vec::new();
        let mut before = 0_usize;
        for refinement in 0..sequence.refinement_count {
            let after = sequence.prefix_length(refinement, total) as usize;
            let added = self.target.order.get(start.max(before)..end.min(after)).unwrap_or_default();
            before = after;
            self.unit(layer, refinement, shift, added.to_vec(), &mut digests, predictors)?;
        }
        Ok(())
    }

    fn unit(
        &mut self,
        layer: u8,
        refinement: u8,
        shift: u8,
        mut added: Vec<u32>,
        digests: &mut Vec<UnitDigest>,
        predictors: Chooser<'_>,
    ) -> Result<(), Error> {
        let home = usize::from(refinement);
        let parents = self.homes[home].clone();
        let mut draft = self.coder.blank();
        draft.header.position_shift = shift;
        draft.header.attribute_shift = self.shifts(shift);
        self.refine(&mut draft, &parents, home, shift);
        let wanted = self.coder.place_new(&mut draft, self.target.wanted, &mut added);
        let lower: Vec<&QuantizedFrame> = self.homes[..home].iter().map(|home| &home.planes).collect();
        let situation = Situation { around: [&lower, &[]], parents_follow: true };
        let mut models = self.models.before(refinement).clone();
        let applied = predictors.choose(self.coder, &mut draft, parents, &situation, &wanted, &models)?;
        let sections = self.coder.sections(&draft, &mut models)?;
        self.models.follow(refinement, models);
        digests.push(unit_digest(&applied.home.planes, 0..applied.home.len()));
        draft.header.refinement_digest = frame_digest(digests);
        draft.header.carried_digest = frame_digest(&[]);
        self.homes[home] = applied.home;
        self.compensate(&mut draft, layer, refinement);
        self.units.push(CodedUnit {
            spatial_layer: layer,
            refinement,
            payload: self.coder.payload(&draft.header, &sections)?,
            header: draft.header,
            predicted: used(&draft),
        });
        self.members[home].extend(added);
        Ok(())
    }

    /// Fills the holes of a prefix that can be shown.
    fn compensate(&self, draft: &mut Draft, layer: u8, refinement: u8) {
        let sequence = self.coder.sequence;
        let is_top = layer + 1 == sequence.spatial_layer_count;
        let is_prefix = refinement + 1 < sequence.refinement_count && !(is_top && self.target.predicted);
        let Some(compensator) = self.target.compensator.filter(|_| is_prefix) else { return };
        let homes = &self.homes[..=usize::from(refinement)];
        let (log_scale, opacity) = compensator.offsets(homes, sequence);
        (draft.header.compensation_log_scale, draft.header.compensation_opacity) = (log_scale, opacity);
    }

    /// attribute_shift of a layer. Entries of codebooks are not shifted: no layer refines them.
    fn shifts(&self, shift: u8) -> [u8; 5] {
        let book = matches!(self.coder.colour.mode, ShCoding::VectorQuantised { .. });
        [shift, shift, shift, shift, if book { 0 } else { shift }]
    }

    /// Halves the steps of what lower layers have coded.
    fn refine(&self, draft: &mut Draft, parents: &Home, home: usize, shift: u8) {
        let members = &self.members[home];
        if members.is_empty() {
            return;
        }
        let count = members.len() as u32;
        (draft.header.parent_count, draft.header.move_count, draft.header.update_count) =
            (count, count, count);
        let block = 1 << self.coder.sequence.block_log2;
        let section = |planes| SectionValues { deltas: Vec::new(), planes, block };
        draft.values.set(Section::Modes, section(vec![vec![3; members.len()]]));
        let wanted = self.target.wanted.select(members);
        let last = (1 << self.coder.sequence.position_bits) - 1;
        draft.values.set(Section::Moves, section(wanted.moves(parents, shift, last)));
        let rows: Vec<u32> = (0..count).collect();
        let now = Attributes::of_home(parents, &rows);
        let residuals = |stage| wanted.residuals(stage, &now, shift, &self.coder.colour, false);
        draft.values.set(Section::Updates, section(Stage::ALL.into_iter().flat_map(residuals).collect()));
    }
}

/// What brings log-scales near those wanted: of the largest, and of the two differences (7.16).
pub(crate) fn scale_residuals(now: [i32; 3], wanted: [i32; 3], shift: u8) -> [i32; 3] {
    let first = nearest(wanted[0] - now[0], shift);
    let largest = now[0] + (first << shift);
    let second = nearest(largest - wanted[1] - (now[0] - now[1]), shift);
    let middle = largest - (now[0] - now[1]) - (second << shift);
    let third = nearest(middle - wanted[2] - (now[1] - now[2]), shift);
    [first, second, third]
}
