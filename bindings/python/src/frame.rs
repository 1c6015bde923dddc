//! A decoded frame.

use crate::arrays::dictionary;
use crate::errors::damage;
use crate::gaussians::{Gaussians, Source, borrowed, planes_of};
use crate::operating_point;
use numpy::PyArray1;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

/// One frame of a stream: Gaussians, most important first within each refinement, and what is known of the frame.
#[pyclass(frozen, extends = Gaussians, module = "splatstream_codec")]
pub(crate) struct Frame;

impl Frame {
    pub(crate) fn new(py: Python<'_>, frame: splatstream::Frame) -> PyResult<Py<Self>> {
        let gaussians = Gaussians::new(Source::Decoded(Box::new(frame)));
        Py::new(py, PyClassInitializer::from(gaussians).add_subclass(Self))
    }
}

/// The decoded frame in its base class, where each has one.
pub(crate) fn decoded<'a>(frame: &'a Bound<'_, Frame>) -> PyResult<&'a splatstream::Frame> {
    let decoded = frame.as_super().get().decoded();
    decoded.ok_or_else(|| PyRuntimeError::new_err("this frame was not decoded"))
}

#[pymethods]
impl Frame {
    /// Its number in the order in which frames are shown, from 0.
    #[getter]
    fn index(this: &Bound<'_, Self>) -> PyResult<u32> {
        Ok(decoded(this)?.index())
    }

    /// When it is shown, seconds from the start of the stream.
    #[getter]
    fn time(this: &Bound<'_, Self>) -> PyResult<f64> {
        Ok(decoded(this)?.time().as_secs_f64())
    }

    /// Whether it refers to no other frame.
    #[getter]
    fn is_keyframe(this: &Bound<'_, Self>) -> PyResult<bool> {
        Ok(decoded(this)?.is_keyframe())
    }

    /// The operating point that it was decoded at.
    #[getter]
    fn operating_point<'py>(this: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        operating_point::to_python(this.py(), decoded(this)?.operating_point())
    }

    /// How many refinements it shows exactly. Fewer than the operating point asks for if some are missing.
    #[getter]
    fn refinements(this: &Bound<'_, Self>) -> PyResult<u8> {
        Ok(decoded(this)?.refinements())
    }

    /// How many of its Gaussians, the last ones, are those of an earlier frame, moved: they stand in for refinements that
    /// are not there.
    #[getter]
    fn carried(this: &Bound<'_, Self>) -> PyResult<usize> {
        Ok(decoded(this)?.carried())
    }

    /// Bytes of its units that were decoded, headers included.
    #[getter]
    fn bytes(this: &Bound<'_, Self>) -> PyResult<u64> {
        Ok(decoded(this)?.bytes())
    }

    /// The digest of the Gaussians that it shows exactly, clause 7.9: equal digests mean equal frames, on any machine.
    /// None where nothing is exact.
    #[getter]
    fn digest(this: &Bound<'_, Self>) -> PyResult<Option<u64>> {
        Ok(decoded(this)?.digest())
    }

    /// The identity of each Gaussian, (N,) uint32: the same in two frames for the same Gaussian. Read-only, without a copy.
    #[getter]
    fn identities<'py>(this: &Bound<'py, Self>) -> PyResult<Bound<'py, PyArray1<u32>>> {
        decoded(this)?;
        Ok(borrowed(this.as_super(), |owner| owner.decoded().map_or(&[], splatstream::Frame::identities)))
    }

    /// What was lost since the frame before: a list of Damage.
    #[getter]
    fn warnings<'py>(this: &Bound<'py, Self>) -> PyResult<Bound<'py, PyList>> {
        let py = this.py();
        let warnings = decoded(this)?.warnings().iter().map(|warning| damage(py, warning));
        PyList::new(py, warnings.collect::<PyResult<Vec<_>>>()?)
    }

    /// The Gaussians as integers on the grids of the stream, which every decoder gets alike: a tuple of arrays (N,) by
    /// attribute, read-only, without a copy. The w of rotations follows from x, y and z.
    fn integers<'py>(this: &Bound<'py, Self>) -> PyResult<Bound<'py, PyDict>> {
        let sh = decoded(this)?.integers().sh.len();
        let owner = this.as_super();
        let opacity = planes_of(owner, 1, |owner, _| of(owner, |planes| &planes.opacity))?;
        dictionary(
            this.py(),
            [
                ("position", planes_of(owner, 3, |owner, at| of(owner, |all| &all.position[at]))?.into_any()),
                (
                    "log_scale",
                    planes_of(owner, 3, |owner, at| of(owner, |all| &all.log_scale[at]))?.into_any(),
                ),
                ("rotation", planes_of(owner, 3, |owner, at| of(owner, |all| &all.rotation[at]))?.into_any()),
                ("opacity_logit", opacity.into_any()),
                ("dc", planes_of(owner, 3, |owner, at| of(owner, |all| &all.dc[at]))?.into_any()),
                ("sh", planes_of(owner, sh, |owner, at| of(owner, |all| &all.sh[at]))?.into_any()),
            ],
        )
    }

    fn __repr__(this: &Bound<'_, Self>) -> PyResult<String> {
        let frame = decoded(this)?;
        let point = frame.operating_point();
        Ok(format!("<Frame {}: {} Gaussians at {point}, {:?}>", frame.index(), frame.len(), frame.time()))
    }
}

/// A plane of the integers.
fn of<T>(owner: &Gaussians, plane: impl FnOnce(&splatstream::Integers) -> &Vec<T>) -> &[T] {
    owner.decoded().map_or(&[], |frame| plane(frame.integers()))
}
