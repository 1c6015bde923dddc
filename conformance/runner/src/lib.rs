//! Runs a decoder on the vectors of the conformance suite and reports which cases are wrong and where.
//!
//! A [`case`] is a [`vector`] at an operating point in a mode. A [`session`] runs the decoder under test within [`limits`];
//! [`judge`] compares its answer and its files with the record; [`difference`] finds the first wrong value. [`mod@run`] does
//! this for many cases; [`report`] presents the results to people and programs.
//!
//! The runner trusts nothing that a decoder reports: it hashes the files itself, kills whole process groups, and
//! distinguishes a rejection, a rejection with the wrong class, a crash and a timeout. `conformance/planted` has decoders
//! with one error each; its tests check that each is found for its own error.

pub mod answer;
pub mod attribute;
pub mod cancel;
pub mod capabilities;
pub mod case;
pub mod command;
pub mod counted;
pub mod difference;
mod digest;
pub mod error;
pub mod expectations;
pub mod feature;
mod files;
mod inside;
pub mod judge;
pub mod limits;
pub mod matrix;
pub mod output;
pub mod packages;
mod process_group;
pub mod protocol;
pub mod reference;
pub mod report;
mod resemblance;
pub mod result;
pub mod run;
pub mod selection;
pub mod serve;
pub mod session;
mod source_unit;
pub mod suggest;
pub mod suite;
pub mod symptom;
pub mod vector;
mod watchdog;

pub use source_unit::SourceUnit;
