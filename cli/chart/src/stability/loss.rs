//! A stream with units missing.

use super::dice::Dice;
use super::ours::decoded;
use super::sample::{Quality, Views};
use splatstream_format::Limits;
use splatstream_format::syntax::UnitType;
use splatstream_format::unit::Stream;

/// Trials at each share.
const TRIALS: u64 = 4;

/// What is left of a stream in all trials.
pub(super) struct Remains {
    /// Mean of the trials; none if none of them shows a frame.
    pub(super) quality: Option<Quality>,
    /// What the decoder says in the first trial in which it says something.
    pub(super) detected: Option<String>,
    /// Whether it says something in every trial in which units are missing.
    pub(super) always_detected: bool,
}

/// Loses a share of the units of frames.
pub(super) fn remains(stream: &[u8], share: f64, frames: usize, views: &Views<'_>) -> Remains {
    let mut remains = Remains { quality: None, detected: None, always_detected: true };
    let mut qualities = Vec::new();
    for trial in 0..TRIALS {
        let damaged = without_some(stream, share, trial);
        let (shown, said) = decoded(&damaged, frames);
        qualities.extend(views.judged(&shown));
        remains.always_detected &= said.is_some() || damaged.len() == stream.len();
        remains.detected = remains.detected.or(said);
    }
    remains.quality = Quality::mean(&qualities);
    remains
}

/// The stream without some of its frame headers and increments.
fn without_some(stream: &[u8], share: f64, seed: u64) -> Vec<u8> {
    let mut dice = Dice::new(seed);
    let mut kept = Vec::new();
    let mut copied = 0;
    let opened = Stream::open(stream, &Limits::default());
    // The stream was made a moment ago: every unit of it can be read.
    for unit in opened.iter().flat_map(Stream::units).flatten() {
        let is_of_frame = matches!(unit.header.unit_type(), UnitType::FrameHeader | UnitType::Increment);
        if is_of_frame && dice.unit() < share {
            kept.extend_from_slice(stream.get(copied..unit.at as usize).unwrap_or_default());
            copied = unit.payload_at as usize + unit.payload.len();
        }
    }
    kept.extend_from_slice(stream.get(copied..).unwrap_or_default());
    kept
}

#[cfg(test)]
mod tests {
    use super::super::base::{Base, Size, builtin};
    use super::super::sequences::plain;
    use super::super::tools::Tool;
    use super::*;

    #[test]
    fn what_is_missing_is_noticed() {
        let sample = plain(&Base::new(&builtin(Size::Quick), Size::Quick));
        let views = sample.views(1, 40);
        let (stream, _) =
            Tool::SplatStream.attempt(&sample, None, &|_, _| Vec::new()).coded.expect("a stream");
        assert_eq!(without_some(&stream, 0.0, 1), stream);
        assert!(without_some(&stream, 1.0, 1).len() < stream.len() / 2);
        let whole = remains(&stream, 0.0, 4, &views);
        let half = remains(&stream, 0.5, 4, &views);
        assert!(whole.detected.is_none() && whole.always_detected);
        assert!(half.detected.is_some() && half.always_detected);
        assert!(half.quality.unwrap().psnr < whole.quality.unwrap().psnr);
    }
}
