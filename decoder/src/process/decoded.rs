//! What a decoder gives for a frame.

use crate::attribute::ATTRIBUTE_RANGE;
use crate::entropy_state::UnitEntropy;
use crate::frame::QuantizedFrame;
use crate::shift::Shift;
use splatstream_format::syntax::FrameType;
use splatstream_format::{Error, Result};

/// One frame, as far as its units were decoded.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct DecodedFrame {
    /// Display index.
    pub index: u32,
    /// How it is coded.
    pub frame_type: FrameType,
    /// The integer planes of the Gaussians that are shown: exact lists, then carried lists. Not compensated; see
    /// [`DecodedFrame::into_shown`].
    pub planes: QuantizedFrame,
    /// Exact lists that are shown.
    pub level: u8,
    /// The spatial layer of the last exact list.
    pub spatial_layer: u8,
    /// Carried lists that are shown (clause 7.8.1).
    pub carried_lists: u8,
    /// Gaussians of carried lists: the last ones of `planes`.
    pub carried: usize,
    /// Whether nothing is known of the frame: it is an empty frame, which has no Gaussians (SS-CA-002).
    pub is_lost: bool,
    /// Whether the frame shows less than its operating point asks for, or may: units of it, or of a frame that it refers to, are
    /// damaged or did not come before the end of the bytes or an error that ends the GOP. Of units that are missing without a
    /// trace nothing is known: an extracted stream lacks those of higher points too. Where such a stream is cut between two units, its
    /// last frame is called reduced even if all that was extracted of it is there, since only the operating_points unit says which
    /// point that was, and it stands behind all frames; whoever knows the point asks for it.
    pub is_reduced: bool,
    /// Digest of the exact lists; none if digests are not verified or there is no exact list.
    pub digest: Option<u64>,
    /// Digest of all carried lists of the frame, where it was compared.
    pub carried_digest: Option<u64>,
    /// The identity of each Gaussian of `planes`, if they were asked for: in two frames the same for the same Gaussian, and
    /// in one frame different for each. Gaussians of different GOPs are different.
    pub identities: Vec<u32>,
    /// What is added before output.
    pub compensation: Compensation,
    /// Bytes of the units of the frame that were decoded, headers included.
    pub bytes: u64,
    /// Entropy states of the units of the frame that were decoded, if they were asked for.
    pub entropy: Vec<UnitEntropy>,
    /// The first error that was found in the frame.
    pub error: Option<Error>,
}

/// Clause 7.8.3: what fills the holes that missing Gaussians leave.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Compensation {
    /// Added to exact Gaussians.
    pub exact: Shift,
    /// To which of the exact ones, in order; empty: to all.
    pub only: Vec<bool>,
    /// Added to carried Gaussians.
    pub carried: Shift,
}

impl DecodedFrame {
    /// A frame of which nothing is there.
    pub(super) fn empty(index: u32, frame_type: FrameType) -> Self {
        Self {
            index,
            frame_type,
            planes: QuantizedFrame::default(),
            level: 0,
            spatial_layer: 0,
            carried_lists: 0,
            carried: 0,
            is_lost: false,
            is_reduced: false,
            digest: None,
            carried_digest: None,
            identities: Vec::new(),
            compensation: Compensation::default(),
            bytes: 0,
            entropy: Vec::new(),
            error: None,
        }
    }

    /// Establishes that everything of a frame fits together, so that nobody has to ask when it is shown.
    ///
    /// # Errors
    /// A fault.
    pub(super) fn check(&self, sh_degree: u8, has_identities: bool) -> Result<()> {
        let gaussians = self.planes.len();
        let exact =
            gaussians.checked_sub(self.carried).ok_or(Error::fault("carried Gaussians in a frame"))?;
        let only = self.compensation.only.len();
        let rules = [
            (
                self.planes.check(sh_degree).is_ok(),
                Error::fault("planes of one length, and those of the degree"),
            ),
            (only == 0 || only == exact, Error::fault("a flag for each exact Gaussian")),
            (
                !has_identities || self.identities.len() == gaussians,
                Error::fault("an identity for each Gaussian"),
            ),
        ];
        rules.into_iter().try_for_each(|(holds, error)| if holds { Ok(()) } else { Err(error) })
    }

    /// The planes from which clause 7.10 computes the output: compensated.
    pub fn into_shown(self) -> QuantizedFrame {
        let Self { mut planes, compensation, carried, .. } = self;
        let exact = planes.len().saturating_sub(carried);
        compensation.apply(&mut planes, exact);
        planes
    }
}

impl Compensation {
    /// Compensates planes of which the first `exact` Gaussians are exact.
    fn apply(&self, planes: &mut QuantizedFrame, exact: usize) {
        let shift = |plane: &mut [i32], of_exact: i8, of_carried: i8| {
            match self.only.is_empty() {
                true => plane.iter_mut().take(exact).for_each(|value| add(value, of_exact)),
                false => {
                    let flagged = plane.iter_mut().take(exact).zip(&self.only);
                    flagged.filter(|(_, only)| **only).for_each(|(value, _)| add(value, of_exact));
                }
            }
            plane.iter_mut().skip(exact).for_each(|value| add(value, of_carried));
        };
        if self.exact.is_zero() && self.carried.is_zero() {
            return;
        }
        for plane in &mut planes.log_scale {
            shift(plane, self.exact.log_scale, self.carried.log_scale);
        }
        shift(&mut planes.opacity, self.exact.opacity, self.carried.opacity);
    }
}

fn add(value: &mut i32, by: i8) {
    *value = value.saturating_add(by.into()).clamp(*ATTRIBUTE_RANGE.start(), *ATTRIBUTE_RANGE.end());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_and_carried_gaussians_are_compensated_apart() {
        let mut frame = DecodedFrame::empty(0, FrameType::Predicted);
        frame.planes = QuantizedFrame::zeroed(4, 0);
        frame.planes.opacity = vec![1, 32_767, 3, -32_768];
        frame.carried = 1;
        frame.compensation = Compensation {
            exact: Shift { log_scale: 2, opacity: 5 },
            only: vec![false, true, true],
            carried: Shift { log_scale: -1, opacity: -5 },
        };
        let mut all = frame.clone();
        all.compensation.only.clear();
        let shown = frame.into_shown();
        assert_eq!(shown.opacity, [1, 32_767, 8, -32_768]);
        assert_eq!(shown.log_scale, [const { [0, 2, 2, -1] }; 3].map(Vec::from));
        assert_eq!(all.into_shown().opacity, [6, 32_767, 8, -32_768]);
    }

    #[test]
    fn a_frame_whose_parts_do_not_fit_is_a_fault() {
        let mut frame = DecodedFrame::empty(0, FrameType::Predicted);
        frame.planes = QuantizedFrame::zeroed(4, 0);
        (frame.carried, frame.identities) = (1, vec![0; 4]);
        frame.compensation.only = vec![true; 3];
        assert_eq!(frame.check(0, true), Ok(()));
        let changes: [fn(&mut DecodedFrame); 4] = [
            |frame| frame.carried = 5,
            |frame| frame.planes.dc[1].truncate(3),
            |frame| frame.compensation.only.truncate(2),
            |frame| frame.identities.truncate(3),
        ];
        for change in changes {
            let mut changed = frame.clone();
            change(&mut changed);
            assert!(changed.check(0, true).is_err_and(|error| error.is_fault()));
        }
        assert!(frame.check(1, true).is_err(), "SH planes of another degree");
        frame.identities.clear();
        assert_eq!(frame.check(0, false), Ok(()), "nobody asked for identities");
    }
}
