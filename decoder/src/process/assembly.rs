//! One frame of profile Dynamic, unit by unit: clauses 7.13, 7.14 and 7.18.

use super::expected::element_at;
use super::layered::{PendingIncrement, Reference};
use super::{Compensation, DecodedFrame, Options, PendingFrame};
use crate::digest::{UnitDigest, frame_digest, unit_digest};
use crate::displacement::{CellField, rotation_unit};
use crate::entropy_state::{UnitEntropy, of_increment};
use crate::frame::QuantizedFrame;
use crate::frame_state::FrameState;
use crate::gop::{Gop, Transforms};
use crate::home::Home;
use crate::increment::residual::AttributeCoding;
use crate::increment::values::{PreparedIncrement, UnitValues};
use crate::increment::{Applied, Situation, Unit, apply, field};
use crate::layout::ShCoding;
use rayon::prelude::*;
use splatstream_format::entropy::in_force::{ModelsInForce, ModelsOfFrame};
use splatstream_format::syntax::{FrameType, IncrementHeader, SequenceParameters};
use splatstream_format::{Error, ErrorKind, Result};
use std::sync::Arc;

/// Tables that are expanded at the same time: all of those of an honest frame.
const MOST_TABLES: usize = 1 << 12;

/// A frame that is being put together.
pub(super) struct Assembly<'d, 'a> {
    options: Options,
    /// Entropy states of the units so far, if they are asked for.
    entropy: Vec<UnitEntropy>,
    sequence: &'d SequenceParameters,
    gop: &'d Gop,
    transforms: Transforms<'d>,
    frame: &'d PendingFrame<'a>,
    reference: Option<&'d Reference>,
    /// The layer below the one in progress: its homes are the parents there.
    below: Layer,
    /// The last complete layer, if it is neither of these.
    complete: Option<Layer>,
    /// The homes of the layer in progress, and their digests.
    homes: Vec<Home>,
    digests: Vec<UnitDigest>,
    spatial_layer: u8,
    /// Units of the lowest layer: as many make a layer complete.
    width: usize,
    field: Arc<CellField>,
    /// The homes of the reference frame displaced, and the Gaussians added so far, if units predict from them.
    displaced: Vec<QuantizedFrame>,
    added: Vec<QuantizedFrame>,
    models: ModelsOfFrame,
    /// Header and offset of the last unit decoded.
    last: Option<(IncrementHeader, u64)>,
    bytes: u64,
}

/// A spatial layer of an intra frame.
#[derive(Debug, Default)]
struct Layer {
    spatial_layer: u8,
    homes: Vec<Home>,
    last: Option<(IncrementHeader, u64)>,
}

/// A frame put together.
pub(super) struct Assembled {
    pub(super) decoded: DecodedFrame,
    /// Refinements that frames which refer to this one can have.
    pub(super) level: u8,
    pub(super) state: Arc<FrameState>,
    /// What is carried differs from its digest.
    pub(super) fault: Option<Error>,
}

impl<'d, 'a> Assembly<'d, 'a> {
    pub(super) fn new(
        options: Options,
        sequence: &'d SequenceParameters,
        gop: &'d Gop,
        frame: &'d PendingFrame<'a>,
        reference: Option<&'d Reference>,
    ) -> Result<Self> {
        let models = reference.map(|reference| reference.state.models.clone()).unwrap_or_default();
        Ok(Self {
            options,
            entropy: Vec::new(),
            sequence,
            gop,
            transforms: gop.transforms(&frame.header, frame.at)?,
            frame,
            reference,
            below: Layer::default(),
            complete: None,
            homes: Vec::new(),
            digests: Vec::new(),
            spatial_layer: 0,
            width: 0,
            field: Arc::new(CellField::default()),
            displaced: Vec::new(),
            added: Vec::new(),
            models: ModelsOfFrame::starting_with(models),
            last: None,
            bytes: frame.bytes,
        })
    }

    fn is_intra(&self) -> bool {
        self.frame.place.reference.is_none()
    }

    /// Decodes units in order, up to the first that fails.
    pub(super) fn units(&mut self, units: &[PendingIncrement<'a>]) -> Result<()> {
        let (prepared, failure) = self.prepare(units);
        let predicts = units.iter().any(|unit| unit.increment.header.predictor_count() > 0);
        let mut rest = units.iter().zip(&prepared).collect::<Vec<_>>();
        while !rest.is_empty() {
            let later = rest.split_off(group_length(&rest));
            let values: Vec<Result<UnitValues>> =
                rest.par_iter().map(|(_, prepared)| prepared.0.decode(self.sequence)).collect();
            for ((unit, (_, models)), values) in rest.iter().zip(values) {
                let values = values?;
                self.unit(unit, &values, predicts)?;
                self.observe(unit, &values);
                self.models.follow(unit.refinement, models.clone());
            }
            rest = later;
        }
        failure.map_or(Ok(()), Err)
    }

    /// Keeps the entropy state of a unit, if it has one and is asked for it.
    fn observe(&mut self, unit: &PendingIncrement<'a>, values: &UnitValues) {
        if self.options.entropy {
            let state = of_increment(&unit.increment, values);
            self.entropy.extend(state.map(|state| UnitEntropy { payload_at: unit.payload_at, state }));
        }
    }

    /// Reads the models of the units, up to the first that fails.
    fn prepare<'r>(&self, units: &'r [PendingIncrement<'a>]) -> (Vec<Prepared<'r, 'a>>, Option<Error>) {
        let mut in_force = self.models.clone();
        let mut prepared = Vec::with_capacity(units.len());
        for unit in units {
            let mut models = in_force.before(unit.refinement).clone();
            let ranks = (self.transforms.dc.header.rank, self.transforms.sh.map_or(0, |sh| sh.header.rank));
            let sh = ShCoding::of(&unit.increment.header.sh(), ranks.1);
            match PreparedIncrement::new(&unit.increment, ranks.0, sh, &mut models, &mut ()) {
                Ok(read) => prepared.push((read, models.clone())),
                Err(error) => return (prepared, Some(error)),
            }
            in_force.follow(unit.refinement, models);
        }
        (prepared, None)
    }

    /// Applies a unit to its parents and checks what comes out.
    fn unit(&mut self, pending: &PendingIncrement<'a>, values: &UnitValues, predicts: bool) -> Result<()> {
        if pending.spatial_layer != self.spatial_layer && self.is_intra() {
            let homes = core::mem::take(&mut self.homes);
            let done = Layer { spatial_layer: self.spatial_layer, homes, last: self.last.take() };
            let before = core::mem::replace(&mut self.below, done);
            if before.homes.len() == self.width {
                self.complete = Some(before);
            }
            self.digests.clear();
        }
        self.spatial_layer = pending.spatial_layer;
        let header = &pending.increment.header;
        let at = pending.payload_at;
        let table = (&IncrementHeader::TABLE, at);
        let layer = self.frame.place.temporal_layer;
        let unit = Unit {
            header,
            values,
            coding: AttributeCoding {
                shift: header.attribute_shift,
                canonical_axes: self.sequence.canonical_axes(),
                rotation_thresholds: self.sequence.rotation_threshold,
                colour: self.gop.colour(self.transforms, &header.sh(), layer, table)?,
            },
            sequence: self.sequence,
            intra: self.is_intra(),
            network: self.gop.network(),
            most_learned: self.options.limits.max_learned,
            at,
        };
        let parents = self.parents(&unit, usize::from(pending.refinement), predicts)?;
        let applied = self.applied(&unit, parents)?;
        self.check(&applied, pending)?;
        self.take(applied, predicts);
        if self.spatial_layer == 0 || !self.is_intra() {
            self.width = self.homes.len();
        }
        self.last = Some((*header, at));
        self.bytes = self.bytes.wrapping_add(pending.bytes);
        Ok(())
    }

    /// Clause 7.14: the Gaussians that a unit may change, displaced.
    fn parents(&mut self, unit: &Unit<'_>, refinement: usize, predicts: bool) -> Result<Home> {
        let sh_planes = usize::from(self.sequence.sh_dimension());
        let of = |homes: &[Home]| homes.get(refinement).cloned().unwrap_or_else(|| Home::empty(sh_planes));
        let parents = match self.reference {
            None => of(&self.below.homes),
            Some(reference) => {
                if refinement == 0 {
                    self.field = Arc::new(field(unit, rotation_unit(self.sequence.rotation_step))?);
                }
                let mut parents = of(&reference.state.homes);
                parents.displace(&self.field);
                if predicts {
                    self.displaced.push(parents.planes.clone());
                }
                parents
            }
        };
        let announced = u64::from(unit.header.parent_count);
        let found = u64::try_from(parents.len()).unwrap_or(u64::MAX);
        mismatch(unit.at, "parent_count", announced, found)?;
        Ok(parents)
    }

    fn applied(&self, unit: &Unit<'_>, parents: Home) -> Result<Applied> {
        let lower: Vec<&QuantizedFrame> = match self.reference {
            None => self.homes.iter().map(|home| &home.planes).collect(),
            // The last of them are the parents.
            Some(_) => self.displaced.iter().take(self.homes.len()).collect(),
        };
        let anchor = self
            .reference
            .map(|reference| reference.state.anchor.iter().skip(self.homes.len().wrapping_add(1)));
        let behind: Vec<&QuantizedFrame> =
            anchor.into_iter().flatten().map(|home| &home.planes).chain(&self.added).collect();
        let situation = Situation { around: [&lower, &behind], parents_follow: self.reference.is_none() };
        apply(unit, parents, &situation)
    }

    /// Clauses 6.14 and 7.18: counts and digest after a unit.
    fn check(&mut self, applied: &Applied, pending: &PendingIncrement<'a>) -> Result<()> {
        let count = |length: usize| u64::try_from(length).unwrap_or(u64::MAX);
        let total = self.homes.iter().map(Home::len).fold(applied.home.len(), usize::saturating_add);
        let all = self.frame.header.gaussian_count;
        let at = pending.payload_at;
        let top = pending.spatial_layer.wrapping_add(1) == self.sequence.spatial_layer_count;
        let last = pending.refinement.wrapping_add(1) == self.sequence.refinement_count;
        if self.is_intra() && top {
            let expected = self.sequence.refinement_length(pending.refinement, all);
            mismatch(at, "new_count", count(applied.home.len()), expected.into())?;
        } else if count(total) > all.into() || last && !self.is_intra() {
            mismatch(at, "new_count", count(total), all.into())?;
        }
        self.digests.push(unit_digest(&applied.home.planes, 0..applied.home.len()));
        let stored = pending.increment.header.refinement_digest;
        let computed = if self.options.verify { frame_digest(&self.digests) } else { stored };
        if computed != stored {
            return Err(Error::new(at, "7.18", ErrorKind::Digest { stored, computed }));
        }
        Ok(())
    }

    fn take(&mut self, applied: Applied, predicts: bool) {
        let Applied { home, added } = applied;
        if predicts && !self.is_intra() {
            self.added.push(added);
        }
        self.homes.push(home);
    }

    /// Clause 7.20: what is shown of the frame, and what is kept.
    pub(super) fn finish(mut self) -> Assembled {
        if self.homes.len() < self.width {
            let below = core::mem::take(&mut self.below);
            let complete =
                if below.homes.len() == self.width { below } else { self.complete.take().unwrap_or(below) };
            Layer { spatial_layer: self.spatial_layer, homes: self.homes, last: self.last } = complete;
        }
        let decoded = DecodedFrame {
            spatial_layer: self.spatial_layer,
            bytes: self.bytes,
            entropy: core::mem::take(&mut self.entropy),
            refinements: u8::try_from(self.homes.len()).unwrap_or(u8::MAX),
            ..DecodedFrame::empty(self.frame.number, self.frame_type())
        };
        match self.reference {
            Some(reference) if self.homes.is_empty() => self.frozen(decoded, reference),
            _ => self.shown(decoded),
        }
    }

    fn frame_type(&self) -> FrameType {
        self.frame.place.frame_type
    }

    /// A predicted frame of which nothing is there looks like the one it refers to.
    fn frozen(&self, mut decoded: DecodedFrame, reference: &Reference) -> Assembled {
        let sh_planes = usize::from(self.sequence.sh_dimension());
        let (planes, exact) = reference.state.shown(sh_planes, self.options.subset);
        decoded.carried = planes.len().wrapping_sub(exact);
        decoded.planes = planes;
        decoded.frozen = Some(reference.state.number);
        decoded.compensation = reference.state.compensation.clone();
        Assembled { decoded, level: 0, state: Arc::clone(&reference.state), fault: None }
    }

    fn shown(self, mut decoded: DecodedFrame) -> Assembled {
        let refinements = usize::from(self.sequence.refinement_count);
        let complete = self.homes.len() == refinements
            && self.spatial_layer.wrapping_add(1) == self.sequence.spatial_layer_count;
        let (level, anchor, fields) = match self.reference {
            None => {
                let level = if complete { self.sequence.refinement_count } else { 0 };
                (level, Arc::new(self.homes.clone()), Vec::new())
            }
            Some(reference) => {
                let mut fields = reference.state.fields.clone();
                fields.push(Arc::clone(&self.field));
                (decoded.refinements, Arc::clone(&reference.state.anchor), fields)
            }
        };
        let digest = self.last.filter(|_| self.options.verify);
        let mut state = FrameState {
            number: self.frame.number,
            homes: self.homes,
            anchor,
            fields,
            carried: Vec::new(),
            compensation: Compensation::default(),
            models: self.models.first,
        };
        let mut fault = None;
        if let (Some(reference), false) = (self.reference, self.options.subset) {
            state.carry_from(&reference.state, refinements);
        }
        decoded.digest = digest.map(|(header, _)| header.refinement_digest);
        if let (Some((header, at)), false) = (digest, self.options.subset) {
            let computed = state.carried_digest();
            decoded.carried_digest = Some(computed);
            let stored = header.carried_digest;
            if computed != stored {
                let at = element_at(&IncrementHeader::TABLE, at, "carried_digest");
                fault = Some(Error::new(at, "7.18", ErrorKind::Digest { stored, computed }));
            }
        }
        state.compensation = self
            .last
            .filter(|_| usize::from(decoded.refinements) < refinements)
            .map(|(header, _)| state.compensation(&header, self.options.subset || self.reference.is_none()))
            .unwrap_or_default();
        decoded.compensation = state.compensation.clone();
        let (planes, exact) = state.shown(usize::from(self.sequence.sh_dimension()), self.options.subset);
        decoded.carried = planes.len().wrapping_sub(exact);
        decoded.planes = planes;
        Assembled { decoded, level, state: Arc::new(state), fault }
    }
}

/// A unit with its models read, and those in force after it.
type Prepared<'r, 'a> = (PreparedIncrement<'r, 'a>, ModelsInForce);

/// How many of the units, at least one, have their tables expanded at the same time.
fn group_length(units: &[(&PendingIncrement<'_>, &Prepared<'_, '_>)]) -> usize {
    let mut tables = 0_usize;
    let fits = |(_, (prepared, _)): &&(&PendingIncrement<'_>, &Prepared<'_, '_>)| {
        tables = tables.wrapping_add(prepared.tables());
        tables <= MOST_TABLES
    };
    units.iter().take_while(fits).count().max(1)
}

/// A count of the header is not what the state says.
fn mismatch(at: u64, element: &'static str, value: u64, expected: u64) -> Result<()> {
    if value == expected {
        return Ok(());
    }
    let at = element_at(&IncrementHeader::TABLE, at, element);
    Err(Error::new(at, "6.14", ErrorKind::Mismatch { element, value, expected }))
}
