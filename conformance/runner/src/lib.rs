//! Runs a decoder on the vectors of the conformance suite and says, of every case, whether it is right and where it
//! is not.
//!
//! A [`case`] is a [`vector`] at an operating point, shown in a mode. A [`session`] asks the decoder under test, within
//! [`limits`]; [`judge`] compares its answer and its files with the record; [`difference`] says where wrong values part
//! from right ones. [`mod@run`] does all of it for many cases; [`report`] tells people and machines.
//!
//! The runner believes nothing: it hashes the files itself, ends whole process groups, and tells apart a stream that was
//! rejected, one that was rejected as something else, a crash and a timeout. `conformance/planted` holds decoders with
//! one fault each, and the tests of this crate demand that each is caught for its own fault.

pub mod answer;
pub mod attribute;
pub mod capabilities;
mod carrier;
pub mod case;
pub mod command;
pub mod difference;
mod digest;
pub mod error;
pub mod expectations;
pub mod feature;
mod group;
mod guard;
pub mod judge;
pub mod limits;
pub mod matrix;
pub mod nearest;
pub mod output;
pub mod protocol;
pub mod reference;
pub mod report;
mod resemblance;
pub mod result;
pub mod run;
pub mod selection;
pub mod serve;
pub mod session;
pub mod stop;
pub mod suite;
pub mod symptom;
pub mod vector;

pub use carrier::Carrier;
