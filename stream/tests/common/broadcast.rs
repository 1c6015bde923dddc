//! A packager that writes in virtual time.

use super::{Files, apply, repeated, vectors};
use splatstream_format::Limits;
use splatstream_stream::division::Division;
use splatstream_stream::live::{Live, Settings};
use splatstream_stream::manifest::Manifest;
use splatstream_stream::package::{Layout, Options as Packaging, Package};

/// When the first bytes come, by the clock of the packager.
const START_MS: u64 = 1_767_225_600_000;

/// Milliseconds of a frame. The four GOPs of the stream that is repeated have 5, 2, 2 and 2.
const FRAME_MS: u64 = 200;

/// 24 GOPs of 0.4 s and 1 s: 13.2 s.
fn stream() -> Vec<u8> {
    let path = vectors().into_iter().find(|path| path.to_string_lossy().contains("temporal-gops-mixed"));
    repeated(&std::fs::read(path.unwrap()).unwrap(), 6, FRAME_MS as u32)
}

/// What a packager has written, and when by the player's clock.
pub(crate) struct Broadcast {
    pub(crate) stream: Vec<u8>,
    pub(crate) history: Vec<(u64, Files)>,
}

impl Broadcast {
    /// Frames come in real time: the first bytes at 0 s of the player's clock, later ones when the next frame or GOP begins.
    pub(crate) fn new(layout: Layout, window_ms: u32) -> Self {
        let stream = stream();
        let settings = Settings { window_ms, ..Settings::new(Packaging { layout, ..Packaging::default() }) };
        let division = Division::of(&stream, &Limits::default()).unwrap();
        let (mut live, mut files) = (Live::new(&settings, &Limits::default()), Files::new());
        let mut history = Vec::new();
        let mut at = 0;
        for piece in division.gops.iter().flat_map(|gop| &gop.pieces) {
            let now_ms = u64::from(piece.place.frame) * FRAME_MS;
            let end = piece.end as usize;
            apply(&mut files, live.push(&stream[at..end], START_MS + now_ms).unwrap());
            history.push((now_ms * 1000, files.clone()));
            at = end;
        }
        let now_ms = 13_200;
        apply(&mut files, live.push(&stream[at..], START_MS + now_ms).unwrap());
        apply(&mut files, live.finish(START_MS + now_ms).unwrap());
        history.push((now_ms * 1000, files));
        Self { stream, history }
    }

    /// The files at a time.
    pub(crate) fn files(&self, now_us: u64) -> &Files {
        let so_far = self.history.iter().take_while(|(at_us, _)| *at_us <= now_us);
        &so_far.last().unwrap().1
    }

    pub(crate) fn manifest(&self, now_us: u64) -> Option<Manifest> {
        self.files(now_us).get(Package::MANIFEST).map(|bytes| Manifest::parse(bytes).unwrap())
    }
}
