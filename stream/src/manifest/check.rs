//! What must hold of a manifest, so that a reader can act on it.

use super::{
    ByteRange, CLAUSE, FrameInfo, GopInfo, LevelInfo, LiveInfo, Manifest, ManifestError, RepresentationInfo,
    SubsegmentInfo,
};
use crate::package::Layout;
use crate::representation::Representation;
use splatstream_format::syntax::{GopHeader, MAX_LAYERS, MAX_REFINEMENTS};
use std::collections::HashMap;

/// The largest time in milliseconds: numbers of JSON are exact up to it everywhere.
const MAX_TIME: u64 = 1 << 53;

type Result = core::result::Result<(), ManifestError>;

/// A value shall be as `holds` says.
fn demand(holds: bool, at: impl FnOnce() -> String, message: impl Into<String>) -> Result {
    if holds {
        return Ok(());
    }
    Err(ManifestError { at: at(), clause: CLAUSE, message: message.into() })
}

impl Manifest {
    /// C.8: everything that a reader relies on.
    pub(super) fn check(&self) -> Result {
        let at = |name: &'static str| move || name.to_owned();
        demand(self.format == Self::FORMAT, at("format"), "this is not a manifest of SplatStream")?;
        let version = format!("version {} is not known, only {}", self.version, Self::VERSION);
        demand(self.version == Self::VERSION, at("version"), version)?;
        let layouts = [Layout::Gop, Layout::Frame].map(Layout::name);
        demand(layouts.contains(&self.layout.as_str()), at("layout"), "neither gop nor frame")?;
        self.check_live()?;
        self.check_stream()?;
        self.check_representations()?;
        self.check_gops()?;
        self.check_quality()
    }

    fn check_live(&self) -> Result {
        let Some(live) = &self.live else { return Ok(()) };
        let at = |name: &'static str| move || format!("live.{name}");
        let states = [LiveInfo::GROWING, LiveInfo::ENDED];
        demand(states.contains(&live.state.as_str()), at("state"), "neither growing nor ended")?;
        let count = u64::try_from(self.gops.len()).unwrap_or(u64::MAX);
        let end = live.first_gop.checked_add(count);
        demand(end.is_some_and(|end| end <= 1 << 32), at("first_gop"), "more than 2^32 GOPs")?;
        demand(live.started_ms <= MAX_TIME, at("started_ms"), "beyond 2^53")?;
        demand(live.published_ms <= MAX_TIME, at("published_ms"), "beyond 2^53")?;
        demand(live.update_ms > 0, at("update_ms"), "not 1 or more")
    }

    fn check_stream(&self) -> Result {
        let stream = &self.stream;
        let at = |name: &'static str| move || format!("stream.{name}");
        demand(stream.profile <= 1, at("profile"), "not 0 or 1")?;
        demand((1..=4).contains(&stream.level), at("level"), "not 1 to 4")?;
        demand(stream.sh_degree <= 3, at("sh_degree"), "not 0 to 3")?;
        demand((1..=MAX_LAYERS).contains(&stream.spatial_layers), at("spatial_layers"), "not 1 to 4")?;
        demand((1..=MAX_LAYERS).contains(&stream.temporal_layers), at("temporal_layers"), "not 1 to 4")?;
        demand(stream.ticks_per_second > 0, at("ticks_per_second"), "not 1 or more")?;
        demand(stream.ticks_per_frame > 0, at("ticks_per_frame"), "not 1 or more")?;
        let known = !self.is_growing();
        demand(
            stream.bytes.is_some() == known,
            at("bytes"),
            "not null while the stream grows, a number otherwise",
        )?;
        demand(
            stream.digest.is_some() == known,
            at("digest"),
            "not null while the stream grows, text otherwise",
        )?;
        let digest = stream.digest.as_deref().is_none_or(is_digest);
        demand(digest, at("digest"), "not 16 hexadecimal digits")?;
        demand(stream.frames <= 1 << 32, at("frames"), "more than 2^32")?;
        let percents = &stream.refinements;
        let rises = percents.iter().zip(percents.iter().skip(1)).all(|(one, next)| one < next);
        let is_whole = percents.last() == Some(&100) && percents.first() > Some(&0);
        let few = percents.len() <= usize::from(MAX_REFINEMENTS);
        demand(rises && is_whole && few, at("refinements"), "not 1 to 10 percentages that increase to 100")
    }

    fn check_representations(&self) -> Result {
        let all = &self.representations;
        let at = |index: usize, name: &'static str| move || format!("representations[{index}].{name}");
        demand(!all.is_empty(), at(0, "id"), "there is none")?;
        let mut last = None;
        for (index, one) in all.iter().enumerate() {
            let representation = Representation::from_id(&one.id);
            demand(
                representation > last,
                at(index, "id"),
                "unknown, or not in the order s0 to s3, t0 to t3",
            )?;
            last = representation;
            let codes = representation.map(Representation::codes);
            demand(
                codes.map(|(_, layer)| layer) == Some(one.layer),
                at(index, "layer"),
                "not that of the id",
            )?;
            demand(is_plain(&one.file), at(index, "file"), "not a plain file name")?;
            let fresh = all.iter().take(index).all(|earlier| earlier.file != one.file);
            demand(fresh, at(index, "file"), "two have this file")?;
            let types: &[&str] = match representation {
                Some(Representation::Spatial(_)) => &["I"],
                Some(Representation::Temporal(0)) => &["P"],
                _ => &["B"],
            };
            demand(types.contains(&one.frame_type.as_str()), at(index, "frame_type"), "not that of the id")?;
            let before: Vec<&String> = all.iter().take(index).map(|earlier| &earlier.id).collect();
            let depends = one.depends_on.iter().eq(before);
            demand(depends, at(index, "depends_on"), "not all Representations before it")?;
            demand(one.bandwidth > 0, at(index, "bandwidth"), "not 1 or more")?;
            let levels = one.level_bandwidths.len() == self.stream.refinements.len();
            demand(levels, at(index, "level_bandwidths"), "not one for each refinement")?;
            let base = representation == Some(Representation::Spatial(0));
            demand(index > 0 || base, at(index, "id"), "the first is not s0")?;
            self.check_parts(index, one)?;
        }
        Ok(())
    }

    fn check_parts(&self, index: usize, one: &RepresentationInfo) -> Result {
        let at = |name: &'static str| move || format!("representations[{index}].{name}");
        demand(one.init.offset == 0 && one.init.size > 0, at("init"), "not at the start of the file")?;
        in_file(&one.init, one.bytes, at("init"))?;
        if let Some(range) = &one.index {
            in_file(range, one.bytes, at("index"))?;
            demand(range.offset == one.init.size, at("index"), "not after the initialisation segment")?;
        }
        let Some(live) = &self.live else {
            demand(one.tail_file.is_none(), at("tail_file"), "the package is not live")?;
            return one.tail.as_ref().map_or(Ok(()), |range| in_file(range, one.bytes, at("tail")));
        };
        demand(one.bytes == one.init.size, at("bytes"), "more than the initialisation segment")?;
        demand(one.index.is_none(), at("index"), "not null in a live package")?;
        let can_be = one.tail.is_none() || live.state == LiveInfo::ENDED;
        demand(can_be, at("tail"), "not null while the stream grows")?;
        demand(one.tail_file.is_some() == one.tail.is_some(), at("tail_file"), "not that of a tail")?;
        demand(one.tail_file.as_deref().is_none_or(is_plain), at("tail_file"), "not a plain file name")?;
        one.tail.as_ref().map_or(Ok(()), |range| in_file(range, u64::MAX, at("tail")))
    }

    fn check_gops(&self) -> Result {
        let mut ends: HashMap<&str, u64> = HashMap::new();
        for one in self.representations.iter().filter(|_| self.live.is_none()) {
            let index = one.index.as_ref().map_or(0, |range| range.size);
            ends.insert(&one.file, one.init.size.saturating_add(index));
        }
        let last = self.gops.len().saturating_sub(1);
        let can_grow = self.is_growing() && self.layout == Layout::Frame.name();
        let mut next = 0;
        for (index, gop) in self.gops.iter().enumerate() {
            let at = |name: &'static str| move || format!("gops[{index}].{name}");
            demand(u64::from(gop.first_frame) >= next, at("first_frame"), "within the GOP before it")?;
            demand(gop.frame_count > 0, at("frame_count"), "not 1 or more")?;
            let growing = !gop.growing || (can_grow && index == last);
            demand(
                growing,
                at("growing"),
                "only the last GOP grows, frame by frame, until the stream has ended",
            )?;
            demand(
                gop.temporal_depth < self.stream.temporal_layers,
                at("temporal_depth"),
                "beyond the layers",
            )?;
            next = u64::from(gop.first_frame).saturating_add(gop.frame_count.into());
            demand(next <= self.stream.frames, at("frame_count"), "beyond the frames of the stream")?;
            for (number, subsegment) in gop.subsegments.iter().enumerate() {
                self.check_subsegment(gop, subsegment, &mut ends, || {
                    format!("gops[{index}].subsegments[{number}]")
                })?;
            }
        }
        Ok(())
    }

    fn check_subsegment<'a>(
        &'a self,
        gop: &GopInfo,
        subsegment: &'a SubsegmentInfo,
        ends: &mut HashMap<&'a str, u64>,
        at: impl Fn() -> String,
    ) -> Result {
        let of_it = self.representations.iter().find(|one| one.id == subsegment.representation);
        let Some(of_it) = of_it else {
            return demand(false, || format!("{}.representation", at()), "unknown");
        };
        let file = subsegment.file.as_deref();
        let is_live = self.live.is_some();
        demand(file.is_some() == is_live, || format!("{}.file", at()), "not the file of a live package")?;
        demand(file.is_none_or(is_plain), || format!("{}.file", at()), "not a plain file name")?;
        // Indices may stand before a subsegment of a live package, whose files have no known length.
        let bytes = if is_live { u64::MAX } else { of_it.bytes };
        let end = ends.entry(file.unwrap_or(&of_it.file)).or_default();
        check_frames(gop, subsegment, &at)?;
        let count = subsegment.levels.len() == self.stream.refinements.len();
        demand(count, || format!("{}.levels", at()), "not one for each refinement")?;
        let percents = (0_u8..).zip(&self.stream.refinements);
        for (level, (refinement, percent)) in subsegment.levels.iter().zip(percents) {
            let at = || format!("{}.levels[{refinement}]", at());
            demand((level.refinement, level.percent) == (refinement, *percent), at, "not that refinement")?;
            let offset = level.bytes.offset;
            let follows = offset == *end || (is_live && refinement == 0 && offset > *end);
            demand(follows, at, "the range does not start where the one before it ends")?;
            in_file(&level.bytes, bytes, at)?;
            check_level(level, at)?;
            *end = level.bytes.offset.saturating_add(level.bytes.size);
        }
        Ok(())
    }

    fn check_quality(&self) -> Result {
        for (index, one) in self.quality.iter().flatten().enumerate() {
            let at = || format!("quality[{index}]");
            let gops = one.gop.is_none_or(|gop| usize::try_from(gop).is_ok_and(|gop| gop < self.gops.len()));
            demand(gops, at, "there is no such GOP")?;
            let finite = [one.psnr_db, one.ssim].into_iter().flatten().all(f64::is_finite);
            demand(finite, at, "a value is not finite")?;
            demand(self.has_point(&one.point), at, "there is no such operating point")?;
        }
        Ok(())
    }

    /// Whether a name such as `s0,t1,r2` is that of an operating point of the stream.
    fn has_point(&self, name: &str) -> bool {
        let stream = &self.stream;
        let (spatial, temporal) = (usize::from(stream.spatial_layers), usize::from(stream.temporal_layers));
        let counts = [("s", spatial), ("t", temporal), ("r", stream.refinements.len())];
        let mut parts = name.split(',');
        let all = counts.iter().all(|(letter, count)| {
            let number = parts.next().and_then(|part| part.strip_prefix(letter)?.parse::<usize>().ok());
            number.is_some_and(|number| number < *count)
        });
        all && parts.next().is_none()
    }
}

/// The frames of a subsegment are some of its GOP, in order.
fn check_frames(gop: &GopInfo, subsegment: &SubsegmentInfo, at: impl Fn() -> String) -> Result {
    let last = u64::from(gop.first_frame).saturating_add(gop.frame_count.into());
    let header = match gop.predicted {
        true => GopHeader::predicted(gop.index, gop.frame_count, gop.temporal_depth),
        false => GopHeader::intra(gop.index, gop.frame_count),
    };
    let mut next = gop.first_frame.into();
    for frame in &subsegment.frames {
        let within = (next..last).contains(&u64::from(frame.frame));
        let holds = within && *frame == FrameInfo::of(&header, gop.first_frame, frame.frame);
        demand(holds, || format!("{}.frames", at()), format!("frame {} cannot be here", frame.frame))?;
        next = u64::from(frame.frame).saturating_add(1);
    }
    Ok(())
}

fn check_level(level: &LevelInfo, at: impl Fn() -> String) -> Result {
    let bits = level.bits_per_gaussian.is_none_or(|bits| bits.is_finite() && bits >= 0.0);
    demand(bits, &at, "bits_per_gaussian is no rate")?;
    let neighbours = level.predictors.neighbours <= splatstream_format::syntax::MAX_NEIGHBOURS;
    demand(neighbours, &at, "more than 16 neighbours")
}

fn in_file(range: &ByteRange, bytes: u64, at: impl Fn() -> String) -> Result {
    let end = range.offset.checked_add(range.size);
    demand(end.is_some_and(|end| end <= bytes), &at, "the range ends beyond its file")?;
    demand(is_digest(&range.digest), &at, "the digest is not 16 hexadecimal digits")
}

fn is_digest(text: &str) -> bool {
    text.len() == 16 && text.bytes().all(|byte| byte.is_ascii_digit() || (b'a'..=b'f').contains(&byte))
}

/// A name that stays in its directory on every system.
fn is_plain(name: &str) -> bool {
    let known = |byte: u8| byte.is_ascii_alphanumeric() || b"._-".contains(&byte);
    (1..=255).contains(&name.len()) && !name.starts_with('.') && name.bytes().all(known)
}
