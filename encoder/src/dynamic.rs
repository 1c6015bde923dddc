//! Streams of profile Dynamic: intra frames in spatial layers, predicted frames, temporal layers.

mod align;
mod anchor;
mod compensation;
mod judge;
pub(crate) mod learning;
mod predicted;
mod predictors;
mod price;
mod survivors;
mod unit;
mod wanted;
mod worth;

use crate::canonical::{canonicalise, visible};
use crate::colour;
use crate::error::Error;
use crate::importance::Ranking;
use crate::lattice::{Spacing, check_reach, geometry};
use crate::matching::{Cloud, Kind, Matching, Measure, shares_little, shares_much};
use crate::section::SectionPlan;
use crate::settings::{Fidelity, Importance, Preset, Settings, ShChoice, Structure};
use crate::source::FrameSource;
use crate::stream::{FrameReport, GopTools, Prepared, Progress, Report, UnitWriter, sh_planes};
use crate::vq;
use align::Namings;
use anchor::{AnchorTarget, code_anchor};
use compensation::Compensator;
use learning::Recorder;
use predicted::{Predicted, ReferenceCloud};
use predictors::Chooser;
use price::{Goal, Pictures};
use splatstream_decoder::colour::Colour;
use splatstream_decoder::frame_state::FrameState;
use splatstream_decoder::home::Home;
use splatstream_decoder::layout::ShCoding;
use splatstream_format::payload::{Codebook, Network};
use splatstream_format::syntax::{
    FrameHeader, FrameType, GopHeader, IncrementHeader, IndexEntry, PlaceInGop, SequenceParameters,
    UnitHeader, UnitId, UnitType,
};
use splatstream_scene::GaussianFrame;
use survivors::Survivors;
use unit::UnitCoder;
use wanted::{ColourTarget, Wanted};

/// Frames of a predicted GOP, at most (6.5).
const MOST_FRAMES: u32 = 1024;

/// Pairs on which coefficients and a codebook of SH residuals are compared, and on which the codebook is trained.
const TRIAL: usize = 1 << 13;

/// Entries of a codebook of SH residuals, at most: it is carried with each frame.
const RESIDUAL_ENTRIES: usize = 256;

/// Rows of the same Gaussian may differ by this many steps in attributes that motion leaves alone.
const SAME: f32 = 1.5;

/// A unit ready to be written.
pub(crate) struct CodedUnit {
    spatial_layer: u8,
    refinement: u8,
    header: IncrementHeader,
    payload: Vec<u8>,
    /// New Gaussians by predictor.
    predicted: [u64; 4],
}

/// A coded frame that others refer to.
pub(crate) struct Reference {
    state: FrameState,
    /// The row in its file of each Gaussian, home by home.
    rows: Vec<Vec<u32>>,
    /// Rows of the file.
    row_count: u32,
}

/// A frame to be coded.
pub(crate) struct Target {
    /// Canonical, without what is never seen.
    frame: GaussianFrame,
    /// Positions in lattice steps.
    position: [Vec<f32>; 3],
    rows: Vec<u32>,
    row_count: u32,
}

impl Target {
    fn cloud(&self) -> Cloud<'_> {
        Cloud {
            position: self.position.each_ref().map(Vec::as_slice),
            log_scale: self.frame.log_scale().each_ref().map(Vec::as_slice),
            opacity: self.frame.opacity_logit(),
            dc: self.frame.dc().each_ref().map(Vec::as_slice),
            row: &self.rows,
            row_count: self.row_count,
        }
    }
}

/// Codes frames one after the other.
pub(crate) struct Dynamic<'a, 'w> {
    pub(crate) source: &'a mut dyn FrameSource,
    pub(crate) settings: &'a Settings,
    pub(crate) sequence: SequenceParameters,
    pub(crate) ranking: &'a mut Ranking,
    pub(crate) writer: &'a mut UnitWriter<'w>,
    pub(crate) report: &'a mut Report,
    pub(crate) index: Vec<IndexEntry>,
    /// The network that the GOPs may use.
    pub(crate) network: Option<Network>,
    /// New Gaussians of a unit that it may predict.
    pub(crate) most_learned: u32,
    /// What a network is trained with, while that is being collected.
    pub(crate) recorder: Option<&'a Recorder>,
}

/// A GOP while its frames are being coded.
struct Gop {
    /// Display index of its first frame.
    first: u32,
    header: GopHeader,
    tools: GopTools,
    /// The last frame of each temporal layer and its number.
    references: Vec<Option<(u32, Reference)>>,
    /// The level of the price of a bit in pictures, of the last frame that had one.
    price_level: i32,
    /// The units after the GOP header.
    units: Vec<(UnitId, Vec<u8>)>,
    /// Whether a new Gaussian takes the network.
    has_learned: bool,
}

impl Dynamic<'_, '_> {
    /// Codes all frames.
    ///
    /// # Errors
    /// As [`encode`](crate::encode).
    pub(crate) fn run(&mut self, progress: Progress<'_>) -> Result<(), Error> {
        let mut first = 0;
        let frames = self.source.len();
        while first < frames && !self.recorder.is_some_and(Recorder::is_full) {
            first = self.gop(first, frames.min(first + self.settings.gop.min(MOST_FRAMES)), progress)?;
        }
        Ok(())
    }

    /// Temporal layers; 0 where no frame refers to another.
    fn layers(&self) -> u8 {
        match self.settings.structure {
            Structure::Intra => 0,
            Structure::Predicted { layers } => layers,
        }
    }

    fn chooser(&self) -> Chooser<'_> {
        Chooser {
            predictors: self.settings.predictors,
            choice: self.settings.predictor_choice,
            neighbours: self.settings.neighbours,
            recorder: self.recorder,
        }
    }

    fn measure(&self) -> Measure {
        Measure { position_step: self.sequence.position_step(), steps: self.settings.steps, same: SAME }
    }

    fn target(&mut self, number: u32) -> Result<Target, Error> {
        let frame = self.source.frame(number).map_err(|source| Error::Source { frame: number, source })?;
        let rows = visible(&frame, self.settings.keep_invisible);
        let row_count = frame.len() as u32;
        let frame = canonicalise(&frame, &rows, true);
        check_reach(&frame, &self.sequence, number)?;
        let step = self.sequence.position_step();
        let offset = self.sequence.position_offset();
        let position = [0, 1, 2].map(|axis: usize| {
            frame.position()[axis].iter().map(|&value| (value - offset[axis]) / step).collect()
        });
        Ok(Target { frame, position, rows, row_count })
    }

    /// Codes a GOP of the frames from `first` up to `last` at most, and gives the frame after it: it ends where a
    /// frame shares little with the one it would refer to.
    fn gop(&mut self, first: u32, last: u32, progress: Progress<'_>) -> Result<u32, Error> {
        let target = self.target(first)?;
        let tools = self.tools(&target, last - first);
        let mut gop = Gop {
            first,
            header: self.header(last - first),
            units: tools.units(&self.sequence, first)?,
            tools,
            references: (0..self.layers().max(1)).map(|_| None).collect(),
            has_learned: false,
            price_level: 0,
        };
        if first == 0 {
            gop.tools.report(self.report);
        }
        self.intra(&mut gop, first, target)?;
        let mut end = first + 1;
        progress(end, self.source.len());
        while end < last {
            let target = self.target(end)?;
            let place = gop.header.place(end - first);
            match place.reference {
                None => self.intra(&mut gop, end, target)?,
                Some(reference) => {
                    if !self.predicted(&mut gop, end, &place, first + reference, &target)? {
                        break;
                    }
                }
            }
            end += 1;
            progress(end, self.source.len());
        }
        let header = self.header(end - first);
        self.index.push(IndexEntry { frame: first, reserved_zero: 0, offset: self.writer.offset });
        self.writer.unit(UnitId::of_frame(UnitType::GopHeader, first), &header.to_bytes()?)?;
        if let Some(network) = self.network.as_ref().filter(|_| gop.has_learned) {
            let id = UnitId::of_frame(UnitType::Weights, first);
            self.writer.unit(id, &learning::weights(network)?.to_bytes()?)?;
        }
        gop.units.iter().try_for_each(|(id, payload)| self.writer.unit(*id, payload))?;
        Ok(end)
    }

    /// The header of a GOP of some frames.
    fn header(&self, frames: u32) -> GopHeader {
        let gop_index = self.index.len() as u32;
        match self.layers() {
            0 => GopHeader::intra(gop_index, frames),
            layers => GopHeader::predicted(gop_index, frames, layers - 1),
        }
    }

    /// Transforms and codebooks, made for the first frame.
    fn tools(&self, target: &Target, frames: u32) -> GopTools {
        let prepared =
            Prepared { frame: target.frame.clone(), order: Vec::new(), spacing: Spacing::default() };
        let mut tools = GopTools::new(&prepared, &self.sequence, self.settings, frames);
        tools.keep_zero();
        tools
    }

    fn intra(&mut self, gop: &mut Gop, number: u32, target: Target) -> Result<(), Error> {
        let order = self.ranking.order(&target.frame);
        let spacing = self.ranking.spacing(&order, self.settings);
        let geometry = geometry(&target.frame, &self.sequence, &spacing);
        let dc: Vec<&[f32]> = target.frame.dc().iter().map(Vec::as_slice).collect();
        let dc_step = self.sequence.dc_step();
        let dc_components = colour::components(&gop.tools.dc, &dc, dc_step, &spacing);
        let zeros = vec![0.0; target.frame.len()];
        let planes = sh_planes(&target.frame, &self.sequence, &zeros);
        let step = self.sequence.sh_step();
        let sh =
            gop.tools.sh.as_ref().map_or_else(Vec::new, |(transform, plan)| match plan.codebooks.first() {
                None => colour::components(transform, &planes, step, &spacing),
                Some(book) => vec![colour::indices(transform, &planes, step, book)],
            });
        let coder = self.coder(gop, None);
        let dc = ColourTarget { planes: &dc, step: dc_step, components: &dc_components };
        let sh = ColourTarget { planes: &planes, step, components: &sh };
        let wanted = Wanted::new(&geometry, &dc, &sh, &coder.colour, &spacing)?;
        let compensator = self.compensator(&target.frame);
        let anchor = AnchorTarget {
            number,
            compensator: compensator.as_ref(),
            predicted: self.layers() > 0,
            wanted: &wanted,
            order: &order,
            rows: &target.rows,
            row_count: target.row_count,
        };
        let (units, reference) = code_anchor(&coder, &anchor, self.chooser())?;
        let place = PlaceInGop { frame_type: FrameType::Intra, temporal_layer: 0, reference: None };
        self.write_frame(gop, number, &place, target.frame.len(), &target, &units)?;
        gop.keep(0, number, reference);
        Ok(())
    }

    /// Codes a frame that refers to another; false, and nothing done, if it shares too little with it.
    fn predicted(
        &mut self,
        gop: &mut Gop,
        number: u32,
        place: &PlaceInGop,
        reference: u32,
        target: &Target,
    ) -> Result<bool, Error> {
        let found = gop.references.iter().flatten().find(|(number, _)| *number == reference);
        let Some((_, reference)) = found else { return Ok(false) };
        let measure = self.measure();
        let cloud = ReferenceCloud::new(reference, &self.sequence);
        let mut matching = cloud.matching(target, &measure, self.sequence.position_bits);
        // Who goes by pictures has a use for partners that differ a lot.
        let useful = self.by_pictures() && shares_much(&matching);
        if shares_little(&matching) && !useful && !target.frame.is_empty() {
            return Ok(false);
        }
        if !self.settings.tools.survivors {
            matching.target_of.iter_mut().for_each(|partner| *partner = None);
        }
        let mut goal = self.goal(gop, &matching, target);
        let mut survivors = Survivors {
            target,
            sequence: &self.sequence,
            steps: &self.settings.steps,
            dc: &gop.tools.dc,
            sh: gop.tools.sh.as_ref().map(|(transform, _)| transform),
            namings: Namings::new(),
            judge: None,
            book: None,
        };
        let book = self.residual_book(gop, &survivors, reference, &matching, place.temporal_layer);
        survivors.book = book.as_ref();
        let by_pictures = self.ranking.importance() != Importance::Volume;
        let mut predicted = Predicted {
            coder: self.coder(gop, Some(book.as_ref())),
            reference,
            target,
            matching,
            survivors,
            measure,
            tools: self.settings.tools,
            coarse_tail: self.settings.tools.coarse_tail && by_pictures,
            number,
        };
        let (units, coded) = predicted.code(self.chooser(), goal.as_mut())?;
        if let Some(book) = &book {
            let id = UnitId::of_frame(UnitType::Codebook, gop.first).on_layers(0, place.temporal_layer);
            gop.units.push((id, book.to_bytes()?));
        }
        let gaussians = coded.state.homes.iter().map(Home::len).sum();
        self.write_frame(gop, number, place, gaussians, target, &units)?;
        if let (Some(goal), Some(frame)) = (goal, self.report.coded.last_mut()) {
            gop.price_level = goal.level;
            frame.by_pictures = true;
        }
        if place.temporal_layer + 1 < self.layers().max(2) {
            gop.keep(place.temporal_layer, number, coded);
        }
        Ok(true)
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

    /// Prefixes of intra frames are compensated where time is no matter and they are shown at all: in a predicted GOP
    /// who has all spatial layers has the whole frame.
    fn compensator(&self, frame: &GaussianFrame) -> Option<Compensator> {
        let judged = self.settings.preset != Preset::Fast && self.sequence.refinement_count > 1;
        (judged && !frame.is_empty()).then(|| Compensator::new(frame))
    }

    /// The codebook of the SH residuals of a frame, where a codebook serves them better than coefficients. Only a
    /// GOP whose intra frames have codebooks has them: a new Gaussian takes an entry of each.
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
        let rows = survivors.sh_rows(&reference.state.homes, &matching.target_of, pairs / TRIAL);
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

    /// How the units of a frame are coded: an intra frame, or one with or without a codebook of SH residuals.
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
            network: self.network.as_ref(),
            most_learned: self.most_learned,
        }
    }

    fn write_frame(
        &mut self,
        gop: &mut Gop,
        number: u32,
        place: &PlaceInGop,
        gaussians: usize,
        target: &Target,
        units: &[CodedUnit],
    ) -> Result<(), Error> {
        let sh = gop.tools.sh.as_ref().map(|_| 0);
        let header = FrameHeader::new(place.frame_type, 0, sh, gaussians as u32);
        let top = self.sequence.spatial_layer_count - 1;
        let spatial = if place.reference.is_some() { top } else { 0 };
        let id = UnitId::of_frame(UnitType::FrameHeader, number).on_layers(spatial, place.temporal_layer);
        let start = gop.units.len();
        gop.units.push((id, header.to_bytes()?));
        let mut frame = FrameReport {
            frame_type: place.frame_type,
            gaussians: gaussians as u32,
            ..FrameReport::default()
        };
        for unit in units {
            let id = UnitId { refinement: unit.refinement, ..UnitId::of_frame(UnitType::Increment, number) };
            let id = id.on_layers(unit.spatial_layer, place.temporal_layer);
            gop.units.push((id, unit.payload.clone()));
            frame.add(&unit.header, unit.predicted);
            gop.has_learned |= unit.predicted[3] > 0;
        }
        let bytes = |(_, payload): &(UnitId, Vec<u8>)| (UnitHeader::SIZE + payload.len()) as u64;
        frame.bytes = gop.units[start..].iter().map(bytes).sum();
        self.report.invisible += u64::from(target.row_count) - target.frame.len() as u64;
        self.report.gaussians += gaussians as u64;
        self.report.coded.push(frame);
        self.report.digests.push(units.last().map_or(0, |unit| unit.header.refinement_digest));
        Ok(())
    }
}

impl Gop {
    fn keep(&mut self, layer: u8, number: u32, reference: Reference) {
        if !self.header.is_predicted() {
            return;
        }
        for (place, slot) in self.references.iter_mut().enumerate().skip(usize::from(layer)) {
            if place > usize::from(layer) {
                *slot = None;
            }
        }
        self.references[usize::from(layer)] = Some((number, reference));
    }
}
