//! Changes of whole frames, from which cases are made.

use super::dice::Dice;
use crate::quantile::ranked;
use splatstream_gaussians::{GaussianFrame, PlanesMut, sh_coefficients};

/// Where the inner scene is.
pub(super) struct Place {
    /// Its median on each axis.
    pub(super) middle: [f32; 3],
    /// The largest side of the box that holds 98 % on each axis; 1 for a scene without extent.
    pub(super) width: f32,
}

impl Place {
    /// Of a frame.
    pub(super) fn of(frame: &GaussianFrame) -> Self {
        let of_axes = frame.position().each_ref().map(|plane| {
            let mut values = plane.clone();
            [1, 50, 99].map(|percent| ranked(&mut values, percent, f32::total_cmp).unwrap_or_default())
        });
        let width = of_axes.iter().map(|[low, _, high]| high - low).fold(0.0, f32::max);
        Self { middle: of_axes.map(|[_, middle, _]| middle), width: if width > 0.0 { width } else { 1.0 } }
    }
}

/// A frame with other values.
pub(super) fn edited(frame: &GaussianFrame, edit: impl FnOnce(&mut PlanesMut<'_>)) -> GaussianFrame {
    let mut edited = frame.clone();
    edit(&mut edited.planes_mut());
    edited
}

/// Distances from a point and sizes times a factor, of some Gaussians.
pub(super) fn pushed(frame: &GaussianFrame, rows: &[usize], from: [f32; 3], factor: f64) -> GaussianFrame {
    let growth = libm::log(factor) as f32;
    edited(frame, |planes| {
        for &row in rows {
            for (plane, from) in planes.position.iter_mut().zip(from) {
                plane[row] = (f64::from(from) + (f64::from(plane[row]) - f64::from(from)) * factor) as f32;
            }
            planes.log_scale.iter_mut().for_each(|plane| plane[row] += growth);
        }
    })
}

/// The same of all Gaussians.
pub(super) fn zoomed(frame: &GaussianFrame, from: [f32; 3], factor: f64) -> GaussianFrame {
    let rows: Vec<usize> = (0..frame.len()).collect();
    pushed(frame, &rows, from, factor)
}

/// All Gaussians moved along x.
pub(super) fn moved(frame: &GaussianFrame, by: f32) -> GaussianFrame {
    edited(frame, |planes| planes.position[0].iter_mut().for_each(|x| *x += by))
}

/// The Gaussians in another order: no row keeps its meaning.
pub(super) fn shuffled(frame: &GaussianFrame, seed: u64) -> GaussianFrame {
    frame.select(&Dice::new(seed).order(frame.len()))
}

/// Evenly chosen Gaussians, at most so many.
pub(super) fn fewer(frame: &GaussianFrame, most: usize) -> GaussianFrame {
    let count = frame.len();
    if count <= most {
        return frame.clone();
    }
    let rows: Vec<u32> = (0..most).map(|row| (row as u64 * count as u64 / most as u64) as u32).collect();
    frame.select(&rows)
}

/// The same, grown so that they still cover what they lie on: Gaussians lie on surfaces, so their area grows as their
/// number shrinks.
pub(super) fn thinned(frame: &GaussianFrame, most: usize) -> GaussianFrame {
    let kept = fewer(frame, most);
    let growth = 0.5 * libm::log(frame.len().max(1) as f64 / kept.len().max(1) as f64);
    edited(&kept, |planes| {
        let scales = planes.log_scale.iter_mut().flat_map(|plane| plane.iter_mut());
        scales.for_each(|scale| *scale += growth as f32);
    })
}

/// Another scene of the same kind: mirrored, other colours.
pub(super) fn another(frame: &GaussianFrame) -> GaussianFrame {
    let middle = Place::of(frame).middle[0];
    edited(frame, |planes| {
        planes.position[0].iter_mut().for_each(|x| *x = 2.0 * middle - *x);
        planes.dc.rotate_left(1);
    })
}

/// A frame with spherical harmonics up to a degree: those above it are dropped, those that it lacks are made.
pub(super) fn with_degree(frame: &GaussianFrame, degree: u8) -> GaussianFrame {
    let mut planes = frame.clone().into_planes();
    let mut dice = Dice::new(u64::from(degree));
    planes.sh.truncate(sh_coefficients(degree) * 3);
    while planes.sh.len() < sh_coefficients(degree) * 3 {
        planes.sh.push((0..frame.len()).map(|_| (0.05 * dice.normal()) as f32).collect());
    }
    // As many planes as the degree has, all of one length.
    let made = GaussianFrame::from_planes(degree, planes).unwrap_or_default();
    made.with_antialiased(frame.antialiased())
}

#[cfg(test)]
mod tests {
    use super::*;
    use splatstream_files::builtin::BuiltinScene;

    fn frame() -> GaussianFrame {
        BuiltinScene { gaussians: 200, frames: 1, sh_degree: 1, ..BuiltinScene::default() }.frame(0)
    }

    #[test]
    fn a_zoom_can_be_undone() {
        let frame = frame();
        let there = zoomed(&frame, [0.0; 3], 1000.0);
        let back = zoomed(&there, [0.0; 3], 0.001);
        let far = |a: &GaussianFrame| (a.position()[0][7] - frame.position()[0][7]).abs();
        assert!(far(&there) > 1.0 && far(&back) < 1e-5);
        assert!((Place::of(&there).width / Place::of(&frame).width - 1000.0).abs() < 0.1);
    }

    #[test]
    fn degrees_are_dropped_and_made() {
        let frame = frame();
        assert_eq!([0, 1, 3].map(|degree| with_degree(&frame, degree).sh_degree()), [0, 1, 3]);
        assert_eq!(with_degree(&frame, 3).sh()[..9], frame.sh()[..]);
    }

    #[test]
    fn fewer_gaussians_are_larger() {
        let frame = frame();
        let few = thinned(&frame, 50);
        assert_eq!(few.len(), 50);
        assert!((few.log_scale()[0][0] - frame.log_scale()[0][0] - libm::logf(2.0)).abs() < 1e-6);
        assert_eq!(thinned(&frame, 500).len(), 200);
    }
}
