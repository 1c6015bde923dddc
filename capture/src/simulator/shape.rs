//! Surfaces: where a ray meets them, and how far a point is from them.

use glam::{DVec2, DVec3};

/// Nearer than this along a ray is where it starts.
pub(super) const NEAR: f64 = 1e-6;

/// A surface around the origin, y along its axis.
#[derive(Clone, Copy, Debug)]
pub(super) enum Shape {
    Ball {
        radius: f64,
    },
    Box {
        half: DVec3,
    },
    /// A segment along y of this half length, and all within the radius of it.
    Capsule {
        half: f64,
        radius: f64,
    },
    /// Around y.
    Ring {
        radius: f64,
        thickness: f64,
    },
    /// In the plane y = 0, seen from both sides.
    Disc {
        radius: f64,
    },
}

impl Shape {
    /// Radius of a ball around the origin that holds it all.
    pub(super) fn bound(&self) -> f64 {
        match *self {
            Self::Ball { radius } | Self::Disc { radius } => radius,
            Self::Box { half } => half.length(),
            Self::Capsule { half, radius } => half + radius,
            Self::Ring { radius, thickness } => radius + thickness,
        }
    }

    /// How far along the ray it is met first, for a direction of length 1.
    pub(super) fn meets(&self, origin: DVec3, ahead: DVec3) -> Option<f64> {
        match *self {
            Self::Ball { radius } => ball(origin, ahead, radius),
            Self::Box { half } => box_(origin, ahead, half),
            Self::Capsule { half, radius } => capsule(origin, ahead, half, radius),
            Self::Ring { .. } => self.march(origin, ahead),
            Self::Disc { radius } => {
                let along = -origin.y / ahead.y;
                let at = origin + ahead * along;
                (along > NEAR && at.x * at.x + at.z * at.z < radius * radius).then_some(along)
            }
        }
    }

    /// Goes along the ray by as much as is free, within the ball that holds the shape.
    fn march(&self, origin: DVec3, ahead: DVec3) -> Option<f64> {
        let bound = self.bound();
        let middle = -origin.dot(ahead);
        let half = (bound * bound - (origin + ahead * middle).length_squared()).max(0.0).sqrt();
        let (mut along, end) = ((middle - half).max(0.0), middle + half);
        for _ in 0..512 {
            let free = self.distance(origin + ahead * along);
            if free < 1e-7 {
                // A ray that starts on the surface leaves it.
                return (along > 1e-4).then_some(along);
            }
            along += free;
            if along > end {
                return None;
            }
        }
        None
    }

    /// From a point to the surface, negative inside.
    pub(super) fn distance(&self, at: DVec3) -> f64 {
        match *self {
            Self::Ball { radius } => at.length() - radius,
            Self::Box { half } => {
                let outside = at.abs() - half;
                outside.max(DVec3::ZERO).length() + outside.max_element().min(0.0)
            }
            Self::Capsule { half, radius } => (at - nearest_on_axis(at, half)).length() - radius,
            Self::Ring { radius, thickness } => {
                DVec2::new(DVec2::new(at.x, at.z).length() - radius, at.y).length() - thickness
            }
            Self::Disc { radius } => {
                let beyond = (DVec2::new(at.x, at.z).length() - radius).max(0.0);
                DVec2::new(beyond, at.y).length()
            }
        }
    }

    /// The direction out of the surface at a point of it; of a disc, against y.
    pub(super) fn normal(&self, at: DVec3) -> DVec3 {
        let out = match *self {
            Self::Ball { .. } => at,
            Self::Box { half } => {
                let share = at / half;
                let most = share.abs().max_element();
                DVec3::select(share.abs().cmpge(DVec3::splat(most)), share, DVec3::ZERO)
            }
            Self::Capsule { half, .. } => at - nearest_on_axis(at, half),
            Self::Ring { radius, .. } => {
                let flat = DVec3::new(at.x, 0.0, at.z);
                at - flat.normalize_or(DVec3::X) * radius
            }
            Self::Disc { .. } => DVec3::NEG_Y,
        };
        out.normalize_or(DVec3::NEG_Y)
    }
}

fn nearest_on_axis(at: DVec3, half: f64) -> DVec3 {
    DVec3::new(0.0, at.y.clamp(-half, half), 0.0)
}

/// The smaller root of a·t² + 2·b·t + c that lies ahead, or the larger one from inside.
fn first_root(a: f64, b: f64, c: f64) -> Option<f64> {
    let square = b * b - a * c;
    if square <= 0.0 || a == 0.0 {
        return None;
    }
    let root = square.sqrt();
    [(-b - root) / a, (-b + root) / a].into_iter().find(|along| *along > NEAR)
}

fn ball(origin: DVec3, ahead: DVec3, radius: f64) -> Option<f64> {
    first_root(1.0, origin.dot(ahead), origin.length_squared() - radius * radius)
}

fn box_(origin: DVec3, ahead: DVec3, half: DVec3) -> Option<f64> {
    let inverse = ahead.recip();
    let (a, b) = ((-half - origin) * inverse, (half - origin) * inverse);
    let (enters, leaves) = (a.min(b).max_element(), a.max(b).min_element());
    let along = if enters > NEAR { enters } else { leaves };
    (enters <= leaves && along > NEAR).then_some(along)
}

fn capsule(origin: DVec3, ahead: DVec3, half: f64, radius: f64) -> Option<f64> {
    let a = 1.0 - ahead.y * ahead.y;
    let b = origin.dot(ahead) - origin.y * ahead.y;
    let c = origin.length_squared() - origin.y * origin.y - radius * radius;
    let side = first_root(a, b, c).filter(|along| (origin.y + along * ahead.y).abs() <= half);
    let end = |y: f64| ball(origin - DVec3::new(0.0, y, 0.0), ahead, radius);
    let beyond = |along: &f64, y: f64| (origin.y + along * ahead.y) * y.signum() >= half;
    let ends = [half, -half].map(|y| end(y).filter(|along| beyond(along, y)));
    [side, ends[0], ends[1]].into_iter().flatten().min_by(f64::total_cmp)
}

#[cfg(test)]
mod tests {
    use super::*;
    use splatstream_gaussians::random::SplitMix64;

    #[test]
    fn rays_meet_surfaces_where_the_distance_is_0_and_no_sooner() {
        let shapes = [
            Shape::Ball { radius: 0.7 },
            Shape::Box { half: DVec3::new(0.3, 0.5, 0.4) },
            Shape::Capsule { half: 0.5, radius: 0.25 },
            Shape::Ring { radius: 0.6, thickness: 0.2 },
            Shape::Disc { radius: 0.8 },
        ];
        let mut random = SplitMix64::new(5);
        for shape in shapes {
            let mut met = 0;
            for _ in 0..400 {
                let mut any = || DVec3::from([(); 3].map(|()| f64::from(random.signed())));
                let (origin, aim) = (any() * 4.0, any() * 0.6);
                if shape.distance(origin) < 0.1 {
                    continue;
                }
                let ahead = (aim - origin).normalize();
                let end = shape.meets(origin, ahead).unwrap_or(10.0);
                for step in 0..200 {
                    let free = shape.distance(origin + ahead * (end * f64::from(step) / 200.0));
                    assert!(free > -1e-6, "{shape:?} {origin} {ahead} {end} {free}");
                }
                if end < 10.0 {
                    met += 1;
                    let at = origin + ahead * end;
                    assert!(shape.distance(at).abs() < 1e-5, "{shape:?} {}", shape.distance(at));
                    let out = shape.normal(at);
                    let out = if out.dot(ahead) > 0.0 { -out } else { out };
                    assert!(shape.distance(at + out * 1e-3) > 5e-4, "{shape:?}");
                }
            }
            assert!(met > 50, "{shape:?} {met}");
        }
    }
}
