//! Control of adaptive players: what to fetch next, when to wait, when to give a request up, how fast to play.
//!
//! All of it is computation: no clock, no network, no threads. A [`Session`] is told what happened and answers with
//! [`Decision`]s; the simulator, a native client and a browser drive the same one. Equal events give equal decisions on every
//! machine.
//!
//! A [`Ladder`] says what can be fetched. [`Layered`] is the rule for layered streams; the others are for comparison.
//!
//! ```
//! use splatstream_stream::control::{Decision, Layered, Session, Settings};
//! use splatstream_stream::simulation::ladders;
//!
//! let mut session = Session::new(ladders::small(10), Settings::default(), Layered::default(), 0);
//! // Nothing is known of the network: the base of the first GOP comes first.
//! let Decision::Fetch(fetch) = session.decide(0) else { panic!("nothing is there yet") };
//! assert_eq!((fetch.gop(), fetch.ranges()[0].representation), (0, 0));
//! // The response begins after 0.1 s and ends after 0.2 s, and playback begins.
//! session.received(100_000, 0);
//! session.received(200_000, fetch.bytes());
//! assert_eq!(session.state().shown().len(), 1);
//! ```

mod baselines;
mod driven;
mod fetch;
pub(crate) mod ladder;
mod layered;
mod levels;
mod live;
pub(crate) mod number;
mod options;
mod plan;
mod rule;
mod session;
mod single;
mod state;
mod throughput;

pub use baselines::{Bola, BufferRule, ThroughputRule};
pub use fetch::Fetch;
pub use ladder::{
    Description, Gop, Ladder, LadderError, Layer, OperatingPoint, Piece, Point, Representation,
};
pub use layered::{Layered, Weights};
pub use levels::Levels;
pub use options::{Choice, Limits, Range, choices, order, whole_ranges};
pub use rule::{Decision, Rule};
pub use session::Session;
pub use single::{Pick, Rung, Single, SingleRule, Situation};
pub use state::{Live, Playback, Request, Settings, Shown, State};
pub use throughput::{MOST_ERROR, Network, Transfer};
