//! Smaller streams from a stream.

use crate::error::{Error, Result};
use crate::limits::Limits;
use splatstream_decoder::operating_point::{self, OperatingPoint};

/// The stream that holds just the units of an operating point: a client of that point decodes the same frames from it.
///
/// # Errors
/// A stream whose units cannot be told apart, and damage in units that belong to the point.
///
/// ```
/// # let stream = include_bytes!("../examples/talk.gss").to_vec();
/// let small = splatstream::extract(&stream, "s0,t0,r1".parse()?, &Default::default())?;
/// assert!(small.len() < stream.len());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn extract(bytes: &[u8], point: OperatingPoint, limits: &Limits) -> Result<Vec<u8>> {
    operating_point::extract(bytes, point, &limits.of_format()).map_err(Error::from)
}
