//! Packages (annex C) through an unpackager: what it makes of the files, and how it refuses those with a fault; and their
//! streams through a packager, whose packages are unpackaged again.

use crate::answer::{Answer, Ending};
use crate::cancel::Cancel;
use crate::command::Template;
use crate::digest::sha256;
use crate::error::{Error, Result};
use crate::limits::Limits;
use crate::session::{Decoder, Session};
use serde::{Deserialize, Serialize};
use splatstream_format::Class;
use std::fs;
use std::path::{Path, PathBuf};

/// The record of a package.
#[derive(Debug, Clone, Deserialize)]
pub struct Record {
    /// What it is about.
    pub purpose: String,
    /// The requirements of annex C that it is about.
    pub requirements: Vec<String>,
    /// What an unpackager shall do.
    pub expect: Expected,
}

/// What an unpackager shall do.
#[derive(Debug, Clone, Deserialize)]
#[serde(tag = "outcome", rename_all = "lowercase")]
pub enum Expected {
    /// Give this stream.
    Accept {
        /// Its bytes.
        bytes: u64,
        /// Their digest, 64 hexadecimal digits.
        sha256: String,
    },
    /// Refuse the files with an error of a class.
    Reject {
        /// The name of the class.
        class: String,
    },
}

/// What came of a package.
#[derive(Debug, Clone, Serialize)]
pub struct PackageResult {
    /// Its kind and its name.
    pub package: String,
    /// The requirements that it is about.
    pub requirements: Vec<String>,
    /// Whether the unpackager is right.
    pub passed: bool,
    /// What is wrong; empty if nothing is.
    pub message: String,
}

/// The folder of the packages that goes with a folder of vectors.
pub fn beside(vectors: &Path) -> PathBuf {
    vectors.parent().unwrap_or(vectors).join("packages")
}

/// Runs an unpackager on every package of a folder, in order of their names.
///
/// # Errors
/// Files that cannot be read, and a command that does not start.
pub fn run(
    folder: &Path,
    template: Template,
    limits: &Limits,
    cancel: &Cancel,
) -> Result<Vec<PackageResult>> {
    let decoder = Decoder::Once(template);
    let mut session = Session::new(&decoder, limits, cancel)?;
    each(folder, &["growing", "invalid", "valid"], cancel, |path, record| {
        let (answer, out) = session.ask_file(path, "out.gss")?;
        Ok(judge(&record.expect, &answer, &out))
    })
}

/// Runs a packager on the stream of every valid package of a folder, in order of their names. An unpackager that is
/// right gets the streams out of the packages, and out of what the packager writes.
///
/// # Errors
/// As [`run`].
pub fn run_packager(
    folder: &Path,
    packager: Template,
    unpackager: Template,
    limits: &Limits,
    cancel: &Cancel,
) -> Result<Vec<PackageResult>> {
    let (packager, unpackager) = (Decoder::Once(packager), Decoder::Once(unpackager));
    let mut tested = Session::new(&packager, limits, cancel)?;
    let mut reference = Session::new(&unpackager, limits, cancel)?;
    each(folder, &["valid"], cancel, |path, record| {
        let (answer, stream) = reference.ask_file(path, "in.gss")?;
        if let Err(message) = judge(&record.expect, &answer, &stream) {
            return Ok(Err(format!("the unpackager is wrong, not the packager: {message}")));
        }
        let (answer, package) = tested.ask_file(&stream, "package")?;
        match (answer.ending, answer.fault) {
            (Ending::Code(0), _) => {}
            (Ending::Code(code), _) => {
                return Ok(Err(format!("it refused a valid stream with exit code {code}")));
            }
            (_, fault) => return Ok(Err(fault.unwrap_or_else(|| "it ended by a signal".to_owned()))),
        }
        let (answer, back) = reference.ask_file(&package, "out.gss")?;
        Ok(judge(&record.expect, &answer, &back).map_err(|message| format!("of its package, {message}")))
    })
}

/// What `test` says of each package of some kinds.
fn each(
    folder: &Path,
    kinds: &[&str],
    cancel: &Cancel,
    mut test: impl FnMut(&Path, &Record) -> Result<std::result::Result<(), String>>,
) -> Result<Vec<PackageResult>> {
    let mut results = Vec::new();
    for kind in kinds {
        for path in entries(&folder.join(kind))? {
            if cancel.is_set() {
                return Ok(results);
            }
            let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
            let record = read(&path.join("package.json"))?;
            let message = test(&path, &record)?.err().unwrap_or_default();
            results.push(PackageResult {
                package: format!("{kind}/{name}"),
                requirements: record.requirements,
                passed: message.is_empty(),
                message,
            });
        }
    }
    Ok(results)
}

fn entries(folder: &Path) -> Result<Vec<PathBuf>> {
    let failed = Error::file("read", folder);
    let entries = fs::read_dir(folder).and_then(Iterator::collect::<std::io::Result<Vec<_>>>);
    let mut paths: Vec<PathBuf> = entries.map_err(failed)?.iter().map(fs::DirEntry::path).collect();
    paths.sort();
    Ok(paths)
}

fn read(path: &Path) -> Result<Record> {
    let text = fs::read(path).map_err(Error::file("read", path))?;
    serde_json::from_slice(&text)
        .map_err(|error| Error::Content { path: path.to_path_buf(), message: error.to_string() })
}

/// Whether an answer is right; otherwise why not.
fn judge(expected: &Expected, answer: &Answer, out: &Path) -> std::result::Result<(), String> {
    let Ending::Code(code) = answer.ending else {
        return Err(answer.fault.clone().unwrap_or_else(|| "it ended by a signal".to_owned()));
    };
    match expected {
        Expected::Accept { bytes, sha256: digest } => {
            if code != 0 {
                return Err(format!("it refused a valid package with exit code {code}"));
            }
            let written = fs::read(out).map_err(|error| format!("there is no stream: {error}"))?;
            let (length, found) = (written.len(), sha256(&written));
            if u64::try_from(length) == Ok(*bytes) && found == *digest {
                return Ok(());
            }
            Err(format!("its stream has {length} bytes with SHA-256 {found}, not {bytes} with {digest}"))
        }
        Expected::Reject { class } => {
            let name = Class::of_exit_code(code).map(Class::name);
            match name {
                Some(name) if name == class => Ok(()),
                _ if code == 0 => Err(format!("it accepted a package that is {class}")),
                Some(name) => Err(format!("it says {name}, but the package is {class}")),
                None => Err(format!("it ended with exit code {code}, which is no class; {class} is right")),
            }
        }
    }
}
