//! What pictures would show of each Gaussian, estimated without drawing any.
//!
//! A Gaussian shows by its opacity, by the pixels that it covers, and by the light that those before it let through. How much
//! that is, small pictures tell in which there is nothing but light: each Gaussian, the nearest first, finds what is left of it on a
//! square of pixels and takes its part. No ellipse is projected, no colour is blended, and Gaussians at nearly one depth are not
//! told apart, so that it takes less time than drawing the same pictures.
#![expect(
    clippy::indexing_slicing,
    reason = "rows are those of the frame; pixels are clipped to the picture; axes and buckets are constants"
)]
#![expect(clippy::arithmetic_side_effects, reason = "floats; places in what is in memory")]

use super::AT_ONCE;
use crate::frame::visible_difference::Pixels;
use crate::verification::HEIGHT;
use core::f32::consts::TAU;
use rayon::prelude::*;
use splatstream_gaussians::GaussianFrame;
use splatstream_render::Camera;
use splatstream_render::contribution::Worth;
use splatstream_render::rasterise::LOW_PASS;

/// Of what a Gaussian would show if nothing hid it, about so much is lost where only that one is missing: others overlap it.
const OVERLAPPED: f64 = 0.1;

/// What is hidden from all cameras counts for so much of what it would show: other views may see it.
const LEAST_PASSING: f32 = 1e-3;

/// A Gaussian takes so much of the light at most, as in a renderer.
const MOST_TAKEN: f32 = 0.99;

/// Depths are told apart by so many buckets between the nearest and the farthest.
const BUCKETS: usize = 1 << 12;

/// What pictures show of each Gaussian: what they [would](unhidden) if nothing hid it, as far as the light of its pixels passes
/// those before it. Light is squared where what is shown is, and both are means of the cameras that have the Gaussian in their picture;
/// what is in none counts as if nothing hid it.
///
/// Equal on every machine and for any number of threads.
pub(super) fn footprint(frame: &GaussianFrame, cameras: &[Camera]) -> Vec<Worth> {
    let mut shown = unhidden(frame, cameras);
    let covers: Vec<Cover> = shown.par_iter().with_min_len(AT_ONCE).map(Cover::new).collect();
    let mut sums = vec![(0.0, 0_u32); frame.len()];
    for cameras in cameras.chunks(rayon::current_num_threads()) {
        let light = |camera| View { frame, camera, covers: &covers }.light();
        let views: Vec<Vec<Option<f32>>> = cameras.par_iter().with_max_len(1).map(light).collect();
        sums.par_iter_mut().enumerate().with_min_len(AT_ONCE).for_each(|(row, (sum, count))| {
            for light in views.iter().filter_map(|light| light[row]) {
                *sum += light * light;
                *count += 1;
            }
        });
    }
    shown.par_iter_mut().zip(sums).with_min_len(AT_ONCE).for_each(|(shown, (sum, count))| {
        let passing = if count > 0 { f64::from((sum / count as f32).max(LEAST_PASSING)) } else { 1.0 };
        shown.contribution *= passing.sqrt();
        shown.loss *= passing;
        shown.energy *= passing;
    });
    shown
}

/// What pictures would show of each Gaussian if no other hid it: from its opacity, and from the pixels that it covers.
///
/// The low-pass filter of a renderer widens what is smaller than a pixel, and with antialiasing fades it by as much. It is that
/// of pictures of as many lines as quality is measured in, whatever the cameras have.
pub(crate) fn unhidden(frame: &GaussianFrame, cameras: &[Camera]) -> Vec<Worth> {
    let lines = cameras.iter().map(|camera| camera.height as f32).sum::<f32>() / cameras.len().max(1) as f32;
    let filter = LOW_PASS * (lines / HEIGHT as f32).powi(2);
    let of_row = |(row, pixel): (usize, &f32)| {
        let [a, b, c] = frame.log_scale().each_ref().map(|plane| plane[row]);
        let largest = a.max(b).max(c);
        let middle = a.max(b).min(a.min(b).max(c));
        let pixel = pixel.max(f32::MIN_POSITIVE);
        let [across, along] = [middle, largest].map(|scale| libm::expf(2.0 * scale) / (pixel * pixel));
        let area = ((across + filter) * (along + filter)).sqrt();
        let kept = if frame.antialiased() { (across * along).sqrt() / area } else { 1.0 };
        let opacity = kept / (1.0 + libm::expf(-frame.opacity_logit()[row]));
        let [contribution, energy] = [opacity * area, opacity * opacity * area].map(f64::from);
        Worth { contribution, loss: OVERLAPPED * energy, energy }
    };
    let arch = pulp::Arch::new();
    let mut shown = vec![Worth::default(); frame.len()];
    shown.par_chunks_mut(AT_ONCE).enumerate().for_each(|(chunk, shown)| {
        let first = chunk * AT_ONCE;
        let position = frame.position().each_ref().map(|plane| &plane[first..first + shown.len()]);
        let mut pixels = [0.0; AT_ONCE];
        let pixels = &mut pixels[..shown.len()];
        arch.dispatch(Pixels { position, cameras, pixels });
        let rows = (first..).zip(&*pixels);
        shown.iter_mut().zip(rows).for_each(|(shown, row)| *shown = of_row(row));
    });
    shown
}

/// A picture of which only the light is known.
struct View<'a> {
    frame: &'a GaussianFrame,
    camera: &'a Camera,
    covers: &'a [Cover],
}

/// What a Gaussian takes the light of: a square as large as what it covers, one pixel at least.
struct Cover {
    /// Pixels.
    side: f32,
    /// The part of their light that it lets through. Of a pixel that it does not fill it takes less.
    passing: f32,
}

impl Cover {
    /// From what would be seen of the Gaussian if nothing hid it.
    fn new(Worth { contribution, energy, .. }: &Worth) -> Self {
        let opacity = (energy / contribution.max(f64::MIN_POSITIVE)) as f32;
        // A bell of width 1 has as much light as a disc of this area that is as bright as its middle.
        let area = TAU * (*contribution as f32 / opacity.max(f32::MIN_POSITIVE));
        let side = area.sqrt().round().max(1.0);
        let taken = opacity * (area / (side * side)).min(1.0);
        Self { side, passing: 1.0 - taken.min(MOST_TAKEN) }
    }
}

/// The pixels of a [cover](Cover).
#[derive(Clone, Copy, Default)]
struct Square {
    row: u32,
    /// The first pixel, and the one after the last; none is left of a square that is not in the picture.
    across: [u16; 2],
    down: [u16; 2],
    /// As that of the cover.
    passing: f32,
}

impl View<'_> {
    /// The part of the light of its pixels that reaches each Gaussian; none where it is not in the picture.
    fn light(&self) -> Vec<Option<f32>> {
        let width = self.camera.width as usize;
        let mut left = vec![1.0_f32; width * self.camera.height as usize];
        let mut light = vec![None; self.frame.len()];
        for Square { row, across, down, passing } in self.nearest_first() {
            let [from, to] = across.map(usize::from);
            let [top, bottom] = down.map(usize::from);
            let mut sum = 0.0;
            for line in top..bottom {
                for pixel in &mut left[line * width + from..line * width + to] {
                    sum += *pixel;
                    *pixel *= passing;
                }
            }
            let pixels = (to - from) * (bottom - top);
            light[row as usize] = (pixels > 0).then(|| sum / pixels as f32);
        }
        light
    }

    /// What is before the camera, sorted by depth in one round of counting.
    fn nearest_first(&self) -> Vec<Square> {
        let depths = self.depths();
        let known = || depths.iter().flatten().map(|depth| depth.to_bits());
        let (least, most) = (known().min().unwrap_or_default(), known().max().unwrap_or_default());
        // Depths are positive: their bits order as they do.
        let spread = u32::BITS - (most - least).leading_zeros();
        let shift = spread.saturating_sub(BUCKETS.trailing_zeros());
        let bucket = |depth: u32| ((depth - least) >> shift) as usize;
        let mut starts = [0; BUCKETS + 1];
        known().for_each(|depth| starts[bucket(depth) + 1] += 1);
        (0..BUCKETS).for_each(|bucket| starts[bucket + 1] += starts[bucket]);
        let mut sorted = vec![Square::default(); starts[BUCKETS]];
        for (row, depth) in (0..).zip(&depths) {
            let Some(depth) = depth else { continue };
            let slot = &mut starts[bucket(depth.to_bits())];
            sorted[*slot] = self.square(row, *depth);
            *slot += 1;
        }
        sorted
    }

    /// The depth of each Gaussian, scene units; none behind the camera.
    fn depths(&self) -> Vec<Option<f32>> {
        let Camera {
            rotation: [.., [ahead_x, ahead_y, ahead_z]], position: [from_x, from_y, from_z], ..
        } = self.camera;
        let [x, y, z] = self.frame.position();
        let depth = |((x, y), z): ((&f32, &f32), &f32)| {
            let depth = (x - from_x) * ahead_x + (y - from_y) * ahead_y + (z - from_z) * ahead_z;
            (depth > 0.0 && depth < f32::INFINITY).then_some(depth)
        };
        x.iter().zip(y).zip(z).map(depth).collect()
    }

    fn square(&self, row: u32, depth: f32) -> Square {
        let Camera { rotation: [right, down, _], position, focal, principal, width, height, .. } =
            self.camera;
        let place = self.frame.position().each_ref().map(|plane| plane[row as usize]);
        let along = |axis: &[f32; 3]| -> f32 {
            axis.iter().zip(place).zip(position).map(|((axis, place), from)| axis * (place - from)).sum()
        };
        let Cover { side, passing } = self.covers[row as usize];
        let pixels = |middle: f32, count: u32| {
            let first = middle - 0.5 * side;
            // Rounded. Of what is no number nothing is left.
            [first, first + side].map(|edge| (edge + 0.5).clamp(0.0, count as f32) as u16)
        };
        Square {
            row,
            across: pixels(along(right) / depth * focal[0] + principal[0], *width),
            down: pixels(along(down) / depth * focal[1] + principal[1], *height),
            passing,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use splatstream_gaussians::Planes;

    /// Gaussians on the way of the camera and beside it, by place, size and opacity.
    fn scene(rows: &[([f32; 3], f32, f32)]) -> GaussianFrame {
        let column = |of: fn(&([f32; 3], f32, f32)) -> f32| rows.iter().map(of).collect::<Vec<f32>>();
        let planes = Planes {
            position: [column(|row| row.0[0]), column(|row| row.0[1]), column(|row| row.0[2])],
            log_scale: [(); 3].map(|()| column(|row| libm::logf(row.1))),
            rotation: [1.0, 0.0, 0.0, 0.0].map(|value| vec![value; rows.len()]),
            opacity_logit: column(|row| libm::logf(row.2 / (1.0 - row.2))),
            dc: [(); 3].map(|()| vec![0.5; rows.len()]),
            sh: Vec::new(),
        };
        GaussianFrame::from_planes(0, planes).unwrap()
    }

    /// At the origin, along z.
    fn camera(width: u32) -> Camera {
        let [target, down] = [[0.0, 0.0, 1.0].into(), [0.0, 1.0, 0.0].into()];
        Camera::look_at("ahead".into(), [0.0; 3].into(), target, down, 1.0, [width, 96])
    }

    /// What passes to each: of the squares of what would show.
    fn passing(frame: &GaussianFrame, cameras: &[Camera]) -> Vec<f64> {
        let bare = unhidden(frame, cameras);
        footprint(frame, cameras).iter().zip(bare).map(|(shown, bare)| shown.energy / bare.energy).collect()
    }

    #[test]
    fn a_gaussian_is_hidden_by_those_before_it_alone() {
        let (wall, small) = (0.5, 0.01);
        let frame = scene(&[
            ([0.0, 0.0, 4.0], small, 0.9),
            ([0.0, 0.0, 2.0], wall, 0.9),
            ([0.2, 0.0, 1.0], small, 0.9),
            ([2.0, 0.0, 4.0], small, 0.9),
            ([0.0, 0.0, -4.0], small, 0.9),
            ([90.0, 0.0, 4.0], small, 0.9),
        ]);
        let [behind, wall, before, beside, back, outside] = passing(&frame, &[camera(160)])[..] else {
            panic!("six rows")
        };
        assert!((behind - 0.01).abs() < 2e-3, "{behind} of (1 - 0.9)^2");
        assert!(wall > 0.95 && wall < 1.0, "{wall}: a small one takes the light of a pixel");
        assert_eq!([before, beside, back, outside], [1.0; 4]);
    }

    #[test]
    fn what_many_hide_keeps_a_part() {
        let walls = (0..5).map(|wall| ([0.0, 0.0, 2.0 + wall as f32], 2.0, 0.99));
        let rows: Vec<_> = walls.chain([([0.0, 0.0, 9.0], 0.01, 0.9)]).collect();
        let last = passing(&scene(&rows), &[camera(160)])[5];
        assert!((last - f64::from(LEAST_PASSING)).abs() < 1e-9, "{last}");
    }

    #[test]
    fn scenes_at_the_ends_of_the_range_are_estimated_too() {
        assert!(footprint(&scene(&[]), &[camera(160)]).is_empty());
        let far = ([0.0, 0.0, 1e12], 1e10, 0.5);
        let near = ([1e-6, 0.0, 1e-6], 1e-10, 1e-6);
        let large = ([0.0, 0.0, 1.0], 1e8, 0.5);
        let frame = scene(&[far, near, large]);
        let worth = footprint(&frame, &[camera(1)]);
        assert!(worth.iter().all(|worth| worth.energy >= 0.0), "{worth:?}");
    }
}
