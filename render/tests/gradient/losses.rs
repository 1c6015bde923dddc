//! Losses of pictures against the definition in 64 bits and its differences.

use crate::scenes::{camera, random};
use proptest::prelude::*;
use splatstream_gaussians::random::SplitMix64;
use splatstream_render::gradient::{GradientError, Gradients, Loss, MultiResolution, Resolution};
use splatstream_render::metrics::ssim;
use splatstream_render::{Image, PreparedFrame, render};

/// A picture of smooth shapes with some noise, from a seed; a few values outside 0..1.
fn picture(seed: u64, width: usize, height: usize) -> Image {
    let mut random = SplitMix64::new(seed);
    let waves: Vec<[f32; 4]> = (0..6).map(|_| [(); 4].map(|()| random.signed())).collect();
    let pixel = |place: usize| {
        let (x, y) = ((place % width) as f32, (place / width) as f32);
        [0, 1, 2].map(|channel: usize| {
            let [a, b, c, d] = waves[channel];
            0.5 + 0.4 * (0.5 * a * x + 0.5 * b * y + 6.0 * c).sin() * d + 0.1 * random.signed()
        })
    };
    Image::new(width, (0..width * height).map(pixel).collect())
}

/// Means of L1 and of SSIM, pixel by pixel from the definition.
fn by_definition(reference: &[[f64; 3]], picture: &[[f64; 3]], width: usize) -> [f64; 2] {
    let height = reference.len() / width;
    let bell = |distance: i64| (-0.5 * (distance as f64 / 1.5).powi(2)).exp();
    let total: f64 = (-5..=5).map(bell).sum();
    let at = |x: i64, y: i64| {
        let inside = (0..width as i64).contains(&x) && (0..height as i64).contains(&y);
        inside.then(|| y as usize * width + x as usize)
    };
    let (mut l1, mut similarity) = (0.0, 0.0);
    for place in 0..reference.len() {
        for channel in 0..3 {
            l1 += (reference[place][channel] - picture[place][channel]).abs();
            let mut means = [0.0; 5];
            for (dy, dx) in (-5..=5).flat_map(|dy| (-5..=5).map(move |dx| (dy, dx))) {
                let Some(other) = at((place % width) as i64 + dx, (place / width) as i64 + dy) else {
                    continue;
                };
                let weight = bell(dx) * bell(dy) / total / total;
                let (a, b) = (reference[other][channel], picture[other][channel]);
                for (mean, value) in means.iter_mut().zip([a, b, a * a, b * b, a * b]) {
                    *mean += weight * value;
                }
            }
            let [a, b, aa, bb, ab] = means;
            let luminance = (2.0 * a * b + 1e-4) / (a * a + b * b + 1e-4);
            similarity += luminance * (2.0 * (ab - a * b) + 9e-4) / (aa - a * a + bb - b * b + 9e-4);
        }
    }
    [l1, similarity].map(|sum| sum / (3 * reference.len()) as f64)
}

fn wide(image: &Image) -> Vec<[f64; 3]> {
    image.pixels().iter().map(|pixel| pixel.map(f64::from)).collect()
}

/// Compares value and slopes with the definition.
fn check(reference: &Image, picture: &Image, beta: f32) {
    let judged = Loss { similarity: beta }.between(reference, picture).unwrap();
    let width = picture.width();
    let (a, mut b) = (wide(reference), wide(picture));
    let beta = f64::from(beta);
    let of = |[l1, similarity]: [f64; 2]| (1.0 - beta) * l1 + beta * (1.0 - similarity);
    let [l1, similarity] = by_definition(&a, &b, width);
    assert!((judged.l1 - l1).abs() < 1e-6 && (judged.ssim - similarity).abs() < 1e-5, "{judged:?}");
    assert!((judged.value - of([l1, similarity])).abs() < 1e-5);
    let largest = judged.slopes.pixels().iter().flatten().fold(0.0_f32, |most, slope| most.max(slope.abs()));
    for place in 0..b.len() {
        let channel = place % 3;
        let value = b[place][channel];
        let mut moved = |step: f64| {
            b[place][channel] = value + step;
            let loss = of(by_definition(&a, &b, width));
            b[place][channel] = value;
            loss
        };
        let difference = (moved(1e-6) - moved(-1e-6)) / 2e-6;
        let slope = f64::from(judged.slopes.pixels()[place][channel]);
        let error = (slope - difference).abs();
        assert!(error < 1e-4 * f64::from(largest), "{place}: {slope:e} {difference:e}");
    }
}

#[test]
fn values_and_slopes_are_those_of_the_definition() {
    // Smaller than the window, as wide as it, larger.
    for (seed, [width, height]) in (0..).zip([[1, 1], [3, 2], [11, 7], [17, 13]]) {
        for beta in [0.0, 0.2, 1.0] {
            check(&picture(seed, width, height), &picture(seed + 50, width, height), beta);
        }
    }
}

#[test]
fn bands_join_without_a_seam() {
    // Pictures of one column, so that the definition takes no time over 300 lines.
    check(&picture(7, 1, 300), &picture(8, 1, 300), 0.5);
}

#[test]
fn inside_a_picture_similarity_is_that_of_the_metric() {
    let (width, height) = (48, 40);
    let [reference, picture] = [3, 4].map(|seed| {
        // What a black border hides is equal in both.
        let inner = picture(seed, width, height);
        let in_middle = |place: usize| {
            (10..width - 10).contains(&(place % width)) && (10..height - 10).contains(&(place / width))
        };
        let pixels = inner.pixels().iter().enumerate();
        let black = |(place, pixel): (usize, &[f32; 3])| {
            if in_middle(place) { pixel.map(|v| v.clamp(0.0, 1.0)) } else { [0.0; 3] }
        };
        Image::new(width, pixels.map(black).collect())
    });
    let judged = Loss::default().between(&reference, &picture).unwrap();
    // The metric has no value at 5 pixels on each side, where similarity here is 1.
    let (all, measured) = ((width * height) as f64, ((width - 10) * (height - 10)) as f64);
    let expected = (ssim(&reference, &picture).unwrap() * measured + all - measured) / all;
    assert!((judged.ssim - expected).abs() < 1e-5, "{} {expected}", judged.ssim);
}

#[test]
fn pictures_of_other_sizes_and_gradients_of_other_frames_are_errors() {
    let (one, other) = (picture(1, 4, 4), picture(1, 8, 2));
    assert_eq!(Loss::default().between(&one, &other), Err(GradientError::Size([8, 2], [4, 4])));
    let (frame, fewer) = (random(1, 5, 1, false), random(1, 4, 0, false));
    let (prepared, camera) = (PreparedFrame::new(&frame), camera(8, 2));
    let drawing = prepared.draw(&camera, [0.0; 3]);
    let mut gradients = Gradients::zero(&fewer);
    assert_eq!(drawing.backward(&other, &mut gradients), Err(GradientError::Frame(4, 0, 5, 1)));
    assert_eq!(drawing.backward(&one, &mut gradients), Err(GradientError::Size([4, 4], [8, 2])));
    assert_eq!(gradients, Gradients::zero(&fewer));
    let loss =
        MultiResolution { resolutions: vec![Resolution { lines: 3, weight: 1.0 }], loss: Loss::default() };
    assert_eq!(loss.targets(&camera, &other), Err(GradientError::Resolutions(2)));
    assert_eq!(loss.targets(&camera, &one), Err(GradientError::Size([4, 4], [8, 2])));
}

#[test]
fn the_multi_resolution_loss_is_the_weighted_sum_of_its_pictures() {
    let (frame, other) = (random(5, 30, 1, true), random(5, 28, 1, true));
    let camera = camera(96, 72);
    let reference = render(&other, &camera, [0.0; 3]).colour;
    let resolution = |(lines, weight)| Resolution { lines, weight };
    let resolutions = [(36, 0.5), (48, 0.3), (72, 0.2), (1080, 9.0)].map(resolution).to_vec();
    let loss = MultiResolution { resolutions, loss: Loss { similarity: 0.4 } };
    let targets = loss.targets(&camera, &reference).unwrap();
    let sizes: Vec<[usize; 2]> =
        targets.iter().map(|target| [target.picture.width(), target.picture.height()]).collect();
    assert_eq!(sizes, [[48, 36], [64, 48], [96, 72]], "the picture has no 1080 lines");
    assert_eq!(targets[2].picture, reference);

    let prepared = PreparedFrame::new(&frame);
    let mut gradients = Gradients::zero(&frame);
    let value = loss.add(&prepared, [0.0; 3], &targets, &mut gradients).unwrap();
    let mut expected = 0.0;
    let mut sum = vec![0.0; frame.len()];
    for target in &targets {
        let drawing = prepared.draw(&target.camera, [0.0; 3]);
        let judged = loss.loss.between(&target.picture, &drawing.rendering().colour).unwrap();
        let mut own = Gradients::zero(&frame);
        drawing.backward(&judged.slopes, &mut own).unwrap();
        expected += f64::from(target.weight) * judged.value;
        sum.iter_mut()
            .zip(&own.planes().opacity_logit)
            .for_each(|(sum, slope)| *sum += target.weight * slope);
    }
    assert!((value - expected).abs() < 1e-12);
    let largest = sum.iter().fold(0.0_f32, |most, slope| most.max(slope.abs()));
    for (sum, slope) in sum.iter().zip(&gradients.planes().opacity_logit) {
        assert!((sum - slope).abs() < 1e-5 * largest, "{sum} {slope}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn equal_pictures_have_no_loss_and_no_slope(seed: u64, width in 1_usize..30, height in 1_usize..30) {
        let picture = picture(seed, width, height);
        let judged = Loss { similarity: 0.0 }.between(&picture, &picture).unwrap();
        prop_assert_eq!(judged.value, 0.0);
        prop_assert!(judged.slopes.pixels().iter().flatten().all(|&slope| slope == 0.0));
        let judged = Loss { similarity: 1.0 }.between(&picture, &picture).unwrap();
        prop_assert!(judged.value.abs() < 1e-6);
        prop_assert!(judged.slopes.pixels().iter().flatten().all(|&slope| slope == 0.0));
    }
}
