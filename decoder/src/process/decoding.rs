//! The units of a frame, decoded: clauses 7.4 to 7.9.
//!
//! 1. The models of all pending units are read, one unit after the other, since they may repeat each other.
//! 2. The blocks of all units are decoded on all cores, as many units at a time as have few enough tables.
//! 3. The units are applied one after the other: parents, displaced in a P or B frame, become the list of the unit.
//!
//! Where units only add Gaussians without predictors, steps 2 and 3 are one: see [`crate::direct`].

use super::applying::{self, Outcome};
use super::frame::{Context, DividedUnit, FrameInProgress, Refused};
use super::lists::{Head, Identities, put};
use crate::cores;
use crate::digest::{ListDigest, list_digest_unless, whole_digest_unless};
use crate::direct::{self, DirectUnit};
use crate::entropy_state::{UnitEntropy, of_sections};
use crate::fault;
use crate::increment::Unit;
use crate::increment::residual::AttributeCoding;
use crate::increment::values::{PreparedSections, SectionCoding, UnitValues};
use crate::layout::ShCoding;
use crate::shift::Shift;
use crate::steps::StepRule;
use splatstream_format::entropy::in_force::{ModelsInForce, ModelsOfFrame};
use splatstream_format::syntax::IncrementHeader;
use splatstream_format::{Error, Result};
use std::sync::Arc;

/// Tables that are expanded at the same time: all of those of an honest frame. A stream made to take memory gets one unit
/// at a time.
const MAX_TABLES: usize = 1 << 12;
/// Values of units that are held at the same time, if there is more than one unit: 64 MiB. Units of spatial layers, each
/// of which changes all Gaussians, would take several times the memory of their frame otherwise.
const MAX_VALUES: u64 = 1 << 24;

/// A pending unit with its models read.
struct Prepared<'r, 'a> {
    unit: &'r DividedUnit<'a>,
    sections: PreparedSections<'r, 'a>,
    coding: AttributeCoding<'r>,
    /// The models in force after the unit.
    models: ModelsInForce,
}

impl FrameInProgress {
    /// Decodes the pending units; gives their errors in stream order.
    pub(super) fn decode(&mut self, context: &Context<'_>) -> Vec<Error> {
        let pending = core::mem::take(&mut self.pending);
        let divided: Result<Vec<DividedUnit<'_>>> =
            pending.iter().map(|unit| unit.divided(context)).collect();
        match divided {
            Ok(units) => self.decode_units(&units, context),
            Err(error) => vec![error],
        }
    }

    fn decode_units(&mut self, pending: &[DividedUnit<'_>], context: &Context<'_>) -> Vec<Error> {
        let mut errors = Vec::new();
        let prepared = self.prepare(pending, context);
        let is_direct = self.is_direct(pending, context);
        if !is_direct {
            if let Err(error) = self.lists.divide(context.options.identities, context.interrupt) {
                return vec![error];
            }
            self.lists.displaced_needed = displaced_needed(pending);
        }
        let mut rest = prepared.as_slice();
        while !rest.is_empty() {
            let Some((group, later)) = rest.split_at_checked(group_length(rest, is_direct)) else {
                errors.push(Error::fault("no more units in a group than there are"));
                break;
            };
            match is_direct {
                true => self.decode_direct(group, context, &mut errors),
                false => self.decode_group(group, context, &mut errors),
            }
            rest = later;
        }
        self.expected = self.decoded.clone();
        errors
    }

    /// Reads the models of the units. A unit whose models are wrong is the last: those after it are of no use, or they are
    /// judged again once the error has been reported.
    fn prepare<'r, 'a>(
        &self,
        units: &'r [DividedUnit<'a>],
        context: &Context<'r>,
    ) -> Vec<(&'r DividedUnit<'a>, Result<Prepared<'r, 'a>>)> {
        let mut in_force = self.lists.models.clone();
        let prepare = |unit: &'r DividedUnit<'a>| {
            let prepared = self.prepared(unit, context, &mut in_force);
            (unit, prepared)
        };
        units.iter().map(prepare).collect()
    }

    fn prepared<'r, 'a>(
        &self,
        unit: &'r DividedUnit<'a>,
        context: &Context<'r>,
        in_force: &mut ModelsOfFrame,
    ) -> Result<Prepared<'r, 'a>> {
        let header = &unit.increment.header;
        let transforms = context.gop.transforms(&self.header, self.payload_at)?;
        let colour = context.gop.colour(transforms, header, self.role.temporal_layer, unit.payload_at)?;
        let sh = ShCoding::of(&header.sh(), transforms.sh.map_or(0, |sh| sh.header.rank));
        let mut models = in_force.before(unit.refinement).clone();
        let sections = &unit.increment.sections;
        let steps = StepRule::new(context.sequence, header.attribute_step);
        let coding = SectionCoding { dc_rank: transforms.dc.header.rank, sh, steps };
        let sections = PreparedSections::new(sections, &coding, &mut models, &mut ())?;
        in_force.follow(unit.refinement, models.clone());
        let canonical_axes = context.sequence.canonical_axes();
        let coding = AttributeCoding { steps, canonical_axes, colour, interrupt: context.interrupt };
        Ok(Prepared { unit, sections, coding, models })
    }

    /// Whether the units can be decoded straight into planes. Entropy states need the values by themselves.
    fn is_direct(&self, units: &[DividedUnit<'_>], context: &Context<'_>) -> bool {
        let of_lowest_layer = |unit: &DividedUnit<'_>| self.is_intra() && unit.spatial_layer == 0;
        let is_direct = |unit: &DividedUnit<'_>| of_lowest_layer(unit) && direct::is_direct(&unit.increment);
        self.lists.lists.is_empty() && !context.options.entropy && units.iter().all(is_direct)
    }

    /// Decodes units whose blocks go straight into planes. They are of one layer: after one that fails none is accepted.
    fn decode_direct(
        &mut self,
        group: &[(&DividedUnit<'_>, Result<Prepared<'_, '_>>)],
        context: &Context<'_>,
        errors: &mut Vec<Error>,
    ) {
        let units: Vec<DirectUnit<'_, '_>> = group
            .iter()
            .filter_map(|(unit, prepared)| Some((unit, prepared.as_ref().ok()?)))
            .map(|(unit, Prepared { sections, coding, .. })| DirectUnit {
                header: &unit.increment.header,
                prepared: sections,
                coding: *coding,
            })
            .collect();
        let (mut planes, results) = match direct::decode(&units, context.sequence, context.workspace()) {
            Ok(decoded) => decoded,
            Err(error) => return errors.push(error),
        };
        let mut results = results.into_iter();
        let mut kept = 0_usize;
        for (unit, prepared) in group {
            if unit.refinement >= self.decoded.limit {
                break;
            }
            let taken = known(prepared).and_then(|prepared| {
                let added = results.next().ok_or(Error::fault("a result for each unit"))??;
                let end = kept.saturating_add(added);
                let digest = || {
                    let digest = list_digest_unless(context.interrupt, &planes, kept..end);
                    digest.ok_or(Error::fault("the Gaussians of all units in the planes"))
                };
                self.check_list(unit, context, digest)?;
                put(&mut self.lists.heads, unit.refinement.into(), head(unit, added, added))?;
                self.finish_unit(unit, added, prepared)?;
                Ok(end)
            });
            match taken {
                Ok(end) => kept = end,
                Err(error) => self.refuse(unit, error, errors),
            }
        }
        planes.truncate(kept);
        match self.lists.planes.is_empty() {
            true => self.lists.planes = planes,
            false => self.lists.planes.append_unless(context.interrupt, &planes),
        }
    }

    /// Decodes units whose lists depend on others.
    fn decode_group(
        &mut self,
        group: &[(&DividedUnit<'_>, Result<Prepared<'_, '_>>)],
        context: &Context<'_>,
        errors: &mut Vec<Error>,
    ) {
        let of_unit = |(_, prepared): &(_, Result<Prepared<'_, '_>>)| {
            prepared.as_ref().map_or(0, |p| p.sections.values())
        };
        let count = group.iter().map(of_unit).fold(0, u64::saturating_add);
        // That many or more than can be counted: both are worth all cores.
        let count = usize::try_from(count).unwrap_or(usize::MAX);
        let values: Vec<Result<UnitValues>> = cores::map(count, group.iter().collect(), |(_, prepared)| {
            known(prepared)?.sections.decode(context.sequence, context.workspace())
        });
        for ((unit, prepared), values) in group.iter().zip(values) {
            if unit.refinement < self.decoded.limit {
                let values = values.as_ref().map_err(|error| *error);
                let taken = known(prepared).and_then(|prepared| self.unit(prepared, values?, context));
                taken.unwrap_or_else(|error| self.refuse(unit, error, errors));
            }
            context.interrupt.leave(values);
        }
    }

    /// Applies a unit and checks its digest.
    fn unit(
        &mut self,
        prepared: &Prepared<'_, '_>,
        values: &UnitValues,
        context: &Context<'_>,
    ) -> Result<()> {
        let pending = prepared.unit;
        let header = &pending.increment.header;
        let unit = Unit {
            header,
            values,
            coding: prepared.coding,
            sequence: context.sequence,
            network: context.gop.network(),
            max_learned: context.options.limits.max_learned,
            at: pending.payload_at,
        };
        let Outcome { list, added, keep } = self.applied(&unit, pending.refinement, context)?;
        let known = context.reference.and_then(|reference| reference.digest(pending.refinement, &list));
        let compute = || whole_digest_unless(context.interrupt, &list.planes);
        self.check_list(pending, context, || Ok(known.cloned().unwrap_or_else(compute)))?;
        if context.options.entropy {
            let state = of_sections(&pending.increment.sections, values)?;
            let payload_at = pending.payload_at;
            self.entropy.extend(state.map(|state| UnitEntropy { payload_at, state }));
        }
        let (size, head) = (list.len(), head(pending, list.len(), added));
        if context.options.identities {
            let r = usize::from(pending.refinement);
            let parents = match context.reference {
                Some(reference) => reference.identities.get(r),
                None => self.lists.identities.get(r),
            };
            // The lowest spatial layer has no parents.
            let parents = parents.map_or_else(Identities::default, Arc::clone);
            self.lists.follow_identities(r, parents, &keep, added)?;
        }
        self.lists.take(pending.refinement, list, head, keep)?;
        self.finish_unit(pending, size, prepared)
    }

    fn check_list(
        &mut self,
        unit: &DividedUnit<'_>,
        context: &Context<'_>,
        digest: impl FnOnce() -> Result<ListDigest>,
    ) -> Result<()> {
        if !context.options.verify {
            return Ok(());
        }
        let stored = unit.increment.header.refinement_digest;
        let at = unit.increment.header.at(unit.payload_at, "refinement_digest");
        self.lists.check_digest(unit.refinement, digest()?, stored, at)
    }

    /// Takes note of a unit that was decoded.
    fn finish_unit(
        &mut self,
        unit: &DividedUnit<'_>,
        size: usize,
        prepared: &Prepared<'_, '_>,
    ) -> Result<()> {
        self.bytes = self.bytes.saturating_add(unit.bytes);
        self.lists.models.follow(unit.refinement, prepared.models.clone());
        self.decoded.take(unit.spatial_layer, unit.refinement, fault::count(size)?);
        Ok(())
    }

    fn refuse(&mut self, unit: &DividedUnit<'_>, error: Error, errors: &mut Vec<Error>) {
        self.fail(&Refused { error, limit: unit.refinement });
        errors.push(error);
    }
}

/// What is known of a list after a unit that leaves it with `size` Gaussians, of which it has added the last.
fn head(unit: &DividedUnit<'_>, size: usize, added: usize) -> Head {
    let IncrementHeader { compensation_log_scale, compensation_opacity, .. } = unit.increment.header;
    let shift = Shift { log_scale: compensation_log_scale, opacity: compensation_opacity };
    Head { spatial_layer: unit.spatial_layer, shift, size, added }
}

/// How many of the first lists units that are to be applied may need displaced.
fn displaced_needed(units: &[DividedUnit<'_>]) -> usize {
    let predicts = |unit: &&DividedUnit<'_>| applying::predicts(&unit.increment.header);
    let last = units.iter().filter(predicts).map(|unit| unit.refinement).max();
    last.map_or(0, usize::from)
}

/// A unit with its models, unless they are wrong.
fn known<'p, 'r, 'a>(prepared: &'p Result<Prepared<'r, 'a>>) -> Result<&'p Prepared<'r, 'a>> {
    prepared.as_ref().map_err(|error| *error)
}

/// How many of the units, at least one, have their tables expanded and their values held at the same time.
fn group_length(units: &[(&DividedUnit<'_>, Result<Prepared<'_, '_>>)], is_direct: bool) -> usize {
    let (mut tables, mut values) = (0_usize, 0_u64);
    let fits = |(_, prepared): &&(&DividedUnit<'_>, Result<Prepared<'_, '_>>)| {
        let more = prepared.as_ref().map_or(0, |prepared| prepared.sections.tables());
        tables = tables.saturating_add(more);
        values = values.saturating_add(prepared.as_ref().map_or(0, |prepared| prepared.sections.values()));
        tables <= MAX_TABLES && (is_direct || values <= MAX_VALUES)
    };
    units.iter().take_while(fits).count().max(1)
}
