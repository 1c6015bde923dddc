//! Clauses 7.14 to 7.18 unit by unit, by the functions of the decoder, with all that stands between.

use splatstream_decoder::colour::Colour;
use splatstream_decoder::digest::{UnitDigest, frame_digest, unit_digest};
use splatstream_decoder::displacement::{CellField, rotation_unit};
use splatstream_decoder::frame::QuantizedFrame;
use splatstream_decoder::home::Home;
use splatstream_decoder::increment::residual::AttributeCoding;
use splatstream_decoder::increment::values::UnitValues;
use splatstream_decoder::increment::{Situation, Unit, apply, field, reference_set};
use splatstream_decoder::layout::ShCoding;
use splatstream_format::entropy::in_force::ModelsInForce;
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
    pub(crate) parents: Home,
    pub(crate) displaced: Home,
    pub(crate) set: QuantizedFrame,
    pub(crate) home: Home,
    /// The new Gaussians of the home.
    pub(crate) added: QuantizedFrame,
    /// refinement_digest and carried_digest as computed.
    pub(crate) digests: [u64; 2],
}

/// A frame as far as it goes.
#[derive(Default)]
pub(crate) struct Walked {
    pub(crate) number: u32,
    pub(crate) reference: Option<u32>,
    pub(crate) field: CellField,
    pub(crate) steps: Vec<Step>,
    /// `carried(h)` of each home.
    pub(crate) carried: Vec<Home>,
    /// After the last unit of refinement 0, and after the last unit.
    pub(crate) models: [ModelsInForce; 2],
}

impl Common {
    pub(crate) fn coding(&self, header: &IncrementHeader) -> AttributeCoding<'_> {
        AttributeCoding {
            shift: header.attribute_shift,
            canonical_axes: self.sequence.canonical_axes(),
            rotation_thresholds: self.sequence.rotation_threshold,
            colour: Colour { dc: &self.transform, sh: None, mode: ShCoding::None, codebooks: [None; 4] },
        }
    }

    /// Begins a frame.
    pub(crate) fn start(&self, frames: &[Walked], number: u32) -> Walked {
        let reference = self.gop.place(number).reference;
        let known = reference.map(|at| &frames[at as usize]);
        let first = known.map(|known| known.models[0].clone()).unwrap_or_default();
        Walked { number, reference, models: [first.clone(), first], ..Walked::default() }
    }

    /// Applies a unit to the frame in progress, behind the frames before it.
    pub(crate) fn step(
        &self,
        frames: &[Walked],
        frame: &mut Walked,
        id: UnitId,
        header: IncrementHeader,
        values: UnitValues,
    ) {
        let coding = self.coding(&header);
        let intra = frame.reference.is_none();
        let unit = Unit {
            header: &header,
            values: &values,
            coding,
            sequence: &self.sequence,
            intra,
            network: None,
            most_learned: 0,
            at: 0,
        };
        let r = usize::from(id.refinement);
        let reference = frame.reference.map(|at| &frames[at as usize]);
        if let (Some(reference), 0) = (reference, r) {
            frame.field = field(&unit, rotation_unit(self.sequence.rotation_step)).unwrap();
            let carried = |home: &Home| home.clone().carried(&frame.field);
            frame.carried = reference.carried.iter().map(carried).collect();
        }
        let parents = parents(frames, frame, &id);
        let mut displaced = parents.clone();
        displaced.displace(&frame.field);
        let (lower, behind) = around(frames, frame, &id);
        let (lower, behind): (Vec<_>, Vec<_>) = (lower.iter().collect(), behind.iter().collect());
        let situation = Situation { around: [&lower, &behind], parents_follow: intra };
        let applied = apply(&unit, displaced.clone(), &situation).unwrap();
        let mut left = applied.home.planes.clone();
        left.truncate(left.len() - applied.added.len());
        let set = reference_set(&situation, if intra { &left } else { &displaced.planes });
        let (home, added) = (applied.home, applied.added);
        let mut step = Step {
            id,
            header,
            values,
            parents,
            displaced,
            set,
            home,
            added,
            digests: [0, frame_digest(&[])],
        };
        self.digests(frame, &mut step);
        frame.steps.push(step);
    }

    /// Clause 7.18.4; an intra frame carries the homes of its highest layer.
    fn digests(&self, frame: &mut Walked, step: &mut Step) {
        let (spatial, r) = (step.id.spatial_layer, usize::from(step.id.refinement));
        let homes = frame.layer(spatial).map(|step| &step.home).chain([&step.home]);
        step.digests[0] = digest(homes);
        if frame.reference.is_some() {
            step.digests[1] = digest(frame.carried.iter().skip(r + 1));
        } else if spatial + 1 == self.sequence.spatial_layer_count {
            frame.carried.push(step.home.clone());
        }
    }
}

/// SS-PA-001: the parents of a unit, not displaced.
fn parents(frames: &[Walked], frame: &Walked, id: &UnitId) -> Home {
    let home = match frame.reference {
        Some(reference) => frames[reference as usize].home(id.spatial_layer, id.refinement.into()),
        None => id.spatial_layer.checked_sub(1).and_then(|below| frame.home(below, id.refinement.into())),
    };
    home.cloned().unwrap_or_else(|| Home::empty(0))
}

/// SS-PR-001: what stands before and behind the parents of a unit in its reference set.
fn around(frames: &[Walked], frame: &Walked, id: &UnitId) -> (Vec<QuantizedFrame>, Vec<QuantizedFrame>) {
    if frame.reference.is_none() {
        return (frame.layer(id.spatial_layer).map(|step| step.home.planes.clone()).collect(), Vec::new());
    }
    let lower = frame.steps.iter().map(|step| step.displaced.planes.clone()).collect();
    let anchor = frames[0].layer(id.spatial_layer).skip(usize::from(id.refinement) + 1);
    let added = frame.steps.iter().map(|step| step.added.clone());
    (lower, anchor.map(|step| step.home.planes.clone()).chain(added).collect())
}

fn digest<'h>(homes: impl Iterator<Item = &'h Home>) -> u64 {
    let digests: Vec<UnitDigest> = homes.map(|home| unit_digest(&home.planes, 0..home.len())).collect();
    frame_digest(&digests)
}

impl Step {
    pub(crate) fn name(&self) -> String {
        format!("({}, {}) of frame {}", self.id.spatial_layer, self.id.refinement, self.id.frame)
    }
}

impl Walked {
    fn layer(&self, spatial: u8) -> impl Iterator<Item = &Step> {
        self.steps.iter().filter(move |step| step.id.spatial_layer == spatial)
    }

    pub(crate) fn step(&self, spatial: u8, refinement: usize) -> &Step {
        self.layer(spatial).nth(refinement).unwrap()
    }

    fn home(&self, spatial: u8, refinement: usize) -> Option<&Home> {
        self.layer(spatial).nth(refinement).map(|step| &step.home)
    }
}
