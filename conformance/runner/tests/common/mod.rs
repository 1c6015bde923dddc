//! A made-up suite, and decoders that are one line of shell. The streams need not be valid, since the runner does not parse
//! them.
#![allow(dead_code, reason = "each test file uses its part")]

use serde_json::{Value, json};
use sha2::{Digest, Sha256};
use splatstream_conformance::cancel::Cancel;
use splatstream_conformance::capabilities::Capabilities;
use splatstream_conformance::case::Case;
use splatstream_conformance::command::Template;
use splatstream_conformance::limits::Limits;
use splatstream_conformance::result::CaseResult;
use splatstream_conformance::run::{Settings, run};
use splatstream_conformance::session::Decoder;
use splatstream_conformance::suite::Suite;
use splatstream_format::syntax::SPECIFICATION;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;
use tempfile::TempDir;

/// Shell commands that write the right files of the one frame.
pub(crate) const WRITE: &str =
    "for a in position log_scale opacity rotation dc; do printf abcd > $4/f0000.$a.i32; done";

pub(crate) fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// A folder of vectors in a temporary folder.
pub(crate) struct Vectors {
    around: TempDir,
    folder: PathBuf,
}

impl Vectors {
    pub(crate) fn none() -> Self {
        let around = tempfile::tempdir().unwrap();
        let folder = around.path().join("vectors");
        fs::create_dir(&folder).unwrap();
        Self { around, folder }
    }

    /// A suite with a valid vector `good`, an invalid one `bad`, and `big`, which may be refused.
    pub(crate) fn new() -> Self {
        let vectors = Self::none();
        vectors.add("valid", "good", json!({"outcome": "accept"}), |_| {});
        let bad =
            json!({"outcome": "reject", "class": "invalid", "code": "RANGE", "clause": "6.1", "byte": 3});
        vectors.add("invalid", "bad", bad, |record| {
            record.as_object_mut().unwrap().remove("states");
        });
        vectors.add("either", "big", json!({"outcome": "accept"}), |record| {
            record["acceptable"] = json!([{"class": "over-limit", "code": "OVER_LIMIT"}]);
        });
        vectors
    }

    /// Adds a vector whose stream is its name.
    pub(crate) fn add(&self, kind: &str, name: &str, expect: Value, change: impl FnOnce(&mut Value)) {
        let folder = self.path().join(kind).join("stream").join(name);
        fs::create_dir_all(&folder).unwrap();
        fs::write(folder.join("in.gss"), name).unwrap();
        let digest = sha256(b"abcd");
        let planes = json!({"position": digest, "log_scale": digest, "opacity": digest, "rotation": digest, "dc": digest});
        let mut record = json!({
            "schema": "splatstream-vector/1", "name": name, "area": "stream", "kind": kind, "purpose": "made up",
            "clauses": ["7.1"], "requirements": ["SS-XX-001"], "features": ["predicted"], "profile": 1, "level": 2,
            "license": "CC0-1.0", "bytes": name.len(), "sha256": sha256(name.as_bytes()), "expect": expect,
            "states": [{"frame": 0, "type": "I", "gaussians": 1, "exact": 1, "carried": 0, "planes": planes}],
            "generator": {"recipe": "none", "seed": 0},
        });
        change(&mut record);
        fs::write(folder.join("vector.json"), record.to_string()).unwrap();
    }

    pub(crate) fn path(&self) -> &Path {
        &self.folder
    }

    /// Adds VERSION and MANIFEST: version 9 of a suite.
    pub(crate) fn seal(&self) {
        let suite = self.suite();
        fs::write(self.around.path().join("VERSION"), format!("9\n{SPECIFICATION}\n")).unwrap();
        let manifest = format!("{}\n{}\n", suite.vectors.len(), suite.sha256());
        fs::write(self.around.path().join("MANIFEST"), manifest).unwrap();
    }

    pub(crate) fn suite(&self) -> Suite {
        Suite::read(self.path()).unwrap()
    }
}

/// Settings for a decoder that is a shell script; `$1` is the stream, `$2` the point, `$3` the mode, `$4` the folder.
pub(crate) fn settings(script: &str) -> Settings {
    let command = format!("sh -c '{script}' sh {{in}} {{op}} {{mode}} {{out}}");
    Settings {
        decoder: Decoder::Once(Template::parse(&command).unwrap()),
        capabilities: Capabilities::everything("script"),
        limits: Limits { time: Duration::from_secs(10), ..Limits::default() },
        strict: false,
        jobs: 2,
        cancel: Cancel::default(),
    }
}

/// The results of a run over a whole suite.
pub(crate) fn results(suite: &Suite, settings: &Settings) -> Vec<CaseResult> {
    run(&Case::all(suite), settings, |_| {}).unwrap()
}

/// The verdicts of the cases good, bad and big for a decoder.
pub(crate) fn labels(script: &str) -> [&'static str; 3] {
    let vectors = Vectors::new();
    let results = results(&vectors.suite(), &settings(script));
    ["good", "bad", "big"].map(|name| results.iter().find(|result| result.vector == name).unwrap().label())
}
