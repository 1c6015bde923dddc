//! Ending the work of a decoder from another thread.
#![expect(unsafe_code, reason = "pointers come from C")]
#![expect(clippy::missing_safety_doc, reason = "one contract for all functions: the top of the header")]

use crate::call;
use splatstream::Cancel;

/// Ends the work of decoders, also within a frame. Threads may share it.
#[derive(Debug)]
pub struct SplatstreamCancel(pub(crate) Cancel);

/// For splatstream_decoder_set_cancel.
#[unsafe(no_mangle)]
pub extern "C" fn splatstream_cancel_new() -> *mut SplatstreamCancel {
    call::new(|| SplatstreamCancel(Cancel::new()))
}

/// Ends the work of all decoders that have been given this, for good: they return SPLATSTREAM_STATUS_CANCELLED.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn splatstream_cancel_request(cancel: *const SplatstreamCancel) {
    // SAFETY: the contract of the header.
    if let Ok(cancel) = unsafe { call::get(cancel) } {
        cancel.0.request();
    }
}

/// Frees it, or does nothing if it is null. Decoders that have been given it go on.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn splatstream_cancel_free(cancel: *mut SplatstreamCancel) {
    // SAFETY: the contract of the header.
    unsafe { call::free(cancel) }
}
