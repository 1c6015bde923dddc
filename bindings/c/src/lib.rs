//! The C interface of the decoder: `include/splatstream.h` has its documentation, `examples/decode.c` shows its use.
//!
//! Every function is a few lines around the crate [`splatstream`]. Those that take pointers are unsafe by one contract,
//! which stands at the top of the header: `call.rs` turns the pointers of C into references, and panics and errors
//! into a status. Compiled to WebAssembly it imports nothing; `tests/wasm.mjs` calls it. A structure or function that changes its shape gets a new [`SPLATSTREAM_ABI_VERSION`].

mod call;
mod cancel;
mod decoder;
mod planes;
mod settings;
mod slots;
mod status;
mod version;

pub use cancel::*;
pub use decoder::*;
pub use planes::SplatstreamPlanes;
pub use settings::*;
pub use slots::*;
pub use status::SplatstreamStatus;
pub use version::*;
