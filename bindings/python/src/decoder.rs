//! From bytes to frames.

use crate::errors::{decode_error, os_error};
use crate::file_object::FileObject;
use crate::frame::Frame;
use crate::limits::Limits;
use crate::operating_point::{self, Point};
use crate::work::{self, Guard, Shared};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::pybacked::PyBackedBytes;
use pyo3::types::{PyBytes, PyDict, PyMemoryView};
use splatstream::scene::UpAxis;
use splatstream::{Cancel, OperatingPoint, Position};
use std::io::Cursor;
use std::path::PathBuf;
use std::time::Duration;

/// Decodes a stream, frame by frame: an iterator of frames.
///
/// Args:
///     source: A path, bytes, or a file object in binary mode that can seek; it is read as it is needed. Without it,
///         bytes are pushed.
///     op: The operating point, as "s0,t1,r2" or (0, 1, 2), where 255 is all that there is; everything by default.
///     limits: What the stream may take.
///     ahead: Decode two frames at a time where neither needs the other: more frames a second, the first one later.
///
/// Threads may share a decoder: a call waits until that of another thread is done. A file object cannot use the decoder that
/// reads from it: that is an Error (kind "in-use").
///
/// Example:
///     >>> for frame in gss.Decoder("talk.gss"):
///     ...     print(frame.index, frame.position.shape)
///
///     Bytes as they arrive:
///
///     >>> decoder = gss.Decoder()
///     >>> for chunk in chunks:
///     ...     decoder.push(chunk)
///     ...     for frame in decoder:
///     ...         show(frame)
///     >>> decoder.end()
///     >>> for frame in decoder:
///     ...     show(frame)
#[pyclass(frozen, module = "splatstream_codec")]
pub(crate) struct Decoder(Shared<State>);

struct State {
    decoder: splatstream::Decoder,
    cancel: Cancel,
    /// The last frame that was given out.
    last: Option<u32>,
    /// An operating point that was asked for, until it is known that the stream has it.
    unchecked: Option<OperatingPoint>,
    /// A frame that was decoded before that was known.
    held: Option<splatstream::Frame>,
}

impl State {
    /// Why the stream has no such operating point as was asked for; none while that is not known.
    fn refused(&mut self) -> Option<PyErr> {
        let (point, highest) = (self.unchecked?, self.decoder.highest_point()?);
        let refused = operating_point::refused(point, highest);
        self.unchecked = self.unchecked.filter(|_| refused.is_some());
        refused
    }

    /// The next frame, once the operating point that was asked for is one of the stream.
    fn next_frame(&mut self) -> splatstream::Result<PyResult<Option<splatstream::Frame>>> {
        if self.held.is_none() {
            self.held = match self.refused() {
                Some(refused) => return Ok(Err(refused)),
                None => self.decoder.next_frame()?,
            };
        }
        if let Some(refused) = self.refused() {
            return Ok(Err(refused));
        }
        let frame = self.held.take();
        self.last = frame.as_ref().map(splatstream::Frame::index).or(self.last);
        Ok(Ok(frame))
    }
}

/// A decoder of what Python names.
fn open(source: Option<&Bound<'_, PyAny>>) -> PyResult<splatstream::Decoder> {
    let Some(source) = source else { return Ok(splatstream::Decoder::new()) };
    if let Ok(bytes) = bytes_of(source) {
        return Ok(splatstream::Decoder::from_reader(Cursor::new(bytes)));
    }
    if source.hasattr("read")? {
        if !source.hasattr("seek")? {
            return Err(PyTypeError::new_err(
                "the file object has no seek(): push what it reads, or give it to decode()",
            ));
        }
        return Ok(splatstream::Decoder::from_reader(FileObject::new(source)));
    }
    let path: PathBuf = source.extract().map_err(|_| {
        let found = source.get_type().name().map(|name| name.to_string()).unwrap_or_default();
        PyTypeError::new_err(format!("source is {found}, not a path, bytes or a file object in binary mode"))
    })?;
    splatstream::Decoder::open(&path).map_err(|error| match error {
        splatstream::Error::Io(error) => os_error(error, Some(&path)),
        error => decode_error(source.py(), error, None),
    })
}

/// The bytes of an object that has some; those of `bytes` without a copy.
fn bytes_of(object: &Bound<'_, PyAny>) -> PyResult<PyBackedBytes> {
    if let Ok(bytes) = object.cast::<PyBytes>() {
        return Ok(bytes.clone().into());
    }
    let view = PyMemoryView::from(object)?;
    Ok(view.call_method0("tobytes")?.cast_into::<PyBytes>()?.into())
}

impl Decoder {
    fn state(&self, py: Python<'_>) -> PyResult<Guard<'_, State>> {
        self.0.lock(py)
    }

    /// Does something with the decoder that takes time.
    fn work<T: Send>(
        &self,
        py: Python<'_>,
        call: impl FnOnce(&mut State) -> splatstream::Result<T> + Send,
    ) -> PyResult<T> {
        let mut state = self.state(py)?;
        let state = &mut *state;
        let cancel = state.cancel.clone();
        let done = work::run(py, &cancel, &mut |_| Ok(()), || call(state));
        if cancel.is_requested() {
            // A seek starts again.
            state.cancel = Cancel::new();
            state.decoder.set_cancel(state.cancel.clone());
        }
        done?.map_err(|error| decode_error(py, error, state.last))
    }
}

#[pymethods]
impl Decoder {
    #[new]
    #[pyo3(signature = (source=None, *, op=None, limits=None, ahead=false))]
    fn new(
        source: Option<&Bound<'_, PyAny>>,
        op: Option<Point>,
        limits: Option<&Limits>,
        ahead: bool,
    ) -> PyResult<Self> {
        let mut decoder = open(source)?;
        if let Some(limits) = limits {
            decoder = decoder.with_limits(limits.into());
        }
        let unchecked = op.map(|Point(point)| point);
        if let Some(point) = unchecked {
            decoder = decoder.with_operating_point(point);
        }
        if ahead {
            decoder = decoder.ahead();
        }
        let cancel = Cancel::new();
        decoder.set_cancel(cancel.clone());
        Ok(Self(Shared::new("decoder", State { decoder, cancel, last: None, unchecked, held: None })))
    }

    /// Takes the next bytes of the stream, any number of them. Those that are no longer needed are dropped as frames are
    /// taken.
    ///
    /// Raises:
    ///     Error: The decoder reads by itself, was told the end (kind "not-pushed"), or must give out frames first
    ///         (kind "too-much-input").
    fn push(&self, py: Python<'_>, data: &Bound<'_, PyAny>) -> PyResult<()> {
        let bytes = bytes_of(data)?;
        let mut state = self.state(py)?;
        let State { decoder, last, .. } = &mut *state;
        py.detach(|| decoder.push(&bytes)).map_err(|error| decode_error(py, error, *last))
    }

    /// No more bytes will be pushed: a frame that lacks some is given out.
    fn end(&self, py: Python<'_>) -> PyResult<()> {
        self.state(py)?.decoder.end();
        Ok(())
    }

    /// The next frame. None if more bytes have to come, or after the last one: see `is_finished`.
    ///
    /// Raises:
    ///     ValueError: The stream has fewer layers or refinements than the operating point; says the highest. No frame is
    ///         lost: set a point that the stream has, and go on.
    ///     StreamError: The stream cannot be decoded at all, or not within the limits.
    ///     IncompleteError: Once, after the last frame: something was missing or damaged there. Damage otherwise costs
    ///         frames; their warnings tell.
    ///     KeyboardInterrupt: Ctrl-C ended it; a seek starts again.
    fn next_frame(&self, py: Python<'_>) -> PyResult<Option<Py<Frame>>> {
        let frame = self.work(py, State::next_frame)??;
        frame.map(|frame| Frame::new(py, frame)).transpose()
    }

    fn __iter__(this: PyRef<'_, Self>) -> PyRef<'_, Self> {
        this
    }

    fn __next__(&self, py: Python<'_>) -> PyResult<Option<Py<Frame>>> {
        self.next_frame(py)
    }

    /// Goes to a frame: the next one that is given out has its index, or a higher one where that is missing. This works
    /// after the end and after errors too.
    ///
    /// Args:
    ///     frame: Its index.
    ///     time: Instead of that, seconds: the frame that is shown then.
    #[pyo3(signature = (frame=None, *, time=None))]
    fn seek(&self, py: Python<'_>, frame: Option<u32>, time: Option<f64>) -> PyResult<()> {
        let to = match (frame, time) {
            (Some(frame), None) => Position::Frame(frame),
            (None, Some(time)) => Position::Time(
                Duration::try_from_secs_f64(time)
                    .map_err(|_| PyValueError::new_err(format!("time is {time}, not seconds from 0")))?,
            ),
            _ => return Err(PyTypeError::new_err("seek() takes a frame or a time")),
        };
        self.work(py, |state| {
            state.last = None;
            state.decoder.seek(to)?;
            state.held = None;
            Ok(())
        })
    }

    /// Changes the operating point: from the next GOP on, and where it is lower, from the next frame on.
    ///
    /// Raises:
    ///     ValueError: The stream has fewer layers or refinements; says the highest point. Nothing has changed. Before it is
    ///         known what the stream has, the next frame raises it.
    fn set_operating_point(&self, py: Python<'_>, op: Point) -> PyResult<()> {
        let mut state = self.state(py)?;
        if let Some(refused) =
            state.decoder.highest_point().and_then(|all| operating_point::refused(op.0, all))
        {
            return Err(refused);
        }
        state.unchecked = Some(op.0);
        state.decoder.set_operating_point(op.0);
        Ok(())
    }

    /// Whether no more frames will come, whatever is pushed.
    #[getter]
    fn is_finished(&self, py: Python<'_>) -> PyResult<bool> {
        let state = self.state(py)?;
        Ok(state.held.is_none() && state.decoder.is_finished())
    }

    /// Frames in the stream; None before that has come, and where the stream does not say it.
    #[getter]
    fn frame_count(&self, py: Python<'_>) -> PyResult<Option<u32>> {
        Ok(self.state(py)?.decoder.frame_count())
    }

    /// Seconds from a frame to the next at the full frame rate; None before that has come.
    #[getter]
    fn frame_duration(&self, py: Python<'_>) -> PyResult<Option<f64>> {
        Ok(self.state(py)?.decoder.frame_duration().map(|duration| duration.as_secs_f64()))
    }

    /// The operating point of everything that the stream has; None before that has come.
    #[getter]
    fn highest_point<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let point = self.state(py)?.decoder.highest_point();
        point.map(|point| operating_point::to_python(py, point)).transpose()
    }

    /// What the stream says of its scene, for viewers; None where it says nothing, or has not yet. A dictionary: `title`,
    /// `up` (the axis, as "-y"), `metres_per_unit`, `background` (red, green, blue), `bounds` (the lowest and the highest
    /// position), each None where it is not said, and `cameras`: position, rotation, vertical_field_of_view (radians).
    #[getter]
    fn description<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let state = self.state(py)?;
        let Some(description) = state.decoder.description() else { return Ok(None) };
        let all = PyDict::new(py);
        all.set_item("title", description.title.as_deref())?;
        let up = Some(description.up_axis).filter(|&axis| axis != UpAxis::Unknown);
        all.set_item("up", up.map(UpAxis::name))?;
        all.set_item("metres_per_unit", description.metres_per_unit)?;
        all.set_item("background", description.background)?;
        all.set_item("bounds", description.bounds)?;
        let cameras = description.cameras.iter().map(|camera| {
            let one = PyDict::new(py);
            one.set_item("position", camera.position)?;
            one.set_item("rotation", camera.rotation)?;
            one.set_item("vertical_field_of_view", camera.vertical_field_of_view)?;
            Ok(one)
        });
        all.set_item("cameras", cameras.collect::<PyResult<Vec<_>>>()?)?;
        Ok(Some(all))
    }
}
