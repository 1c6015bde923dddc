//! Clauses 7.14 to 7.18 frame by frame, with every unit there: homes, carried lists, digests.

use super::cells::Field;
use super::gaussian::{Rules, Splat, moved, placed, planes, reconstructed, unpredicted};
use super::prediction::{bilateral, knn, neighbours};
use super::scene::{Frame, Gop, Unit};
use super::transformer::learned;
use crate::crafted::reference::{frame_digest, plane_digests};
use splatstream_format::syntax::SequenceParameters;
use std::collections::BTreeMap;
use xxhash_rust::xxh64::xxh64;

/// What is known of a frame.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Known {
    pub(crate) place: u32,
    /// `home(s, r)`; none where a unit breaks a rule.
    pub(crate) homes: BTreeMap<(u8, u8), Vec<Splat>>,
    /// New Gaussians of each unit.
    added: BTreeMap<(u8, u8), Vec<Splat>>,
    /// `carried(t, h)`.
    pub(crate) carried: Vec<Vec<Splat>>,
}

/// A frame that is being worked out.
pub(crate) struct Work {
    sequence: SequenceParameters,
    top: u8,
    pub(crate) known: Known,
    /// Homes of the reference frame, displaced, and of the intra frame; none in an intra frame.
    displaced: Option<Vec<Vec<Splat>>>,
    intra: Vec<Vec<Splat>>,
}

fn homes(sequence: &SequenceParameters, known: Option<&Known>) -> Vec<Vec<Splat>> {
    let top = sequence.spatial_layer_count - 1;
    let home = |h| known.and_then(|known| known.homes.get(&(top, h))).cloned().unwrap_or_default();
    (0..sequence.refinement_count).map(home).collect()
}

impl Work {
    /// Begins a frame whose cells are those of its unit 0; `before` are the frames of the GOP before it.
    pub(crate) fn new(
        sequence: &SequenceParameters,
        gop: &Gop,
        place: u32,
        unit: Option<&Unit>,
        before: &[Known],
    ) -> Self {
        let find = |place: u32| before.iter().find(|known| known.place == place);
        let known = Known { place, ..Known::default() };
        let mut work = Self {
            sequence: *sequence,
            top: sequence.spatial_layer_count - 1,
            known,
            displaced: None,
            intra: Vec::new(),
        };
        if let Some(reference) = gop.reference(place) {
            let cells = unit.map(|unit| unit.cells.as_slice()).unwrap_or_default();
            let field = Field { sequence, cell_log2: unit.map_or(0, |unit| unit.header.cell_log2), cells };
            let displaced = |list: &Vec<Splat>| list.iter().map(|splat| field.displaced(splat)).collect();
            work.displaced = Some(homes(sequence, find(reference)).iter().map(displaced).collect());
            work.intra = homes(sequence, find(0));
            let fresh = |list: &Vec<Splat>| -> Vec<Splat> {
                let kept = list.iter().filter(|splat| !field.is_stale(splat));
                kept.map(|splat| field.displaced(splat)).collect()
            };
            work.known.carried = find(reference).iter().flat_map(|known| &known.carried).map(fresh).collect();
        }
        work
    }

    /// 7.14.2, displaced.
    pub(crate) fn parents(&self, spatial: u8, refinement: u8) -> Vec<Splat> {
        match &self.displaced {
            Some(homes) => homes.get(usize::from(refinement)).cloned().unwrap_or_default(),
            None => {
                let below = spatial.checked_sub(1).map(|below| (below, refinement));
                below.and_then(|at| self.known.homes.get(&at)).cloned().unwrap_or_default()
            }
        }
    }

    /// SS-PR-001; `parents` as the unit leaves them.
    fn reference_set(&self, unit: &Unit, parents: &[Splat]) -> Vec<Splat> {
        let r = usize::from(unit.refinement);
        match &self.displaced {
            None => {
                let lower = (0..unit.refinement).filter_map(|h| self.known.homes.get(&(unit.spatial, h)));
                lower.flatten().chain(parents).cloned().collect()
            }
            Some(homes) => {
                let below = homes.iter().take(r + 1).flatten();
                let above = self.intra.iter().skip(r + 1).flatten();
                let new = (0..unit.refinement).filter_map(|r| self.known.added.get(&(self.top, r)));
                below.chain(above).chain(new.flatten()).cloned().collect()
            }
        }
    }

    /// Adds a unit; none if it breaks a rule of a Gaussian.
    pub(crate) fn unit(&mut self, rules: &Rules<'_>, unit: &Unit) -> Option<()> {
        let field = Field { sequence: &self.sequence, cell_log2: unit.header.cell_log2, cells: &unit.cells };
        if !field.is_allowed() {
            return None;
        }
        let parents = changed(rules, unit, &self.parents(unit.spatial, unit.refinement))?;
        let added = self.added(rules, unit, &self.reference_set(unit, &parents))?;
        let kept = parents.iter().zip(&unit.modes).filter(|(_, mode)| **mode != 4);
        let home = kept.map(|(splat, _)| splat).chain(&added).cloned().collect();
        let at = (unit.spatial, unit.refinement);
        self.known.homes.insert(at, home);
        self.known.added.insert(at, added);
        if self.displaced.is_none() {
            self.known.carried = homes(&self.sequence, Some(&self.known));
        }
        Some(())
    }

    fn added(&self, rules: &Rules<'_>, unit: &Unit, set: &[Splat]) -> Option<Vec<Splat>> {
        let mut code = 0_u64;
        let mut added = Vec::new();
        for (place, v) in unit.new.iter().enumerate() {
            let is_first = place % (1 << self.sequence.block_log2) == 0;
            code = if is_first { v.delta } else { code.checked_add(v.delta)? };
            let start = Splat {
                position_fine: placed(rules, code)?,
                anchor: self.displaced.is_none(),
                ..Splat::default()
            };
            let run = place.checked_shr(unit.header.predictor_block_log2.into()).unwrap_or(0);
            let predictor = unit.predictors.get(run).copied().unwrap_or(0);
            let near = neighbours(set, &start, unit.header.neighbour_count);
            added.push(match predictor {
                3 if rules.network.is_none() => return None,
                1..=3 if near.is_empty() => reconstructed(rules, v, start, |at, _| unpredicted(rules, at))?,
                1 => reconstructed(rules, v, start, |at, _| knn(&near, at))?,
                2 => reconstructed(rules, v, start, |at, own| bilateral(&near, rules.header, at, own))?,
                3 => reconstructed(rules, v, start, |at, own| learned(&near, rules, at, own))?,
                0 => reconstructed(rules, v, start, |at, _| unpredicted(rules, at))?,
                _ => return None,
            });
        }
        Some(added)
    }

    /// SS-DG-005 and SS-DG-006.
    pub(crate) fn digests(&self, spatial: u8, refinement: u8) -> [u64; 2] {
        let lists = (0..=refinement).map(|h| self.known.homes.get(&(spatial, h)));
        let exact =
            digest(&self.sequence, &lists.map(|list| list.cloned().unwrap_or_default()).collect::<Vec<_>>());
        if self.displaced.is_none() {
            return [exact, xxh64(&[], 0)];
        }
        let carried = self.known.carried.get(usize::from(refinement) + 1..).unwrap_or_default();
        [exact, digest(&self.sequence, carried)]
    }
}

/// SS-DG-004.
fn digest(sequence: &SequenceParameters, lists: &[Vec<Splat>]) -> u64 {
    let of = |list: &Vec<Splat>| plane_digests(&planes(list, sequence.sh_dimension()));
    frame_digest(&lists.iter().map(of).collect::<Vec<_>>())
}

/// The parents after their moves and updates.
fn changed(rules: &Rules<'_>, unit: &Unit, parents: &[Splat]) -> Option<Vec<Splat>> {
    let (mut moves, mut updates) = (unit.moves.iter(), unit.updates.iter());
    let one = |(parent, &mode): (&Splat, &i64)| {
        let mut splat = parent.clone();
        if mode == 1 || mode == 3 {
            splat.position_fine = moved(rules, splat.position_fine, *moves.next()?)?;
        }
        if mode == 2 || mode == 3 {
            splat = reconstructed(rules, updates.next()?, splat.clone(), |at, _| splat.of_itself(at))?;
        }
        Some(splat)
    };
    parents.iter().zip(&unit.modes).map(one).collect()
}

/// Every frame of a GOP.
pub(crate) fn evaluate(sequence: &SequenceParameters, gop: &Gop) -> Vec<Known> {
    let mut all: Vec<Known> = Vec::new();
    for (place, frame) in gop.frames.iter().enumerate() {
        let known = evaluate_frame(sequence, gop, place, frame, &all, |_, _| ()).known;
        all.push(known);
    }
    all
}

/// One frame; `after` each unit sees it and its digests.
pub(crate) fn evaluate_frame(
    sequence: &SequenceParameters,
    gop: &Gop,
    place: usize,
    frame: &Frame,
    before: &[Known],
    mut after: impl FnMut(&Unit, [u64; 2]),
) -> Work {
    let mut work = Work::new(sequence, gop, frame.place, frame.units.first(), before);
    let codebooks = gop.codebooks(place);
    for unit in &frame.units {
        if let Some(tools) = gop.tools(frame, &codebooks) {
            let header = unit.counted();
            let rules = Rules { sequence, tools, network: gop.network.as_ref(), header: &header };
            let _ = work.unit(&rules, unit);
        }
        after(unit, work.digests(unit.spatial, unit.refinement));
    }
    work
}
