//! What has a step of its own.

use crate::steps::Steps;

/// What has a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Attribute {
    /// Centres.
    Position,
    /// Natural logs of semi-axes.
    LogScale,
    /// Quaternions.
    Rotation,
    /// Opacity logits.
    Opacity,
    /// The constant part of the colour.
    Dc,
    /// Spherical harmonics of degree 1 and up.
    Sh,
}

/// All of them, in the order of their discriminants.
pub(crate) const ATTRIBUTES: [Attribute; 6] = [
    Attribute::Position,
    Attribute::LogScale,
    Attribute::Rotation,
    Attribute::Opacity,
    Attribute::Dc,
    Attribute::Sh,
];

impl Attribute {
    /// Makes a step coarser by `factor`, within what is sensible.
    pub(crate) fn scale(self, steps: &mut Steps, factor: f64) {
        let scaled =
            |step: f32, most: f32| ((f64::from(step) * factor) as f32).clamp(2.0_f32.powi(-20), most);
        match self {
            Self::Position => {
                steps.position_bits = (steps.position_bits - libm::log2(factor) as f32).clamp(1.0, 20.0);
            }
            Self::LogScale => steps.log_scale = scaled(steps.log_scale, 2.0),
            Self::Rotation => steps.rotation = scaled(steps.rotation, 0.5),
            Self::Opacity => steps.opacity = scaled(steps.opacity, 4.0),
            Self::Dc => steps.dc = scaled(steps.dc, 4.0),
            Self::Sh => steps.sh = scaled(steps.sh, 4.0),
        }
    }
}
