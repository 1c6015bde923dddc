//! A frame of Gaussians in memory: made by Python, read from a file, or decoded.

use crate::arrays::{Attributes, attribute, dictionary, interleaved, owned, shared};
use crate::errors::scene_error;
use numpy::ndarray::{ArrayView1, Dim};
use numpy::{Element, PyArray1, PyArray2, PyArray3};
use pyo3::exceptions::{PyIndexError, PyOverflowError};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyDict, PyTuple};
use splatstream::{GaussianFrame, Planes};
use splatstream_files::{ReadLimits, ply, read_scene_as_is};
use std::path::PathBuf;

/// Gaussians as arrays, one row each.
///
/// Values are those of PLY files as trainers write them: before any activation. Arrays that are attributes are made once and
/// are read-only; `arrays()` gives copies to change.
///
/// Args:
///     position: (N, 3): x right, y down, z forward, in the unit of the scene.
///     log_scale: (N, 3): natural logarithm of the semi-axes.
///     rotation: (N, 4): quaternions w, x, y, z of any length above 0.
///     opacity_logit: (N,), or (N, 1) as some trainers keep it: opacity before the sigmoid.
///     dc: (N, 3), or (N, 1, 3) as well: the first coefficient of red, green and blue; colour = 0.5 + 0.2821 dc.
///     sh: (N, K, 3): the other coefficients, K = 3, 8 or 15 for degree 1, 2 or 3.
///     antialiased: Whether opacities were fitted for a renderer that makes up for its low-pass filter.
///
/// Example:
///     >>> import numpy as np, splatstream_codec as gss
///     >>> one = gss.Gaussians(position=np.zeros((1, 3)), log_scale=np.full((1, 3), -3.0),
///     ...                     rotation=[[1, 0, 0, 0]], opacity_logit=[2.0], dc=[[1.5, 0, 0]])
///     >>> len(one), one.sh.shape
///     (1, (1, 0, 3))
#[pyclass(frozen, subclass, module = "splatstream_codec")]
pub(crate) struct Gaussians {
    source: Source,
    made: Made,
}

/// Where the values are.
pub(crate) enum Source {
    /// As they were given.
    Given(GaussianFrame),
    /// In a decoded frame, which computes them when they are asked for.
    Decoded(Box<splatstream::Frame>),
}

/// The arrays that have been made.
struct Made {
    position: PyOnceLock<Py<PyArray2<f32>>>,
    log_scale: PyOnceLock<Py<PyArray2<f32>>>,
    rotation: PyOnceLock<Py<PyArray2<f32>>>,
    opacity_logit: PyOnceLock<Py<PyArray1<f32>>>,
    dc: PyOnceLock<Py<PyArray2<f32>>>,
    sh: PyOnceLock<Py<PyArray3<f32>>>,
}

impl Made {
    const fn new() -> Self {
        Self {
            position: PyOnceLock::new(),
            log_scale: PyOnceLock::new(),
            rotation: PyOnceLock::new(),
            opacity_logit: PyOnceLock::new(),
            dc: PyOnceLock::new(),
            sh: PyOnceLock::new(),
        }
    }
}

impl Gaussians {
    pub(crate) fn new(source: Source) -> Self {
        Self { source, made: Made::new() }
    }

    /// The values, which are computed now if they were not.
    pub(crate) fn values(&self) -> &GaussianFrame {
        match &self.source {
            Source::Given(frame) => frame,
            Source::Decoded(frame) => frame.gaussians(),
        }
    }

    /// The decoded frame, of Gaussians that come from a stream.
    pub(crate) fn decoded(&self) -> Option<&splatstream::Frame> {
        match &self.source {
            Source::Given(_) => None,
            Source::Decoded(frame) => Some(frame),
        }
    }

    /// The index of a Gaussian, as Python gives it.
    fn index(&self, index: &Bound<'_, PyAny>) -> PyResult<u32> {
        let count = self.count();
        match index.extract::<u32>() {
            Ok(index) if (index as usize) < count => Ok(index),
            Err(error) if !error.is_instance_of::<PyOverflowError>(index.py()) => Err(error),
            _ => {
                let last = count.checked_sub(1).map(|last| format!(", with indices from 0 to {last}"));
                let range = last.unwrap_or_default();
                Err(PyIndexError::new_err(format!("index {index}: there are {count} Gaussians{range}")))
            }
        }
    }

    fn count(&self) -> usize {
        match &self.source {
            Source::Given(frame) => frame.len(),
            Source::Decoded(frame) => frame.len(),
        }
    }

    /// The components of an attribute side by side; other threads of Python run meanwhile.
    fn rows(&self, py: Python<'_>, name: &str) -> Vec<f32> {
        py.detach(|| {
            let values = self.values();
            interleaved(attribute(values.planes(), name).into_iter(), values.len())
        })
    }

    fn matrix<'py>(&self, py: Python<'py>, name: &str, width: usize) -> PyResult<Bound<'py, PyArray2<f32>>> {
        owned(py, Dim([self.count(), width]), self.rows(py, name))
    }

    fn opacities<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f32>>> {
        owned(py, Dim([self.count()]), self.rows(py, "opacity_logit"))
    }

    fn harmonics<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f32>>> {
        let values = self.rows(py, "sh");
        owned(py, Dim([self.count(), self.values().sh().len() / 3, 3]), values)
    }

    /// A matrix that is made once.
    fn once<'py>(
        &self,
        py: Python<'py>,
        slot: &PyOnceLock<Py<PyArray2<f32>>>,
        name: &str,
        width: usize,
    ) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let make = || Ok::<_, PyErr>(shared(self.matrix(py, name, width)?).unbind());
        Ok(slot.get_or_try_init(py, make)?.bind(py).clone())
    }
}

#[pymethods]
impl Gaussians {
    #[new]
    #[pyo3(signature = (position, log_scale, rotation, opacity_logit, dc, sh=None, *, antialiased=false))]
    fn from_arrays(
        position: &Bound<'_, PyAny>,
        log_scale: &Bound<'_, PyAny>,
        rotation: &Bound<'_, PyAny>,
        opacity_logit: &Bound<'_, PyAny>,
        dc: &Bound<'_, PyAny>,
        sh: Option<&Bound<'_, PyAny>>,
        antialiased: bool,
    ) -> PyResult<Self> {
        let given = Attributes::new(position)?;
        let (degree, sh) = given.harmonics(sh)?;
        let [opacity_logit] = given.planes("opacity_logit", opacity_logit)?;
        let planes = Planes {
            position: given.planes("position", position)?,
            log_scale: given.planes("log_scale", log_scale)?,
            rotation: given.planes("rotation", rotation)?,
            opacity_logit,
            dc: given.planes("dc", dc)?,
            sh,
        };
        let frame = GaussianFrame::from_planes(degree, planes)
            .map_err(|error| pyo3::exceptions::PyValueError::new_err(error.to_string()))?;
        Ok(Self::new(Source::Given(frame.with_unit_rotations().with_antialiased(antialiased))))
    }

    /// Reads a scene file: .ply as trainers write it, .compressed.ply, .spz, .sog or .splat.
    ///
    /// Args:
    ///     path: The file; its content decides what it is.
    ///     max_memory: Bytes that reading may take; a file that asks for more is refused.
    ///
    /// Raises:
    ///     SceneError: A file that cannot be read; says where in it, and what to do.
    ///     OSError: There is no such file.
    ///
    /// Values that are not finite are kept: `encode` refuses them, or drops such Gaussians.
    #[staticmethod]
    #[pyo3(signature = (path, *, max_memory=4 << 30))]
    fn load(py: Python<'_>, path: PathBuf, max_memory: u64) -> PyResult<Self> {
        let read = py.detach(|| read_scene_as_is(&path, &ReadLimits { max_memory }));
        read.map(|scene| Self::new(Source::Given(scene.frame))).map_err(|error| scene_error(py, error))
    }

    /// Writes a .ply file as trainers write it: float32, which keeps every value as it is.
    fn save_ply(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let written = py.detach(|| std::fs::write(&path, ply::write(self.values())));
        written.map_err(|error| crate::errors::os_error(error, Some(&path)))
    }

    /// The Gaussians with some indices, in that order.
    ///
    /// Args:
    ///     indices: Integers from 0 to len(self) - 1; one may come more than once.
    ///
    /// Raises:
    ///     IndexError: An integer that is no such index.
    fn select(&self, py: Python<'_>, indices: &Bound<'_, PyAny>) -> PyResult<Self> {
        let indices = indices.try_iter()?.map(|index| self.index(&index?)).collect::<PyResult<Vec<u32>>>()?;
        Ok(Self::new(Source::Given(py.detach(|| self.values().select(&indices)))))
    }

    fn __len__(&self) -> usize {
        self.count()
    }

    fn __repr__(&self) -> String {
        format!("<Gaussians: {}, SH degree {}>", self.count(), self.values().sh_degree())
    }

    /// Centres, (N, 3): x right, y down, z forward, in the unit of the scene.
    #[getter]
    fn position<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        self.once(py, &self.made.position, "position", 3)
    }

    /// Natural logarithm of the semi-axes, (N, 3).
    #[getter]
    fn log_scale<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        self.once(py, &self.made.log_scale, "log_scale", 3)
    }

    /// Unit quaternions w, x, y, z, (N, 4).
    #[getter]
    fn rotation<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        self.once(py, &self.made.rotation, "rotation", 4)
    }

    /// Opacity before the sigmoid, (N,).
    #[getter]
    fn opacity_logit<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f32>>> {
        let make = || Ok::<_, PyErr>(shared(self.opacities(py)?).unbind());
        Ok(self.made.opacity_logit.get_or_try_init(py, make)?.bind(py).clone())
    }

    /// First coefficient of red, green and blue, (N, 3); colour = 0.5 + 0.2821 dc.
    #[getter]
    fn dc<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        self.once(py, &self.made.dc, "dc", 3)
    }

    /// The other coefficients of the spherical harmonics, (N, K, 3): K = 0, 3, 8 or 15.
    #[getter]
    fn sh<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f32>>> {
        let make = || Ok::<_, PyErr>(shared(self.harmonics(py)?).unbind());
        Ok(self.made.sh.get_or_try_init(py, make)?.bind(py).clone())
    }

    /// Degree of the spherical harmonics, 0 to 3.
    #[getter]
    fn sh_degree(&self, py: Python<'_>) -> u8 {
        py.detach(|| self.values().sh_degree())
    }

    /// Whether opacities were fitted for a renderer that makes up for its low-pass filter.
    #[getter]
    fn antialiased(&self, py: Python<'_>) -> bool {
        py.detach(|| self.values().antialiased())
    }

    /// The arrays by name, each a new copy that may be changed: `Gaussians(**frame.arrays())` are the same Gaussians.
    fn arrays<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        dictionary(
            py,
            [
                ("position", self.matrix(py, "position", 3)?.into_any()),
                ("log_scale", self.matrix(py, "log_scale", 3)?.into_any()),
                ("rotation", self.matrix(py, "rotation", 4)?.into_any()),
                ("opacity_logit", self.opacities(py)?.into_any()),
                ("dc", self.matrix(py, "dc", 3)?.into_any()),
                ("sh", self.harmonics(py)?.into_any()),
            ],
        )
    }

    /// The attributes by name, each a tuple of arrays of one component, (N,), read-only: the memory of the frame itself,
    /// without any copy. Plane 3 k + channel of `sh` is coefficient k.
    fn planes<'py>(this: &Bound<'py, Self>) -> PyResult<Bound<'py, PyDict>> {
        let py = this.py();
        let sh = py.detach({
            let gaussians = this.get();
            || gaussians.values().sh().len()
        });
        let scalars = planes_of(this, 1, |this, _| this.values().opacity_logit())?;
        dictionary(
            py,
            [
                ("position", planes_of(this, 3, |this, at| &this.values().position()[at])?.into_any()),
                ("log_scale", planes_of(this, 3, |this, at| &this.values().log_scale()[at])?.into_any()),
                ("rotation", planes_of(this, 4, |this, at| &this.values().rotation()[at])?.into_any()),
                ("opacity_logit", scalars.into_any()),
                ("dc", planes_of(this, 3, |this, at| &this.values().dc()[at])?.into_any()),
                ("sh", planes_of(this, sh, |this, at| &this.values().sh()[at])?.into_any()),
            ],
        )
    }
}

/// An array of values that stay in the memory of an owner, not to be written.
#[expect(unsafe_code, reason = "NumPy keeps a pointer to memory of Rust")]
pub(crate) fn borrowed<'py, T: Element>(
    owner: &Bound<'py, Gaussians>,
    values: impl FnOnce(&Gaussians) -> &[T],
) -> Bound<'py, PyArray1<T>> {
    let view = ArrayView1::from(values(owner.get()));
    // SAFETY: the values belong to the owner, which is frozen and gives out no reference to change them, so that they stay
    // where they are until it is dropped; the array keeps it alive.
    let array = unsafe { PyArray1::borrow_from_array(&view, owner.clone().into_any()) };
    shared(array)
}

/// An attribute as planes: as many arrays as it has components.
pub(crate) fn planes_of<'py, T: Element>(
    owner: &Bound<'py, Gaussians>,
    count: usize,
    plane: impl Fn(&Gaussians, usize) -> &[T],
) -> PyResult<Bound<'py, PyTuple>> {
    let arrays = (0..count).map(|component| borrowed(owner, |owner| plane(owner, component)));
    PyTuple::new(owner.py(), arrays.collect::<Vec<_>>())
}
