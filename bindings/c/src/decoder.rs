//! From bytes to frames.
#![expect(unsafe_code, reason = "pointers come from C")]
#![expect(clippy::missing_safety_doc, reason = "one contract for all functions: the top of the header")]

use crate::call::{self, Handle, Report};
use crate::cancel::SplatstreamCancel;
use crate::planes::SplatstreamPlanes;
use crate::settings::{SplatstreamLimits, SplatstreamOperatingPoint};
use crate::status::{Failure, SplatstreamStatus};
use core::ffi::c_char;
use splatstream::{Cancel, Decoder, Error, Frame, Limits, OperatingPoint, Position, Warning};
use std::ffi::CString;
use std::io::Cursor;
use std::time::Duration;

/// Decodes a stream.
pub struct SplatstreamDecoder {
    decoder: Decoder,
    limits: Limits,
    point: OperatingPoint,
    cancel: Cancel,
    /// Whether bytes or frames have been taken.
    has_begun: bool,
    frame: Option<Frame>,
    /// Pointers to planes of the frame.
    sh: Vec<*const f32>,
    warnings: Vec<CString>,
    report: Report,
}

impl Handle for SplatstreamDecoder {
    fn report(&self) -> &Report {
        &self.report
    }

    fn report_mut(&mut self) -> &mut Report {
        &mut self.report
    }
}

/// A frame.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct SplatstreamFrame {
    /// When it is shown, from the start of the stream.
    pub nanoseconds: u64,
    /// How many Gaussians it has.
    pub gaussians: usize,
    /// How many of these, the last ones, are those of an earlier frame, moved: they stand in for refinements that are not
    /// there.
    pub carried: usize,
    /// How many warnings there are: see splatstream_decoder_warning.
    pub warnings: usize,
    /// Its number in the order in which frames are shown, from 0.
    pub index: u32,
    /// The operating point that it was decoded at.
    pub point: SplatstreamOperatingPoint,
    /// How many refinements it shows exactly. Fewer than the operating point asks for if some are missing.
    pub refinements: u8,
    /// Whether it refers to no other frame.
    pub is_keyframe: bool,
}

impl SplatstreamDecoder {
    fn new() -> Self {
        Self {
            decoder: Decoder::new(),
            limits: Limits::default(),
            point: OperatingPoint::ALL,
            cancel: Cancel::default(),
            has_begun: false,
            frame: None,
            sh: Vec::new(),
            warnings: Vec::new(),
            report: Report::default(),
        }
    }

    /// Reads from another place, with the settings as they are.
    fn open(&mut self, decoder: Decoder) {
        self.decoder = decoder.with_limits(self.limits).with_operating_point(self.point);
        self.decoder.set_cancel(self.cancel.clone());
        self.has_begun = false;
        self.forget();
    }

    /// The last frame is no longer there.
    fn forget(&mut self) {
        self.frame = None;
        self.sh.clear();
        self.warnings.clear();
    }

    fn keep_warnings(&mut self, warnings: &[Warning]) {
        self.warnings = warnings.iter().map(|warning| call::text(&warning.to_string())).collect();
    }

    /// The next frame, which stays here.
    fn next(&mut self) -> Result<Option<SplatstreamFrame>, Failure> {
        self.has_begun = true;
        self.forget();
        let frame = match self.decoder.next_frame() {
            Ok(None) => return Ok(None),
            Ok(Some(frame)) => frame,
            Err(error) => {
                if let Error::Incomplete(warnings) = &error {
                    self.keep_warnings(warnings);
                }
                return Err(error.into());
            }
        };
        self.keep_warnings(frame.warnings());
        let shown = SplatstreamFrame {
            // 584 years.
            nanoseconds: u64::try_from(frame.time().as_nanos()).unwrap_or(u64::MAX),
            gaussians: frame.len(),
            carried: frame.carried(),
            warnings: self.warnings.len(),
            index: frame.index(),
            point: frame.operating_point().into(),
            refinements: frame.refinements(),
            is_keyframe: frame.is_keyframe(),
        };
        self.frame = Some(frame);
        Ok(Some(shown))
    }

    /// The frame that is there.
    pub(crate) fn frame(&self) -> Result<&Frame, Failure> {
        self.frame
            .as_ref()
            .ok_or_else(|| Failure::argument("there is no frame: see splatstream_decoder_next_frame"))
    }

    fn seek(&mut self, to: Position) -> Result<SplatstreamStatus, Failure> {
        self.has_begun = true;
        self.forget();
        self.decoder.seek(to)?;
        Ok(SplatstreamStatus::Ok)
    }
}

/// A decoder that bytes are pushed to, unless it opens something. Null if there is no memory.
#[unsafe(no_mangle)]
pub extern "C" fn splatstream_decoder_new() -> *mut SplatstreamDecoder {
    call::new(SplatstreamDecoder::new)
}

/// Frees a decoder, or does nothing if it is null. Slots may be used further.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn splatstream_decoder_free(decoder: *mut SplatstreamDecoder) {
    // SAFETY: the contract of the header.
    unsafe { call::free(decoder) }
}

/// What was wrong with the last call that returned a status, as text in English, or an empty text. It lasts until the
/// next call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn splatstream_decoder_message(decoder: *const SplatstreamDecoder) -> *const c_char {
    // SAFETY: the contract of the header.
    unsafe { call::message(decoder) }
}

/// Decodes a file, which is read as it is needed. `path` ends with a zero; its encoding is UTF-8, on Unix that of the
/// file system. Limits, operating point and cancellation stay as they have been set, whatever was decoded before.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn splatstream_decoder_open(
    decoder: *mut SplatstreamDecoder,
    path: *const c_char,
) -> SplatstreamStatus {
    // SAFETY: the contract of the header; the path is not kept.
    unsafe {
        call::run(decoder, |decoder| {
            decoder.open(Decoder::open(call::path(path)?)?);
            Ok(SplatstreamStatus::Ok)
        })
    }
}

/// Decodes a stream in memory, of which the decoder keeps a copy. Otherwise as splatstream_decoder_open.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn splatstream_decoder_open_bytes(
    decoder: *mut SplatstreamDecoder,
    bytes: *const u8,
    length: usize,
) -> SplatstreamStatus {
    // SAFETY: the contract of the header; the bytes are copied.
    unsafe {
        call::run(decoder, |decoder| {
            let bytes = call::bytes(bytes, length)?;
            let mut copy = Vec::new();
            if copy.try_reserve_exact(length).is_err() {
                return Err(Error::Io(std::io::ErrorKind::OutOfMemory.into()).into());
            }
            copy.extend_from_slice(bytes);
            decoder.open(Decoder::from_reader(Cursor::new(copy)));
            Ok(SplatstreamStatus::Ok)
        })
    }
}

/// Sets limits. To be called before bytes or frames are taken.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn splatstream_decoder_set_limits(
    decoder: *mut SplatstreamDecoder,
    limits: *const SplatstreamLimits,
) -> SplatstreamStatus {
    // SAFETY: the contract of the header.
    unsafe {
        call::run(decoder, |decoder| {
            let limits = Limits::from(*call::get(limits)?);
            if decoder.has_begun {
                return Err(Failure::argument("limits have to be set before decoding begins"));
            }
            decoder.limits = limits;
            let opened = core::mem::take(&mut decoder.decoder);
            decoder.open(opened);
            Ok(SplatstreamStatus::Ok)
        })
    }
}

/// Sets the operating point, which is everything at first: from the next GOP (group of pictures) on, and where it is lower
/// on some axis, from the next frame on.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn splatstream_decoder_set_operating_point(
    decoder: *mut SplatstreamDecoder,
    point: SplatstreamOperatingPoint,
) -> SplatstreamStatus {
    // SAFETY: the contract of the header.
    unsafe {
        call::run(decoder, |decoder| {
            decoder.point = point.into();
            decoder.decoder.set_operating_point(decoder.point);
            Ok(SplatstreamStatus::Ok)
        })
    }
}

/// Lets another thread end the work of this decoder. Null takes that back, after a cancellation too: then seek.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn splatstream_decoder_set_cancel(
    decoder: *mut SplatstreamDecoder,
    cancel: *const SplatstreamCancel,
) -> SplatstreamStatus {
    // SAFETY: the contract of the header; the decoder shares what the handle holds, not the handle.
    unsafe {
        call::run(decoder, |decoder| {
            decoder.cancel = cancel.as_ref().map(|cancel| cancel.0.clone()).unwrap_or_default();
            decoder.decoder.set_cancel(decoder.cancel.clone());
            Ok(SplatstreamStatus::Ok)
        })
    }
}

/// Takes the next bytes of the stream, which are copied. After the last frame they are ignored.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn splatstream_decoder_push(
    decoder: *mut SplatstreamDecoder,
    bytes: *const u8,
    length: usize,
) -> SplatstreamStatus {
    // SAFETY: the contract of the header; the bytes are copied.
    unsafe {
        call::run(decoder, |decoder| {
            let bytes = call::bytes(bytes, length)?;
            decoder.has_begun = true;
            decoder.decoder.push(bytes)?;
            Ok(SplatstreamStatus::Ok)
        })
    }
}

/// No more bytes will be pushed: a frame that lacks some is given.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn splatstream_decoder_end(decoder: *mut SplatstreamDecoder) -> SplatstreamStatus {
    // SAFETY: the contract of the header.
    unsafe {
        call::run(decoder, |decoder| {
            decoder.decoder.end();
            Ok(SplatstreamStatus::Ok)
        })
    }
}

/// Decodes the next frame. SPLATSTREAM_STATUS_OK: it is described in `frame`, unless that is null, and stays in the decoder
/// until the next call of this function, of one that seeks or opens, or of splatstream_decoder_set_limits. After
/// SPLATSTREAM_STATUS_NEED_BYTES push more; after SPLATSTREAM_STATUS_END and all errors nothing comes any more.
/// SPLATSTREAM_STATUS_INCOMPLETE stands in for SPLATSTREAM_STATUS_END where something was lost after the last frame.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn splatstream_decoder_next_frame(
    decoder: *mut SplatstreamDecoder,
    frame: *mut SplatstreamFrame,
) -> SplatstreamStatus {
    // SAFETY: the contract of the header.
    unsafe {
        call::run(decoder, |decoder| match decoder.next()? {
            Some(shown) => {
                if !frame.is_null() {
                    call::set(frame, shown)?;
                }
                Ok(SplatstreamStatus::Ok)
            }
            None if decoder.decoder.is_finished() => Ok(SplatstreamStatus::End),
            None => Ok(SplatstreamStatus::NeedBytes),
        })
    }
}

/// The Gaussians of the frame, most important first within each refinement. They last as long as the frame.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn splatstream_decoder_planes(
    decoder: *mut SplatstreamDecoder,
    planes: *mut SplatstreamPlanes,
) -> SplatstreamStatus {
    // SAFETY: the contract of the header.
    unsafe {
        call::run(decoder, |decoder| {
            let mut sh = core::mem::take(&mut decoder.sh);
            let shown = SplatstreamPlanes::of(decoder.frame()?.gaussians().planes(), &mut sh);
            decoder.sh = sh;
            call::set(planes, shown)?;
            Ok(SplatstreamStatus::Ok)
        })
    }
}

/// The identity of each Gaussian of the frame: the same in two frames for the same Gaussian. Null if there is no frame. They
/// last as long as the frame.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn splatstream_decoder_identities(decoder: *const SplatstreamDecoder) -> *const u32 {
    // SAFETY: the contract of the header.
    let frame = unsafe { decoder.as_ref() }.and_then(|decoder| decoder.frame.as_ref());
    frame.map_or(core::ptr::null(), |frame| frame.identities().as_ptr())
}

/// What was lost between the frame before and this one, or after the last one, as text in English: the warning with this
/// number, from 0. Null if there are not so many. It lasts as long as the frame.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn splatstream_decoder_warning(
    decoder: *const SplatstreamDecoder,
    number: usize,
) -> *const c_char {
    // SAFETY: the contract of the header.
    let warning = unsafe { decoder.as_ref() }.and_then(|decoder| decoder.warnings.get(number));
    warning.map_or(core::ptr::null(), |warning| warning.as_ptr())
}

/// Frames in the stream, if this is known: after the first frame, of streams that say it. Otherwise 0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn splatstream_decoder_frame_count(decoder: *const SplatstreamDecoder) -> u32 {
    // SAFETY: the contract of the header.
    unsafe { decoder.as_ref() }.and_then(|decoder| decoder.decoder.frame_count()).unwrap_or(0)
}

/// Goes to a frame: the next one has this index, or a higher one where that is missing. Not for bytes that are pushed. This
/// works after the end and after errors too.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn splatstream_decoder_seek_frame(
    decoder: *mut SplatstreamDecoder,
    index: u32,
) -> SplatstreamStatus {
    // SAFETY: the contract of the header.
    unsafe { call::run(decoder, |decoder| decoder.seek(Position::Frame(index))) }
}

/// Goes to the frame that is shown at a time from the start of the stream. Otherwise as splatstream_decoder_seek_frame.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn splatstream_decoder_seek_time(
    decoder: *mut SplatstreamDecoder,
    nanoseconds: u64,
) -> SplatstreamStatus {
    // SAFETY: the contract of the header.
    unsafe { call::run(decoder, |decoder| decoder.seek(Position::Time(Duration::from_nanos(nanoseconds)))) }
}
