//! The files that a decoder wrote. The runner hashes them itself and trusts no digests of the decoder.

use crate::attribute::Attribute;
use crate::digest;
use crate::error::{Error, Result};
use std::collections::BTreeMap;
use std::fs;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

/// The end of the name of `u%04d.entropy`.
const ENTROPY: &str = ".entropy";
/// A file that a decoder may write for its own use.
const META: &str = "meta.json";

/// The files in the folder of a case.
#[derive(Debug, Default)]
pub struct Output {
    /// Files of planes by frame and attribute.
    pub planes: BTreeMap<(u32, Attribute), Planes>,
    /// SHA-256 of the output of 7.10 by frame.
    pub floats: BTreeMap<u32, String>,
    /// Entropy states by unit, as they were written.
    pub entropy: BTreeMap<usize, String>,
    /// Names of unexpected files.
    pub extra: Vec<String>,
    /// Why the folder cannot be read, if the decoder is to blame.
    pub fault: Option<String>,
}

/// A file of planes.
#[derive(Debug)]
pub struct Planes {
    /// The file.
    pub path: PathBuf,
    /// Its length.
    pub bytes: u64,
    /// SHA-256 of its bytes.
    pub sha256: String,
}

impl Output {
    /// Reads a folder.
    ///
    /// # Errors
    /// The folder or a file in it cannot be read, and the decoder is not to blame.
    pub fn read(folder: &Path) -> Result<Self> {
        match Self::read_whole(folder) {
            Err(Error::File { path, source, .. }) if is_caused_by_decoder(&source) => {
                let fault = match path == folder && source.kind() != ErrorKind::PermissionDenied {
                    true => "the decoder removed its output folder".to_owned(),
                    false => format!("{} cannot be read: {source}", path.display()),
                };
                Ok(Self { fault: Some(fault), ..Self::default() })
            }
            output => output,
        }
    }

    fn read_whole(folder: &Path) -> Result<Self> {
        let mut output = Self::default();
        let failed = Error::file("read", folder);
        let entries =
            fs::read_dir(folder).and_then(Iterator::collect::<io::Result<Vec<_>>>).map_err(failed)?;
        for entry in entries {
            let name = entry.file_name().to_string_lossy().into_owned();
            // Links are not followed: the decoder did not write what they lead to.
            let is_file = entry.file_type().is_ok_and(|kind| kind.is_file());
            output.take(entry.path(), name, is_file)?;
        }
        output.extra.sort();
        Ok(output)
    }

    fn take(&mut self, path: PathBuf, name: String, is_file: bool) -> Result<()> {
        let read = |path: &Path| fs::read(path).map_err(Error::file("read", path));
        if let (Some(key), true) = (Attribute::of_file_name(&name), is_file) {
            let bytes = read(&path)?;
            let (length, sha256) = (bytes.len() as u64, digest::sha256(&bytes));
            self.planes.insert(key, Planes { path, bytes: length, sha256 });
        } else if let (Some(frame), true) = (floats_frame(&name), is_file) {
            self.floats.insert(frame, digest::sha256(&read(&path)?));
        } else if let (Some(unit), true) = (entropy_unit(&name), is_file) {
            self.entropy.insert(unit, String::from_utf8_lossy(&read(&path)?).trim().to_owned());
        } else if name != META || !is_file {
            self.extra.push(name);
        }
        Ok(())
    }
}

/// Whether a decoder can have caused this in its folder.
fn is_caused_by_decoder(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory | ErrorKind::PermissionDenied)
}

/// The name of the file that holds the output of 7.10 of a frame.
pub fn floats_name(frame: u32) -> String {
    format!("f{frame:04}.f32")
}

fn floats_frame(name: &str) -> Option<u32> {
    let frame: u32 = name.strip_prefix('f')?.strip_suffix(".f32")?.parse().ok()?;
    (name == floats_name(frame)).then_some(frame)
}

/// The name of the file that holds the entropy state of a unit.
pub fn entropy_name(unit: usize) -> String {
    format!("u{unit:04}{ENTROPY}")
}

/// The unit whose entropy state a file has, by its name.
fn entropy_unit(name: &str) -> Option<usize> {
    let unit: usize = name.strip_prefix('u')?.strip_suffix(ENTROPY)?.parse().ok()?;
    (name == entropy_name(unit)).then_some(unit)
}
