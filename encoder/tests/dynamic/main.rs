//! Profile Dynamic: what is encoded comes back, whole, in layers and in part.
#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::print_stdout,
    missing_docs,
    reason = "a panic is a failed test, and a test that is skipped says so"
)]

mod chain;
mod damage;
mod learned;
mod nested;
mod points;
mod real;
mod round_trip;
mod stability;
mod untracked;

#[path = "../common/mod.rs"]
mod common;
