//! Whether a manifest that was read again is that of the same package.

use super::PlaybackError;
use crate::manifest::{GopInfo, Manifest};

/// A package shall be the one it was, but for GOPs that were added and for where ranges are.
pub(super) fn check_same(old: &Manifest, new: &Manifest) -> Result<(), PlaybackError> {
    let ids = |manifest: &Manifest| -> Vec<(String, String)> {
        let all = manifest.representations.iter();
        all.map(|info| (info.id.clone(), info.init.digest.clone())).collect()
    };
    let stream = |manifest: &Manifest| {
        let mut stream = manifest.stream.clone();
        (stream.bytes, stream.frames) = (0, 0);
        stream.digest.clear();
        stream
    };
    if ids(old) != ids(new) || stream(old) != stream(new) {
        return Err(PlaybackError::Changed(None));
    }
    let levels = |gop: &GopInfo| -> Vec<(String, u64, String)> {
        let all = gop
            .subsegments
            .iter()
            .flat_map(|one| one.levels.iter().map(|level| (&one.representation, &level.bytes)));
        all.map(|(id, bytes)| (id.clone(), bytes.size, bytes.digest.clone())).collect()
    };
    for (number, gop) in old.gops.iter().enumerate() {
        let same = |other: &GopInfo| {
            (gop.first_frame, gop.frame_count, levels(gop))
                == (other.first_frame, other.frame_count, levels(other))
        };
        if !new.gops.get(number).is_some_and(same) {
            return Err(PlaybackError::Changed(Some(number)));
        }
    }
    Ok(())
}
