//! The same surface trained anew: nearly the same, and never Gaussian for Gaussian.

use glam::DVec3;

use super::gaussian::Gaussian;
use super::random::Random;
use super::surface::turn_about;

const MISSING: f64 = 0.03;
const SPLIT: f64 = 0.03;
/// How much smaller the halves of a split Gaussian are, as a log: 1.6 times, as training does it.
const SPLIT_SHRINK: f64 = 0.47;

/// What becomes of a Gaussian in another training: itself with other noise, nothing, or two halves.
pub(super) fn again(gaussian: Gaussian, random: &mut Random) -> Vec<Gaussian> {
    let fate = random.unit();
    if fate < MISSING {
        return Vec::new();
    }
    let jittered = jitter(gaussian, random);
    if fate < MISSING + SPLIT { split(&jittered).into() } else { vec![jittered] }
}

/// Moves it within its own ellipsoid, turns it a little and changes every value a little.
fn jitter(mut gaussian: Gaussian, random: &mut Random) -> Gaussian {
    let scale = gaussian.log_scale.map(libm::exp);
    let within = DVec3::from_array(scale.map(|scale| 0.3 * scale * random.normal()));
    gaussian.position += gaussian.rotation * within;
    // Turned about each of its own axes in turn.
    for axis in DVec3::AXES {
        gaussian.rotation *= turn_about(axis, 0.05 * random.normal());
    }
    gaussian.log_scale = gaussian.log_scale.map(|scale| scale + 0.12 * random.normal());
    gaussian.opacity_logit += 0.25 * random.normal();
    gaussian.dc = gaussian.dc.map(|value| value + 0.04 * random.normal());
    gaussian.sh = gaussian.sh.map(|value| value + 0.008 * random.normal());
    gaussian
}

/// Two smaller Gaussians side by side along the longest axis.
fn split(whole: &Gaussian) -> [Gaussian; 2] {
    let longest = (0..3).max_by(|&a, &b| whole.log_scale[a].total_cmp(&whole.log_scale[b])).unwrap_or(0);
    let half = 0.6 * libm::exp(whole.log_scale[longest]);
    let offset = whole.rotation * (DVec3::AXES[longest] * half);
    [-1.0, 1.0].map(|side| {
        let mut part = whole.clone();
        part.position += side * offset;
        part.log_scale[longest] -= SPLIT_SHRINK;
        part
    })
}
