//! Cases: a vector at an operating point, shown in a mode.

use crate::protocol::EVERYTHING;
use crate::suite::{Located, Suite};
use crate::vector::{Mode, Point, State, Vector, Verdict};
use splatstream_decoder::operating_point::OperatingPoint;
use std::fmt;
use std::path::Path;

/// One thing to ask of a decoder, and what is right.
#[derive(Debug, Clone, Copy)]
pub struct Case<'a> {
    /// The vector.
    pub vector: &'a Vector,
    /// Its stream.
    pub stream: &'a Path,
    /// How it is decoded; none for a vector without points: everything, in full.
    pub point: Option<&'a Point>,
}

impl<'a> Case<'a> {
    /// All cases of a suite, in its order.
    pub fn all(suite: &'a Suite) -> Vec<Self> {
        suite.vectors.iter().flat_map(Self::of).collect()
    }

    fn of(Located { vector, stream, .. }: &'a Located) -> Vec<Self> {
        let case = |point| Case { vector, stream, point };
        match vector.points.as_slice() {
            [] => vec![case(None)],
            points => points.iter().map(|point| case(Some(point))).collect(),
        }
    }

    /// The operating point, as 7.11 writes it.
    pub fn op(&self) -> &'a str {
        self.point.map_or(EVERYTHING, |point| &point.op)
    }

    /// What is shown.
    pub fn mode(&self) -> Mode {
        self.point.map_or(Mode::Full, |point| point.mode)
    }

    /// The outcomes that are right, the reference's first.
    pub fn verdicts(&self) -> Vec<&'a Verdict> {
        let own = self.point.and_then(|point| point.expect.as_ref());
        let vector: &'a Vector = self.vector;
        std::iter::once(own.unwrap_or(&vector.expect)).chain(&vector.acceptable).collect()
    }

    /// The frames that are shown, in display order; none if the vector does not say, so that any are right.
    pub fn states(&self) -> Option<Vec<&'a State>> {
        let vector: &'a Vector = self.vector;
        states_of(vector, self.point)
    }

    /// Whether the operating point is the highest or the lowest of the vector's.
    pub(crate) fn is_extreme(&self, highest: bool) -> bool {
        let point =
            |op: &str| op.parse().ok().map(|op: OperatingPoint| [op.spatial, op.temporal, op.refinement]);
        let Some(own) = point(self.op()) else { return true };
        let mut others = self.vector.points.iter().filter_map(|other| point(&other.op));
        let beyond = |other: [u8; 3]| {
            own.iter().zip(other).any(|(&own, other)| if highest { own < other } else { own > other })
        };
        !others.any(beyond)
    }
}

/// The frames of a vector that a point shows.
pub(crate) fn states_of<'a>(vector: &'a Vector, point: Option<&'a Point>) -> Option<Vec<&'a State>> {
    match point.and_then(|point| point.states.as_ref()) {
        Some(indices) => Some(indices.iter().filter_map(|&index| vector.states.get(index)).collect()),
        None if vector.states.is_empty() => None,
        None => Some(vector.states.iter().collect()),
    }
}

impl fmt::Display for Case<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}@{}/{}", self.vector.name, self.op(), self.mode())
    }
}
