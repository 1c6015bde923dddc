//! C.9: a stream that arrives in pieces is packaged as it comes, and the files are those of a package.
#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

mod common;

use arbitrary::{Arbitrary, Unstructured};
use common::mpd::check;
use common::{File, is_conforming, vectors, worked_example};
use proptest::prelude::*;
use roxmltree::Document;
use splatstream_format::Limits;
use splatstream_format::arbitrary_stream::ArbitraryStream;
use splatstream_stream::Representation;
use splatstream_stream::live::{Change, Live};
use splatstream_stream::package::{Layout, Options};
use splatstream_stream::unpackage::unpackage;
use std::collections::BTreeMap;

const START: &str = "2026-01-01T00:00:00Z";

/// A directory to which changes are made.
#[derive(Default)]
struct Directory {
    files: BTreeMap<String, Vec<u8>>,
    mpds: Vec<String>,
}

impl Directory {
    fn apply(&mut self, changes: Vec<Change>) {
        for Change { name, bytes, appends } in changes {
            if name == "manifest.mpd" {
                let mpd = String::from_utf8(bytes).unwrap();
                self.check(&mpd);
                self.mpds.push(mpd);
            } else if appends {
                self.files.get_mut(&name).unwrap().extend(bytes);
            } else {
                assert_eq!(self.files.insert(name.clone(), bytes), None, "{name} is written once");
            }
        }
    }

    /// What an MPD names is there, and the MPD obeys the schema.
    fn check(&self, mpd: &str) {
        let document = Document::parse(mpd).unwrap();
        check(document.root_element());
        let count = |name: &str| {
            document
                .descendants()
                .filter(|node| node.has_tag_name(("urn:mpeg:dash:schema:mpd:2011", name)))
                .collect::<Vec<_>>()
        };
        let gops: usize =
            count("S").iter().map(|s| 1 + s.attribute("r").map_or(0, |r| r.parse().unwrap())).sum();
        for representation in count("Representation") {
            let id = representation.attribute("id").unwrap();
            assert!(self.files.contains_key(&format!("{id}-init.mp4")));
            for number in 1..=gops {
                assert!(self.files.contains_key(&format!("{id}-{number}.m4s")), "{id}-{number}");
            }
        }
    }

    /// The files of Representations as C.9 puts them together.
    fn media(&self) -> Vec<(String, Vec<u8>)> {
        let inits = self.files.keys().filter_map(|name| name.strip_suffix("-init.mp4"));
        inits
            .map(|id| {
                let mut bytes = self.files[&format!("{id}-init.mp4")].clone();
                for segment in (1..).map_while(|number| self.files.get(&format!("{id}-{number}.m4s"))) {
                    bytes.extend(segment);
                }
                bytes.extend(self.files.get(&format!("{id}-end.m4s")).into_iter().flatten());
                (Representation::from_id(id).unwrap().file_name(), bytes)
            })
            .collect()
    }
}

/// Packages a stream that comes in pieces of a size.
fn live(stream: &[u8], layout: Layout, size: usize) -> Directory {
    let options = Options { layout, ..Options::default() };
    let (mut live, mut directory) = (Live::new(&options, &Limits::default(), START), Directory::default());
    for piece in stream.chunks(size) {
        directory.apply(live.push(piece, START).unwrap());
    }
    assert!(live.has_ended());
    directory.apply(live.finish(START).unwrap());
    directory
}

fn comes_back(stream: &[u8], layout: Layout, size: usize) -> Directory {
    let directory = live(stream, layout, size);
    let media = directory.media();
    let given: Vec<_> = media.iter().map(|(name, bytes)| (name.clone(), bytes.as_slice())).collect();
    assert!(unpackage(&given, &Limits::default()).unwrap() == stream);
    directory
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(128) })]

    // covers: SS-CR-027
    #[test]
    fn every_stream_comes_back_from_its_segments(
        seed in proptest::collection::vec(any::<u8>(), 0..6000),
        size in 1_usize..3000,
        is_low_latency: bool,
    ) {
        let stream = ArbitraryStream::arbitrary(&mut Unstructured::new(&seed)).unwrap().to_bytes().unwrap();
        comes_back(&stream, if is_low_latency { Layout::Frame } else { Layout::Gop }, size);
    }
}

// covers: SS-CR-027
#[test]
fn every_conforming_vector_comes_back_from_its_segments() {
    for path in vectors().into_iter().filter(|path| is_conforming(path)) {
        let stream = std::fs::read(&path).unwrap();
        for layout in [Layout::Gop, Layout::Frame] {
            comes_back(&stream, layout, 1000);
        }
    }
}

// covers: SS-CR-028, SS-CR-029
#[test]
fn the_mpd_is_dynamic_until_the_stream_ends() {
    let stream = worked_example();
    for layout in [Layout::Gop, Layout::Frame] {
        let directory = comes_back(&stream, layout, 64);
        let (last, earlier) = directory.mpds.split_last().unwrap();
        assert!(last.contains("type=\"static\"") && !last.contains("availabilityTimeOffset"), "{last}");
        for mpd in earlier {
            assert!(mpd.contains("type=\"dynamic\"") && mpd.contains("publishTime"), "{mpd}");
            assert_eq!(mpd.contains("availabilityTimeComplete=\"false\""), layout == Layout::Frame);
            assert_eq!(mpd.contains("<Latency ") && mpd.contains("<Resync "), layout == Layout::Frame);
        }
        assert!(!earlier.is_empty());
    }
}

// covers: SS-CR-027
#[test]
fn a_frame_is_written_before_the_next_one_is_complete() {
    let stream = worked_example();
    let options = Options { layout: Layout::Frame, ..Options::default() };
    let mut live = Live::new(&options, &Limits::default(), START);
    let frames = splatstream_stream::division::Division::of(&stream, &Limits::default()).unwrap();
    let second = frames.gops[0].pieces.iter().find(|piece| piece.place.frame == 1).unwrap();
    // The header of the next frame ends a frame.
    let (before, after) = stream.split_at(second.end as usize);
    let changes = live.push(before, START).unwrap();
    let segment = changes.iter().find(|change| change.name == "s0-1.m4s").unwrap();
    let file = File::parse("s0-1.m4s", &segment.bytes);
    assert_eq!(file.kinds(), ["styp"]);
    let grown = changes.iter().find(|change| change.name == "s0-1.m4s" && change.appends).unwrap();
    let file = File::parse("s0-1.m4s", &grown.bytes);
    assert_eq!(file.kinds()[..3], ["sidx", "ssix", "moof"]);
    // The MPD names the GOP that is not complete.
    let mpd = changes.iter().find(|change| change.name == "manifest.mpd").unwrap();
    assert!(String::from_utf8_lossy(&mpd.bytes).contains("<S "));
    assert!(changes.iter().any(|change| change.name == "t0-1.m4s"));
    assert!(changes.iter().all(|change| change.name != "t0-1.m4s" || !change.appends));
    live.push(after, START).unwrap();
}

#[test]
fn a_stream_that_is_cut_is_an_error() {
    let stream = worked_example();
    let mut live = Live::new(&Options::default(), &Limits::default(), START);
    live.push(&stream[..stream.len() - 36], START).unwrap();
    assert!(!live.has_ended());
    assert_eq!(live.finish(START).unwrap_err().kind.code(), "TRUNCATED");
}
