//! From the pointers of C to references, and from panics and errors to a status.
#![expect(unsafe_code, reason = "pointers come from C")]

use crate::status::{Failure, SplatstreamStatus};
use core::ffi::{CStr, c_char};
use std::ffi::CString;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// What the last call with a handle came to.
#[derive(Debug, Default)]
pub(crate) struct Report {
    message: CString,
    /// A panic has left the handle in an unknown state.
    is_broken: bool,
}

/// A handle with a report.
pub(crate) trait Handle {
    fn report(&self) -> &Report;
    fn report_mut(&mut self) -> &mut Report;
}

/// Makes a handle; null if that panics.
pub(crate) fn new<T>(make: impl FnOnce() -> T) -> *mut T {
    catch_unwind(AssertUnwindSafe(|| Box::into_raw(Box::new(make())))).unwrap_or(core::ptr::null_mut())
}

/// Ends a handle.
///
/// # Safety
/// `handle` is null or comes from [`new`] and is not used again.
pub(crate) unsafe fn free<T>(handle: *mut T) {
    if !handle.is_null() {
        // SAFETY: it comes from `Box::into_raw` in `new`, and nothing else owns it.
        let owned = unsafe { Box::from_raw(handle) };
        // Nothing can be told of a panic here.
        let _ = catch_unwind(AssertUnwindSafe(|| drop(owned)));
    }
}

/// Runs a call, and keeps what was wrong in the handle.
///
/// # Safety
/// `handle` is null or comes from [`new`], and no other thread uses it.
pub(crate) unsafe fn run<H: Handle>(
    handle: *mut H,
    body: impl FnOnce(&mut H) -> Result<SplatstreamStatus, Failure>,
) -> SplatstreamStatus {
    // SAFETY: the caller says that it is null or live and not shared.
    let Some(handle) = (unsafe { handle.as_mut() }) else { return SplatstreamStatus::InvalidArgument };
    if handle.report().is_broken {
        return SplatstreamStatus::Internal;
    }
    let result = catch_unwind(AssertUnwindSafe(|| body(handle)));
    let is_broken = result.is_err();
    let internal = || Failure {
        status: SplatstreamStatus::Internal,
        message: "a defect of the library: the handle can only be freed".to_owned(),
    };
    let (status, message) = match result.unwrap_or_else(|_| Err(internal())) {
        Ok(status) => (status, CString::default()),
        Err(failure) => (failure.status, text(&failure.message)),
    };
    *handle.report_mut() = Report { message, is_broken };
    status
}

/// What was wrong with the last call, or an empty text.
///
/// # Safety
/// As for [`run`].
pub(crate) unsafe fn message<H: Handle>(handle: *const H) -> *const c_char {
    // SAFETY: the caller says that it is null or live and not shared.
    unsafe { handle.as_ref() }
        .map_or(c"there is no handle".as_ptr(), |handle| handle.report().message.as_ptr())
}

/// Text for C, which ends at the first zero.
pub(crate) fn text(text: &str) -> CString {
    CString::new(text.replace('\0', " ")).unwrap_or_default()
}

/// What a pointer that may be null points to.
///
/// # Safety
/// `pointer` is null or points to a value that is not written for as long as `'a` lasts.
pub(crate) unsafe fn get<'a, T>(pointer: *const T) -> Result<&'a T, Failure> {
    // SAFETY: the caller says so.
    unsafe { pointer.as_ref() }.ok_or_else(|| Failure::argument("a pointer is null"))
}

/// Writes a result, which has no destructor.
///
/// # Safety
/// `to` is null or points to memory for a value.
pub(crate) unsafe fn set<T: Copy>(to: *mut T, value: T) -> Result<(), Failure> {
    if to.is_null() {
        return Err(Failure::argument("a pointer is null"));
    }
    // SAFETY: the caller says that there is memory; nothing is there that had to be dropped.
    unsafe { to.write(value) };
    Ok(())
}

/// Bytes of C. There may be none, at a null pointer.
///
/// # Safety
/// `bytes` is null or points to `length` bytes that are not written for as long as `'a` lasts.
pub(crate) unsafe fn bytes<'a>(bytes: *const u8, length: usize) -> Result<&'a [u8], Failure> {
    match (bytes.is_null(), length) {
        (_, 0) => Ok(&[]),
        (true, _) => Err(Failure::argument("the bytes are a null pointer")),
        _ if isize::try_from(length).is_err() => Err(Failure::argument("there cannot be so many bytes")),
        // SAFETY: the caller says so, and the length fits.
        _ => Ok(unsafe { core::slice::from_raw_parts(bytes, length) }),
    }
}

/// A path of C: on Unix any bytes, elsewhere UTF-8.
///
/// # Safety
/// `path` is null or points to text that ends with a zero and is not written for as long as `'a` lasts.
pub(crate) unsafe fn path<'a>(path: *const c_char) -> Result<&'a std::path::Path, Failure> {
    if path.is_null() {
        return Err(Failure::argument("the path is a null pointer"));
    }
    // SAFETY: the caller says so.
    let path = unsafe { CStr::from_ptr(path) };
    #[cfg(unix)]
    let path = {
        use std::os::unix::ffi::OsStrExt;
        std::ffi::OsStr::from_bytes(path.to_bytes())
    };
    #[cfg(not(unix))]
    let path = path.to_str().map_err(|_| Failure::argument("the path is not UTF-8"))?;
    Ok(std::path::Path::new(path))
}

#[cfg(test)]
mod tests {
    use super::{Handle, Report, free, new, run};
    use crate::status::SplatstreamStatus;

    #[derive(Default)]
    struct Plain(Report);

    impl Handle for Plain {
        fn report(&self) -> &Report {
            &self.0
        }

        fn report_mut(&mut self) -> &mut Report {
            &mut self.0
        }
    }

    #[test]
    fn a_panic_stays_inside_and_ends_the_handle() {
        assert!(new::<Plain>(|| panic!("planted")).is_null());
        let handle = new(Plain::default);
        // SAFETY: the handle is live and used here only.
        unsafe {
            assert_eq!(run(handle, |_| panic!("planted")), SplatstreamStatus::Internal);
            assert!(!(*handle).report().message.is_empty());
            assert_eq!(run(handle, |_| Ok(SplatstreamStatus::Ok)), SplatstreamStatus::Internal);
            free(handle);
        }
    }
}
