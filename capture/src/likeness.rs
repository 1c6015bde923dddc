//! Whether frames were trained apart.
//!
//! Of two trainings of one scene hardly any Gaussian agrees with one of the other in all of its values. Of two frames that
//! were tracked, or copied with noise, nearly all do.

use glam::Vec3;
use rayon::prelude::*;
use splatstream_gaussians::GaussianFrame;

/// Gaussians of a frame that are looked for in another.
const SAMPLE: usize = 1000;
/// How far two that stand for the same may differ: log-scales by length, logits of opacity, colours of degree 0.
const ALIKE: [f32; 3] = [0.15, 0.25, 0.1];
/// And how far apart they may be, as a share of the diagonal of the inner 90 % of the scene: what moves moves less in a frame.
const NEAR: f32 = 0.05;

/// The share of the Gaussians of a frame that another has too, near where they are, 0 to 1: of some that are spread over its
/// rows. Where it is most of them the frames need not be followed: they can be predicted as they are.
///
/// Gaussians are known by their semi-axes, opacity and colour, seven values.
///
/// ```
/// use splatstream_capture::in_common;
/// use splatstream_files::builtin::BuiltinScene;
///
/// let walk = BuiltinScene { gaussians: 200, ..BuiltinScene::default() };
/// assert_eq!(in_common(&walk.frame(1), &walk.frame(0)), 1.0);
/// let other = BuiltinScene { seed: 2, ..walk };
/// assert!(in_common(&other.frame(1), &walk.frame(0)) < 0.1);
/// ```
#[must_use]
pub fn in_common(frame: &GaussianFrame, other: &GaussianFrame) -> f64 {
    let near = NEAR * diagonal(frame);
    let others: Vec<Likeness> = (0..other.len()).filter_map(|row| Likeness::of(other, row)).collect();
    let every = frame.len().div_ceil(SAMPLE).max(1);
    let sample: Vec<Likeness> =
        (0..frame.len()).step_by(every).filter_map(|row| Likeness::of(frame, row)).collect();
    let found = sample.par_iter().filter(|one| others.iter().any(|other| one.is_like(other, near))).count();
    found as f64 / sample.len().max(1) as f64
}

/// What a Gaussian is known by.
struct Likeness {
    position: Vec3,
    /// Sorted, since axes have no order.
    log_scales: Vec3,
    opacity_logit: f32,
    dc: Vec3,
}

impl Likeness {
    fn of(frame: &GaussianFrame, row: usize) -> Option<Self> {
        let planes = frame.planes();
        let at = |planes: &[Vec<f32>; 3]| {
            let values = planes.each_ref().map(|plane| plane.get(row).copied());
            let [Some(x), Some(y), Some(z)] = values else { return None };
            Some([x, y, z])
        };
        let mut log_scales = at(planes.log_scale)?;
        log_scales.sort_unstable_by(f32::total_cmp);
        Some(Self {
            position: at(planes.position)?.into(),
            log_scales: log_scales.into(),
            opacity_logit: planes.opacity_logit.get(row).copied()?,
            dc: at(planes.dc)?.into(),
        })
    }

    fn is_like(&self, other: &Self, near: f32) -> bool {
        let [scales, opacity, colour] = ALIKE;
        (self.opacity_logit - other.opacity_logit).abs() <= opacity
            && self.dc.distance_squared(other.dc) <= colour * colour
            && self.log_scales.distance_squared(other.log_scales) <= scales * scales
            && self.position.distance_squared(other.position) <= near * near
    }
}

/// The diagonal of the box of a frame without the outer 5 % at either end of each axis.
fn diagonal(frame: &GaussianFrame) -> f32 {
    let side = |plane: &Vec<f32>| {
        let mut values = plane.clone();
        let mut at = |place: usize| {
            let (_, value, _) = values.select_nth_unstable_by(place, f32::total_cmp);
            *value
        };
        let (last, cut) = (plane.len().saturating_sub(1), plane.len() / 20);
        if plane.is_empty() { 0.0 } else { at(last.saturating_sub(cut)) - at(cut) }
    };
    Vec3::from(frame.position().each_ref().map(side)).length()
}
