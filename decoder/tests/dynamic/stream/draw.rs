//! Scenes by dice that obey every rule: a unit that breaks one is thrown again.

use super::cells::Cell;
use super::frames::{Known, Work, evaluate};
use super::gaussian::{Rules, Splat, moved};
use super::network::Network;
use super::scene::{Frame, Gop, Scene, Unit};
use crate::crafted::sample::{self, Dice};
use crate::crafted::scene::{Gaussian, codebook, diagonal};
use splatstream_format::payload::{Codebook, Transform};
use splatstream_format::syntax::{GopHeader, IncrementHeader, NO_TRANSFORM, SequenceParameters};
use std::collections::BTreeMap;

/// What a scene shall be like.
#[derive(Debug, Clone)]
pub(crate) struct Plan {
    pub(crate) seed: u64,
    pub(crate) layers: (u8, u8),
    pub(crate) percents: Vec<u8>,
    pub(crate) sh: bool,
    /// Of an intra frame.
    pub(crate) gaussians: u64,
    /// Of each GOP: header, and the places of the frames that are there.
    pub(crate) gops: Vec<(GopHeader, Vec<u32>)>,
    /// Whether predicted frames may stop at a low refinement.
    pub(crate) short: bool,
    /// Whether GOPs have networks, and transforms whose components are not those of the output.
    pub(crate) learned: bool,
}

/// Transform 3 of kind dc; 4 of kind sh with two components.
pub(crate) fn transforms(sh: bool) -> Vec<Transform> {
    let dc = diagonal(3, 0, 3, 3, 4096, -70);
    if sh { vec![dc, diagonal(4, 1, 9, 2, 1234, 9)] } else { vec![dc] }
}

/// Codebooks 7 of three entries and 1 of two, for two components.
pub(crate) fn codebooks(spread: i16) -> Vec<(u8, Codebook)> {
    let first = codebook(7, 2, 1, vec![1, -spread, 30, 40, -128, 127]);
    vec![(0, first), (0, codebook(1, 2, 2, vec![0, 5, -8191, 8191 - spread]))]
}

impl Plan {
    pub(crate) fn sequence(&self) -> SequenceParameters {
        let mut refinement_percent = [0; 10];
        refinement_percent[..self.percents.len()].copy_from_slice(&self.percents);
        // Axes that need not be sorted, and a threshold that is not in use.
        let loose = self.seed.is_multiple_of(3);
        SequenceParameters {
            sh_degree: self.sh.into(),
            spatial_layer_count: self.layers.0,
            temporal_layer_count: self.layers.1,
            refinement_count: self.percents.len() as u8,
            refinement_percent,
            sequence_flags: SequenceParameters::flags(!loose, false),
            rotation_threshold: [12, 8, if loose { 0 } else { 4 }],
            frame_count: self.gops.iter().map(|(header, _)| header.gop_frame_count).sum(),
            ..sample::sequence()
        }
    }

    pub(crate) fn scene(&self) -> Scene {
        let sequence = self.sequence();
        let mut drawer = Drawer { dice: Dice::new(self.seed), sequence, plan: self };
        let gops = self.gops.iter().map(|(header, places)| drawer.gop(*header, places)).collect();
        Scene { level: 2, sequence, gops, points: None, index: true }
    }
}

struct Drawer<'p> {
    dice: Dice,
    sequence: SequenceParameters,
    plan: &'p Plan,
}

impl Drawer<'_> {
    fn gop(&mut self, header: GopHeader, places: &[u32]) -> Gop {
        let mut transforms = transforms(self.plan.sh);
        let network = self.plan.learned.then(|| {
            let bases = transforms.iter_mut().flat_map(|transform| &mut transform.basis);
            bases.for_each(|weight| *weight = self.dice.within(-4096, 4096) as i16);
            Network::drawn(&mut self.dice)
        });
        let mut gop = Gop { header, transforms, network, frames: Vec::new() };
        for &place in places {
            let sh_transform = if self.plan.sh { 4 } else { NO_TRANSFORM };
            let codebooks = if place == 0 { codebooks(2) } else { Vec::new() };
            gop.frames.push(Frame {
                place,
                codebooks,
                dc_transform: 3,
                sh_transform,
                count: None,
                units: Vec::new(),
            });
            let before = evaluate(&self.sequence, &gop);
            let units = match gop.reference(place) {
                None => self.intra(&gop, &before),
                Some(_) => self.predicted(&gop, &before),
            };
            gop.frames.last_mut().unwrap().units = units;
        }
        gop
    }

    /// All layers: each brings a part of what the highest has.
    fn intra(&mut self, gop: &Gop, before: &[Known]) -> Vec<Unit> {
        let place = gop.frames.last().unwrap().place;
        let layers = self.sequence.spatial_layer_count;
        let mut work = Work::new(&self.sequence, gop, place, None, before);
        let mut units = Vec::new();
        for spatial in 0..layers {
            for refinement in 0..self.sequence.refinement_count {
                let count = self.plan.gaussians as u32;
                let size = u64::from(self.sequence.refinement_length(refinement, count));
                let here = size * u64::from(spatial + 1) / u64::from(layers);
                let new = here - work.parents(spatial, refinement).len() as u64;
                let shell = Unit { spatial, refinement, ..Unit::default() };
                units.push(self.unit(gop, &mut work, shell, new));
            }
        }
        units
    }

    fn predicted(&mut self, gop: &Gop, before: &[Known]) -> Vec<Unit> {
        let place = gop.frames.last().unwrap().place;
        let (refinements, spatial) = (self.sequence.refinement_count, self.sequence.spatial_layer_count - 1);
        let mut shell = Unit { spatial, ..Unit::default() };
        shell.header.cell_log2 = self.dice.within(5, 10) as u8;
        let reference = gop.reference(place).and_then(|at| before.iter().find(|known| known.place == at));
        let splats: Vec<&Splat> = reference.iter().flat_map(|known| known.homes.values().flatten()).collect();
        shell.cells = self.cells(&splats, shell.header.cell_log2);
        let mut work = Work::new(&self.sequence, gop, place, Some(&shell), before);
        let last = if self.plan.short { self.dice.below(refinements.into()) as u8 } else { refinements - 1 };
        let unit = |refinement: u8| {
            let shell =
                if refinement == 0 { shell.clone() } else { Unit { refinement, spatial, ..Unit::default() } };
            let new = self.dice.below(7);
            self.unit(gop, &mut work, shell, new)
        };
        (0..=last).map(unit).collect()
    }

    /// Some of the cells in which Gaussians are, and a few others.
    fn cells(&mut self, splats: &[&Splat], cell_log2: u8) -> Vec<Cell> {
        let bits = self.sequence.position_bits.saturating_sub(cell_log2).max(1);
        let mut cells = BTreeMap::new();
        for splat in splats.iter().step_by(3) {
            let code = morton(splat.position().map(|position| position >> cell_log2), bits);
            cells.insert(code, self.cell(code));
        }
        let code = self.dice.below(1 << (3 * bits));
        cells.insert(code, self.cell(code));
        cells.into_values().collect()
    }

    fn cell(&mut self, code: u64) -> Cell {
        let stale = i64::from(self.dice.below(4) == 0);
        let far = if self.dice.below(9) == 0 { 30_000 } else { 300 };
        let wide = [0, 700, 8192][self.dice.below(3) as usize];
        let mut three = |most: i64| [(); 3].map(|()| self.dice.within(-most, most));
        Cell { code, stale, translation: three(far), turn: three(wide) }
    }

    /// A unit that fits, on top of a shell with its place and cells.
    fn unit(&mut self, gop: &Gop, work: &mut Work, shell: Unit, new: u64) -> Unit {
        let place = gop.frames.len() - 1;
        let codebooks = gop.codebooks(place);
        let tools = gop.tools(&gop.frames[place], &codebooks).unwrap();
        let sequence = self.sequence;
        let highest = if gop.reference(gop.frames[place].place).is_some() { 4 } else { 3 };
        let parents = work.parents(shell.spatial, shell.refinement);
        for _ in 0..50 {
            let mut unit = Unit { header: self.header(shell.header.cell_log2), ..shell.clone() };
            let network = gop.network.as_ref();
            let rules = Rules { sequence: &sequence, tools, network, header: &unit.header };
            unit.modes = parents.iter().map(|_| self.dice.within(0, highest)).collect();
            let moved = parents.iter().zip(&unit.modes).filter(|(_, mode)| [1, 3].contains(*mode));
            unit.moves = moved.map(|(parent, _)| self.legal_move(&rules, parent)).collect();
            let updates = unit.modes.iter().filter(|mode| [2, 3].contains(*mode)).count();
            unit.updates = (0..updates).map(|_| self.residual(&unit.header)).collect();
            unit.new = (0..new).map(|_| self.residual(&unit.header)).collect();
            for first in unit.new.iter_mut().step_by(1 << sequence.block_log2) {
                first.delta = self.dice.below(10_000_000);
            }
            let run = unit.header.predictor_block_log2;
            let runs = if run == 255 { 0 } else { new.div_ceil(1 << run) };
            let most = if network.is_some() { 3 } else { 2 };
            unit.predictors = (0..runs).map(|_| self.dice.within(0, most)).collect();
            unit.lanes_log2 = self.dice.below(6) as u8;
            unit.reuse = self.dice.below(2) == 0;
            let header = unit.counted();
            if work.unit(&Rules { header: &header, ..rules }, &unit).is_some() {
                return unit;
            }
        }
        panic!("no unit fits");
    }

    /// A move that stays in the lattice.
    fn legal_move(&mut self, rules: &Rules<'_>, parent: &Splat) -> [i64; 3] {
        let mut draw = || [(); 3].map(|()| self.dice.within(-3, 3));
        let fits = |by: &[i64; 3]| moved(rules, parent.position_fine, *by).is_some();
        core::iter::repeat_with(&mut draw).find(fits).unwrap()
    }

    fn header(&mut self, cell_log2: u8) -> IncrementHeader {
        let sh_mode = if self.plan.sh { self.dice.below(3) as u8 } else { 0 };
        let mut attribute_shift = [(); 5].map(|()| self.dice.below(4) as u8);
        let (vq_stage_count, codebook_ids) = match sh_mode {
            2 => {
                // The entries reach the largest component.
                attribute_shift[4] = 0;
                (2, [7, 1, 255, 255])
            }
            _ => (0, [255; 4]),
        };
        IncrementHeader {
            position_shift: self.dice.below(3) as u8,
            attribute_shift,
            cell_log2,
            predictor_block_log2: [255, 0, 1, 3][self.dice.below(4) as usize],
            neighbour_count: self.dice.within(1, 16) as u8,
            bilateral_spatial: self.dice.below(256) as u8,
            bilateral_feature: self.dice.below(60) as u8,
            sh_mode,
            vq_stage_count,
            codebook_ids,
            compensation_log_scale: self.dice.within(-9, 9) as i8,
            compensation_opacity: self.dice.within(-9, 9) as i8,
            ..IncrementHeader::PLAIN
        }
    }

    fn residual(&mut self, header: &IncrementHeader) -> Gaussian {
        let dice = &mut self.dice;
        let least = if self.sequence.canonical_axes() { 0 } else { -4 };
        let sh = match header.sh_mode {
            1 => vec![dice.within(-5, 5), dice.within(-5, 5)],
            2 => vec![dice.within(0, 2), dice.within(0, 1)],
            _ => Vec::new(),
        };
        // Some deltas are 0, so that Gaussians lie in one place.
        let delta = [0, 3, 40_000, 150_000][dice.below(4) as usize];
        Gaussian {
            delta: dice.below(delta + 1),
            log_scale: [dice.within(-20, 20), dice.within(least, 4), dice.within(least, 4)],
            opacity: dice.within(-25, 25),
            rotation: [(); 3].map(|()| dice.within(-9, 9)),
            dc: (0..3).map(|_| dice.within(-60, 60)).collect(),
            sh,
        }
    }
}

/// The code of a cell, 7.15.1.
pub(crate) fn morton(x: [i64; 3], bits: u8) -> u64 {
    let bit = |axis: usize, b: u8| ((x[axis] as u64 >> b) & 1) << (3 * usize::from(b) + axis);
    (0..3).flat_map(|axis| (0..bits).map(move |b| bit(axis, b))).sum()
}
