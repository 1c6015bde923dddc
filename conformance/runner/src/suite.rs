//! The vectors on disk.

use crate::counted::counted;
use crate::digest;
use crate::error::{Error, Result};
use crate::vector::{Kind, Mode, SCHEMA, Vector};
use splatstream_format::syntax::SPECIFICATION;
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
    /// How it differs from its MANIFEST, in words; none if it does not.
    pub changed: Option<String>,
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
    /// SHA-256 of the record, which contains that of the stream.
    pub sha256: String,
}

impl Suite {
    /// The vectors of the repository that the current folder or this program is in; none if there are none.
    pub fn locate() -> Option<PathBuf> {
        let starts = [std::env::current_dir(), std::env::current_exe()].into_iter().flatten();
        let above = starts.flat_map(|start| start.ancestors().map(Path::to_path_buf).collect::<Vec<_>>());
        above.map(|folder| folder.join("conformance/vectors")).find(|vectors| vectors.is_dir())
    }

    /// Reads a folder of vectors, or the folder that holds it as `vectors`. Every stream is compared with its record.
    ///
    /// # Errors
    /// The folder does not exist or has no vectors; they are for another specification; a record cannot be understood or
    /// contradicts its folder or its stream.
    pub fn read(folder: &Path) -> Result<Self> {
        let inner = folder.join("vectors");
        let (root, vectors) = match inner.is_dir() {
            true => (folder, inner.as_path()),
            false => (folder.parent().unwrap_or(folder), folder),
        };
        let mut suite = Self { version: None, specification: None, changed: None, vectors: Vec::new() };
        for kind in [Kind::Valid, Kind::Invalid, Kind::Either] {
            for area in folders(&vectors.join(kind.name()))? {
                for folder in folders(&area)? {
                    suite.vectors.extend(Located::read(&folder, kind, &area)?);
                }
            }
        }
        if suite.vectors.is_empty() {
            return Err(Error::content(folder, nothing_here(folder)));
        }
        suite.check_names(vectors)?;
        suite.read_version(&root.join("VERSION"));
        if let Some(other) = suite.specification.as_deref().filter(|&other| other != SPECIFICATION) {
            let message = format!(
                "these vectors are for specification {other}, and this program tests decoders of {SPECIFICATION}: take \
                 both from the same release"
            );
            return Err(Error::content(folder, message));
        }
        suite.compare_manifest(&root.join("MANIFEST"));
        Ok(suite)
    }

    /// SHA-256 over names and records: equal for equal vectors. It covers a line `sha256 name` for each vector in the order
    /// of the names, where sha256 is that of its vector.json.
    pub fn sha256(&self) -> String {
        let mut vectors: Vec<(&str, &str)> = self
            .vectors
            .iter()
            .map(|located| (located.vector.name.as_str(), located.sha256.as_str()))
            .collect();
        vectors.sort_unstable();
        let lines = vectors.into_iter().map(|(name, sha256)| format!("{sha256} {name}\n"));
        digest::sha256(lines.collect::<String>().as_bytes())
    }

    /// The message that the vectors are not those of the version; none if they are.
    pub fn complaint(&self) -> Option<String> {
        let version = self.version.as_deref().unwrap_or("of a known version");
        self.changed.as_ref().map(|changed| format!("this is not suite {version}: {changed}"))
    }

    /// Compares with MANIFEST, which the generator writes: the number of vectors, then [`Suite::sha256`].
    fn compare_manifest(&mut self, path: &Path) {
        let text = fs::read_to_string(path).unwrap_or_default();
        let mut words = text.split_whitespace();
        let count = words.next().and_then(|count| count.parse::<usize>().ok());
        let (Some(count), Some(sha256)) = (count, words.next()) else {
            self.changed = Some("it has no MANIFEST next to the vectors".to_owned());
            return;
        };
        if sha256 == self.sha256() {
            return;
        }
        let are = |number: usize| counted(number, "vector") + if number == 1 { " is" } else { " are" };
        self.changed = Some(match self.vectors.len() {
            found if found < count => format!("{} missing", are(count.saturating_sub(found))),
            found if found > count => format!("{} not part of it", are(found.saturating_sub(count))),
            _ => "vectors were changed".to_owned(),
        });
    }

    fn check_names(&self, folder: &Path) -> Result<()> {
        let mut streams = BTreeMap::new();
        for Located { vector, stream, .. } in &self.vectors {
            if let Some(other) = streams.insert(&vector.name, stream) {
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
        let again = "get the suite again";
        let record = fs::read(&path).map_err(Error::file("read", &path))?;
        let vector: Vector = serde_json::from_slice(&record)
            .map_err(|error| Error::content(&path, format!("{error}\n  {again}")))?;
        let stream = folder.join("in.gss");
        let bytes = fs::read(&stream)
            .map_err(|error| Error::content(&stream, format!("cannot read: {error}\n  {again}")))?;
        let name = |path: &Path| path.file_name().map(|name| name.to_string_lossy().into_owned());
        let complaint = if vector.schema != SCHEMA {
            Some(format!("the schema is {}, this runner knows {SCHEMA}", vector.schema))
        } else if (name(folder).as_ref(), name(area).as_ref(), kind)
            != (Some(&vector.name), Some(&vector.area), vector.kind)
        {
            Some("name, area and kind are not those of the folder".to_owned())
        } else if vector.bytes != bytes.len() as u64 || vector.sha256 != digest::sha256(&bytes) {
            Some(format!("in.gss is not the stream of this record\n  {again}"))
        } else {
            inconsistency(&vector)
        };
        let sha256 = digest::sha256(&record);
        let located = Self { vector, stream, sha256 };
        complaint.map_or(Ok(Some(located)), |message| Err(Error::content(&path, message)))
    }
}

/// The message for a folder without vectors, with the place where they may be: below it, above it, or elsewhere.
fn nothing_here(folder: &Path) -> String {
    let has_vectors = |path: &Path| path.join("valid").is_dir() && path.join("invalid").is_dir();
    let below = ["vectors", "conformance/vectors"].map(|inner| folder.join(inner));
    let found =
        below.iter().map(PathBuf::as_path).chain(folder.ancestors().skip(1)).find(|path| has_vectors(path));
    let advice = match found {
        Some(path) => format!("did you mean --suite {}", path.display()),
        None => "give the folder of the vectors with --suite DIR".to_owned(),
    };
    format!("no vectors here: there should be folders valid/AREA/NAME with a vector.json\n  {advice}")
}

/// A contradiction in a record.
fn inconsistency(vector: &Vector) -> Option<String> {
    let mut verdicts =
        std::iter::once(&vector.expect).chain(vector.points.iter().filter_map(|point| point.expect.as_ref()));
    if !verdicts.all(|verdict| verdict.is_consistent()) {
        return Some("a rejection has a class, an acceptance has none".to_owned());
    }
    if !vector.acceptable.is_empty() && vector.kind == Kind::Valid {
        return Some("a vector of kind valid has no acceptable rejections".to_owned());
    }
    if vector.inside.is_some() && vector.points.iter().any(|point| point.mode != Mode::Full) {
        return Some("points of a vector with inside have mode full".to_owned());
    }
    if vector.sweep.is_some() && (!vector.points.is_empty() || vector.inside.is_some()) {
        return Some("a vector with sweep has neither points nor inside".to_owned());
    }
    let of_points = vector.points.iter().filter_map(|point| point.states.as_ref()).flatten();
    let mut states =
        of_points.chain(vector.sweep.iter().flat_map(|sweep| &sweep.steps).flat_map(|step| &step.states));
    states
        .any(|&state| state >= vector.states.len())
        .then(|| "a point or step refers to a state that does not exist".to_owned())
}

/// The folders in a folder by name; none if it does not exist.
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
