//! Playback in virtual time over a known network: exact, and the same on every machine.
//!
//! ```
//! use splatstream_stream::control::{Layered, Settings};
//! use splatstream_stream::simulation::{Link, Trace, ladders, simulate};
//!
//! let ladder = ladders::small(30);
//! let report = simulate(&ladder, &Settings::default(), Layered::default(), &Link::new(Trace::constant(8_000_000)));
//! assert_eq!(report.shown.len(), 30);
//! assert_eq!(report.stalled_us(), 0);
//! ```

pub mod ladders;
mod request;
mod run;
mod trace;

pub use request::Requests;
pub use run::{Link, Report, simulate};
pub use trace::{Trace, TraceError};
