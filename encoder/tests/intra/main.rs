//! Profile Intra, and what every frame is coded with: values, grids, real scenes.
#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::print_stdout,
    missing_docs,
    reason = "a panic is a failed test, and a test that is skipped says so"
)]

mod grids;
mod meaning;
mod real_scenes;
mod round_trip;

#[path = "../common/mod.rs"]
mod common;
