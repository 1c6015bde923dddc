//! ISO/IEC 14496-12: boxes are written by [`write`] and read by [`read`].

pub(crate) mod read;
pub(crate) mod write;

/// The type of a box.
pub(crate) type FourCc = [u8; 4];

/// Flags of the boxes of fragments.
pub(crate) mod flags {
    /// `tfhd`: offsets count from the `moof`.
    pub(crate) const DEFAULT_BASE_IS_MOOF: u32 = 0x02_0000;
    /// `tfhd`: there are no samples.
    pub(crate) const DURATION_IS_EMPTY: u32 = 0x01_0000;
    /// `tfhd`: an element that this annex does not use, and its bytes.
    pub(crate) const TFHD_OPTIONS: [(u32, usize); 5] = [(1, 8), (2, 4), (8, 4), (0x10, 4), (0x20, 4)];
    /// `trun`: `data_offset`.
    pub(crate) const DATA_OFFSET: u32 = 1;
    /// `trun`: `first_sample_flags`.
    pub(crate) const FIRST_SAMPLE_FLAGS: u32 = 4;
    /// `trun`: `sample_duration`.
    pub(crate) const SAMPLE_DURATION: u32 = 0x100;
    /// `trun`: `sample_size`.
    pub(crate) const SAMPLE_SIZE: u32 = 0x200;
    /// `trun`: `sample_flags`.
    pub(crate) const SAMPLE_FLAGS: u32 = 0x400;
    /// `trun`: `sample_composition_time_offset`.
    pub(crate) const COMPOSITION_OFFSET: u32 = 0x800;
}
