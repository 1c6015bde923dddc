//! Laws of the metrics.

use proptest::prelude::*;
use splatstream_render::Image;
use splatstream_render::metrics::{
    Mask, RatePoint, SsimMap, bd_psnr, bd_rate, psnr, psnr_masked, ssim, yuv_psnr,
};

/// Pictures of one size, 11 to 40 pixels on a side, with values a bit beyond 0..1.
fn pictures<const COUNT: usize>() -> impl Strategy<Value = [Image; COUNT]> {
    (11_usize..40, 11_usize..40).prop_flat_map(|(width, height)| {
        let channel = || (-26_i16..282).prop_map(|step| f32::from(step) / 255.0);
        let pixels = || proptest::collection::vec([channel(), channel(), channel()], width * height);
        [(); COUNT]
            .map(|()| pixels())
            .prop_map(move |pictures| pictures.map(|pixels| Image::new(width, pixels)))
    })
}

fn flat(width: usize, height: usize, value: f32) -> Image {
    Image::new(width, vec![[value; 3]; width * height])
}

fn curve(points: &[(f64, f64)]) -> Vec<RatePoint> {
    points.iter().map(|&(rate, quality)| RatePoint { rate, quality }).collect()
}

proptest! {
    #[test]
    fn metrics_do_not_depend_on_which_picture_is_the_reference([a, b] in pictures()) {
        prop_assert_eq!(psnr(&a, &b), psnr(&b, &a));
        prop_assert_eq!(yuv_psnr(&a, &b), yuv_psnr(&b, &a));
        prop_assert_eq!(ssim(&a, &b), ssim(&b, &a));
    }

    #[test]
    fn a_picture_is_equal_to_itself([a] in pictures()) {
        prop_assert_eq!(psnr(&a, &a), f64::INFINITY);
        prop_assert!((ssim(&a, &a).unwrap() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_mask_of_all_pixels_changes_nothing([a, b] in pictures()) {
        let mask = Mask::covered(&vec![1.0; a.pixels().len()]);
        prop_assert_eq!(psnr_masked(&a, &b, &mask), Some(psnr(&a, &b)));
        let map = SsimMap::between(&a, &b).unwrap();
        prop_assert!((map.masked_mean(&mask).unwrap() - map.mean()).abs() < 1e-12);
    }

    #[test]
    fn pixels_outside_the_mask_do_not_count([a, b, c] in pictures()) {
        let alpha: Vec<f32> = (0..a.pixels().len()).map(|pixel| (pixel % 3) as f32).collect();
        let choose = |(pixel, (&inside, &outside))| if pixel % 3 > 0 { inside } else { outside };
        let pixels = b.pixels().iter().zip(c.pixels()).enumerate().map(choose).collect();
        let mixed = Image::new(b.width(), pixels);
        let mask = Mask::covered(&alpha);
        prop_assert_eq!(psnr_masked(&a, &b, &mask), psnr_masked(&a, &mixed, &mask));
    }

    #[test]
    fn a_curve_of_k_times_the_rate_has_a_bd_rate_of_k_less_one(
        steps in proptest::collection::vec((0.1..2.0_f64, 0.1..5.0_f64), 2..8),
        factor in 0.1..10.0_f64,
    ) {
        let (mut rate, mut quality) = (1.0, 20.0);
        let points: Vec<(f64, f64)> = steps.iter().map(|(growth, gain)| {
            (rate, quality) = (rate * (1.0 + growth), quality + gain);
            (rate, quality)
        }).collect();
        let scaled: Vec<(f64, f64)> = points.iter().map(|(rate, quality)| (rate * factor, *quality)).collect();
        let difference = bd_rate(&curve(&points), &curve(&scaled)).unwrap();
        prop_assert!((difference - 100.0 * (factor - 1.0)).abs() < 1e-8, "{}", difference);
        let better: Vec<(f64, f64)> = points.iter().map(|(rate, quality)| (*rate, quality + factor)).collect();
        let difference = bd_psnr(&curve(&points), &curve(&better)).unwrap();
        prop_assert!((difference - factor).abs() < 1e-8, "{}", difference);
    }
}

#[test]
fn a_constant_offset_has_the_psnr_of_its_square() {
    let figure = psnr(&flat(7, 5, 0.5), &flat(7, 5, 0.25));
    assert!((figure - -20.0 * 0.25_f64.log10()).abs() < 1e-12, "{figure}");
    let luma_only = yuv_psnr(&flat(7, 5, 0.5), &flat(7, 5, 0.25));
    assert!((luma_only.y - figure).abs() < 1e-9);
    assert!(luma_only.u > 100.0 && luma_only.weighted() < (6.0 * figure + 201.0) / 8.0);
}

#[test]
fn black_and_white_are_as_far_apart_as_can_be_however_bright_the_white() {
    assert_eq!(psnr(&flat(3, 3, f32::NAN), &flat(3, 3, 7.0)), 0.0);
}

#[test]
fn nothing_is_no_figure() {
    let (small, picture) = (flat(10, 30, 0.0), flat(20, 20, 0.0));
    assert_eq!(ssim(&small, &small), None);
    let nothing = Mask::covered(&[0.0; 400]);
    assert_eq!(psnr_masked(&picture, &picture, &nothing), None);
    assert_eq!(SsimMap::between(&picture, &picture).unwrap().masked_mean(&nothing), None);
}

#[test]
fn curves_without_a_common_interval_have_no_mean_difference() {
    let low = curve(&[(1.0, 20.0), (2.0, 25.0)]);
    let high = curve(&[(1.0, 25.0), (2.0, 30.0)]);
    assert_eq!(bd_rate(&low, &high), None);
    assert!(bd_psnr(&low, &high).is_some());
    assert_eq!(bd_rate(&low, &high[..1]), None);
}

#[test]
fn figures_do_not_depend_on_the_number_of_threads() {
    let noise = |seed: u32| {
        let value = |i: u32| (i.wrapping_mul(2_654_435_761).wrapping_add(seed) >> 16) as f32 / 65_536.0;
        Image::new(131, (0..131 * 97).map(|i| [3 * i, 3 * i + 1, 3 * i + 2].map(value)).collect())
    };
    let (a, b) = (noise(1), noise(77_777_777));
    let figures = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| (psnr(&a, &b), yuv_psnr(&a, &b), SsimMap::between(&a, &b)))
    };
    assert_eq!(figures(1), figures(3));
}
