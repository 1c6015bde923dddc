//! Sequences that predicted frames do not fit.

use super::base::Base;
use super::dice::Dice;
use super::edits::{Place, edited, fewer, moved, shuffled, thinned, with_degree, zoomed};
use super::sample::Sample;
use splatstream_gaussians::GaussianFrame;

/// Gaussians of each frame of a long chain, at most.
const CHAIN: usize = 200;

/// The sequence as it is.
pub(super) fn plain(base: &Base) -> Sample {
    Sample::plain(base.frames.clone())
}

/// Each frame by its number.
fn frames(base: &Base, frame: impl Fn(usize) -> GaussianFrame) -> Vec<GaussianFrame> {
    (0..base.len()).map(frame).collect()
}

/// Every second frame with spherical harmonics, the others without.
pub(super) fn mixed_degrees(base: &Base, degree: f64) -> Sample {
    let degree_of = |number: usize| if number.is_multiple_of(2) { degree as u8 } else { 0 };
    Sample::plain(frames(base, |number| with_degree(&base.frame(number), degree_of(number))))
}

/// Every second frame with fewer Gaussians.
pub(super) fn counts(base: &Base, factor: f64) -> Sample {
    let frame = |number: usize| {
        let frame = base.frame(number);
        let most =
            if number.is_multiple_of(2) { frame.len() } else { (frame.len() as f64 / factor) as usize };
        fewer(&frame, most)
    };
    Sample::of(frames(base, frame), base.frames.clone())
}

/// So many cuts between two scenes, evenly over the sequence.
pub(super) fn cuts(base: &Base, cuts: f64) -> Sample {
    let parts = (cuts as usize).min(base.len().saturating_sub(1)) + 1;
    let part = |number: usize| number * parts / base.len().max(1);
    let frame = |number: usize| {
        if part(number).is_multiple_of(2) { base.frame(number) } else { base.other(number) }
    };
    Sample::plain(frames(base, |number| shuffled(&frame(number), number as u64)))
}

/// Everything moves by a share of the scene's width from frame to frame, and no row keeps its meaning.
pub(super) fn motion(base: &Base, share: f64) -> Sample {
    let width = Place::of(&base.frame(0)).width;
    let frame = |number: usize| moved(&base.frame(number), (share * number as f64) as f32 * width);
    Sample::plain(frames(base, |number| shuffled(&frame(number), number as u64)))
}

/// A share of the scene alternates between two states.
pub(super) fn alternating(base: &Base, share: f64) -> Sample {
    let frame = |number: usize| {
        let (frame, other) = (base.frame(0), base.other(0));
        if number.is_multiple_of(2) {
            return frame;
        }
        edited(&frame, |planes| {
            for row in Dice::new(6).some(frame.len(), share) {
                planes.position[0][row] = other.position()[0][row];
                planes.dc.iter_mut().zip(other.dc()).for_each(|(plane, other)| plane[row] = other[row]);
            }
        })
    };
    Sample::plain(frames(base, |number| shuffled(&frame(number), number as u64)))
}

/// Noise on every attribute, new in each frame, as a share of the attribute's deviation.
pub(super) fn noise(base: &Base, share: f64) -> Sample {
    Sample::plain(frames(base, |number| noisy(&base.frame(number), share, number as u64)))
}

fn noisy(frame: &GaussianFrame, share: f64, seed: u64) -> GaussianFrame {
    let mut dice = Dice::new(seed);
    edited(frame, |planes| {
        let plain = planes.position.iter_mut().chain(&mut planes.log_scale).chain(&mut planes.dc);
        for plane in
            plain.chain([&mut planes.opacity_logit]).chain(&mut planes.sh).chain(&mut planes.rotation)
        {
            let deviation = share * deviation(plane);
            plane.iter_mut().for_each(|value| *value += (deviation * dice.normal()) as f32);
        }
        for row in 0..frame.len() {
            let parts = planes.rotation.each_ref().map(|plane| plane[row]);
            let length = parts.iter().map(|part| part * part).sum::<f32>().sqrt();
            if length > 0.0 {
                planes.rotation.iter_mut().for_each(|plane| plane[row] /= length);
            }
        }
    })
}

fn deviation(plane: &[f32]) -> f64 {
    let count = plane.len().max(1) as f64;
    let mean = plane.iter().map(|&value| f64::from(value)).sum::<f64>() / count;
    let squares: f64 = plane.iter().map(|&value| (f64::from(value) - mean) * (f64::from(value) - mean)).sum();
    (squares / count).sqrt()
}

/// Everything grows from frame to frame; the cameras step back as much.
pub(super) fn zoom(base: &Base, factor: f64) -> Sample {
    let middle = Place::of(&base.frame(0)).middle;
    let frame = |number: usize| zoomed(&base.frame(number), middle, libm::pow(factor, number as f64));
    Sample::plain(frames(base, |number| shuffled(&frame(number), number as u64)))
}

/// The scene loses a share of its opacity, evenly over the sequence.
pub(super) fn fade(base: &Base, share: f64) -> Sample {
    let last = base.len().saturating_sub(1).max(1) as f64;
    let frame = |number: usize| {
        let left = 1.0 - share * number as f64 / last;
        edited(&base.frame(number), |planes| {
            planes.opacity_logit.iter_mut().for_each(|logit| *logit = dimmed(*logit, left));
        })
    };
    Sample::plain(frames(base, frame))
}

/// An opacity times a factor, before the sigmoid.
fn dimmed(logit: f32, factor: f64) -> f32 {
    let opacity = factor / (1.0 + libm::exp(-f64::from(logit)));
    let opacity = opacity.clamp(1e-12, 1.0 - 1e-12);
    libm::log(opacity / (1.0 - opacity)) as f32
}

/// So many frames in one GOP, each predicted from the one before; the last is judged.
pub(super) fn chain(base: &Base, length: f64) -> Sample {
    let length = (length as usize).max(1);
    let frames = (0..length).map(|number| thinned(&base.frame(number), CHAIN)).collect();
    Sample::plain(frames).judging(length - 1..length).chained()
}

/// The last frame is far larger than all others, which are judged.
pub(super) fn far_last(base: &Base, factor: f64) -> Sample {
    let last = base.len().saturating_sub(1);
    let frame = |number: usize| {
        let frame = base.frame(number);
        if number == last { zoomed(&frame, Place::of(&frame).middle, factor) } else { frame }
    };
    Sample::plain(frames(base, frame)).judging(0..last)
}

#[cfg(test)]
mod tests {
    use super::super::base::{Size, builtin};
    use super::*;

    #[test]
    fn every_case_is_a_sequence_that_files_could_hold() {
        let base = Base::new(&builtin(Size::Quick), Size::Quick);
        let samples = [
            mixed_degrees(&base, 3.0),
            counts(&base, 10.0),
            cuts(&base, 7.0),
            motion(&base, 0.3),
            alternating(&base, 1.0),
            noise(&base, 0.3),
            zoom(&base, 1.5),
            fade(&base, 1.0),
            chain(&base, 9.0),
            far_last(&base, 1e4),
        ];
        for sample in &samples {
            assert!(sample.frames.iter().all(|frame| frame.validate().is_ok()));
        }
        let lengths = samples.each_ref().map(|sample| sample.frames.len());
        assert_eq!(lengths, [4, 4, 4, 4, 4, 4, 4, 4, 9, 4]);
    }

    #[test]
    fn an_opacity_fades_to_nothing() {
        assert!((dimmed(0.0, 0.5) - libm::logf(1.0 / 3.0)).abs() < 1e-6);
        assert!(dimmed(5.0, 0.0) < -20.0);
    }
}
