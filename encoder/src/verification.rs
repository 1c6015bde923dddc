//! The finished stream, decoded and looked at: what its pictures are worth in views that decide nothing, and, where a PSNR is
//! asked for, in the views that decide how fine all steps together are.
//!
//! While a stream is written the units of up to three of its GOPs are kept: those of the first, the middle and the last
//! frame. Each is decoded when it is complete, as any receiver would who starts there, and a few of its frames are
//! drawn beside those of the source: some strips of each picture, which have nearly the errors of all of it. What is
//! measured is the stream, not what the encoder believes of it; but in the views of the fit a plain frame is not drawn
//! again, where fitting has drawn it with the steps that it is coded with: both differ by 0.02 dB.

use crate::error::Error;
use crate::report::{PictureReport, VerifiedFrame};
use crate::settings::{Preset, Settings};
use crate::source::FrameSource;
use crate::strips::StripViews;
use core::ops::Range;
use splatstream_decoder::output::to_gaussians;
use splatstream_decoder::process::{DecodedFrame, Decoder, Options};
use splatstream_format::Limits;
use splatstream_format::syntax::{FrameType, GopHeader, UnitHeader};
use splatstream_format::unit::Stream;
use splatstream_gaussians::GaussianFrame;
use splatstream_render::Rendering;
use splatstream_render::camera::held_out_twice;

/// Views of each frame that decide nothing, as many as there are that decide, and their height: with other heights PSNR is
/// another number.
const VIEWS: u32 = 4;
pub(crate) const HEIGHT: u32 = 540;

/// Of so many strips of a view one is drawn: of those that decide how fine steps are, and of those that decide nothing; and
/// for the fast preset of either.
pub(crate) const EVERY: [u32; 2] = [6, 12];
const EVERY_FAST: u32 = 12;

/// Keeps units while they are written, and the frames that they decode to.
pub(crate) struct Verifier {
    /// The frame of the sequence that the stream begins with.
    first: u32,
    /// Display indices of the first, the middle and the last frame.
    wanted: [u32; 3],
    /// The file header and the sequence parameters.
    head: Vec<u8>,
    /// The units of the current GOP and which frames of it are taken; none if it is not decoded.
    gop: Option<(Vec<u8>, Taken)>,
    frames: Vec<Decoded>,
}

/// What is known of the first frame before it is coded.
pub(crate) struct Tried {
    /// The views that decide nothing.
    pub(crate) unseen: StripViews,
    /// PSNR in those that decide how fine all steps together are, decibels, drawn with the steps that it is coded with.
    pub(crate) psnr: f64,
}

/// A frame as a receiver has it.
struct Decoded {
    number: u32,
    frame_type: FrameType,
    frame: GaussianFrame,
}

/// Which frames of a GOP are taken.
#[derive(Clone, Copy)]
enum Taken {
    /// The last of each type.
    OfEachType,
    /// One.
    Only(u32),
}

impl Verifier {
    /// For a stream of these frames of a sequence.
    pub(crate) fn new(frames: Range<u32>) -> Self {
        let (first, last) = (frames.start, frames.end.saturating_sub(frames.start).saturating_sub(1));
        Self { first, wanted: [0, last / 2, last], head: Vec::new(), gop: None, frames: Vec::new() }
    }

    /// Takes what stands at the beginning of the stream.
    pub(crate) fn head(&mut self, bytes: &[u8]) {
        self.head.extend_from_slice(bytes);
    }

    /// A GOP begins.
    ///
    /// # Errors
    /// The GOP before does not decode.
    pub(crate) fn start_gop(&mut self, header: &GopHeader, first: u32) -> Result<(), Error> {
        self.end_gop()?;
        let frames = first..first.saturating_add(header.gop_frame_count);
        let [start, middle, end] = self.wanted;
        let taken = match frames.contains(&middle) {
            true => Some(Taken::OfEachType),
            false => [start, end].into_iter().find(|frame| frames.contains(frame)).map(Taken::Only),
        };
        self.gop = taken.map(|taken| (Vec::new(), taken));
        Ok(())
    }

    /// Takes a unit as it is written.
    ///
    /// # Errors
    /// None of a unit that can be written.
    pub(crate) fn unit(&mut self, header: &UnitHeader, payload: &[u8]) -> Result<(), Error> {
        if let Some((units, _)) = &mut self.gop {
            units.extend(header.to_bytes()?);
            units.extend_from_slice(payload);
        }
        Ok(())
    }

    /// Decodes the GOP that has ended.
    ///
    /// # Errors
    /// A GOP that does not decode.
    pub(crate) fn end_gop(&mut self) -> Result<(), Error> {
        let Some((units, taken)) = self.gop.take() else { return Ok(()) };
        let bytes = [self.head.as_slice(), &units].concat();
        let limits = Limits::of_level(*Limits::LEVELS.end());
        let stream = Stream::open(&bytes, &limits).map_err(Error::Verification)?;
        let mut decoder = Decoder::starting_inside(stream.header(), Options { limits, ..Options::default() });
        let memory = decoder.memory().clone();
        let mut found: [Option<DecodedFrame>; 3] = [const { None }; 3];
        let mut take = |frame: DecodedFrame| {
            if matches!(taken, Taken::OfEachType) || matches!(taken, Taken::Only(one) if one == frame.index) {
                let [intra, predicted, enhancement] = &mut found;
                let slot = match frame.frame_type {
                    FrameType::Intra => intra,
                    FrameType::Predicted => predicted,
                    FrameType::Enhancement => enhancement,
                };
                let before = slot.replace(frame);
                before.into_iter().for_each(|frame| memory.recycle_integers(frame.planes));
            } else {
                memory.recycle_integers(frame.planes);
            }
        };
        let mut units = stream.units();
        // These bytes have no end unit.
        while units.position() < bytes.len() as u64 {
            let Some(unit) = units.next_unit() else { break };
            decoder.unit(&unit.map_err(Error::Verification)?).into_iter().for_each(&mut take);
        }
        decoder.finish().into_iter().for_each(&mut take);
        if let Some(&error) = decoder.errors().first() {
            return Err(Error::Verification(error));
        }
        let Some(sequence) = decoder.sequence() else { return Ok(()) };
        for frame in found.into_iter().flatten() {
            let (number, frame_type) = (frame.index, frame.frame_type);
            let frame = to_gaussians(frame.into_shown(), sequence)?;
            self.frames.push(Decoded { number, frame_type, frame });
        }
        Ok(())
    }

    /// Draws the frames that were taken beside those of the source. `tried`: what is known of the only frame, if a decoder
    /// has of it what was drawn then.
    ///
    /// # Errors
    /// A source that cannot be read again.
    pub(crate) fn compare(
        mut self,
        source: &mut dyn FrameSource,
        settings: &Settings,
        tried: Option<&Tried>,
    ) -> Result<PictureReport, Error> {
        self.frames.sort_by_key(|decoded| decoded.number);
        let has_goal = settings.psnr.is_some() && settings.size.is_none();
        let mut frames = Vec::new();
        for Decoded { number, frame_type, frame } in self.frames {
            let number = self.first.saturating_add(number);
            // The source is read again rather than kept beside what was decoded: a frame may fill the memory.
            let mut original =
                || source.original(number).map_err(|source| Error::Source { frame: number, source });
            let (unseen, of_fit) = match tried {
                Some(tried) => (tried.unseen.clone(), None),
                None => {
                    let Views { unseen, of_fit } = Views::of(&original()?, settings);
                    (unseen, has_goal.then_some(of_fit))
                }
            };
            let draw = |views: &StripViews| -> Vec<Rendering> { views.draw(&frame).collect() };
            let (drawn_unseen, drawn_of_fit) = (draw(&unseen), of_fit.as_ref().map(draw));
            drop(frame);
            let original = original()?;
            let psnr = unseen.mean_psnr(&original, &drawn_unseen)?;
            let of_fit = of_fit.zip(drawn_of_fit);
            let fitted_psnr = of_fit.map(|(views, drawn)| views.mean_psnr(&original, &drawn)).transpose()?;
            let known = tried.map(|tried| tried.psnr).filter(|_| has_goal);
            frames.push(VerifiedFrame {
                number,
                frame_type,
                psnr,
                fitted_psnr: fitted_psnr.flatten().or(known),
            });
        }
        Ok(PictureReport { frames, views: VIEWS, height: HEIGHT })
    }
}

/// Views of a frame.
pub(crate) struct Views {
    /// Those that decide nothing.
    pub(crate) unseen: StripViews,
    /// Those that decide how fine all steps together are.
    pub(crate) of_fit: StripViews,
}

impl Views {
    /// Of the views that a scene comes with, or all around it; each set lies between the other.
    pub(crate) fn of(frame: &GaussianFrame, settings: &Settings) -> Self {
        let [of_fit, of_report] = match settings.preset {
            Preset::Fast => [EVERY_FAST; 2],
            Preset::Balanced | Preset::Small => EVERY,
        };
        let [cameras, other] = held_out_twice(frame, settings.up(), &settings.cameras, VIEWS, HEIGHT);
        let strips = |cameras, every| StripViews::new(cameras, every, frame);
        Self { unseen: strips(other, of_report), of_fit: strips(cameras, of_fit) }
    }
}
