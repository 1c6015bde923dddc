//! A decoded frame.

use crate::error::{Error, Result, Warning};
use splatstream_decoder::frame::QuantizedFrame;
use splatstream_decoder::frame_memory::FrameMemory;
use splatstream_decoder::operating_point::OperatingPoint;
use splatstream_decoder::output::to_gaussians;
use splatstream_decoder::process::DecodedFrame;
use splatstream_format::syntax::{FrameType, SequenceParameters};
use splatstream_gaussians::GaussianFrame;
use std::sync::OnceLock;
use std::time::Duration;

/// One frame: Gaussians as structure of arrays, most important first within each refinement.
///
/// ```
/// # let stream = include_bytes!("../examples/talk.gss").to_vec();
/// let mut frames = splatstream::Decoder::from_bytes(stream);
/// let frame = frames.next_frame()?.expect("the stream has frames");
/// assert_eq!((frame.index(), frame.is_keyframe()), (0, true));
/// let [x, y, z] = frame.gaussians().position();
/// println!("the first Gaussian stands at {}, {}, {}", x[0], y[0], z[0]);
/// assert!(frame.warnings().is_empty());
/// # Ok::<(), splatstream::Error>(())
/// ```
#[derive(Debug)]
pub struct Frame {
    index: u32,
    kind: FrameType,
    point: OperatingPoint,
    refinements: u8,
    is_reduced: bool,
    carried: usize,
    sequence: SequenceParameters,
    digest: Option<u64>,
    bytes: u64,
    integers: QuantizedFrame,
    identities: Vec<u32>,
    gaussians: OnceLock<GaussianFrame>,
    warnings: Vec<Warning>,
    /// Where its planes go when it is dropped.
    memory: FrameMemory,
}

impl Drop for Frame {
    fn drop(&mut self) {
        self.memory.recycle_integers(core::mem::take(&mut self.integers));
        self.gaussians.take().into_iter().for_each(|gaussians| self.memory.recycle(gaussians));
    }
}

impl Frame {
    pub(crate) fn new(
        mut decoded: DecodedFrame,
        point: OperatingPoint,
        sequence: SequenceParameters,
        warnings: Vec<Warning>,
        memory: FrameMemory,
    ) -> Result<Self> {
        decoded.planes.check(sequence.sh_degree).map_err(|error| Error::Broken(error.to_string()))?;
        let (identities, gaussians) = (decoded.identities.len(), decoded.planes.len());
        if identities != gaussians {
            return Err(Error::Broken(format!("{gaussians} Gaussians have {identities} identities")));
        }
        Ok(Self {
            index: decoded.index,
            kind: decoded.frame_type,
            point: point.at_most(OperatingPoint::highest(&sequence)),
            digest: decoded.digest,
            bytes: decoded.bytes,
            refinements: decoded.level,
            is_reduced: decoded.is_reduced,
            carried: decoded.carried,
            sequence,
            identities: core::mem::take(&mut decoded.identities),
            integers: decoded.into_shown(),
            gaussians: OnceLock::new(),
            warnings,
            memory,
        })
    }

    /// Its number in the order in which frames are shown, from 0.
    pub fn index(&self) -> u32 {
        self.index
    }

    /// When it is shown, from the start of the stream.
    pub fn time(&self) -> Duration {
        time_of(self.index, &self.sequence)
    }

    /// Whether it refers to no other frame.
    pub fn is_keyframe(&self) -> bool {
        self.kind == FrameType::Intra
    }

    /// The operating point that it was decoded at.
    pub fn operating_point(&self) -> OperatingPoint {
        self.point
    }

    /// How many refinements it shows exactly. Fewer than the operating point asks for if some are missing.
    pub fn refinements(&self) -> u8 {
        self.refinements
    }

    /// Whether it shows less than the operating point asks for, or may, because units of it or of a frame that it refers to are
    /// damaged, or did not come before the end of the bytes or an error that cost the rest of its GOP. Units that are missing
    /// without a trace do not count: an extracted stream lacks those of higher points too. Where such a stream is cut between two
    /// units, its last frame is called reduced even if all that was extracted of it is there, since only the operating_points unit
    /// says which point that was, and it stands behind all frames; whoever knows the point asks for it.
    pub fn is_reduced(&self) -> bool {
        self.is_reduced
    }

    /// How many of its Gaussians, the last ones, are those of an earlier frame, moved: they stand in for refinements that
    /// are not there.
    pub fn carried(&self) -> usize {
        self.carried
    }

    /// How many Gaussians it has.
    pub fn len(&self) -> usize {
        self.integers.len()
    }

    /// Whether it has none.
    pub fn is_empty(&self) -> bool {
        self.integers.is_empty()
    }

    /// Bytes of its units that were decoded, headers included.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// The Gaussians as f32. The first call computes them, beside the integers; [`Frame::into_gaussians`] needs no second
    /// copy.
    pub fn gaussians(&self) -> &GaussianFrame {
        self.gaussians.get_or_init(|| computed(self.memory.copy(&self.integers), &self.sequence))
    }

    /// The Gaussians as f32. Whoever gives them back to [`Decoder::recycle`](crate::Decoder::recycle) saves the next frame fresh
    /// memory.
    pub fn into_gaussians(mut self) -> GaussianFrame {
        let integers = core::mem::take(&mut self.integers);
        match self.gaussians.take() {
            Some(gaussians) => {
                self.integers = integers;
                gaussians
            }
            None => computed(integers, &self.sequence),
        }
    }

    /// The Gaussians as integers on the grids of the stream.
    pub fn integers(&self) -> &QuantizedFrame {
        &self.integers
    }

    /// The Gaussians as integers on the grids of the stream.
    pub fn into_integers(mut self) -> QuantizedFrame {
        core::mem::take(&mut self.integers)
    }

    /// The digest of the Gaussians that it shows exactly, as clause 7.9 of the specification defines it: equal digests mean
    /// equal frames, on any machine. It agrees with that of the stream. None where nothing is exact.
    pub fn digest(&self) -> Option<u64> {
        self.digest
    }

    /// The identity of each Gaussian: the same in two frames for the same Gaussian. [`Slots`](crate::Slots) uses them.
    pub fn identities(&self) -> &[u32] {
        &self.identities
    }

    /// What was lost since the frame before: damage, and frames that are missing. This is the only place where it is told,
    /// but for what follows the last frame, which is [`Error::Incomplete`](crate::Error::Incomplete).
    pub fn warnings(&self) -> &[Warning] {
        &self.warnings
    }
}

/// When a frame is shown, from the start of the stream.
pub(crate) fn time_of(index: u32, sequence: &SequenceParameters) -> Duration {
    let ticks = u64::from(index) * u64::from(sequence.ticks_per_frame);
    let per_second = u64::from(sequence.ticks_per_second.max(1));
    let nanoseconds = u128::from(ticks % per_second) * 1_000_000_000 / u128::from(per_second);
    Duration::new(ticks / per_second, nanoseconds as u32)
}

/// The output of 7.10 of planes that [`Frame::new`] has checked.
fn computed(integers: QuantizedFrame, sequence: &SequenceParameters) -> GaussianFrame {
    to_gaussians(integers, sequence).expect("a frame has planes that fit together")
}

#[cfg(test)]
mod tests {
    use super::*;
    use splatstream_decoder::operating_point::OperatingPoint;
    use splatstream_decoder::process::Options;
    use splatstream_decoder::stream::Frames;

    #[test]
    fn planes_go_to_the_memory_unless_they_were_handed_out() {
        const fn can_be_sent<T: Send + Sync>() {}
        can_be_sent::<Frame>();
        let decoder = crate::Decoder::from_bytes(include_bytes!("../examples/talk.gss").to_vec());
        let mut frames = decoder.map(|frame| frame.unwrap());
        let planes = |frame: &Frame| frame.memory.clone();
        let count = |memory: &FrameMemory| format!("{memory:?}");
        let first = frames.next().unwrap();
        let memory = planes(&first);
        let kept = first.gaussians().clone();
        drop(first);
        // Those of integers; a clone has the others.
        let of_one = count(&memory);
        assert_ne!(of_one, count(&FrameMemory::default()));
        let integers = frames.next().unwrap().into_integers();
        let gaussians = frames.next().unwrap().into_gaussians();
        assert_eq!(count(&memory), count(&FrameMemory::default()), "all are in use");
        memory.recycle(kept);
        assert_eq!(count(&memory), of_one);
        memory.recycle_integers(integers);
        memory.recycle(gaussians);
        assert_ne!(count(&memory), of_one);
    }

    #[test]
    fn a_frame_whose_parts_do_not_fit_is_broken() {
        let options = Options { identities: true, ..Options::default() };
        let mut frames = Frames::open(include_bytes!("../examples/talk.gss"), &options).unwrap();
        let decoded = frames.next_frame().unwrap();
        let sequence = *frames.sequence().unwrap();
        let frame = |decoded| {
            let memory = frames.memory().clone();
            Frame::new(decoded, OperatingPoint::ALL, sequence, Vec::new(), memory)
        };
        assert!(frame(decoded.clone()).is_ok());
        let mut without_identity = decoded.clone();
        without_identity.identities.pop();
        assert!(matches!(frame(without_identity), Err(Error::Broken(what)) if what.contains("identities")));
        let mut without_value = decoded;
        without_value.planes.opacity.pop();
        assert!(matches!(frame(without_value), Err(Error::Broken(_))));
    }
}
