//! Primitives of Gaussians: their attributes, or the SPZ file that stands for them.

use super::EXTENSION;
use super::accessor::Values;
use super::buffers::Buffers;
use super::document::{Compressed, Document, Primitive, SPZ, broken};
use super::tree::Part;
use crate::axes::Flip;
use crate::byte_values::{log_scale_of, logit_within};
use crate::error::SceneError;
use crate::limits::Budget;
use crate::note::Note;
use crate::reading::frame_of;
use crate::{spz, srgb};
use splatstream_gaussians::{GaussianFrame, MAX_SH_DEGREE, sh_coefficients};

/// What colours are encoded as sRGB, as in frames, and what they are called in drafts of the extension.
const SRGB: [&str; 3] = ["srgb_rec709_display", "BT.709-sRGB", "BT.709-srgb"];

/// Colours in linear light, and the same in drafts.
const LINEAR: [&str; 2] = ["lin_rec709_display", "BT.709-linear"];

/// The Gaussians of a primitive, in the axes of frames, not yet placed.
pub(super) fn read(
    document: &Document,
    buffers: &Buffers<'_>,
    part: &Part<'_>,
    budget: &mut Budget,
) -> Result<GaussianFrame, SceneError> {
    check(part)?;
    let frame = match compressed(part.primitive) {
        Some(Compressed { buffer_view: Some(view) }) => {
            let (bytes, _) = buffers.view(document, view)?;
            spz::read_as_is(bytes, budget)
        }
        Some(_) => Err(broken(format!("{} is compressed and has no bufferView", name(part)))),
        None => attributes(document, buffers, part, budget),
    }?;
    if !colour_space(part).is_some_and(|space| LINEAR.contains(&space)) {
        return Ok(frame);
    }
    budget.note(Note::LinearColours);
    Ok(srgb::from_linear(frame))
}

/// What the colours of a primitive are, where it says so; they are sRGB otherwise.
fn colour_space<'a>(part: &Part<'a>) -> Option<&'a str> {
    part.primitive.extensions.gaussians.as_ref()?.color_space.as_deref()
}

/// What a primitive is called in messages.
fn name(part: &Part<'_>) -> String {
    format!("primitive {} of mesh {}", part.index, part.mesh)
}

fn check(part: &Part<'_>) -> Result<(), SceneError> {
    let Some(gaussians) = &part.primitive.extensions.gaussians else { return Ok(()) };
    if let Some(kernel) = gaussians.kernel.as_deref().filter(|&kernel| kernel != "ellipse") {
        let what = format!("{}: Gaussians of the kernel \"{}\"", name(part), kernel.escape_default());
        return Err(SceneError::unsupported(what, "only the kernel ellipse is known"));
    }
    if part.primitive.mode.is_some_and(|mode| mode != 0) {
        return Err(broken(format!("{} has Gaussians and is not made of points (mode 0)", name(part))));
    }
    if let Some(unknown) = gaussians.extensions.keys().find(|&name| !SPZ.contains(&name.as_str()))
        && compressed(part.primitive).is_none()
        && !part.primitive.attributes.contains_key(ROTATION)
    {
        let what = format!("{}: Gaussians by the extension {}", name(part), unknown.escape_default());
        return Err(SceneError::unsupported(what, "export them without it, or compressed as SPZ"));
    }
    let is_known = |space: &str| SRGB.contains(&space) || LINEAR.contains(&space);
    if let Some(unknown) = colour_space(part).filter(|&space| !is_known(space)) {
        let what = format!("{}: colours of the space \"{}\"", name(part), unknown.escape_default());
        return Err(SceneError::unsupported(
            what,
            "export them as srgb_rec709_display or lin_rec709_display",
        ));
    }
    Ok(())
}

/// Where a primitive is compressed.
fn compressed(primitive: &Primitive) -> Option<Compressed> {
    let extensions = &primitive.extensions;
    let inside = extensions
        .gaussians
        .iter()
        .find_map(|gaussians| SPZ.iter().find_map(|&name| gaussians.extensions.get(name)));
    inside.copied().or(extensions.spz_draft)
}

const ROTATION: &str = "KHR_gaussian_splatting:ROTATION";
const SCALE: &str = "KHR_gaussian_splatting:SCALE";
const OPACITY: &str = "KHR_gaussian_splatting:OPACITY";
pub(super) const DC: &str = "KHR_gaussian_splatting:SH_DEGREE_0_COEF_0";
pub(super) const REQUIRED: [&str; 5] = ["POSITION", ROTATION, SCALE, OPACITY, DC];

/// The attributes of the coefficients of some degrees, in the order of a frame.
pub(super) fn sh_names(sh_degree: u8) -> impl Iterator<Item = String> {
    (1..=sh_degree).flat_map(|degree| {
        (0..=u16::from(degree).saturating_mul(2))
            .map(move |at| format!("{EXTENSION}:SH_DEGREE_{degree}_COEF_{at}"))
    })
}

fn attributes(
    document: &Document,
    buffers: &Buffers<'_>,
    part: &Part<'_>,
    budget: &mut Budget,
) -> Result<GaussianFrame, SceneError> {
    let found = &part.primitive.attributes;
    let missing: Vec<&str> = REQUIRED.into_iter().filter(|&name| !found.contains_key(name)).collect();
    if !missing.is_empty() {
        return Err(broken(format!("{} lacks {}", name(part), missing.join(", "))));
    }
    let sh_degree = sh_degree(part, budget)?;
    let index = |name: &str| found.get(name).copied().unwrap_or(u32::MAX);
    let centres = Values::<3>::of(document, buffers, (REQUIRED[0], index(REQUIRED[0])))?;
    let count = centres.count;
    let same = |name: &str, other: u64| match other == count {
        true => Ok(()),
        false => Err(broken(format!("{}: {count} values of POSITION, {other} of {name}", self::name(part)))),
    };
    let mut planes = budget.planes(sh_degree, count)?;
    let flip = Flip::of_gltf();
    push(&mut planes.position, centres.iter(), |axis, value| value as f32 * sign(&flip.position(), axis));
    let rotations = Values::<4>::of(document, buffers, (ROTATION, index(ROTATION)))?;
    same(ROTATION, rotations.count)?;
    let signs = flip.rotation();
    // glTF has w last, frames have it first.
    let turned = rotations.iter().map(|[x, y, z, w]| [w, x, y, z]);
    push(&mut planes.rotation, turned, |at, value| match at.checked_sub(1) {
        Some(axis) => value as f32 * sign(&signs, axis),
        None => value as f32,
    });
    let scales = Values::<3>::of(document, buffers, (SCALE, index(SCALE)))?;
    same(SCALE, scales.count)?;
    push(&mut planes.log_scale, scales.iter(), |_, value| log_scale_of(value as f32));
    let opacities = Values::<1>::of(document, buffers, (OPACITY, index(OPACITY)))?;
    same(OPACITY, opacities.count)?;
    let margin = opacities.half_step();
    planes.opacity_logit.extend(opacities.iter().map(|[opacity]| logit_within(opacity, margin)));
    let dc = Values::<3>::of(document, buffers, (DC, index(DC)))?;
    same(DC, dc.count)?;
    push(&mut planes.dc, dc.iter(), |_, value| value as f32);
    let coefficients = planes.sh.as_chunks_mut::<3>().0.iter_mut().zip(sh_names(sh_degree)).zip(flip.sh());
    for ((planes, name), sign) in coefficients {
        let values = Values::<3>::of(document, buffers, (&name, index(&name)))?;
        same(&name, values.count)?;
        push(planes, values.iter(), |_, value| value as f32 * sign);
    }
    frame_of(sh_degree, planes)
}

/// Appends values to planes, each changed by its place.
fn push<const N: usize>(
    planes: &mut [Vec<f32>; N],
    values: impl Iterator<Item = [f64; N]>,
    change: impl Fn(usize, f64) -> f32,
) {
    for value in values {
        for (at, (plane, part)) in planes.iter_mut().zip(value).enumerate() {
            plane.push(change(at, part));
        }
    }
}

fn sign(signs: &[f32; 3], axis: usize) -> f32 {
    signs.get(axis).copied().unwrap_or(1.0)
}

/// The degree whose attributes are all there. A degree with some of them is an error; a fourth is noted and ignored.
fn sh_degree(part: &Part<'_>, budget: &mut Budget) -> Result<u8, SceneError> {
    let found = &part.primitive.attributes;
    let mut degree = 0_u8;
    for next in 1..=MAX_SH_DEGREE {
        let first = sh_coefficients(next.saturating_sub(1));
        let missing: Vec<String> =
            sh_names(next).skip(first).filter(|name| !found.contains_key(name)).collect();
        let is_whole = missing.is_empty();
        let is_there = missing.len() < sh_coefficients(next).saturating_sub(first);
        if is_there && !(is_whole && degree.checked_add(1) == Some(next)) {
            let what = match missing.first() {
                Some(name) => format!("{} lacks {name}", name_of_degree(part, next)),
                None => {
                    format!("{} comes without degree {}", name_of_degree(part, next), next.saturating_sub(1))
                }
            };
            return Err(broken(what));
        }
        if is_whole {
            degree = next;
        }
    }
    if found.keys().any(|name| name.starts_with("KHR_gaussian_splatting:SH_DEGREE_4_")) {
        budget.note(Note::ShDegree { found: 4 });
    }
    Ok(degree)
}

fn name_of_degree(part: &Part<'_>, degree: u8) -> String {
    format!("{}: SH degree {degree}", name(part))
}
