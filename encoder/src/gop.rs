//! GOPs, frame by frame: I frames, and frames that refer to others.

use crate::canonical::{canonicalise, visible};
use crate::colour;
use crate::error::Error;
use crate::frame::cells::{CellPlan, ReferenceCloud};
use crate::frame::compensation::Compensator;
use crate::frame::intra::{IntraTarget, code_intra};
use crate::frame::learning::{self, Recorder};
use crate::frame::predicted::{Predicted, PredictedTarget};
use crate::frame::predictors::Chooser;
use crate::frame::price::{Goal, Pictures};
use crate::frame::survivors::Survivors;
use crate::frame::unit::UnitCoder;
use crate::frame::wanted::Wanted;
use crate::frame::{CodedFrame, Namings, Reference, Target};
use crate::gop_tools::GopTools;
use crate::grid::Spacing;
use crate::importance::Ranking;
use crate::matching::{Kind, Matching, Measure, shares_little, shares_much};
use crate::report::{FrameReport, Report};
use crate::section::SectionPlan;
use crate::settings::{Fidelity, Importance, Predictors, Preset, Settings, ShChoice};
use crate::source::FrameSource;
use crate::stream::Progress;
use crate::vq;
use crate::writer::UnitWriter;
use splatstream_decoder::colour::Colour;
use splatstream_decoder::layout::ShCoding;
use splatstream_decoder::list::GaussianList;
use splatstream_format::Limits;
use splatstream_format::payload::{Codebook, Network, write_frame};
use splatstream_format::syntax::{
    FrameHeader, FrameRole, FrameType, GopHeader, Profile, SequenceParameters, UnitHeader, UnitId, UnitType,
};

/// Frames of a predicted GOP, at most (6.5).
const MAX_FRAMES: u32 = 1024;

/// Pairs on which coefficients and a codebook of SH residuals are compared, and on which the codebook is trained.
const TRIAL: usize = 1 << 13;

/// Entries of a codebook of SH residuals, at most: it is carried with each frame.
const RESIDUAL_ENTRIES: usize = 256;

/// Rows of the same Gaussian may differ by this many steps in attributes that motion leaves alone.
const SAME: f32 = 1.5;

/// Codes the frames of a sequence one after the other.
pub(crate) struct SequenceCoder<'a, 'w> {
    pub(crate) source: &'a mut dyn FrameSource,
    pub(crate) settings: &'a Settings,
    pub(crate) sequence: SequenceParameters,
    pub(crate) ranking: &'a mut Ranking,
    pub(crate) writer: &'a mut UnitWriter<'w>,
    pub(crate) report: &'a mut Report,
    /// The network that the GOPs may use.
    pub(crate) network: Option<Network>,
    /// Those of the level of the stream.
    pub(crate) limits: Limits,
    /// What a network is trained with, while that is being collected.
    pub(crate) recorder: Option<&'a Recorder>,
}

/// An I frame to be coded.
struct Intra {
    target: Target,
    /// Its Gaussians, most important first, and which of them may be coarser.
    order: Vec<u32>,
    spacing: Spacing,
}

/// A GOP while its frames are being coded.
struct Gop {
    /// Display index of its first frame.
    first: u32,
    header: GopHeader,
    tools: GopTools,
    /// The last frame of each temporal layer and its number.
    references: Vec<Option<(u32, Reference)>>,
    /// The lists of the I frame, where new Gaussians of other frames may be predicted from all of them.
    anchor: Vec<GaussianList>,
    /// What fills the holes of the prefixes of the I frame, and so of all frames.
    compensation: Vec<(i8, i8)>,
    /// The level of the price of a bit in pictures, of the last frame that had one.
    price_level: i32,
    /// Units that are not written yet.
    units: Vec<(UnitId, Vec<u8>)>,
    /// Whether the header has been written.
    is_open: bool,
    /// Whether a new Gaussian takes the network.
    has_learned: bool,
}

impl SequenceCoder<'_, '_> {
    /// Codes all frames.
    ///
    /// # Errors
    /// As [`encode`](crate::encode).
    pub(crate) fn run(mut self, progress: Progress<'_>) -> Result<(), Error> {
        let most = if self.settings.temporal_layers() > 0 { MAX_FRAMES } else { u32::MAX };
        let length = self.settings.gop.min(most);
        let frames = self.source.len();
        let mut first = 0;
        while first < frames && !self.recorder.is_some_and(Recorder::is_full) {
            first = self.gop(first, frames.min(first.saturating_add(length)), progress)?;
        }
        Ok(())
    }

    /// Codes a GOP of the frames from `first` up to `last` at most, and gives the frame after it: it ends where a
    /// frame shares little with the one it would refer to.
    fn gop(&mut self, first: u32, last: u32, progress: Progress<'_>) -> Result<u32, Error> {
        let intra = self.intra_target(first)?;
        let mut gop = self.start(first, last - first, &intra)?;
        self.intra(&mut gop, first, intra)?;
        let mut end = first + 1;
        progress(end, self.source.len());
        while end < last {
            let role = gop.header.role(end - first);
            match role.reference {
                None => {
                    let intra = self.intra_target(end)?;
                    self.intra(&mut gop, end, intra)?;
                }
                Some(reference) => {
                    let target = self.target(end)?;
                    if !self.predicted(&mut gop, end, &role, first + reference, &target)? {
                        break;
                    }
                }
            }
            end += 1;
            progress(end, self.source.len());
        }
        gop.header = self.header(end - first);
        self.write(&mut gop)?;
        Ok(end)
    }

    /// A GOP of at most so many frames that starts with an I frame.
    fn start(&mut self, first: u32, frames: u32, intra: &Intra) -> Result<Gop, Error> {
        let frame = &intra.target.frame;
        let tools = GopTools::new(frame, &intra.spacing, &self.sequence, self.settings, frames);
        if first == 0 {
            tools.report(self.report);
        }
        Ok(Gop {
            first,
            header: self.header(frames),
            units: tools.units(&self.sequence, first)?,
            tools,
            references: (0..self.settings.temporal_layers()).map(|_| None).collect(),
            anchor: Vec::new(),
            compensation: Vec::new(),
            price_level: 0,
            is_open: false,
            has_learned: false,
        })
    }

    /// The header of a GOP of some frames.
    fn header(&self, frames: u32) -> GopHeader {
        let gop_index = self.writer.gops();
        match self.settings.temporal_layers() {
            0 => GopHeader::intra(gop_index, frames),
            layers => GopHeader::predicted(gop_index, frames, layers - 1),
        }
    }

    /// Writes what has been coded of a GOP. Its header and the network it needs are known then.
    fn write(&mut self, gop: &mut Gop) -> Result<(), Error> {
        if !gop.is_open {
            self.writer.gop(&gop.header, gop.first)?;
            if let Some(network) = self.network.as_ref().filter(|_| gop.has_learned) {
                let id = UnitId::of_frame(UnitType::Weights, gop.first);
                self.writer.unit(id, &learning::weights(network)?.to_bytes()?)?;
            }
            gop.is_open = true;
        }
        gop.units.drain(..).try_for_each(|(id, payload)| self.writer.unit(id, &payload))
    }

    /// A frame in canonical form.
    fn target(&mut self, number: u32) -> Result<Target, Error> {
        let frame = self.source.frame(number).map_err(|source| Error::Source { frame: number, source })?;
        let rows = visible(&frame, self.settings.keep_invisible);
        let row_count = frame.len() as u32;
        // Where frames are predicted axes are named as in the reference, and what a frame starts with is sorted.
        let sorts = self.sequence.canonical_axes() || self.settings.profile() == Profile::Dynamic;
        let frame = canonicalise(&frame, &rows, sorts);
        let step = self.sequence.position_step();
        let offset = self.sequence.position_offset();
        let position = [0, 1, 2].map(|axis: usize| {
            frame.position()[axis].iter().map(|&value| (value - offset[axis]) / step).collect()
        });
        Ok(Target { frame, position, rows, row_count })
    }

    fn intra_target(&mut self, number: u32) -> Result<Intra, Error> {
        let target = self.target(number)?;
        let order = self.ranking.order(&target.frame);
        let spacing = self.ranking.spacing(&order, self.settings);
        Ok(Intra { target, order, spacing })
    }

    /// Codes an I frame.
    fn intra(&mut self, gop: &mut Gop, number: u32, intra: Intra) -> Result<(), Error> {
        let Intra { target, order, spacing } = &intra;
        let known = gop.tools.take_components();
        let coder = self.coder(gop, None);
        let wanted = Wanted::new(&target.frame, spacing, known, &coder)?;
        let compensator = self.compensator(target);
        let is_predicted = gop.header.is_predicted();
        let coded = code_intra(
            &coder,
            &IntraTarget {
                chooser: self.chooser(),
                compensator: compensator.as_ref(),
                shows_top_prefixes: !(is_predicted && self.sequence.whole_anchor()),
                wanted: &wanted,
                order,
                rows: &target.rows,
                row_count: target.row_count,
            },
        )?;
        let role = FrameRole { frame_type: FrameType::Intra, temporal_layer: 0, reference: None };
        self.add(gop, number, &role, target, &coded)?;
        if is_predicted {
            gop.start_with(number, coded, self.sequence.whole_anchor());
        } else if self.network.is_none() {
            self.write(gop)?;
        }
        Ok(())
    }

    /// Codes a frame that refers to another; false, and nothing done, if it shares too little with it.
    fn predicted(
        &mut self,
        gop: &mut Gop,
        number: u32,
        role: &FrameRole,
        reference: u32,
        target: &Target,
    ) -> Result<bool, Error> {
        let found = gop.references.iter().flatten().find(|(number, _)| *number == reference);
        let Some((_, reference)) = found else { return Ok(false) };
        let measure = self.measure();
        let Some(matching) = self.matching(reference, target, &measure) else { return Ok(false) };
        let mut goal = self.goal(gop, &matching, target);
        let mut survivors = self.survivors(gop, target);
        let book = self.residual_book(gop, &survivors, reference, &matching, role.temporal_layer);
        survivors.book = book.as_ref();
        let cells = CellPlan {
            measure: &measure,
            marks_stale: self.sequence.whole_anchor(),
            max_cells: self.limits.max_cells,
        };
        let from = PredictedTarget {
            coder: self.coder(gop, Some(book.as_ref())),
            chooser: self.chooser(),
            reference,
            anchor: &gop.anchor,
            target,
            survivors,
            coarse_tail: self.settings.tools.coarse_tail && self.ranking.importance() != Importance::Volume,
            compensation: &gop.compensation,
        };
        let cells = Some(&cells).filter(|_| self.settings.tools.cell_motion);
        let coded = Predicted::new(from, cells, matching)?.code(goal.as_mut())?;
        if !self.is_within_limits(&coded) {
            return Ok(false);
        }
        if let Some(book) = &book {
            let id = UnitId::of_frame(UnitType::Codebook, gop.first).on_layers(0, role.temporal_layer);
            gop.units.push((id, book.to_bytes()?));
        }
        self.add(gop, number, role, target, &coded)?;
        if let (Some(goal), Some(frame)) = (goal, self.report.coded.last_mut()) {
            gop.price_level = goal.level;
            frame.by_pictures = true;
        }
        if role.temporal_layer + 1 < self.settings.temporal_layers().max(2) {
            gop.keep(role.temporal_layer, number, coded.reference);
        }
        Ok(true)
    }

    /// Which Gaussian of a frame continues each of a reference; none if they share too little.
    fn matching(&self, reference: &Reference, target: &Target, measure: &Measure) -> Option<Matching> {
        let cloud = ReferenceCloud::new(reference, &self.sequence);
        let mut matching = cloud.matching(target, measure, self.sequence.position_bits);
        // Who goes by pictures has a use for partners that differ a lot.
        let useful = self.by_pictures() && shares_much(&matching);
        if shares_little(&matching) && !useful && !target.frame.is_empty() {
            return None;
        }
        if !self.settings.tools.survivors {
            matching.target_of.iter_mut().for_each(|partner| *partner = None);
        }
        Some(matching)
    }

    /// Whether the level of the stream allows a frame: what stays although nothing continues it may make it larger than
    /// any of the source.
    fn is_within_limits(&self, coded: &CodedFrame) -> bool {
        let gaussians = coded.gaussians();
        let rate = self.sequence.gaussian_rate(gaussians);
        gaussians <= self.limits.max_gaussians && rate <= self.limits.max_gaussian_rate
    }

    /// What becomes of the Gaussians of a reference is found with this.
    fn survivors<'s>(&'s self, gop: &'s Gop, target: &'s Target) -> Survivors<'s> {
        Survivors {
            target,
            sequence: &self.sequence,
            steps: &self.settings.steps,
            dc: &gop.tools.dc,
            sh: gop.tools.sh.as_ref().map(|(transform, _)| transform),
            namings: Namings::new(),
            judge: None,
            book: None,
        }
    }

    fn measure(&self) -> Measure {
        Measure { position_step: self.sequence.position_step(), steps: self.settings.steps, same: SAME }
    }

    /// Whether frames of which no row keeps its meaning are true to their pictures. What a network is trained with is
    /// the same either way, and sooner found without them.
    fn by_pictures(&self) -> bool {
        let may = self.settings.tools.survivors && self.recorder.is_none();
        may && self.settings.fidelity() == Fidelity::Pictures
    }

    /// How good the pictures of a frame must be, if it is them that the frame is true to.
    fn goal(&mut self, gop: &Gop, matching: &Matching, target: &Target) -> Option<Goal> {
        if !self.by_pictures() || matching.kind != Kind::Untracked || target.frame.is_empty() {
            return None;
        }
        let cameras = self.ranking.cameras(&target.frame).to_vec();
        Some(Goal {
            pictures: Pictures::new(&target.frame, cameras),
            tolerance: f64::from(self.settings.tolerance),
            least: Vec::new(),
            level: gop.price_level,
        })
    }

    /// Prefixes of I frames are compensated where time is no matter: not in streams of one frame, or of frames that
    /// each stand for themselves, which are encoded quickly.
    fn compensator(&self, target: &Target) -> Option<Compensator> {
        let takes_time = self.settings.preset != Preset::Fast && self.settings.profile() == Profile::Dynamic;
        let has_prefixes = self.sequence.refinement_count > 1 && !target.frame.is_empty();
        (takes_time && has_prefixes).then(|| Compensator::new(&target.frame))
    }

    /// The codebook of the SH residuals of a frame, where a codebook serves them better than coefficients. Only a
    /// GOP whose I frame has a codebook has them: a new Gaussian takes an entry of each.
    fn residual_book(
        &self,
        gop: &Gop,
        survivors: &Survivors<'_>,
        reference: &Reference,
        matching: &Matching,
        temporal_layer: u8,
    ) -> Option<Codebook> {
        let (transform, plan) = gop.tools.sh.as_ref()?;
        plan.codebooks.first()?;
        let rank = usize::from(transform.header.rank);
        let pairs = matching.target_of.iter().flatten().count();
        let rows = survivors.sh_rows(&reference.lists, &matching.target_of, pairs / TRIAL);
        let forced = self.settings.sh == ShChoice::VectorQuantised;
        let entries = vq::entry_count(pairs, false).min(RESIDUAL_ENTRIES);
        if rows.len() < 4 * rank || !forced && !colour::compare(&rows, rank, pairs, entries).1 {
            return None;
        }
        let mut book = vq::train(&rows, rank, entries.min(rows.len() / rank));
        book.entries[..rank].fill(0);
        // Each temporal layer has a codebook of its own, which only its frames replace.
        book.header.codebook_id = 1 + temporal_layer;
        Some(book)
    }

    /// How new Gaussians are predicted.
    fn chooser(&self) -> Chooser<'_> {
        Chooser {
            predictors: match self.settings.profile() {
                Profile::Intra => Predictors::NONE,
                Profile::Dynamic => self.settings.predictors,
            },
            choice: self.settings.predictor_choice,
            neighbours: self.settings.neighbours,
            recorder: self.recorder,
        }
    }

    /// How the units of a frame are coded: an I frame, or one with or without a codebook of SH residuals.
    fn coder<'g>(&'g self, gop: &'g Gop, predicted: Option<Option<&'g Codebook>>) -> UnitCoder<'g> {
        let sh = gop.tools.sh.as_ref();
        let whole = sh.and_then(|(_, plan)| plan.codebooks.first());
        let residual = predicted.flatten();
        let coding = match (sh, predicted) {
            (Some((transform, _)), Some(None)) => ShCoding::Coefficients { rank: transform.header.rank },
            (Some(_), Some(Some(_))) => ShCoding::VectorQuantised { stages: 2 },
            _ => gop.tools.sh_coding(),
        };
        let books = match coding {
            ShCoding::VectorQuantised { .. } => [whole, residual, None, None],
            _ => [None; 4],
        };
        UnitCoder {
            sequence: &self.sequence,
            colour: Colour {
                dc: &gop.tools.dc,
                sh: sh.map(|(transform, _)| transform),
                mode: coding,
                codebooks: books,
            },
            sh: coding.header(books.iter().flatten().map(|book| book.header.codebook_id)),
            plan: SectionPlan {
                block_log2: self.sequence.block_log2,
                preset: self.settings.preset,
                tools: self.settings.tools,
            },
            intra: predicted.is_none(),
            has_differences: self.chooser().predictors != Predictors::NONE
                || self.sequence.spatial_layer_count > 1,
            network: self.network.as_ref(),
            max_learned: self.limits.max_learned,
        }
    }

    /// Adds the units of a coded frame to its GOP, and what they are to the report.
    fn add(
        &mut self,
        gop: &mut Gop,
        number: u32,
        role: &FrameRole,
        target: &Target,
        coded: &CodedFrame,
    ) -> Result<(), Error> {
        let gaussians = coded.gaussians();
        let sh = gop.tools.sh.as_ref().map(|_| 0);
        let header = FrameHeader::new(role.frame_type, 0, sh, gaussians);
        let payload = write_frame(&header, coded.carried_digest, coded.cells.as_ref(), &self.sequence)?;
        let cells = coded.cells.as_ref().map_or(0, |cells| cells.cell_count);
        let mut frame = FrameReport::new(role.frame_type, gaussians, cells);
        let start = gop.units.len();
        let id = UnitId::of_frame(UnitType::FrameHeader, number).on_layers(0, role.temporal_layer);
        gop.units.push((id, payload));
        for unit in &coded.units {
            let id = UnitId::of_increment(number, unit.refinement);
            gop.units.push((id.on_layers(unit.spatial_layer, role.temporal_layer), unit.payload.clone()));
            frame.add(&unit.header, unit.predicted);
            gop.has_learned |= unit.predicted[3] > 0;
        }
        let bytes = |(_, payload): &(UnitId, Vec<u8>)| (UnitHeader::SIZE + payload.len()) as u64;
        frame.bytes = gop.units[start..].iter().map(bytes).sum();
        self.report.invisible += u64::from(target.row_count) - target.frame.len() as u64;
        self.report.gaussians += u64::from(gaussians);
        self.report.coded.push(frame);
        self.report.digests.push(coded.units.last().map_or(0, |unit| unit.header.refinement_digest));
        Ok(())
    }
}

impl Gop {
    /// Keeps the I frame of a predicted GOP.
    fn start_with(&mut self, number: u32, coded: CodedFrame, whole_anchor: bool) {
        if whole_anchor {
            self.anchor.clone_from(&coded.reference.lists);
        } else {
            let top = coded.units.last().map_or(0, |unit| unit.spatial_layer);
            let highest = coded.units.iter().filter(|unit| unit.spatial_layer == top);
            let offsets = highest.map(|u| (u.header.compensation_log_scale, u.header.compensation_opacity));
            self.compensation = offsets.collect();
        }
        self.keep(0, number, coded.reference);
    }

    /// Keeps a frame that others refer to, and no frame of a higher temporal layer.
    fn keep(&mut self, layer: u8, number: u32, reference: Reference) {
        let layer = usize::from(layer);
        self.references.iter_mut().skip(layer).for_each(|slot| *slot = None);
        self.references[layer] = Some((number, reference));
    }
}
