//! Standard 3D Gaussian splatting PLY, as the original training code writes it.
//!
//! Read: ascii and both byte orders, any scalar type, any property order; other properties and elements are
//! passed over. `f_rest_*` holds one channel after another and may have 0, 9, 24 or 45 properties.
//! Written: binary little endian `f32` in the original order, normals zero.

mod header;
mod points;
mod table;

pub(crate) use header::{Element, Header, is_ply, parse as parse_header};
pub use points::{PointCloud, read_points};
pub(crate) use table::Body;

use crate::error::SceneError;
use crate::limits::{Budget, ReadLimits};
use crate::reading::{checked, frame_of};
use splatstream_gaussians::{GaussianFrame, MAX_SH_DEGREE, Planes, rest_index, sh_planes};

/// Reads a PLY file. Rotations come out at unit length.
///
/// # Errors
/// A header that is not understood, missing properties (all of them are named), fewer bytes than the header
/// promises, more than `limits` allow, or a value that no frame may hold (row and property are named).
pub fn read(bytes: &[u8], limits: &ReadLimits) -> Result<GaussianFrame, SceneError> {
    checked(read_as_is(bytes, &mut Budget::new(limits))?)
}

/// As [`read`], with values as they are: none is checked.
pub(crate) fn read_as_is(bytes: &[u8], budget: &mut Budget) -> Result<GaussianFrame, SceneError> {
    let header = parse_header(bytes, budget)?;
    let vertex = header.element("vertex").ok_or_else(|| {
        SceneError::inconsistent("no element is called vertex", "this PLY file holds no Gaussians")
    })?;
    if is_packed(vertex) {
        let what = "this is a compressed PLY: its vertices are packed_position and so on";
        return Err(SceneError::unsupported(what, "read it as compressed PLY"));
    }
    let sh_degree = degree_of_rest(vertex)?;
    let names = names(sh_degree);
    require(vertex, &names)?;
    let mut body = Body::new(bytes, &header);
    for element in header.elements.iter().take_while(|element| element.name != "vertex") {
        body.skip(element)?;
    }
    let columns = body.columns(vertex, &names, budget)?;
    frame_of(sh_degree, planes_of_columns(sh_degree, columns))
}

/// Writes a frame: every value exactly, whatever it is.
pub fn write(frame: &GaussianFrame) -> Vec<u8> {
    let mut names = names(frame.sh_degree());
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

/// The SH degree that an element's number of `f_rest_*` properties stands for.
pub(crate) fn degree_of_rest(element: &Element) -> Result<u8, SceneError> {
    let is_rest =
        |name: &str| name.strip_prefix("f_rest_").is_some_and(|digits| digits.parse::<u32>().is_ok());
    let found = element.properties.iter().filter(|property| is_rest(&property.name)).count();
    degree_of_values(found).ok_or_else(|| {
        let what = format!("element {} has {found} f_rest properties", element.name);
        SceneError::inconsistent(what, "SH degrees 0 to 3 have 0, 9, 24 or 45; export it with one of these")
    })
}

/// The degree whose three channels have `values` coefficients in all: 0, 9, 24, 45; none otherwise.
fn degree_of_values(values: usize) -> Option<u8> {
    (0..=MAX_SH_DEGREE).find(|&degree| sh_planes(degree) == values)
}

/// `f_rest_0` and on, as many as the degree has.
pub(crate) fn rest_names(sh_degree: u8) -> impl Iterator<Item = String> {
    (0..sh_planes(sh_degree)).map(|at| format!("f_rest_{at}"))
}

/// SH planes, coefficient by coefficient, of `f_rest_*` columns, channel by channel.
pub(crate) fn planes_of_rest<T: Default>(sh_degree: u8, mut rest: Vec<T>) -> Vec<T> {
    let planes = 0..rest.len();
    let mut take = |plane| rest.get_mut(rest_index(plane, sh_degree)).map(std::mem::take).unwrap_or_default();
    planes.map(&mut take).collect()
}

/// The properties that make a Gaussian, in the order of the original code, without normals.
fn names(sh_degree: u8) -> Vec<String> {
    let numbered = |prefix: &'static str, count: usize| (0..count).map(move |at| format!("{prefix}_{at}"));
    let position = ["x", "y", "z"].into_iter().map(str::to_owned);
    position
        .chain(numbered("f_dc", 3))
        .chain(rest_names(sh_degree))
        .chain(std::iter::once("opacity".to_owned()))
        .chain(numbered("scale", 3))
        .chain(numbered("rot", 4))
        .collect()
}

/// Planes of columns in the order of [`names`].
fn planes_of_columns(sh_degree: u8, columns: Vec<Vec<f32>>) -> Planes {
    let mut columns = columns.into_iter();
    // There are as many columns as names, so none of these defaults is ever used.
    let mut next = || columns.next().unwrap_or_default();
    let position = std::array::from_fn(|_| next());
    let dc = std::array::from_fn(|_| next());
    let rest = (0..sh_planes(sh_degree)).map(|_| next()).collect();
    let opacity_logit = next();
    let log_scale = std::array::from_fn(|_| next());
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
        assert_eq!([0, 9, 24, 45, 12].map(degree_of_values), [Some(0), Some(1), Some(2), Some(3), None]);
    }
}
