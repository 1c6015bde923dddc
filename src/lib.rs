//! SplatStream: scalable, dynamic 3D Gaussian splatting in one stream. This crate is the way in for engines, players and
//! servers.
//!
//! A file, frame by frame:
//!
//! ```no_run
//! for frame in splatstream::Decoder::open("talk.gss")? {
//!     let frame = frame?;
//!     println!("frame {}: {} Gaussians", frame.index(), frame.gaussians().len());
//! }
//! # Ok::<(), splatstream::Error>(())
//! ```
//!
//! Bytes as they arrive, from a network for example. The decoder keeps those that it still needs:
//!
//! ```
//! # let stream = include_bytes!("../examples/talk.gss").to_vec();
//! let mut decoder = splatstream::Decoder::new();
//! for chunk in stream.chunks(1000) {
//!     decoder.push(chunk)?;
//!     while let Some(frame) = decoder.next_frame()? {
//!         println!("frame {}: {} Gaussians", frame.index(), frame.len());
//!     }
//! }
//! decoder.end();
//! while let Some(frame) = decoder.next_frame()? {
//!     println!("frame {}: the last", frame.index());
//! }
//! # Ok::<(), splatstream::Error>(())
//! ```
//!
//! * [`Decoder`] takes a file, bytes in memory, or chunks; it [seeks](Decoder::seek), and changes its
//!   [operating point](Decoder::set_operating_point).
//! * [`Frame`] has the Gaussians as planes of f32 or of integers, and [what was lost](Frame::warnings).
//! * [`Slots`] keeps each Gaussian at its place from frame to frame, and says what has changed: what a renderer uploads.
//! * [`Limits`] bound memory, work and output before anything is allocated; [`Cancel`] ends the work on a frame. The
//!   defaults are safe for a server that decodes what strangers send; a player takes [`Limits::without_totals`].
//! * [`Encoder`] takes frames as they come and writes a stream, GOP by GOP.
//!
//! No input panics or aborts. A damaged stream gives the frames that are left, with warnings; damage costs at most the GOP
//! (group of pictures) that it is in.
//!
//! Programs in C and C++ use the same decoder through `bindings/c` of the repository: a static or shared library, and the
//! header `splatstream.h`; those in Python through `bindings/python`. Compiled for wasm32-unknown-unknown it imports nothing; `bindings/web` has it as an npm package,
//! and a player for web pages.
//!
//! The format is specified in the `spec/` folder of the repository. The crates below this one are its parts, for
//! inspectors and for other encoders; their interfaces change more often.

mod decoder;
mod error;
mod extract;
mod frame;
mod limits;
mod slots;
mod source;

pub use decoder::{Decoder, Position};
pub use error::{Error, Result, Warning};
pub use extract::extract;
pub use frame::Frame;
pub use limits::Limits;
pub use slots::{Slots, Update};

/// A frame as planes of integers on the grids of the stream: what decoders compare.
pub use splatstream_decoder::frame::QuantizedFrame as Integers;
/// Ends the work of a [`Decoder`] from another thread: see [`Decoder::set_cancel`].
pub use splatstream_decoder::interrupt::Interrupt as Cancel;
pub use splatstream_decoder::operating_point::{OperatingPoint, ParseOperatingPointError};
#[cfg(feature = "encode")]
pub use splatstream_encoder::{Encoder, Error as EncodeError, FrameSource, Report, Settings, encode};
/// What is wrong with the bytes of a stream: where, by which clause, and what.
pub use splatstream_format::{Class, Error as StreamError};
pub use splatstream_gaussians::{GaussianFrame, Planes, PlanesRef};

/// What a stream says of its scene.
pub mod scene {
    pub use splatstream_format::payload::{ColourSpace, SceneDescription, Sorting, UpAxis};
    pub use splatstream_format::syntax::Camera;
}

/// A sequence encoded in parts, on as many machines as there are, and streams that are joined.
///
/// A plan settles what holds for all frames; each machine encodes a shard, some whole GOPs, by it; joined, they are the bytes
/// of [`encode`], whatever the number of shards. Streams with the same parameters are joined one after the other.
///
/// ```
/// # use splatstream_files::builtin::BuiltinScene;
/// use splatstream::parts::{StreamPart, concat, plan};
/// use splatstream::{Settings, encode};
///
/// # let scene = BuiltinScene { gaussians: 60, frames: 4, ..BuiltinScene::default() };
/// # let mut frames: Vec<_> = (0..4).map(|number| scene.frame(number)).collect();
/// let settings = Settings { gop: 2, ..Settings::default() };
/// let plan = plan(&mut frames, &settings)?;
/// let mut shards = vec![Vec::new(); 2];
/// for (number, shard) in (1..).zip(&mut shards) {
///     plan.encode_shard(&mut frames, (number, 2), shard, &mut |_, _| ())?;
/// }
///
/// let limits = splatstream::parts::StreamLimits::default();
/// let parts = shards.iter().map(|shard| StreamPart::scan(&mut shard.as_slice(), &limits)).collect::<Result<Vec<_>, _>>()?;
/// let mut joined = Vec::new();
/// concat(&parts, &mut |part| Ok(Box::new(shards[part].as_slice())), &mut joined, &limits)?;
///
/// let mut single = Vec::new();
/// encode(&mut frames, &settings, &mut single, &mut |_, _| ())?;
/// assert_eq!(joined, single);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[cfg(feature = "encode")]
pub mod parts {
    pub use splatstream_encoder::{
        ConcatError, Concatenated, PartError, Plan, PlanRecord, StreamPart, concat, plan,
    };
    /// What a part may hold: bounds of syntax elements, by level.
    pub use splatstream_format::Limits as StreamLimits;
}

/// What the fields of [`Settings`] hold.
#[cfg(feature = "encode")]
pub mod settings {
    pub use splatstream_encoder::{
        Anchor, Attribute, Fidelity, Finetune, FinetuneLoss, FinetuneProgress, FinetuneState, FinetuneWatch,
        Importance, Laws, NetworkSource, Photograph, PointWeight, PredictorChoice, Predictors, Preset,
        Quality, ShChoice, Size, Steps, Structure, Tools,
    };
    pub use splatstream_format::payload::SceneDescription;
}
