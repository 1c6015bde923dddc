//! Standard 3D Gaussian splatting PLY, as the original training code writes it.
//!
//! Read: ascii and both byte orders, any scalar type, any property order; other properties and elements are
//! ignored. `f_rest_*` holds one channel after another and may have 0, 9, 24, 45 or 72 properties, those of degree 4, which
//! is reduced to 3. Without `scale_2`, Gaussians are flat (2DGS): they get a third semi-axis of 1e-6. Infinite `opacity`, which
//! converters write for an opacity of exactly 0 or 1, becomes a finite logit, half a step of 8 bits inside.
//! Written: binary little endian `f32` in the original order, normals zero.

mod header;
mod points;
mod table;

pub(crate) use header::{Element, Header, MOST_HEADER, is_ply, parse as parse_header};
pub use points::{PointCloud, read_points};
pub(crate) use table::Body;

use crate::byte_values::logit_of_byte;
use crate::error::SceneError;
use crate::limits::{Budget, ReadLimits};
use crate::note::{MOST_SH_DEGREE, Note};
use crate::reading::{checked, frame_of};
use splatstream_gaussians::{GaussianFrame, MAX_SH_DEGREE, Planes, rest_index, sh_coefficients, sh_planes};

/// Reads a PLY file. Rotations come out at unit length.
///
/// # Errors
/// A header that is not understood, missing properties (all of them are named), fewer bytes than the header
/// promises, more than `limits` allow, or a value that no frame may hold (row and property are named).
pub fn read(bytes: &[u8], limits: &ReadLimits) -> Result<GaussianFrame, SceneError> {
    checked(read_as_is(bytes, &mut Budget::new(limits))?)
}

/// As [`read`], with values as they are, but for infinite opacities: none is checked.
pub(crate) fn read_as_is(bytes: &[u8], budget: &mut Budget) -> Result<GaussianFrame, SceneError> {
    let header = parse_header(bytes, budget)?;
    let vertex = header.element("vertex").ok_or_else(|| {
        SceneError::inconsistent("no element is called vertex", "this PLY file holds no Gaussians")
    })?;
    if is_packed(vertex) {
        let what = "this is a compressed PLY: its vertices are packed_position and so on";
        return Err(SceneError::unsupported(what, "read it as compressed PLY"));
    }
    let rest = Rest::of(vertex, budget)?;
    let names = names(&rest, !is_flat(vertex));
    require(vertex, &names)?;
    let mut body = Body::new(bytes, &header);
    for element in header.elements.iter().take_while(|element| element.name != "vertex") {
        body.skip(element)?;
    }
    let columns = body.columns(vertex, &names, budget)?;
    body.end(header.elements.iter().skip_while(|element| element.name != "vertex").skip(1), budget);
    let mut planes = planes_of_columns(rest.sh_degree, is_flat(vertex), columns);
    if is_flat(vertex) {
        thicken(&mut planes, budget)?;
    }
    bound_opacities(&mut planes.opacity_logit, budget);
    frame_of(rest.sh_degree, planes)
}

/// Natural log of the semi-axis that flat Gaussians get, 1e-6: thinner than a pixel in any view of a scene, and finite.
const FLAT_LOG_SCALE: f32 = -13.815_511;

/// Whether Gaussians have two semi-axes: all properties but the third scale.
fn is_flat(vertex: &Element) -> bool {
    vertex.has("scale_0") && vertex.has("scale_1") && !vertex.has("scale_2")
}

/// Gives flat Gaussians their third semi-axis.
fn thicken(planes: &mut Planes, budget: &mut Budget) -> Result<(), SceneError> {
    let count = planes.opacity_logit.len();
    let [.., third] = &mut planes.log_scale;
    *third = budget.room(count as u64, "the third semi-axis")?;
    third.resize(count, FLAT_LOG_SCALE);
    budget.note(Note::Flat { log_scale: FLAT_LOG_SCALE });
    Ok(())
}

/// Gives opacities of exactly 0 and 1, whose logits are infinite, the logits that readers of 8-bit opacities give them.
fn bound_opacities(logits: &mut [f32], budget: &mut Budget) {
    let mut count: u64 = 0;
    for logit in logits.iter_mut().filter(|logit| logit.is_infinite()) {
        *logit = logit_of_byte(if *logit > 0.0 { u8::MAX } else { 0 });
        count = count.saturating_add(1);
    }
    if count > 0 {
        budget.note(Note::ExactOpacity { count });
    }
}

/// Writes a frame: every value exactly, whatever it is.
pub fn write(frame: &GaussianFrame) -> Vec<u8> {
    let mut names = names(&Rest::all_of(frame.sh_degree()), true);
    names.splice(3..3, ["nx", "ny", "nz"].map(str::to_owned));
    let mut text = format!("ply\nformat binary_little_endian 1.0\nelement vertex {}\n", frame.len());
    for name in &names {
        text.push_str(&format!("property float {name}\n"));
    }
    text.push_str("end_header\n");
    let mut out = text.into_bytes();
    out.reserve(frame.len().saturating_mul(names.len()).saturating_mul(4));
    let columns = columns_of_frame(frame);
    for row in 0..frame.len() {
        for column in &columns {
            let value = column.and_then(|column| column.get(row)).copied().unwrap_or(0.0);
            out.extend_from_slice(&value.to_le_bytes());
        }
    }
    out
}

/// Whether the vertices are those of a compressed PLY.
pub(crate) fn is_packed(vertex: &Element) -> bool {
    vertex.has("packed_position")
}

/// Refuses an element that lacks any of `names`; the error lists all that are missing.
pub(crate) fn require(element: &Element, names: &[String]) -> Result<(), SceneError> {
    let missing: Vec<&str> = names.iter().filter(|name| !element.has(name)).map(String::as_str).collect();
    if missing.is_empty() {
        return Ok(());
    }
    let what = format!("element {} lacks {}", element.name, missing.join(", "));
    Err(SceneError::inconsistent(what, "export it as a Gaussian splatting PLY with all its properties"))
}

/// The `f_rest_*` properties of an element: what it stores, and what a frame takes of it.
pub(crate) struct Rest {
    /// Of the file.
    stored_degree: u8,
    /// Of the frame, 3 at most.
    pub(crate) sh_degree: u8,
}

impl Rest {
    /// Finds the degree that an element's number of `f_rest_*` properties stands for; one that is too high is noted.
    pub(crate) fn of(element: &Element, budget: &mut Budget) -> Result<Self, SceneError> {
        let is_rest =
            |name: &str| name.strip_prefix("f_rest_").is_some_and(|digits| digits.parse::<u32>().is_ok());
        let found = element.properties.iter().filter(|property| is_rest(&property.name)).count();
        let stored_degree = degree_of_values(found).ok_or_else(|| {
            let what = format!("element {} has {found} f_rest properties", element.name);
            let advice = "SH degrees 0 to 4 have 0, 9, 24, 45 or 72; export it with one of these";
            SceneError::inconsistent(what, advice)
        })?;
        if stored_degree > MAX_SH_DEGREE {
            budget.note(Note::ShDegree { found: stored_degree });
        }
        Ok(Self { stored_degree, sh_degree: stored_degree.min(MAX_SH_DEGREE) })
    }

    /// All of a degree, 3 at most.
    fn all_of(sh_degree: u8) -> Self {
        Self { stored_degree: sh_degree, sh_degree }
    }

    /// The names that a frame takes: one channel after another, of each the coefficients of the frame's degree.
    pub(crate) fn names(&self) -> impl Iterator<Item = String> {
        let (kept, stored) = (sh_coefficients(self.sh_degree), sh_coefficients(self.stored_degree));
        let first = (0..3_usize).map(move |channel| channel.saturating_mul(stored));
        first.flat_map(move |first| (first..first.saturating_add(kept)).map(|at| format!("f_rest_{at}")))
    }
}

/// The degree whose three channels have `values` coefficients in all: 0, 9, 24, 45, 72; none otherwise.
fn degree_of_values(values: usize) -> Option<u8> {
    (0..=MOST_SH_DEGREE).find(|&degree| sh_planes(degree) == values)
}

/// SH planes, coefficient by coefficient, of `f_rest_*` columns, channel by channel.
pub(crate) fn planes_of_rest<T: Default>(sh_degree: u8, mut rest: Vec<T>) -> Vec<T> {
    let planes = 0..rest.len();
    let mut take = |plane| rest.get_mut(rest_index(plane, sh_degree)).map(std::mem::take).unwrap_or_default();
    planes.map(&mut take).collect()
}

/// The properties that make a Gaussian, in the order of the original code, without normals; flat ones have two scales.
fn names(rest: &Rest, is_solid: bool) -> Vec<String> {
    let numbered = |prefix: &'static str, count: usize| (0..count).map(move |at| format!("{prefix}_{at}"));
    let position = ["x", "y", "z"].into_iter().map(str::to_owned);
    position
        .chain(numbered("f_dc", 3))
        .chain(rest.names())
        .chain(std::iter::once("opacity".to_owned()))
        .chain(numbered("scale", if is_solid { 3 } else { 2 }))
        .chain(numbered("rot", 4))
        .collect()
}

/// Planes of columns in the order of [`names`].
fn planes_of_columns(sh_degree: u8, is_flat: bool, columns: Vec<Vec<f32>>) -> Planes {
    let mut columns = columns.into_iter();
    // There are as many columns as names, so none of these defaults is ever used.
    let mut next = || columns.next().unwrap_or_default();
    let position = std::array::from_fn(|_| next());
    let dc = std::array::from_fn(|_| next());
    let rest = (0..sh_planes(sh_degree)).map(|_| next()).collect();
    let opacity_logit = next();
    let log_scale = std::array::from_fn(|axis| if is_flat && axis == 2 { Vec::new() } else { next() });
    let rotation = std::array::from_fn(|_| next());
    Planes { position, log_scale, rotation, opacity_logit, dc, sh: planes_of_rest(sh_degree, rest) }
}

/// The columns that [`write`] writes; none where it writes zeros.
fn columns_of_frame(frame: &GaussianFrame) -> Vec<Option<&[f32]>> {
    let mut rest = vec![None; frame.sh().len()];
    for (plane, values) in frame.sh().iter().enumerate() {
        if let Some(column) = rest.get_mut(rest_index(plane, frame.sh_degree())) {
            *column = Some(values.as_slice());
        }
    }
    let some = |plane| Some(Vec::as_slice(plane));
    let mut columns: Vec<Option<&[f32]>> = frame.position().iter().map(some).collect();
    columns.extend([None; 3]);
    columns.extend(frame.dc().iter().map(some));
    columns.extend(rest);
    columns.push(Some(frame.opacity_logit()));
    columns.extend(frame.log_scale().iter().map(some));
    columns.extend(frame.rotation().iter().map(some));
    columns
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_degree_follows_from_the_number_of_values() {
        let degrees = [Some(0), Some(1), Some(2), Some(3), Some(4), None];
        assert_eq!([0, 9, 24, 45, 72, 12].map(degree_of_values), degrees);
    }
}
