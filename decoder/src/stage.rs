//! Clause 7.7: the order in which attributes are reconstructed.

use crate::layout::Attribute;

/// The attributes in the order in which they are reconstructed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// Log-scales.
    LogScale,
    /// Opacity.
    Opacity,
    /// Rotation.
    Rotation,
    /// dc.
    Dc,
    /// sh.
    Sh,
}

impl Stage {
    /// Every attribute, in order.
    pub const ALL: [Self; 5] = [Self::LogScale, Self::Opacity, Self::Rotation, Self::Dc, Self::Sh];

    /// That of the planes of an attribute, if it is one of those.
    pub const fn of(attribute: Attribute) -> Option<Self> {
        match attribute {
            Attribute::LogScale => Some(Self::LogScale),
            Attribute::Opacity => Some(Self::Opacity),
            Attribute::Rotation => Some(Self::Rotation),
            Attribute::Dc => Some(Self::Dc),
            Attribute::Sh => Some(Self::Sh),
            _ => None,
        }
    }
}
