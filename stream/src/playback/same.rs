//! Whether a manifest that was read again is that of the same package.

use super::{GopLog, PlaybackError, first_gop};
use crate::manifest::{GopInfo, Manifest};

/// A package shall be the one it was, but for GOPs that were added and for where ranges are. `logs` has the numbers of the
/// GOPs that were known.
pub(super) fn check_same(old: &Manifest, logs: &[GopLog], new: &Manifest) -> Result<(), PlaybackError> {
    let ids = |manifest: &Manifest| -> Vec<(String, String)> {
        let all = manifest.representations.iter();
        all.map(|info| (info.id.clone(), info.init.digest.clone())).collect()
    };
    let stream = |manifest: &Manifest| {
        let mut stream = manifest.stream.clone();
        (stream.bytes, stream.digest, stream.frames) = (None, None, 0);
        stream
    };
    let started = old.live.as_ref().zip(new.live.as_ref());
    let began_again = started.is_some_and(|(old, new)| old.started_ms != new.started_ms);
    if ids(old) != ids(new) || stream(old) != stream(new) || began_again {
        return Err(PlaybackError::Changed(None));
    }
    let first = first_gop(new);
    let listed = first.saturating_add(new.complete_gops());
    let known = logs.last().map_or(0, |log| log.number.saturating_add(1));
    if listed < known && new.live.is_some() {
        return Err(PlaybackError::Backwards { known, listed });
    }
    for (gop, log) in old.gops.iter().zip(logs) {
        let Some(index) = log.number.checked_sub(first) else { continue };
        if !new.gops.get(index).is_some_and(|other| is_same(gop, other)) {
            return Err(PlaybackError::Changed(Some(log.number)));
        }
    }
    Ok(())
}

/// Whether frames and bytes are those of a GOP, of which the bytes may be forgotten.
fn is_same(gop: &GopInfo, other: &GopInfo) -> bool {
    let levels = |gop: &GopInfo| -> Vec<(String, u64, String)> {
        let all = gop
            .subsegments
            .iter()
            .flat_map(|one| one.levels.iter().map(|level| (&one.representation, &level.bytes)));
        all.map(|(id, bytes)| (id.clone(), bytes.size, bytes.digest.clone())).collect()
    };
    (gop.first_frame, gop.frame_count) == (other.first_frame, other.frame_count)
        && (gop.subsegments.is_empty() || levels(gop) == levels(other))
}
