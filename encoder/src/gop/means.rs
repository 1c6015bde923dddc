//! What the frames of a GOP are coded with.

use super::{Gop, SpanCoder};
use crate::colour;
use crate::frame::axis_matching::Namings;
use crate::frame::cells::ReferenceCloud;
use crate::frame::grain::Grains;
use crate::frame::predictors::Chooser;
use crate::frame::rate_distortion::Goal;
use crate::frame::steadiness::Steadiness;
use crate::frame::survivors::{BitPrice, Survivors};
use crate::frame::target::Target;
use crate::frame::unit::UnitCoder;
use crate::frame::{CodedFrame, Reference};
use crate::matching::{Kind, Matching, Measure, shares_little, shares_much};
use crate::section::SectionPlan;
use crate::settings::{Fidelity, Predictors, ShChoice};
use crate::spans::span::Common;
use crate::vq;
use splatstream_decoder::colour::Colour;
use splatstream_decoder::layout::ShCoding;
use splatstream_decoder::steps::StepRule;
use splatstream_format::payload::Codebook;
use splatstream_format::syntax::Profile;
use splatstream_render::ReferencePictures;

/// Pairs on which coefficients and a codebook of SH residuals are compared, and on which the codebook is trained.
const TRIAL: usize = 1 << 13;

/// Entries of a codebook of SH residuals, at most: it is carried with each frame.
const RESIDUAL_ENTRIES: usize = 256;

/// Rows of the same Gaussian may differ by this many steps in attributes that motion leaves alone.
const SAME: f32 = 1.5;

impl SpanCoder<'_> {
    /// Which Gaussian of a frame continues each of a reference; none if they share too little.
    pub(super) fn matching(
        &self,
        reference: &Reference,
        target: &Target,
        measure: &Measure,
    ) -> Option<Matching> {
        let cloud = ReferenceCloud::of_source(reference, &self.common.sequence);
        let mut matching = cloud.matching(target, measure, self.common.sequence.position_bits);
        // Who goes by pictures has a use for partners that differ a lot.
        let useful = self.by_pictures() && shares_much(&matching);
        if shares_little(&matching) && !useful && !target.frame.is_empty() {
            return None;
        }
        if !self.common.settings.tools.survivors {
            matching.target_of.iter_mut().for_each(|partner| *partner = None);
        }
        Some(matching)
    }

    /// Whether the level of the stream allows a frame: what stays although nothing continues it may make it larger than
    /// any of the source.
    pub(super) fn is_within_limits(&self, coded: &CodedFrame) -> bool {
        let gaussians = coded.gaussians();
        let rate = self.common.sequence.gaussian_rate(gaussians);
        gaussians <= self.common.limits.max_gaussians && rate <= self.common.limits.max_gaussian_rate
    }

    /// What becomes of the Gaussians of a reference is found with this.
    pub(super) fn survivors<'s>(&'s self, gop: &'s Gop, target: &'s Target) -> Survivors<'s> {
        Survivors {
            target,
            sequence: &self.common.sequence,
            dc: &gop.tools.dc,
            sh: gop.tools.sh.as_ref().map(|(transform, _)| transform),
            namings: Namings::new(),
            price: gop.steadiness.as_ref().map_or(BitPrice::at(1.0), Steadiness::price),
            judge: None,
            weigher: None,
            kept: None,
            book: None,
        }
    }

    pub(super) fn measure(&self) -> Measure {
        let steps = Measure::steps_beside(&self.common.settings.steps);
        Measure { position_step: self.common.sequence.position_step(), steps, same: SAME }
    }

    /// Whether frames of which no row keeps its meaning are true to their pictures. What a network is trained with is
    /// the same either way, and sooner found without them.
    pub(super) fn by_pictures(&self) -> bool {
        let may = self.common.settings.tools.survivors && self.recorder.is_none();
        may && self.common.settings.fidelity() == Fidelity::Pictures
    }

    /// How good the pictures of a frame must be, if it is them that the frame is true to.
    pub(super) fn goal(&mut self, gop: &Gop, matching: &Matching, target: &Target) -> Option<Goal> {
        if !self.by_pictures() || matching.kind != Kind::Untracked || target.frame.is_empty() {
            return None;
        }
        let cameras = self.ranking.cameras(&target.frame).to_vec();
        Some(Goal {
            pictures: ReferencePictures::new(&target.frame, cameras),
            tolerance: f64::from(self.common.settings.tolerance),
            least: Vec::new(),
            level: gop.price_level,
        })
    }

    /// The codebook of the SH residuals of a frame, where a codebook serves them better than coefficients. Only a
    /// GOP whose I frame has a codebook has them: a new Gaussian takes an entry of each.
    #[expect(
        clippy::indexing_slicing,
        reason = "an entry of a codebook has `rank` values, and there is one or more"
    )]
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "lengths of what is in memory; a rank is 1 or more, temporal layers are at most 3"
    )]
    pub(super) fn residual_book(
        &self,
        gop: &Gop,
        survivors: &Survivors<'_>,
        reference: &Reference,
        matching: &Matching,
        temporal_layer: u8,
    ) -> Option<Codebook> {
        let (transform, plan) = gop.tools.sh.as_ref()?;
        plan.codebooks.first()?;
        let rank = usize::from(transform.header.rank);
        let pairs = matching.target_of.iter().flatten().count();
        let grains = self.grains();
        let rule = |list: u8| StepRule::new(&self.common.sequence, grains.of(list).attribute_step);
        let rules: Vec<StepRule> = (0..self.common.sequence.refinement_count).map(rule).collect();
        let rows = survivors.sh_rows(&reference.lists, &rules, &matching.target_of, pairs / TRIAL);
        let forced = self.common.settings.sh == ShChoice::VectorQuantised;
        let entries = vq::entry_count(pairs, false).min(RESIDUAL_ENTRIES);
        if rows.len() < 4 * rank || !forced && !colour::compare(&rows, rank, pairs, entries).1 {
            return None;
        }
        let mut book = vq::train(&rows, rank, entries.min(rows.len() / rank));
        book.entries[..rank].fill(0);
        // Each temporal layer has a codebook of its own, which only its frames replace.
        book.header.codebook_id = 1 + temporal_layer;
        Some(book)
    }

    /// How finely refinements are coded.
    fn grains(&self) -> Grains {
        let Common { settings, sequence, .. } = &self.common;
        Grains::new(&settings.laws, &settings.steps, sequence)
    }

    /// How new Gaussians are predicted.
    pub(super) fn chooser(&self) -> Chooser<'_> {
        Chooser {
            predictors: match self.common.settings.profile() {
                Profile::Intra => Predictors::NONE,
                Profile::Dynamic => self.common.settings.predictors,
            },
            choice: self.common.settings.predictor_choice,
            neighbours: self.common.settings.neighbours,
            recorder: self.recorder,
        }
    }

    /// How the units of a frame are coded: an I frame, or one with or without a codebook of SH residuals.
    pub(super) fn coder<'g>(
        &'g self,
        gop: &'g Gop,
        predicted: Option<Option<&'g Codebook>>,
    ) -> UnitCoder<'g> {
        let sh = gop.tools.sh.as_ref();
        let whole = sh.and_then(|(_, plan)| plan.codebooks.first());
        let residual = predicted.flatten();
        let coding = match (sh, predicted) {
            (Some((transform, _)), Some(None)) => ShCoding::Coefficients { rank: transform.header.rank },
            (Some(_), Some(Some(_))) => ShCoding::VectorQuantised { stages: 2 },
            _ => gop.tools.sh_coding(),
        };
        let books = match coding {
            ShCoding::VectorQuantised { .. } => [whole, residual, None, None],
            _ => [None; 4],
        };
        UnitCoder {
            sequence: &self.common.sequence,
            colour: Colour {
                dc: &gop.tools.dc,
                sh: sh.map(|(transform, _)| transform),
                mode: coding,
                codebooks: books,
            },
            sh: coding.header(books.iter().flatten().map(|book| book.header.codebook_id)),
            plan: SectionPlan {
                block_log2: self.common.sequence.block_log2,
                preset: self.common.settings.preset,
                tools: self.common.settings.tools,
            },
            grains: self.grains(),
            has_differences: self.chooser().predictors != Predictors::NONE
                || self.common.sequence.spatial_layer_count > 1,
            network: self.common.network,
            max_learned: self.common.limits.max_learned,
        }
    }
}
