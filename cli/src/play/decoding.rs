//! GOPs to frames, beside playback.

use crate::failure::Failure;
use serde::Serialize;
use splatstream_decoder::operating_point::OperatingPoint;
use splatstream_decoder::process::Options;
use splatstream_decoder::stream::{Step, StreamDecoder};
use splatstream_format::{Class, Error};
use splatstream_stream::client::PlayedGop;
use std::collections::BTreeMap;
use std::sync::mpsc::{SyncSender, sync_channel};
use std::thread::JoinHandle;
use std::time::Instant;

/// What became of a GOP.
#[derive(Debug, Clone, Default, Serialize)]
pub(super) struct Decoded {
    pub(super) frames: u32,
    pub(super) gaussians: u64,
    pub(super) seconds: f64,
    /// Pairs of the first and last display index of frames that are not there.
    pub(super) lost: Vec<(u32, u32)>,
    /// What was wrong, in words.
    pub(super) errors: Vec<String>,
    /// The error that counts most: that of a limit, or else the first one.
    #[serde(skip)]
    pub(super) worst: Option<Error>,
}

impl Decoded {
    fn add(&mut self, error: Error) {
        let is_limit = |error: &Error| error.class() == Class::OverLimit;
        self.errors.push(error.to_string());
        if self.worst.is_none_or(|worst| is_limit(&error) && !is_limit(&worst)) {
            self.worst = Some(error);
        }
    }

    /// Whether a limit kept something from being decoded.
    pub(super) fn is_over_limit(&self) -> bool {
        self.worst.is_some_and(|error| error.class() == Class::OverLimit)
    }
}

/// GOPs that wait to be decoded: so the memory is bounded, and a slow decoder holds playback up.
const WAITING: usize = 2;

struct Job {
    number: usize,
    point: OperatingPoint,
    /// Whether only the first frame is wanted.
    intra: bool,
    head: usize,
    bytes: Vec<u8>,
}

/// A decoder in a thread of its own.
pub(super) struct Decoding {
    running: Option<Running>,
}

struct Running {
    jobs: SyncSender<Job>,
    thread: JoinHandle<BTreeMap<usize, Decoded>>,
}

impl Decoding {
    /// A decoder, if one is wanted.
    pub(super) fn start(wanted: bool, options: Options) -> Result<Self, Failure> {
        if !wanted {
            return Ok(Self { running: None });
        }
        let (jobs, waiting) = sync_channel::<Job>(WAITING);
        let work = move || waiting.iter().map(|job| (job.number, decode(&job, &options))).collect();
        let thread = std::thread::Builder::new().name("decoder".into()).spawn(work);
        let thread = thread.map_err(|error| Failure::other(format!("cannot start a decoder: {error}")))?;
        Ok(Self { running: Some(Running { jobs, thread }) })
    }

    /// Takes a GOP.
    pub(super) fn show(&mut self, gop: &PlayedGop<'_>) {
        let (Some(running), Some(point)) = (&self.running, gop.point) else { return };
        let temporal = point.temporal.unwrap_or(0);
        let job = Job {
            number: gop.number,
            point: OperatingPoint { spatial: point.spatial, temporal, refinement: point.refinement },
            intra: point.temporal.is_none(),
            head: gop.head.len(),
            bytes: [gop.head, gop.units].concat(),
        };
        // A decoder that has gone has nothing to say either.
        let _gone = running.jobs.send(job);
    }

    /// What became of all GOPs; nothing without a decoder.
    pub(super) fn finish(self) -> Result<BTreeMap<usize, Decoded>, Failure> {
        let Some(Running { jobs, thread }) = self.running else { return Ok(BTreeMap::new()) };
        drop(jobs);
        let stopped = |_| Failure::other("the decoder has stopped; please report this, with the package");
        thread.join().map_err(stopped)
    }
}

fn decode(job: &Job, options: &Options) -> Decoded {
    let options = Options { operating_point: job.point, ..*options };
    let mut decoded = Decoded::default();
    let start = Instant::now();
    let mut decoder = StreamDecoder::inside(job.head as u64, &options);
    loop {
        let at = decoder.position();
        let rest = usize::try_from(at).ok().and_then(|at| job.bytes.get(at..)).unwrap_or_default();
        // The end of the stream is only after its last GOP.
        match decoder.next_step(rest, false) {
            Ok(Step::Frame(frame)) => {
                if !frame.is_lost {
                    decoded.frames += 1;
                    decoded.gaussians += frame.planes.len() as u64;
                }
                if job.intra {
                    break;
                }
            }
            // At another place there are other bytes.
            Ok(Step::NeedMoreData(_)) if decoder.position() != at => {}
            Ok(Step::NeedMoreData(_) | Step::End) => break,
            Err(error) => {
                decoded.add(error);
                break;
            }
        }
    }
    decoded.seconds = start.elapsed().as_secs_f64();
    let summary = decoder.summary();
    decoded.lost = summary.lost.iter().map(|frames| (*frames.start(), *frames.end())).collect();
    for error in &summary.errors {
        decoded.add(*error);
    }
    decoded
}
