//! C.7: the media presentation description.

mod live;

use crate::manifest::{ByteRange, Manifest, RepresentationInfo};
use crate::package::layout::Layout;
use std::fmt::Write;

/// What an ordinary DASH client does not know, so that it passes over the AdaptationSet.
pub const SCHEME: &str = "urn:splatstream:dash:carriage:1";

/// The MPD of a package. That of a live one shall list all GOPs, of which nothing but their frames is needed.
pub(crate) fn of(manifest: &Manifest) -> String {
    let mut xml = Xml::default();
    xml.out.push_str("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
    let longest = duration(manifest, longest(manifest).into());
    let mut attributes = vec![
        ("xmlns", "urn:mpeg:dash:schema:mpd:2011".to_owned()),
        ("profiles", "urn:mpeg:dash:profile:full:2011".to_owned()),
    ];
    match &manifest.live {
        Some(live) if manifest.is_growing() => attributes.extend([
            ("type", "dynamic".to_owned()),
            ("availabilityStartTime", live::date_time(live.started_ms)),
            ("publishTime", live::date_time(live.published_ms)),
            ("minimumUpdatePeriod", longest.clone()),
        ]),
        _ => attributes.extend([
            ("type", "static".to_owned()),
            ("mediaPresentationDuration", duration(manifest, manifest.stream.frames)),
        ]),
    }
    attributes.push(("minBufferTime", longest));
    xml.element("MPD", &attributes, |xml| {
        live::service(xml, manifest);
        xml.element("Period", &[("id", "0".to_owned()), ("start", "PT0S".to_owned())], |xml| {
            adaptation_set(xml, manifest);
        });
    });
    xml.out
}

fn adaptation_set(xml: &mut Xml, manifest: &Manifest) {
    let stream = &manifest.stream;
    let set = [
        ("id", "0".to_owned()),
        ("contentType", "application".to_owned()),
        ("mimeType", "application/mp4".to_owned()),
        ("codecs", format!("gss1.{}.{}", stream.profile, stream.level)),
        ("subsegmentAlignment", "true".to_owned()),
    ];
    xml.element("AdaptationSet", &set, |xml| {
        let scheme = [("schemeIdUri", SCHEME.to_owned()), ("value", stream.specification.clone())];
        xml.empty("EssentialProperty", &scheme);
        live::clock(xml, manifest);
        for level in 1..=stream.refinements.len() {
            let component = [("id", level.to_string()), ("contentType", "application".to_owned())];
            xml.empty("ContentComponent", &component);
        }
        live::template(xml, manifest);
        for (index, one) in manifest.representations.iter().enumerate() {
            representation(xml, manifest, index, one);
        }
    });
}

fn representation(xml: &mut Xml, manifest: &Manifest, index: usize, one: &RepresentationInfo) {
    let mut attributes = vec![("id", one.id.clone()), ("bandwidth", one.bandwidth.to_string())];
    if !one.depends_on.is_empty() {
        attributes.push(("dependencyId", one.depends_on.join(" ")));
    }
    attributes.extend(frame_rate(manifest, index).map(|rate| ("frameRate", rate)));
    if one.frame_type == "I" && manifest.layout == Layout::Gop.name() {
        attributes.push(("startWithSAP", "1".to_owned()));
    }
    xml.element("Representation", &attributes, |xml| {
        let is_file = manifest.live.is_none();
        if is_file {
            xml.text("BaseURL", &one.file);
        }
        if one.level_bandwidths.len() > 1 {
            sub_representations(xml, one);
        }
        if is_file {
            segment_base(xml, one);
        }
    });
}

/// A level needs all levels below it; its bandwidth is its own.
fn sub_representations(xml: &mut Xml, one: &RepresentationInfo) {
    let mut below = Vec::new();
    for (level, bandwidth) in (1_u8..).zip(&one.level_bandwidths) {
        let mut attributes = vec![("level", level.to_string())];
        if !below.is_empty() {
            attributes.push(("dependencyLevel", below.join(" ")));
        }
        attributes.push(("bandwidth", (*bandwidth).max(1).to_string()));
        attributes.push(("contentComponent", level.to_string()));
        xml.empty("SubRepresentation", &attributes);
        below.push(level.to_string());
    }
}

fn segment_base(xml: &mut Xml, one: &RepresentationInfo) {
    let range = |range: &ByteRange| {
        let last = range.offset.saturating_add(range.size).saturating_sub(1);
        format!("{}-{last}", range.offset)
    };
    let mut attributes = Vec::new();
    if let Some(index) = &one.index {
        attributes.push(("indexRange", range(index)));
        attributes.push(("indexRangeExact", "true".to_owned()));
    }
    xml.element("SegmentBase", &attributes, |xml| {
        xml.empty("Initialization", &[("range", range(&one.init))]);
    });
}

/// The rate of the frames that a receiver of a Representation shows; none where that is no number.
fn frame_rate(manifest: &Manifest, index: usize) -> Option<String> {
    let taken = manifest.representations.iter().take(index.saturating_add(1));
    // Spatial layers show the same frames.
    let temporal = taken.filter(|one| one.id == "s0" || one.frame_type != "I");
    let shown: u64 = temporal.map(|one| u64::from(one.frames)).sum();
    let complete = manifest.gops.iter().filter(|gop| !gop.growing);
    let all = complete.map(|gop| u64::from(gop.frame_count)).fold(0, u64::saturating_add);
    let stream = &manifest.stream;
    let rate = u128::from(shown).checked_mul(stream.ticks_per_second.into())?;
    let over = u128::from(all).checked_mul(stream.ticks_per_frame.into())?;
    let common = common_divisor(rate, over);
    let (rate, over) = (rate.checked_div(common)?, over.checked_div(common)?);
    match over {
        0 => None,
        1 => Some(rate.to_string()),
        _ => Some(format!("{rate}/{over}")),
    }
}

fn common_divisor(mut a: u128, mut b: u128) -> u128 {
    while let Some(rest) = a.checked_rem(b) {
        (a, b) = (b, rest);
    }
    a
}

/// Frames of the longest GOP.
fn longest(manifest: &Manifest) -> u32 {
    manifest.gops.iter().map(|gop| gop.frame_count).max().unwrap_or(0)
}

/// Frames as an `xs:duration`.
fn duration(manifest: &Manifest, frames: u64) -> String {
    format!("PT{}S", seconds(manifest, frames))
}

/// Frames in seconds, rounded up to a millisecond.
fn seconds(manifest: &Manifest, frames: u64) -> String {
    let stream = &manifest.stream;
    let ticks = u128::from(frames).saturating_mul(stream.ticks_per_frame.into());
    let milliseconds = ticks.saturating_mul(1000).div_ceil(stream.ticks_per_second.max(1).into());
    let (seconds, rest) = (milliseconds / 1000, milliseconds % 1000);
    format!("{seconds}.{rest:03}")
}

/// XML as it is written.
#[derive(Debug, Default)]
pub(crate) struct Xml {
    pub(crate) out: String,
    depth: usize,
}

impl Xml {
    fn open(&mut self, name: &str, attributes: &[(&str, String)], end: &str) {
        self.out.extend(std::iter::repeat_n("  ", self.depth));
        let _infallible = write!(self.out, "<{name}");
        for (key, value) in attributes {
            let _infallible = write!(self.out, " {key}=\"{}\"", escaped(value));
        }
        self.out.push_str(end);
    }

    /// An element with elements in it.
    pub(crate) fn element(
        &mut self,
        name: &str,
        attributes: &[(&str, String)],
        body: impl FnOnce(&mut Self),
    ) {
        self.open(name, attributes, ">\n");
        self.depth = self.depth.saturating_add(1);
        body(self);
        self.depth = self.depth.saturating_sub(1);
        self.out.extend(std::iter::repeat_n("  ", self.depth));
        let _infallible = writeln!(self.out, "</{name}>");
    }

    /// An element with nothing in it.
    pub(crate) fn empty(&mut self, name: &str, attributes: &[(&str, String)]) {
        self.open(name, attributes, "/>\n");
    }

    /// An element with text in it.
    pub(crate) fn text(&mut self, name: &str, text: &str) {
        self.open(name, &[], ">");
        let _infallible = writeln!(self.out, "{}</{name}>", escaped(text));
    }
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
