//! Captures that are written are read again, and files that are wrong are said.
#![allow(clippy::unwrap_used, missing_docs, reason = "a panic is a failed test")]

use splatstream_capture::simulator::{CaptureFiles, Rig, Simulation};
use splatstream_capture::{LoadError, Photograph, load_photographs, load_points};
use splatstream_render::camera::read_capture;
use splatstream_render::{Camera, Image};
use std::fs;
use std::path::Path;

const SIMULATION: Simulation = Simulation { seed: 1, samples: 1 };

/// A capture of four views in a directory.
fn written() -> (tempfile::TempDir, Vec<Camera>) {
    let folder = tempfile::tempdir().unwrap();
    let cameras = Rig::Forward.cameras(4, [64, 36]);
    let points = SIMULATION.points(&cameras, 0.2, 50);
    let put = |path: &str, bytes: &[u8]| {
        let path = folder.path().join(path);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
    };
    for camera in &cameras {
        put(&CaptureFiles::picture_path(camera), &SIMULATION.picture(camera, 0.2).to_png().unwrap());
    }
    let files = CaptureFiles { cameras: &cameras, points: &points, seconds: 0.2 }.files();
    files.iter().for_each(|file| put(&file.path, &file.bytes));
    (folder, cameras)
}

#[test]
fn a_simulated_capture_is_read_by_both_of_its_descriptions() {
    let (folder, cameras) = written();
    let points = SIMULATION.points(&cameras, 0.2, 50);
    for place in ["", "sparse/0"] {
        let capture = read_capture(&folder.path().join(place)).unwrap();
        let photographs = load_photographs(&capture, None, None, [0.0; 3]).unwrap();
        assert_eq!(photographs.len(), cameras.len());
        for (photograph, camera) in photographs.iter().zip(&cameras) {
            let found = photograph.camera();
            assert_eq!((&found.name, found.width, found.height), (&camera.name, 64, 36));
            let near = |a: &f32, b: &f32| (a - b).abs() < 1e-5;
            assert!(
                found
                    .rotation
                    .iter()
                    .flatten()
                    .zip(camera.rotation.iter().flatten())
                    .all(|(a, b)| near(a, b))
            );
            assert!(found.position.iter().zip(&camera.position).all(|(a, b)| near(a, b)));
            assert_eq!((found.focal, found.principal), (camera.focal, camera.principal));
            assert_eq!(photograph.picture(), SIMULATION.picture(camera, 0.2));
        }
        assert_eq!(load_points(&capture).unwrap(), points);
    }
}

#[test]
fn pictures_are_the_same_for_any_number_of_threads_and_move() {
    let camera = &Rig::Orbit.cameras(3, [48, 27])[1];
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            (SIMULATION.picture(camera, 0.7), SIMULATION.points(std::slice::from_ref(camera), 0.7, 40))
        })
    };
    let one = with(1);
    assert_eq!(one, with(3));
    let changed = |other: &Image| one.0.pixels().iter().zip(other.pixels()).filter(|(a, b)| a != b).count();
    // What moves changes, and most of the picture does not.
    let moved = changed(&SIMULATION.picture(camera, 0.75));
    assert!((5..48 * 27 / 2).contains(&moved), "{moved}");
    assert!(changed(&Simulation { seed: 2, ..SIMULATION }.picture(camera, 0.7)) > 20);
}

/// Everything that a renderer could get wrong is off by far more: points project onto what has their colour.
#[test]
fn points_lie_where_cameras_see_their_colour() {
    let cameras = Rig::Orbit.cameras(6, [320, 180]);
    let picture = SIMULATION.picture(&cameras[0], 0.0);
    let points = SIMULATION.points(&cameras[..1], 0.0, 400);
    let mut close = 0;
    for point in &points {
        let camera = &cameras[0];
        let offset = [0, 1, 2].map(|axis| point.position[axis] - camera.position[axis]);
        let dot = |row: [f32; 3]| row.iter().zip(offset).map(|(a, b)| a * b).sum::<f32>();
        let [x, y, z] = camera.rotation.map(dot);
        let at = [0, 1]
            .map(|axis| (camera.focal[axis] * [x, y][axis] / z + camera.principal[axis]).max(0.0) as usize);
        let pixel = picture.pixels()[at[1].min(179) * 320 + at[0].min(319)];
        let off =
            pixel.iter().zip(point.colour).map(|(a, b)| (a - f32::from(b) / 255.0).abs()).fold(0.0, f32::max);
        close += usize::from(off < 0.15);
    }
    assert!(close * 4 > points.len() * 3, "{close} of {}", points.len());
}

#[test]
fn pictures_are_made_smaller_with_their_cameras() {
    let (folder, cameras) = written();
    let capture = read_capture(folder.path()).unwrap();
    let photographs = load_photographs(&capture, None, Some(18), [0.0; 3]).unwrap();
    assert_eq!(*photographs[0].camera(), cameras[0].scaled_to_height(18));
    assert_eq!(photographs[0].picture().width(), 32);
    // Pictures that somebody made smaller are taken for what they are.
    let half = SIMULATION.picture(&cameras[0], 0.2).averaged(32, 18);
    assert_eq!(Photograph::new(&cameras[0], &half, None).unwrap().camera(), photographs[0].camera());
    let square = SIMULATION.picture(&cameras[0], 0.2).averaged(36, 36);
    let said = Photograph::new(&cameras[0], &square, None).unwrap_err().to_string();
    assert!(said.contains("view_000: the picture has [36, 36] pixels, the camera says [64, 36]"), "{said}");
}

#[test]
fn pictures_that_are_not_there_or_are_none_are_named() {
    let (folder, _) = written();
    let path = folder.path().join("images/view_002.png");
    let load =
        |at: Option<&Path>| load_photographs(&read_capture(folder.path()).unwrap(), at, None, [0.0; 3]);
    // Elsewhere by its name alone, and without its ending in the file.
    assert!(load(Some(&folder.path().join("images"))).is_ok());
    let bare = fs::read_to_string(folder.path().join("transforms.json")).unwrap().replace(".png", "");
    fs::write(folder.path().join("transforms.json"), bare).unwrap();
    assert!(load(None).is_ok());
    fs::write(&path, b"no picture").unwrap();
    let said = load(None).unwrap_err();
    assert!(matches!(said, LoadError::Picture { .. }) && said.to_string().contains("view_002.png"), "{said}");
    fs::remove_file(&path).unwrap();
    let said = load(None).unwrap_err().to_string();
    assert!(said.contains("view_002") && said.contains("cannot read"), "{said}");
}

#[test]
fn lenses_that_bend_and_too_many_pixels_are_refused() {
    let (folder, _) = written();
    let mut capture = read_capture(folder.path()).unwrap();
    capture.views[1].is_distorted = true;
    let said = load_photographs(&capture, None, None, [0.0; 3]).unwrap_err().to_string();
    assert!(said.contains("view_001") && said.contains("image_undistorter"), "{said}");
    capture.views[1].is_distorted = false;
    capture.views[0].camera.width = 2_000_000_000;
    let said = load_photographs(&capture, None, None, [0.0; 3]).unwrap_err().to_string();
    assert!(said.contains("--height"), "{said}");
    capture.views[2].picture = None;
    capture.views[0].camera.width = 64;
    assert!(matches!(load_photographs(&capture, None, None, [0.0; 3]), Err(LoadError::Unnamed(_))));
}

#[test]
fn only_regular_files_that_end_soon_are_read() {
    let (folder, _) = written();
    let refused = |name: &str| {
        let mut capture = read_capture(folder.path()).unwrap();
        capture.views[1].picture = Some(name.into());
        capture.points.clear();
        capture.points_file = Some(folder.path().join(name));
        let picture = load_photographs(&capture, None, None, [0.0; 3]).unwrap_err();
        [picture, load_points(&capture).unwrap_err()]
    };
    // A device has no end, and a directory is no picture.
    for name in
        ["/dev/zero", "images"].into_iter().filter(|name| Path::new(name).exists() || !name.starts_with('/'))
    {
        for said in refused(name) {
            assert!(matches!(said, LoadError::NoFile { .. }) && said.to_string().contains(name), "{said}");
        }
    }
    fs::File::create(folder.path().join("long.png")).unwrap().set_len((256 << 20) + 1).unwrap();
    for said in refused("long.png") {
        let is_named = said.to_string().contains("long.png: the file has more than 268435456 bytes");
        assert!(matches!(said, LoadError::TooLong { .. }) && is_named, "{said}");
    }
}

#[test]
fn pictures_are_compared_with_cameras_before_they_are_decoded() {
    let (folder, cameras) = written();
    let path = folder.path().join("images/view_001.png");
    let load = || load_photographs(&read_capture(folder.path()).unwrap(), None, None, [0.0; 3]).unwrap_err();
    // Of another shape, and damaged after its head: the shape is what is said.
    let mut square = SIMULATION.picture(&cameras[1], 0.2).averaged(36, 36).to_png().unwrap();
    square.truncate(50);
    fs::write(&path, square).unwrap();
    let said = load();
    assert!(matches!(said, LoadError::Size { .. }) && said.to_string().contains("[36, 36]"), "{said}");
    // Of the right shape, damaged there.
    let mut cut = fs::read(folder.path().join("images/view_002.png")).unwrap();
    cut.truncate(cut.len() / 2);
    fs::write(&path, cut).unwrap();
    let said = load();
    assert!(matches!(said, LoadError::Picture { .. }) && said.to_string().contains("view_001"), "{said}");
}

#[test]
fn names_from_captures_do_not_reach_terminals_as_they_are() {
    let (folder, _) = written();
    let mut capture = read_capture(folder.path()).unwrap();
    capture.points.clear();
    capture.points_file = Some(folder.path().join("\u{1b}[2J.ply"));
    let said = load_points(&capture).unwrap_err().to_string();
    assert!(said.contains("\\u{1b}[2J.ply: cannot read") && !said.contains('\u{1b}'), "{said:?}");
}
