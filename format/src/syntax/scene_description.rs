//! 5.9 scene_description: what a viewer may want to know about the scene. Decoding does not depend on it.

use super::{record_io, table};
use crate::Result;

table! {
    /// 5.9 — the fixed part of a scene description; what `description_flags` announces follows.
    "5.9" "6.9" scene_description SceneDescriptionHeader {
        /// 0 is unknown, 1 +x, 2 -x, 3 +y, 4 -y, 5 +z, 6 -z
        up_axis: u8,
        /// 0 is the ellipsoid
        kernel: u8,
        /// 0 is sRGB, 1 is linear; BT.709 primaries, display-referred
        colour_space: u8,
        /// 0 is perspective
        projection: u8,
        /// 0 is distance to the camera, 1 is depth along the view axis
        sorting: u8,
        /// bit 0 metres, 1 background, 2 bounds, 3 title, 4 cameras
        description_flags: u8,
    }
}

table! {
    /// 5.9.1 — a camera from which the scene may be viewed.
    "5.9.1" "6.9" camera CameraRecord {
        /// position in the scene
        position: f32[3],
        /// quaternion w, x, y, z from the camera to the scene
        rotation: f32[4],
        /// vertical field of view, radians
        vertical_field_of_view: f32,
    }
}

record_io!(SceneDescriptionHeader);

impl SceneDescriptionHeader {
    /// Bit 0 of `description_flags`.
    pub const METRES: u8 = 1;
    /// Bit 1.
    pub const BACKGROUND: u8 = 1 << 1;
    /// Bit 2.
    pub const BOUNDS: u8 = 1 << 2;
    /// Bit 3.
    pub const TITLE: u8 = 1 << 3;
    /// Bit 4.
    pub const CAMERAS: u8 = 1 << 4;
    /// The bits that have a meaning.
    const FLAGS: u8 = (1 << 5) - 1;

    /// 6.9.
    ///
    /// # Errors
    /// Unsupported: reserved values or flags.
    pub fn validate(&self, at: u64) -> Result<()> {
        let check = Self::TABLE.check(at);
        check.known(self.up_axis <= 6, "up_axis", self.up_axis)?;
        check.known(self.kernel == 0, "kernel", self.kernel)?;
        check.known(self.colour_space <= 1, "colour_space", self.colour_space)?;
        check.known(self.projection == 0, "projection", self.projection)?;
        check.known(self.sorting <= 1, "sorting", self.sorting)?;
        check.reserved_bits("description_flags", 0, self.description_flags & !Self::FLAGS)
    }
}

/// A camera from which the scene may be viewed; it looks along its z axis, x to the right and y down.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// Position in the scene.
    pub position: [f32; 3],
    /// Quaternion w, x, y, z from the camera to the scene. Its length is not checked.
    pub rotation: [f32; 4],
    /// Vertical field of view, radians.
    pub vertical_field_of_view: f32,
}

/// 2^40, the largest magnitude of a number.
const MAX_MAGNITUDE: f32 = f32::from_bits((127 + 40) << 23);
/// -2^40.
const MIN_MAGNITUDE: f32 = f32::from_bits(1 << 31 | (127 + 40) << 23);

/// Whether a number is finite and at most 2^40 in magnitude.
pub(crate) fn in_range(value: f32) -> bool {
    (MIN_MAGNITUDE..=MAX_MAGNITUDE).contains(&value)
}

impl Camera {
    /// Reads and checks the record at the start of `bytes`, which stand at offset `at`; gives the bytes after it.
    ///
    /// # Errors
    /// Malformed: bytes are missing. Invalid: a number that clause 6.9 forbids.
    pub fn parse(bytes: &[u8], at: u64) -> Result<(Self, &[u8])> {
        let (record, rest): (CameraRecord, _) = super::decode(&CameraRecord::TABLE, bytes, at)?;
        let camera = Self {
            position: record.position.map(f32::from_bits),
            rotation: record.rotation.map(f32::from_bits),
            vertical_field_of_view: f32::from_bits(record.vertical_field_of_view),
        };
        camera.validate(at)?;
        Ok((camera, rest))
    }

    /// The bytes of the record; refused where [`Self::parse`] would refuse them.
    ///
    /// # Errors
    /// Invalid: a number that clause 6.9 forbids.
    pub fn to_bytes(&self) -> Result<Vec<u8>> {
        self.validate(0)?;
        let record = CameraRecord {
            position: self.position.map(f32::to_bits),
            rotation: self.rotation.map(f32::to_bits),
            vertical_field_of_view: self.vertical_field_of_view.to_bits(),
        };
        Ok(super::encode(&record))
    }

    /// 6.9.
    fn validate(&self, at: u64) -> Result<()> {
        const RULE: &str = "a number is finite and between -2^40 and 2^40";
        let check = CameraRecord::TABLE.check(at);
        for (index, value) in self.position.into_iter().enumerate() {
            check.rule(in_range(value), "position", index, RULE)?;
        }
        for (index, value) in self.rotation.into_iter().enumerate() {
            check.rule(in_range(value), "rotation", index, RULE)?;
        }
        let angle = self.vertical_field_of_view;
        // The constant is the binary32 number next to pi, which is greater than pi.
        let fits = angle > 0.0 && angle < core::f32::consts::PI;
        check.rule(fits, "vertical_field_of_view", 0, "a field of view is above 0 and below pi")
    }

    /// The table of the record.
    pub const TABLE: super::Table = CameraRecord::TABLE;
    /// Bytes of the record.
    pub const SIZE: usize = CameraRecord::SIZE;
}
