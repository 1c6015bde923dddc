//! Laws of cameras.

use crate::gaussian::{BALL, Gaussian, frame};
use glam::Vec3;
use proptest::prelude::*;
use splatstream_gaussians::GaussianFrame;
use splatstream_render::camera::{Up, forward, held_out, held_out_twice, read_cameras, ring, spiral};
use splatstream_render::{Camera, render};

const UPS: [Up; 6] = [Up::MinusY, Up::PlusY, Up::MinusZ, Up::PlusZ, Up::MinusX, Up::PlusX];

/// Where a camera sees a point, pixels, and how far ahead.
fn seen(camera: &Camera, point: Vec3) -> [f32; 3] {
    let offset = point - Vec3::from(camera.position);
    let [x, y, z] = camera.rotation.map(|axis| Vec3::from(axis).dot(offset));
    [camera.focal[0] * x / z + camera.principal[0], camera.focal[1] * y / z + camera.principal[1], z]
}

fn point() -> impl Strategy<Value = Vec3> {
    [-9.0_f32..9.0, -9.0_f32..9.0, -9.0_f32..9.0].prop_map(Vec3::from)
}

proptest! {
    #[test]
    fn look_at_puts_the_target_in_the_middle(
        position in point(), target in point(), down in point(), angle in 0.2_f32..2.0,
    ) {
        prop_assume!((target - position).length() > 0.5);
        let camera = Camera::look_at("c".to_owned(), position, target, down, angle, [64, 48]);
        let [x, y, z] = seen(&camera, target);
        prop_assert!((x - 32.0).abs() < 0.01 && (y - 24.0).abs() < 0.01 && z > 0.0, "{} {} {}", x, y, z);
        prop_assert!((camera.vertical_field() - angle).abs() < 1e-5);
        let rows = camera.rotation.map(Vec3::from);
        prop_assert!((rows[0].cross(rows[1]) - rows[2]).length() < 1e-5, "not a rotation");
    }

    #[test]
    fn a_pose_is_the_camera_again(position in point(), target in point(), down in point(), angle in 0.2_f32..2.0) {
        prop_assume!((target - position).length() > 0.5);
        let camera = Camera::look_at("c".to_owned(), position, target, down, angle, [64, 48]);
        let rotation = camera.quaternion();
        prop_assert!((rotation.iter().map(|part| part * part).sum::<f32>() - 1.0).abs() < 1e-5);
        let again =
            Camera::of_pose("c".to_owned(), camera.position, rotation, camera.vertical_field(), [64, 48]);
        let [one, other] = [&camera, &again].map(|camera| seen(camera, target));
        prop_assert!(one.iter().zip(other).all(|(one, other)| (one - other).abs() < 0.01), "{:?} {:?}", one, other);
    }

    #[test]
    fn what_lies_below_is_drawn_below(position in point(), target in point(), down in point()) {
        let ahead = (target - position).normalize_or_zero();
        let down = down.normalize_or_zero();
        prop_assume!((target - position).length() > 0.5 && ahead.cross(down).length() > 0.1);
        let camera = Camera::look_at("c".to_owned(), position, target, down, 1.0, [64, 48]);
        prop_assert!(seen(&camera, target + 0.1 * down)[1] > 24.0);
    }

    #[test]
    fn a_camera_scaled_to_a_height_keeps_its_field_and_what_it_sees(
        height in 1_u32..2000, point in point(),
    ) {
        let camera = Camera::look_at("c".to_owned(), Vec3::splat(20.0), Vec3::ZERO, Vec3::Y, 0.9, [960, 540]);
        let scaled = camera.scaled_to_height(height);
        prop_assert_eq!(scaled.height, height);
        prop_assert!((scaled.vertical_field() - 0.9).abs() < 1e-5);
        let ([x, y, _], [u, v, _]) = (seen(&camera, point), seen(&scaled, point));
        prop_assert!((x / 960.0 - u / scaled.width as f32).abs() < 1e-5);
        prop_assert!((y / 540.0 - v / height as f32).abs() < 1e-5);
    }
}

#[test]
fn cameras_that_are_made_see_the_middle_of_the_scene() {
    let corners = [[-1.0, -2.0, 4.0], [1.0, -2.0, 4.0], [-1.0, 0.0, 4.0], [1.0, 0.0, 6.0]];
    let frame = frame(&corners.map(|position| Gaussian { position, ..BALL }));
    for up in UPS {
        let held_out = |frame: &_, up, count, height| held_out(frame, up, &[], count, height);
        let mut made = [ring, forward, spiral].map(|cameras| cameras(&frame, up, 6, 90)).to_vec();
        made.push(held_out(&frame, up, 6, 90));
        for camera in made.iter().flatten() {
            let [x, y, z] = seen(camera, Vec3::new(0.0, -1.0, 5.0));
            assert!((x - 80.0).abs() < 0.05 && (y - 45.0).abs() < 0.05 && z > 0.0, "{camera:?}");
            assert!(render(&frame, camera, [0.0; 3]).alpha.iter().any(|alpha| *alpha > 0.5), "{camera:?}");
            assert_eq!((camera.width, camera.height), (160, 90));
        }
    }
}

#[test]
fn cameras_of_a_ring_stand_above_and_upright() {
    let frame = frame(&[BALL, Gaussian { position: [1.0, 1.0, 4.0], ..BALL }]);
    for (up, axis) in UPS.into_iter().zip([Vec3::NEG_Y, Vec3::Y, Vec3::NEG_Z, Vec3::Z, Vec3::NEG_X, Vec3::X])
    {
        for camera in ring(&frame, up, 5, 90) {
            assert!(Vec3::from(camera.rotation[1]).dot(axis) < -0.8, "down in the picture is not up");
            assert!(Vec3::from(camera.rotation[0]).dot(axis).abs() < 1e-6, "the horizon is not level");
            assert!(Vec3::from(camera.rotation[2]).dot(axis) < 0.0, "not from above");
        }
    }
}

/// The second of two sets, the first of which is [`held_out`].
fn between_held_out(frame: &GaussianFrame, up: Up, given: &[Camera], count: u32, height: u32) -> Vec<Camera> {
    let [first, second] = held_out_twice(frame, up, given, count, height);
    assert_eq!(first, held_out(frame, up, given, count, height));
    second
}

#[test]
fn cameras_of_one_view_are_all_different() {
    let frame = frame(&[BALL, Gaussian { position: [1.0, 1.0, 4.0], ..BALL }]);
    let mut cameras = ring(&frame, Up::MinusY, 8, 90);
    cameras.extend(spiral(&frame, Up::MinusY, 8, 90));
    let given = spiral(&frame, Up::MinusY, 8, 90);
    for made in [held_out, between_held_out] {
        cameras.extend(made(&frame, Up::MinusY, &[], 8, 90));
        let turned = made(&frame, Up::MinusY, &given, 3, 80).into_iter();
        cameras.extend(turned.map(|camera| Camera { name: format!("turned {}", camera.name), ..camera }));
    }
    // Both sets turn the one camera that there is, each to another side.
    let one = |made: fn(&GaussianFrame, Up, &[Camera], u32, u32) -> Vec<Camera>| {
        made(&frame, Up::MinusY, &given[..1], 1, 80)[0].position
    };
    assert_ne!(one(held_out), one(between_held_out));
    for (at, camera) in cameras.iter().enumerate() {
        assert!(
            cameras[..at].iter().all(|other| other.position != camera.position && other.name != camera.name)
        );
    }
}

#[test]
fn held_out_cameras_stand_five_degrees_from_given_ones_and_see_the_same() {
    let frame = frame(&[BALL, Gaussian { position: [1.0, 1.0, 4.0], ..BALL }]);
    let given = ring(&frame, Up::MinusY, 6, 90);
    for (camera, from) in held_out(&frame, Up::MinusY, &given, 3, 45).iter().zip([1, 3, 5]) {
        let (one, other) = (Vec3::from(camera.rotation[2]), Vec3::from(given[from].rotation[2]));
        assert!((one.dot(other).acos().to_degrees() - 5.0).abs() < 0.1, "{one} {other}");
        let [x, y, z] = seen(camera, Vec3::new(0.5, 0.5, 3.5));
        assert!((x - 40.0).abs() < 0.1 && (y - 22.5).abs() < 0.1 && z > 0.0, "{x} {y} {z}");
    }
}

#[test]
fn far_gaussians_do_not_push_cameras_away_from_the_scene() {
    // Two of five Gaussians are a thousand times as far as the rest, in all directions.
    let place = |number: u32| {
        let part = |by: f32| 2.0 * (number as f32 * by).fract() - 1.0;
        let far = if number % 5 < 2 { 1000.0 } else { 1.0 };
        [part(0.618) * far, part(0.755) * far, part(0.570) * far]
    };
    let gaussians: Vec<Gaussian> =
        (0..500).map(|number| Gaussian { position: place(number), ..BALL }).collect();
    for camera in ring(&frame(&gaussians), Up::MinusY, 4, 90) {
        let distance = Vec3::from(camera.position).length();
        assert!((1.0..10.0).contains(&distance), "{distance}");
    }
}

#[test]
fn both_file_forms_are_read_from_files() {
    let folder = tempfile::tempdir().unwrap();
    let trainer = folder.path().join("cameras.json");
    let studio = folder.path().join("transforms.json");
    let list = r#"[{"id": 0, "img_name": "00001", "width": 64, "height": 32, "fx": 50.0, "fy": 51.0,
        "position": [1, 2, 3], "rotation": [[0, -1, 0], [1, 0, 0], [0, 0, 1]]}]"#;
    let object = r#"{"w": 64, "h": 32, "fl_x": 50.0, "fl_y": 51.0, "cx": 32.0, "cy": 16.0, "frames": [
        {"file_path": "./images/00001.png",
         "transform_matrix": [[0, 1, 0, 1], [1, 0, 0, 2], [0, 0, -1, 3], [0, 0, 0, 1]]}]}"#;
    std::fs::write(&trainer, list).unwrap();
    std::fs::write(&studio, object).unwrap();
    let cameras = read_cameras(&trainer).unwrap();
    assert_eq!(cameras, read_cameras(&studio).unwrap());
    // Its right is the world's y.
    assert_eq!(cameras[0].rotation[0], [0.0, 1.0, 0.0]);
    assert!(
        read_cameras(&folder.path().join("none.json")).unwrap_err().to_string().contains("check the path")
    );
}
