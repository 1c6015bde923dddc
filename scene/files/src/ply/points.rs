//! Points with colours, as structure from motion and scanners write them.

use super::{Body, parse_header, require};
use crate::error::SceneError;
use crate::limits::{Budget, ReadLimits};

/// Points of a PLY file, row by row.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PointCloud {
    /// x, y and z; all finite.
    pub position: [Vec<f32>; 3],
    /// Red, green and blue, 0 to 255; grey where the file has none.
    pub colour: [Vec<u8>; 3],
}

/// Reads the points of a PLY file: `x`, `y`, `z` and, if it has them, `red`, `green`, `blue` of 0 to 255, of the element
/// `vertex`; other properties are ignored.
///
/// # Errors
/// A header that is not understood, missing coordinates, fewer bytes than the header promises, more than `limits` allow, or a
/// coordinate that is not finite.
///
/// ```
/// use splatstream_files::{ReadLimits, ply};
///
/// let file = b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n\
///     property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n1 2 3 255 0 9\n";
/// let points = ply::read_points(file, &ReadLimits::default())?;
/// assert_eq!((points.position[2][0], points.colour[2][0]), (3.0, 9));
/// # Ok::<(), splatstream_files::SceneError>(())
/// ```
pub fn read_points(bytes: &[u8], limits: &ReadLimits) -> Result<PointCloud, SceneError> {
    let mut budget = Budget::new(limits);
    let header = parse_header(bytes, &mut budget)?;
    let vertex = header.element("vertex");
    let vertex = vertex.ok_or_else(|| {
        SceneError::inconsistent("no element is called vertex", "this PLY file holds no points")
    })?;
    let positions = ["x", "y", "z"].map(str::to_owned);
    let colours = ["red", "green", "blue"].map(str::to_owned);
    require(vertex, &positions)?;
    let body = || {
        let mut body = Body::new(bytes, &header);
        for element in header.elements.iter().take_while(|element| element.name != "vertex") {
            body.skip(element)?;
        }
        Ok::<_, SceneError>(body)
    };
    let position = three(body()?.columns::<f32>(vertex, &positions, &mut budget)?);
    let rows = position[0].len();
    let colour = match colours.iter().all(|name| vertex.has(name)) {
        true => three(body()?.columns::<u8>(vertex, &colours, &mut budget)?),
        false => [(); 3].map(|()| vec![128; rows]),
    };
    match (0..rows)
        .find(|&row| !position.iter().all(|plane| plane.get(row).is_some_and(|part| part.is_finite())))
    {
        None => Ok(PointCloud { position, colour }),
        Some(row) => {
            let what = format!("point {row} has a coordinate that is not finite");
            Err(SceneError::inconsistent(what, "export the points again without it"))
        }
    }
}

/// As many columns as names were asked for.
fn three<T>(columns: Vec<Vec<T>>) -> [Vec<T>; 3] {
    let mut columns = columns.into_iter();
    [(); 3].map(|()| columns.next().unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(properties: &[&str], values: &str) -> Vec<u8> {
        let properties: String = properties.iter().map(|name| format!("property float {name}\n")).collect();
        format!("ply\nformat ascii 1.0\nelement vertex 2\n{properties}end_header\n{values}\n").into_bytes()
    }

    #[test]
    fn points_without_colour_are_grey() {
        let points = read_points(&file(&["z", "x", "y"], "3 1 2 6 4 5"), &ReadLimits::default()).unwrap();
        assert_eq!(points.position, [vec![1.0, 4.0], vec![2.0, 5.0], vec![3.0, 6.0]]);
        assert_eq!(points.colour, [(); 3].map(|()| vec![128; 2]));
    }

    #[test]
    fn points_that_are_none_are_refused() {
        let refused = |bytes: &[u8]| read_points(bytes, &ReadLimits::default()).unwrap_err().to_string();
        assert!(refused(&file(&["x", "y"], "1 2 3 4")).contains("lacks z"));
        assert!(refused(&file(&["x", "y", "z"], "1 2 3 4 5")).contains("cut short"));
        assert!(refused(&file(&["x", "y", "z"], "1 2 3 4 nan 6")).contains("point 1 has a coordinate"));
        assert!(refused(b"not a file").contains("first line"));
        let small = ReadLimits { max_memory: 8 };
        assert!(read_points(&file(&["x", "y", "z"], "1 2 3 4 5 6"), &small).is_err());
    }
}
