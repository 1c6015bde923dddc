//! What a decoder may take.

use pyo3::prelude::*;

/// What a decoder may take; a stream that asks for more is refused before anything is allocated. The defaults are safe for a
/// server that decodes what strangers send: a stream takes 2 GiB and some minutes of a core at most. For a stream of any length
/// raise the three totals, as in ``Limits(max_total_gaussians=2**64 - 1, max_output=2**64 - 1, max_work=2**64 - 1)``.
///
/// Args:
///     max_memory: Bytes that are held at the same time.
///     max_gaussians: Gaussians of a frame.
///     max_total_gaussians: Gaussians of all frames together.
///     max_unit: Bytes of a unit, of which a frame has one for each refinement and layer.
///     max_output: Bytes of all frames together as float32.
///     max_work: Values that are decoded, moved, hashed or predicted in all frames together.
#[pyclass(frozen, get_all, eq, module = "splatstream_codec")]
#[derive(PartialEq)]
pub(crate) struct Limits {
    max_memory: u64,
    max_gaussians: u32,
    max_total_gaussians: u64,
    max_unit: u32,
    max_output: u64,
    max_work: u64,
}

impl From<splatstream::Limits> for Limits {
    fn from(limits: splatstream::Limits) -> Self {
        let splatstream::Limits {
            max_memory,
            max_gaussians,
            max_total_gaussians,
            max_unit,
            max_output,
            max_work,
        } = limits;
        Self { max_memory, max_gaussians, max_total_gaussians, max_unit, max_output, max_work }
    }
}

impl From<&Limits> for splatstream::Limits {
    fn from(limits: &Limits) -> Self {
        let Limits { max_memory, max_gaussians, max_total_gaussians, max_unit, max_output, max_work } =
            *limits;
        Self { max_memory, max_gaussians, max_total_gaussians, max_unit, max_output, max_work }
    }
}

#[pymethods]
impl Limits {
    #[new]
    #[pyo3(signature = (*, max_memory=None, max_gaussians=None, max_total_gaussians=None, max_unit=None, max_output=None, max_work=None))]
    fn new(
        max_memory: Option<u64>,
        max_gaussians: Option<u32>,
        max_total_gaussians: Option<u64>,
        max_unit: Option<u32>,
        max_output: Option<u64>,
        max_work: Option<u64>,
    ) -> Self {
        let usual = splatstream::Limits::default();
        Self {
            max_memory: max_memory.unwrap_or(usual.max_memory),
            max_gaussians: max_gaussians.unwrap_or(usual.max_gaussians),
            max_total_gaussians: max_total_gaussians.unwrap_or(usual.max_total_gaussians),
            max_unit: max_unit.unwrap_or(usual.max_unit),
            max_output: max_output.unwrap_or(usual.max_output),
            max_work: max_work.unwrap_or(usual.max_work),
        }
    }

    /// What the highest level of the specification allows.
    #[staticmethod]
    fn unlimited() -> Self {
        splatstream::Limits::UNLIMITED.into()
    }
}
