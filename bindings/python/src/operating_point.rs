//! Operating points: text or three numbers in Python.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use splatstream::OperatingPoint;

/// An operating point as `"s0,t1,r2"` or as a sequence of three numbers.
pub(crate) struct Point(pub(crate) OperatingPoint);

impl<'py> FromPyObject<'_, 'py> for Point {
    type Error = PyErr;

    fn extract(value: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        if let Ok((spatial, temporal, refinement)) = value.extract::<(u8, u8, u8)>() {
            return Ok(Self(OperatingPoint { spatial, temporal, refinement }));
        }
        let text: String = value.extract()?;
        text.parse()
            .map(Self)
            .map_err(|error: splatstream::ParseOperatingPointError| PyValueError::new_err(error.to_string()))
    }
}

/// The class of operating points.
pub(crate) fn to_python(py: Python<'_>, point: OperatingPoint) -> PyResult<Bound<'_, PyAny>> {
    let class = py.import("splatstream_codec._types")?.getattr("OperatingPoint")?;
    class.call1((point.spatial, point.temporal, point.refinement))
}
