//! Every attribute against central differences of the model.

use crate::model::{Model, Values, values};
use crate::scenes::{camera, degenerate, random};
use splatstream_gaussians::GaussianFrame;
use splatstream_gaussians::random::SplitMix64;
use splatstream_render::gradient::Gradients;
use splatstream_render::{Camera, Image, PreparedFrame};

/// First and last plane of each attribute.
const ATTRIBUTES: [(&str, usize, usize); 6] = [
    ("position", 0, 3),
    ("log-scale", 3, 6),
    ("rotation", 6, 10),
    ("opacity", 10, 11),
    ("dc", 11, 14),
    ("sh", 14, usize::MAX),
];

/// The largest error of an attribute, of its largest slope in a scene; rounding of 32 bits is far below.
const TOLERANCE: f64 = 2e-5;

/// Largest slope of each attribute, for a test to see that it had one.
type Largest = [f64; 6];

fn ours(
    frame: &GaussianFrame,
    camera: &Camera,
    background: [f32; 3],
    weights: &[[f64; 3]],
) -> (Values, Image) {
    let prepared = PreparedFrame::new(frame);
    let drawing = prepared.draw(camera, background);
    let slopes = weights.iter().map(|pixel| pixel.map(|weight| weight as f32)).collect();
    let mut gradients = Gradients::zero(frame);
    drawing.backward(&Image::new(camera.width as usize, slopes), &mut gradients).unwrap();
    let wide = |plane: &Vec<f32>| plane.iter().map(|&slope| f64::from(slope)).collect();
    (gradients.planes().iter().map(wide).collect(), drawing.rendering().colour.clone())
}

/// Compares a frame's gradients for random slopes by its pixels.
fn check(name: &str, frame: &GaussianFrame, camera: &Camera) -> Largest {
    let background = [0.2_f32, 0.5, 0.8];
    let model = Model {
        camera,
        background: background.map(f64::from),
        antialiased: frame.antialiased(),
        sh_degree: frame.sh_degree(),
    };
    let choices = model.choose(frame);
    let mut random = SplitMix64::new(99);
    let weight = |&doubtful: &bool| [(); 3].map(|()| if doubtful { 0.0 } else { f64::from(random.signed()) });
    let weights: Vec<[f64; 3]> = choices.doubtful.iter().map(weight).collect();
    let certain = choices.doubtful.iter().filter(|&&doubtful| !doubtful).count();
    assert!(2 * certain > choices.doubtful.len(), "{name}: {certain} pixels are certain");

    let is_clamped = |drawn: &Vec<(usize, bool)>| drawn.iter().any(|&(_, is_clamped)| is_clamped);
    let at_limit = match name {
        "nearly opaque" => choices.pixels.iter().any(is_clamped),
        "at the border" => choices.clamped.iter().flatten().flatten().count() > 2,
        "pixels that are done" => choices.done > 20,
        _ => true,
    };
    assert!(at_limit, "{name}: nothing is");

    let (found, picture) = ours(frame, camera, background, &weights);
    let values = values(frame);
    for ((own, pixel), doubtful) in
        model.picture(&values, &choices).iter().zip(picture.pixels()).zip(&choices.doubtful)
    {
        for (own, &pixel) in own.iter().zip(pixel) {
            assert!(*doubtful || (own - f64::from(pixel)).abs() < 1e-4, "{name}: picture {own} {pixel}");
        }
    }
    let expected = model.differences(&values, &choices, &weights);
    ATTRIBUTES.map(|(attribute, first, last)| {
        let planes = first..last.min(found.len());
        let pairs = || expected[planes.clone()].iter().flatten().zip(found[planes.clone()].iter().flatten());
        let largest = pairs().map(|(expected, _)| expected.abs()).fold(0.0, f64::max);
        let error = pairs().map(|(expected, found)| (expected - found).abs()).fold(0.0, f64::max);
        assert!(error <= TOLERANCE * largest + 1e-7, "{name}, {attribute}: {error:e} of {largest:e}");
        largest
    })
}

#[test]
fn random_scenes_of_every_degree_have_the_slopes_of_the_model() {
    for antialiased in [false, true] {
        for sh_degree in 0..=3 {
            let frame = random(20 + u64::from(sh_degree), 8, sh_degree, antialiased);
            let largest = check(&format!("degree {sh_degree}"), &frame, &camera(36, 30));
            let attributes = if sh_degree == 0 { &largest[..5] } else { &largest };
            assert!(attributes.iter().all(|&slope| slope > 0.05), "{largest:?}");
        }
    }
}

#[test]
fn scenes_at_their_limits_have_the_slopes_of_the_model() {
    for antialiased in [false, true] {
        for (name, frame, [width, height]) in degenerate(antialiased) {
            let mut camera = camera(width, height);
            if name == "equal depths" {
                camera.rotation = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
            }
            if width == 1 {
                // Gaussians as large as pixels, not smaller.
                camera.focal = [12.0; 2];
            }
            let largest = check(name, &frame, &camera);
            assert!(largest[..5].iter().all(|&slope| slope > 1e-3), "{name}: {largest:?}");
        }
    }
}

/// Gaussians of many tiles, and many to a tile.
#[test]
fn a_picture_of_several_tiles_has_the_slopes_of_the_model() {
    let frame = random(31, 40, 0, true);
    check("several tiles", &frame, &camera(70, 50));
}
