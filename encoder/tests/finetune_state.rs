//! Fitting to pictures that is ended and gone on with: the bytes are those of a run that nobody ended, and no state is mistaken
//! for another.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "a panic is a failed test")]

#[path = "common/mod.rs"]
mod common;

use common::{builtin, encoded};
use splatstream_decoder::interrupt::Interrupt;
use splatstream_encoder::{
    Encoder, Error, Finetune, FinetuneLoss, FinetuneState, FinetuneWatch, Photograph, PointWeight, Preset,
    Report, Settings, StateError, Structure, encode,
};
use splatstream_files::builtin::BuiltinScene;
use splatstream_gaussians::GaussianFrame;
use splatstream_render::camera::{Up, ring};
use splatstream_render::{Camera, render};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use tempfile::{TempDir, tempdir};

/// In pictures of a few lines.
fn settings(iterations: u32) -> Settings {
    let finetune = Finetune { iterations, lines: vec![60, 108], ..Finetune::default() };
    Settings { preset: Preset::Fast, finetune: Some(finetune), ..Settings::default() }
}

fn moving(count: u32) -> Vec<GaussianFrame> {
    let scene = BuiltinScene { gaussians: 400, frames: count, sh_degree: 1, ..BuiltinScene::default() };
    (0..count).map(|number| scene.frame(number)).collect()
}

/// Settings that keep a state.
fn keeping(settings: &Settings, state: &FinetuneState) -> Settings {
    let mut settings = settings.clone();
    settings.finetune.iter_mut().for_each(|finetune| finetune.state = state.clone());
    settings
}

/// The same that end after so many iterations, counted over all fits.
fn ending(settings: &Settings, after: u32) -> Settings {
    let (cancel, told) = (Interrupt::new(), Arc::new(AtomicU32::new(0)));
    let request = cancel.clone();
    let watch = FinetuneWatch::new(move |_| {
        if told.fetch_add(1, Ordering::Relaxed) + 1 == after {
            request.request();
        }
    });
    let mut settings = settings.clone();
    settings
        .finetune
        .iter_mut()
        .for_each(|finetune| finetune.watch = watch.clone().with_cancel(cancel.clone()));
    settings
}

type Encoded = Result<(Vec<u8>, Report), Error>;

/// A run that goes on with what is in a directory, and ends after so many iterations.
fn run(frames: &[GaussianFrame], settings: &Settings, directory: &Path, after: u32) -> Encoded {
    let state = FinetuneState::resume(directory, settings)?;
    let settings = ending(&keeping(settings, &state), after);
    let mut bytes = Vec::new();
    let report = encode(&mut frames.to_vec(), &settings, &mut bytes, &mut |_, _| ())?;
    state.remove()?;
    Ok((bytes, report))
}

/// Ends a run again and again after so many iterations until one comes to its end; gives that, and how many did not.
fn piecewise(frames: &[GaussianFrame], settings: &Settings, after: u32) -> (Vec<u8>, Report, u32) {
    let around = tempdir().unwrap();
    let directory = around.path().join("state");
    for ended in 0..100 {
        match run(frames, settings, &directory, after) {
            Ok((bytes, report)) => {
                assert!(!directory.exists());
                return (bytes, report, ended);
            }
            Err(Error::Cancelled) => {}
            Err(error) => panic!("{error}"),
        }
    }
    panic!("it comes no further with {settings:?}");
}

#[test]
fn a_run_that_was_ended_anywhere_gives_the_bytes_of_one_that_was_not() {
    let (frames, settings) = (vec![builtin(600, 1)], settings(60));
    let (bytes, whole) = encoded(frames.clone(), &settings);
    for (after, resumed) in [(1, 0), (19, 0), (20, 20), (33, 20), (40, 40), (59, 40), (60, 60)] {
        let directory = tempdir().unwrap();
        match run(&frames, &settings, directory.path(), after) {
            // The last iteration is followed by none that could be left out.
            Ok(_) => assert_eq!(after, 60),
            other => assert!(matches!(other, Err(Error::Cancelled)), "{after}: {other:?}"),
        }
        let (again, report) = run(&frames, &settings, directory.path(), u32::MAX).unwrap();
        assert!(again == bytes, "ended after {after} iterations");
        let [one] = report.finetuned.as_slice() else { panic!("{report:?}") };
        let resumed = if after == 60 { 0 } else { resumed };
        assert_eq!((one.iterations, one.resumed), (60, resumed), "ended after {after}");
        assert_eq!((one.psnr, one.bits, &one.points), {
            let one = &whole.finetuned[0];
            (one.psnr, one.bits, &one.points)
        });
    }
}

#[test]
fn every_kind_of_fit_goes_on() {
    let still = vec![builtin(400, 1)];
    let point = |refinement| splatstream_decoder::operating_point::OperatingPoint {
        spatial: 0,
        temporal: 0,
        refinement,
    };
    let finetuned = |change: &dyn Fn(&mut Finetune)| {
        let mut settings = settings(45);
        settings.finetune.iter_mut().for_each(change);
        settings
    };
    let points =
        [(1, 1.0), (4, 2.5)].map(|(refinement, weight)| PointWeight { point: point(refinement), weight });
    let photographs = {
        let cameras = ring(&still[0], Up::default(), 16, 90);
        let taken =
            |camera: Camera| Photograph { picture: render(&still[0], &camera, [0.1; 3]).colour, camera };
        cameras.into_iter().map(taken).collect::<Vec<_>>()
    };
    let layered = Settings { spatial_layers: 2, ..settings(45) };
    let predicted = Settings { structure: Structure::Predicted { layers: 1 }, gop: 2, ..layered.clone() };
    let cases = [
        ("prefixes, which are compensated", &still, finetuned(&|one| one.optimise_for = points.to_vec())),
        ("L1 and SSIM", &still, finetuned(&|one| one.loss = FinetuneLoss::l1_ssim())),
        ("several resolutions", &still, finetuned(&|one| one.resolutions = vec![60, 90, 108])),
        ("photographs", &still, finetuned(&|one| one.photographs.clone_from(&photographs))),
        ("spatial layers", &still, layered),
        ("several fits, for a quality", &still, Settings { psnr: Some(40.0), ..settings(45) }),
        ("several frames", &moving(2), settings(45)),
        ("I frames of several GOPs", &moving(4), predicted),
    ];
    for (name, frames, settings) in cases {
        let (bytes, whole) = encoded(frames.clone(), &settings);
        // Of two GOPs that are fitted at the same time one comes to 20 iterations.
        let after = if settings.gop == 2 { 50 } else { 30 };
        let (again, report, ended) = piecewise(frames, &settings, after);
        assert!(again == bytes, "{name}");
        assert!(ended > 0, "{name}");
        let numbers = |report: &Report| {
            let number =
                |one: &splatstream_encoder::FinetuneReport| (one.frame, one.spatial_layer, one.iterations);
            report.finetuned.iter().map(number).collect::<Vec<_>>()
        };
        assert_eq!(numbers(&report), numbers(&whole), "{name}");
    }
}

#[test]
fn frames_that_are_pushed_go_on_too() {
    let (frames, settings) = (moving(3), Settings { gop: 1, ..settings(25) });
    let push = |settings: &Settings, cancel: Option<Interrupt>| -> Encoded {
        let mut bytes = Vec::new();
        let mut encoder = Encoder::new(&mut bytes, settings.clone());
        cancel.into_iter().for_each(|cancel| encoder.set_cancel(cancel));
        frames.iter().try_for_each(|frame| encoder.push(frame.clone()))?;
        let report = encoder.finish()?;
        Ok((bytes, report))
    };
    // One GOP after the other, so that it is known which iterations come before which.
    let one_by_one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let push = |settings: &Settings, cancel| one_by_one.install(|| push(settings, cancel));
    let (bytes, _) = push(&settings, None).unwrap();
    let directory = tempdir().unwrap();
    let state = FinetuneState::create(directory.path(), &settings).unwrap();
    let (cancel, told) = (Interrupt::new(), Arc::new(AtomicU32::new(0)));
    let (request, count) = (cancel.clone(), Arc::clone(&told));
    let watch = FinetuneWatch::new(move |_| {
        if count.fetch_add(1, Ordering::Relaxed) + 1 == 47 {
            request.request();
        }
    });
    let mut cancelled = keeping(&settings, &state);
    cancelled.finetune.iter_mut().for_each(|finetune| finetune.watch = watch.clone());
    assert!(matches!(push(&cancelled, Some(cancel)), Err(Error::Cancelled)));
    // Not even the iteration after it.
    assert_eq!(told.load(Ordering::Relaxed), 47);
    let state = FinetuneState::resume(directory.path(), &settings).unwrap();
    let (again, report) = push(&keeping(&settings, &state), None).unwrap();
    assert!(again == bytes);
    assert_eq!(report.finetuned.iter().map(|one| one.resumed).collect::<Vec<_>>(), [25, 20, 0]);
}

/// A directory in which a run of some settings was ended on its way.
fn ended(frames: &[GaussianFrame], settings: &Settings) -> TempDir {
    let directory = tempdir().unwrap();
    assert!(matches!(run(frames, settings, directory.path(), 30), Err(Error::Cancelled)));
    directory
}

/// Why a run could not go on.
fn refusal(frames: &[GaussianFrame], settings: &Settings, directory: &Path) -> StateError {
    match run(frames, settings, directory, u32::MAX) {
        Err(Error::FinetuneState(error)) => error,
        other => panic!("{:?}", other.map(|(_, report)| report)),
    }
}

#[test]
fn the_state_of_another_run_is_refused() {
    let (frames, settings) = (vec![builtin(400, 1)], settings(60));
    let directory = ended(&frames, &settings);
    let again = FinetuneState::create(directory.path(), &settings);
    assert!(matches!(again, Err(StateError::Exists { .. })), "{again:?}");
    let named = |settings: &Settings| match refusal(&frames, settings, directory.path()) {
        StateError::OtherSetting { name, .. } => name,
        other => panic!("{other:?}"),
    };
    assert_eq!(named(&Settings { finetune: self::settings(61).finetune, ..settings.clone() }), "finetune");
    assert_eq!(named(&Settings { psnr: Some(45.0), ..settings.clone() }), "psnr");
    assert_eq!(named(&Settings { spatial_layers: 2, ..settings.clone() }), "spatial_layers");
    assert_eq!(named(&Settings { prune: Some(60.0), ..settings.clone() }), "prune");
    let mut other = frames.clone();
    other[0].planes_mut().dc[1][7] += 0.5;
    let refused = refusal(&other, &settings, directory.path());
    assert!(matches!(refused, StateError::OtherFrame { frame: 0, .. }), "{refused}");
    // What is refused is not lost.
    assert!(run(&frames, &settings, directory.path(), u32::MAX).is_ok());
}

/// The files of fits.
fn fits(directory: &Path) -> Vec<PathBuf> {
    let paths = fs::read_dir(directory).unwrap().map(|entry| entry.unwrap().path());
    paths.filter(|path| path.extension().is_some_and(|ending| ending == "fit")).collect()
}

#[test]
fn a_damaged_state_is_an_error() {
    let (frames, settings) = (vec![builtin(60, 0), builtin(50, 0)], settings(40));
    let directory = tempdir().unwrap();
    // The first frame is finished, the second one under way.
    assert!(matches!(run(&frames, &settings, directory.path(), 65), Err(Error::Cancelled)));
    let mut names = fits(directory.path());
    names.push(directory.path().join("settings"));
    assert_eq!(names.len(), 3);
    for path in names {
        let whole = fs::read(&path).unwrap();
        let is_refused = |bytes: &[u8]| {
            fs::write(&path, bytes).unwrap();
            let refused = refusal(&frames, &settings, directory.path());
            let StateError::Damaged { path: named, .. } = &refused else { panic!("{refused}") };
            let is_of_settings = path.ends_with("settings");
            assert_eq!(named, if is_of_settings { directory.path() } else { &path });
        };
        for length in [0, 7, 16, 17, 30, whole.len() / 2, whole.len() - 1] {
            is_refused(&whole[..length]);
        }
        if path.ends_with("settings") {
            is_refused(&[whole.as_slice(), b"\xff"].concat());
            fs::write(&path, &whole).unwrap();
            continue;
        }
        is_refused(&[whole.as_slice(), b"x"].concat());
        let places = (0..30).chain((30..whole.len()).step_by(whole.len() / 12)).chain([whole.len() - 1]);
        for place in places {
            for mask in [0x01, 0x80] {
                let mut damaged = whole.clone();
                damaged[place] ^= mask;
                is_refused(&damaged);
            }
        }
        fs::write(&path, &whole).unwrap();
    }
    fs::remove_file(directory.path().join("settings")).unwrap();
    let refused = refusal(&frames, &settings, directory.path());
    assert!(matches!(&refused, StateError::Damaged { path, .. } if path == directory.path()), "{refused}");
}

#[test]
fn files_of_others_stay_where_they_are() {
    let (frames, settings) = (vec![builtin(60, 0)], settings(20));
    let directory = tempdir().unwrap();
    let note = directory.path().join("note.txt");
    fs::write(&note, "mine").unwrap();
    run(&frames, &settings, directory.path(), u32::MAX).unwrap();
    let left: Vec<_> = fs::read_dir(directory.path()).unwrap().map(|entry| entry.unwrap().path()).collect();
    assert_eq!(left, [note]);
}
