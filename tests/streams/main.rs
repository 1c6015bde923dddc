//! Streams of the conformance suite through every way into the decoder.

#![cfg(test)]

mod ahead;
mod arrival;
mod bounds;
mod operating_points;
mod orders;
mod readme;
mod slots;
mod vectors;
