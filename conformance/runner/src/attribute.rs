//! The attributes of a frame as files: groups of the canonical planes of clause 7.9.1.

use serde::{Deserialize, Serialize};
use splatstream_decoder::frame::QuantizedFrame;
use std::fmt;

/// A group of canonical planes; the order is that of the planes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Attribute {
    /// Planes 0 to 2: positions in steps of the grid.
    Position,
    /// Planes 3 to 5, steps, compensated (7.8.3).
    LogScale,
    /// Plane 6, steps, compensated.
    Opacity,
    /// Planes 7 to 9: x, y and z of the quaternion, steps.
    Rotation,
    /// Planes 10 to 12: red, green, blue, 64ths of a step.
    Dc,
    /// Planes 13 and after, 64ths of a step; there if the sequence has spherical harmonics.
    Sh,
}

impl Attribute {
    /// All of them, in order.
    pub const ALL: [Self; 6] =
        [Self::Position, Self::LogScale, Self::Opacity, Self::Rotation, Self::Dc, Self::Sh];

    /// The word in records and in names of files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Position => "position",
            Self::LogScale => "log_scale",
            Self::Opacity => "opacity",
            Self::Rotation => "rotation",
            Self::Dc => "dc",
            Self::Sh => "sh",
        }
    }

    /// The values of the group in a frame, plane after plane, Gaussians in the order of the frame.
    pub fn values(self, frame: &QuantizedFrame) -> Vec<i32> {
        match self {
            Self::Position => {
                // Below 2^position_bits, at most 2^24: always an i32.
                let plane = |plane: &Vec<u32>| plane.iter().map(|&value| value.cast_signed()).collect();
                frame.position.iter().map(plane).collect::<Vec<Vec<i32>>>().concat()
            }
            Self::LogScale => frame.log_scale.concat(),
            Self::Opacity => frame.opacity.clone(),
            Self::Rotation => frame.rotation.concat(),
            Self::Dc => frame.dc.concat(),
            Self::Sh => frame.sh.concat(),
        }
    }

    /// The name of the file that holds the group of a frame with this display index.
    pub fn file_name(self, frame: u32) -> String {
        format!("f{frame:04}.{self}.i32")
    }

    /// The frame and the attribute that a file holds by its name.
    pub fn of_file_name(name: &str) -> Option<(u32, Self)> {
        let (frame, rest) = name.strip_prefix('f')?.split_once('.')?;
        let attribute = rest.strip_suffix(".i32")?;
        let attribute = Self::ALL.into_iter().find(|known| known.name() == attribute)?;
        let frame = frame.parse().ok()?;
        (attribute.file_name(frame) == name).then_some((frame, attribute))
    }
}

impl fmt::Display for Attribute {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Values as the bytes of a file.
pub fn to_bytes(values: &[i32]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

/// The values of a file; bytes that are left over are no value.
pub fn from_bytes(bytes: &[u8]) -> Vec<i32> {
    let (values, _) = bytes.as_chunks::<4>();
    values.iter().map(|bytes| i32::from_le_bytes(*bytes)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_of_a_file_says_frame_and_attribute() {
        for (frame, attribute) in [(0, Attribute::Sh), (17, Attribute::LogScale), (12345, Attribute::Dc)] {
            assert_eq!(Attribute::of_file_name(&attribute.file_name(frame)), Some((frame, attribute)));
        }
        for other in ["f1.dc.i32", "f0001.dc.i32le", "f0001.colour.i32", "meta.json", "f+001.dc.i32"] {
            assert_eq!(Attribute::of_file_name(other), None, "{other}");
        }
    }

    #[test]
    fn values_are_read_as_they_are_written() {
        let values = [0, -1, i32::MIN, i32::MAX];
        assert_eq!(from_bytes(&to_bytes(&values)), values);
    }
}
