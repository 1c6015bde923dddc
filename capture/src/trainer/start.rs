//! What a training starts from.
#![expect(clippy::arithmetic_side_effects, reason = "vectors of floats; places of points in memory")]
#![expect(clippy::indexing_slicing, reason = "places are those of the points, axes constants")]

use super::TrainError;
use glam::Vec3;
use rayon::prelude::*;
use splatstream_gaussians::activation::{dc_of_colour, logit};
use splatstream_gaussians::random::SplitMix64;
use splatstream_gaussians::{GaussianFrame, Planes};
use splatstream_render::Camera;
use splatstream_render::camera::CapturedPoint;

/// Opacity of a Gaussian of which nothing is known.
const OPACITY: f64 = 0.1;

/// A round Gaussian at each point, in its colour, as large as the root of the mean square of the distances to the three
/// nearest others.
///
/// # Errors
/// No points.
pub fn start_of_points(points: &[CapturedPoint]) -> Result<GaussianFrame, TrainError> {
    if points.is_empty() {
        return Err(TrainError::Points);
    }
    let sizes = spacings(points);
    let mut planes = Planes::with_capacity(0, points.len());
    for (point, size) in points.iter().zip(sizes) {
        planes.position.iter_mut().zip(point.position).for_each(|(plane, part)| plane.push(part));
        planes.log_scale.iter_mut().for_each(|plane| plane.push(libm::logf(size)));
        planes.rotation.iter_mut().zip([1.0, 0.0, 0.0, 0.0]).for_each(|(plane, part)| plane.push(part));
        planes.opacity_logit.push(logit(OPACITY) as f32);
        let colours = point.colour.map(|level| dc_of_colour(f64::from(level) / 255.0));
        planes.dc.iter_mut().zip(colours).for_each(|(plane, part)| plane.push(part));
    }
    Ok(GaussianFrame::from_planes(0, planes)?)
}

/// From where to where a camera's random points lie, in extents of all cameras: the farther, the fewer to a length.
const REACH: [f32; 2] = [0.5, 25.0];

/// `count` grey points that cameras see, anywhere in their pictures, at any order of magnitude of distance around how far
/// the cameras are from each other: for captures without points. None without cameras.
#[must_use]
pub fn start_at_random(cameras: &[&Camera], count: usize, seed: u64) -> Vec<CapturedPoint> {
    let extent = extent(cameras.iter().map(|camera| Vec3::from(camera.position)));
    let [near, far] = REACH;
    let mut random = SplitMix64::new(seed);
    let mut point = || {
        let camera = cameras.get(random.below(cameras.len()))?;
        let mut side =
            |size: u32, focal: f32, principal: f32| (random.unit() as f32 * size as f32 - principal) / focal;
        let x = side(camera.width, camera.focal[0], camera.principal[0]);
        let y = side(camera.height, camera.focal[1], camera.principal[1]);
        let [right, down, ahead] = camera.rotation.map(Vec3::from);
        let depth = extent * near * libm::powf(far / near, random.unit() as f32);
        let position = Vec3::from(camera.position) + (ahead + right * x + down * y) * depth;
        Some(CapturedPoint { position: position.to_array(), colour: [128; 3] })
    };
    (0..count).filter_map(|_| point()).collect()
}

/// The largest distance of a camera from the mean of all, and a tenth: what 3D Gaussian splatting calls the extent of a scene.
/// 1 where there is one camera.
pub(super) fn extent(cameras: impl Iterator<Item = Vec3> + Clone) -> f32 {
    let count = cameras.clone().count().max(1);
    let mean = cameras.clone().sum::<Vec3>() / count as f32;
    let farthest = cameras.map(|camera| camera.distance(mean)).fold(0.0, f32::max);
    if farthest > 0.0 { 1.1 * farthest } else { 1.0 }
}

/// The root of the mean square of the distances of each point to its three nearest.
///
/// Points are sorted along x, and each looks to both sides as far as a nearer one may be. Where points coincide, some of the
/// distances are 0; the result is never.
fn spacings(points: &[CapturedPoint]) -> Vec<f32> {
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by(|&a, &b| points[a].position[0].total_cmp(&points[b].position[0]).then(a.cmp(&b)));
    let sorted: Vec<Vec3> = order.iter().map(|&at| points[at].position.into()).collect();
    let spacing = |place: usize| {
        let own = sorted[place];
        let mut nearest = [f32::INFINITY; 3];
        let sides: [&mut dyn Iterator<Item = &Vec3>; 2] =
            [&mut sorted[place + 1..].iter(), &mut sorted[..place].iter().rev()];
        for side in sides {
            for other in side {
                let aside = other.x - own.x;
                if aside * aside >= nearest[2] {
                    break;
                }
                let square = other.distance_squared(own);
                if square < nearest[2] {
                    nearest[2] = square;
                    nearest.sort_by(f32::total_cmp);
                }
            }
        }
        let found: Vec<f32> = nearest.into_iter().filter(|square| square.is_finite()).collect();
        let mean = found.iter().sum::<f32>() / found.len().max(1) as f32;
        // A point alone has any size.
        if mean > 0.0 { mean.sqrt() } else { 1e-3 }
    };
    let sizes: Vec<f32> = (0..sorted.len()).into_par_iter().map(spacing).collect();
    let mut by_point = vec![0.0; points.len()];
    order.iter().zip(sizes).for_each(|(&at, size)| by_point[at] = size);
    by_point
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spacings_are_those_of_all_pairs() {
        let cameras = [Camera::of_pose(String::new(), [0.0; 3], [1.0, 0.0, 0.0, 0.0], 1.0, [8, 8])];
        let mut points = start_at_random(&[&cameras[0]], 60, 3);
        // Some on a line across x, some in one place.
        points.iter_mut().take(10).for_each(|point| point.position[0] = 0.0);
        points[20] = points[21];
        let found = spacings(&points);
        for (point, found) in points.iter().zip(found) {
            let own = Vec3::from(point.position);
            let mut squares: Vec<f32> =
                points.iter().map(|other| own.distance_squared(other.position.into())).collect();
            squares.sort_by(f32::total_cmp);
            let expected = (squares[1..4].iter().sum::<f32>() / 3.0).sqrt();
            assert!((found - expected).abs() <= 1e-6 * expected, "{found} {expected}");
        }
    }

    #[test]
    fn one_point_is_a_start_and_none_is_not() {
        let one = CapturedPoint { position: [1.0, 2.0, 3.0], colour: [255, 0, 128] };
        let frame = start_of_points(&[one, one]).unwrap();
        assert!(frame.planes().iter().flatten().all(|value| value.is_finite()));
        assert_eq!(start_of_points(&[one]).unwrap().len(), 1);
        assert_eq!(start_of_points(&[]), Err(TrainError::Points));
    }
}
