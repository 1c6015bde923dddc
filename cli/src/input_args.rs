//! How scene files are read: how much memory they may ask for, and which frames are taken of continuous time.

use crate::failure::Failure;
use clap::Args;
use splatstream_files::{ReadLimits, SceneError, SceneErrorKind, SequenceOptions, read_scene};
use splatstream_gaussians::GaussianFrame;
use std::path::Path;

/// Memory that any scene may take, and that for each byte of its file: packed scenes of any format take less than a third
/// of it. A file of a few bytes may not ask for gigabytes.
const BASE: u64 = 64 << 20;
const PER_BYTE: u64 = 64;

/// Memory that no scene may take, unless it is asked for.
const MOST: u64 = 8 << 30;

/// The option of all commands that read scenes.
#[derive(Args, Debug, Clone, Copy, Default)]
pub(crate) struct InputArgs {
    /// Most memory that reading one scene may take, as in 512M or 4G [default: 64M and 64 times the file, at most 8G].
    #[arg(long, value_name = "SIZE", value_parser = parse_size)]
    max_input_memory: Option<u64>,
    /// Frames to take of a scene in continuous time, .splatv: so many, evenly over its length [default: 50].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    samples: Option<u32>,
    /// Memory that the command has for everything, bytes; none: reading is bounded by itself.
    #[arg(skip)]
    memory: Option<u64>,
}

impl InputArgs {
    /// How the frames of a file of many are chosen.
    pub(crate) fn sequence(&self) -> SequenceOptions {
        SequenceOptions { samples: self.samples.unwrap_or(SequenceOptions::default().samples) }
    }

    /// The same where everything together has so much memory.
    pub(crate) fn within(self, memory: u64) -> Self {
        Self { memory: Some(memory), ..self }
    }

    /// Whether a scene is refused because of the memory that there is for everything, or is left of the machine.
    pub(crate) fn is_over_memory(&self, error: &SceneError) -> bool {
        match &error.kind {
            SceneErrorKind::OverLimit { allowed, .. } => Some(*allowed) == self.memory,
            SceneErrorKind::Io(cause) if cause.kind() == std::io::ErrorKind::OutOfMemory => {
                self.memory.is_some()
            }
            SceneErrorKind::OutOfMemory { .. } => self.memory.is_some(),
            _ => false,
        }
    }

    /// The frame in a file that a command has written.
    pub(crate) fn frame(&self, path: &Path) -> Result<GaussianFrame, Failure> {
        read_scene(path, &self.limits(path)).map_err(|error| Failure::other(error.to_string()))
    }

    /// The memory that any scene may take, whatever its size.
    pub(crate) fn most(&self) -> u64 {
        self.max_input_memory.unwrap_or(MOST)
    }

    /// The limits for the scene at a path.
    pub(crate) fn limits(&self, path: &Path) -> ReadLimits {
        let of_file = || size_of(path).saturating_mul(PER_BYTE).saturating_add(BASE).min(MOST);
        let of_reading = self.max_input_memory.unwrap_or_else(of_file);
        ReadLimits { max_memory: of_reading.min(self.memory.unwrap_or(u64::MAX)) }
    }
}

/// An error of a reader, with the option that helps where one does.
pub(crate) fn with_advice(error: &SceneError) -> String {
    match error.kind {
        SceneErrorKind::OverLimit { asked, .. } => {
            let gibibytes = asked.div_ceil(1 << 30);
            format!("{error}\n  if you trust the file, give --max-input-memory {gibibytes}G")
        }
        _ => error.to_string(),
    }
}

/// Bytes of a file, or of the files in a directory; 0 if they cannot be had, which reading will say. A file that names
/// others, as a .gltf and the meta.json of a SOG scene do, counts with those beside it.
pub(crate) fn size_of(path: &Path) -> u64 {
    let names_others = path
        .extension()
        .is_some_and(|extension| ["gltf", "json"].iter().any(|other| extension.eq_ignore_ascii_case(other)));
    let path = match path.parent().filter(|_| names_others && path.is_file()) {
        Some(parent) if parent.as_os_str().is_empty() => Path::new("."),
        Some(parent) => parent,
        None => path,
    };
    let of_file = |path: &Path| path.metadata().map_or(0, |metadata| metadata.len());
    match std::fs::read_dir(path) {
        Ok(entries) => entries.filter_map(Result::ok).map(|entry| of_file(&entry.path())).sum(),
        Err(_) => of_file(path),
    }
}

/// Bytes, with K, M or G for 2 to the 10, 20 or 30 of them.
pub(crate) fn parse_size(text: &str) -> Result<u64, String> {
    let wrong = || format!("'{text}' is not a size; write 512M, 4G or a number of bytes");
    let digits = text.trim_end_matches(|last: char| last.is_ascii_alphabetic());
    let shift = match text[digits.len()..].to_ascii_uppercase().as_str() {
        "" => 0,
        "K" => 10,
        "M" => 20,
        "G" => 30,
        _ => return Err(wrong()),
    };
    let number: u64 = digits.parse().map_err(|_| wrong())?;
    number.checked_mul(1 << shift).filter(|&size| size > 0).ok_or_else(wrong)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_goes_with_the_bytes_of_a_scene() {
        let directory = tempfile::tempdir().unwrap();
        let file = |name: &str, bytes: u64| {
            let path = directory.path().join(name);
            std::fs::File::create(&path).unwrap().set_len(bytes).unwrap();
            path
        };
        let allowed = |path: &Path| InputArgs::default().limits(path).max_memory;
        assert_eq!(allowed(&file("small.sog", 334)), BASE + 64 * 334);
        assert_eq!(allowed(&file("large.ply", 1 << 34)), MOST);
        std::fs::remove_file(directory.path().join("large.ply")).unwrap();
        // Files that a scene is spread over count together.
        file("scene.bin", 1 << 20);
        let all = BASE + 64 * (334 + (1 << 20) + 100);
        assert_eq!(allowed(&file("scene.gltf", 100)), all);
        assert_eq!(allowed(directory.path()), all);
        let given = InputArgs { max_input_memory: Some(5), ..InputArgs::default() };
        assert_eq!(given.limits(directory.path()).max_memory, 5);
    }

    #[test]
    fn sizes_have_units() {
        assert_eq!(["7", "512K", "3m", "4G"].map(parse_size), [7, 512 << 10, 3 << 20, 4 << 30].map(Ok));
        assert!(["", "G", "-1G", "4GB", "0", "99999999999G"].iter().all(|text| parse_size(text).is_err()));
    }
}
