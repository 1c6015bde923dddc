//! Operating points: text or three numbers in Python.

use pyo3::exceptions::{PyOverflowError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use splatstream::OperatingPoint;

/// An operating point as `"s0,t1,r2"` or as a tuple of three numbers.
pub(crate) struct Point(pub(crate) OperatingPoint);

impl<'py> FromPyObject<'_, 'py> for Point {
    type Error = PyErr;

    fn extract(value: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        if let Ok(text) = value.extract::<String>() {
            let point = text.parse().map(Self);
            return point.map_err(|error: splatstream::ParseOperatingPointError| {
                PyValueError::new_err(error.to_string())
            });
        }
        match value.extract::<(u8, u8, u8)>() {
            Ok((spatial, temporal, refinement)) => Ok(Self(OperatingPoint { spatial, temporal, refinement })),
            Err(error) if error.is_instance_of::<PyOverflowError>(value.py()) => {
                let found = value.repr()?;
                Err(PyValueError::new_err(format!(
                    "the operating point is {found}, and its numbers go from 0 to 255"
                )))
            }
            Err(_) => {
                let found = value.repr()?;
                Err(PyTypeError::new_err(format!(
                    "the operating point is {found}: write it as \"s0,t0,r2\" or (0, 0, 2)"
                )))
            }
        }
    }
}

/// Why a stream that goes up to a point has no such point; none if it has.
pub(crate) fn refused(point: OperatingPoint, highest: OperatingPoint) -> Option<PyErr> {
    let message = || format!("there is no operating point {point}; the points go from s0,t0,r0 to {highest}");
    (!point.is_within(highest)).then(|| PyValueError::new_err(message()))
}

/// The class of operating points.
pub(crate) fn to_python(py: Python<'_>, point: OperatingPoint) -> PyResult<Bound<'_, PyAny>> {
    let class = py.import("splatstream_codec._types")?.getattr("OperatingPoint")?;
    class.call1((point.spatial, point.temporal, point.refinement))
}
