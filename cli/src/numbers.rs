//! Numbers in words: for tables, and the arguments that hold numbers.

pub(crate) use splatstream_chart::numbers::counted;
use std::num::ParseIntError;

/// A number of frames: 1 frame, 2 frames.
pub(crate) fn frames(count: u32) -> String {
    counted(count.into(), "frame")
}

/// A digest as reports write it.
pub(crate) fn hex_digest(digest: u64) -> String {
    format!("{digest:016x}")
}

/// A span of frames, `A..B`: from A up to and without B.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct FrameRange {
    /// The first frame.
    pub(crate) first: u32,
    /// The frame after the last; none is to the end.
    pub(crate) end: Option<u32>,
}

impl FrameRange {
    /// Every frame.
    pub(crate) const ALL: Self = Self { first: 0, end: None };

    /// Whether a frame belongs to it.
    pub(crate) fn contains(&self, frame: u32) -> bool {
        frame >= self.first && !self.is_over(frame)
    }

    /// Whether `frame` and all after it come after it.
    pub(crate) fn is_over(&self, frame: u32) -> bool {
        self.end.is_some_and(|end| frame >= end)
    }

    /// Frames of it in a stream of `frames` frames.
    pub(crate) fn count_in(&self, frames: u32) -> u32 {
        self.end.map_or(frames, |end| end.min(frames)).saturating_sub(self.first)
    }

    /// `A..B`, `A..` or `..B`.
    pub(crate) fn parse(text: &str) -> Result<Self, String> {
        let wrong = || format!("'{text}' is not a span of frames; write 10..20, 10.. or ..20");
        let (first, end) = text.split_once("..").ok_or_else(wrong)?;
        let number = |part: &str| (!part.is_empty()).then(|| part.parse::<u32>()).transpose();
        let bounds = || -> Result<_, ParseIntError> { Ok((number(first)?.unwrap_or(0), number(end)?)) };
        match bounds().map_err(|_| wrong())? {
            (first, Some(end)) if first >= end => {
                Err(format!("'{text}' is empty: the end is the frame after the last one"))
            }
            (first, end) => Ok(Self { first, end }),
        }
    }
}

/// A share, 0 to 1.
pub(crate) fn parse_share(text: &str) -> Result<f64, String> {
    let share = text.parse::<f64>().ok().filter(|share| (0.0..=1.0).contains(share));
    share.ok_or_else(|| "write a share, 0 to 1".to_owned())
}

/// The mean, if there are any.
pub(crate) fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values.fold((0.0, 0), |(sum, count), value| (sum + value, count + 1));
    (count > 0).then(|| sum / f64::from(count))
}

/// Frames per second as ticks per second and ticks per frame: `30`, `29.97` or `30000/1001`.
pub(crate) fn parse_frame_rate(text: &str) -> Result<(u32, u32), String> {
    let wrong = || format!("'{text}' is not a frame rate; write 30, 29.97 or 30000/1001");
    let positive = |part: &str| part.parse::<u32>().ok().filter(|&number| number > 0).ok_or_else(wrong);
    if let Some((ticks, per_frame)) = text.split_once('/') {
        return Ok((positive(ticks)?, positive(per_frame)?));
    }
    let Some((whole, fraction)) = text.split_once('.') else {
        return Ok((positive(text)?, 1));
    };
    let scale = 10_u32.checked_pow(fraction.len() as u32).ok_or_else(wrong)?;
    Ok((positive(&format!("{whole}{fraction}"))?, scale))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_is_no_plural() {
        assert_eq!([1, 2].map(frames), ["1 frame", "2 frames"]);
    }

    #[test]
    fn a_span_of_frames_ends_before_its_end() {
        let span = FrameRange::parse("2..4").unwrap();
        assert_eq!((0..6).filter(|&frame| span.contains(frame)).collect::<Vec<_>>(), [2, 3]);
        assert_eq!(FrameRange::parse(".."), Ok(FrameRange::ALL));
        assert_eq!((span.count_in(3), FrameRange::ALL.count_in(3)), (1, 3));
        assert!(["", "3", "4..4", "a..b", "1..2..3"].iter().all(|text| FrameRange::parse(text).is_err()));
    }

    #[test]
    fn frame_rates_are_exact_fractions() {
        assert_eq!(parse_frame_rate("30"), Ok((30, 1)));
        assert_eq!(parse_frame_rate("29.97"), Ok((2997, 100)));
        assert_eq!(parse_frame_rate("30000/1001"), Ok((30000, 1001)));
        assert!(["0", "-1", "1/0", "x", "1e9"].iter().all(|text| parse_frame_rate(text).is_err()));
    }
}
