//! Which way is up in a scene, for cameras that are made for it.

use crate::settings::Settings;
use splatstream_format::payload::UpAxis;
use splatstream_render::camera::Up;

/// The direction of an axis, if it is known.
pub fn up_of(axis: UpAxis) -> Option<Up> {
    match axis {
        UpAxis::Unknown => None,
        UpAxis::MinusY => Some(Up::MinusY),
        UpAxis::PlusY => Some(Up::PlusY),
        UpAxis::MinusZ => Some(Up::MinusZ),
        UpAxis::PlusZ => Some(Up::PlusZ),
        UpAxis::MinusX => Some(Up::MinusX),
        UpAxis::PlusX => Some(Up::PlusX),
    }
}

impl Settings {
    /// What points up in views that are made for the scene: what its description says, or -y, as trainers write scenes.
    pub(crate) fn up(&self) -> Up {
        up_of(self.description.up_axis).unwrap_or_default()
    }
}
