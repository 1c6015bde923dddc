//! What a choice saves against the other one, as far as that can be told without encoding everything again.

/// What a bit is worth, squared steps: halving the step of a uniform quantiser takes a bit more and divides its error of a
/// twelfth of a square by four.
pub(crate) const BIT: f64 = 2.0 * core::f64::consts::LN_2 / 12.0;

/// A tool, or a choice, whose worth is told.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Tool {
    /// Axes sorted by size, or as they come: against the other.
    Axes,
    /// Principal components of spherical harmonics, against coefficients as they are.
    ShTransform,
    /// Coefficients of spherical harmonics or a codebook: against the other.
    ShCoding,
    /// Tables chosen by what has been decoded, against one table for each plane.
    Contexts,
    /// Tables of the refinement before, against tables of its own for each refinement.
    TableReuse,
    /// Steps that follow from the Gaussian, against the same for all.
    AdaptiveSteps,
    /// Refinements, against a single one.
    Refinements,
    /// Spatial layers, against a single one.
    SpatialLayers,
}

/// How a saving is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Basis {
    /// Both were coded.
    Measured,
    /// From entropies and from errors that are expected, on some of the Gaussians.
    Estimated,
}

/// What a choice saves.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Saving {
    /// What was chosen.
    pub tool: Tool,
    /// Bits per Gaussian of the first frame that it takes less than the other choice, at equal errors; below 0: more.
    pub bits: f64,
    /// How that is known.
    pub basis: Basis,
}

impl Saving {
    /// Of a choice that is coded both ways.
    pub(crate) fn measured(tool: Tool, bits: f64) -> Self {
        Self { tool, bits, basis: Basis::Measured }
    }

    /// Of a choice between estimates.
    pub(crate) fn estimated(tool: Tool, bits: f64) -> Self {
        Self { tool, bits, basis: Basis::Estimated }
    }

    /// Of a choice between bits and squared errors, of Gaussians in their own steps: what is chosen, and the other.
    pub(crate) fn between(tool: Tool, chosen: (f64, f64), other: (f64, f64)) -> Self {
        let cost = |(bits, error): (f64, f64)| bits + error / BIT;
        Self::estimated(tool, cost(other) - cost(chosen))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_count_as_the_bits_that_avoid_them() {
        let saving = Saving::between(Tool::ShCoding, (10.0, 1.0), (9.0, 1.0 + 3.0 * BIT));
        assert!((saving.bits - 2.0).abs() < 1e-9);
        assert_eq!(saving.basis, Basis::Estimated);
    }
}
