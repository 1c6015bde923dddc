//! I frames: their values, fitted to pictures or not, and what other frames need of them.

use super::group::Gop;
use super::worth::worth_of_reuse;
use super::{Intra, SpanCoder};
use crate::error::Error;
use crate::finetune::report::FinetuneReport;
use crate::finetune::{Finetune, Fit};
use crate::frame::CodedFrame;
use crate::frame::compensation::Compensator;
use crate::frame::intra::{IntraTarget, code_intra};
use crate::frame::predictors::Chooser;
use crate::frame::residuals::Wanted;
use crate::frame::steadiness::Steadiness;
use crate::frame::target::Target;
use crate::settings::{Predictors, Preset};
use splatstream_format::syntax::{FrameRole, FrameType, Profile};

impl SpanCoder<'_> {
    /// An I frame to be coded, and the order of its Gaussians.
    pub(super) fn intra_target(&mut self, number: u32) -> Result<Intra, Error> {
        let target = self.target(number)?;
        self.ranking.turn_to(number, &target.frame);
        let order = self.ranking.order(&target.frame);
        Ok(Intra { target, order })
    }

    /// Codes an I frame.
    pub(super) fn intra(&mut self, gop: &mut Gop, number: u32, intra: Intra) -> Result<(), Error> {
        let Intra { mut target, order } = intra;
        let known = gop.tools.take_components();
        let coder = self.coder(gop, None);
        let is_predicted = gop.header.is_predicted();
        let finetune = self.finetune(&target);
        let compensator = self.compensator(&target, finetune.is_some());
        let fit = |finetune| Fit {
            frame: &target.frame,
            order: &order,
            coder: &coder,
            layers: if gop.in_one_layer { 1 } else { self.common.sequence.spatial_layer_count },
            settings: self.common.settings,
            finetune,
            compensator: compensator.as_ref(),
            read: (number, target.digest),
        };
        let fitted = finetune.map(|finetune| fit(finetune).run()).transpose()?;
        let wanted = match &fitted {
            Some(fitted) => Wanted::new(&fitted.highest, None, &coder),
            None => Wanted::new(&target.frame, known, &coder),
        };
        let lowest = fitted.as_ref().and_then(|fitted| fitted.lowest.as_ref());
        let lowest = lowest.map(|frame| Wanted::new(frame, None, &coder));
        // Predictions would move the grids that values were fitted on.
        let predictors = if fitted.is_some() { Predictors::NONE } else { self.chooser().predictors };
        if !is_predicted {
            target.forget();
        }
        let mut coded = code_intra(
            &coder,
            IntraTarget {
                chooser: Chooser { predictors, ..self.chooser() },
                lowest,
                compensator: compensator.as_ref(),
                shows_top_prefixes: !(is_predicted && self.common.sequence.whole_anchor()),
                wanted,
                order: &order,
                rows: &target.rows,
                row_count: target.row_count,
                in_one_layer: gop.in_one_layer,
                tells_savings: self.tells_savings(number),
            },
        )?;
        if self.report.coded.is_empty() {
            self.report.savings.extend(coded.savings.iter().chain(&worth_of_reuse(&coded)));
        }
        if is_predicted {
            let is_fitted = fitted.as_ref().is_some_and(|fitted| fitted.is_changed);
            coded.reference.differs_from(&target, &self.coder(gop, None), is_fitted)?;
        }
        let reports = fitted.into_iter().flat_map(|fitted| fitted.reports);
        self.report.finetuned.extend(reports.map(|report| FinetuneReport { frame: number, ..report }));
        let role = FrameRole { frame_type: FrameType::Intra, temporal_layer: 0, reference: None };
        self.add(gop, number, &role, &target, &coded)?;
        gop.intra_bytes = coded.bytes() / f64::from(coded.gaussians().max(1));
        self.keep_intra(gop, number, &target, coded)
    }

    /// How an I frame is fitted to pictures, where that is asked for.
    fn finetune(&self, target: &Target) -> Option<&Finetune> {
        let is_fitted = self.recorder.is_none() && !target.frame.is_empty();
        self.common.settings.finetune.as_ref().filter(|_| is_fitted)
    }

    /// Keeps what other frames need of an I frame; one that none needs is written.
    fn keep_intra(
        &mut self,
        gop: &mut Gop,
        number: u32,
        target: &Target,
        coded: CodedFrame,
    ) -> Result<(), Error> {
        if !gop.header.is_predicted() {
            let is_done = self.common.network.is_none() && !gop.in_one_layer;
            return if is_done { self.write(gop) } else { Ok(()) };
        }
        if self.recorder.is_none() && !target.frame.is_empty() {
            let cameras = self.ranking.cameras(&target.frame);
            gop.steadiness = Some(Steadiness::new(cameras, target, &coded, &self.common.sequence)?);
        }
        gop.start_with(number, coded, self.common.sequence.whole_anchor());
        Ok(())
    }

    /// Prefixes of I frames are compensated where time is no matter: not in streams of one frame, or of frames that
    /// each stand for themselves, which are encoded quickly, unless they are fitted to pictures.
    fn compensator(&self, target: &Target, is_fitted: bool) -> Option<Compensator> {
        let settings = self.common.settings;
        let takes_time =
            is_fitted || settings.preset != Preset::Fast && settings.profile() == Profile::Dynamic;
        let has_prefixes = self.common.sequence.refinement_count > 1 && !target.frame.is_empty();
        (takes_time && has_prefixes).then(|| Compensator::new(&target.frame, self.common.settings.up()))
    }
}
