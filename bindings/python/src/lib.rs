//! The Python package of SplatStream: what `splatstream_codec` cannot say in Python itself.
//!
//! `decoder`, `frame` and `slots` are those of the crate `splatstream`; `encoder` takes its options in the words of the
//! command line, which is in this module too (`main`). Arrays go in and out by `arrays`, files of Python by `file_object`,
//! exceptions by `errors`; `work` lets other threads of Python run meanwhile, and Ctrl-C end it.

mod arrays;
mod decoder;
mod encoder;
mod errors;
mod file_object;
mod frame;
mod gaussians;
mod limits;
mod operating_point;
mod sink;
mod slots;
mod work;

use pyo3::prelude::*;
use std::ffi::OsString;

/// What the Python modules of the package use and re-export.
#[pymodule]
mod _native {
    #[pymodule_export]
    use crate::decoder::Decoder;
    #[pymodule_export]
    use crate::encoder::{Encoder, encode_sequence};
    #[pymodule_export]
    use crate::frame::Frame;
    #[pymodule_export]
    use crate::gaussians::Gaussians;
    #[pymodule_export]
    use crate::limits::Limits;
    #[pymodule_export]
    use crate::main;
    #[pymodule_export]
    use crate::slots::{Slots, Update};

    #[pymodule_export]
    const VERSION: &str = env!("CARGO_PKG_VERSION");
}

/// Runs the `splatstream` command with its arguments, the first of which is its name, and gives its exit code.
#[pyfunction]
fn main(py: Python<'_>, arguments: Vec<OsString>) -> u8 {
    py.detach(|| splatstream_cli::main(&arguments))
}
