//! What [`render`] draws.

use crate::exact;
use crate::gaussian::{BALL, Gaussian, any_gaussian, any_gaussians, camera, frame};
use proptest::prelude::*;
use rayon::ThreadPoolBuilder;
use splatstream_files::builtin::BuiltinScene;
use splatstream_gaussians::GaussianFrame;
use splatstream_render::{Camera, Rendering, render};

const BLACK: [f32; 3] = [0.0; 3];

fn draw(gaussians: &[Gaussian], camera: &Camera) -> Rendering {
    render(&frame(gaussians), camera, BLACK)
}

/// Compares every pixel of a picture of one Gaussian with the formula.
fn agrees_with_the_formula(
    gaussian: &Gaussian,
    camera: &Camera,
    antialiased: bool,
) -> Result<(), TestCaseError> {
    let drawn = render(&frame(&[*gaussian]).with_antialiased(antialiased), camera, BLACK);
    for (pixel, &found) in (0..).zip(&drawn.alpha) {
        let expected =
            exact::alpha(gaussian, camera, antialiased, [pixel % camera.width, pixel / camera.width]);
        // Within rounding of the least alpha, both are right.
        let unsure = (expected / exact::LEAST - 1.0).abs() < 0.01;
        let expected = if expected < exact::LEAST { 0.0 } else { expected.min(0.99) };
        let near = (f64::from(found) - expected).abs() < 2e-4;
        prop_assert!(unsure || near, "pixel {}: {} drawn, {} expected", pixel, found, expected);
    }
    Ok(())
}

proptest! {
    #[test]
    fn a_gaussian_on_the_axis_has_the_closed_form_alpha(
        log_scale in -6.0_f32..0.0, depth in 0.5_f32..20.0, opacity_logit in -6.0_f32..8.0,
    ) {
        let ball = Gaussian { position: [0.0, 0.0, depth], log_scale: [log_scale; 3], opacity_logit, ..BALL };
        let variance = (f64::from(log_scale).exp() * 40.0 / f64::from(depth)).powi(2) + 0.3;
        let drawn = draw(&[ball], &camera(33, 17, 40.0));
        for offset in 0..16_u32 {
            let expected = exact::opacity(&ball) * (-0.5 * f64::from(offset * offset) / variance).exp();
            let found = f64::from(drawn.alpha[8 * 33 + 16 + offset as usize]);
            if (expected / exact::LEAST - 1.0).abs() > 1e-3 {
                let expected = if expected < exact::LEAST { 0.0 } else { expected.min(0.99) };
                prop_assert!((found - expected).abs() < 5e-6, "{} {} {}", offset, found, expected);
            }
        }
    }

    #[test]
    fn a_gaussian_of_any_shape_is_drawn_as_in_the_paper(gaussian in any_gaussian()) {
        agrees_with_the_formula(&gaussian, &camera(61, 45, 60.0), false)?;
    }

    #[test]
    fn a_low_pass_filter_that_is_made_up_for_makes_small_gaussians_fainter(gaussian in any_gaussian()) {
        agrees_with_the_formula(&gaussian, &camera(61, 45, 60.0), true)?;
    }

    #[test]
    fn needles_far_outside_the_picture_are_drawn_as_in_the_paper(
        along in 0.0_f32..6.3, reach in 1.0_f32..40.0, width in -9.0_f32..-4.0,
    ) {
        // From its centre, at `reach` units in some direction, it points through the middle of the picture.
        let (sine, cosine) = along.sin_cos();
        let rotation = [(0.5 * along).cos(), 0.0, 0.0, (0.5 * along).sin()];
        let needle = Gaussian {
            position: [reach * cosine, reach * sine, 2.0],
            log_scale: [reach.ln(), width, width],
            rotation,
            ..BALL
        };
        agrees_with_the_formula(&needle, &camera(61, 45, 60.0), false)?;
    }

    #[test]
    fn the_order_of_gaussians_of_different_depth_does_not_matter(
        gaussians in any_gaussians(), seed in any::<u64>(),
    ) {
        let mut gaussians = gaussians;
        for (place, gaussian) in (0_u8..).zip(&mut gaussians) {
            gaussian.position[2] = 1.0 + f32::from(place) / 16.0;
        }
        let camera = camera(40, 30, 40.0);
        let expected = draw(&gaussians, &camera);
        let key = |gaussian: &Gaussian| u64::from(gaussian.position[2].to_bits()).wrapping_mul(seed | 1);
        gaussians.sort_by_key(key);
        prop_assert_eq!(draw(&gaussians, &camera), expected);
    }

    #[test]
    fn the_background_shows_only_where_something_passes(gaussians in any_gaussians()) {
        let (frame, camera) = (frame(&gaussians), camera(40, 30, 40.0));
        let background = [0.3, 2.0, 0.7];
        let (black, coloured) = (render(&frame, &camera, BLACK), render(&frame, &camera, background));
        prop_assert_eq!(&black.alpha, &coloured.alpha);
        let pixels = black.colour.pixels().iter().zip(coloured.colour.pixels()).zip(&black.alpha);
        for ((black, coloured), alpha) in pixels {
            prop_assert!((0.0..1.0).contains(alpha));
            for channel in 0..3 {
                let added = coloured[channel] - black[channel];
                prop_assert!((added - (1.0 - alpha) * background[channel]).abs() < 1e-5);
            }
        }
    }

    #[test]
    fn a_picture_of_any_size_is_the_corner_of_a_larger_one(
        gaussians in any_gaussians(), width in 1_u32..50, height in 1_u32..50,
    ) {
        // Only Gaussians well inside the field of both: beyond it the projection depends on the size.
        let mut gaussians = gaussians;
        for gaussian in &mut gaussians {
            gaussian.position[0] = gaussian.position[0].abs() / 60.0;
            gaussian.position[1] = gaussian.position[1].abs() / 60.0;
        }
        let large = Camera { principal: [0.0; 2], ..camera(64, 64, 40.0) };
        let small = Camera { width, height, ..large.clone() };
        let (large, small) = (draw(&gaussians, &large), draw(&gaussians, &small));
        for (y, line) in small.colour.pixels().chunks(width as usize).enumerate() {
            prop_assert_eq!(line, &large.colour.pixels()[64 * y..64 * y + width as usize]);
        }
    }

    #[test]
    fn gaussians_that_cannot_be_projected_are_left_out(
        gaussians in any_gaussians(), bad in any_gaussian(), kind in 0..3, extreme in 25.0_f32..100.0,
    ) {
        let bad = match kind {
            0 => Gaussian { position: bad.position.map(|part| -part), ..bad },
            1 => Gaussian { log_scale: [extreme; 3], ..bad },
            _ => Gaussian { log_scale: [2.0 * extreme, -2.0, -2.0], ..bad },
        };
        let camera = camera(40, 30, 40.0);
        let with: Vec<Gaussian> = std::iter::once(bad).chain(gaussians.iter().copied()).collect();
        prop_assert_eq!(draw(&with, &camera), draw(&gaussians, &camera));
    }
}

#[test]
fn what_is_far_nearer_than_the_scene_is_left_out_in_any_unit() {
    for unit in [1e-3, 1.0, 1e3] {
        let at = |depth: f32| Gaussian {
            position: [0.0, 0.0, depth * unit],
            log_scale: [libm::logf(0.001 * depth * unit); 3],
            ..BALL
        };
        let scene = [at(3.0); 9];
        let with = |near: Gaussian| [&[near][..], &scene].concat();
        let camera = camera(33, 17, 40.0);
        assert_eq!(draw(&with(at(0.005)), &camera), draw(&scene, &camera), "{unit}");
        assert_ne!(draw(&with(at(0.05)), &camera), draw(&scene, &camera), "{unit}");
    }
}

#[test]
fn a_scene_looks_the_same_in_any_unit() {
    let small = BuiltinScene { gaussians: 2_000, ..BuiltinScene::default() }.frame(0);
    let scaled = |factor: f32| {
        let mut planes = small.clone().into_planes();
        planes.position.iter_mut().flatten().for_each(|value| *value *= factor);
        planes.log_scale.iter_mut().flatten().for_each(|value| *value += libm::logf(factor));
        GaussianFrame::from_planes(small.sh_degree(), planes).unwrap()
    };
    let picture = |frame: &GaussianFrame| {
        let camera = splatstream_render::camera::ring(frame, Default::default(), 1, 133).remove(0);
        render(frame, &camera, BLACK).colour
    };
    for factor in [1e-3, 1e3] {
        let decibels = splatstream_render::metrics::psnr(&picture(&small), &picture(&scaled(factor)));
        assert!(decibels > 70.0, "{factor}: {decibels} dB");
    }
}

#[test]
fn a_gaussian_larger_than_can_be_computed_is_left_out() {
    for log_scale in [25.0, 60.0, 90.0] {
        let drawn = draw(&[Gaussian { log_scale: [log_scale; 3], ..BALL }], &camera(40, 30, 40.0));
        assert!(drawn.alpha.iter().all(|alpha| *alpha == 0.0), "{log_scale}");
    }
}

#[test]
fn gaussians_at_one_depth_are_drawn_in_the_order_of_the_frame() {
    let red = Gaussian { dc: [1.772_453_9, -1.772_453_9, -1.772_453_9], ..BALL };
    let green = Gaussian { dc: [-1.772_453_9, 1.772_453_9, -1.772_453_9], ..BALL };
    let [first, second] = [[red, green], [green, red]].map(|order| {
        let drawn = draw(&order, &camera(33, 17, 40.0));
        drawn.colour.pixels()[8 * 33 + 16]
    });
    let opacity = exact::opacity(&BALL) as f32;
    assert!(
        (first[0] - opacity).abs() < 1e-5 && (first[1] - opacity * (1.0 - opacity)).abs() < 1e-5,
        "{first:?}"
    );
    assert_eq!((first[0], first[1]), (second[1], second[0]));
}

#[test]
fn a_frame_of_nothing_is_background() {
    let drawn = render(&GaussianFrame::default(), &camera(17, 33, 40.0), [0.1, 0.2, 0.3]);
    assert!(drawn.colour.pixels().iter().all(|pixel| *pixel == [0.1, 0.2, 0.3]));
    assert!(drawn.alpha.iter().all(|alpha| *alpha == 0.0));
    assert_eq!((drawn.colour.width(), drawn.colour.height()), (17, 33));
}

#[test]
fn a_picture_of_one_pixel_is_the_middle_of_a_larger_one() {
    let ball = Gaussian { opacity_logit: 0.5, ..BALL };
    let (one, more) = (draw(&[ball], &camera(1, 1, 40.0)), draw(&[ball], &camera(33, 17, 40.0)));
    assert_eq!(one.colour.pixels()[0], more.colour.pixels()[8 * 33 + 16]);
}

#[test]
fn the_number_of_threads_does_not_matter() {
    let frame = BuiltinScene { gaussians: 5_000, ..BuiltinScene::default() }.frame(0);
    let camera = splatstream_render::camera::ring(&frame, Default::default(), 1, 133).remove(0);
    let pictures = [1, 2, 3].map(|threads| {
        let pool = ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| render(&frame, &camera, BLACK))
    });
    assert!(pictures[0].alpha.iter().any(|alpha| *alpha > 0.9));
    assert_eq!(pictures[0], pictures[1]);
    assert_eq!(pictures[0], pictures[2]);
}

/// CRC-32 of the bits of all colours and alphas, lowest byte first.
fn checksum(drawn: &Rendering) -> u32 {
    let values = drawn.colour.pixels().iter().flatten().chain(&drawn.alpha);
    crc32fast::hash(&values.flat_map(|value| value.to_le_bytes()).collect::<Vec<u8>>())
}

#[test]
fn the_picture_has_the_same_bits_on_every_machine() {
    let scene = BuiltinScene { gaussians: 2_000, ..BuiltinScene::default() }.frame(0);
    let camera = splatstream_render::camera::ring(&scene, Default::default(), 2, 72).remove(1);
    let checksums = [false, true].map(|antialiased| {
        checksum(&render(&scene.clone().with_antialiased(antialiased), &camera, [0.1, 0.2, 0.3]))
    });
    assert_eq!(checksums, [923_592_192, 4_010_468_725]);
}
