//! Frames for renderers: every Gaussian keeps its row, and what has changed is told.

use crate::arrays::{attribute, interleaved, owned};
use crate::errors::decode_error;
use crate::frame::{Frame, decoded};
use numpy::ndarray::IxDyn;
use numpy::{PyArrayDyn, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PySlice;
use splatstream::Planes;
use std::ops::Range;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Arrays of a fixed number of rows. A Gaussian has the same row in every frame from the one that it appears in to the one
/// that it disappears in; a row without a Gaussian has opacity 0 (its logit is minus infinity) and is 0 otherwise.
///
/// The arrays are written in place: a renderer wraps them once, and after each `update` copies only the rows that have
/// changed. Read them only.
///
/// Args:
///     capacity: Rows; a frame with more Gaussians is refused.
///
/// Example:
///     >>> slots = gss.Slots(500_000)
///     >>> for frame in gss.decode("talk.gss"):
///     ...     for rows in slots.update(frame).dirty:
///     ...         upload(rows.start, slots.position[rows])
#[pyclass(frozen, module = "splatstream_codec")]
pub(crate) struct Slots(Mutex<State>);

struct State {
    slots: splatstream::Slots,
    /// In the order of [`NAMES`].
    arrays: [Py<PyArrayDyn<f32>>; 6],
}

const NAMES: [&str; 6] = ["position", "log_scale", "rotation", "opacity_logit", "dc", "sh"];

/// What a frame has changed in slots.
#[pyclass(frozen, get_all, module = "splatstream_codec")]
pub(crate) struct Update {
    /// Slices of rows of which some value has changed, increasing.
    dirty: Vec<Py<PySlice>>,
    /// Gaussians that keep their row.
    kept: usize,
    /// Gaussians that have appeared.
    appeared: usize,
    /// Gaussians that have disappeared.
    disappeared: usize,
    /// The degree of the spherical harmonics has changed: `sh` is another array.
    has_new_sh: bool,
}

/// An array of one attribute of all rows, as they are in the planes.
fn array(py: Python<'_>, planes: &Planes, name: &str) -> PyResult<Py<PyArrayDyn<f32>>> {
    let rows = planes.opacity_logit.len();
    let planes = attribute(planes.into(), name);
    let shape = match name {
        "opacity_logit" => vec![rows],
        "sh" => vec![rows, planes.len() / 3, 3],
        _ => vec![rows, planes.len()],
    };
    Ok(owned(py, IxDyn(&shape), interleaved(planes.into_iter(), rows))?.unbind())
}

/// Copies rows of planes to an array.
fn copy(to: &Bound<'_, PyArrayDyn<f32>>, planes: &[&[f32]], dirty: &[Range<usize>]) -> PyResult<()> {
    let mut array = to.try_readwrite()?;
    let values = array.as_slice_mut()?;
    let width = planes.len();
    for range in dirty {
        for (component, plane) in planes.iter().enumerate() {
            let to = values.iter_mut().skip(range.start * width + component).step_by(width.max(1));
            let from = plane.get(range.clone()).unwrap_or_default();
            to.zip(from).for_each(|(to, from)| *to = *from);
        }
    }
    Ok(())
}

impl Slots {
    /// No call lets another thread of Python run while it has the lock.
    fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn array<'py>(&self, py: Python<'py>, at: usize) -> Bound<'py, PyArrayDyn<f32>> {
        self.state().arrays[at].bind(py).clone()
    }
}

#[pymethods]
impl Slots {
    #[new]
    fn new(py: Python<'_>, capacity: u32) -> PyResult<Self> {
        let slots = splatstream::Slots::new(capacity as usize);
        let [position, log_scale, rotation, opacity, dc, sh] =
            NAMES.map(|name| array(py, slots.planes(), name));
        let arrays = [position?, log_scale?, rotation?, opacity?, dc?, sh?];
        Ok(Self(Mutex::new(State { slots, arrays })))
    }

    /// Shows a frame; frames come in the order of the stream.
    ///
    /// Raises:
    ///     Error: The frame has more Gaussians than there are rows (kind "too-few-slots"). The slots are as they were.
    fn update(&self, py: Python<'_>, frame: &Bound<'_, Frame>) -> PyResult<Update> {
        let frame = decoded(frame)?;
        let mut state = self.state();
        let State { slots, arrays } = &mut *state;
        let update = slots.update(frame).map_err(|error| decode_error(py, error, Some(frame.index())))?;
        for (to, name) in arrays.iter_mut().zip(NAMES) {
            if update.has_new_planes && name == "sh" {
                *to = array(py, slots.planes(), name)?;
            } else {
                copy(to.bind(py), &attribute(slots.planes().into(), name), &update.dirty)?;
            }
        }
        let slice =
            |range: &Range<usize>| PySlice::new(py, range.start as isize, range.end as isize, 1).unbind();
        Ok(Update {
            dirty: update.dirty.iter().map(slice).collect(),
            kept: update.kept,
            appeared: update.appeared,
            disappeared: update.disappeared,
            has_new_sh: update.has_new_planes,
        })
    }

    /// Rows.
    #[getter]
    fn capacity(&self) -> usize {
        self.state().slots.capacity()
    }

    /// The row of the Gaussian with an identity, if it is in the last frame.
    fn slot(&self, identity: u32) -> Option<usize> {
        self.state().slots.slot(identity)
    }

    /// Centres, (capacity, 3).
    #[getter]
    fn position<'py>(&self, py: Python<'py>) -> Bound<'py, PyArrayDyn<f32>> {
        self.array(py, 0)
    }

    /// Natural logarithm of the semi-axes, (capacity, 3).
    #[getter]
    fn log_scale<'py>(&self, py: Python<'py>) -> Bound<'py, PyArrayDyn<f32>> {
        self.array(py, 1)
    }

    /// Quaternions w, x, y, z, (capacity, 4).
    #[getter]
    fn rotation<'py>(&self, py: Python<'py>) -> Bound<'py, PyArrayDyn<f32>> {
        self.array(py, 2)
    }

    /// Opacity before the sigmoid, (capacity,); minus infinity in rows without a Gaussian.
    #[getter]
    fn opacity_logit<'py>(&self, py: Python<'py>) -> Bound<'py, PyArrayDyn<f32>> {
        self.array(py, 3)
    }

    /// First coefficient of red, green and blue, (capacity, 3).
    #[getter]
    fn dc<'py>(&self, py: Python<'py>) -> Bound<'py, PyArrayDyn<f32>> {
        self.array(py, 4)
    }

    /// The other coefficients of the spherical harmonics, (capacity, K, 3).
    #[getter]
    fn sh<'py>(&self, py: Python<'py>) -> Bound<'py, PyArrayDyn<f32>> {
        self.array(py, 5)
    }
}
