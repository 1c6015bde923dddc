//! What frames are called in directories, where many commands write them and look for them.

use crate::output_directory::is_numbered;

/// The name of a frame, without an ending: frame_0000.
pub(crate) fn frame_name(number: u32) -> String {
    format!("frame_{number:04}")
}

/// Whether a name without an ending is that of a frame.
pub(crate) fn is_frame_name(name: &str) -> bool {
    is_numbered(name, "frame_", 4, "")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_frames_are_given_are_known() {
        assert!([0, 9999, 10_000].iter().all(|&number| is_frame_name(&frame_name(number))));
        assert!(["frame_12", "frame_0001_top", "frame_", "0001"].iter().all(|name| !is_frame_name(name)));
    }
}
