//! Frames that are pushed: bytes come GOP by GOP, and the stream is as good as one whose frames were all known.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, missing_docs, reason = "a panic is a failed test")]

mod common;

use common::{decoded, encoded, strict};
use splatstream_decoder::interrupt::Interrupt;
use splatstream_decoder::output::to_gaussians;
use splatstream_decoder::stream::Frames;
use splatstream_encoder::{Encoder, Error, Preset, Report, Settings, Size, Structure, encode};
use splatstream_files::builtin::BuiltinScene;
use splatstream_gaussians::GaussianFrame;
use std::sync::{Arc, Mutex};

fn settings() -> Settings {
    let structure = Structure::Predicted { layers: 2 };
    Settings { preset: Preset::Fast, gop: 4, structure, ..Settings::default() }
}

fn frames(count: u32) -> Vec<GaussianFrame> {
    let scene = BuiltinScene { gaussians: 800, frames: count, sh_degree: 1, ..BuiltinScene::default() };
    (0..count).map(|number| scene.frame(number)).collect()
}

fn pushed(frames: &[GaussianFrame], settings: &Settings) -> (Vec<u8>, Report) {
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, settings.clone());
    frames.iter().for_each(|frame| encoder.push(frame.clone()).unwrap());
    let report = encoder.finish().unwrap();
    (bytes, report)
}

/// The largest error of a position, in parts of the step of the grid.
fn largest_error(bytes: &[u8], source: &[GaussianFrame]) -> f32 {
    let mut decoded = Frames::open(bytes, &strict()).unwrap();
    let mut largest = 0.0_f32;
    for original in source {
        let frame = decoded.next_frame().unwrap();
        let sequence = *decoded.sequence().unwrap();
        let step = sequence.position_step();
        let frame = to_gaussians(frame.into_shown(), &sequence).unwrap();
        // Every Gaussian of the source has one of the stream near it.
        for row in (0..original.len()).step_by(97) {
            let at =
                |frame: &GaussianFrame, row: usize| [0, 1, 2].map(|axis: usize| frame.position()[axis][row]);
            let wanted = at(original, row);
            let apart = |other: usize| {
                let found = at(&frame, other);
                (0..3).map(|axis| (found[axis] - wanted[axis]).abs()).fold(0.0, f32::max)
            };
            largest = largest.max((0..frame.len()).map(apart).fold(f32::INFINITY, f32::min) / step);
        }
    }
    assert!(decoded.next_frame().is_none());
    assert_eq!(decoded.summary().verdict(), None);
    largest
}

#[test]
fn one_gop_is_what_all_frames_known_give() {
    let frames = frames(4);
    assert_eq!(pushed(&frames, &settings()), encoded(frames, &settings()));
}

#[test]
fn a_longer_sequence_is_as_true_as_one_that_is_known() {
    let frames = frames(14);
    let (bytes, report) = pushed(&frames, &settings());
    let (known, _) = encoded(frames.clone(), &settings());
    assert_eq!((report.frames, report.bytes, report.coded.len()), (14, bytes.len() as u64, 14));
    let digests: Vec<u64> = decoded(&bytes, &strict()).0.iter().map(|frame| frame.digest.unwrap()).collect();
    assert_eq!(digests, report.digests);
    let errors = [largest_error(&bytes, &frames), largest_error(&known, &frames)];
    assert!(errors[0] <= errors[1] + 1.0, "{errors:?}");
    assert!(bytes.len() as f64 <= 1.1 * known.len() as f64, "{} {}", bytes.len(), known.len());
    let mut read = Frames::open(&bytes, &strict()).unwrap();
    read.next_frame().unwrap();
    assert_eq!(read.sequence().unwrap().frame_count, 0);
}

#[test]
fn the_bytes_of_a_gop_are_written_before_the_next_gop_is_there() {
    let mut sent = Vec::new();
    let (sender, receiver) = std::sync::mpsc::channel();
    let mut encoder = Encoder::new(Chunks(sender), settings());
    let mut complete = Vec::new();
    for frame in frames(13) {
        encoder.push(frame).unwrap();
        receiver.try_iter().for_each(|chunk: Vec<u8>| sent.extend(chunk));
        complete.push(match sent.is_empty() {
            true => 0,
            false => {
                let mut decoder = Frames::open(&sent, &strict()).unwrap();
                std::iter::from_fn(|| decoder.next_frame()).count()
            }
        });
    }
    // Only the first waits for one frame more, which shows that there is another GOP.
    assert_eq!(complete, [0, 0, 0, 0, 4, 4, 4, 8, 8, 8, 8, 12, 12]);
    encoder.finish().unwrap();
}

struct Chunks(std::sync::mpsc::Sender<Vec<u8>>);

impl std::io::Write for Chunks {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.send(bytes.to_vec()).map_err(std::io::Error::other)?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

#[test]
fn steps_are_fitted_to_the_first_frames() {
    let asked = Settings { psnr: Some(42.0), ..settings() };
    let (bytes, report) = pushed(&frames(9), &asked);
    assert!(report.target.is_some());
    let psnr = report.pictures.unwrap().fitted_psnr().unwrap();
    assert!((psnr - 42.0).abs() < 1.0, "{psnr}");
    assert_eq!(decoded(&bytes, &strict()).0.len(), 9);
    let rate = Settings { size: Some(Size::BitsPerGaussian(30.0)), ..settings() };
    let (bytes, report) = pushed(&frames(9), &rate);
    let bits = 8.0 * bytes.len() as f64 / report.gaussians as f64;
    assert!((bits / 30.0 - 1.0).abs() < 0.2, "{bits}");
}

#[test]
fn a_size_of_the_whole_stream_is_refused() {
    let asked = Settings { size: Some(Size::Bytes(10_000)), ..settings() };
    let mut encoder = Encoder::new(Vec::new(), asked);
    let refused = frames(5).into_iter().find_map(|frame| encoder.push(frame).err()).unwrap();
    assert!(matches!(refused, Error::Setting { name: "size", .. }), "{refused}");
}

#[test]
fn frames_that_leave_what_was_announced_are_held_and_told() {
    let mut frames = frames(9);
    frames[7].planes_mut().position[0][3] = 1e7;
    frames[7].planes_mut().log_scale[2][4] = 80.0;
    let (bytes, report) = pushed(&frames, &settings());
    assert_eq!(decoded(&bytes, &strict()).0.len(), 9);
    let told: Vec<_> = report.isolated.iter().map(|one| (one.attribute, one.frame, one.row)).collect();
    assert!(told.contains(&("position", 7, 3)) && told.contains(&("log_scale", 7, 4)), "{told:?}");
}

#[test]
fn invalid_gaussians_are_refused_or_left_out() {
    let mut frames = frames(9);
    frames[6].planes_mut().dc[1][5] = f32::NAN;
    let mut encoder = Encoder::new(Vec::new(), settings());
    let refused = frames.iter().find_map(|frame| encoder.push(frame.clone()).err());
    assert!(matches!(refused, Some(Error::Invalid { frame: 6, count: 1, .. })), "{refused:?}");
    let (bytes, report) = pushed(&frames, &Settings { drop_invalid: true, ..settings() });
    assert_eq!(report.dropped.len(), 1);
    assert_eq!((report.dropped[0].frame, report.dropped[0].gaussians, report.invisible), (6, 1, 0));
    assert_eq!(decoded(&bytes, &strict()).0[6].planes.len(), 799);
}

#[test]
fn coded_frames_are_told_one_by_one() {
    let told = Arc::new(Mutex::new(Vec::new()));
    let mut encoder = Encoder::new(Vec::new(), settings());
    let sender = told.clone();
    encoder.set_progress(move |done| sender.lock().unwrap().push(done));
    for frame in frames(10) {
        encoder.push(frame).unwrap();
    }
    encoder.finish().unwrap();
    let told = told.lock().unwrap();
    assert!(told.is_sorted() && told.len() >= 10, "{told:?}");
    assert_eq!(told.last(), Some(&10));
}

#[test]
fn a_cancellation_ends_encoding_before_the_next_frame() {
    let cancel = Interrupt::new();
    let mut encoder = Encoder::new(Vec::new(), settings());
    encoder.set_cancel(cancel.clone());
    let mut frames = frames(10).into_iter();
    // All of a GOP but the frame that completes it.
    frames.by_ref().take(settings().gop as usize).for_each(|frame| encoder.push(frame).unwrap());
    cancel.request();
    assert!(matches!(encoder.push(frames.next().unwrap()), Err(Error::Cancelled)));
    assert!(matches!(encoder.finish(), Err(Error::Cancelled)));
}

/// Nothing says where later Gaussians may be.
#[test]
fn a_first_gop_without_extent_is_refused() {
    let frames = frames(3);
    for first in [frames[0].select(&[]), frames[0].select(&[5])] {
        let settings = Settings { gop: 1, ..settings() };
        let mut encoder = Encoder::new(Vec::new(), settings);
        // What the first GOP and one frame more have is announced.
        let pushed = [first.clone(), first, frames[2].clone()].map(|frame| encoder.push(frame));
        let refused = pushed.into_iter().find_map(Result::err);
        let error = refused.or_else(|| encoder.finish().err()).unwrap();
        assert!(matches!(error, Error::NoExtent { frames: 2 }), "{error}");
    }
}

#[test]
fn frames_of_which_some_are_antialiased_are_refused() {
    let mut mixed = frames(3);
    mixed[2] = mixed[2].clone().with_antialiased(true);
    let error = encode(&mut mixed, &settings(), &mut Vec::new(), &mut |_, _| {}).unwrap_err();
    assert!(matches!(error, Error::Antialiasing { frame: 2, value: true }), "{error}");
    // A frame without Gaussians is as the others are.
    mixed[2] = mixed[2].select(&[]);
    encode(&mut mixed, &settings(), &mut Vec::new(), &mut |_, _| {}).unwrap();
}

/// A pipe: what was flushed can be read, and how much each time.
#[derive(Default)]
struct Pipe {
    bytes: usize,
    flushed: Vec<usize>,
}

impl std::io::Write for Pipe {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.bytes += bytes.len();
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.flushed.push(self.bytes);
        Ok(())
    }
}

/// Packages are made of a stream while it is encoded.
#[test]
fn each_gop_is_passed_on_when_it_is_coded() {
    let mut pipe = Pipe::default();
    let report = encode(&mut frames(12), &settings(), &mut pipe, &mut |_, _| {}).unwrap();
    assert_eq!(report.gops.len(), 3);
    let increasing = pipe.flushed.windows(2).all(|pair| pair[0] < pair[1]);
    assert!(pipe.flushed.len() >= 3 && increasing, "{:?}", pipe.flushed);
}
