//! Gradients of pictures and of losses against finite differences of a model in 64 bits, laws that they keep, and steps
//! against them.
#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

mod adam;
mod attributes;
mod laws;
mod losses;
mod model;
mod scenes;
