//! A heap that ends: a request that was sized by a count in the input is refused, and so is what many small
//! ones add up to. libFuzzer's own limits need a sanitizer's heap, which stable toolchains lack, or look at pages
//! in use, which zeroed ones are not. It also measures what a thread has in use: see [`peak_of`].
#![expect(unsafe_code, reason = "GlobalAlloc is an unsafe trait; each request goes to the system as it came")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::ptr::null_mut;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

/// Most bytes of one request.
pub const MAX_REQUEST: usize = 64 << 20;
/// Most bytes of all requests together.
pub const MAX_IN_USE: usize = 2 * MAX_REQUEST;

/// What the requests of a thread add up to, less what it has released; memory of one thread may be released by another.
#[derive(Clone, Copy)]
struct Held {
    now: isize,
    peak: isize,
}

thread_local! {
    static HELD: Cell<Held> = const { Cell::new(Held { now: 0, peak: 0 }) };
}

/// Does some work, and says how many bytes more than before this thread had in use at the same time, at most.
pub fn peak_of<T>(work: impl FnOnce() -> T) -> (T, usize) {
    let before = HELD.get().now;
    HELD.set(Held { now: before, peak: before });
    let result = work();
    (result, HELD.get().peak.saturating_sub(before).cast_unsigned())
}

/// Counts a request or, if negative, a release of the calling thread.
fn count(bytes: isize) {
    // A thread that ends releases what it has after its counter is gone.
    let _ = HELD.try_with(|held| {
        let now = held.get().now.saturating_add(bytes);
        held.set(Held { now, peak: held.get().peak.max(now) });
    });
}

struct Ceiling {
    in_use: AtomicUsize,
}

#[global_allocator]
static CEILING: Ceiling = Ceiling { in_use: AtomicUsize::new(0) };

impl Ceiling {
    /// Whether there is room for `size` more bytes, which then are in use.
    fn claim(&self, size: usize) -> bool {
        if size > MAX_REQUEST {
            return false;
        }
        let has_room = self.in_use.fetch_add(size, Relaxed) <= MAX_IN_USE - size;
        count(size.cast_signed());
        if !has_room {
            self.release(size);
        }
        has_room
    }

    fn release(&self, size: usize) {
        self.in_use.fetch_sub(size, Relaxed);
        count(-size.cast_signed());
    }

    fn claimed(&self, size: usize, request: impl FnOnce() -> *mut u8) -> *mut u8 {
        let pointer = if self.claim(size) { request() } else { return null_mut() };
        if pointer.is_null() {
            self.release(size);
        }
        pointer
    }
}

// SAFETY: System keeps the contract; null is what it gives too where there is no memory.
unsafe impl GlobalAlloc for Ceiling {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        self.claimed(layout.size(), || unsafe { System.alloc(layout) })
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        self.claimed(layout.size(), || unsafe { System.alloc_zeroed(layout) })
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        let pointer = self.claimed(size, || unsafe { System.realloc(pointer, layout, size) });
        if !pointer.is_null() {
            self.release(layout.size());
        }
        pointer
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        self.release(layout.size());
        unsafe { System.dealloc(pointer, layout) }
    }
}
