//! The rules of profile 1 on streams made by hand: accepted ones decode to the frames of the reference at every
//! operating point and with every loss, broken ones are refused with class and code.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "a panic is a failed test")]
#![allow(dead_code, reason = "the builder offers more than a test needs")]

#[path = "../crafted/mod.rs"]
mod crafted;

mod stream;

mod cells;
mod contexts;
mod headers;
mod learned;
mod losses;
mod models;
mod points;
mod prediction;
mod profiles;
mod random;
mod shown;
mod structure;
mod values;
mod verdicts;
mod weights;
