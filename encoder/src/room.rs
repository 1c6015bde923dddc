//! What is announced for frames that are not known yet: the ranges of those that are, with room around them.
//!
//! Where later frames leave them all the same, values are taken for the nearest that are announced, and reported. With
//! this much room that is a Gaussian that nobody sees, or a scene that has become another one.

use crate::error::Error;
use crate::grid::MAX_COLOUR;
use crate::isolated::Isolated;
use crate::sequence::{Analysis, Survey};
use crate::settings::Settings;
use splatstream_format::Limits;
use splatstream_gaussians::GaussianFrame;

/// Boxes that stand beside each other on an axis where one held all Gaussians.
const BOXES: f32 = 5.0;
/// Log-scales: a Gaussian may be as many times larger or smaller than any that was seen, natural logs.
const SCALE_ROOM: f32 = 6.0;
/// Opacities: from what is never seen to what is solid, whatever the middle is.
const OPACITY_ROOM: f32 = 16.0;
/// Spherical harmonics: so many times the largest that were seen, and so much more.
const SH_ROOM: (f32, f32) = (2.0, 2.0);
/// Gaussians of a frame, where there was one.
const MORE_GAUSSIANS: usize = 2;

/// What later frames are held to.
pub(crate) struct Announced {
    sh_degree: u8,
    antialiased: bool,
    max_gaussians: u32,
    /// Smallest and largest log-scale and opacity.
    log_scale: [f32; 2],
    opacity: [f32; 2],
    /// The largest norm of the spherical harmonics of a Gaussian.
    sh: f32,
}

/// What holds for all frames, of which some have been seen.
///
/// # Errors
/// More Gaussians than a stream can carry, and frames whose Gaussians are all at one point.
pub(crate) fn announce(mut survey: Survey, settings: &Settings) -> Result<(Analysis, Announced), Error> {
    if !survey.scene.extent.has_size() {
        return Err(Error::NoExtent { frames: survey.frames() });
    }
    let scene = &mut survey.scene;
    scene.extent = scene.extent.widened(BOXES);
    let [scale, opacity] = scene.origins;
    let [scale_reach, opacity_reach, dc_reach, sh_reach] = &mut scene.reach;
    *scale_reach += SCALE_ROOM;
    *opacity_reach = opacity_reach.max(OPACITY_ROOM);
    // What is beyond is isolated in any case.
    *dc_reach = 3_f32.sqrt() * MAX_COLOUR;
    *sh_reach = SH_ROOM.0.mul_add(*sh_reach, SH_ROOM.1);
    let around = |middle: f32, reach: f32| [middle - reach, middle + reach];
    let (log_scale, opacity) = (around(scale, *scale_reach), around(opacity, *opacity_reach));
    let sh = *sh_reach;
    // No more than what a stream holds at all, unless it is already.
    let most = Limits::of_level(*Limits::LEVELS.end()).max_gaussians as usize;
    let (frame, count) = survey.largest;
    survey.largest = (frame, count.saturating_mul(MORE_GAUSSIANS).min(most).max(count));
    survey.degree = survey.source_degree;
    let analysis = Analysis { bounds: None, ..survey.analysis(settings, 0)? };
    let max_gaussians = Limits::of_level(analysis.level).max_gaussians;
    let (sh_degree, antialiased) = (survey.source_degree, analysis.parameters.antialiased());
    Ok((analysis, Announced { sh_degree, antialiased, max_gaussians, log_scale, opacity, sh }))
}

impl Announced {
    /// A frame as it is coded, and what was too far out in it.
    ///
    /// # Errors
    /// What nothing can be taken for: a higher SH degree, another kind of antialiasing, more Gaussians than the level of
    /// the stream allows.
    pub(crate) fn hold(
        &self,
        frame: GaussianFrame,
        number: u32,
    ) -> Result<(GaussianFrame, Vec<Isolated>), Error> {
        let later = |property, value: String, announced: String| {
            Err(Error::NotAnnounced { frame: number, property, value, announced })
        };
        if frame.sh_degree() > self.sh_degree {
            return later("SH degree", frame.sh_degree().to_string(), format!("at most {}", self.sh_degree));
        }
        if frame.antialiased() != self.antialiased && !frame.is_empty() {
            return Err(Error::Antialiasing { frame: number, value: frame.antialiased() });
        }
        let max = self.max_gaussians;
        if frame.len() > max as usize {
            return Err(Error::TooManyGaussians { frame: number, count: frame.len(), max });
        }
        Ok(self.within(frame, number))
    }

    fn within(&self, mut frame: GaussianFrame, number: u32) -> (GaussianFrame, Vec<Isolated>) {
        let mut found = Vec::new();
        let mut take = |attribute, out: Vec<(u32, f32)>| {
            Isolated::add(Isolated::of(attribute, number, out.into_iter()), &mut found);
        };
        let planes = frame.planes_mut();
        for plane in planes.log_scale {
            take("log_scale", clamp(plane, self.log_scale));
        }
        // What is fainter than announced is never seen, and left out as it is.
        take("opacity", clamp(planes.opacity_logit, [f32::NEG_INFINITY, self.opacity[1]]));
        take("sh", shorten(planes.sh, self.sh));
        (frame, found)
    }
}

/// Clamps values; gives the rows and the values of those that were outside. What is not finite stays: no frame may hold it,
/// which is found later.
fn clamp(plane: &mut [f32], [low, high]: [f32; 2]) -> Vec<(u32, f32)> {
    let mut out = Vec::new();
    for (row, value) in (0..).zip(plane) {
        if value.is_finite() && !(low..=high).contains(value) {
            out.push((row, *value));
            *value = value.clamp(low, high);
        }
    }
    out
}

/// Shortens vectors, one coefficient a plane, that are longer than `most`; gives the rows and the lengths of those. As for
/// [`clamp`], what is not finite stays.
fn shorten(mut planes: Vec<&mut [f32]>, most: f32) -> Vec<(u32, f32)> {
    let mut squares = vec![0.0_f32; planes.first().map_or(0, |plane| plane.len())];
    for plane in &planes {
        for (sum, value) in squares.iter_mut().zip(plane.iter()) {
            let near = value.clamp(-MAX_COLOUR, MAX_COLOUR);
            *sum = if value.is_finite() { near.mul_add(near, *sum) } else { f32::NAN };
        }
    }
    let lengths = (0..).zip(squares).map(|(row, square)| (row, square.sqrt()));
    let out: Vec<(u32, f32)> = lengths.filter(|(_, length)| *length > most).collect();
    for &(row, length) in &out {
        for value in planes.iter_mut().filter_map(|plane| plane.get_mut(row as usize)) {
            *value = value.clamp(-MAX_COLOUR, MAX_COLOUR) * (most / length);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use splatstream_files::builtin::BuiltinScene;

    fn announced(frame: &GaussianFrame) -> (Analysis, Announced) {
        let settings = Settings::default();
        let survey = Survey::of(&mut vec![frame.clone()], &settings).unwrap();
        announce(survey, &settings).unwrap()
    }

    fn scene() -> GaussianFrame {
        BuiltinScene { gaussians: 300, sh_degree: 1, ..BuiltinScene::default() }.frame(0)
    }

    #[test]
    fn what_is_within_stays_as_it_is() {
        let frame = scene();
        let (analysis, announced) = announced(&frame);
        assert_eq!((analysis.parameters.frame_count, analysis.bounds), (0, None));
        assert_eq!(announced.hold(frame.clone(), 1).unwrap(), (frame, Vec::new()));
    }

    #[test]
    fn what_is_too_far_out_is_held_and_told() {
        let frame = scene();
        let (_, announced) = announced(&frame);
        let mut far = frame.clone();
        let planes = far.planes_mut();
        planes.log_scale[1][7] = -90.0;
        planes.opacity_logit[8] = 500.0;
        planes.opacity_logit[9] = f32::NEG_INFINITY;
        planes.sh.into_iter().for_each(|plane| plane[11] = -15.0);
        let (held, told) = announced.hold(far, 4).unwrap();
        let names: Vec<_> = told.iter().map(|one| (one.attribute, one.frame, one.row, one.count)).collect();
        assert_eq!(names, [("log_scale", 4, 7, 1), ("opacity", 4, 8, 1), ("sh", 4, 11, 1)]);
        assert_eq!(held.log_scale()[1][7], announced.log_scale[0]);
        assert_eq!(held.opacity_logit()[9], f32::NEG_INFINITY);
        let norm: f32 = held.sh().iter().map(|plane| plane[11] * plane[11]).sum();
        assert!((norm.sqrt() / announced.sh - 1.0).abs() < 1e-5);
        assert!(announced.hold(held, 5).unwrap().1.is_empty());
    }

    #[test]
    fn what_no_frame_may_hold_stays_to_be_refused() {
        let frame = scene();
        let (_, announced) = announced(&frame);
        let mut bad = frame;
        let planes = bad.planes_mut();
        (planes.log_scale[0][1], planes.opacity_logit[2]) = (f32::NAN, f32::INFINITY);
        planes.sh.into_iter().for_each(|plane| plane[3] = f32::INFINITY);
        let (held, told) = announced.hold(bad, 2).unwrap();
        assert_eq!(told, []);
        assert!(held.log_scale()[0][1].is_nan() && held.opacity_logit()[2] == f32::INFINITY);
        assert!(held.sh().iter().all(|plane| plane[3] == f32::INFINITY));
    }

    #[test]
    fn what_nothing_can_be_taken_for_is_an_error() {
        let (_, announced) = announced(&scene());
        let more = BuiltinScene { gaussians: 300, sh_degree: 2, ..BuiltinScene::default() }.frame(0);
        let error = announced.hold(more, 3).unwrap_err().to_string();
        assert_eq!(
            error,
            "frame 3: SH degree is 2, and at most 1 was announced by the first frames; \
            give the first frames as much"
        );
        let error = announced.hold(scene().with_antialiased(true), 3).unwrap_err();
        assert!(matches!(error, Error::Antialiasing { frame: 3, value: true }));
        assert!(announced.hold(scene().select(&[]).with_antialiased(true), 3).is_ok());
    }
}
