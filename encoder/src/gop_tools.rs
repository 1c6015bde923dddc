//! What the frames of a GOP share: colour transforms and codebooks.

use crate::colour::{self, ShPlan};
use crate::error::Error;
use crate::grid::size;
use crate::pca::Components;
use crate::refinements::parts;
use crate::report::Report;
use crate::savings::{Saving, Tool};
use crate::settings::{Preset, Settings};
use crate::shape::Shape;
use splatstream_decoder::layout::ShCoding;
use splatstream_decoder::steps::{Stage, StepRule};
use splatstream_format::payload::{Codebook, Transform};
use splatstream_format::syntax::{Profile, SequenceParameters, TransformKind, UnitId, UnitType};
use splatstream_gaussians::GaussianFrame;

/// Transforms and codebooks, made for the first frame of a GOP.
pub(crate) struct GopTools {
    pub(crate) dc: Transform,
    pub(crate) sh: Option<(Transform, ShPlan)>,
    /// What the transform saves, if it was looked at.
    worth_of_transform: Option<Saving>,
    /// SH components of the first frame, steps, which were needed to find the rank.
    first_components: Option<Vec<Vec<f32>>>,
}

/// The SH planes that the sequence carries; a frame of a lower degree has fewer.
pub(crate) fn sh_planes<'a>(
    frame: &'a GaussianFrame,
    sequence: &SequenceParameters,
    zeros: &'a [f32],
) -> Vec<&'a [f32]> {
    (0..usize::from(sequence.sh_dimension()))
        .map(|plane| frame.sh().get(plane).map_or(zeros, Vec::as_slice))
        .collect()
}

pub(crate) fn dc_planes(frame: &GaussianFrame) -> [&[f32]; 3] {
    frame.dc().each_ref().map(Vec::as_slice)
}

impl GopTools {
    /// For a GOP of at most so many frames that starts with `frame`, whose Gaussians have the order of importance `order`.
    pub(crate) fn new(
        frame: &GaussianFrame,
        order: &[u32],
        sequence: &SequenceParameters,
        settings: &Settings,
        frames: u32,
    ) -> Self {
        let dc = Components::of(&dc_planes(frame));
        let dc = colour::transform(TransformKind::Dc, &dc, sequence.dc_step());
        let zeros = vec![0.0; frame.len()];
        let (mut first_components, mut worth_of_transform) = (None, None);
        let sh = (sequence.sh_degree > 0).then(|| {
            let planes = sh_planes(frame, sequence, &zeros);
            let step = sequence.sh_step();
            let basis = match settings.tools.sh_transform {
                true => Components::of(&planes),
                false => Components::identity(planes.len()),
            };
            let mut transform = colour::transform(TransformKind::Sh, &basis, step);
            let mut components = colour::components(&transform, &planes, step);
            let exponent = sh_exponent(frame, order, sequence, settings);
            // What the first frame does not need, another may.
            if frames == 1 {
                colour::drop_unused(&mut transform, &mut components, &exponent);
            }
            let is_looked_at =
                settings.tools.sh_transform && settings.preset != Preset::Fast && !frame.is_empty();
            let gaussians = frame.len().saturating_mul(frames as usize);
            let (worth, mut plan) = rayon::join(
                || is_looked_at.then(|| colour::worth_of_transform(&components, &planes, &exponent, step)),
                || colour::plan_sh(&components, &exponent, gaussians, settings.sh, settings.preset),
            );
            worth_of_transform = worth;
            if settings.profile() == Profile::Dynamic {
                keep_zero(&mut plan.codebooks, usize::from(transform.header.rank));
            }
            first_components = Some(components);
            (transform, plan)
        });
        Self { dc, sh, worth_of_transform, first_components }
    }

    /// The units that define them, for the GOP that starts with a frame.
    ///
    /// # Errors
    /// A transform or codebook that a decoder would refuse.
    pub(crate) fn units(
        &self,
        sequence: &SequenceParameters,
        frame: u32,
    ) -> Result<Vec<(UnitId, Vec<u8>)>, Error> {
        let transform_id = UnitId::of_frame(UnitType::Transform, frame);
        let mut units = vec![(transform_id, self.dc.to_bytes(sequence)?)];
        let Some((transform, plan)) = &self.sh else { return Ok(units) };
        units.push((transform_id, transform.to_bytes(sequence)?));
        for codebook in &plan.codebooks {
            units.push((UnitId::of_frame(UnitType::Codebook, frame), codebook.to_bytes()?));
        }
        Ok(units)
    }

    /// Reports how SH is coded.
    pub(crate) fn report(&self, report: &mut Report) {
        if let Some((transform, plan)) = &self.sh {
            report.sh_rank = transform.header.rank;
            report.sh_trial = plan.trial;
            let worth_of_coding = plan.trial.map(|[coefficients, book]| match plan.codebooks.is_empty() {
                true => Saving::between(Tool::ShCoding, coefficients, book),
                false => Saving::between(Tool::ShCoding, book, coefficients),
            });
            report.savings.extend(self.worth_of_transform.into_iter().chain(worth_of_coding));
            report.sh_codebook_entries =
                plan.codebooks.first().map_or(0, |book| u32::from(book.header.entry_count_minus1) + 1);
        }
    }

    /// How the SH of I frames is coded.
    pub(crate) fn sh_coding(&self) -> ShCoding {
        match &self.sh {
            None => ShCoding::None,
            Some((transform, plan)) if plan.codebooks.is_empty() => {
                ShCoding::Coefficients { rank: transform.header.rank }
            }
            Some((_, plan)) => ShCoding::VectorQuantised { stages: plan.codebooks.len() as u8 },
        }
    }

    /// The SH components of the first frame, once, if they are known.
    pub(crate) fn take_components(&mut self) -> Option<Vec<Vec<f32>>> {
        self.first_components.take()
    }
}

/// The exponent of the steps of SH of each Gaussian of an I frame.
#[expect(
    clippy::indexing_slicing,
    reason = "rows are those of the frame; an entry of a codebook has `rank` values"
)]
fn sh_exponent(
    frame: &GaussianFrame,
    order: &[u32],
    sequence: &SequenceParameters,
    settings: &Settings,
) -> impl Fn(usize) -> u8 {
    let mut refinements = vec![0; frame.len()];
    let mut rules = Vec::new();
    for (refinement, part) in (0..).zip(parts(&settings.refinements, order.len())) {
        let announced = settings.laws.attribute_step(&settings.steps, sequence, refinement);
        rules.push(StepRule::new(sequence, announced));
        order[part].iter().for_each(|&row| refinements[row as usize] = refinement);
    }
    move |row| {
        let rule = &rules[usize::from(refinements[row])];
        let (log_scale, opacity) = size(frame, row, sequence);
        Shape::new(log_scale, opacity, rule, sequence.canonical_axes()).exponent(Stage::Sh, rule)
    }
}

/// Makes entry 0 of every codebook zero, so that it can stand for "as before".
#[expect(
    clippy::indexing_slicing,
    reason = "rows are those of the frame; an entry of a codebook has `rank` values"
)]
fn keep_zero(books: &mut [Codebook], rank: usize) {
    books.iter_mut().for_each(|book| book.entries[..rank].fill(0));
}
