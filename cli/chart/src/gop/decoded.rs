//! The frames of an operating point: what they take, what they show.

use crate::Error;
use crate::decoding::each_frame;
use crate::picture_comparison::Judge;
use splatstream_decoder::frame_memory::FrameMemory;
use splatstream_decoder::operating_point::{OperatingPoint, extract};
use splatstream_decoder::output::to_gaussians;
use splatstream_decoder::process::Options;
use splatstream_format::Limits;
use splatstream_format::syntax::{FrameType, UnitHeader, UnitType};
use splatstream_format::unit::Stream;
use splatstream_render::metrics::Comparison;
use std::collections::BTreeMap;

/// A GOP at an operating point.
pub(crate) struct Shown {
    /// The frames that are output, in display order.
    pub(super) frames: Vec<ShownFrame>,
}

/// A frame at an operating point.
pub(crate) struct ShownFrame {
    /// Display index.
    pub(super) number: u32,
    /// How it is coded.
    pub(super) frame_type: FrameType,
    /// Bytes of its units, and of what the GOP defines for it.
    pub(super) bytes: u64,
    /// Gaussians received, without those that are carried.
    pub(super) gaussians: u64,
    /// Figures of each camera.
    views: Vec<Comparison>,
}

impl ShownFrame {
    /// Whether it refers to no other.
    pub(super) fn is_intra(&self) -> bool {
        self.frame_type == FrameType::Intra
    }
}

impl Shown {
    /// Bytes of the GOP.
    pub(super) fn bytes(&self) -> u64 {
        self.frames.iter().map(|frame| frame.bytes).sum()
    }

    /// Gaussians received.
    pub(super) fn gaussians(&self) -> u64 {
        self.frames.iter().map(|frame| frame.gaussians).sum()
    }

    /// The intra frame: no operating point holds all its layers and nothing else, but a client may stop after it.
    pub(super) fn intra_alone(self) -> Self {
        Self { frames: self.frames.into_iter().filter(ShownFrame::is_intra).collect() }
    }

    /// Means over the frames that count.
    pub(crate) fn figures(&self, counts: impl Fn(&ShownFrame) -> bool) -> Result<Comparison, Error> {
        let counted = self.frames.iter().filter(|frame| counts(frame));
        mean(counted.flat_map(|frame| frame.views.iter().copied()))
    }

    /// The units in words: the whole intra frame, predicted frames up to a refinement.
    pub(super) fn units(&self, refinement: u8) -> String {
        let upto = if refinement == 0 { "r0".to_owned() } else { format!("r0-r{refinement}") };
        let mut frames: Vec<&ShownFrame> = self.frames.iter().collect();
        frames.sort_by_key(|frame| (frame.frame_type.code(), frame.number));
        let unit = |frame: &&ShownFrame| match frame.is_intra() {
            true => format!("{} s0-s{}", label(frame), super::SPATIAL - 1),
            false => format!("{} {upto}", label(frame)),
        };
        frames.iter().map(unit).collect::<Vec<_>>().join(" + ")
    }
}

/// Means over pictures.
pub(super) fn mean(views: impl Iterator<Item = Comparison>) -> Result<Comparison, Error> {
    let views: Vec<Comparison> = views.collect();
    Comparison::mean(&views).ok_or_else(|| Error::other("there is no picture to compare"))
}

/// I0, P2, B1.
pub(super) fn label(frame: &ShownFrame) -> String {
    let letter = match frame.frame_type {
        FrameType::Intra => 'I',
        FrameType::Predicted => 'P',
        FrameType::Enhancement => 'B',
    };
    format!("{letter}{}", frame.number)
}

/// Decodes an operating point and judges its frames.
pub(crate) fn shown(stream: &[u8], point: OperatingPoint, judge: &mut Judge<'_>) -> Result<Shown, Error> {
    let sizes = sizes(stream, point)?;
    let mut frames = Vec::new();
    let options = Options { operating_point: point, ..Options::default() };
    each_frame(&FrameMemory::default(), stream, &options, |sequence, frame| {
        let (number, frame_type) = (frame.index, frame.frame_type);
        let (gaussians, carried) = ((frame.planes.len() - frame.carried) as u64, frame.carried);
        let mut key = sequence.to_bytes()?;
        key.extend(format!("{:?}", frame.compensation.exact).bytes());
        let key = (key, number, frame.digest.unwrap_or_default());
        let shown = to_gaussians(frame.into_shown(), sequence)?;
        // Digests know nothing of carried Gaussians.
        let views = if carried > 0 { judge.views(number, &shown) } else { judge.views_of(key, &shown) };
        let bytes = sizes.get(&number).copied().unwrap_or_default();
        frames.push(ShownFrame { number, frame_type, bytes, gaussians, views });
        Ok(shown)
    })?;
    frames.sort_by_key(|frame| frame.number);
    Ok(Shown { frames })
}

/// Bytes of each frame at an operating point, headers included. What the GOP defines counts to the frame after it.
fn sizes(stream: &[u8], point: OperatingPoint) -> Result<BTreeMap<u32, u64>, Error> {
    let limits = Limits::default();
    let part = extract(stream, point, &limits)?;
    let mut sizes = BTreeMap::new();
    let mut waiting = 0;
    for unit in Stream::open(&part, &limits)?.units() {
        let unit = unit?;
        let bytes = (UnitHeader::SIZE + unit.payload.len()) as u64;
        match unit.header.unit_type() {
            UnitType::GopHeader | UnitType::Transform | UnitType::Codebook | UnitType::Weights => {
                waiting += bytes;
            }
            UnitType::FrameHeader => {
                *sizes.entry(unit.header.frame).or_default() += bytes + std::mem::take(&mut waiting);
            }
            UnitType::Increment => *sizes.entry(unit.header.frame).or_default() += bytes,
            _ => {}
        }
    }
    Ok(sizes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gop::{SPATIAL, TEMPORAL, encoded, settings};
    use splatstream_decoder::operating_point::operating_points;
    use splatstream_encoder::{Importance, Settings};
    use splatstream_files::builtin::BuiltinScene;

    #[test]
    fn the_frames_of_a_point_take_what_the_point_takes() {
        let scene = BuiltinScene { gaussians: 300, frames: 4, sh_degree: 1, ..BuiltinScene::default() };
        let mut frames = (0..4).map(|number| scene.frame(number)).collect();
        let baseline = Settings { importance: Some(Importance::Volume), ..Settings::default() };
        let stream = encoded(&mut frames, &settings(baseline, 4)).unwrap();
        let infos = operating_points(&stream, &Limits::default()).unwrap();
        let whole = infos.iter().filter(|info| info.point.spatial == SPATIAL - 1);
        assert!(whole.clone().any(|info| info.point.temporal == TEMPORAL - 1));
        for info in whole {
            let sizes = sizes(&stream, info.point).unwrap();
            assert_eq!(sizes.values().sum::<u64>(), info.bytes, "{}", info.point);
            assert_eq!(sizes.len() as u32, info.frames, "{}", info.point);
        }
    }
}
