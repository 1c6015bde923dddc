//! Scenes come out of pictures: better than they began, the same every time.
#![allow(clippy::unwrap_used, missing_docs, reason = "a panic is a failed test")]

use splatstream_capture::Photograph;
use splatstream_capture::simulator::{Rig, Simulation};
use splatstream_capture::trainer::{Settings, TrainError, Trainer, start_at_random, start_of_points};
use splatstream_gaussians::{GaussianFrame, Planes};
use splatstream_render::PreparedFrame;

const SIMULATION: Simulation = Simulation { seed: 1, samples: 2 };

/// Pictures to train with, and others.
fn pictures(seconds: f64) -> [Vec<Photograph>; 2] {
    let cameras = Rig::Forward.cameras(10, [128, 72]);
    let take = |camera| Photograph::new(camera, &SIMULATION.picture(camera, seconds), None).unwrap();
    let all: Vec<Photograph> = cameras.iter().map(take).collect();
    let (mut trained, mut others) = (Vec::new(), Vec::new());
    for (at, photograph) in all.into_iter().enumerate() {
        if at % 5 == 2 { others.push(photograph) } else { trained.push(photograph) }
    }
    [trained, others]
}

fn start(count: u32) -> GaussianFrame {
    let cameras = Rig::Forward.cameras(10, [128, 72]);
    start_of_points(&SIMULATION.points(&cameras, 0.0, count)).unwrap()
}

fn psnr(frame: &GaussianFrame, photographs: &[Photograph]) -> f64 {
    let prepared = PreparedFrame::new(frame);
    let sum: f64 = photographs.iter().map(|photograph| photograph.psnr(&prepared, [0.0; 3])).sum();
    sum / photographs.len() as f64
}

fn trained(photographs: &[Photograph], start: GaussianFrame, settings: Settings) -> GaussianFrame {
    let mut trainer = Trainer::new(photographs, start, settings).unwrap();
    let mut steps = 0;
    while let Some(step) = trainer.step().unwrap() {
        steps += 1;
        assert_eq!(step.iteration, steps);
        assert!(step.loss.is_finite() && step.gaussians <= settings.gaussians.max(trainer.frame().len()));
    }
    assert_eq!(steps, settings.iterations);
    trainer.finish()
}

#[test]
fn pictures_that_were_not_trained_with_come_out_too() {
    let [photographs, others] = pictures(0.0);
    let start = start(1500);
    let before = psnr(&start, &others);
    let settings = Settings { iterations: 200, gaussians: 3000, ..Settings::default() };
    let frame = trained(&photographs, start, settings);
    let after = psnr(&frame, &others);
    assert!(after > before + 6.0 && after > 19.0, "{before} {after}");
    assert!((1800..=3000).contains(&frame.len()) && frame.sh_degree() == 2, "{}", frame.len());
    assert!(frame.validate().is_ok());
}

#[test]
fn any_number_of_threads_trains_the_same_scene() {
    let [photographs, _] = pictures(0.0);
    let settings = Settings { iterations: 60, gaussians: 1200, ..Settings::default() };
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| trained(&photographs, start(600), settings))
    };
    let one = with(1);
    assert!(one.len() > 600);
    assert_eq!(one, with(3));
    assert_ne!(one, trained(&photographs, start(600), Settings { seed: 2, ..settings }));
}

#[test]
fn a_warm_start_keeps_every_gaussian_in_its_row_and_follows_what_moves() {
    let [first, _] = pictures(0.0);
    let settings = Settings { iterations: 120, gaussians: 2500, ..Settings::default() };
    let before = trained(&first, start(1500), settings);
    let [next, others] = pictures(0.2);
    let warm = Settings { iterations: 60, densify: false, pace: Settings::NEAR, ..settings };
    let after = trained(&next, before.clone(), warm);
    assert_eq!((after.len(), after.sh_degree()), (before.len(), before.sh_degree()));
    let [stale, fresh] = [&before, &after].map(|frame| psnr(frame, &others));
    assert!(fresh > stale + 0.5, "{stale} {fresh}");
    // Held, it follows as well, and much of it has not changed at all.
    let held = trained(&next, before.clone(), Settings { hold: 0.3, ..warm });
    let equal = |frame: &GaussianFrame| {
        let values = frame.planes().iter().flatten().zip(before.planes().iter().flatten());
        let (mut equal, mut all) = (0, 0);
        for (value, before) in values {
            equal += usize::from(value == before);
            all += 1;
        }
        equal as f64 / f64::from(all)
    };
    let follows = psnr(&held, &others);
    assert!(follows > stale + 0.3, "{stale} {follows}");
    assert!(equal(&after) < 0.2 && equal(&held) > 0.35, "{} {}", equal(&after), equal(&held));
}

#[test]
fn degrees_come_with_the_settings_and_stay_where_none_is_added() {
    let [photographs, _] = pictures(0.0);
    for sh_degree in [0, 3] {
        let settings = Settings { iterations: 20, sh_degree, gaussians: 400, ..Settings::default() };
        let frame = trained(&photographs, start(300), settings);
        assert_eq!(frame.sh_degree(), sh_degree);
        let lower = Settings { sh_degree: 1, densify: false, iterations: 2, ..settings };
        assert_eq!(trained(&photographs, frame, lower).sh_degree(), sh_degree.max(1));
    }
}

#[test]
fn a_random_start_is_one_too() {
    let [photographs, others] = pictures(0.0);
    let cameras: Vec<_> = photographs.iter().map(Photograph::camera).collect();
    let points = start_at_random(&cameras, 2000, 1);
    assert_eq!(points, start_at_random(&cameras, 2000, 1));
    let start = start_of_points(&points).unwrap();
    let before = psnr(&start, &others);
    let settings = Settings { iterations: 200, gaussians: 3000, antialiased: true, ..Settings::default() };
    let frame = trained(&photographs, start, settings);
    let after = psnr(&frame, &others);
    assert!(after > before + 1.5 && frame.antialiased(), "{before} {after}");
}

#[test]
fn nothing_to_learn_from_and_nothing_to_start_from_are_errors() {
    let [photographs, _] = pictures(0.0);
    let none = GaussianFrame::from_planes(0, Planes::default()).unwrap();
    assert_eq!(Trainer::new(&[], start(10), Settings::default()).err(), Some(TrainError::Pictures));
    assert_eq!(Trainer::new(&photographs, none, Settings::default()).err(), Some(TrainError::Points));
}
