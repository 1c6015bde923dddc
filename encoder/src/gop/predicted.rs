//! Frames that refer to others.
#![expect(
    clippy::arithmetic_side_effects,
    reason = "numbers of frames rise within a GOP, and temporal layers are few"
)]

use super::group::Gop;
use super::{SpanCoder, Verdict};
use crate::error::Error;
use crate::frame::CodedFrame;
use crate::frame::cells::CellPlan;
use crate::frame::predicted::{Predicted, PredictedTarget};
use crate::frame::rate_distortion::Goal;
use crate::frame::target::Target;
use splatstream_format::syntax::{FrameRole, UnitId, UnitType};

/// A predicted frame that takes more than this part of what an I frame would is not worth it: it is no easier to decode,
/// and an I frame is where decoding can start.
const DEAR: f64 = 0.97;

impl SpanCoder<'_> {
    /// Codes a frame that refers to another, if that is worth it.
    pub(super) fn predicted(
        &mut self,
        gop: &mut Gop,
        number: u32,
        role: &FrameRole,
        reference: u32,
        target: &Target,
    ) -> Result<Verdict, Error> {
        let found = gop.references.iter().flatten().find(|(number, _)| *number == reference);
        let Some((earlier, reference)) = found else { return Ok(Verdict::Unlike) };
        let span_log2 = (number - earlier).ilog2() as u8;
        let measure = self.measure();
        let Some(matching) = self.matching(reference, target, &measure) else { return Ok(Verdict::Unlike) };
        let mut goal = self.goal(gop, &matching, target);
        let source = target;
        // Pictures decide about single frames, each by itself.
        let follows = goal.is_none() || reference.is_fitted();
        let followed =
            follows.then(|| reference.followed(target, &matching, &self.coder(gop, None))).flatten();
        let target = followed.as_ref().unwrap_or(source);
        let mut survivors = self.survivors(gop, target);
        let book = self.residual_book(gop, &survivors, reference, &matching, role.temporal_layer);
        survivors.book = book.as_ref();
        survivors.kept = reference.rounded().filter(|_| follows);
        let cells = CellPlan {
            measure: &measure,
            marks_stale: self.common.sequence.whole_anchor(),
            max_cells: self.common.limits.max_cells,
        };
        let from = PredictedTarget {
            coder: self.coder(gop, Some(book.as_ref())),
            chooser: self.chooser(),
            reference,
            span_log2,
            anchor: &gop.anchor,
            target,
            survivors,
            compensation: &gop.compensation,
        };
        let cells = Some(&cells).filter(|_| self.common.settings.tools.cell_motion);
        let mut predicted = Predicted::new(from, cells, matching)?;
        match (&mut goal, &gop.steadiness) {
            (Some(goal), _) => predicted.set_judge(goal)?,
            (None, Some(steadiness)) => {
                predicted.set_weigher(steadiness.weigher(&target.frame), steadiness.weighed_price());
            }
            (None, None) => {}
        }
        let coded = predicted.code()?;
        if !self.is_within_limits(&coded) {
            return Ok(Verdict::Unlike);
        }
        if self.is_dear(gop, &coded) {
            return Ok(Verdict::Dear);
        }
        if let Some(book) = &book {
            let id = UnitId::of_frame(UnitType::Codebook, gop.first).on_layers(0, role.temporal_layer);
            gop.units.push((id, book.to_bytes()?));
        }
        self.add(gop, number, role, target, &coded)?;
        self.keep_predicted(gop, (number, role), goal, source, coded)?;
        Ok(Verdict::Predicted)
    }

    /// Whether a predicted frame takes about as many bits as an I frame.
    fn is_dear(&self, gop: &Gop, coded: &CodedFrame) -> bool {
        let most = DEAR * gop.intra_bytes * f64::from(coded.gaussians());
        self.common.settings.tools.survivors && coded.bytes() > most
    }

    /// Keeps what other frames need of a predicted frame, and how good it is.
    fn keep_predicted(
        &mut self,
        gop: &mut Gop,
        (number, role): (u32, &FrameRole),
        goal: Option<Goal>,
        source: &Target,
        mut coded: CodedFrame,
    ) -> Result<(), Error> {
        let is_kept = role.temporal_layer + 1 < self.common.settings.temporal_layers().max(2);
        if is_kept && goal.is_none() && !coded.reference.is_fitted() {
            coded.reference.differs_from(source, &self.coder(gop, None), false)?;
        }
        match goal {
            Some(goal) => {
                gop.price_level = goal.level;
                self.report.coded.last_mut().into_iter().for_each(|frame| frame.by_pictures = true);
            }
            None => {
                if let Some(steadiness) = &mut gop.steadiness {
                    steadiness.follow(source, &coded, &self.common.sequence)?;
                }
            }
        }
        if is_kept {
            gop.keep(role.temporal_layer, number, coded.reference);
        }
        Ok(())
    }
}
