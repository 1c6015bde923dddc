//! What an encoder can be given that it cannot encode.

use crate::finetune::StateError;
use splatstream_gaussians::{Defect, FrameError};
use splatstream_render::gradient::GradientError;

/// Errors of encoding. Those of reading a frame are the source's own.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// There is no frame.
    #[error("there is no frame to encode")]
    NoFrames,
    /// The refinement percentages are not a list the bitstream can carry.
    #[error("refinements {0:?}: give 1 to 10 increasing percentages, the last of them 100")]
    Refinements(Vec<u8>),
    /// A setting outside its range.
    #[error("{name} is {value}; allowed is {allowed}")]
    Setting {
        /// The setting.
        name: &'static str,
        /// Its value.
        value: String,
        /// What would be allowed.
        allowed: &'static str,
    },
    /// A frame has more Gaussians than a stream can carry.
    #[error("frame {frame} has {count} Gaussians, a frame holds at most {max}")]
    TooManyGaussians {
        /// The frame.
        frame: u32,
        /// Its Gaussians.
        count: usize,
        /// The most that a frame holds.
        max: u32,
    },
    /// A frame has so many Gaussians that those of one second are more than a stream can carry.
    #[error(
        "frame {frame} has {count} Gaussians, which is too many at this frame rate: one second holds at most {max}"
    )]
    TooManyPerSecond {
        /// The frame.
        frame: u32,
        /// Its Gaussians.
        count: usize,
        /// The most that one second holds.
        max: u64,
    },
    /// A frame takes more memory to encode than the settings allow.
    #[error(
        "frame {frame}: encoding {gaussians} Gaussians takes up to {asked} bytes of memory, at most {allowed} are allowed (max_memory)"
    )]
    OverMemory {
        /// The frame.
        frame: u32,
        /// Its Gaussians.
        gaussians: u64,
        /// Bytes that encoding takes at most, one GOP at a time.
        asked: u64,
        /// Bytes that it may take: [`Settings::max_memory`](crate::Settings::max_memory), less frames that wait.
        allowed: u64,
    },
    /// A frame has values that no frame may hold.
    #[error("frame {frame}: number of invalid Gaussians: {count}; for example {first}")]
    Invalid {
        /// The frame.
        frame: u32,
        /// Gaussians with such values.
        count: usize,
        /// One of the values.
        first: Defect,
    },
    /// An attribute cannot be put on its quantisation grid.
    #[error(
        "frame {frame}: {attribute} of Gaussian {row} is {value}, and with these quantisers a stream carries -{most} to {most}; \
         number of such Gaussians in the frame: {count}, farthest of all Gaussian {farthest_row} with {farthest}"
    )]
    OutOfGrid {
        /// The frame.
        frame: u32,
        /// The attribute.
        attribute: &'static str,
        /// The Gaussian, counted in the order of the source.
        row: usize,
        /// Its value.
        value: f32,
        /// The largest magnitude that the grid reaches.
        most: f32,
        /// Gaussians of the frame that are, in the same component of the attribute.
        count: usize,
        /// The one that is farthest out.
        farthest_row: usize,
        /// Its value.
        farthest: f32,
    },
    /// A pushed frame is not what the frames before it have announced.
    #[error(
        "frame {frame}: {property} is {value}, and {announced} was announced by the first frames; give the first frames as much"
    )]
    NotAnnounced {
        /// The frame.
        frame: u32,
        /// What differs.
        property: &'static str,
        /// What it is.
        value: String,
        /// What was announced.
        announced: String,
    },
    /// Some frames are antialiased and some are not. Frames without Gaussians count as either.
    #[error(
        "frame {frame}: antialiasing is {value}, other than in the frames before it, and a stream has one for all frames; give all of them the same"
    )]
    Antialiasing {
        /// The first frame that is not as those before it.
        frame: u32,
        /// Whether it is antialiased.
        value: bool,
    },
    /// The first frames that were pushed have no extent, so that nothing says where those of later frames may be.
    #[error(
        "the Gaussians of the first {frames} frames are at one point, or there are none, and the stream has to announce where all others \
         may be; push a GOP that shows the scene first, or encode all frames at once"
    )]
    NoExtent {
        /// Frames of the first GOP, and the one after it.
        frames: usize,
    },
    /// There are not so many GOPs.
    #[error(
        "{count} shards are asked for, more than the sequence has GOPs; the most that there can be: {most}; give fewer shards, or shorter GOPs"
    )]
    Shards {
        /// The number of shards.
        count: u32,
        /// The number of GOPs.
        most: u32,
    },
    /// The sequence has not the frames that it was planned with.
    #[error(
        "the number of frames is {found}, and was {planned} when the sequence was planned; give the same frames, or plan again"
    )]
    OtherFrames {
        /// Frames there are.
        found: u32,
        /// Frames there were.
        planned: u32,
    },
    /// A frame is not the one that was planned with.
    #[error(
        "frame {frame}: the number of Gaussians is {found}, and was {planned} when the sequence was planned; give the same frames, or plan again"
    )]
    OtherFrame {
        /// The frame.
        frame: u32,
        /// Its Gaussians.
        found: u32,
        /// Those it had.
        planned: u32,
    },
    /// A frame has other values than the one that was planned with.
    #[error(
        "frame {frame} is not the one that the sequence was planned with: its values differ; give the same frames, or plan again"
    )]
    ChangedFrame {
        /// The frame.
        frame: u32,
    },
    /// A setting is not the one that was planned with.
    #[error(
        "{name} is {found}, and was {planned} when the sequence was planned; give every shard the settings of the plan"
    )]
    OtherSetting {
        /// The setting.
        name: &'static str,
        /// What it is.
        found: String,
        /// What it was.
        planned: String,
    },
    /// A record is not one of a plan.
    #[error("the plan is damaged: {0}; make it again")]
    Plan(&'static str),
    /// How far fitting to pictures has come cannot be kept or read.
    #[error(transparent)]
    FinetuneState(#[from] StateError),
    /// A frame could not be read.
    #[error("frame {frame}: {source}")]
    Source {
        /// The frame.
        frame: u32,
        /// Why.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
    /// Somebody has ended the work: see [`Encoder::set_cancel`](crate::Encoder::set_cancel).
    #[error("encoding was cancelled")]
    Cancelled,
    /// The stream could not be written.
    #[error("the stream cannot be written: {0}")]
    Output(#[from] std::io::Error),
    /// The stream that was written does not decode to what it should: the encoder is at fault.
    #[error(
        "the stream was written and then decoded for a check, which failed: {0}; please report this, with the scene"
    )]
    Verification(splatstream_format::Error),
    /// The planes that were reconstructed make no frame: the encoder is at fault.
    #[error("reconstruction failed: {0}; please report this, with the scene")]
    Reconstruction(#[from] FrameError),
    /// Pictures that values are fitted to do not go together: the encoder is at fault.
    #[error("fitting to pictures failed: {0}; please report this, with the scene")]
    Finetune(#[from] GradientError),
    /// What the encoder has counted itself does not hold: the encoder is at fault.
    #[error("encoding failed: {0}; please report this, with the scene")]
    Fault(&'static str),
    /// The syntax refuses what the encoder wants to write.
    #[error("the bitstream cannot carry this: {0}")]
    Syntax(#[from] splatstream_format::Error),
}
