//! The rules of clauses 6 to 9 and of annexes A and B on streams made by hand: accepted ones decode to the planes
//! of the reference, broken ones are refused with class, code, clause and offset.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "a panic is a failed test")]
#![allow(dead_code, reason = "the builder offers more than a test needs")]

#[path = "../crafted/mod.rs"]
mod crafted;

mod blocks;
mod confined;
mod models;
mod order;
mod output;
mod points;
mod random;
mod relations;
mod reuse;
mod sample_stream;
mod values;
