//! C.9: a stream that arrives in pieces is packaged as it comes, and the files are those of a package.
#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

mod common;

use arbitrary::{Arbitrary, Unstructured};
use common::mpd::check;
use common::{File, is_conforming, vectors, worked_example};
use core::ops::ControlFlow;
use proptest::prelude::*;
use roxmltree::Document;
use serde_json::Value;
use splatstream_decoder::process::Options as DecoderOptions;
use splatstream_decoder::stream::decode_stream;
use splatstream_format::Limits;
use splatstream_format::arbitrary_stream::ArbitraryStream;
use splatstream_format::syntax::UnitType;
use splatstream_format::unit::Stream;
use splatstream_stream::Representation;
use splatstream_stream::division::Division;
use splatstream_stream::live::{Change, Live, Settings};
use splatstream_stream::manifest::{ByteRange, LiveInfo, Manifest};
use splatstream_stream::package::{Layout, Options, Package};
use splatstream_stream::unpackage::{unpackage, unpackage_growing};
use std::collections::BTreeMap;
use std::sync::OnceLock;

/// The time when the first bytes come.
const START: u64 = 1_767_225_600_000;

fn settings(layout: Layout) -> Settings {
    Settings::new(Options { layout, ..Options::default() })
}

/// A directory to which changes are made.
#[derive(Default)]
struct Directory {
    files: BTreeMap<String, Vec<u8>>,
    mpds: Vec<String>,
    manifests: Vec<Manifest>,
}

impl Directory {
    fn apply(&mut self, changes: Vec<Change>) {
        for Change { name, bytes, appends } in changes {
            if name == Package::MPD {
                let mpd = String::from_utf8(bytes).unwrap();
                self.check(&mpd);
                self.mpds.push(mpd);
            } else if name == Package::MANIFEST {
                assert!(!appends, "a manifest is replaced");
                self.check_manifest(&bytes);
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

    /// A manifest obeys its schema, what it names is there, and it goes on from the one before.
    fn check_manifest(&mut self, bytes: &[u8]) {
        let manifest = Manifest::parse(bytes).unwrap();
        let text: Value = serde_json::from_slice(bytes).unwrap();
        let wrong: Vec<String> = schema().iter_errors(&text).map(|error| error.to_string()).collect();
        assert_eq!(wrong, [""; 0]);
        assert_eq!(manifest.to_json().as_bytes(), bytes, "what is put together is what is written");
        for one in &manifest.representations {
            self.holds(&one.file, &one.init);
            one.tail.iter().zip(&one.tail_file).for_each(|(tail, file)| self.holds(file, tail));
        }
        let subsegments = manifest.gops.iter().flat_map(|gop| &gop.subsegments);
        for (one, level) in subsegments.flat_map(|one| one.levels.iter().map(move |level| (one, level))) {
            self.holds(one.file.as_ref().unwrap(), &level.bytes);
        }
        if let Some(before) = self.manifests.last() {
            let end = |manifest: &Manifest| manifest.first_gop() as usize + manifest.gops.len();
            assert!(end(&manifest) >= end(before) && before.is_growing());
            assert!(manifest.first_gop() >= before.first_gop() || !manifest.is_growing());
        }
        self.manifests.push(manifest);
    }

    fn holds(&self, file: &str, range: &ByteRange) {
        let bytes = &self.files[file][range.offset as usize..][..range.size as usize];
        assert!(range.holds(bytes), "{file}: {range:?}");
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
    live_as(&settings(layout), stream, size)
}

fn live_as(settings: &Settings, stream: &[u8], size: usize) -> Directory {
    let (mut live, mut directory) = (Live::new(settings, &Limits::default()), Directory::default());
    for (piece, now_ms) in stream.chunks(size).zip(START..) {
        directory.apply(live.push(piece, now_ms).unwrap());
    }
    assert!(live.has_ended());
    directory.apply(live.finish(START + 1_000_000).unwrap());
    directory
}

fn schema() -> &'static jsonschema::Validator {
    static SCHEMA: OnceLock<jsonschema::Validator> = OnceLock::new();
    SCHEMA.get_or_init(|| {
        let schema: Value = serde_json::from_str(include_str!("../manifest.schema.json")).unwrap();
        jsonschema::validator_for(&schema).unwrap()
    })
}

fn comes_back(stream: &[u8], layout: Layout, size: usize) -> Directory {
    let directory = live(stream, layout, size);
    let media = directory.media();
    let given: Vec<_> = media.iter().map(|(name, bytes)| (name.clone(), bytes.as_slice())).collect();
    assert!(unpackage(&given, &Limits::default()).unwrap() == stream);
    let (last, earlier) = directory.manifests.split_last().unwrap();
    assert!(last.describes(stream) && !last.is_growing() && last.first_gop() == 0);
    assert!(earlier.iter().all(|manifest| manifest.is_growing() && !manifest.describes(stream)));
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

/// The stream of the GOPs of a live package that has not ended, when `count` of them are complete.
fn unpackaged(stream: &[u8], whole: &Division, count: usize) -> Vec<u8> {
    // The GOP after it has begun, so that it is complete.
    let begun = whole.gops[count].pieces[0].end as usize;
    let mut live = Live::new(&settings(Layout::Gop), &Limits::default());
    let mut directory = Directory::default();
    directory.apply(live.push(&stream[..begun], START).unwrap());
    let complete = directory.manifests.last().unwrap().complete_gops();
    assert_eq!(complete, count);
    directory.files.retain(|name, _| !name.ends_with(&format!("-{}.m4s", complete + 1)));
    let media = directory.media();
    let given: Vec<_> = media.iter().map(|(name, bytes)| (name.clone(), bytes.as_slice())).collect();
    // One that has not ended is not taken for one that has.
    assert!(unpackage(&given, &Limits::default()).is_err());
    unpackage_growing(&given, &Limits::default()).unwrap()
}

#[test]
fn complete_gops_of_a_package_that_has_not_ended_are_a_stream() {
    let path = vectors().into_iter().find(|path| path.to_string_lossy().contains("temporal-gops-mixed"));
    let stream = std::fs::read(path.unwrap()).unwrap();
    // This one announces its frames, of which a part has fewer.
    let announcing = include_bytes!("../../examples/talk.gss").as_slice();
    for (stream, announces) in [(stream.as_slice(), false), (announcing, true)] {
        let whole = Division::of(stream, &Limits::default()).unwrap();
        for count in 1..whole.gops.len() {
            let part = unpackaged(stream, &whole, count);
            assert_eq!(Division::of(&part, &Limits::default()).unwrap().gops.len(), count);
            let (mut kept, mut changed) = (stream[..whole.gops[count].start as usize].to_vec(), false);
            let units = Stream::open(&part, &Limits::default()).unwrap().units();
            let mut last = None;
            for unit in units.map(Result::unwrap) {
                last = Some(unit.header.unit_type());
                if last == Some(UnitType::SequenceParameters) {
                    let own = unit.at as usize..unit.payload_at as usize + unit.payload.len();
                    changed |= kept[own.clone()] != part[own.clone()];
                    kept[own.clone()].copy_from_slice(&part[own]);
                }
            }
            assert_eq!((last, changed), (Some(UnitType::End), announces));
            assert!(part.starts_with(&kept));
            let summary = decode_stream(&part, &DecoderOptions::default(), |_, _| ControlFlow::Continue(()));
            assert_eq!((summary.errors, summary.lost), (Vec::new(), Vec::new()));
        }
        let media = live(stream, Layout::Gop, 1000).media();
        let given: Vec<_> = media.iter().map(|(name, bytes)| (name.clone(), bytes.as_slice())).collect();
        assert!(unpackage_growing(&given, &Limits::default()).is_err());
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

/// GOPs of a manifest without what is only true of live packages: what they are, not where. A frame that is written before
/// the next one is known has another duration, so that digests differ.
fn gops(manifest: &Manifest) -> Vec<String> {
    let strip = |gop: &splatstream_stream::manifest::GopInfo| {
        let mut gop = gop.clone();
        // A live package has Representations without units too.
        gop.subsegments.retain(|one| !one.frames.is_empty());
        for one in &mut gop.subsegments {
            one.file = None;
            for level in &mut one.levels {
                level.bytes.offset = 0;
                level.bytes.digest.clear();
            }
        }
        format!("{gop:?}")
    };
    manifest.gops.iter().map(strip).collect()
}

// covers: SS-CR-031, SS-CR-032
#[test]
fn the_last_manifest_says_of_gops_what_that_of_a_whole_package_says() {
    for path in vectors().into_iter().filter(|path| is_conforming(path)).step_by(5) {
        let stream = std::fs::read(&path).unwrap();
        for layout in [Layout::Gop, Layout::Frame] {
            let directory = live(&stream, layout, 777);
            let last = directory.manifests.last().unwrap();
            let whole = common::package(&stream, &settings(layout).package).manifest;
            assert!(gops(last) == gops(&whole), "{}", path.display());
            assert_eq!(last.stream, whole.stream);
            let rates = |manifest: &Manifest| -> Vec<_> {
                let all = manifest.representations.iter();
                // A live package has Representations without units too.
                all.filter(|one| one.frames > 0)
                    .map(|one| (one.id.clone(), one.level_bandwidths.clone(), one.frames))
                    .collect()
            };
            assert_eq!(rates(last), rates(&whole), "{}", path.display());
        }
    }
}

/// A stream of four GOPs.
fn mixed() -> Vec<u8> {
    let path = vectors().into_iter().find(|path| path.to_string_lossy().contains("temporal-gops-mixed"));
    std::fs::read(path.unwrap()).unwrap()
}

// covers: SS-CR-031
#[test]
fn a_growing_manifest_lists_a_window_of_the_last_gops() {
    let stream = mixed();
    let all = common::package(&stream, &Options::default()).manifest;
    assert!(all.gops.len() > 3, "the stream has {} GOPs", all.gops.len());
    let narrow = Settings { window_ms: 0, ..settings(Layout::Gop) };
    let directory = live_as(&narrow, &stream, 100);
    let (last, growing) = directory.manifests.split_last().unwrap();
    for (number, manifest) in growing.iter().enumerate() {
        assert_eq!(manifest.gops.len(), 3.min(number + 1));
        assert_eq!(manifest.first_gop() as usize, (number + 1).saturating_sub(3));
        let of_all = &gops(&all)[manifest.first_gop() as usize..][..manifest.gops.len()];
        assert_eq!(gops(manifest), of_all);
    }
    assert_eq!(last.gops.len(), all.gops.len());
    // One that is held to a bound leaves out its first GOPs.
    let small = Settings { manifest_bytes: 1, ..narrow };
    let directory = live_as(&small, &stream, 100);
    let last = directory.manifests.last().unwrap();
    assert_eq!((last.gops.len(), last.first_gop() as usize), (3, all.gops.len() - 3));
    assert!(last.describes(&stream));
}

// covers: SS-CR-031
#[test]
fn the_manifest_says_when_and_how_it_grows() {
    let stream = worked_example();
    for layout in [Layout::Gop, Layout::Frame] {
        let directory = live(&stream, layout, 64);
        let (last, growing) = directory.manifests.split_last().unwrap();
        let (first, live) = (growing[0].live.clone().unwrap(), last.live.clone().unwrap());
        assert_eq!((first.state.as_str(), live.state.as_str()), (LiveInfo::GROWING, LiveInfo::ENDED));
        assert_eq!((first.started_ms, live.started_ms), (START, START));
        assert_eq!(live.published_ms, START + 1_000_000);
        assert!(
            growing.windows(2).all(|pair| pair[0].live.as_ref().unwrap().published_ms
                < pair[1].live.as_ref().unwrap().published_ms)
        );
        let info = &last.stream;
        let ms = |frames: u32| (frames * info.ticks_per_frame * 1000).div_ceil(info.ticks_per_second);
        let frames = if layout == Layout::Gop { last.gops[0].frame_count } else { 1 };
        assert_eq!((live.update_ms, live.target_latency_ms), (ms(frames), ms(2 * frames)));
        // Every frame is news where frames are subsegments.
        let news = if layout == Layout::Gop { 1 } else { last.gops[0].subsegments.len() };
        let frames = |manifest: &Manifest| -> usize {
            manifest.gops.iter().flat_map(|gop| &gop.subsegments).filter(|one| !one.frames.is_empty()).count()
        };
        assert!(growing.len() <= news && !growing.is_empty());
        assert!(
            growing.windows(2).all(|pair| frames(&pair[0]) < frames(&pair[1]) || !pair[1].gops[0].growing)
        );
        assert_eq!(growing[0].gops[0].growing, layout == Layout::Frame);
    }
    let wanted = Settings { target_latency_ms: Some(1234), ..settings(Layout::Frame) };
    let directory = live_as(&wanted, &stream, 64);
    assert_eq!(directory.manifests[0].live.as_ref().unwrap().target_latency_ms, 1234);
    assert!(directory.mpds[0].contains("<Latency target=\"1234\"/>"), "{}", directory.mpds[0]);
}

// covers: SS-CR-027
#[test]
fn a_frame_is_written_before_the_next_one_is_complete() {
    let stream = worked_example();
    let mut live = Live::new(&settings(Layout::Frame), &Limits::default());
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
    let mut live = Live::new(&settings(Layout::Gop), &Limits::default());
    live.push(&stream[..stream.len() - 36], START).unwrap();
    assert!(!live.has_ended());
    assert_eq!(live.finish(START).unwrap_err().kind.code(), "TRUNCATED");
}
