//! Frames that a directory seems to lack, by the numbers in the names of its files.

use crate::encode::warnings::Warning;
use crate::numbers::counted;
use std::path::{Path, PathBuf};

/// A name: what stands before its last number, that number, and what stands after it.
fn numbered(path: &Path) -> Option<(&str, u64, &str)> {
    let name = path.file_name()?.to_str()?;
    // The number of a format, as in .splat4d, is none of a frame.
    let stem = name.split('.').next()?;
    let end = stem.rfind(|c: char| c.is_ascii_digit())?.checked_add(1)?;
    let before = stem.get(..end)?.trim_end_matches(|c: char| c.is_ascii_digit());
    Some((before, stem.get(before.len()..end)?.parse().ok()?, name.get(end..)?))
}

/// What to say where names that are alike but for their numbers leave some out. Numbers rise by the smallest step that at least half
/// of them have; where no such step is, they are no numbers of frames. `paths` are in natural order.
pub(crate) fn missing_frames(paths: &[PathBuf]) -> Option<Warning> {
    let names: Vec<_> = paths.iter().map(|path| numbered(path)).collect::<Option<_>>()?;
    let &(before, _, after) = names.first()?;
    if names.iter().any(|name| (name.0, name.2) != (before, after)) {
        return None;
    }
    let pairs = || names.iter().zip(names.iter().skip(1)).map(|(a, b)| b.1.saturating_sub(a.1));
    let step = pairs().min().filter(|&step| step > 0)?;
    if 2 * pairs().filter(|&other| other == step).count() < names.len().saturating_sub(1) {
        return None;
    }
    let missing = pairs().map(|apart| (apart / step).saturating_sub(1)).fold(0, u64::saturating_add);
    let gap = pairs().position(|apart| apart / step > 1)?;
    let name = |at: usize| paths.get(at).map(|path| path.display().to_string()).unwrap_or_default();
    let message = format!(
        "{} is followed by {}: {} of the sequence seem to be missing, and later ones are shown too early",
        name(gap),
        name(gap + 1),
        counted(missing, "frame")
    );
    Some(Warning::new("missing-frames", message))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(names: &[&str]) -> Option<String> {
        let paths: Vec<PathBuf> = names.iter().map(PathBuf::from).collect();
        missing_frames(&paths).map(|warning| warning.text())
    }

    #[test]
    fn a_gap_among_numbers_is_told() {
        let text = told(&["f_0000.ply", "f_0001.ply", "f_0003.ply", "f_0006.ply", "f_0007.ply"]).unwrap();
        assert!(text.contains("f_0001.ply is followed by f_0003.ply: 3 frames"), "{text}");
        assert!(told(&["f8.spz", "f10.spz", "f12.spz", "f16.spz"]).is_some());
    }

    #[test]
    fn what_has_no_gap_or_no_numbers_is_not() {
        assert_eq!(told(&["f8.ply", "f9.ply", "f10.ply"]), None);
        assert_eq!(told(&["f0.ply", "f5.ply", "f10.ply"]), None);
        assert_eq!(told(&["a1.ply", "b2.ply", "c9.ply"]), None);
        assert_eq!(told(&["v1.ply", "v7.ply", "v90.ply", "v91.ply"]), None);
        assert_eq!(told(&["left.splat4d", "right.splat4d", "up.splat4d"]), None);
        assert_eq!(told(&["7.ply"]), None);
    }
}
