//! What must hold of a manifest, so that a reader can act on it.

use super::{
    ByteRange, CLAUSE, FrameInfo, GopInfo, LevelInfo, Manifest, ManifestError, RepresentationInfo,
    SubsegmentInfo,
};
use crate::package::Layout;
use crate::representation::Representation;
use splatstream_format::syntax::{GopHeader, MAX_LAYERS, MAX_REFINEMENTS};
use std::collections::HashMap;

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
        self.check_stream()?;
        self.check_representations()?;
        self.check_gops()?;
        self.check_quality()
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
        demand(is_digest(&stream.digest), at("digest"), "not 16 hexadecimal digits")?;
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
        one.tail.as_ref().map_or(Ok(()), |range| in_file(range, one.bytes, at("tail")))
    }

    fn check_gops(&self) -> Result {
        let mut ends: HashMap<&str, u64> = HashMap::new();
        for one in &self.representations {
            let index = one.index.as_ref().map_or(0, |range| range.size);
            ends.insert(&one.id, one.init.size.saturating_add(index));
        }
        let mut next = 0;
        for (index, gop) in self.gops.iter().enumerate() {
            let at = |name: &'static str| move || format!("gops[{index}].{name}");
            demand(u64::from(gop.first_frame) >= next, at("first_frame"), "within the GOP before it")?;
            demand(gop.frame_count > 0, at("frame_count"), "not 1 or more")?;
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
        let (Some(file), Some(end)) = (of_it, ends.get_mut(subsegment.representation.as_str())) else {
            return demand(false, || format!("{}.representation", at()), "unknown");
        };
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
        let count = subsegment.levels.len() == self.stream.refinements.len();
        demand(count, || format!("{}.levels", at()), "not one for each refinement")?;
        let percents = (0_u8..).zip(&self.stream.refinements);
        for (level, (refinement, percent)) in subsegment.levels.iter().zip(percents) {
            let at = || format!("{}.levels[{refinement}]", at());
            demand((level.refinement, level.percent) == (refinement, *percent), at, "not that refinement")?;
            demand(level.bytes.offset == *end, at, "the range does not start where the one before it ends")?;
            in_file(&level.bytes, file.bytes, at)?;
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
