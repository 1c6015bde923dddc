//! Which interface this is.
#![expect(unsafe_code, reason = "an exported name may meet another one of the program")]

/// The version of this interface: of its functions, structures and values.
pub const SPLATSTREAM_ABI_VERSION: u32 = 1;

/// The version of the interface that the library has. A program that was compiled with another
/// SPLATSTREAM_ABI_VERSION must not call anything else.
#[unsafe(no_mangle)]
pub extern "C" fn splatstream_abi_version() -> u32 {
    SPLATSTREAM_ABI_VERSION
}
