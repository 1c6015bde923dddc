//! glTF 2.0 with the extension KHR_gaussian_splatting: `.glb`, and `.gltf` with its buffers beside it or inside it.
//!
//! Gaussians are primitives of points. All of the scene are read, placed by the transforms of their nodes and joined in the
//! order of the nodes; other primitives are ignored. Compressed primitives hold an SPZ file
//! (KHR_gaussian_splatting_compression_spz_2, and the drafts before it).
//!
//! | attribute | type | value |
//! |---|---|---|
//! | `POSITION` | VEC3 | centre |
//! | `KHR_gaussian_splatting:ROTATION` | VEC4 | x, y, z, w |
//! | `KHR_gaussian_splatting:SCALE` | VEC3 | semi-axes, not their logs |
//! | `KHR_gaussian_splatting:OPACITY` | SCALAR | opacity, not its logit |
//! | `KHR_gaussian_splatting:SH_DEGREE_l_COEF_n` | VEC3 | a coefficient of red, green and blue; degree 0 is DC |
//!
//! glTF's axes are x left, y up, z forward; frames here are x right, y down, z forward. Reading and writing convert.

mod accessor;
mod buffers;
mod container;
mod document;
#[expect(clippy::arithmetic_side_effects, reason = "vectors and matrices of floats, which do not overflow")]
mod placement;
mod primitive;
#[expect(clippy::arithmetic_side_effects, reason = "floats, and degrees from 1 to 3")]
mod spin;
#[expect(clippy::arithmetic_side_effects, reason = "vectors and matrices of floats, which do not overflow")]
mod tree;
mod write;

use std::path::{Component, Path};

use crate::error::SceneError;
use crate::limits::{Budget, ReadLimits};
use crate::note::Note;
use crate::reading::{checked, frame_of, read_file};
use crate::walk::Walk;
use buffers::Buffers;
use document::Document;
use splatstream_gaussians::GaussianFrame;

pub use write::{clamped, write};

/// The extension, and what its attributes begin with.
const EXTENSION: &str = "KHR_gaussian_splatting";

const EXPORT: &str = "export the file again";

/// Reads a `.glb` file, or a `.gltf` whose buffers are all inside it.
///
/// # Errors
/// A file that is not glTF 2.0 or ends early, no Gaussians in its scene, attributes that lack or are not of the extension's
/// types, nodes with transforms that are more than translation, rotation and scale, buffers outside the file, more than
/// `limits` allow, or a value that no frame may hold.
pub fn read(bytes: &[u8], limits: &ReadLimits) -> Result<GaussianFrame, SceneError> {
    checked(read_as_is(bytes, None, &mut Budget::new(limits))?)
}

/// As [`read`], with values as they are: none is checked. Buffers with a name are read from `directory`, if there is one.
pub(crate) fn read_as_is(
    bytes: &[u8],
    directory: Option<&Path>,
    budget: &mut Budget,
) -> Result<GaussianFrame, SceneError> {
    let (json, binary) = container::split(bytes)?;
    let document = Document::parse(json, budget)?;
    let parts = tree::gaussians(&document, budget)?;
    let fetch = |name: &str, budget: &mut Budget| match directory {
        Some(directory) if is_inside(name) => read_file(&directory.join(name), budget),
        Some(_) => {
            let what = format!("the file names a buffer \"{name}\", which is not beside it");
            Err(SceneError::unsupported(
                what,
                "put the buffers into the folder of the file, or export a .glb",
            ))
        }
        None => {
            let what = format!("the file has a buffer outside of it, \"{name}\"");
            Err(SceneError::unsupported(what, "read it from its folder, or export a .glb"))
        }
    };
    let buffers = Buffers::load(&document, binary, fetch, budget)?;
    let mut frames = budget.room(parts.len() as u64, "the primitives")?;
    for part in &parts {
        let frame = primitive::read(&document, &buffers, part, budget)?;
        frames.push(placement::placed(frame, &part.placement));
    }
    joined(frames, budget)
}

/// Checks what the start of a file announces: its version, that its chunks are there, and that there is room for it and its JSON.
///
/// # Errors
/// As [`read`], as far as the start tells.
pub(crate) fn check(walk: &mut impl Walk, budget: &mut Budget) -> Result<(), SceneError> {
    let size = walk.left();
    let json = container::json_bytes(walk)?;
    budget.check(size.saturating_add(document::parsed_bytes(json)), "the JSON of the file")
}

/// Whether `bytes` begin as a `.glb` does.
pub(crate) fn is_glb(bytes: &[u8]) -> bool {
    bytes.starts_with(&container::MAGIC)
}

/// Whether `bytes` can be the JSON of a `.gltf`.
pub(crate) fn is_json(bytes: &[u8]) -> bool {
    bytes.iter().find(|byte| !byte.is_ascii_whitespace()) == Some(&b'{')
}

/// Whether a name stays in its directory: another would let a scene read any file.
fn is_inside(name: &str) -> bool {
    let mut parts = Path::new(name).components().peekable();
    parts.peek().is_some() && parts.all(|part| matches!(part, Component::Normal(_)))
}

/// One frame of several, those of lower degree with coefficients 0.
fn joined(mut frames: Vec<GaussianFrame>, budget: &mut Budget) -> Result<GaussianFrame, SceneError> {
    if frames.len() == 1
        && let Some(only) = frames.pop()
    {
        return Ok(only);
    }
    let sh_degree = frames.iter().map(GaussianFrame::sh_degree).max().unwrap_or(0);
    let antialiased = frames.iter().any(GaussianFrame::antialiased);
    let mut planes = budget.planes(sh_degree, frames.iter().map(|frame| frame.len() as u64).sum())?;
    for frame in frames {
        let rows = planes.opacity_logit.len().saturating_add(frame.len());
        let mut to = planes.iter_mut();
        frame.planes().iter().zip(&mut to).for_each(|(from, to)| to.extend_from_slice(from));
        to.for_each(|to| to.resize(rows, 0.0));
    }
    Ok(frame_of(sh_degree, planes)?.with_antialiased(antialiased))
}

/// Takes note of what the scene has beside Gaussians.
fn note_others(count: u64, budget: &mut Budget) {
    if count > 0 {
        budget.note(Note::OtherPrimitives { count });
    }
}
