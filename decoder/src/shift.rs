//! What compensation adds to Gaussians (7.8.3).

/// What is added to log-scales and opacities, in steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Shift {
    /// Added to each log-scale.
    pub log_scale: i8,
    /// Added to the opacity.
    pub opacity: i8,
}

impl Shift {
    /// True if nothing is added.
    pub fn is_zero(self) -> bool {
        self == Self::default()
    }
}
