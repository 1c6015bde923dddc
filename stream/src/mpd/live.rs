//! C.9: what an MPD says of segments that are files of their own, and of those that are still being made.

use super::{Xml, longest, seconds};
use crate::manifest::Manifest;
use crate::package::layout::Layout;

/// How far behind a client should be: the longest GOP, or a frame of it.
pub(super) fn service(xml: &mut Xml, manifest: &Manifest) {
    if !is_low_latency(manifest) {
        return;
    }
    let target = manifest.live.as_ref().map_or(0, |live| live.target_latency_ms);
    xml.element("ServiceDescription", &[("id", "0".to_owned())], |xml| {
        xml.empty("Latency", &[("target", target.to_string())]);
    });
}

/// When frames are made, and that decoding can start within a segment.
pub(super) fn clock(xml: &mut Xml, manifest: &Manifest) {
    let Some(live) = manifest.live.as_ref().filter(|_| manifest.is_growing()) else { return };
    let reference = [
        ("id", "0".to_owned()),
        ("type", "encoder".to_owned()),
        ("wallClockTime", date_time(live.started_ms)),
        ("presentationTime", "0".to_owned()),
    ];
    xml.empty("ProducerReferenceTime", &reference);
    if is_low_latency(manifest) {
        xml.empty("Resync", &[("type", "1".to_owned())]);
    }
}

/// The files of segments and their times.
pub(super) fn template(xml: &mut Xml, manifest: &Manifest) {
    if manifest.live.is_none() {
        return;
    }
    let stream = &manifest.stream;
    let mut attributes = vec![
        ("timescale", stream.ticks_per_second.to_string()),
        ("initialization", "$RepresentationID$-init.mp4".to_owned()),
        ("media", "$RepresentationID$-$Number$.m4s".to_owned()),
        ("startNumber", "1".to_owned()),
    ];
    if is_low_latency(manifest) {
        let early = seconds(manifest, longest(manifest).saturating_sub(1).into());
        attributes.push(("availabilityTimeOffset", early));
        attributes.push(("availabilityTimeComplete", "false".to_owned()));
    }
    xml.element("SegmentTemplate", &attributes, |xml| {
        xml.element("SegmentTimeline", &[], |xml| {
            for (start, ticks, repeated) in runs(manifest) {
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
fn runs(manifest: &Manifest) -> Vec<(u64, u64, u64)> {
    let mut runs: Vec<(u64, u64, u64)> = Vec::new();
    let ticks = |frames: u32| u64::from(frames).saturating_mul(manifest.stream.ticks_per_frame.into());
    for gop in &manifest.gops {
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
fn is_low_latency(manifest: &Manifest) -> bool {
    manifest.is_growing() && manifest.layout == Layout::Frame.name()
}

/// A Unix time in milliseconds as an `xs:dateTime`.
pub(super) fn date_time(unix_ms: u64) -> String {
    let (days, ms) = (unix_ms / DAY_MS, unix_ms % DAY_MS);
    let (hours, minutes, seconds) = (ms / 3_600_000, ms / 60_000 % 60, ms / 1000 % 60);
    let (year, month, day) = date(days);
    format!("{year:04}-{month:02}-{day:02}T{hours:02}:{minutes:02}:{seconds:02}.{:03}Z", ms % 1000)
}

const DAY_MS: u64 = 86_400_000;

/// Year, month and day of so many days after 1970 began. The calendar repeats after 400 years.
fn date(days: u64) -> (u64, u64, u64) {
    const CYCLE: u64 = 400 * 365 + 97;
    let is_leap =
        |year: u64| year.is_multiple_of(4) && (!year.is_multiple_of(100) || year.is_multiple_of(400));
    let mut year = (days / CYCLE).saturating_mul(400).saturating_add(1970);
    let mut left = days % CYCLE;
    while let Some(rest) = left.checked_sub(if is_leap(year) { 366 } else { 365 }) {
        (year, left) = (year.saturating_add(1), rest);
    }
    let mut month = 1_u64;
    for length in [31, if is_leap(year) { 29 } else { 28 }, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31] {
        let Some(rest) = left.checked_sub(length) else { break };
        (month, left) = (month.saturating_add(1), rest);
    }
    (year, month, left.saturating_add(1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_dates() {
        assert_eq!(date_time(0), "1970-01-01T00:00:00.000Z");
        assert_eq!(date_time(951_782_400_000), "2000-02-29T00:00:00.000Z");
        assert_eq!(date_time(1_767_225_599_999), "2025-12-31T23:59:59.999Z");
        assert_eq!(date_time(1_767_225_600_000), "2026-01-01T00:00:00.000Z");
        assert_eq!(date_time(4_107_542_400_000), "2100-03-01T00:00:00.000Z");
        assert_eq!(date_time(12_622_780_800_000), "2370-01-01T00:00:00.000Z");
    }
}
