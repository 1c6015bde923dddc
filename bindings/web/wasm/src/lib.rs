//! The decoder for web pages, compiled to WebAssembly. It imports nothing; `decoder/decoder.js` of the npm package calls it.
//!
//! * [`session`]: bytes in, frames out, and which rows of the textures a frame has changed;
//! * [`received`]: the bytes that have come so far, as a file that the decoder can seek in;
//! * [`texels`]: Gaussians as the renderer's textures hold them;
//! * [`order`]: the order to draw them in;
//! * `package`: the package of a server, of which a session fetches what the network allows: what to request, and the frames of
//!   what has come. With the feature `packages`;
//! * [`exports`] and `package_exports`: the functions that JavaScript sees. One module instance has one session.

pub mod exports;
pub mod order;
#[cfg(feature = "packages")]
pub mod package;
#[cfg(feature = "packages")]
pub mod package_exports;
pub mod received;
pub mod session;
pub mod texels;
