//! Increments: clauses 7.4 to 7.7. Entropy-coded [`values`] in, a [list](crate::list) of Gaussians out.
//!
//! [`values::PreparedSections::decode`] parses a unit without knowing any other frame; [`apply`] then changes the
//! parents and adds the new Gaussians. The encoder calls [`apply`] with the values it has chosen.

pub mod prediction;
pub mod residual;
pub mod values;

mod apply;

pub(crate) use apply::is_idle;
pub use apply::{Applied, Situation, Temporal, Unit, apply, field, reference_set};
