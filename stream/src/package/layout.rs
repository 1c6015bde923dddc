//! C.5: how the frames of a stream are divided into subsegments.

/// What a subsegment is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Layout {
    /// A GOP: any prefix of its refinements is one range of bytes.
    #[default]
    Gop,
    /// A frame, for low latency.
    Frame,
}

impl Layout {
    /// The name in the manifest.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Gop => "gop",
            Self::Frame => "frame",
        }
    }
}
