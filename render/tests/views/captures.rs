//! Captures from files: COLMAP's models as text and binary, transforms.json, and files that are none.

use splatstream_render::camera::{CameraError, Capture, read_cameras, read_capture, read_views};
use std::fs;
use std::path::Path;

const CAMERAS: &str = "# Camera list\n1 SIMPLE_PINHOLE 64 48 50 32 24\n7 PINHOLE 80 60 70 71 40.5 30\n";
/// Image 4 looks along z from (1, 2, 3); image 9 has turned a quarter about y, and its line of points is empty.
const IMAGES: &str = "# Image list\n9 0.7071067811865476 0 0.7071067811865476 0 0 0 2 7 b c.jpg\n\n\
    4 1 0 0 0 -1 -2 -3 1 a.png\n10.5 20.5 1 3 4 -1\n";
const POINTS: &str = "# 3D point list\n1 1.5 -2 3 255 0 7 0.5 4 0 9 1\n2 0 0 1 1 2 3 0.1\n";

fn folder(files: &[(&str, &[u8])]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in files {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
    }
    folder
}

fn text(cameras: &str, images: &str, points: &str) -> tempfile::TempDir {
    folder(&[
        ("sparse/0/cameras.txt", cameras.as_bytes()),
        ("sparse/0/images.txt", images.as_bytes()),
        ("sparse/0/points3D.txt", points.as_bytes()),
        ("images/a.png", b""),
    ])
}

fn lens(number: u32, model: u32, [width, height]: [u64; 2], parameters: &[f64]) -> Vec<u8> {
    let mut bytes = [number, model].map(u32::to_le_bytes).concat();
    bytes.extend([width, height].map(u64::to_le_bytes).concat());
    parameters.iter().for_each(|parameter| bytes.extend(parameter.to_le_bytes()));
    bytes
}

fn image(number: u32, pose: [f64; 7], lens: u32, name: &str, points: u64) -> Vec<u8> {
    let mut bytes = number.to_le_bytes().to_vec();
    pose.iter().for_each(|part| bytes.extend(part.to_le_bytes()));
    bytes.extend(lens.to_le_bytes());
    bytes.extend(name.as_bytes());
    bytes.push(0);
    bytes.extend(points.to_le_bytes());
    bytes.resize(bytes.len() + 24 * points as usize, 3);
    bytes
}

fn point(number: u64, position: [f64; 3], colour: [u8; 3], track: u64) -> Vec<u8> {
    let mut bytes = number.to_le_bytes().to_vec();
    position.iter().for_each(|part| bytes.extend(part.to_le_bytes()));
    bytes.extend(colour);
    bytes.extend(0.5_f64.to_le_bytes());
    bytes.extend(track.to_le_bytes());
    bytes.resize(bytes.len() + 8 * track as usize, 5);
    bytes
}

fn list(records: &[Vec<u8>]) -> Vec<u8> {
    [(records.len() as u64).to_le_bytes().to_vec(), records.concat()].concat()
}

/// The same model in bytes.
fn binary() -> [(&'static str, Vec<u8>); 3] {
    let quarter = 0.5_f64.sqrt();
    let cameras =
        [lens(1, 0, [64, 48], &[50.0, 32.0, 24.0]), lens(7, 1, [80, 60], &[70.0, 71.0, 40.5, 30.0])];
    let images = [
        image(9, [quarter, 0.0, quarter, 0.0, 0.0, 0.0, 2.0], 7, "b c.jpg", 0),
        image(4, [1.0, 0.0, 0.0, 0.0, -1.0, -2.0, -3.0], 1, "a.png", 2),
    ];
    let points = [point(1, [1.5, -2.0, 3.0], [255, 0, 7], 2), point(2, [0.0, 0.0, 1.0], [1, 2, 3], 0)];
    [("cameras.bin", list(&cameras)), ("images.bin", list(&images)), ("points3D.bin", list(&points))]
}

fn binary_folder(change: impl FnOnce(&mut [(&'static str, Vec<u8>); 3])) -> tempfile::TempDir {
    let mut files = binary();
    change(&mut files);
    let files: Vec<(&str, &[u8])> = files.iter().map(|(name, bytes)| (*name, bytes.as_slice())).collect();
    folder(&files)
}

fn close(a: [f32; 3], b: [f32; 3]) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-6)
}

fn refused(path: &Path) -> String {
    read_capture(path).unwrap_err().to_string()
}

#[test]
fn a_model_as_text_is_read() {
    let folder = text(CAMERAS, IMAGES, POINTS);
    let Capture { views, points, pictures, points_file } = read_capture(folder.path()).unwrap();
    assert_eq!((pictures, points_file), (folder.path().join("images"), None));
    // By the name of the picture.
    let [a, b] = views.as_slice() else { panic!("{views:?}") };
    assert_eq!((a.camera.name.as_str(), a.picture.as_deref()), ("a", Some(Path::new("a.png"))));
    assert_eq!((a.camera.width, a.camera.focal, a.camera.principal), (64, [50.0; 2], [32.0, 24.0]));
    assert_eq!(a.camera.rotation, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
    assert!(close(a.camera.position, [1.0, 2.0, 3.0]) && !a.is_distorted);
    assert_eq!((b.camera.name.as_str(), b.picture.as_deref()), ("b c", Some(Path::new("b c.jpg"))));
    assert_eq!((b.camera.focal, b.camera.principal), ([70.0, 71.0], [40.5, 30.0]));
    // What the camera has ahead, a quarter about y from z, is against x; the origin lies 2 ahead of it.
    assert!(
        close(b.camera.rotation[2], [-1.0, 0.0, 0.0]) && close(b.camera.position, [2.0, 0.0, 0.0]),
        "{b:?}"
    );
    assert_eq!(points.len(), 2);
    assert_eq!((points[0].position, points[0].colour), ([1.5, -2.0, 3.0], [255, 0, 7]));
    assert_eq!(read_cameras(folder.path()).unwrap(), [a.camera.clone(), b.camera.clone()]);
}

#[test]
fn a_model_as_bytes_says_the_same_as_text() {
    let of_text = read_capture(text(CAMERAS, IMAGES, POINTS).path()).unwrap();
    let views = read_views(text(CAMERAS, IMAGES, POINTS).path()).unwrap();
    assert_eq!((views.views.len(), views.points.len()), (of_text.views.len(), 0));
    let of_bytes = read_capture(binary_folder(|_| {}).path()).unwrap();
    assert_eq!((of_text.views, of_text.points), (of_bytes.views, of_bytes.points));
}

#[test]
fn cut_models_are_refused_with_the_byte() {
    for file in 0..3 {
        let whole = binary()[file].1.len();
        for length in 0..whole {
            let folder = binary_folder(|files| files[file].1.truncate(length));
            let said = refused(folder.path());
            assert!(said.contains(binary()[file].0) && said.contains("too early"), "{length}: {said}");
        }
    }
}

/// A count that no file could hold takes neither memory nor time.
#[test]
fn counts_are_not_trusted() {
    for (file, at) in [(0, 0), (1, 0), (2, 0), (1, 80), (2, 51)] {
        let folder = binary_folder(|files| {
            let bytes = &mut files[file].1;
            let end = bytes.len().min(at + 8);
            bytes[at..end].fill(0xff);
        });
        let said = refused(folder.path());
        assert!(said.contains("too early") || said.contains("know"), "{file} {at}: {said}");
    }
}

#[test]
fn lines_that_are_wrong_are_named() {
    let cases = [
        (
            "1 PINHOLE 64 48 50 50 32\n",
            IMAGES,
            POINTS,
            "cameras.txt: line 1: PINHOLE has 4 parameters, there are 3",
        ),
        ("1 PINHOLE 64 48 50 x 32 24\n", IMAGES, POINTS, "line 1: PARAMS is 'x', which is no such number"),
        ("1 HYPER 64 48 50\n", IMAGES, POINTS, "HYPER is no model of a camera that is known"),
        (
            "\n1 OPENCV_FISHEYE 64 48 50 50 32 24 0 0 0 0\n",
            IMAGES,
            POINTS,
            "line 2: OPENCV_FISHEYE is not a pinhole camera: run colmap",
        ),
        (
            CAMERAS,
            "4 1 0 0 0 -1 -2 -3 2 a.png\n\n",
            POINTS,
            "images.txt: line 1: a.png: there is no camera 2",
        ),
        (CAMERAS, "4 1 0 0 0 -1 -2 -3 1\n\n", POINTS, "line 1: NAME is missing"),
        (CAMERAS, "4 0 0 0 0 -1 -2 -3 1 a.png\n\n", POINTS, "a.png: its rotation has no direction"),
        (CAMERAS, "4 1 0 0 0 nan -2 -3 1 a.png\n\n", POINTS, "must be finite"),
        (CAMERAS, IMAGES, "1 1 2 3 256 0 0 0\n", "points3D.txt: line 1: R is '256'"),
        (CAMERAS, IMAGES, "1 1 2 inf 25 0 0 0\n", "position of a point must be finite"),
        (
            "1 PINHOLE 0 48 50 50 32 24\n",
            "4 1 0 0 0 -1 -2 -3 1 a.png\n\n",
            POINTS,
            "width and height must be 1 to 16384",
        ),
    ];
    for (cameras, images, points, expected) in cases {
        let said = refused(text(cameras, images, points).path());
        assert!(said.contains(expected), "{said}");
    }
}

#[test]
fn long_lines_of_points_are_passed_over() {
    let track = " 12345 678".repeat(50_000);
    let images = format!("4 1 0 0 0 -1 -2 -3 1 a.png\n{}\n5 1 0 0 0 0 0 0 1 d.png\n\n", &track[1..]);
    let points = format!("1 1 2 3 4 5 6 0.5{track}\n2 3 2 1 4 5 6 0.5");
    let capture = read_capture(text(CAMERAS, &images, &points).path()).unwrap();
    assert_eq!((capture.views.len(), capture.points.len()), (2, 2));
}

#[test]
fn lenses_that_bend_are_said_and_those_that_do_not_are_pinholes() {
    let image = "4 1 0 0 0 -1 -2 -3 1 a.png\n\n";
    for (parameters, is_distorted) in [("50 32 24 0", false), ("50 32 24 0.02", true)] {
        let camera = format!("1 SIMPLE_RADIAL 64 48 {parameters}\n");
        let capture = read_capture(text(&camera, image, POINTS).path()).unwrap();
        assert_eq!(capture.views[0].is_distorted, is_distorted);
        assert_eq!(capture.views[0].camera.focal, [50.0; 2]);
    }
    let transforms = |more: &str| {
        let text = format!(
            r#"{{"w": 64, "h": 32, "fl_x": 50, {more} "ply_file_path": "points.ply", "frames": [{{"file_path": "images/a",
            "transform_matrix": [[1, 0, 0, 1], [0, -1, 0, 2], [0, 0, -1, 3], [0, 0, 0, 1]]}}]}}"#
        );
        folder(&[("transforms.json", text.as_bytes())])
    };
    let bent = transforms(r#""camera_model": "OPENCV", "k1": 0.1,"#);
    let capture = read_capture(bent.path()).unwrap();
    assert!(capture.views[0].is_distorted);
    assert_eq!(capture.points_file, Some(bent.path().join("points.ply")));
    assert_eq!(capture.views[0].picture.as_deref(), Some(Path::new("images/a")));
    assert!(!read_capture(transforms(r#""k1": 0.0,"#).path()).unwrap().views[0].is_distorted);
    let with_angle = read_cameras(transforms(r#""camera_angle_y": 0.8,"#).path()).unwrap();
    assert!((with_angle[0].focal[1] - 16.0 / 0.4_f32.tan()).abs() < 1e-3);
    for fisheye in [r#""camera_model": "OPENCV_FISHEYE","#, r#""is_fisheye": true,"#] {
        assert!(refused(transforms(fisheye).path()).contains("fisheye"));
    }
}

#[test]
fn a_directory_without_cameras_says_what_it_lacks() {
    let folder = folder(&[("images/a.png", b""), ("cameras.txt", CAMERAS.as_bytes())]);
    assert!(matches!(read_capture(folder.path()), Err(CameraError::Directory)));
    assert!(refused(folder.path()).contains("sparse/0"));
    assert!(refused(&folder.path().join("none.json")).contains("check the path"));
}

#[test]
fn cameras_in_json_are_read_up_to_a_limit() {
    let trainer =
        r#"{"width":64,"height":32,"fx":50,"fy":50,"position":[1,2,3],"rotation":[[1,0,0],[0,1,0],[0,0,1]]}"#;
    let frame = r#"{"transform_matrix":[[1,0,0,1],[0,-1,0,2],[0,0,-1,3],[0,0,0,1]]}"#;
    let list = |element: &str, count: usize| vec![element; count].join(",");
    let files = |count: usize| {
        let cameras = format!("[{}]", list(trainer, count));
        let transforms = format!(r#"{{"frames":[{}],"w":64,"h":32,"fl_x":50}}"#, list(frame, count));
        folder(&[("cameras.json", cameras.as_bytes()), ("transforms.json", transforms.as_bytes())])
    };
    let (most, more) = (files(100_000), files(100_001));
    for name in ["cameras.json", "transforms.json"] {
        assert_eq!(read_cameras(&most.path().join(name)).unwrap().len(), 100_000);
        let said = refused(&more.path().join(name));
        assert_eq!(said, "there are more than 100000 cameras: give a part of the file");
    }
}

/// Keys that are not known hold anything, keys that are known come in any order, and the last of two counts.
#[test]
fn objects_of_json_are_read_in_any_order() {
    let text = r#" {"applied_transform": [[1, {"deep": [null, "x"]}]], "frames": [{"colmap_im_id": {"a": [1]}, "cx": null,
        "w": 10, "transform_matrix": [[1, 0, 0, 1, 9], [0, -1, 0, 2], [0, 0, -1, 3], []], "w": 80}],
        "camera_model": "PINHOLE", "h": 32, "fl_\u0078": 50, "w": 64}"#;
    let folder = folder(&[("transforms.json", text.as_bytes())]);
    let camera = &read_cameras(folder.path()).unwrap()[0];
    assert_eq!(
        (camera.width, camera.height, camera.focal, camera.position),
        (80, 32, [50.0; 2], [1.0, 2.0, 3.0])
    );
}

#[test]
fn json_of_another_form_says_what_lacks() {
    let cases = [
        (r#"{"w": 1}"#, "missing field `frames`"),
        (r#"{"frames": [{"w": 1}]}"#, "missing field `transform_matrix`"),
        (
            r#"{"frames": [{"transform_matrix": []}], "w": 1, "h": 1, "fl_x": 1}"#,
            "transform_matrix has no rows",
        ),
        (
            r#"{"frames": [{"transform_matrix": [[1], [2]]}], "w": 1, "h": 1, "fl_x": 1}"#,
            "4 rows of 4 numbers",
        ),
        (r#"{"frames": [{"transform_matrix": [["1"]]}]}"#, "expected f32"),
        (r#"[{"width": 64}]"#, "missing field `height`"),
        (r#"{"frames": []} x"#, "trailing characters"),
        (r#""text""#, "neither a cameras.json"),
        ("[", "EOF"),
    ];
    for (text, expected) in cases {
        let folder = folder(&[("a.json", text.as_bytes())]);
        let said = refused(&folder.path().join("a.json"));
        assert!(said.contains(expected), "{text}: {said}");
    }
}

#[test]
fn characters_of_control_in_names_are_refused_and_not_repeated() {
    let trainer = br#"[{"img_name": "a\u001b[2J.png", "width": 64, "height": 32, "fx": 50, "fy": 50, "position": [1, 2, 3],
        "rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}]"#;
    let json = folder(&[("cameras.json", trainer)]);
    let image = "4 1 0 0 0 -1 -2 -3 1 a\u{1b}[2J.png\n\n";
    let cases = [
        (
            refused(&json.path().join("cameras.json")),
            "camera 0: the name of its picture has characters of control",
        ),
        (refused(text(CAMERAS, image, POINTS).path()), "camera 0: the name of its picture"),
        (refused(text("1 \u{1b}[2J 64 48 50\n", IMAGES, POINTS).path()), "\\u{1b}[2J is no model"),
        (
            refused(text("2 PINHOLE 64 48 50 50 32 24\n", image, POINTS).path()),
            "a\\u{1b}[2J.png: there is no camera 1",
        ),
    ];
    for (said, expected) in cases {
        assert!(said.contains(expected) && !said.contains('\u{1b}'), "{said:?}");
    }
}
