//! Predicted frames: cells, survivors, new Gaussians.

use super::predictors::{Chooser, used};
use super::price::Goal;
use super::survivors::{Fate, Survivors};
use super::unit::{Draft, UnitCoder, deltas};
use super::wanted::{ColourTarget, Wanted};
use super::{CodedUnit, Reference, Target};
use crate::colour;
use crate::error::Error;
use crate::lattice::{Spacing, geometry};
use crate::matching::{Cloud, Matching, Measure};
use crate::motion::follow::follow;
use crate::motion::stale::{Held, stale_cells};
use crate::motion::{CellMotion, Pair, cell_motion};
use crate::settings::Tools;
use crate::vq;
use rayon::prelude::*;
use splatstream_decoder::digest::{UnitDigest, frame_digest, unit_digest};
use splatstream_decoder::displacement::{CellField, rotation_unit};
use splatstream_decoder::frame::QuantizedFrame;
use splatstream_decoder::frame_state::FrameState;
use splatstream_decoder::home::{FINE, Home};
use splatstream_decoder::increment::values::SectionValues;
use splatstream_decoder::increment::{Applied, Situation, field};
use splatstream_decoder::layout::{Section, ShCoding};
use splatstream_decoder::process::Compensation;
use splatstream_format::entropy::in_force::{ModelsInForce, ModelsOfFrame};
use splatstream_format::syntax::SequenceParameters;
use splatstream_scene::importance;
use std::ops::Range;
use std::sync::Arc;

/// The largest translation of a cell, steps / 8: the difference of two is below 2^16.
const MOST_TRANSLATION: i32 = (1 << 15) - 1;

/// The row of a Gaussian that no file has any more.
const NO_ROW: u32 = u32::MAX;

/// The Gaussians of a reference as matching sees them.
pub(crate) struct ReferenceCloud {
    position: [Vec<f32>; 3],
    log_scale: [Vec<f32>; 3],
    opacity: Vec<f32>,
    dc: [Vec<f32>; 3],
    rows: Vec<u32>,
    row_count: u32,
    /// Fine positions.
    from: Vec<[i32; 3]>,
}

impl ReferenceCloud {
    pub(crate) fn new(reference: &Reference, sequence: &SequenceParameters) -> Self {
        let homes = &reference.state.homes;
        let joined =
            |plane: &dyn Fn(&Home) -> Vec<f32>| -> Vec<f32> { homes.iter().flat_map(plane).collect() };
        let axes = [0, 1, 2];
        let affine = |values: &[i32], offset: f32, step: f32| -> Vec<f32> {
            values.iter().map(|&q| offset + step * q as f32).collect()
        };
        let scale = (sequence.log_scale_offset(), sequence.log_scale_step());
        let from = |home: &Home| {
            let [x, y, z] = &home.position_fine;
            x.iter().zip(y).zip(z).map(|((&x, &y), &z)| [x, y, z]).collect::<Vec<_>>()
        };
        Self {
            position: axes
                .map(|axis: usize| joined(&|home| affine(&home.position_fine[axis], 0.0, 1.0 / FINE as f32))),
            log_scale: axes
                .map(|axis: usize| joined(&|home| affine(&home.planes.log_scale[axis], scale.0, scale.1))),
            opacity: joined(&|home| {
                affine(&home.planes.opacity, sequence.opacity_offset(), sequence.opacity_step())
            }),
            dc: axes.map(|axis: usize| {
                joined(&|home| affine(&home.planes.dc[axis], 0.0, sequence.dc_step() / 64.0))
            }),
            rows: reference.rows.concat(),
            row_count: reference.row_count,
            from: homes.iter().flat_map(from).collect(),
        }
    }

    fn cloud<'a>(&'a self, position: &'a [Vec<f32>; 3]) -> Cloud<'a> {
        let slices = |planes: &'a [Vec<f32>; 3]| planes.each_ref().map(Vec::as_slice);
        Cloud {
            position: slices(position),
            log_scale: slices(&self.log_scale),
            opacity: &self.opacity,
            dc: slices(&self.dc),
            row: &self.rows,
            row_count: self.row_count,
        }
    }

    /// Which Gaussian of a target continues each.
    pub(crate) fn matching(&self, target: &Target, measure: &Measure, position_bits: u8) -> Matching {
        follow(&self.cloud(&self.position), &target.cloud(), measure, position_bits)
    }

    /// How cells move, and which are stale.
    fn motion(
        &self,
        target: &Target,
        matching: &Matching,
        measure: &Measure,
        position_bits: u8,
    ) -> CellMotion {
        let mut pairs = Vec::new();
        let mut unmatched = Vec::new();
        for (&from, partner) in self.from.iter().zip(&matching.target_of) {
            match *partner {
                Some(place) => {
                    let to = target.position.each_ref().map(|plane| plane[place as usize]);
                    pairs.push(Pair { from, to });
                }
                None => unmatched.push(from),
            }
        }
        let motion = cell_motion(&pairs, &unmatched, position_bits);
        let mut displaced = [const { Vec::new() }; 3];
        for &from in &self.from {
            let to = motion.displaced(from);
            displaced.iter_mut().zip(to).for_each(|(plane, value): (&mut Vec<f32>, f32)| plane.push(value));
        }
        let held = Held { carried: self.cloud(&displaced), from: &self.from, matching };
        let stale = stale_cells(&motion, &held, &target.cloud(), measure);
        motion.with_stale(&stale)
    }
}

/// What a predicted frame is made from.
pub(crate) struct Predicted<'a> {
    pub(crate) coder: UnitCoder<'a>,
    pub(crate) reference: &'a Reference,
    pub(crate) target: &'a Target,
    pub(crate) matching: Matching,
    pub(crate) survivors: Survivors<'a>,
    pub(crate) measure: Measure,
    pub(crate) tools: Tools,
    /// Whether the steps of the last home are doubled, as in intra frames.
    pub(crate) coarse_tail: bool,
    pub(crate) number: u32,
}

/// A unit while its frame is being coded.
pub(crate) struct Made {
    draft: Draft,
    home: Home,
    /// The new Gaussians of the home.
    added: QuantizedFrame,
    rows: Vec<u32>,
    sections: Vec<splatstream_format::payload::SectionBytes>,
}

/// A unit before its sections are coded.
pub(crate) struct Drafted {
    pub(crate) draft: Draft,
    pub(crate) applied: Applied,
    /// Places of its new Gaussians among those of the frame, in coded order.
    added: Vec<u32>,
}

impl Predicted<'_> {
    /// Codes the units of the frame.
    ///
    /// # Errors
    /// What the decoder's own checks refuse.
    pub(crate) fn code(
        &mut self,
        predictors: Chooser<'_>,
        goal: Option<&mut Goal>,
    ) -> Result<(Vec<CodedUnit>, Reference), Error> {
        let sequence = self.coder.sequence;
        let motion = self.cells()?;
        let (cells, cell_log2) = (self.cell_values(&motion), motion.cell_log2);
        let mut first = self.coder.blank();
        first.header.cell_count = motion.cells.len() as u32;
        first.header.cell_log2 = if motion.cells.is_empty() { 0 } else { cell_log2 };
        first.values.set(Section::Cells, cells);
        let field = Arc::new(field(&self.coder.unit(&first), rotation_unit(sequence.rotation_step))?);
        let displaced: Vec<Home> = self
            .reference
            .state
            .homes
            .iter()
            .map(|home| {
                let mut home = home.clone();
                home.displace(&field);
                home
            })
            .collect();
        self.let_go(&displaced);
        if let Some(goal) = goal {
            self.set_judge(goal, &first, &displaced)?;
        }
        let fresh = self.fresh(&displaced)?;
        let mut models = ModelsOfFrame::starting_with(self.reference.state.models.clone());
        let mut made: Vec<Made> = Vec::new();
        for (home, added) in fresh.of_home.iter().enumerate() {
            let draft = if home == 0 { first.clone() } else { self.coder.blank() };
            let unit = self.unit(home, draft, &displaced, &fresh, added, &made, predictors, &mut models)?;
            made.push(unit);
        }
        self.finish(made, field, models.first)
    }

    /// Parts the pairs whose Gaussian cannot be brought to its partner.
    fn let_go(&mut self, displaced: &[Home]) {
        let places = displaced.iter().flat_map(|home| (0..home.len()).map(move |row| (home, row)));
        for ((home, row), partner) in places.zip(&mut self.matching.target_of) {
            if partner.is_some_and(|place| self.survivors.is_out_of_reach(home, row, place)) {
                *partner = None;
            }
        }
    }

    fn cells(&self) -> Result<CellMotion, Error> {
        if !self.tools.cell_motion {
            return Ok(CellMotion { cell_log2: 0, cells: Vec::new(), bits: [0.0; 2] });
        }
        let cloud = ReferenceCloud::new(self.reference, self.coder.sequence);
        let bits = self.coder.sequence.position_bits;
        let mut motion = cloud.motion(self.target, &self.matching, &self.measure, bits);
        // What differs more from cell to cell, no token codes.
        motion.cells.retain(|cell| cell.translation.iter().all(|part| part.abs() <= MOST_TRANSLATION));
        Ok(motion)
    }

    fn cell_values(&self, motion: &CellMotion) -> SectionValues {
        let block = 1 << self.coder.sequence.block_log2;
        let codes: Vec<u64> = motion.cells.iter().map(|cell| cell.code).collect();
        let stale = motion.cells.iter().map(|cell| i32::from(cell.stale)).collect();
        let mut planes = vec![stale];
        for part in 0..6_usize {
            let of = |place: usize| {
                let cell = &motion.cells[place];
                if part < 3 { cell.translation[part] } else { cell.turn[part - 3] }
            };
            let difference =
                |place: usize| of(place) - if place.is_multiple_of(block) { 0 } else { of(place - 1) };
            planes.push((0..codes.len()).map(difference).collect());
        }
        SectionValues { deltas: deltas(&codes, block), planes, block }
    }

    /// The Gaussians that continue none, on the lattices, and the homes they go to.
    pub(crate) fn fresh(&self, displaced: &[Home]) -> Result<Fresh, Error> {
        let mut places = self.matching.wanted(self.target.frame.len());
        if let Some(judge) = &self.survivors.judge {
            places.retain(|&place| judge.is_missed(place));
        }
        let frame = self.target.frame.select(&places);
        let survivors: Vec<usize> =
            (0..displaced.len()).map(|home| self.continued(displaced, home).count()).collect();
        let order = importance::order(&importance::opacity_volume(&frame));
        let total = (survivors.iter().sum::<usize>() + frame.len()) as u32;
        let sequence = self.coder.sequence;
        let mut of_home: Vec<Vec<u32>> = Vec::new();
        let mut rest = order.as_slice();
        for refinement in 0..sequence.refinement_count {
            let wanted = sequence.refinement_length(refinement, total) as usize;
            let last = refinement + 1 == sequence.refinement_count;
            let room = wanted.saturating_sub(survivors[usize::from(refinement)]);
            let (now, later) = rest.split_at(if last { rest.len() } else { room.min(rest.len()) });
            of_home.push(now.to_vec());
            rest = later;
        }
        let spacing = Spacing::default();
        let geometry = geometry(&frame, sequence, &spacing);
        let dc: Vec<&[f32]> = frame.dc().iter().map(Vec::as_slice).collect();
        let dc_components = colour::components(self.survivors.dc, &dc, sequence.dc_step(), &spacing);
        let zeros = vec![0.0; frame.len()];
        let planes = crate::stream::sh_planes(&frame, sequence, &zeros);
        let step = sequence.sh_step();
        let sh = match (self.coder.colour.mode, self.survivors.sh) {
            (ShCoding::Coefficients { .. }, Some(transform)) => {
                colour::components(transform, &planes, step, &spacing)
            }
            (ShCoding::VectorQuantised { .. }, Some(transform)) => {
                let rows = colour::sampled_rows(transform, &planes, step, 1);
                self.stages(&rows, usize::from(transform.header.rank))
            }
            _ => Vec::new(),
        };
        let dc = ColourTarget { planes: &dc, step: sequence.dc_step(), components: &dc_components };
        let sh = ColourTarget { planes: &planes, step, components: &sh };
        let wanted = Wanted::new(&geometry, &dc, &sh, &self.coder.colour, &spacing)?;
        Ok(Fresh { places, wanted, of_home })
    }

    /// Codebook indices of whole SH values: the nearest entry, and what refines it.
    fn stages(&self, rows: &[f32], rank: usize) -> Vec<Vec<i32>> {
        let [Some(whole), Some(residual), ..] = self.coder.colour.codebooks else { return Vec::new() };
        let pair = |row: &[f32]| {
            let first = vq::nearest_entry(whole, row);
            let entry = whole.entries[first as usize * rank..].iter();
            let left: Vec<f32> =
                row.iter().zip(entry).map(|(part, &value)| part - f32::from(value)).collect();
            (first, vq::nearest_entry(residual, &left))
        };
        let (first, second) = rows.par_chunks_exact(rank.max(1)).map(pair).unzip();
        vec![first, second]
    }

    /// The places of a home's Gaussians among those of all homes.
    fn places(displaced: &[Home], home: usize) -> Range<usize> {
        let start = displaced[..home].iter().map(Home::len).sum();
        start..start + displaced[home].len()
    }

    /// Gaussians of a home that continue, and their partners.
    fn continued(&self, displaced: &[Home], home: usize) -> impl Iterator<Item = (usize, Option<u32>)> {
        let places = Self::places(displaced, home);
        let partners = places.clone().zip(self.matching.target_of[places].iter().copied());
        partners.filter(|&(from, partner)| self.survivors.goes_on(from, partner))
    }

    #[expect(clippy::too_many_arguments, reason = "what a unit depends on")]
    fn unit(
        &self,
        home: usize,
        draft: Draft,
        displaced: &[Home],
        fresh: &Fresh,
        added: &[u32],
        made: &[Made],
        predictors: Chooser<'_>,
        models: &mut ModelsOfFrame,
    ) -> Result<Made, Error> {
        let refinement = home as u8;
        let mut in_force = models.before(refinement).clone();
        let Drafted { draft, applied, added } =
            self.drafted(home, draft, displaced, fresh, added, made, predictors, &in_force)?;
        let sections = self.coder.sections(&draft, &mut in_force)?;
        models.follow(refinement, in_force);
        let continued = self
            .continued(displaced, home)
            .map(|(_, partner)| partner.map_or(NO_ROW, |place| self.target.rows[place as usize]));
        let new = added.iter().map(|&place| self.target.rows[fresh.places[place as usize] as usize]);
        let rows = continued.chain(new).collect();
        Ok(Made { draft, home: applied.home, added: applied.added, rows, sections })
    }

    /// A unit and what a decoder makes of it.
    #[expect(clippy::too_many_arguments, reason = "what a unit depends on")]
    pub(crate) fn drafted(
        &self,
        home: usize,
        mut draft: Draft,
        displaced: &[Home],
        fresh: &Fresh,
        added: &[u32],
        made: &[Made],
        predictors: Chooser<'_>,
        models: &ModelsInForce,
    ) -> Result<Drafted, Error> {
        let parents = &displaced[home];
        let places = Self::places(displaced, home);
        let start = places.start;
        let partners = &self.matching.target_of[places];
        let last = home + 1 == displaced.len();
        let coarse = last && self.coarse_tail && displaced.len() > 1;
        let fates = self.survivors.fates(parents, start, partners, coarse);
        self.set_fates(&mut draft, &fates);
        let mut added = added.to_vec();
        let wanted = self.coder.place_new(&mut draft, &fresh.wanted, &mut added);
        let lower: Vec<&QuantizedFrame> = displaced[..home].iter().map(|home| &home.planes).collect();
        let anchor = self.reference.state.anchor.iter().skip(home + 1).map(|home| &home.planes);
        let behind: Vec<&QuantizedFrame> = anchor.chain(made.iter().map(|made| &made.added)).collect();
        let situation = Situation { around: [&lower, &behind], parents_follow: false };
        let applied =
            predictors.choose(&self.coder, &mut draft, parents.clone(), &situation, &wanted, models)?;
        Ok(Drafted { draft, applied, added })
    }

    fn set_fates(&self, draft: &mut Draft, fates: &[Fate]) {
        let block = 1 << self.coder.sequence.block_log2;
        let section = |planes| SectionValues { deltas: Vec::new(), planes, block };
        let count = |holds: &dyn Fn(i32) -> bool| fates.iter().filter(|fate| holds(fate.mode)).count() as u32;
        let header = &mut draft.header;
        header.parent_count = fates.len() as u32;
        header.move_count = count(&|mode| mode & 1 != 0);
        header.update_count = count(&|mode| mode & 2 != 0);
        header.remove_count = count(&|mode| mode == 4);
        draft.values.set(Section::Modes, section(vec![fates.iter().map(|fate| fate.mode).collect()]));
        let moved = |axis: usize| {
            fates.iter().filter(|fate| fate.mode & 1 != 0).map(|fate| fate.moved[axis]).collect()
        };
        draft.values.set(Section::Moves, section([0, 1, 2].map(moved).to_vec()));
        let width = fates.iter().map(|fate| fate.updated.len()).max().unwrap_or(0);
        let updated = |plane: usize| {
            fates.iter().filter(|fate| fate.mode & 2 != 0).map(|fate| fate.updated[plane]).collect()
        };
        draft.values.set(Section::Updates, section((0..width).map(updated).collect()));
    }

    /// Digests of what each refinement shows, and the payloads.
    fn finish(
        &self,
        made: Vec<Made>,
        field: Arc<CellField>,
        models: ModelsInForce,
    ) -> Result<(Vec<CodedUnit>, Reference), Error> {
        let before = &self.reference.state;
        let carried: Vec<Home> =
            before.carried.iter().flatten().map(|home| home.clone().carried(&field)).collect();
        let digest = |home: &Home| unit_digest(&home.planes, 0..home.len());
        let carried_digests: Vec<UnitDigest> = carried.iter().map(digest).collect();
        let mut digests: Vec<UnitDigest> = Vec::new();
        let mut units = Vec::new();
        let mut homes = Vec::new();
        let mut rows = Vec::new();
        for (place, unit) in made.into_iter().enumerate() {
            digests.push(digest(&unit.home));
            let mut header = unit.draft.header;
            header.refinement_digest = frame_digest(&digests);
            header.carried_digest = frame_digest(carried_digests.get(place + 1..).unwrap_or_default());
            units.push(CodedUnit {
                spatial_layer: self.coder.sequence.spatial_layer_count - 1,
                refinement: place as u8,
                payload: self.coder.payload(&header, &unit.sections)?,
                header,
                predicted: used(&unit.draft),
            });
            homes.push(unit.home);
            rows.push(unit.rows);
        }
        let mut fields = before.fields.clone();
        fields.push(field);
        let anchor = Arc::clone(&before.anchor);
        let carried = carried.into_iter().map(Some).collect();
        let (number, compensation) = (self.number, Compensation::default());
        let state = FrameState { number, homes, anchor, fields, carried, compensation, models };
        Ok((units, Reference { state, rows, row_count: self.target.row_count }))
    }
}

/// New Gaussians of a frame.
pub(crate) struct Fresh {
    /// Their places in the target.
    places: Vec<u32>,
    wanted: Wanted,
    /// For each home those it gets, as places among the new ones.
    pub(crate) of_home: Vec<Vec<u32>>,
}
