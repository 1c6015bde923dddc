//! Gradients of pictures and of losses against finite differences of a model in 64 bits, and laws that they keep.
#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

mod attributes;
mod laws;
mod losses;
mod model;
mod scenes;
