//! What a file announces, checked before it is read.
//!
//! Readers take whole files into memory. Formats that say at their start of what version they are and how long, or whose length
//! says what they hold, are looked at first: a file of many gigabytes that is of another version, that is cut short, or
//! whose frame takes more memory than is allowed, is refused after a few reads.

use std::io::{Read, Seek};

use crate::error::SceneError;
use crate::format::SceneFormat;
use crate::limits::Budget;
use crate::walk::{FileWalk, Walk};
use crate::{gltf, ksplat, splat, spz};

/// Checks the start and the size of a file, where its format has something to check there.
///
/// # Errors
/// Those with which the reader of the format would refuse the whole file.
pub(crate) fn check(
    format: SceneFormat,
    file: impl Read + Seek,
    budget: &mut Budget,
) -> Result<(), SceneError> {
    let mut walk = FileWalk::new(file)?;
    match format {
        SceneFormat::Splat => splat::check_size(walk.left(), budget),
        SceneFormat::Ksplat => ksplat::check(&mut walk, budget),
        SceneFormat::Spz => spz::check(&mut walk, budget),
        SceneFormat::Gltf => gltf::check(&mut walk, budget),
        // A header of text says how long a PLY file is only after it is parsed, and the rest are not read whole.
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests;
