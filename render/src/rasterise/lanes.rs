//! The size of a tile, and of what is done at once.

/// Pixels on a side of a tile.
pub(crate) const TILE: usize = 16;

/// One value for each pixel of a line of a tile.
pub(crate) type Lanes = [f32; TILE];
