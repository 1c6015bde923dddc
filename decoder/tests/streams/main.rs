//! Whole streams through the decoder: properties that vectors cannot state, on small streams from a seed.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a panic is a failed test")]

mod bounds;
mod carried;
mod losses;
mod paths;
mod points;
mod write;
