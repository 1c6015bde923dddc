//! Clauses 7.4 to 7.8 unit by unit, by the functions of the decoder, with all that stands between.

use super::scene::FramePlan;
use splatstream_decoder::colour::Colour;
use splatstream_decoder::digest::{ListDigest, lists_digest};
use splatstream_decoder::displacement::CellField;
use splatstream_decoder::frame::QuantizedFrame;
use splatstream_decoder::increment::residual::AttributeCoding;
use splatstream_decoder::increment::values::UnitValues;
use splatstream_decoder::increment::{Situation, Temporal, Unit, apply, field, reference_set};
use splatstream_decoder::interrupt::Interrupt;
use splatstream_decoder::layout::ShCoding;
use splatstream_decoder::list::GaussianList;
use splatstream_decoder::moves::SpanRatio;
use splatstream_decoder::steps::StepRule;
use splatstream_format::entropy::in_force::ModelsOfFrame;
use splatstream_format::payload::Transform;
use splatstream_format::syntax::{GopHeader, IncrementHeader, SequenceParameters, UnitId};

/// What the units of a stream have in common.
pub(crate) struct Common {
    pub(crate) sequence: SequenceParameters,
    pub(crate) gop: GopHeader,
    pub(crate) transform: Transform,
}

/// A unit and what it does.
pub(crate) struct Step {
    pub(crate) id: UnitId,
    pub(crate) header: IncrementHeader,
    pub(crate) values: UnitValues,
    /// The parents as the reference or the layer below has them, and displaced.
    pub(crate) parents: GaussianList,
    pub(crate) displaced: GaussianList,
    pub(crate) set: QuantizedFrame,
    pub(crate) list: GaussianList,
    /// The new Gaussians of the list.
    pub(crate) added: QuantizedFrame,
}

/// A frame as far as it goes.
pub(crate) struct Walked {
    pub(crate) index: u32,
    pub(crate) reference: Option<u32>,
    pub(crate) plan: FramePlan,
    pub(crate) field: CellField,
    pub(crate) steps: Vec<Step>,
    pub(crate) models: ModelsOfFrame,
}

impl Common {
    pub(crate) fn coding(&self, header: &IncrementHeader) -> AttributeCoding<'_> {
        AttributeCoding {
            steps: StepRule::new(&self.sequence, header.attribute_step),
            canonical_axes: self.sequence.canonical_axes(),
            colour: Colour { dc: &self.transform, sh: None, mode: ShCoding::None, codebooks: [None; 4] },
            interrupt: Interrupt::NEVER,
        }
    }

    /// Begins a frame.
    pub(crate) fn start(&self, frames: &[Walked], index: u32, plan: FramePlan) -> Walked {
        let reference = self.gop.role(index).reference;
        let first = reference.map(|at| frames[at as usize].models.first.clone()).unwrap_or_default();
        Walked {
            index,
            reference,
            field: field(&plan.cells, plan.cell_log2, &self.sequence, 0).unwrap(),
            plan,
            steps: Vec::new(),
            models: ModelsOfFrame::starting_with(first),
        }
    }

    /// Applies a unit to the frame in progress, after the frames before it; the unit gets its digest.
    pub(crate) fn step(
        &self,
        frames: &[Walked],
        frame: &mut Walked,
        id: UnitId,
        mut header: IncrementHeader,
        values: UnitValues,
    ) {
        let intra = frame.reference.is_none();
        let unit = Unit {
            header: &header,
            values: &values,
            coding: self.coding(&header),
            sequence: &self.sequence,
            network: None,
            max_learned: 0,
            at: 0,
        };
        let parents = parents(frames, frame, &id);
        let mut displaced = parents.unchanged();
        displaced.displace(&frame.field);
        let [before, after] = around(frame, &id);
        let ratio = SpanRatio::default();
        let temporal = (!intra).then_some(Temporal { reference: &parents, ratio, moves: None });
        let situation = Situation { around: [&before, &after], temporal };
        let applied = apply(&unit, displaced.clone(), &situation).unwrap();
        let mut left = applied.list.planes.clone();
        left.truncate(left.len() - applied.added.len());
        let set = reference_set(&situation, if intra { &left } else { &displaced.planes });
        let (list, added) = (applied.list, applied.added);
        let lists = frame.layer(id.spatial_layer).map(|step| &step.list).chain([&list]);
        header.refinement_digest =
            lists_digest(&lists.map(GaussianList::digest).collect::<Vec<ListDigest>>());
        frame.steps.push(Step { id, header, values, parents, displaced, set, list, added });
    }

    /// Clause 7.8.1: the lists of the I frame at a layer, moved into a frame that refers to it; without what lies in a
    /// stale cell where units of the frame replace it.
    pub(crate) fn carried(
        &self,
        frames: &[Walked],
        frame: u32,
        layer: u8,
        drops_stale: bool,
    ) -> Vec<GaussianList> {
        let lists = frames[0].layer(layer).map(|step| step.list.clone());
        lists.map(|list| list.carried(&frames[frame as usize].field, drops_stale)).collect()
    }
}

/// SS-PA-001: the parents of a unit, not displaced.
fn parents(frames: &[Walked], frame: &Walked, id: &UnitId) -> GaussianList {
    let r = id.refinement.into();
    let list = match frame.reference {
        Some(reference) => frames[reference as usize].layer(id.spatial_layer).nth(r),
        None => id.spatial_layer.checked_sub(1).and_then(|below| frame.layer(below).nth(r)),
    };
    list.map_or_else(|| GaussianList::empty(0), |step| step.list.clone())
}

/// SS-PR-001: what stands before and after the parents of a unit in its reference set.
fn around<'f>(frame: &'f Walked, id: &UnitId) -> [Vec<&'f QuantizedFrame>; 2] {
    let steps = || frame.layer(id.spatial_layer);
    match frame.reference {
        None => [steps().map(|step| &step.list.planes).collect(), Vec::new()],
        Some(_) => {
            [steps().map(|step| &step.displaced.planes).collect(), steps().map(|step| &step.added).collect()]
        }
    }
}

impl Step {
    pub(crate) fn name(&self) -> String {
        format!("({}, {}) of frame {}", self.id.spatial_layer, self.id.refinement, self.id.frame)
    }
}

impl Walked {
    pub(crate) fn layer(&self, spatial: u8) -> impl Iterator<Item = &Step> {
        self.steps.iter().filter(move |step| step.id.spatial_layer == spatial)
    }

    pub(crate) fn step(&self, spatial: u8, refinement: usize) -> &Step {
        self.layer(spatial).nth(refinement).unwrap()
    }
}
