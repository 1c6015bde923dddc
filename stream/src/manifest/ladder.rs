//! What the controller of a player sees of a manifest.

use super::{GopInfo, Manifest, QualityInfo, SubsegmentInfo};
use crate::control::ladder::{QualityRow, first_of_each, quality_of};
use crate::control::number::{real, size};
use crate::control::{Description, Ladder, LadderError, Layer, OperatingPoint, Piece, Representation};
use crate::representation::Representation as Kind;
use core::ops::Range;

/// What a frame that stands still costs in dB, where no picture of it was measured.
const STILL: f64 = 6.0;

/// PSNR in dB from which on nobody sees a difference.
const EXACT: f64 = 50.0;

impl Manifest {
    /// The same without layers above a spatial and a temporal one.
    #[must_use]
    pub fn up_to(mut self, (spatial, temporal): (u8, u8)) -> Self {
        let wanted = |id: &str| match layer(id) {
            Some(Layer::Spatial(layer)) => layer <= spatial,
            Some(Layer::Temporal(layer)) => layer <= temporal,
            None => false,
        };
        self.representations.retain(|one| wanted(&one.id));
        for gop in &mut self.gops {
            gop.subsegments.retain(|one| wanted(&one.representation));
        }
        self
    }

    /// The presentation as a controller plans it, without a GOP to which frames still come. Of Representations of predicted frames it is taken that they need all
    /// refinements of all spatial layers where `whole_anchor` says so, and the base and the temporal layers below otherwise.
    ///
    /// # Errors
    /// Those of [`Ladder`]: a manifest that was [parsed](Manifest::parse) has none.
    pub fn ladder(&self) -> Result<Ladder, LadderError> {
        let layers: Vec<Layer> = self.representations.iter().filter_map(|one| layer(&one.id)).collect();
        let whole = self.has_whole_anchors();
        let needs = |(index, layer): (usize, &Layer)| Representation {
            layer: *layer,
            needs: layers
                .iter()
                .take(index)
                .enumerate()
                .filter(|(_, other)| is_needed(layer, other, whole))
                .map(|(other, _)| other)
                .collect(),
        };
        let mut ladder = Ladder::new(layers.iter().enumerate().map(needs).collect())?;
        self.descriptions(0).try_for_each(|description| ladder.push(description))?;
        Ok(ladder)
    }

    /// GOPs to which no frames come any more: those of [`Manifest::ladder`].
    pub fn complete_gops(&self) -> usize {
        self.gops.iter().take_while(|gop| !gop.growing).count()
    }

    /// A GOP of [`Manifest::ladder`]; none if there are not so many.
    pub fn description(&self, gop: usize) -> Option<Description> {
        self.describe(gop, &Qualities::of(self))
    }

    /// All GOPs of [`Manifest::ladder`] from one on.
    pub(crate) fn descriptions(&self, from: usize) -> impl Iterator<Item = Description> {
        let qualities = Qualities::of(self);
        (from..self.complete_gops()).map_while(move |gop| self.describe(gop, &qualities))
    }

    fn describe(&self, gop: usize, qualities: &Qualities) -> Option<Description> {
        let info = self.gops.get(gop).filter(|gop| !gop.growing)?;
        let mut description = Description {
            duration_us: self.duration_us(gop),
            frames: Vec::new(),
            pieces: Vec::new(),
            quality: Vec::new(),
        };
        for (index, one) in self.representations.iter().enumerate() {
            let own = || info.subsegments.iter().filter(|subsegment| subsegment.representation == one.id);
            let frames: usize = own().map(|subsegment| subsegment.frames.len()).sum();
            // Layers of I frames add to the frame of the base.
            let is_layer = matches!(layer(&one.id), Some(Layer::Spatial(_))) && index > 0;
            description.frames.push(if is_layer { 0 } else { u32::try_from(frames).unwrap_or(u32::MAX) });
            // Where a GOP lists nothing, nothing is kept: many GOPs are listed in few bytes. The base has a piece always.
            let listed = own().next().map_or(u8::from(index == 0), |_| self.pieces_of(index));
            let pieces = (0..listed).filter_map(|piece| self.levels_of_piece(index, piece));
            description.pieces.push(pieces.map(|levels| piece(own(), &levels, size(frames))).collect());
        }
        description.quality = qualities.of_gop(gop, info);
        Some(description)
    }

    /// How many pieces a Representation has in a GOP of the [ladder](Manifest::ladder).
    pub(crate) fn pieces_of(&self, representation: usize) -> u8 {
        let id = self.representations.get(representation).map_or("", |one| &one.id);
        let intra = matches!(layer(id), Some(Layer::Spatial(_)));
        if intra && self.has_whole_anchors() { 1 } else { self.refinement_count() }
    }

    /// The levels of a piece of a Representation; none if it has not so many.
    pub(crate) fn levels_of_piece(&self, representation: usize, piece: u8) -> Option<Range<u8>> {
        let pieces = self.pieces_of(representation);
        if piece >= pieces {
            return None;
        }
        if pieces < self.refinement_count() {
            return Some(0..self.refinement_count());
        }
        Some(piece..piece.saturating_add(1))
    }

    fn refinement_count(&self) -> u8 {
        u8::try_from(self.stream.refinements.len()).unwrap_or(u8::MAX)
    }

    /// Whether I frames are fetched with all refinements, or not at all.
    fn has_whole_anchors(&self) -> bool {
        self.stream.whole_anchor && self.representations.iter().any(|one| one.frame_type != "I")
    }

    /// From the first frame of a GOP to that of the next one, or to the end of the last one.
    fn duration_us(&self, gop: usize) -> u64 {
        let Some(info) = self.gops.get(gop) else { return 0 };
        let next = gop.checked_add(1).and_then(|next| self.gops.get(next));
        let frames = next.map_or(info.frame_count, |next| next.first_frame.saturating_sub(info.first_frame));
        let ticks = u128::from(frames).saturating_mul(self.stream.ticks_per_frame.into());
        let us = ticks.saturating_mul(1_000_000).checked_div(self.stream.ticks_per_second.into());
        us.and_then(|us| u64::try_from(us).ok()).unwrap_or(u64::MAX).max(1)
    }
}

/// The rows of the table of qualities, each point once: those of all GOPs under none. It is sorted once, as there may be
/// many GOPs and many rows.
struct Qualities(Vec<QualityRow>);

impl Qualities {
    fn of(manifest: &Manifest) -> Self {
        let row = |one: &QualityInfo| {
            let quality = one.psnr_db.map(|psnr| psnr.min(EXACT))?;
            Some((one.gop, named(&one.point)?, quality))
        };
        Self(first_of_each(manifest.quality.iter().flatten().filter_map(row).collect()))
    }

    /// Those of a GOP, by point.
    fn rows(&self, gop: Option<u32>) -> &[QualityRow] {
        let start = self.0.partition_point(|row| row.0 < gop);
        let end = self.0.partition_point(|row| row.0 <= gop);
        self.0.get(start..end).unwrap_or_default()
    }

    /// What the table says of a GOP or, where it has nothing, of all of them. Of points at which only I frames are played
    /// it has nothing: these are estimated from those with the frames of the lowest temporal layer.
    fn of_gop(&self, gop: usize, info: &GopInfo) -> Vec<(OperatingPoint, f64)> {
        let own = u32::try_from(gop).map_or(&[][..], |gop| self.rows(Some(gop)));
        let others = self.rows(None).iter().filter(|row| quality_of(own, row.1).is_none());
        let mut found: Vec<(OperatingPoint, f64)> =
            own.iter().chain(others).map(|&(_, name, quality)| (name, quality)).collect();
        let still = STILL * (1.0 - 1.0 / real(info.frame_count.max(1).into()));
        let intra: Vec<(OperatingPoint, f64)> = found
            .iter()
            .filter(|(name, _)| name.temporal == Some(0))
            .map(|(name, quality)| (OperatingPoint { temporal: None, ..*name }, quality - still))
            .collect();
        found.extend(intra);
        found
    }
}

/// Levels of a Representation in a GOP as one piece.
fn piece<'a>(
    subsegments: impl Iterator<Item = &'a SubsegmentInfo>,
    levels: &Range<u8>,
    frames: u64,
) -> Piece {
    let of = |subsegment: &'a SubsegmentInfo| {
        subsegment.levels.iter().filter(|level| levels.contains(&level.refinement))
    };
    let add = |piece: Piece, level: &'a super::LevelInfo| Piece {
        bytes: piece.bytes.saturating_add(level.bytes.size),
        gaussians: piece.gaussians.saturating_add(level.gaussians),
    };
    let all = subsegments.flat_map(of).fold(Piece { bytes: 0, gaussians: 0 }, add);
    Piece { gaussians: all.gaussians.div_ceil(frames.max(1)), ..all }
}

fn layer(id: &str) -> Option<Layer> {
    Some(match Kind::from_id(id)? {
        Kind::Spatial(layer) => Layer::Spatial(layer),
        Kind::Temporal(layer) => Layer::Temporal(layer),
    })
}

/// Whether a layer cannot be played without an earlier one.
fn is_needed(layer: &Layer, earlier: &Layer, whole: bool) -> bool {
    match (layer, earlier) {
        (Layer::Temporal(_), Layer::Spatial(number)) => whole || *number == 0,
        _ => true,
    }
}

/// The point with a name such as `s0,t1,r2`.
fn named(name: &str) -> Option<OperatingPoint> {
    let mut parts = name
        .split(',')
        .zip(['s', 't', 'r'])
        .map(|(part, letter)| part.strip_prefix(letter)?.parse::<u8>().ok());
    let (spatial, temporal, refinement) = (parts.next()??, parts.next()??, parts.next()??);
    Some(OperatingPoint { spatial, temporal: Some(temporal), refinement })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::{Decision, Layered, Session, Settings};
    use crate::package::{Options, Package};
    use splatstream_format::Limits;

    /// The stream of annex E: two spatial layers, an I, a B and a P frame, two refinements.
    fn manifest() -> Manifest {
        let stream = include_bytes!("../../../spec/data/worked-temporal-example.gss");
        Package::of(stream, &Options::default(), &Limits::default()).expect("it conforms").manifest
    }

    #[test]
    fn a_ladder_has_the_pieces_of_a_manifest() {
        let manifest = manifest();
        let ladder = manifest.ladder().expect("it is complete");
        let needs: Vec<&[usize]> = ladder.representations().iter().map(|one| one.needs.as_slice()).collect();
        assert_eq!(needs, [&[][..], &[0], &[0], &[0, 2]]);
        let [gop] = ladder.gops() else { panic!("it has one GOP") };
        let sizes: Vec<u64> = manifest.gops[0]
            .subsegments
            .iter()
            .flat_map(|one| &one.levels)
            .map(|level| level.bytes.size)
            .collect();
        let pieces: Vec<u64> = (0..4).flat_map(|index| gop.pieces(index)).map(|piece| piece.bytes).collect();
        assert_eq!(pieces, sizes);
        let most = gop.points().last().expect("it has points");
        assert_eq!((most.name.to_string().as_str(), most.frames), ("s1,t1,r1", 3));
        assert_eq!(most.bytes, sizes.iter().sum::<u64>());
        assert_eq!(manifest.description(1), None);
    }

    #[test]
    fn layers_are_left_out() {
        let manifest = manifest().up_to((0, 0));
        let ids: Vec<&str> = manifest.representations.iter().map(|one| one.id.as_str()).collect();
        assert_eq!((ids, manifest.gops[0].subsegments.len()), (vec!["s0", "t0"], 2));
        let ladder = manifest.ladder().expect("it is complete");
        assert_eq!(
            ladder.gops()[0].points().last().map(|point| point.name.to_string()).as_deref(),
            Some("s0,t0,r1")
        );
    }

    #[test]
    fn whole_anchors_are_one_piece_that_motion_needs() {
        let mut manifest = manifest();
        manifest.stream.whole_anchor = true;
        let ladder = manifest.ladder().expect("it is complete");
        assert_eq!(ladder.representations()[2].needs, [0, 1]);
        let counts: Vec<usize> = (0..4).map(|index| ladder.gops()[0].pieces(index).len()).collect();
        assert_eq!(counts, [1, 1, 2, 2]);
        assert_eq!(
            (manifest.levels_of_piece(0, 0), manifest.levels_of_piece(2, 1)),
            (Some(0..2), Some(1..2))
        );
    }

    #[test]
    fn qualities_are_those_of_the_table() {
        let mut manifest = manifest();
        let row = |point: &str, gop, psnr_db| QualityInfo { point: point.into(), gop, psnr_db, ssim: None };
        let mut table = vec![row("s0,t0,r0", Some(0), Some(21.0))];
        for point in
            ["s0,t0,r0", "s0,t0,r1", "s0,t1,r0", "s0,t1,r1", "s1,t0,r0", "s1,t0,r1", "s1,t1,r0", "s1,t1,r1"]
        {
            table.push(row(point, None, Some(30.0)));
        }
        manifest.quality = Some(table);
        let quality = |manifest: &Manifest, name: &str| {
            let ladder = manifest.ladder().expect("it is complete");
            let points = ladder.gops()[0].points().to_vec();
            points.iter().find(|point| point.name.to_string() == name).map(|point| point.quality)
        };
        assert_eq!(quality(&manifest, "s0,t0,r0"), Some(21.0));
        assert_eq!(quality(&manifest, "s0,i,r0"), Some(17.0));
        assert_eq!(quality(&manifest, "s1,t1,r1"), Some(30.0));
        // One point less, and all are estimates.
        manifest.quality.iter_mut().for_each(|table| table.truncate(5));
        assert_eq!(quality(&manifest, "s1,t1,r1"), Some(36.0));
    }

    #[test]
    fn gops_without_subsegments_cost_little() {
        let mut manifest = manifest();
        manifest.gops[0].subsegments.clear();
        manifest.gops = vec![manifest.gops[0].clone(); 20_000];
        let row = |gop| QualityInfo { point: "s0,t0,r0".into(), gop, psnr_db: Some(30.0), ssim: None };
        manifest.quality = Some((0..20_000).map(|gop| row(Some(gop))).collect());
        // For each GOP all rows would take minutes.
        let ladder = manifest.ladder().expect("each has a base");
        let points: usize = ladder.gops().iter().map(|gop| gop.points().len()).sum();
        let pieces: usize =
            ladder.gops().iter().flat_map(|gop| (0..4).map(|one| gop.pieces(one).len())).sum();
        assert_eq!((points, pieces), (20_000, 20_000));
    }

    #[test]
    fn what_gains_most_by_the_table_is_fetched_first() {
        let first = |motion: f64, refinement: f64| {
            let mut manifest = manifest();
            let row = |(spatial, temporal, level): (u8, u8, u8)| QualityInfo {
                point: format!("s{spatial},t{temporal},r{level}"),
                gop: None,
                psnr_db: Some(20.0 + motion * f64::from(temporal) + refinement * f64::from(level)),
                ssim: None,
            };
            let points = (0..8).map(|number| (number / 4, number / 2 % 2, number % 2));
            manifest.quality = Some(points.map(row).collect());
            let ladder = manifest.ladder().expect("it is complete");
            let mut session = Session::new(ladder, Settings::default(), Layered::default(), 0);
            let Decision::Fetch(fetch) = session.decide(0) else { panic!("there is nothing to wait for") };
            let ranges: Vec<(usize, u8)> =
                fetch.ranges().iter().map(|range| (range.representation, range.to)).collect();
            ranges
        };
        // s0, s1, t0, t1: their base, then what is worth most.
        let (motion, detail) = (first(20.0, 1.0), first(1.0, 20.0));
        let place = |ranges: &[(usize, u8)], wanted: (usize, u8)| {
            let found = ranges.iter().position(|range| range.0 == wanted.0 && range.1 >= wanted.1);
            found.unwrap_or(ranges.len())
        };
        assert!(place(&motion, (3, 1)) < place(&motion, (0, 2)), "{motion:?}");
        assert!(place(&detail, (0, 2)) < place(&detail, (3, 1)), "{detail:?}");
    }

    #[test]
    fn gops_last_until_the_next_one() {
        let mut manifest = manifest();
        (manifest.stream.ticks_per_second, manifest.stream.ticks_per_frame) = (30, 1);
        let mut next = manifest.gops[0].clone();
        next.first_frame = 6;
        manifest.gops.push(next);
        let durations: Vec<u64> =
            (0..2).filter_map(|gop| manifest.description(gop)).map(|gop| gop.duration_us).collect();
        assert_eq!(durations, [200_000, 100_000]);
    }
}
