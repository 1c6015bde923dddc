//! Scenes that stand still and have something in them that codecs do not expect.

use super::dice::Dice;
use super::edits::{Place, edited, fewer, pushed, zoomed};
use super::sample::Sample;
use splatstream_gaussians::GaussianFrame;

/// Opacities before the sigmoid: one of what can be seen, one of what never is.
const VISIBLE: f32 = 2.0;
const INVISIBLE: f32 = -30.0;

/// Gaussians with absurd colours, and needles: shares of the scene.
const ABSURD: f64 = 0.01;
const NEEDLES: f64 = 0.05;

/// A share of the Gaussians `factor` times as far away, and as much larger: sky, street, garden.
pub(super) fn far(scene: &GaussianFrame, share: f64, factor: f64) -> Sample {
    let rows = Dice::new(1).some(scene.len(), share);
    Sample::scene(pushed(scene, &rows, Place::of(scene).middle, factor), scene)
}

/// One more Gaussian, so many scene sizes away.
pub(super) fn floater(scene: &GaussianFrame, distance: f64, visible: bool) -> Sample {
    let rows: Vec<u32> = (0..scene.len() as u32).chain([0]).collect();
    let Place { middle, width } = Place::of(scene);
    let frame = edited(&scene.select(&rows), |planes| {
        for (plane, middle) in planes.position.iter_mut().zip(middle) {
            if let Some(last) = plane.last_mut() {
                *last = (f64::from(middle) + distance * f64::from(width)) as f32;
            }
        }
        if let Some(last) = planes.opacity_logit.last_mut() {
            *last = if visible { VISIBLE } else { INVISIBLE };
        }
    });
    Sample::scene(frame, scene)
}

/// Some Gaussians whose colour no screen can show.
pub(super) fn absurd(scene: &GaussianFrame, dc: f64) -> Sample {
    let frame = edited(scene, |planes| {
        for row in Dice::new(2).some(scene.len(), ABSURD) {
            planes.dc.iter_mut().for_each(|plane| plane[row] = dc as f32);
        }
    });
    Sample::scene(frame, scene)
}

/// Some Gaussians stretched along their longest axis.
pub(super) fn needles(scene: &GaussianFrame, factor: f64) -> Sample {
    let growth = libm::log(factor) as f32;
    let frame = edited(scene, |planes| {
        for row in Dice::new(3).some(scene.len(), NEEDLES) {
            let longest = planes.log_scale.iter_mut().max_by(|a, b| a[row].total_cmp(&b[row]));
            if let Some(plane) = longest {
                plane[row] += growth;
            }
        }
    });
    Sample::scene(frame, scene)
}

/// The scene in another unit of length.
pub(super) fn unit(scene: &GaussianFrame, unit: f64) -> Sample {
    let frame = zoomed(scene, [0.0; 3], unit);
    Sample::plain(vec![frame]).in_unit(unit)
}

/// So many Gaussians.
pub(super) fn count(scene: &GaussianFrame, count: f64) -> Sample {
    Sample::scene(fewer(scene, count as usize), scene)
}

/// A share of the Gaussians in one point.
pub(super) fn one_point(scene: &GaussianFrame, share: f64) -> Sample {
    let frame = edited(scene, |planes| {
        let rows = Dice::new(4).some(scene.len(), share);
        for (plane, middle) in planes.position.iter_mut().zip(Place::of(scene).middle) {
            rows.iter().for_each(|&row| plane[row] = middle);
        }
    });
    Sample::scene(frame, scene)
}

/// A share of the Gaussians without any opacity.
pub(super) fn transparent(scene: &GaussianFrame, share: f64) -> Sample {
    let frame = edited(scene, |planes| {
        for row in Dice::new(5).some(scene.len(), share) {
            planes.opacity_logit[row] = INVISIBLE;
        }
    });
    Sample::scene(frame, scene)
}

#[cfg(test)]
mod tests {
    use super::*;
    use splatstream_files::builtin::BuiltinScene;

    fn scene() -> GaussianFrame {
        BuiltinScene { gaussians: 200, frames: 1, sh_degree: 0, ..BuiltinScene::default() }.frame(0)
    }

    #[test]
    fn a_floater_is_one_more_and_far() {
        let scene = scene();
        let sample = floater(&scene, 1e4, false);
        let frame = &sample.frames[0];
        assert_eq!(frame.len(), 201);
        assert!(frame.position()[1][200] > 1e4 && frame.opacity_logit()[200] < -20.0);
        assert_eq!(frame.position()[1][..200], scene.position()[1][..]);
    }

    #[test]
    fn every_case_is_a_scene_that_files_could_hold() {
        let scene = scene();
        let samples = [
            far(&scene, 0.1, 1000.0),
            floater(&scene, 1e10, true),
            absurd(&scene, 1e6),
            needles(&scene, 20.0),
            unit(&scene, 1e-3),
            count(&scene, 0.0),
            one_point(&scene, 1.0),
            transparent(&scene, 1.0),
        ];
        let counts = samples.each_ref().map(|sample| sample.gaussians());
        assert_eq!(counts, [200, 201, 200, 200, 200, 0, 200, 200]);
        assert!(samples.iter().all(|sample| sample.frames[0].validate().is_ok()));
    }
}
