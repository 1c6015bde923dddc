//! Where the streams are.

use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The stream that the examples decode: three GOPs of 4 frames, 400 Gaussians each, two temporal layers, three refinements.
pub(crate) fn talk() -> Arc<[u8]> {
    include_bytes!("../../examples/talk.gss").as_slice().into()
}

/// All streams of the suite: valid, invalid and those that a decoder may take either way.
pub(crate) fn all() -> Vec<(PathBuf, Arc<[u8]>)> {
    let mut found = Vec::new();
    collect(&Path::new(env!("CARGO_MANIFEST_DIR")).join("conformance/vectors"), &mut found);
    found.sort();
    assert!(found.len() > 1000, "the vectors are there");
    found.into_iter().map(|path| (path.clone(), std::fs::read(path).unwrap().into())).collect()
}

fn collect(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        match path.is_dir() {
            true => collect(&path, found),
            false => found.extend(path.extension().is_some_and(|end| end == "gss").then_some(path)),
        }
    }
}
