//! Exceptions with fields, which `splatstream_codec._errors` defines.

use pyo3::exceptions::PyOSError;
use pyo3::prelude::*;
use pyo3::types::{IntoPyDict, PyDict, PyRange};
use splatstream::{EncodeError, Error, StreamError, Warning};
use splatstream_files::{SceneError, SceneErrorKind};
use std::io;
use std::path::Path;

/// An exception of the package; `fields` are the keyword arguments of its class.
fn exception(py: Python<'_>, class: &str, message: String, fields: PyResult<Bound<'_, PyDict>>) -> PyErr {
    let make = || {
        let class = py.import("splatstream_codec._errors")?.getattr(class)?;
        class.call((message,), Some(&fields?))
    };
    make().map_or_else(|error| error, PyErr::from_value)
}

/// An error of the operating system, which Python makes a FileNotFoundError or the like of.
pub(crate) fn os_error(error: io::Error, path: Option<&Path>) -> PyErr {
    match (error.raw_os_error(), path) {
        (Some(code), Some(path)) => {
            let text = error.to_string();
            let text = text.split(" (os error").next().unwrap_or_default().to_owned();
            PyOSError::new_err((code, text, path.as_os_str().to_owned()))
        }
        // Errors of file objects are the exceptions that these have raised.
        _ => error.into(),
    }
}

/// The fields of an error of a stream. `frame` is the last frame that was given out before it.
fn stream_fields<'py>(
    py: Python<'py>,
    error: &StreamError,
    frame: Option<u32>,
) -> PyResult<Bound<'py, PyDict>> {
    let fields = [("kind", error.class().name()), ("code", error.kind.code()), ("clause", error.clause)];
    let fields = fields.into_py_dict(py)?;
    fields.set_item("offset", error.at)?;
    fields.set_item("frame", frame)?;
    Ok(fields)
}

/// What was lost, as Python has it.
pub(crate) fn damage<'py>(py: Python<'py>, warning: &Warning) -> PyResult<Bound<'py, PyAny>> {
    let class = py.import("splatstream_codec._types")?.getattr("Damage")?;
    let fields = match warning {
        Warning::Damaged(error) => stream_fields(py, error, None)?,
        _ => [("kind", "lost")].into_py_dict(py)?,
    };
    let frames = match warning {
        Warning::Lost(frames) => {
            Some(PyRange::new(py, *frames.start() as isize, *frames.end() as isize + 1)?)
        }
        _ => None,
    };
    if fields.contains("frame")? {
        fields.del_item("frame")?;
    }
    fields.set_item("frames", frames)?;
    class.call((warning.to_string(),), Some(&fields))
}

/// The exception for an error of a decoder.
pub(crate) fn decode_error(py: Python<'_>, error: Error, frame: Option<u32>) -> PyErr {
    let message = error.to_string();
    match error {
        Error::Stream(error) => exception(py, "StreamError", message, stream_fields(py, &error, frame)),
        Error::Incomplete(warnings) => {
            let fields = || {
                let first = warnings.iter().find_map(|warning| match warning {
                    Warning::Damaged(error) => Some(error),
                    _ => None,
                });
                let fields = match first {
                    Some(error) => stream_fields(py, error, frame)?,
                    None => {
                        let fields = [("kind", "lost")].into_py_dict(py)?;
                        fields.set_item("frame", frame)?;
                        fields
                    }
                };
                let damage: Vec<_> = warnings.iter().map(|one| damage(py, one)).collect::<PyResult<_>>()?;
                fields.set_item("damage", damage)?;
                Ok(fields)
            };
            exception(py, "IncompleteError", message, fields())
        }
        Error::Io(error) => os_error(error, None),
        _ => call_error(py, message, decoder_kind(&error)),
    }
}

/// The exception for a call that cannot be answered, whatever the stream is.
pub(crate) fn call_error(py: Python<'_>, message: String, kind: &str) -> PyErr {
    exception(py, "Error", message, [("kind", kind)].into_py_dict(py))
}

/// What is wrong with a call, of errors that are not those of a stream.
fn decoder_kind(error: &Error) -> &'static str {
    match error {
        Error::Cancelled => "cancelled",
        Error::TooMuchInput { .. } => "too-much-input",
        Error::NotPushed => "not-pushed",
        Error::NotSeekable => "not-seekable",
        Error::TooFewSlots { .. } => "too-few-slots",
        _ => "defect",
    }
}

/// The exception for an error of the encoder. What a frame raised is raised as it is.
pub(crate) fn encode_error(py: Python<'_>, error: EncodeError) -> PyErr {
    let message = error.to_string();
    let kind = match &error {
        EncodeError::NoFrames => "no-frames",
        EncodeError::Refinements(_) | EncodeError::Setting { .. } => "setting",
        EncodeError::TooManyGaussians { .. } | EncodeError::TooManyPerSecond { .. } => "too-many-gaussians",
        EncodeError::Invalid { .. } => "invalid-value",
        EncodeError::OutOfGrid { .. } => "out-of-grid",
        EncodeError::NotAnnounced { .. } | EncodeError::NoExtent { .. } => "not-announced",
        EncodeError::Antialiasing { .. } => "antialiasing",
        EncodeError::Cancelled => "cancelled",
        _ => "defect",
    };
    let (frame, gaussian, property) = place(&error);
    match error {
        EncodeError::Source { source, .. } => match source.downcast::<PyErr>() {
            Ok(raised) => *raised,
            Err(_) => exception(py, "EncodeError", message, encode_fields(py, "source", frame, None, None)),
        },
        EncodeError::Output(error) => os_error(error, None),
        _ => exception(py, "EncodeError", message, encode_fields(py, kind, frame, gaussian, property)),
    }
}

/// The frame, Gaussian and property that an error is about.
fn place(error: &EncodeError) -> (Option<u32>, Option<usize>, Option<String>) {
    match error {
        EncodeError::TooManyGaussians { frame, .. }
        | EncodeError::TooManyPerSecond { frame, .. }
        | EncodeError::Antialiasing { frame, .. }
        | EncodeError::Source { frame, .. } => (Some(*frame), None, None),
        EncodeError::Invalid { frame, first, .. } => {
            (Some(*frame), Some(first.row), Some(first.property.clone()))
        }
        EncodeError::OutOfGrid { frame, attribute, farthest_row, .. } => {
            (Some(*frame), Some(*farthest_row), Some((*attribute).to_owned()))
        }
        EncodeError::NotAnnounced { frame, property, .. } => {
            (Some(*frame), None, Some((*property).to_owned()))
        }
        EncodeError::Setting { name, .. } => (None, None, Some((*name).to_owned())),
        _ => (None, None, None),
    }
}

fn encode_fields<'py>(
    py: Python<'py>,
    kind: &str,
    frame: Option<u32>,
    gaussian: Option<usize>,
    property: Option<String>,
) -> PyResult<Bound<'py, PyDict>> {
    let fields = [("kind", kind)].into_py_dict(py)?;
    fields.set_item("frame", frame)?;
    fields.set_item("gaussian", gaussian)?;
    fields.set_item("property", property)?;
    Ok(fields)
}

/// The exception for a scene file that cannot be read.
pub(crate) fn scene_error(py: Python<'_>, error: SceneError) -> PyErr {
    let message = error.to_string();
    let (kind, offset) = match error.kind {
        SceneErrorKind::Io(cause) => return os_error(cause, error.path.as_deref()),
        SceneErrorKind::Empty => ("truncated", Some(0)),
        SceneErrorKind::Truncated { at, .. } => ("truncated", Some(at)),
        SceneErrorKind::Malformed { at, .. } => ("malformed", Some(at)),
        SceneErrorKind::Unsupported { .. } => ("unsupported", None),
        SceneErrorKind::OverLimit { .. } | SceneErrorKind::OutOfMemory { .. } => ("over-limit", None),
        _ => ("malformed", None),
    };
    let fields = || {
        let fields = [("kind", kind)].into_py_dict(py)?;
        fields.set_item("path", error.path)?;
        fields.set_item("offset", offset)?;
        Ok(fields)
    };
    exception(py, "SceneError", message, fields())
}
