//! Frames for the tests: random ones, and those where something is at its limit.

use splatstream_gaussians::random::SplitMix64;
use splatstream_gaussians::{GaussianFrame, Planes, PlanesMut, sh_planes};
use splatstream_render::Camera;

/// Gaussians in front of [`camera`], of any direction and shape, quaternions of any length.
pub(crate) fn random(seed: u64, count: usize, sh_degree: u8, antialiased: bool) -> GaussianFrame {
    let mut random = SplitMix64::new(seed);
    let mut planes = Planes { sh: vec![Vec::new(); sh_planes(sh_degree)], ..Planes::default() };
    for _ in 0..count {
        let mut between = |least: f32, most: f32| least + (most - least) * random.unit() as f32;
        let depth = between(1.0, 6.0);
        let length = between(0.3, 3.0);
        let [x, y] = [between(-0.55, 0.55), between(-0.45, 0.45)];
        for (plane, value) in planes.position.iter_mut().zip([x * depth, y * depth, depth]) {
            plane.push(value);
        }
        planes.log_scale.iter_mut().for_each(|plane| plane.push(between(-4.0, -0.5)));
        planes.rotation.iter_mut().for_each(|plane| plane.push(length * between(-1.0, 1.0)));
        planes.opacity_logit.push(between(-3.0, 4.0));
        planes.dc.iter_mut().for_each(|plane| plane.push(between(-1.5, 1.5)));
        planes.sh.iter_mut().for_each(|plane| plane.push(between(-0.3, 0.3)));
    }
    GaussianFrame::from_planes(sh_degree, planes).unwrap().with_antialiased(antialiased)
}

/// A camera near the origin that looks nearly along z, with unequal focal lengths and its axis beside the middle.
pub(crate) fn camera(width: u32, height: u32) -> Camera {
    let focal = 0.9 * width as f32;
    let [x, y] = [width as f32, height as f32];
    let pose =
        Camera::of_pose(String::new(), [0.05, -0.1, -0.2], [1.0, 0.04, -0.03, 0.1], 1.0, [width, height]);
    Camera { focal: [focal, 1.1 * focal], principal: [0.47 * x, 0.55 * y], ..pose }
}

/// A frame whose planes are changed, row by row.
fn changed(frame: GaussianFrame, mut change: impl FnMut(usize, &mut PlanesMut<'_>)) -> GaussianFrame {
    let mut frame = frame;
    let rows = frame.len();
    let mut planes = frame.planes_mut();
    (0..rows).for_each(|row| change(row, &mut planes));
    frame
}

/// Frames where something is at its limit, with what it is and the size of the picture.
pub(crate) fn degenerate(antialiased: bool) -> Vec<(&'static str, GaussianFrame, [u32; 2])> {
    let base = |seed| random(seed, 8, 1, antialiased);
    let size = [40, 34];
    let needles = changed(base(1), |row, planes| {
        planes.log_scale[row % 3][row] = -0.5;
        planes.log_scale[(row + 1) % 3][row] = -7.0;
        planes.log_scale[(row + 2) % 3][row] = if antialiased { -3.5 } else { -9.0 };
        planes.opacity_logit[row] = 3.0;
    });
    let tiny = changed(base(2), |row, planes| {
        planes.log_scale.iter_mut().for_each(|plane| plane[row] -= 2.0);
        planes.opacity_logit[row] = 3.0;
    });
    let large = changed(base(3), |row, planes| {
        planes.log_scale.iter_mut().for_each(|plane| plane[row] += 3.5);
        planes.opacity_logit[row] = -1.0;
    });
    let opaque = changed(base(4), |row, planes| {
        // So large that compensation leaves them so.
        planes.log_scale.iter_mut().for_each(|plane| plane[row] = 0.3 * plane[row] + 0.3);
        planes.opacity_logit[row] = 4.0 + row as f32;
    });
    let transparent = changed(base(5), |row, planes| planes.opacity_logit[row] = -5.3 + 0.2 * row as f32);
    let border = changed(base(6), |row, planes| {
        let depth = planes.position[2][row];
        planes.position[row % 2][row] = if row % 4 < 2 { 0.75 } else { -0.75 } * depth;
        planes.log_scale.iter_mut().for_each(|plane| plane[row] *= 0.5);
        planes.opacity_logit[row] = 2.0;
    });
    let near = changed(base(7), |row, planes| {
        let closer = if row % 2 == 0 { 0.02 } else { 1.0 };
        // From the camera's position, so that those that come close stay in sight.
        for (plane, centre) in planes.position.iter_mut().zip([0.05, -0.1, -0.2]) {
            plane[row] = centre + closer * (plane[row] - centre);
        }
        planes.log_scale.iter_mut().for_each(|plane| plane[row] += closer.ln());
    });
    let black = changed(base(8), |row, planes| planes.dc[row % 3][row] = -4.0);
    let level = changed(base(9), |row, planes| {
        // Two depths, exactly equal for a camera whose axes are those of the scene.
        planes.position[2][row] = if row % 2 == 0 { 2.0 } else { 3.0 };
    });
    let walls = changed(random(10, 16, 0, antialiased), |row, planes| {
        planes.log_scale.iter_mut().for_each(|plane| plane[row] = 0.2 * plane[row] - 0.1);
        planes.opacity_logit[row] = 3.2;
    });
    let discs = changed(base(11), |row, planes| {
        planes.log_scale[2][row] = -14.0;
        planes.opacity_logit[row] = 2.5;
    });
    let one =
        changed(base(12), |row, planes| planes.log_scale.iter_mut().for_each(|plane| plane[row] += 1.0));
    vec![
        ("needles", needles, size),
        ("tiny", tiny, size),
        ("very large", large, size),
        ("nearly opaque", opaque, size),
        ("nearly transparent", transparent, size),
        ("at the border", border, size),
        ("near the camera", near, size),
        ("clamped colours", black, size),
        ("equal depths", level, size),
        ("pixels that are done", walls, size),
        ("discs without thickness", discs, size),
        ("a picture of one pixel", one, [1, 1]),
    ]
}
