//! How far encoding has come.

/// Called after every frame with frames done and frames in all. Where the quality or the size of the stream is given,
/// frames may be encoded several times.
pub type Progress<'a> = &'a mut dyn FnMut(u32, u32);
