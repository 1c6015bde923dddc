//! The decoder for web pages, compiled to WebAssembly. It imports nothing; `decoder/decoder.js` of the npm package calls it.
//!
//! * [`session`]: bytes in, frames out, and which rows of the textures a frame has changed;
//! * [`received`]: the bytes that have come so far, as a file that the decoder can seek in;
//! * [`texels`]: Gaussians as the renderer's textures hold them;
//! * [`order`]: the order to draw them in;
//! * [`exports`]: the functions that JavaScript sees. One module instance has one session.

pub mod exports;
pub mod order;
pub mod received;
pub mod session;
pub mod texels;
