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

/// The numbers of names that are alike but for these; none of others.
fn of_alike(paths: &[PathBuf]) -> Option<Vec<u64>> {
    let names: Vec<_> = paths.iter().map(|path| numbered(path)).collect::<Option<_>>()?;
    let &(before, _, after) = names.first()?;
    let are_alike = names.iter().all(|name| (name.0, name.2) == (before, after));
    are_alike.then(|| names.iter().map(|name| name.1).collect())
}

/// The numbers of frames in names that are alike but for these, if each is larger than the one before. Those of a single file, or
/// of files that count from 1, may be anything, and are none.
pub(crate) fn numbers(paths: &[PathBuf]) -> Option<Vec<u32>> {
    let numbers = of_alike(paths)?;
    let are_rising = numbers.is_sorted_by(|a, b| a < b);
    let counts_from_1 = numbers.iter().zip(1..).all(|(&number, at)| number == at);
    let may_be_frames = numbers.len() > 1 && are_rising && !counts_from_1;
    let numbers = numbers.into_iter().map(u32::try_from).collect::<Result<_, _>>().ok()?;
    may_be_frames.then_some(numbers)
}

/// What to say where names that are alike but for their numbers leave some out, or have one twice. Numbers rise by the smallest step that at least half
/// of them have; where no such step is, they are no numbers of frames. `paths` are in natural order.
pub(crate) fn missing_frames(paths: &[PathBuf]) -> Option<Warning> {
    let numbers = of_alike(paths)?;
    let name = |at: usize| paths.get(at).map(|path| path.display().to_string()).unwrap_or_default();
    let pairs = || numbers.iter().zip(numbers.iter().skip(1)).map(|(a, b)| b.saturating_sub(*a));
    if let Some(twice) = pairs().position(|apart| apart == 0) {
        let message = format!(
            "{} and {} have the same number: both are frames of the sequence, and later ones are shown too late",
            name(twice),
            name(twice + 1)
        );
        return Some(Warning::new("missing-frames", message));
    }
    let step = pairs().min()?;
    if 2 * pairs().filter(|&other| other == step).count() < numbers.len().saturating_sub(1) {
        return None;
    }
    let missing = pairs().map(|apart| (apart / step).saturating_sub(1)).fold(0, u64::saturating_add);
    let gap = pairs().position(|apart| apart / step > 1)?;
    let message = format!(
        "{} is followed by {}: {} of the sequence {} to be missing, and later ones are shown too early",
        name(gap),
        name(gap + 1),
        counted(missing, "frame"),
        if missing == 1 { "seems" } else { "seem" }
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
    fn numbers_are_those_of_names_that_are_alike() {
        let of = |names: &[&str]| numbers(&names.iter().map(PathBuf::from).collect::<Vec<_>>());
        assert_eq!(of(&["f_0004.ply", "f_0008.ply", "f_0012.ply"]), Some(vec![4, 8, 12]));
        assert_eq!(of(&["f_0001.ply", "f_0003.ply"]), Some(vec![1, 3]));
        assert_eq!(of(&["f_0001.ply", "f_0002.ply", "f_0003.ply"]), None);
        assert_eq!(of(&["f_0002.ply"]), None);
        assert_eq!(of(&["a_2.ply", "b_3.ply"]), None);
        assert_eq!(of(&["a_2.ply", "a_02.ply"]), None);
    }

    #[test]
    fn a_number_that_two_files_have_is_told() {
        let text = told(&["f_0000.ply", "f_1.ply", "f_0001.ply", "f_0005.ply", "f_0006.ply"]).unwrap();
        assert!(text.contains("f_1.ply and f_0001.ply have the same number"), "{text}");
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
