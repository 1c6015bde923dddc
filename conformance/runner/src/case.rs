//! Cases: a vector at an operating point in a mode.

use crate::error::{Error, Result};
use crate::inside;
use crate::protocol::EVERYTHING;
use crate::suite::{Located, Suite};
use crate::vector::{Mode, Point, State, Step, Vector, Verdict};
use splatstream_decoder::operating_point::OperatingPoint;
use std::fmt;
use std::path::Path;

/// One request to a decoder, and the right answers.
#[derive(Debug, Clone, Copy)]
pub struct Case<'a> {
    /// The vector.
    pub vector: &'a Vector,
    /// Its stream.
    pub stream: &'a Path,
    /// The operating point; none for a vector without points: everything, in full.
    pub point: Option<&'a Point>,
    /// Length of the prefix that is decoded; none for all of the stream.
    pub cut: Option<u64>,
}

impl<'a> Case<'a> {
    /// All cases of a suite, in its order.
    pub fn all(suite: &'a Suite) -> Vec<Self> {
        suite.vectors.iter().flat_map(Self::of).collect()
    }

    fn of(Located { vector, stream, .. }: &'a Located) -> Vec<Self> {
        let case = |point| Case { vector, stream, point, cut: None };
        match vector.points.as_slice() {
            [] => vec![case(None)],
            points => points.iter().map(|point| case(Some(point))).collect(),
        }
    }

    /// The operating point, as 7.2 writes it.
    pub fn op(&self) -> &'a str {
        self.point.map_or(EVERYTHING, |point| &point.op)
    }

    /// The mode.
    pub fn mode(&self) -> Mode {
        match self.vector.inside {
            Some(_) => Mode::Inside,
            None => self.point.map_or(Mode::Full, |point| point.mode),
        }
    }

    /// The cases of the prefixes of a swept stream, which together are this case; none for another vector.
    pub fn prefixes(self) -> Option<impl Iterator<Item = Self>> {
        let bytes = self.vector.bytes;
        self.vector.sweep.as_ref().map(|_| (0..bytes).map(move |cut| Case { cut: Some(cut), ..self }))
    }

    /// What the decoder gets: the stream, a prefix of it, or the parts of it that a decoder gets which starts inside.
    ///
    /// # Errors
    /// The stream cannot be read.
    pub fn input(&self) -> Result<Vec<u8>> {
        let mut bytes = std::fs::read(self.stream).map_err(Error::file("read", self.stream))?;
        if let Some(cut) = self.cut {
            bytes.truncate(usize::try_from(cut).unwrap_or(usize::MAX));
        }
        Ok(match self.vector.inside {
            Some(at) => inside::input(&bytes, at),
            None => bytes,
        })
    }

    /// Whether the decoder gets the stream as it is.
    pub(crate) fn is_whole(&self) -> bool {
        self.cut.is_none() && self.vector.inside.is_none()
    }

    /// The right answers, that of the reference first.
    pub fn verdicts(&self) -> Vec<Verdict> {
        match self.point.and_then(|point| point.expect.as_ref()) {
            Some(own) => vec![own.clone()],
            None => {
                let mut all = vec![self.vector.expect.clone()];
                let others = self.vector.acceptable.iter().map(Verdict::from);
                all.extend(others.filter(|other| {
                    (other.class, &other.code) != (self.vector.expect.class, &self.vector.expect.code)
                }));
                all
            }
        }
    }

    /// The frames that are shown, in display order; none if the vector does not say, so that any are right.
    pub fn states(&self) -> Option<Vec<&'a State>> {
        let vector: &'a Vector = self.vector;
        let state = |index: &usize| vector.states.get(*index);
        match (&vector.sweep, self.cut) {
            (Some(sweep), Some(cut)) => {
                let is_before = |step: &&Step| step.bytes <= cut;
                let step = sweep.steps.iter().rfind(is_before);
                Some(step.map_or_else(Vec::new, |step| step.states.iter().filter_map(state).collect()))
            }
            (Some(_), None) => None,
            (None, _) => states_of(vector, self.point),
        }
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
