//! Rays of a camera.

use super::light::{dome_point, levels, radiance};
use super::objects::Objects;
use glam::DVec3;
use splatstream_gaussians::random::{SplitMix64, mix};
use splatstream_render::Camera;
use splatstream_render::camera::CapturedPoint;
use std::f64::consts::TAU;

/// A camera in 64 bits.
pub(super) struct Sight {
    axes: [DVec3; 3],
    position: DVec3,
    focal: [f64; 2],
    principal: [f64; 2],
    size: [u32; 2],
}

impl Sight {
    pub(super) fn new(camera: &Camera) -> Self {
        let wide = |row: [f32; 3]| DVec3::from(row.map(f64::from));
        Self {
            axes: camera.rotation.map(wide),
            position: wide(camera.position),
            focal: camera.focal.map(f64::from),
            principal: camera.principal.map(f64::from),
            size: [camera.width.max(1), camera.height.max(1)],
        }
    }

    /// The direction of a place in the picture, pixels from its top left corner.
    fn ahead(&self, [x, y]: [f64; 2]) -> DVec3 {
        let [right, down, forward] = self.axes;
        let [x, y] = [(x - self.principal[0]) / self.focal[0], (y - self.principal[1]) / self.focal[1]];
        (forward + right * x + down * y).normalize()
    }

    /// The mean radiance of a pixel: one sample in each of `side` by `side` parts of it, anywhere within.
    pub(super) fn mean(&self, objects: &Objects, [x, y]: [u32; 2], side: u32) -> DVec3 {
        let key = mix(u64::from(x) | u64::from(y) << 32);
        let mut random = SplitMix64::new(key);
        let mut sum = DVec3::ZERO;
        for part in 0..side * side {
            let within =
                |corner: u32, random: &mut SplitMix64| (f64::from(corner) + random.unit()) / f64::from(side);
            let across = within(part % side, &mut random);
            let down = within(part / side, &mut random);
            let disc = disc(&mut random);
            let ahead = self.ahead([f64::from(x) + across, f64::from(y) + down]);
            // What is brighter than white would draw bright steps along edges.
            sum += radiance(objects, self.position, ahead, disc, true).min(DVec3::ONE);
        }
        sum / f64::from(side * side)
    }

    /// A point that the camera sees, somewhere in its picture.
    pub(super) fn point(&self, objects: &Objects, random: &mut SplitMix64) -> Option<CapturedPoint> {
        let at = self.size.map(|side| f64::from(side) * random.unit());
        let ahead = self.ahead(at);
        let along = match objects.hit(self.position, ahead) {
            Some(hit) => hit.along,
            None => (dome_point(self.position, ahead) - self.position).length(),
        };
        let colour = levels(radiance(objects, self.position, ahead, [0.0; 2], false));
        let off = DVec3::from([(); 3].map(|()| f64::from(random.signed()) + f64::from(random.signed())));
        let position = self.position + (ahead + off * 0.001) * along;
        Some(CapturedPoint { position: position.to_array().map(|part| part as f32), colour })
    }
}

/// Anywhere in the unit disc.
fn disc(random: &mut SplitMix64) -> [f64; 2] {
    let (radius, angle) = (random.unit().sqrt(), TAU * random.unit());
    let (sine, cosine) = libm::sincos(angle);
    [radius * cosine, radius * sine]
}
