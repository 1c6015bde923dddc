//! What holds for all gradients.

use crate::scenes::{camera, degenerate, random};
use proptest::prelude::*;
use splatstream_gaussians::random::SplitMix64;
use splatstream_gaussians::{GaussianFrame, Planes};
use splatstream_render::gradient::{Gradients, Loss};
use splatstream_render::{Camera, Image, PreparedFrame, render};

/// Slopes from a seed for the pixels of a camera.
fn slopes(seed: u64, camera: &Camera) -> Image {
    let mut random = SplitMix64::new(seed);
    let pixels = (0..camera.width * camera.height).map(|_| [(); 3].map(|()| random.signed()));
    Image::new(camera.width as usize, pixels.collect())
}

fn gradients(frame: &GaussianFrame, camera: &Camera, slopes: &Image) -> Gradients {
    let mut gradients = Gradients::zero(frame);
    PreparedFrame::new(frame).draw(camera, [0.3; 3]).backward(slopes, &mut gradients).unwrap();
    gradients
}

fn flat(planes: &Planes) -> Vec<f32> {
    planes.iter().flatten().copied().collect()
}

#[test]
fn any_number_of_threads_makes_the_same_bits() {
    let frame = random(3, 9_000, 2, true);
    let camera = camera(400, 300);
    let reference = render(&random(4, 9_000, 0, true), &camera, [0.0; 3]).colour;
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let prepared = PreparedFrame::new(&frame);
            let drawing = prepared.draw(&camera, [0.0; 3]);
            let judged = Loss::default().between(&reference, &drawing.rendering().colour).unwrap();
            let mut gradients = Gradients::zero(&frame);
            drawing.backward(&judged.slopes, &mut gradients).unwrap();
            let bits: Vec<u32> = flat(gradients.planes()).iter().map(|slope| slope.to_bits()).collect();
            (judged.value.to_bits(), bits)
        })
    };
    let one = with(1);
    assert!(one.1.iter().any(|&bits| bits != 0));
    for threads in [2, 3, 8] {
        assert!(one == with(threads), "{threads} threads");
    }
}

#[test]
fn the_picture_is_the_one_that_is_rendered() {
    let (frame, camera) = (random(8, 500, 1, false), camera(130, 90));
    assert_eq!(
        *PreparedFrame::new(&frame).draw(&camera, [0.1; 3]).rendering(),
        render(&frame, &camera, [0.1; 3])
    );
}

#[test]
fn what_no_picture_shows_has_no_slope() {
    for antialiased in [false, true] {
        let seen = random(2, 12, 3, antialiased);
        let mut hidden = seen.clone();
        let planes = hidden.planes_mut();
        // Behind the camera, far beside it, fainter than can be drawn; and one without direction.
        planes.position[2][..4].fill(-5.0);
        planes.position[0][4..7].fill(1e4);
        planes.opacity_logit[7..10].fill(-8.0);
        planes.rotation.into_iter().for_each(|plane| plane[10..].fill(0.0));
        let camera = camera(40, 30);
        let zero = Gradients::zero(&hidden);
        assert_eq!(gradients(&hidden, &camera, &slopes(1, &camera)), zero);
        assert_ne!(gradients(&seen, &camera, &slopes(1, &camera)), zero);
    }
    let none = GaussianFrame::from_planes(0, Planes::default()).unwrap();
    assert!(flat(gradients(&none, &camera(5, 5), &slopes(1, &camera(5, 5))).planes()).is_empty());
}

#[test]
fn a_step_against_the_slopes_makes_the_loss_less() {
    let camera = camera(64, 48);
    let reference = render(&random(6, 60, 1, true), &camera, [0.0; 3]).colour;
    let mut frame = random(7, 60, 1, true);
    let judge = |frame: &GaussianFrame| {
        let prepared = PreparedFrame::new(frame);
        let drawing = prepared.draw(&camera, [0.0; 3]);
        let judged = Loss::default().between(&reference, &drawing.rendering().colour).unwrap();
        let mut gradients = Gradients::zero(frame);
        drawing.backward(&judged.slopes, &mut gradients).unwrap();
        (judged.value, gradients)
    };
    let (before, gradients) = judge(&frame);
    let mut planes = frame.clone().into_planes();
    for (plane, slopes) in planes.iter_mut().zip(gradients.planes().iter()) {
        plane.iter_mut().zip(slopes).for_each(|(value, slope)| *value -= 0.02 * slope);
    }
    frame = GaussianFrame::from_planes(1, planes).unwrap().with_antialiased(true);
    let (after, _) = judge(&frame);
    let predicted: f64 =
        flat(gradients.planes()).iter().map(|&slope| 0.02 * f64::from(slope) * f64::from(slope)).sum();
    assert!(
        before - after > 0.5 * predicted && before - after < 1.5 * predicted,
        "{before} {after} {predicted}"
    );
}

/// Where the loss counts each pixel by its column, a Gaussian that moves by one pixel to the right adds its light once.
#[test]
fn slopes_in_the_picture_are_those_by_pixels_of_movement() {
    let camera = camera(120, 80);
    let mut frame = random(3, 3, 0, false);
    let planes = frame.planes_mut();
    // Apart from each other and from the border, on a plane that the camera sees at an angle.
    for (row, x) in [-0.4, 0.0, 0.4].into_iter().enumerate() {
        for (plane, value) in [x, 0.1 * x, 3.0].into_iter().enumerate() {
            planes.position[plane][row] = value;
        }
    }
    planes.log_scale.into_iter().for_each(|plane| plane.copy_from_slice(&[-2.2, -2.0, -2.4]));
    planes.opacity_logit.fill(1.0);
    planes.dc.into_iter().for_each(|plane| plane.copy_from_slice(&[1.0, 0.5, 0.0]));
    let columns = (0..80).flat_map(|_| (0..120).map(|x| [x as f32, 0.0, 0.0]));
    let slopes = Image::new(120, columns.collect());
    for row in 0..3 {
        let one = frame.select(&[row]);
        let prepared = PreparedFrame::new(&one);
        let drawing = prepared.draw(&camera, [0.0; 3]);
        let light: f64 = drawing.rendering().colour.pixels().iter().map(|pixel| f64::from(pixel[0])).sum();
        let (mut with, mut without) = (Gradients::zero(&one), Gradients::zero(&one));
        let footprints = drawing.backward_in_picture(&slopes, &mut with).unwrap();
        drawing.backward(&slopes, &mut without).unwrap();
        assert_eq!(with, without);
        let [footprint] = footprints[..] else { panic!("{footprints:?}") };
        let [across, down] = footprint.slope;
        // The step of alpha at its end, 1/255, is left out: that many pixels, of a bell curve with this top, times its height.
        let (top, end) = (1.0 / (1.0 + (-1.0_f64).exp()), 1.0 / 255.0);
        let share = 1.0 - end * (top / end).ln() / (top - end);
        assert!(
            (across / light - share).abs() < 0.015 && (down / light).abs() < 0.01,
            "{footprint:?} {light}"
        );
        let [wide, tall] = footprint.extent;
        assert!(wide > 5.0 && wide < 40.0 && tall > 5.0 && tall < 40.0, "{footprint:?}");
    }
}

/// Frames of finite values, however far from anything trained.
#[test]
fn slopes_are_finite_however_extreme_the_frame() {
    let camera = camera(40, 30);
    for antialiased in [false, true] {
        for log_scale in [-60.0, -30.0, -10.0, 5.0, 12.0, 20.0, 30.0, 60.0] {
            let mut frame = random(5, 20, 1, antialiased);
            let planes = frame.planes_mut();
            planes.log_scale[1].fill(log_scale);
            planes.opacity_logit[..5].fill(200.0);
            planes.opacity_logit[5..10].fill(-200.0);
            planes.rotation.into_iter().for_each(|plane| plane[3] *= 1e-12);
            let gradients = gradients(&frame, &camera, &slopes(3, &camera));
            assert!(flat(gradients.planes()).iter().all(|slope| slope.is_finite()), "{log_scale}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn slopes_of_a_sum_are_the_sum_of_slopes(seed: u64, antialiased: bool, factor in -3.0_f32..3.0) {
        let (frame, camera) = (random(seed, 30, 1, antialiased), camera(50, 40));
        let [a, b] = [seed ^ 1, seed ^ 2].map(|seed| slopes(seed, &camera));
        let pixels = a.pixels().iter().zip(b.pixels());
        let both = pixels.map(|(a, b)| [0, 1, 2].map(|c| a[c] + factor * b[c])).collect();
        let both = Image::new(a.width(), both);
        let [a, b, both] = [a, b, both].map(|slopes| gradients(&frame, &camera, &slopes));
        for ((a, b), both) in a.planes().iter().zip(b.planes().iter()).zip(both.planes().iter()) {
            let expected: Vec<f32> = a.iter().zip(b).map(|(a, b)| a + factor * b).collect();
            let largest = expected.iter().chain(a).chain(b).fold(0.0_f32, |most, slope| most.max(slope.abs()));
            for (expected, both) in expected.iter().zip(both) {
                prop_assert!((expected - both).abs() <= 1e-4 * largest + 1e-6, "{} {}", expected, both);
            }
        }
    }

    #[test]
    fn gradients_add_up_over_views(seed: u64) {
        let (frame, views) = (random(seed, 10, 1, false), [camera(20, 20), camera(31, 17)]);
        let mut sum = Gradients::zero(&frame);
        for camera in &views {
            PreparedFrame::new(&frame).draw(camera, [0.3; 3]).backward(&slopes(seed, camera), &mut sum).unwrap();
        }
        let [one, other] = views.each_ref().map(|camera| flat(gradients(&frame, camera, &slopes(seed, camera)).planes()));
        let expected: Vec<f32> = one.iter().zip(other).map(|(one, other)| one + other).collect();
        prop_assert_eq!(flat(sum.planes()), expected);
    }

    #[test]
    fn slopes_of_a_quaternion_are_at_right_angles_to_it(seed: u64) {
        let (frame, camera) = (random(seed, 20, 0, true), camera(40, 40));
        let gradients = gradients(&frame, &camera, &slopes(seed, &camera));
        for row in 0..frame.len() {
            let [own, slopes] = [frame.rotation(), &gradients.planes().rotation].map(|p| p.each_ref().map(|p| f64::from(p[row])));
            let length = |q: [f64; 4]| q.iter().map(|part| part * part).sum::<f64>().sqrt();
            let dot: f64 = own.iter().zip(slopes).map(|(own, slope)| own * slope).sum();
            prop_assert!(dot.abs() <= 1e-5 * length(own) * length(slopes));
        }
    }

    #[test]
    fn no_slope_by_pixels_is_no_slope_by_values(which in 0_usize..12, antialiased: bool) {
        let (_, frame, [width, height]) = degenerate(antialiased).swap_remove(which);
        let camera = camera(width, height);
        let none = Image::new(width as usize, vec![[0.0; 3]; (width * height) as usize]);
        prop_assert_eq!(gradients(&frame, &camera, &none), Gradients::zero(&frame));
    }
}
