//! Steps of Adam against the algorithm in 64 bits, and what holds for Gaussians that come, go and hide.

use crate::scenes::{camera, random};
use splatstream_gaussians::GaussianFrame;
use splatstream_gaussians::random::SplitMix64;
use splatstream_render::gradient::{Adam, GradientError, Gradients, Loss, Rates};
use splatstream_render::{Image, PreparedFrame, render};

/// Rates that differ, so that none is taken for another.
const RATES: Rates =
    Rates { position: 0.01, log_scale: 0.02, rotation: 0.03, opacity_logit: 0.04, dc: 0.05, sh: 0.06 };

/// The rate of each plane of degree 1.
fn of_planes() -> Vec<f64> {
    let each = [(0.01_f32, 3), (0.02, 3), (0.03, 4), (0.04, 1), (0.05, 3), (0.06, 9)];
    each.iter().flat_map(|&(rate, planes)| vec![f64::from(rate); planes]).collect()
}

/// The slopes of random pixels; `shown` Gaussians are in the picture, the others behind the camera.
fn slopes_of(frame: &GaussianFrame, seed: u64) -> Gradients {
    let camera = camera(40, 30);
    let mut random = SplitMix64::new(seed);
    let slopes = (0..40 * 30).map(|_| [(); 3].map(|()| random.signed())).collect();
    let mut gradients = Gradients::zero(frame);
    let prepared = PreparedFrame::new(frame);
    prepared.draw(&camera, [0.3; 3]).backward(&Image::new(40, slopes), &mut gradients).unwrap();
    gradients
}

fn values(frame: &GaussianFrame) -> Vec<Vec<f32>> {
    frame.planes().iter().cloned().collect()
}

#[test]
fn steps_are_those_of_the_algorithm() {
    let mut frame = random(1, 40, 1, false);
    let mut expected: Vec<Vec<f64>> =
        values(&frame).iter().map(|plane| plane.iter().map(|&value| f64::from(value)).collect()).collect();
    let mut means = vec![vec![[0.0_f64; 2]; 40]; expected.len()];
    let mut steps = [0; 40];
    let mut adam = Adam::new(&frame);
    for seed in 0..12 {
        let gradients = slopes_of(&frame, seed);
        let slopes: Vec<_> = gradients.planes().iter().collect();
        for row in 0..40 {
            if slopes.iter().all(|plane| plane[row] == 0.0) {
                continue;
            }
            steps[row] += 1;
            for (plane, rate) in of_planes().into_iter().enumerate() {
                let (slope, mean) = (f64::from(slopes[plane][row]), &mut means[plane][row]);
                mean[0] = 0.9 * mean[0] + 0.1 * slope;
                mean[1] = 0.999 * mean[1] + 0.001 * slope * slope;
                let unbiased = [
                    mean[0] / (1.0 - 0.9_f64.powi(steps[row])),
                    mean[1] / (1.0 - 0.999_f64.powi(steps[row])),
                ];
                expected[plane][row] -= rate * unbiased[0] / (unbiased[1].sqrt() + 1e-15);
            }
        }
        adam.step(&mut frame, &gradients, &RATES).unwrap();
    }
    assert!(steps.contains(&12), "{steps:?}");
    for (plane, expected) in values(&frame).iter().zip(&expected) {
        for (value, expected) in plane.iter().zip(expected) {
            assert!((f64::from(*value) - expected).abs() < 2e-4, "{value} {expected}");
        }
    }
}

#[test]
fn what_is_held_goes_back_towards_its_anchor_but_not_past_it() {
    let anchor = random(7, 40, 1, false);
    let (hold, rates) = (0.4, of_planes());
    let (mut held, mut adam) = (anchor.clone(), Adam::new(&anchor));
    let (mut still, mut moved) = (0, 0);
    for seed in 0..12 {
        let gradients = slopes_of(&held, seed);
        let (mut free, mut freely) = (held.clone(), adam.clone());
        freely.step(&mut free, &gradients, &RATES).unwrap();
        adam.step_held(&mut held, &gradients, &RATES, (&anchor, hold)).unwrap();
        assert!(adam == freely, "the means are those of a step that is not held");
        for (plane, rate) in rates.iter().enumerate() {
            for row in 0..40 {
                let [anchor, free, held] =
                    [&anchor, &free, &held].map(|frame| f64::from(values(frame)[plane][row]));
                let expected =
                    anchor + (free - anchor).signum() * ((free - anchor).abs() - 0.4 * rate).max(0.0);
                let stays = gradients.planes().iter().all(|plane| plane[row] == 0.0);
                assert!((held - expected).abs() < 1e-6 || stays, "{anchor} {free} {held} {expected}");
                if held == anchor { still += 1 } else { moved += 1 }
            }
        }
    }
    assert!(still > 1000 && moved > 1000, "{still} {moved}");
    // Not held at all, a step is a step.
    let gradients = slopes_of(&held, 99);
    let (mut free, mut freely) = (held.clone(), adam.clone());
    freely.step(&mut free, &gradients, &RATES).unwrap();
    adam.step_held(&mut held, &gradients, &RATES, (&anchor, 0.0)).unwrap();
    assert_eq!(values(&held), values(&free));
    let other = anchor.select(&[0, 1]);
    assert!(adam.step_held(&mut held, &gradients, &RATES, (&other, 0.5)).is_err());
}

#[test]
fn any_number_of_threads_takes_the_same_steps() {
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut frame = random(3, 10_000, 1, true);
            let mut adam = Adam::new(&frame);
            for seed in 0..3 {
                let gradients = slopes_of(&frame, seed);
                adam.step(&mut frame, &gradients, &RATES).unwrap();
            }
            frame.planes().iter().flatten().map(|value| value.to_bits()).collect::<Vec<_>>()
        })
    };
    let one = with(1);
    for threads in [2, 3, 8] {
        assert!(one == with(threads), "{threads} threads");
    }
}

#[test]
fn what_has_no_slope_neither_moves_nor_counts() {
    let shown = random(5, 6, 1, false);
    let mut hidden = shown.clone();
    hidden.planes_mut().position[2][..3].fill(-5.0);
    let mut adam = Adam::new(&shown);
    let mut frame = hidden.clone();
    for seed in 0..4 {
        let gradients = slopes_of(&frame, seed);
        adam.step(&mut frame, &gradients, &RATES).unwrap();
    }
    for (before, after) in values(&hidden).iter().zip(values(&frame)) {
        assert_eq!(before[..3], after[..3]);
        assert_ne!(before[3..], after[3..]);
    }
    // Then they come into sight, and step as new ones do.
    let seen = frame.select(&[0, 1, 2]);
    let mut seen = {
        let mut seen = seen;
        seen.planes_mut().position[2].copy_from_slice(&shown.position()[2][..3]);
        seen
    };
    let gradients = slopes_of(&seen, 9);
    let mut fresh = seen.clone();
    adam.select(&[0, 1, 2]);
    adam.step(&mut seen, &gradients, &RATES).unwrap();
    Adam::new(&fresh).step(&mut fresh, &gradients, &RATES).unwrap();
    assert_eq!(seen, fresh);
}

#[test]
fn a_slope_that_is_not_finite_moves_nothing_of_its_gaussian() {
    let mut frame = random(5, 6, 1, false);
    let before = frame.clone();
    let mut gradients = slopes_of(&frame, 1).into_planes();
    gradients.dc[1][2] = f32::NAN;
    gradients.position[0][3] = f32::INFINITY;
    let gradients = Gradients::from_planes(1, gradients).unwrap();
    Adam::new(&frame).step(&mut frame, &gradients, &RATES).unwrap();
    assert_eq!(before.select(&[2, 3]), frame.select(&[2, 3]));
    assert!(frame.planes().iter().flatten().all(|value| value.is_finite()));
    assert_ne!(before.dc()[0][0], frame.dc()[0][0]);
}

#[test]
fn gaussians_that_stay_keep_their_means_and_new_ones_start_at_zero() {
    let frame = random(7, 5, 1, false);
    let mut all = frame.clone();
    let mut adam = Adam::new(&all);
    let first = slopes_of(&all, 1);
    adam.step(&mut all, &first, &RATES).unwrap();

    // Rows 4 and 1 stay, and a copy of row 0 comes new.
    let mut some = all.select(&[4, 1, 0]);
    let mut of_some = adam.clone();
    of_some.select(&[4, 1]);
    of_some.grow(1);
    let second = slopes_of(&some, 2);
    let mut picked = all.select(&[4, 1, 0]);
    let mut of_picked = adam;
    of_picked.select(&[4, 1, 0]);
    of_some.step(&mut some, &second, &RATES).unwrap();
    of_picked.step(&mut picked, &second, &RATES).unwrap();
    assert_eq!(some.select(&[0, 1]), picked.select(&[0, 1]));
    assert_ne!(some.select(&[2]), picked.select(&[2]));
    let mut alone = all.select(&[4, 1, 0]);
    Adam::new(&alone).step(&mut alone, &second, &RATES).unwrap();
    assert_eq!(some.select(&[2]), alone.select(&[2]));
}

#[test]
fn a_higher_degree_starts_at_rest_and_then_moves() {
    let low = random(8, 10, 0, false);
    let mut adam = Adam::new(&low);
    let mut planes = low.clone().into_planes();
    planes.sh = vec![vec![0.0; low.len()]; 9];
    let mut high = GaussianFrame::from_planes(1, planes).unwrap();
    let gradients = slopes_of(&high, 1);
    let wrong = adam.clone().step(&mut high, &gradients, &RATES);
    assert_eq!(wrong, Err(GradientError::Frame(10, 0, 10, 1)));
    adam.raise_sh_degree(1);
    assert_eq!(adam, Adam::new(&high));
    adam.step(&mut high, &gradients, &RATES).unwrap();
    assert!(high.sh().iter().flatten().any(|&value| value != 0.0));
}

#[test]
fn a_picture_is_found_again() {
    let camera = camera(64, 48);
    let reference = render(&random(6, 60, 1, true), &camera, [0.0; 3]).colour;
    let mut frame = random(7, 60, 1, true);
    let mut adam = Adam::new(&frame);
    let mut losses = Vec::new();
    for _ in 0..150 {
        let prepared = PreparedFrame::new(&frame);
        let drawing = prepared.draw(&camera, [0.0; 3]);
        let judged = Loss::default().between(&reference, &drawing.rendering().colour).unwrap();
        losses.push(judged.value);
        let mut gradients = Gradients::zero(&frame);
        drawing.backward(&judged.slopes, &mut gradients).unwrap();
        adam.step(&mut frame, &gradients, &RATES).unwrap();
        frame = frame.with_unit_rotations();
    }
    let [first, last] = [losses[0], losses[149]];
    assert!(last < 0.25 * first, "{first} {last}");
}
