//! What Gaussians give to pictures, and what pictures lose without them.

use crate::gaussian::{BALL, Gaussian, any_gaussian, any_gaussians, camera, frame};
use proptest::prelude::*;
use rayon::ThreadPoolBuilder;
use splatstream_files::builtin::BuiltinScene;
use splatstream_render::contribution::{contribution, removal};
use splatstream_render::render;

const BLACK: [f32; 3] = [0.0; 3];

fn all_but(frame: &splatstream_gaussians::GaussianFrame, row: u32) -> splatstream_gaussians::GaussianFrame {
    let others: Vec<u32> = (0..frame.len() as u32).filter(|&other| other != row).collect();
    frame.select(&others)
}

/// Squared difference of all channels of two pictures.
fn squared_difference(a: &splatstream_render::Image, b: &splatstream_render::Image) -> f64 {
    let pairs = a.pixels().iter().flatten().zip(b.pixels().iter().flatten());
    pairs.map(|(a, b)| f64::from(a - b).powi(2)).sum()
}

proptest! {
    #[test]
    fn contributions_add_up_to_the_alpha_of_the_pictures(gaussians in any_gaussians()) {
        let frame = frame(&gaussians);
        let cameras = [camera(40, 30, 40.0), camera(33, 17, 20.0)];
        let sum: f64 = contribution(&frame, &cameras).iter().sum();
        let alpha = |camera| render(&frame, camera, BLACK).alpha.into_iter().map(f64::from).sum::<f64>();
        let expected: f64 = cameras.iter().map(alpha).sum();
        prop_assert!((sum - expected).abs() <= 1e-5 * expected + 1e-3, "{} {}", sum, expected);
    }

    #[test]
    fn without_a_lone_gaussian_its_picture_is_lost(gaussian in any_gaussian()) {
        let (frame, camera) = (frame(&[gaussian]), camera(40, 30, 40.0));
        let picture = render(&frame, &camera, BLACK).colour;
        let energy: f64 = picture.pixels().iter().flatten().map(|&value| f64::from(value).powi(2)).sum();
        let lost = removal(&frame, std::slice::from_ref(&camera))[0];
        prop_assert!((lost - energy).abs() <= 1e-4 * energy, "{} {}", lost, energy);
    }

    #[test]
    fn what_is_lost_is_the_difference_to_a_picture_without(gaussians in any_gaussians()) {
        // Too little to end a pixel: there, what would come next is not known.
        let mut gaussians: Vec<Gaussian> = gaussians.into_iter().take(12).collect();
        for gaussian in &mut gaussians {
            gaussian.opacity_logit = gaussian.opacity_logit.min(0.0);
        }
        let (frame, camera) = (frame(&gaussians), camera(40, 30, 40.0));
        let picture = render(&frame, &camera, BLACK).colour;
        let losses = removal(&frame, std::slice::from_ref(&camera));
        for (row, lost) in (0..).zip(losses) {
            let without = render(&all_but(&frame, row), &camera, BLACK).colour;
            let expected = squared_difference(&picture, &without);
            prop_assert!((lost - expected).abs() <= 1e-3 * expected + 1e-6, "{}: {} {}", row, lost, expected);
        }
    }
}

#[test]
fn many_gaussians_on_one_tile_are_measured_as_few_are() {
    // Faint, so that no pixel ends, and each on all lines of the only tile, so that these are more than are kept.
    let faint = |number: u32| {
        let position = [0.0, 0.0, 2.0 + number as f32 / 1000.0];
        Gaussian { position, log_scale: [1.0; 3], opacity_logit: -5.3, ..BALL }
    };
    let gaussians: Vec<Gaussian> = (0..1500).map(faint).collect();
    let (frame, camera) = (frame(&gaussians), camera(16, 16, 40.0));
    let picture = render(&frame, &camera, BLACK);
    let sum: f64 = contribution(&frame, std::slice::from_ref(&camera)).iter().sum();
    let alpha: f64 = picture.alpha.iter().copied().map(f64::from).sum();
    assert!((sum - alpha).abs() <= 1e-5 * alpha, "{sum} {alpha}");
    let losses = removal(&frame, std::slice::from_ref(&camera));
    for row in [0, 700, 1499] {
        let without = render(&all_but(&frame, row), &camera, BLACK).colour;
        let expected = squared_difference(&picture.colour, &without);
        let lost = losses[row as usize];
        assert!((lost - expected).abs() <= 0.05 * expected + 1e-6, "{row}: {lost} {expected}");
    }
}

#[test]
fn what_no_view_sees_gives_nothing_and_is_not_missed() {
    let behind = Gaussian { position: [0.0, 0.0, -3.0], ..BALL };
    let (frame, cameras) = (frame(&[BALL, behind]), [camera(33, 17, 40.0)]);
    assert!(contribution(&frame, &cameras)[0] > 1.0 && removal(&frame, &cameras)[0] > 1.0);
    assert_eq!((contribution(&frame, &cameras)[1], removal(&frame, &cameras)[1]), (0.0, 0.0));
    assert_eq!(contribution(&frame, &[]), [0.0, 0.0]);
}

#[test]
fn sums_do_not_depend_on_the_number_of_threads() {
    let frame = BuiltinScene { gaussians: 3_000, ..BuiltinScene::default() }.frame(0);
    let cameras = splatstream_render::camera::ring(&frame, Default::default(), 2, 100);
    let sums = [1, 2, 3].map(|threads| {
        let pool = ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| (contribution(&frame, &cameras), removal(&frame, &cameras)))
    });
    assert!(sums[0] == sums[1] && sums[0] == sums[2]);
}
