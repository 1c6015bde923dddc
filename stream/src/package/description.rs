//! What the manifest says about the files of a package.

use super::segment::{Level, Subsegment};
use super::{Chunk, Clock, File, Options, Planned, bytes_of};
use crate::division::{Division, Gop, Tools};
use crate::manifest::{
    ByteRange, FrameInfo, GopInfo, LevelInfo, Manifest, Predictors, RepresentationInfo, StreamInfo,
    SubsegmentInfo, UnitCount, digest_of,
};
use crate::representation::Representation;
use splatstream_format::syntax::{FileHeader, FrameType, GopHeader, SPECIFICATION, SequenceParameters};

/// Collects what the files are.
pub(crate) struct Describer<'a> {
    stream: &'a [u8],
    division: &'a Division,
    options: &'a Options,
    representations: Vec<RepresentationInfo>,
    gops: Vec<GopInfo>,
}

/// A file as it grows.
#[derive(Default)]
struct Growing {
    chunks: Vec<Chunk>,
    at: u64,
}

impl Growing {
    /// Appends parts; where they are.
    fn add(&mut self, chunks: Vec<Chunk>, stream: &[u8]) -> ByteRange {
        let parts: Vec<&[u8]> = chunks.iter().map(|chunk| bytes_of(chunk, stream)).collect();
        let digest = digest_of(&parts);
        let size = parts.iter().map(|part| size(part.len())).fold(0, u64::saturating_add);
        let range = ByteRange { offset: self.at, size, digest };
        self.at = self.at.saturating_add(size);
        self.chunks.extend(chunks);
        range
    }

    /// Appends boxes, if there are any.
    fn boxes(&mut self, bytes: Vec<u8>) -> Option<ByteRange> {
        (!bytes.is_empty()).then(|| self.add(vec![Chunk::Boxes(bytes)], &[]))
    }
}

impl<'a> Describer<'a> {
    pub(crate) fn new(stream: &'a [u8], division: &'a Division, options: &'a Options) -> Self {
        let gops = division.gops.iter().map(GopInfo::of).collect();
        Self { stream, division, options, representations: Vec::new(), gops }
    }

    /// The file of a Representation, after those it depends on.
    pub(crate) fn file(&mut self, planned: Planned) -> File {
        let representation = planned.representation;
        let mut file = Growing::default();
        let init = file.add(vec![Chunk::Boxes(planned.init)], &[]);
        let index = file.boxes(planned.indices);
        let level_bandwidths = self.subsegments(representation, &planned.segments, &mut file);
        let tail = file.boxes(planned.tail);
        let own = level_bandwidths.iter().map(|rate| (*rate).max(1)).fold(0, u64::saturating_add);
        let before = self.representations.last().map_or(0, |last| last.bandwidth);
        let name = representation.file_name();
        self.representations.push(RepresentationInfo {
            id: representation.to_string(),
            file: name.clone(),
            frame_type: representation.frame_type().to_owned(),
            layer: representation.codes().1,
            depends_on: self.representations.iter().map(|earlier| earlier.id.clone()).collect(),
            bandwidth: before.saturating_add(own),
            level_bandwidths,
            frames: self.frames_of(representation),
            bytes: file.at,
            init,
            index,
            tail,
            tail_file: None,
        });
        File { name, chunks: file.chunks }
    }

    /// Appends the subsegments of each GOP; the largest rate of each level, bits per second.
    fn subsegments(
        &mut self,
        representation: Representation,
        segments: &[Vec<Subsegment>],
        file: &mut Growing,
    ) -> Vec<u64> {
        let sequence = &self.division.sequence;
        let clock = Clock::of(sequence);
        let mut rates = vec![0; sequence.refinement_count.into()];
        for ((gop, info), segments) in self.division.gops.iter().zip(&mut self.gops).zip(segments) {
            let ticks = clock.ticks(gop.header.gop_frame_count.into());
            let mut bytes = vec![0_u64; rates.len()];
            for subsegment in segments {
                let percents = &sequence.refinement_percent;
                let ranges = subsegment.levels.iter().map(|level| file.add(chunks(level), self.stream));
                let described = describe(subsegment, representation, gop, percents, ranges);
                for (sum, level) in bytes.iter_mut().zip(&described.levels) {
                    *sum = sum.saturating_add(level.bytes.size);
                }
                info.subsegments.push(described);
            }
            for (most, bytes) in rates.iter_mut().zip(bytes) {
                *most = (*most).max(clock.rate(bytes, ticks));
            }
        }
        rates
    }

    fn frames_of(&self, representation: Representation) -> u32 {
        let id = representation.to_string();
        let of_it = self.gops.iter().flat_map(|gop| &gop.subsegments).filter(|one| one.representation == id);
        of_it.map(|one| u32::try_from(one.frames.len()).unwrap_or(u32::MAX)).fold(0, u32::saturating_add)
    }

    /// The manifest of all files.
    pub(crate) fn manifest(self) -> Manifest {
        let stream = StreamInfo::of(&self.division.header, &self.division.sequence, self.gops.last());
        Manifest {
            format: Manifest::FORMAT.to_owned(),
            version: Manifest::VERSION,
            stream: StreamInfo {
                bytes: Some(size(self.stream.len())),
                digest: Some(digest_of(&[self.stream])),
                ..stream
            },
            layout: self.options.layout.name().to_owned(),
            live: None,
            representations: self.representations,
            gops: self.gops,
            quality: None,
        }
    }
}

impl GopInfo {
    /// A GOP, without its subsegments.
    pub(crate) fn of(gop: &Gop) -> Self {
        Self {
            index: gop.header.gop_index,
            first_frame: gop.first_frame,
            frame_count: gop.header.gop_frame_count,
            predicted: gop.header.is_predicted(),
            temporal_depth: gop.header.temporal_depth,
            growing: false,
            subsegments: Vec::new(),
        }
    }

    /// Display index after its last frame.
    pub(crate) fn end(&self) -> u64 {
        u64::from(self.first_frame).saturating_add(self.frame_count.into())
    }
}

impl StreamInfo {
    /// A stream up to a GOP, of which neither bytes nor digest are known.
    pub(crate) fn of(header: &FileHeader, sequence: &SequenceParameters, last: Option<&GopInfo>) -> Self {
        let clock = Clock::of(sequence);
        let refinements = sequence.refinement_percent.iter().take(sequence.refinement_count.into());
        Self {
            specification: SPECIFICATION.to_owned(),
            profile: header.profile,
            level: header.level,
            bytes: None,
            digest: None,
            frames: last.map_or(0, GopInfo::end),
            sh_degree: sequence.sh_degree,
            spatial_layers: sequence.spatial_layer_count,
            temporal_layers: sequence.temporal_layer_count,
            refinements: refinements.copied().collect(),
            whole_anchor: sequence.whole_anchor(),
            ticks_per_second: clock.timescale,
            ticks_per_frame: clock.frame_ticks,
        }
    }
}

/// A subsegment whose levels are these ranges of its file.
pub(crate) fn describe(
    subsegment: &Subsegment,
    representation: Representation,
    gop: &Gop,
    percents: &[u8],
    ranges: impl Iterator<Item = ByteRange>,
) -> SubsegmentInfo {
    let frames =
        subsegment.frames.iter().map(|&frame| FrameInfo::of(&gop.header, gop.first_frame, frame)).collect();
    let levels = subsegment.levels.iter().zip(percents).zip(ranges).zip(0_u8..);
    let levels = levels
        .map(|(((level, &percent), bytes), refinement)| level_info(refinement, percent, bytes, &level.tools));
    SubsegmentInfo {
        representation: representation.to_string(),
        file: None,
        frames,
        levels: levels.collect(),
    }
}

fn chunks(level: &Level) -> Vec<Chunk> {
    let parts = level.parts.iter().map(|part| {
        let index = |at| usize::try_from(at).unwrap_or(usize::MAX);
        Chunk::Stream(index(part.start)..index(part.end))
    });
    std::iter::once(Chunk::Boxes(level.header.clone())).chain(parts).collect()
}

impl FrameInfo {
    /// A frame of a GOP that starts with a display index.
    pub(crate) fn of(header: &GopHeader, first_frame: u32, frame: u32) -> Self {
        let role = header.role(frame.saturating_sub(first_frame));
        let name = match role.frame_type {
            FrameType::Intra => "I",
            FrameType::Predicted => "P",
            FrameType::Enhancement => "B",
        };
        Self {
            frame,
            frame_type: name.to_owned(),
            temporal_layer: role.temporal_layer,
            reference: role.reference.map(|reference| first_frame.saturating_add(reference)),
        }
    }
}

fn level_info(refinement: u8, percent: u8, bytes: ByteRange, tools: &Tools) -> LevelInfo {
    let units = Tools::TYPES.into_iter().zip(tools.units).filter(|(_, count)| *count > 0);
    LevelInfo {
        refinement,
        percent,
        bits_per_gaussian: bits_per_gaussian(bytes.size, tools.gaussians),
        bytes,
        gaussians: tools.gaussians,
        units: units.map(|(unit_type, count)| UnitCount { unit_type: unit_type.to_owned(), count }).collect(),
        predictors: Predictors {
            predicted: tools.predicted,
            neighbours: tools.neighbours,
            moves: tools.move_predictors,
            extrapolations: tools.extrapolations,
        },
    }
}

/// To a thousandth; none without Gaussians.
fn bits_per_gaussian(bytes: u64, gaussians: u64) -> Option<f64> {
    let thousandths = bytes.saturating_mul(8000).checked_div(gaussians)?;
    Some(f64::from(u32::try_from(thousandths).unwrap_or(u32::MAX)) / 1000.0)
}

fn size(bytes: usize) -> u64 {
    u64::try_from(bytes).unwrap_or(u64::MAX)
}
