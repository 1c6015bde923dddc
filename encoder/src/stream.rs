//! The second pass: units in their order, written as they are made.

use crate::allocation;
use crate::canonical::{canonicalise, visible};
use crate::colour::{self, ShPlan};
use crate::dynamic::{Dynamic, learning};
use crate::error::Error;
use crate::frame::{CodedFrame, UnitPlan, code_frame};
use crate::importance::Ranking;
use crate::lattice::{Spacing, check_reach, geometry};
use crate::pca::Components;
use crate::sequence::analyse;
use crate::settings::{Importance, Settings, Steps};
use crate::source::FrameSource;
use splatstream_decoder::block::UnitParameters;
use splatstream_decoder::colour::Colour;
use splatstream_decoder::layout::{Layout, ShCoding};
use splatstream_decoder::operating_point::Tally;
use splatstream_format::Limits;
use splatstream_format::payload::{Index, Transform};
use splatstream_format::syntax::{
    EndOfStream, FrameHeader, FrameType, GopHeader, IncrementHeader, IndexEntry, Profile, SequenceParameters,
    TransformKind, UnitHeader, UnitId, UnitType,
};
use splatstream_format::unit::{Unit, write_file_header, write_unit};
use splatstream_scene::GaussianFrame;
use std::io::Write;

/// Called after every frame with frames done and frames in all.
pub type Progress<'a> = &'a mut dyn FnMut(u32, u32);

/// What was written, what was chosen, and why.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Report {
    /// Bytes of the stream.
    pub bytes: u64,
    /// Frames.
    pub frames: u32,
    /// Gaussians coded, over all frames.
    pub gaussians: u64,
    /// Gaussians left out because they can never be seen.
    pub invisible: u64,
    /// SH degree of the source and of the stream.
    pub sh_degree: (u8, u8),
    /// Bits of a position on one axis.
    pub position_bits: u8,
    /// Size of a position cell, scene units.
    pub position_step: f32,
    /// Whether axes are sorted, and bits a Gaussian of scale and rotation if they are and if not.
    pub canonical_axes: (bool, [f64; 2]),
    /// Components of the sh transform in the first GOP.
    pub sh_rank: u8,
    /// Entries of the SH codebook in the first GOP; 0: coefficients.
    pub sh_codebook_entries: u32,
    /// Bits a Gaussian and mean squared error in steps, of coefficients and of codebooks, if compared.
    pub sh_trial: Option<[(f64, f64); 2]>,
    /// Quantiser steps.
    pub steps: Option<Steps>,
    /// What ordered the Gaussians.
    pub importance: Option<Importance>,
    /// Reconstruction digest of each frame, all refinements.
    pub digests: Vec<u64>,
    /// What each frame of a stream of profile Dynamic is made of.
    pub coded: Vec<FrameReport>,
}

/// What a frame of profile Dynamic is made of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameReport {
    /// How it is coded.
    pub frame_type: FrameType,
    /// Bytes of its units, headers included.
    pub bytes: u64,
    /// Gaussians of the frame.
    pub gaussians: u32,
    /// Cells that move or are stale.
    pub cells: u32,
    /// Parents: Gaussians of the reference, or of lower spatial layers.
    pub parents: u32,
    /// Parents with a position residual.
    pub moved: u32,
    /// Parents with attribute residuals.
    pub updated: u32,
    /// Parents that are removed.
    pub removed: u32,
    /// Gaussians that are new.
    pub new: u32,
    /// New Gaussians by predictor: none, knn, bilateral, transformer.
    pub predicted: [u64; 4],
    /// Whether it is true to its pictures, not to its attributes.
    pub by_pictures: bool,
}

impl Default for FrameReport {
    fn default() -> Self {
        Self {
            frame_type: FrameType::Intra,
            bytes: 0,
            gaussians: 0,
            cells: 0,
            parents: 0,
            moved: 0,
            updated: 0,
            removed: 0,
            new: 0,
            predicted: [0; 4],
            by_pictures: false,
        }
    }
}

impl FrameReport {
    /// Adds a unit.
    pub(crate) fn add(&mut self, header: &IncrementHeader, predicted: [u64; 4]) {
        self.cells += header.cell_count;
        self.parents += header.parent_count;
        self.moved += header.move_count;
        self.updated += header.update_count;
        self.removed += header.remove_count;
        self.new += header.new_count;
        self.predicted.iter_mut().zip(predicted).for_each(|(sum, count)| *sum += count);
    }
}

/// Encodes all frames of `source` to `sink`.
///
/// # Errors
/// Settings or frames that cannot be coded, a source that cannot be read, a sink that cannot be written.
pub fn encode(
    source: &mut dyn FrameSource,
    settings: &Settings,
    sink: &mut dyn Write,
    progress: Progress<'_>,
) -> Result<Report, Error> {
    let mut ranking = Ranking::new(settings);
    let fitted = fitted(source, settings, &mut ranking)?;
    let settings = &fitted;
    let analysis = analyse(source, settings)?;
    let sequence = analysis.parameters;
    let mut report = Report {
        steps: Some(settings.steps),
        importance: Some(ranking.importance()),
        frames: source.len(),
        sh_degree: (analysis.source_sh_degree, sequence.sh_degree),
        position_bits: sequence.position_bits,
        position_step: sequence.position_step(),
        canonical_axes: (sequence.canonical_axes(), analysis.axes_trial),
        ..Report::default()
    };
    let profile = settings.profile();
    let mut writer = UnitWriter::new(sink, profile);
    writer.bytes(&write_file_header(profile, analysis.level)?)?;
    writer.unit(UnitId::stream(UnitType::SequenceParameters), &sequence.to_bytes()?)?;
    let mut index = Vec::new();
    if profile == Profile::Dynamic {
        let most_learned = Limits::learned_of_level(analysis.level);
        let network = learning::network(source, settings, &sequence)?;
        let (ranking, writer) = (&mut ranking, &mut writer);
        let (report, recorder) = (&mut report, None);
        let mut dynamic = Dynamic {
            source,
            settings,
            sequence,
            ranking,
            writer,
            report,
            index,
            network,
            most_learned,
            recorder,
        };
        dynamic.run(progress)?;
        index = dynamic.index;
        let points = writer.tally.list().to_bytes()?;
        writer.unit(UnitId::stream(UnitType::OperatingPoints), &points)?;
        finish(writer, index, source.len())?;
        report.bytes = writer.offset;
        return Ok(core::mem::take(report));
    }
    for (gop_index, first) in (0..source.len()).step_by(settings.gop as usize).enumerate() {
        let last = source.len().min(first + settings.gop);
        index.push(IndexEntry { frame: first, reserved_zero: 0, offset: writer.offset });
        let gop = GopHeader::intra(gop_index as u32, last - first);
        writer.unit(UnitId::of_frame(UnitType::GopHeader, first), &gop.to_bytes()?)?;
        let mut tools = None;
        for number in first..last {
            let prepared = prepare(source, settings, &sequence, number, &mut ranking, &mut report)?;
            if tools.is_none() {
                let made = GopTools::new(&prepared, &sequence, settings, last - first);
                for (id, payload) in made.units(&sequence, first)? {
                    writer.unit(id, &payload)?;
                }
                if first == 0 {
                    made.report(&mut report);
                }
                tools = Some(made);
            }
            if let Some(tools) = &mut tools {
                write_frame(&mut writer, prepared, &sequence, tools, settings, number, &mut report)?;
            }
            progress(number + 1, source.len());
        }
    }
    finish(&mut writer, index, source.len())?;
    report.bytes = writer.offset;
    Ok(report)
}

/// The settings with steps that reach the quality asked for on the first frame.
fn fitted(
    source: &mut dyn FrameSource,
    settings: &Settings,
    ranking: &mut Ranking,
) -> Result<Settings, Error> {
    let mut settings = settings.clone();
    if let Some(decibels) = settings.psnr
        && !source.is_empty()
    {
        let first = source.frame(0).map_err(|source| Error::Source { frame: 0, source })?;
        let shown = visible(&first, settings.keep_invisible);
        let frame = canonicalise(&first, &shown, true);
        let order = ranking.foresee(&frame);
        let spacing = ranking.spacing(&order, &settings);
        settings.steps = allocation::fit(frame, spacing, &settings, decibels);
    }
    Ok(settings)
}

/// A frame in canonical form, and its Gaussians, most important first.
pub(crate) struct Prepared {
    pub(crate) frame: GaussianFrame,
    pub(crate) order: Vec<u32>,
    pub(crate) spacing: Spacing,
}

pub(crate) fn prepare(
    source: &mut dyn FrameSource,
    settings: &Settings,
    sequence: &SequenceParameters,
    number: u32,
    ranking: &mut Ranking,
    report: &mut Report,
) -> Result<Prepared, Error> {
    let frame = source.frame(number).map_err(|source| Error::Source { frame: number, source })?;
    let shown = visible(&frame, settings.keep_invisible);
    report.invisible += (frame.len() - shown.len()) as u64;
    report.gaussians += shown.len() as u64;
    let frame = canonicalise(&frame, &shown, sequence.canonical_axes());
    let order = ranking.order(&frame);
    let spacing = ranking.spacing(&order, settings);
    Ok(Prepared { frame, order, spacing })
}

/// What the frames of a GOP share.
pub(crate) struct GopTools {
    pub(crate) dc: Transform,
    pub(crate) sh: Option<(Transform, ShPlan)>,
    /// SH components of the first frame, which were needed to find the rank.
    first_components: Option<Vec<Vec<i32>>>,
}

/// The SH planes that the sequence carries; a frame of a lower degree has fewer.
pub(crate) fn sh_planes<'a>(
    frame: &'a GaussianFrame,
    sequence: &SequenceParameters,
    zeros: &'a [f32],
) -> Vec<&'a [f32]> {
    (0..usize::from(sequence.sh_dimension()))
        .map(|plane| frame.sh().get(plane).map_or(zeros, Vec::as_slice))
        .collect()
}

pub(crate) fn dc_planes(frame: &GaussianFrame) -> Vec<&[f32]> {
    frame.dc().iter().map(Vec::as_slice).collect()
}

impl GopTools {
    pub(crate) fn new(
        prepared: &Prepared,
        sequence: &SequenceParameters,
        settings: &Settings,
        frames: u32,
    ) -> Self {
        let Prepared { frame, spacing, .. } = prepared;
        let dc = Components::of(&dc_planes(frame));
        let dc = colour::transform(TransformKind::Dc, &dc, sequence.dc_step());
        let zeros = vec![0.0; frame.len()];
        let mut first_components = None;
        let sh = (sequence.sh_degree > 0).then(|| {
            let planes = sh_planes(frame, sequence, &zeros);
            let step = sequence.sh_step();
            let basis = match settings.tools.sh_transform {
                true => Components::of(&planes),
                false => Components::identity(planes.len()),
            };
            let mut transform = colour::transform(TransformKind::Sh, &basis, step);
            let mut components = colour::components(&transform, &planes, step, spacing);
            // What the first frame does not need, another may.
            if frames == 1 {
                colour::drop_unused(&mut transform, &mut components);
            }
            let gaussians = frame.len() * frames as usize;
            let plan = colour::plan_sh(&transform, &planes, step, gaussians, settings.sh, settings.preset);
            first_components = plan.codebooks.is_empty().then_some(components);
            (transform, plan)
        });
        Self { dc, sh, first_components }
    }

    /// The units that define them, for the GOP that starts with a frame.
    ///
    /// # Errors
    /// A transform or codebook that a decoder would refuse.
    pub(crate) fn units(
        &self,
        sequence: &SequenceParameters,
        frame: u32,
    ) -> Result<Vec<(UnitId, Vec<u8>)>, Error> {
        let transform_id = UnitId::of_frame(UnitType::Transform, frame);
        let mut units = vec![(transform_id, self.dc.to_bytes(sequence)?)];
        let Some((transform, plan)) = &self.sh else { return Ok(units) };
        units.push((transform_id, transform.to_bytes(sequence)?));
        for codebook in &plan.codebooks {
            units.push((UnitId::of_frame(UnitType::Codebook, frame), codebook.to_bytes()?));
        }
        Ok(units)
    }

    /// Tells how SH is coded.
    pub(crate) fn report(&self, report: &mut Report) {
        if let Some((transform, plan)) = &self.sh {
            report.sh_rank = transform.header.rank;
            report.sh_trial = plan.trial;
            report.sh_codebook_entries =
                plan.codebooks.first().map_or(0, |book| u32::from(book.header.entry_count_minus1) + 1);
        }
    }

    /// Makes entry 0 of every codebook zero, so that it can stand for "as before".
    pub(crate) fn keep_zero(&mut self) {
        if let Some((transform, plan)) = &mut self.sh {
            let rank = usize::from(transform.header.rank);
            for book in &mut plan.codebooks {
                book.entries[..rank].fill(0);
            }
        }
        self.first_components = None;
    }

    pub(crate) fn sh_coding(&self) -> ShCoding {
        match &self.sh {
            None => ShCoding::None,
            Some((transform, plan)) if plan.codebooks.is_empty() => {
                ShCoding::Coefficients { rank: transform.header.rank }
            }
            Some((_, plan)) => ShCoding::VectorQuantised { stages: plan.codebooks.len() as u8 },
        }
    }
}

fn write_frame(
    writer: &mut UnitWriter<'_>,
    prepared: Prepared,
    sequence: &SequenceParameters,
    tools: &mut GopTools,
    settings: &Settings,
    number: u32,
    report: &mut Report,
) -> Result<(), Error> {
    let count = prepared.frame.len() as u32;
    let coded = coded_frame(prepared, sequence, tools, number)?;
    let coding = tools.sh_coding();
    let layout = Layout::new(tools.dc.header.rank, coding);
    let codebooks = tools.sh.as_ref().map_or(&[][..], |(_, plan)| plan.codebooks.as_slice());
    let plan = UnitPlan {
        parameters: UnitParameters {
            position_bits: sequence.position_bits,
            position_shift: 0,
            canonical_axes: sequence.canonical_axes(),
            rotation_thresholds: sequence.rotation_threshold,
            lanes_log2: 0,
            layout: &layout,
            colour: Colour {
                dc: &tools.dc,
                sh: tools.sh.as_ref().map(|(transform, _)| transform),
                mode: coding,
                codebooks: [codebooks.first(), codebooks.get(1), codebooks.get(2), codebooks.get(3)],
            },
        },
        sh: coding.header(codebooks.iter().map(|book| book.header.codebook_id)),
        sequence,
        preset: settings.preset,
        tools: settings.tools,
    };
    let units = code_frame(&coded, &plan)?;
    report.digests.push(units.digest);
    let header = FrameHeader::intra(0, tools.sh.as_ref().map(|_| 0), count);
    writer.unit(UnitId::of_frame(UnitType::FrameHeader, number), &header.to_bytes()?)?;
    for (refinement, payload) in (0..).zip(&units.payloads) {
        writer.unit(UnitId::of_refinement(number, refinement), payload)?;
    }
    Ok(())
}

fn coded_frame(
    Prepared { frame, order, spacing }: Prepared,
    sequence: &SequenceParameters,
    tools: &mut GopTools,
    number: u32,
) -> Result<CodedFrame, Error> {
    check_reach(&frame, sequence, number)?;
    let zeros = vec![0.0; frame.len()];
    let first = tools.first_components.take();
    let sh = first.or_else(|| {
        let (transform, plan) = tools.sh.as_ref()?;
        let planes = sh_planes(&frame, sequence, &zeros);
        Some(match plan.codebooks.first() {
            None => colour::components(transform, &planes, sequence.sh_step(), &spacing),
            Some(book) => vec![colour::indices(transform, &planes, sequence.sh_step(), book)],
        })
    });
    Ok(CodedFrame {
        geometry: geometry(&frame, sequence, &spacing),
        dc: colour::components(&tools.dc, &dc_planes(&frame), sequence.dc_step(), &spacing),
        sh: sh.unwrap_or_default(),
        order,
    })
}

pub(crate) fn finish(writer: &mut UnitWriter<'_>, index: Vec<IndexEntry>, frames: u32) -> Result<(), Error> {
    let index_offset = writer.offset;
    writer.unit(UnitId::stream(UnitType::Index), &Index { entries: index }.to_bytes()?)?;
    let end = EndOfStream { frame_count: frames, unit_count: writer.units, index_offset };
    writer.unit(UnitId::stream(UnitType::End), &end.to_bytes()?)
}

/// Counts bytes and units on their way out.
pub(crate) struct UnitWriter<'a> {
    sink: &'a mut dyn Write,
    pub(crate) offset: u64,
    units: u32,
    /// What the units add to the operating points.
    pub(crate) tally: Tally,
}

impl<'a> UnitWriter<'a> {
    pub(crate) fn new(sink: &'a mut dyn Write, profile: Profile) -> Self {
        Self { sink, offset: 0, units: 0, tally: Tally::new(profile) }
    }

    fn bytes(&mut self, bytes: &[u8]) -> Result<(), Error> {
        self.sink.write_all(bytes)?;
        self.offset += bytes.len() as u64;
        Ok(())
    }

    pub(crate) fn unit(&mut self, id: UnitId, payload: &[u8]) -> Result<(), Error> {
        let mut unit = Vec::with_capacity(payload.len() + 20);
        write_unit(&mut unit, id, payload)?;
        self.units += 1;
        let (header, _) = UnitHeader::parse(&unit, 0, Profile::Dynamic)?;
        self.tally.unit(&Unit { at: 0, header, payload, payload_at: 0 });
        self.bytes(&unit)
    }
}
