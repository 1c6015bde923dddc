//! What operating points cost and show, from the headers of units alone.
//!
//! Every unit is added once to sums by layer and refinement; what a point costs is the sum over all units that belong to
//! it. A list of Gaussians that a unit of a higher spatial layer replaces is shown only below that layer, so that sums are
//! kept for each highest spatial layer.

use super::OperatingPoint;
use splatstream_format::follower::Follower;
use splatstream_format::payload::OperatingPoints;
use splatstream_format::syntax::{
    FrameRole, IncrementHeader, OperatingPointEntry, OperatingPointsHeader, Profile, SequenceParameters,
    UnitHeader, UnitType,
};
use splatstream_format::unit::{Stream, Unit};
use splatstream_format::{Error, ErrorKind, Limits, Result};

/// What an operating point costs and shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OperatingPointInfo {
    /// The operating point.
    pub point: OperatingPoint,
    /// Bytes of the units of its frames and GOPs, headers included.
    pub bytes: u64,
    /// Exact Gaussians that are output, over all frames.
    pub gaussians: u64,
    /// Frames that are output.
    pub frames: u32,
    /// Share of the Gaussians of a frame up to its refinement, percent.
    pub percent: u8,
}

/// Sums by highest spatial layer, temporal layer and refinement.
type Sums = [[[u64; 10]; 4]; 4];

/// A frame whose units are being added.
#[derive(Debug, Clone, Copy)]
struct TalliedFrame {
    index: u32,
    role: FrameRole,
    /// Units of lists from this one on are discarded.
    limit: u8,
    /// Units of each spatial layer, and Gaussians of each list at the highest layer that has it.
    counts: [u8; 4],
    sizes: [u32; 10],
}

/// The sums of a stream.
#[derive(Debug, Clone)]
pub struct Tally {
    follower: Follower,
    bytes: Sums,
    gaussians: Sums,
    /// Frames of each temporal layer.
    frames: [u32; 4],
    frame: Option<TalliedFrame>,
    /// Display index and level of the last frame of each temporal layer.
    levels: [Option<(u32, u8)>; 4],
}

impl Tally {
    /// For a stream of a profile.
    pub const fn new(profile: Profile) -> Self {
        Self {
            follower: Follower::new(profile),
            bytes: [[[0; 10]; 4]; 4],
            gaussians: [[[0; 10]; 4]; 4],
            frames: [0; 4],
            frame: None,
            levels: [None; 4],
        }
    }

    /// Of the same sequence, without any unit.
    pub(crate) fn restarted(&self) -> Self {
        Self { follower: self.follower.restarted(), ..Self::new(self.follower.profile()) }
    }

    /// Whether a unit, which need not be counted, belongs to an operating point.
    pub(crate) fn takes(&self, point: OperatingPoint, header: &UnitHeader) -> bool {
        point.takes(header, self.follower.whole_anchor_layers(header))
    }

    /// Takes note of a unit.
    pub fn unit(&mut self, unit: &Unit<'_>) {
        self.follower.follow(unit);
        let header = &unit.header;
        match header.unit_type() {
            UnitType::FrameHeader => self.begin_frame(header),
            UnitType::Increment => self.increment(unit),
            UnitType::GopHeader => (self.frame, self.levels) = (None, [None; 4]),
            UnitType::Transform | UnitType::Codebook | UnitType::Weights => {}
            _ => return,
        }
        let length = UnitHeader::SIZE.saturating_add(unit.payload.len());
        let whole = self.follower.whole_anchor_layers(header);
        add(&mut self.bytes, header, header.spatial_layer..4, whole, size(length), u64::saturating_add);
    }

    fn begin_frame(&mut self, header: &UnitHeader) {
        self.store_level();
        let (Some(sequence), Some(&(gop, first))) = (self.follower.sequence(), self.follower.gop()) else {
            return;
        };
        let role = gop.role(header.frame.saturating_sub(first));
        let reference = role.reference.map(|reference| first.saturating_add(reference));
        let level_of = |reference: u32| {
            let known = self.levels.iter().flatten().find(|(index, _)| *index == reference);
            known.map_or(0, |(_, level)| *level)
        };
        let limit = reference.map_or(sequence.refinement_count, level_of);
        let index = header.frame;
        self.frame = Some(TalliedFrame { index, role, limit, counts: [0; 4], sizes: [0; 10] });
        if let Some(frames) = self.frames.get_mut(usize::from(header.temporal_layer)) {
            *frames = frames.saturating_add(1);
        }
    }

    /// Keeps the level of the frame that ends.
    fn store_level(&mut self) {
        let (Some(frame), Some(sequence)) = (self.frame.take(), self.follower.sequence()) else { return };
        let layers = usize::from(sequence.spatial_layer_count);
        let complete = frame.counts.iter().take(layers).all(|&count| count == sequence.refinement_count);
        let count = frame.counts.get(layers.saturating_sub(1)).copied().unwrap_or(0);
        let is_whole = sequence.whole_anchor() && frame.role.reference.is_none();
        let level = if is_whole && !complete { 0 } else { count };
        if let Some(slot) = self.levels.get_mut(usize::from(frame.role.temporal_layer)) {
            *slot = Some((frame.index, level));
        }
    }

    /// The Gaussians of a unit, if it is decoded: they replace those of the spatial layer below.
    fn increment(&mut self, unit: &Unit<'_>) {
        let header = &unit.header;
        let whole = self.follower.whole_anchor_layers(header);
        let (Some(frame), Some(sequence)) = (&mut self.frame, self.follower.sequence()) else { return };
        let (layer, refinement) = (usize::from(header.spatial_layer), usize::from(header.refinement));
        let (Some(count), Some(slot)) = (frame.counts.get_mut(layer), frame.sizes.get_mut(refinement)) else {
            return;
        };
        let is_next = header.refinement == *count && header.refinement < frame.limit;
        let profile = self.follower.profile();
        let parsed = IncrementHeader::parse(unit.payload, unit.payload_at, sequence, profile);
        let (true, true, Ok((increment, _))) = (is_next, header.frame == frame.index, parsed) else { return };
        *count = count.saturating_add(1);
        let before = core::mem::replace(slot, increment.list_size());
        let layers = header.spatial_layer..4;
        add(&mut self.gaussians, header, layers.clone(), whole, before.into(), u64::saturating_sub);
        add(&mut self.gaussians, header, layers, whole, increment.list_size().into(), u64::saturating_add);
    }

    /// Every operating point of the sequence, lowest first.
    pub fn points(&self) -> Vec<OperatingPoint> {
        self.follower.sequence().map(all_points).unwrap_or_default()
    }

    /// What a point costs and shows.
    pub fn info(&self, point: OperatingPoint) -> OperatingPointInfo {
        let layers = usize::from(point.temporal).saturating_add(1);
        let total = |sums: &Sums| {
            let of_layer = sums.get(usize::from(point.spatial.min(3))).into_iter().flatten().take(layers);
            let refinements = usize::from(point.refinement).saturating_add(1);
            of_layer.flat_map(|sums| sums.iter().take(refinements)).copied().fold(0, u64::saturating_add)
        };
        OperatingPointInfo {
            point,
            bytes: total(&self.bytes),
            gaussians: total(&self.gaussians),
            frames: self.frames.iter().take(layers).copied().fold(0, u32::saturating_add),
            percent: self.percent(point.refinement),
        }
    }

    fn percent(&self, refinement: u8) -> u8 {
        let percents = self.follower.sequence().map_or([0; 10], |sequence| sequence.refinement_percent);
        percents.get(usize::from(refinement)).copied().unwrap_or(100)
    }

    /// The list of every operating point.
    pub fn list(&self) -> OperatingPoints {
        let entry = |point: OperatingPoint| {
            let info = self.info(point);
            OperatingPointEntry {
                spatial_layer: point.spatial,
                temporal_layer: point.temporal,
                refinement: point.refinement,
                reserved_zero: 0,
                frame_count: info.frames,
                gaussian_count: info.gaussians,
                byte_count: info.bytes,
            }
        };
        OperatingPoints { entries: self.points().into_iter().map(entry).collect() }
    }

    /// 6.16: a list says what the units so far imply; `at` is the offset of its payload.
    ///
    /// # Errors
    /// Invalid otherwise.
    pub(crate) fn check(&self, points: &OperatingPoints, at: u64) -> Result<()> {
        let mut at = at.saturating_add(size(OperatingPointsHeader::SIZE));
        for entry in &points.entries {
            let (spatial, temporal, refinement) = entry.key();
            let info = self.info(OperatingPoint { spatial, temporal, refinement });
            let values = [
                ("frame_count", u64::from(entry.frame_count), u64::from(info.frames)),
                ("gaussian_count", entry.gaussian_count, info.gaussians),
                ("byte_count", entry.byte_count, info.bytes),
            ];
            for (element, value, expected) in values {
                if value != expected {
                    let at = at.saturating_add(size(OperatingPointEntry::TABLE.offset(element)));
                    return Err(Error::new(at, "6.16", ErrorKind::Mismatch { element, value, expected }));
                }
            }
            at = at.saturating_add(size(OperatingPointEntry::SIZE));
        }
        Ok(())
    }
}

/// Adds what a unit has to the sums of some highest spatial layers. A receiver of all spatial layers takes every
/// refinement of a whole anchor.
fn add(
    sums: &mut Sums,
    header: &UnitHeader,
    layers: core::ops::Range<u8>,
    whole: Option<u8>,
    value: u64,
    join: fn(u64, u64) -> u64,
) {
    for layer in layers {
        let has_all = whole.is_some_and(|count| layer.saturating_add(1) >= count);
        let refinement = if has_all { 0 } else { usize::from(header.refinement) };
        let of_layer = sums.get_mut(usize::from(layer));
        let of_layer = of_layer.and_then(|sums| sums.get_mut(usize::from(header.temporal_layer)));
        if let Some(sum) = of_layer.and_then(|sums| sums.get_mut(refinement)) {
            *sum = join(*sum, value);
        }
    }
}

/// Every operating point of a sequence, lowest first.
pub fn all_points(sequence: &SequenceParameters) -> Vec<OperatingPoint> {
    let mut points = Vec::new();
    for spatial in 0..sequence.spatial_layer_count {
        for temporal in 0..sequence.temporal_layer_count {
            points.extend((0..sequence.refinement_count).map(|refinement| OperatingPoint {
                spatial,
                temporal,
                refinement,
            }));
        }
    }
    points
}

fn size(bytes: usize) -> u64 {
    u64::try_from(bytes).unwrap_or(u64::MAX)
}

/// The operating points of a stream, lowest first, from its headers alone.
///
/// # Errors
/// What delimiting the units or reading sequence parameters finds.
pub fn operating_points(bytes: &[u8], limits: &Limits) -> Result<Vec<OperatingPointInfo>> {
    let stream = Stream::open(bytes, limits)?;
    let profile = stream.header().profile();
    let mut tally = Tally::new(profile);
    let mut units = stream.units();
    while let Some(unit) = units.next_unit() {
        let unit = unit?;
        unit.check_header(profile)?;
        match unit.header.unit_type() {
            // Decoders discard some of them, whose payload may be anything.
            UnitType::Increment => {}
            UnitType::SequenceParameters => {
                unit.check_payload()?;
                SequenceParameters::parse_payload(unit.payload, unit.payload_at, profile)?;
            }
            _ => unit.check_payload()?,
        }
        tally.unit(&unit);
    }
    Ok(tally.points().into_iter().map(|point| tally.info(point)).collect())
}
