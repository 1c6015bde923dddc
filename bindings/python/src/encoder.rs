//! From frames to a stream.

use crate::errors::encode_error;
use crate::gaussians::Gaussians;
use crate::sink::{Sink, Written};
use crate::work::{self, Shared};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use splatstream::{Cancel, EncodeError, FrameSource, GaussianFrame, Report};
use splatstream_cli::{EncodeOptions, OptionsError, Prepared};
use std::io::Write;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Instant;

/// What the package makes a result of: the bytes, if they were not written elsewhere, and a report in JSON.
type Encoded<'py> = (Option<Bound<'py, PyBytes>>, String);

fn wrong_options(error: OptionsError) -> PyErr {
    PyValueError::new_err(error.to_string())
}

fn encoded<'py>(
    py: Python<'py>,
    written: Option<Written>,
    prepared: &Prepared,
    report: &Report,
    start: Instant,
) -> PyResult<Encoded<'py>> {
    prepared.remove_state().map_err(wrong_options)?;
    let bytes = written.map(|written| PyBytes::new(py, &written.take()));
    let report = prepared.report(report, start.elapsed().as_secs_f64());
    Ok((bytes, report.map_err(|error| PyRuntimeError::new_err(error.to_string()))?))
}

/// Tells Python how many frames are coded, each time that it is another number.
fn teller<'a>(
    progress: Option<&'a Py<PyAny>>,
    coded: &'a AtomicU32,
    all: Option<u32>,
) -> impl FnMut(Python<'_>) -> PyResult<()> + Send + 'a {
    let mut told = 0;
    move |py| {
        let now = coded.load(Ordering::Relaxed);
        if let Some(progress) = progress.filter(|_| now != told) {
            told = now;
            progress.call1(py, (now, all))?;
        }
        Ok(())
    }
}

/// Encodes frames as they come: each GOP is written once its frames are there, and one more.
#[pyclass(frozen, module = "splatstream_codec._native")]
pub(crate) struct Encoder {
    state: Shared<State>,
    start: Instant,
    written: Option<Written>,
    cancel: Cancel,
    coded: Arc<AtomicU32>,
    progress: Option<Py<PyAny>>,
}

enum State {
    /// Whether there is a second frame decides on the settings.
    Waiting {
        options: Box<EncodeOptions>,
        sink: Sink,
        first: Option<GaussianFrame>,
    },
    Encoding {
        encoder: Box<splatstream::Encoder<Sink>>,
        prepared: Box<Prepared>,
    },
    /// After the end, and after an error.
    Ended,
}

impl Encoder {
    /// An encoder that has the first frame, of so many if that is known.
    fn begin(
        &self,
        options: &EncodeOptions,
        sink: Sink,
        first: GaussianFrame,
        frames: Option<u32>,
    ) -> Result<(splatstream::Encoder<Sink>, Prepared), Failed> {
        let prepared = options.prepare(&first, frames)?;
        let mut encoder = splatstream::Encoder::new(sink, prepared.settings.clone());
        encoder.set_cancel(self.cancel.clone());
        let coded = self.coded.clone();
        encoder.set_progress(move |done| coded.store(done, Ordering::Relaxed));
        encoder.push(first)?;
        Ok((encoder, prepared))
    }

    /// Takes a frame, and gives what comes of the state.
    fn take(&self, state: State, frame: GaussianFrame) -> Result<State, Failed> {
        match state {
            State::Waiting { options, sink, first: None } => {
                Ok(State::Waiting { options, sink, first: Some(frame) })
            }
            State::Waiting { options, sink, first: Some(first) } => {
                let (mut encoder, prepared) = self.begin(&options, sink, first, None)?;
                encoder.push(frame)?;
                Ok(State::Encoding { encoder: Box::new(encoder), prepared: Box::new(prepared) })
            }
            State::Encoding { mut encoder, prepared } => {
                encoder.push(frame)?;
                Ok(State::Encoding { encoder, prepared })
            }
            State::Ended => Err(Failed::Ended),
        }
    }

    fn end(&self, state: State) -> Result<(Report, Prepared), Failed> {
        match state {
            State::Waiting { first: None, .. } => Err(EncodeError::NoFrames.into()),
            State::Waiting { options, sink, first: Some(first) } => {
                let (encoder, prepared) = self.begin(&options, sink, first, Some(1))?;
                Ok((encoder.finish()?, prepared))
            }
            State::Encoding { encoder, prepared } => Ok((encoder.finish()?, *prepared)),
            State::Ended => Err(Failed::Ended),
        }
    }
}

/// Why there is no stream.
enum Failed {
    Options(OptionsError),
    Encoding(EncodeError),
    Ended,
}

impl From<OptionsError> for Failed {
    fn from(error: OptionsError) -> Self {
        Self::Options(error)
    }
}

impl From<EncodeError> for Failed {
    fn from(error: EncodeError) -> Self {
        Self::Encoding(error)
    }
}

impl Failed {
    fn raised(self, py: Python<'_>) -> PyErr {
        match self {
            Self::Options(error) => wrong_options(error),
            Self::Encoding(error) => encode_error(py, error),
            Self::Ended => PyValueError::new_err("the stream has ended: make another Encoder"),
        }
    }
}

#[pymethods]
impl Encoder {
    #[new]
    fn new(
        out: Option<&Bound<'_, PyAny>>,
        options: Vec<String>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Self> {
        let options = Box::new(EncodeOptions::parse(options).map_err(wrong_options)?);
        let (sink, written) = Sink::of(out)?;
        Ok(Self {
            state: Shared::new("encoder", State::Waiting { options, sink, first: None }),
            start: Instant::now(),
            written,
            cancel: Cancel::new(),
            coded: Arc::default(),
            progress,
        })
    }

    /// Takes the next frame, and codes the GOP that it completes.
    fn push(&self, py: Python<'_>, frame: &Bound<'_, Gaussians>) -> PyResult<()> {
        let frame = frame.get();
        let mut state = self.state.lock(py)?;
        let before = std::mem::replace(&mut *state, State::Ended);
        let mut told = teller(self.progress.as_ref(), &self.coded, None);
        let after = work::run(py, &self.cancel, &mut told, || self.take(before, frame.values().clone()))?;
        *state = after.map_err(|failed| failed.raised(py))?;
        told(py)
    }

    /// Codes the rest, and ends the stream.
    fn finish<'py>(&self, py: Python<'py>) -> PyResult<Encoded<'py>> {
        let mut state = self.state.lock(py)?;
        let before = std::mem::replace(&mut *state, State::Ended);
        let mut told = teller(self.progress.as_ref(), &self.coded, None);
        let done = work::run(py, &self.cancel, &mut told, || self.end(before))?;
        let (report, prepared) = done.map_err(|failed| failed.raised(py))?;
        told(py)?;
        encoded(py, self.written.clone(), &prepared, &report, self.start)
    }
}

/// Frames that Python has, each asked for when it is needed.
struct PythonFrames {
    frame: Py<PyAny>,
    count: u32,
    cancel: Cancel,
    /// Of a single frame every pass needs no other.
    last: Option<(u32, GaussianFrame)>,
}

impl FrameSource for PythonFrames {
    fn len(&self) -> u32 {
        self.count
    }

    fn frame(&mut self, number: u32) -> Result<GaussianFrame, Box<dyn std::error::Error + Send + Sync>> {
        if self.cancel.is_requested() {
            return Err(EncodeError::Cancelled.into());
        }
        if let Some((last, frame)) = &self.last
            && *last == number
        {
            return Ok(frame.clone());
        }
        let frame = Python::attach(|py| {
            let frame = self.frame.call1(py, (number,))?;
            let gaussians = frame.bind(py).cast::<Gaussians>()?.clone().unbind();
            Ok::<_, PyErr>(py.detach(|| gaussians.get().values().clone()))
        })?;
        self.last = Some((number, frame.clone()));
        Ok(frame)
    }
}

/// Encodes frames that can be asked for more than once: all of them are looked at first.
///
/// `frame` gives the Gaussians with a number below `count`.
#[pyfunction]
#[pyo3(signature = (frame, count, out, options, progress))]
pub(crate) fn encode_sequence<'py>(
    py: Python<'py>,
    frame: Py<PyAny>,
    count: u32,
    out: Option<&Bound<'py, PyAny>>,
    options: Vec<String>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Encoded<'py>> {
    let options = EncodeOptions::parse(options).map_err(wrong_options)?;
    if count == 0 {
        return Err(encode_error(py, EncodeError::NoFrames));
    }
    let start = Instant::now();
    let (cancel, coded) = (Cancel::new(), AtomicU32::new(0));
    let mut frames = PythonFrames { frame, count, cancel: cancel.clone(), last: None };
    let (mut sink, written) = Sink::of(out)?;
    let mut told = teller(progress.as_ref(), &coded, Some(count));
    let done = work::run(py, &cancel, &mut told, || {
        let first = frames.frame(0).map_err(|source| EncodeError::Source { frame: 0, source })?;
        let prepared = options.prepare(&first, Some(count))?;
        let mut store = |done, _| coded.store(done, Ordering::Relaxed);
        let report = splatstream::encode(&mut frames, &prepared.settings, &mut sink, &mut store)?;
        sink.flush().map_err(EncodeError::Output)?;
        Ok::<_, Failed>((report, prepared))
    })?;
    let (report, prepared) = done.map_err(|failed| failed.raised(py))?;
    told(py)?;
    encoded(py, written, &prepared, &report, start)
}
