//! The vectors on disk.

use crate::digest;
use crate::error::{Error, Result, read_json};
use crate::vector::{Kind, SCHEMA, Vector};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// The vectors of a suite, in the order of kind, area and name.
#[derive(Debug)]
pub struct Suite {
    /// Version of the suite, the first line of VERSION; none if there is no such file.
    pub version: Option<String>,
    /// Version of the specification that it goes with, the second line.
    pub specification: Option<String>,
    /// The vectors.
    pub vectors: Vec<Located>,
}

/// A vector and its stream.
#[derive(Debug)]
pub struct Located {
    /// The record.
    pub vector: Vector,
    /// The stream.
    pub stream: PathBuf,
}

impl Suite {
    /// Reads a folder of vectors, or the folder that holds it as `vectors`. Every stream is compared with its record.
    ///
    /// # Errors
    /// The folder is not there or has no vectors; a record cannot be understood or contradicts its place or its stream.
    pub fn read(folder: &Path) -> Result<Self> {
        let inner = folder.join("vectors");
        let (root, vectors) = match inner.is_dir() {
            true => (folder, inner.as_path()),
            false => (folder.parent().unwrap_or(folder), folder),
        };
        let mut suite = Self { version: None, specification: None, vectors: Vec::new() };
        for kind in [Kind::Valid, Kind::Invalid, Kind::Either] {
            for area in folders(&vectors.join(kind.name()))? {
                for place in folders(&area)? {
                    suite.vectors.extend(Located::read(&place, kind, &area)?);
                }
            }
        }
        if suite.vectors.is_empty() {
            let message = "no vectors here: there should be folders valid/AREA/NAME with a vector.json\n  \
                give the folder of the vectors with --suite DIR";
            return Err(Error::content(vectors, message));
        }
        suite.check_names(vectors)?;
        suite.read_version(&root.join("VERSION"));
        Ok(suite)
    }

    /// SHA-256 over names and streams: two runs with the same were made on the same vectors.
    pub fn sha256(&self) -> String {
        let lines =
            self.vectors.iter().map(|Located { vector, .. }| format!("{} {}\n", vector.sha256, vector.name));
        digest::sha256(lines.collect::<String>().as_bytes())
    }

    fn check_names(&self, folder: &Path) -> Result<()> {
        let mut places = BTreeMap::new();
        for Located { vector, stream } in &self.vectors {
            if let Some(other) = places.insert(&vector.name, stream) {
                let message = format!(
                    "two vectors are called {}: {} and {}",
                    vector.name,
                    other.display(),
                    stream.display()
                );
                return Err(Error::content(folder, message));
            }
        }
        Ok(())
    }

    fn read_version(&mut self, path: &Path) {
        let text = fs::read_to_string(path).unwrap_or_default();
        let mut lines = text.lines().map(|line| line.trim().to_owned());
        (self.version, self.specification) = (lines.next(), lines.next());
    }
}

impl Located {
    /// The vector in a folder; none if it has no record.
    fn read(folder: &Path, kind: Kind, area: &Path) -> Result<Option<Self>> {
        let path = folder.join("vector.json");
        if !path.is_file() {
            return Ok(None);
        }
        let vector: Vector = read_json(&path)?;
        let stream = folder.join("in.gss");
        let bytes = fs::read(&stream).map_err(Error::file("read", &stream))?;
        let name = |path: &Path| path.file_name().map(|name| name.to_string_lossy().into_owned());
        let complaint = if vector.schema != SCHEMA {
            Some(format!("the schema is {}, this runner knows {SCHEMA}", vector.schema))
        } else if (name(folder).as_ref(), name(area).as_ref(), kind)
            != (Some(&vector.name), Some(&vector.area), vector.kind)
        {
            Some("name, area and kind are not those of the folder".to_owned())
        } else if vector.bytes != bytes.len() as u64 || vector.sha256 != digest::sha256(&bytes) {
            Some("in.gss is not the stream of this record: get the suite again".to_owned())
        } else {
            inconsistency(&vector)
        };
        complaint.map_or(Ok(Some(Self { vector, stream })), |message| Err(Error::content(&path, message)))
    }
}

/// What a record says that cannot be.
fn inconsistency(vector: &Vector) -> Option<String> {
    let mut verdicts = std::iter::once(&vector.expect)
        .chain(&vector.acceptable)
        .chain(vector.points.iter().filter_map(|point| point.expect.as_ref()));
    if !verdicts.all(|verdict| verdict.is_consistent()) {
        return Some("a rejection has a class, and nothing else has one".to_owned());
    }
    if !vector.acceptable.is_empty() && vector.kind != Kind::Either {
        return Some("only vectors of kind either have acceptable outcomes".to_owned());
    }
    let mut states = vector.points.iter().filter_map(|point| point.states.as_ref()).flatten();
    states
        .any(|&state| state >= vector.states.len())
        .then(|| "a point refers to a state that is not there".to_owned())
}

/// The folders in a folder, by name; none if that is not there.
fn folders(path: &Path) -> Result<Vec<PathBuf>> {
    if !path.is_dir() {
        return Ok(Vec::new());
    }
    let failed = Error::file("read", path);
    let entries =
        fs::read_dir(path).and_then(Iterator::collect::<std::io::Result<Vec<_>>>).map_err(failed)?;
    let mut folders: Vec<PathBuf> =
        entries.into_iter().map(|entry| entry.path()).filter(|path| path.is_dir()).collect();
    folders.sort();
    Ok(folders)
}
