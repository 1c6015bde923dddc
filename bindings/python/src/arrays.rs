//! From planes to arrays of NumPy and back.
//!
//! Rows of arrays are Gaussians. An array of several components holds them side by side, as renderers and trainers want it;
//! planes are arrays of one component, in the memory of the frame.

use numpy::ndarray::{Array, Dimension};
use numpy::{Element, PyArray, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use splatstream::PlanesRef;

/// The values of planes of one length, those of a row side by side.
pub(crate) fn interleaved<'a>(planes: impl ExactSizeIterator<Item = &'a [f32]>, rows: usize) -> Vec<f32> {
    let width = planes.len();
    let mut values = vec![0.0; rows * width];
    for (component, plane) in planes.enumerate() {
        let column = values.iter_mut().skip(component).step_by(width.max(1));
        column.zip(plane).for_each(|(to, from)| *to = *from);
    }
    values
}

/// An array that owns its values. `D` has as many as there are.
pub(crate) fn owned<'py, D: Dimension>(
    py: Python<'py>,
    shape: D,
    values: Vec<f32>,
) -> PyResult<Bound<'py, PyArray<f32, D>>> {
    let array =
        Array::from_shape_vec(shape, values).map_err(|error| PyValueError::new_err(error.to_string()))?;
    Ok(PyArray::from_owned_array(py, array))
}

/// The same, not to be written: others have it too.
pub(crate) fn shared<T: Element, D: Dimension>(array: Bound<'_, PyArray<T, D>>) -> Bound<'_, PyArray<T, D>> {
    // Nothing else borrows an array that has just been made.
    if let Ok(array) = array.try_readwrite() {
        drop(array.make_nonwriteable());
    }
    array
}

/// A dictionary of attributes.
pub(crate) fn dictionary<'py, const N: usize>(
    py: Python<'py>,
    attributes: [(&str, Bound<'py, PyAny>); N],
) -> PyResult<Bound<'py, PyDict>> {
    let dictionary = PyDict::new(py);
    attributes.into_iter().try_for_each(|(name, value)| dictionary.set_item(name, value))?;
    Ok(dictionary)
}

/// An array of floats in C order, of anything that NumPy makes one of; tensors of a device and of a graph come to the host.
fn floats<'py>(values: &Bound<'py, PyAny>, name: &str) -> PyResult<PyReadonlyArrayDyn<'py, f32>> {
    let py = values.py();
    let values = match values.hasattr("detach")? && values.hasattr("cpu")? {
        true => values.call_method0("detach")?.call_method0("cpu")?,
        false => values.clone(),
    };
    let numpy = py.import("numpy")?;
    if values.hasattr("mask")? && numpy.getattr("ma")?.call_method1("is_masked", (&values,))?.is_truthy()? {
        return Err(PyValueError::new_err(format!(
            "{name} has masked values: fill them, or leave their rows out of all arrays"
        )));
    }
    let keywords = PyDict::new(py);
    keywords.set_item("dtype", numpy.getattr("float32")?)?;
    let array = numpy.call_method("ascontiguousarray", (values,), Some(&keywords));
    let array = array.map_err(|error| {
        PyValueError::new_err(format!("{name} cannot be made an array of float32: {}", error.value(py)))
    })?;
    array.extract()
}

/// A frame's attributes as they come from Python.
pub(crate) struct Attributes<'py> {
    rows: usize,
    py: Python<'py>,
}

impl<'py> Attributes<'py> {
    /// Attributes of as many Gaussians as there are positions.
    pub(crate) fn new(position: &Bound<'py, PyAny>) -> PyResult<Self> {
        let rows = floats(position, "position")?.shape().first().copied().unwrap_or_default();
        Ok(Self { rows, py: position.py() })
    }

    /// The planes of an attribute of `N` components, with any axes of length 1 between.
    pub(crate) fn planes<const N: usize>(
        &self,
        name: &str,
        values: &Bound<'py, PyAny>,
    ) -> PyResult<[Vec<f32>; N]> {
        let array = floats(values, name)?;
        let long = |shape: &[usize]| shape.iter().skip(1).copied().filter(|&length| length != 1).collect();
        let components: Vec<usize> = long(array.shape());
        let expected = long(&[self.rows, N]);
        if components != expected || array.shape().first() != Some(&self.rows) {
            let shape = array.shape();
            let wanted = if N == 1 { format!("({},)", self.rows) } else { format!("({}, {N})", self.rows) };
            let why = "position has as many rows as there are Gaussians";
            return Err(PyValueError::new_err(format!("{name} has shape {shape:?}, not {wanted}; {why}")));
        }
        let values = array.as_slice()?;
        Ok(std::array::from_fn(|component| column(values, component, N)))
    }

    /// The planes of harmonics, and their degree.
    pub(crate) fn harmonics(&self, values: Option<&Bound<'py, PyAny>>) -> PyResult<(u8, Vec<Vec<f32>>)> {
        let Some(values) = values.filter(|values| !values.is_none()) else { return Ok((0, Vec::new())) };
        let array = floats(values, "sh")?;
        let (rows, coefficients) = match *array.shape() {
            [rows, coefficients, 3] => (rows, coefficients),
            _ => return Err(self.wrong_harmonics(array.shape())),
        };
        let degree = [0_usize, 3, 8, 15].iter().position(|&count| count == coefficients);
        let Some(degree) = degree.filter(|_| rows == self.rows) else {
            return Err(self.wrong_harmonics(array.shape()));
        };
        let values = array.as_slice()?;
        let planes = self.py.detach(|| {
            let width = 3 * coefficients;
            (0..width).map(|plane| column(values, plane, width)).collect()
        });
        Ok((degree as u8, planes))
    }

    fn wrong_harmonics(&self, shape: &[usize]) -> PyErr {
        PyValueError::new_err(format!(
            "sh has shape {shape:?}, not ({}, K, 3) with K 0, 3, 8 or 15, the coefficients of degree 0, 1, 2 or 3 without \
             the first",
            self.rows
        ))
    }
}

/// A component of rows of `width` values.
fn column(values: &[f32], component: usize, width: usize) -> Vec<f32> {
    values.iter().skip(component).step_by(width.max(1)).copied().collect()
}

/// The planes of an attribute by its name, for arrays.
pub(crate) fn attribute<'a>(planes: PlanesRef<'a>, name: &str) -> Vec<&'a [f32]> {
    let slices = |planes: &'a [Vec<f32>]| planes.iter().map(Vec::as_slice).collect();
    match name {
        "position" => slices(planes.position),
        "log_scale" => slices(planes.log_scale),
        "rotation" => slices(planes.rotation),
        "opacity_logit" => vec![planes.opacity_logit.as_slice()],
        "dc" => slices(planes.dc),
        _ => slices(planes.sh),
    }
}
