//! C.9: what an MPD says of segments that are files of their own, and of those that are still being made.

use super::{Segments, Xml, gops, longest, seconds};
use crate::manifest::Manifest;
use crate::package::Layout;

/// How far behind a client should be: the longest GOP, or a frame of it.
pub(super) fn service(xml: &mut Xml, manifest: &Manifest, segments: Segments<'_>) {
    if !is_low_latency(manifest, segments) {
        return;
    }
    let stream = &manifest.stream;
    let ticks = u64::from(stream.ticks_per_frame).saturating_mul(2000);
    let milliseconds = ticks.div_ceil(u64::from(stream.ticks_per_second).max(1));
    xml.element("ServiceDescription", &[("id", "0".to_owned())], |xml| {
        xml.empty("Latency", &[("target", milliseconds.to_string())]);
    });
}

/// When frames are made, and that decoding can start within a segment.
pub(super) fn clock(xml: &mut Xml, manifest: &Manifest, segments: Segments<'_>) {
    let Segments::Numbered { started, is_end: false, .. } = segments else { return };
    let reference = [
        ("id", "0".to_owned()),
        ("type", "encoder".to_owned()),
        ("wallClockTime", started.to_owned()),
        ("presentationTime", "0".to_owned()),
    ];
    xml.empty("ProducerReferenceTime", &reference);
    if is_low_latency(manifest, segments) {
        xml.empty("Resync", &[("type", "1".to_owned())]);
    }
}

/// The files of segments and their times.
pub(super) fn template(xml: &mut Xml, manifest: &Manifest, segments: Segments<'_>) {
    if matches!(segments, Segments::Files) {
        return;
    }
    let stream = &manifest.stream;
    let mut attributes = vec![
        ("timescale", stream.ticks_per_second.to_string()),
        ("initialization", "$RepresentationID$-init.mp4".to_owned()),
        ("media", "$RepresentationID$-$Number$.m4s".to_owned()),
        ("startNumber", "1".to_owned()),
    ];
    if is_low_latency(manifest, segments) {
        let early = seconds(manifest, longest(manifest, segments).saturating_sub(1).into());
        attributes.push(("availabilityTimeOffset", early));
        attributes.push(("availabilityTimeComplete", "false".to_owned()));
    }
    xml.element("SegmentTemplate", &attributes, |xml| {
        xml.element("SegmentTimeline", &[], |xml| {
            for (start, ticks, repeated) in runs(manifest, segments) {
                let mut attributes = vec![("t", start.to_string()), ("d", ticks.to_string())];
                if repeated > 0 {
                    attributes.push(("r", repeated.to_string()));
                }
                xml.empty("S", &attributes);
            }
        });
    });
}

/// GOPs of one length that follow each other: time and duration of the first, and how many come after it.
fn runs(manifest: &Manifest, segments: Segments<'_>) -> Vec<(u64, u64, u64)> {
    let mut runs: Vec<(u64, u64, u64)> = Vec::new();
    let ticks = |frames: u32| u64::from(frames).saturating_mul(manifest.stream.ticks_per_frame.into());
    for gop in gops(manifest, segments) {
        let (start, length) = (ticks(gop.first_frame), ticks(gop.frame_count));
        match runs.last_mut() {
            Some((first, of_one, repeated))
                if *of_one == length
                    && first.saturating_add(repeated.saturating_add(1).saturating_mul(length)) == start =>
            {
                *repeated = repeated.saturating_add(1);
            }
            _ => runs.push((start, length, 0)),
        }
    }
    runs
}

/// Whether segments are offered while they grow.
fn is_low_latency(manifest: &Manifest, segments: Segments<'_>) -> bool {
    matches!(segments, Segments::Numbered { is_end: false, .. }) && manifest.layout == Layout::Frame.name()
}
