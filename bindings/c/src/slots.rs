//! Frames for renderers: every Gaussian keeps its place.
#![expect(unsafe_code, reason = "pointers come from C")]
#![expect(clippy::missing_safety_doc, reason = "one contract for all functions: the top of the header")]

use crate::call::{self, Handle, Report};
use crate::decoder::SplatstreamDecoder;
use crate::planes::SplatstreamPlanes;
use crate::status::SplatstreamStatus;
use core::ffi::c_char;
use splatstream::{Limits, Slots};

/// Planes of a fixed number of slots. A Gaussian has the same slot in every frame from the one that it appears in to the one
/// that it disappears in; a slot without a Gaussian has opacity 0 (its logit is minus infinity) and is 0 otherwise.
pub struct SplatstreamSlots {
    slots: Slots,
    dirty: Vec<SplatstreamRange>,
    /// Pointers to planes of the slots.
    sh: Vec<*const f32>,
    report: Report,
}

impl Handle for SplatstreamSlots {
    fn report(&self) -> &Report {
        &self.report
    }

    fn report_mut(&mut self) -> &mut Report {
        &mut self.report
    }
}

/// A run of slots.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct SplatstreamRange {
    /// The first.
    pub begin: usize,
    /// The one after the last.
    pub end: usize,
}

/// What a frame has changed.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct SplatstreamUpdate {
    /// Runs of slots of which some plane has another value than before, increasing: what a renderer copies. They last until
    /// the next update.
    pub dirty: *const SplatstreamRange,
    /// How many runs there are.
    pub dirty_count: usize,
    /// Gaussians that keep their slot.
    pub kept: usize,
    /// Gaussians that have appeared.
    pub appeared: usize,
    /// Gaussians that have disappeared.
    pub disappeared: usize,
    /// The degree of the spherical harmonics has changed: there are more or fewer planes.
    pub has_new_planes: bool,
}

/// Slots for frames of at most so many Gaussians. Null if no stream can have so many, or there is no memory.
#[unsafe(no_mangle)]
pub extern "C" fn splatstream_slots_new(capacity: usize) -> *mut SplatstreamSlots {
    if capacity > Limits::UNLIMITED.max_gaussians as usize {
        return core::ptr::null_mut();
    }
    call::new(|| SplatstreamSlots {
        slots: Slots::new(capacity),
        dirty: Vec::new(),
        sh: Vec::new(),
        report: Report::default(),
    })
}

/// Frees slots, or does nothing if they are null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn splatstream_slots_free(slots: *mut SplatstreamSlots) {
    // SAFETY: the contract of the header.
    unsafe { call::free(slots) }
}

/// What was wrong with the last call that returned a status, as text in English, or an empty text. It lasts until the
/// next call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn splatstream_slots_message(slots: *const SplatstreamSlots) -> *const c_char {
    // SAFETY: the contract of the header.
    unsafe { call::message(slots) }
}

/// Shows the frame of a decoder in the slots.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn splatstream_slots_update(
    slots: *mut SplatstreamSlots,
    decoder: *const SplatstreamDecoder,
    update: *mut SplatstreamUpdate,
) -> SplatstreamStatus {
    // SAFETY: the contract of the header.
    unsafe {
        call::run(slots, |slots| {
            let changed = slots.slots.update(call::get(decoder)?.frame()?)?;
            let runs = changed.dirty.iter();
            slots.dirty = runs.map(|run| SplatstreamRange { begin: run.start, end: run.end }).collect();
            let shown = SplatstreamUpdate {
                dirty: slots.dirty.as_ptr(),
                dirty_count: slots.dirty.len(),
                kept: changed.kept,
                appeared: changed.appeared,
                disappeared: changed.disappeared,
                has_new_planes: changed.has_new_planes,
            };
            call::set(update, shown)?;
            Ok(SplatstreamStatus::Ok)
        })
    }
}

/// The planes, whose length is the capacity. They last until the next update.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn splatstream_slots_planes(
    slots: *mut SplatstreamSlots,
    planes: *mut SplatstreamPlanes,
) -> SplatstreamStatus {
    // SAFETY: the contract of the header.
    unsafe {
        call::run(slots, |slots| {
            call::set(planes, SplatstreamPlanes::of(slots.slots.planes().into(), &mut slots.sh))?;
            Ok(SplatstreamStatus::Ok)
        })
    }
}

/// The slot of the Gaussian with an identity; SIZE_MAX if it is not in the last frame.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn splatstream_slots_find(slots: *const SplatstreamSlots, identity: u32) -> usize {
    // SAFETY: the contract of the header.
    unsafe { slots.as_ref() }.and_then(|slots| slots.slots.slot(identity)).unwrap_or(usize::MAX)
}
