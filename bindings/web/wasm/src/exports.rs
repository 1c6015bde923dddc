//! The functions that JavaScript sees. They have numbers only: addresses in the memory of the module, counts, codes of
//! [`Status`](crate::session::Status). An address lasts until the next call.
#![expect(unsafe_code, reason = "an exported name may meet another one of the program")]

use crate::session::Session;
use std::cell::RefCell;

thread_local! {
    static SESSION: RefCell<Session> = RefCell::new(Session::default());
}

pub(crate) fn with<T>(work: impl FnOnce(&mut Session) -> T) -> T {
    SESSION.with_borrow_mut(work)
}

/// The version of this interface, which `decoder.js` compares.
#[unsafe(no_mangle)]
pub extern "C" fn gss_version() -> u32 {
    2
}

/// Where the next `count` bytes of the stream are to be written; 0 if they are too many.
#[unsafe(no_mangle)]
pub extern "C" fn gss_room(count: usize) -> usize {
    with(|session| session.room(count)).map_or(0, |room| room.addr())
}

/// So many bytes have been written there.
#[unsafe(no_mangle)]
pub extern "C" fn gss_filled(count: usize) {
    with(|session| session.filled(count));
}

/// No more bytes will come.
#[unsafe(no_mangle)]
pub extern "C" fn gss_end() {
    with(|session| session.end());
}

/// [`Session::decode`].
#[unsafe(no_mangle)]
pub extern "C" fn gss_next() -> u32 {
    with(Session::decode) as u32
}

/// [`Session::show`].
#[unsafe(no_mangle)]
pub extern "C" fn gss_show() -> u32 {
    with(Session::show) as u32
}

/// [`Session::seek`].
#[unsafe(no_mangle)]
pub extern "C" fn gss_seek(index: u32) -> u32 {
    with(|session| session.seek(index)) as u32
}

/// [`Session::set_point`]; 255 is the highest.
#[unsafe(no_mangle)]
pub extern "C" fn gss_set_point(spatial: u8, temporal: u8, refinement: u8) {
    with(|session| session.set_point([spatial, temporal, refinement]));
}

/// [`Session::describe`].
#[unsafe(no_mangle)]
pub extern "C" fn gss_describe() -> u32 {
    with(Session::describe) as u32
}

/// Numbers of the last call: binary64.
#[unsafe(no_mangle)]
pub extern "C" fn gss_numbers() -> usize {
    with(|session| session.numbers.as_ptr().addr())
}

/// How many numbers there are.
#[unsafe(no_mangle)]
pub extern "C" fn gss_numbers_length() -> usize {
    with(|session| session.numbers.len())
}

/// Text of the last call, UTF-8.
#[unsafe(no_mangle)]
pub extern "C" fn gss_text() -> usize {
    with(|session| session.text.as_ptr().addr())
}

/// Bytes of the text.
#[unsafe(no_mangle)]
pub extern "C" fn gss_text_length() -> usize {
    with(|session| session.text.len())
}

/// Words of a texture: 0 the base, 1 the spherical harmonics.
#[unsafe(no_mangle)]
pub extern "C" fn gss_texels(texture: u32) -> usize {
    with(|session| of(session, texture).words.as_ptr().addr())
}

/// How many words there are.
#[unsafe(no_mangle)]
pub extern "C" fn gss_texels_length(texture: u32) -> usize {
    with(|session| of(session, texture).words.len())
}

/// Rows of a texture that the last [`gss_show`] has changed: pairs of the first and the one after the last.
#[unsafe(no_mangle)]
pub extern "C" fn gss_dirty(texture: u32) -> usize {
    with(|session| of(session, texture).dirty.as_ptr().addr())
}

/// Twice the number of pairs.
#[unsafe(no_mangle)]
pub extern "C" fn gss_dirty_length(texture: u32) -> usize {
    with(|session| of(session, texture).dirty.len())
}

fn of(session: &Session, texture: u32) -> &crate::texels::Texture {
    if texture == 0 { &session.texels.base } else { &session.texels.sh }
}

/// Sorts for a camera at a position that looks along a unit vector; how many slots are drawn.
#[unsafe(no_mangle)]
pub extern "C" fn gss_sort(x: f32, y: f32, z: f32, ahead_x: f32, ahead_y: f32, ahead_z: f32) -> usize {
    with(|session| {
        session.sort([x, y, z], [ahead_x, ahead_y, ahead_z]);
        session.order.slots.len()
    })
}

/// The slots to draw, farthest first.
#[unsafe(no_mangle)]
pub extern "C" fn gss_order() -> usize {
    with(|session| session.order.slots.as_ptr().addr())
}

/// The depth from which Gaussians are drawn.
#[unsafe(no_mangle)]
pub extern "C" fn gss_near() -> f32 {
    with(|session| session.order.near)
}
