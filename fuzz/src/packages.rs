//! Packages for DASH: streams into files, files into streams, manifests.

use crate::seal::sealed;
use crate::{LIMITS, decode, streams};
use splatstream_stream::control::Layered;
use splatstream_stream::live::{Live, Settings};
use splatstream_stream::manifest::Manifest;
use splatstream_stream::package::{Layout, Options, Package};
use splatstream_stream::playback::{Options as Playing, Player};
use splatstream_stream::unpackage::unpackage;

/// Names and bytes of files.
type Files = Vec<(String, Vec<u8>)>;

/// Bytes of an edit of a file: what, where (24 bits), and with which value.
const EDIT: usize = 5;
/// More add time, not depth.
const MAX_EDITS: usize = 32;

/// The first byte says what the others are: a stream or edits of one, edits of the files of a package, the file of s0, or
/// a manifest.
pub fn run(data: &[u8]) {
    let Some((choice, rest)) = data.split_first() else { return };
    match choice % 4 {
        0 => comes_back(&sealed(&decode::stream_of(rest))),
        1 => unpackaged(&edited(rest)),
        2 => unpackaged(&vec![("s0.mp4".to_owned(), rest.to_vec())]),
        _ => described(rest),
    }
}

/// What is packaged, whole or in pieces, comes back.
fn comes_back(stream: &[u8]) {
    for layout in [Layout::Gop, Layout::Frame] {
        let options = Options { layout, ..Options::default() };
        let Ok(package) = Package::of(stream, &options, &LIMITS) else { return };
        let own = files(&package);
        let back = unpackage(&given(&own), &LIMITS);
        assert!(back.as_deref() == Ok(stream), "the stream came back different: {:?}", back.err());
        described(package.manifest.to_json().as_bytes());
        presented(own.iter().map(|(name, bytes)| (name.as_str(), bytes.as_slice())));
        let manifest = Manifest::parse(package.manifest.to_json().as_bytes());
        assert!(manifest.is_ok_and(|manifest| manifest.describes(stream)), "its manifest is refused");
        let settings = Settings { window_ms: 0, ..Settings::new(options) };
        let (mut live, mut changes) = (Live::new(&settings, &LIMITS), Vec::new());
        for (piece, now_ms) in stream.chunks(997).zip(0..) {
            changes.extend(live.push(piece, now_ms).expect("the whole stream was packaged"));
        }
        changes.extend(live.finish(u64::MAX >> 11).expect("the whole stream was packaged"));
        let manifests = changes.iter().filter(|change| change.name == Package::MANIFEST);
        followed(stream, manifests.map(|change| change.bytes.as_slice()));
        presented(changes.iter().map(|change| (change.name.as_str(), change.bytes.as_slice())));
        let bytes: usize = changes.iter().map(|change| change.bytes.len()).sum();
        assert!(bytes >= stream.len(), "bytes are lost");
    }
}

/// Manifests of a stream that grows are read, each goes on from the one before, and the last one is of the stream.
fn followed<'a>(stream: &[u8], manifests: impl Iterator<Item = &'a [u8]>) {
    let mut player: Option<Player<Layered>> = None;
    let mut last = None;
    for text in manifests {
        described(text);
        let manifest =
            Manifest::parse(text).unwrap_or_else(|error| panic!("its manifest is refused: {error}"));
        match &mut player {
            Some(player) => player.renew(0, manifest.clone()).expect("it is that of the same stream"),
            None => {
                player = Player::new(manifest.clone(), Playing::default(), Layered::default(), 0).ok();
            }
        }
        last = Some(manifest);
    }
    assert!(
        last.is_some_and(|manifest| manifest.describes(stream)),
        "its last manifest is of another stream"
    );
}

/// MPDs are XML, in which what refers to a Representation names one.
fn presented<'a>(files: impl Iterator<Item = (&'a str, &'a [u8])>) {
    for (name, bytes) in files.filter(|(name, _)| name.ends_with(".mpd")) {
        let text = core::str::from_utf8(bytes).expect("an MPD is text");
        let document = roxmltree::Document::parse(text).unwrap_or_else(|error| panic!("{name}: {error}"));
        let ids: Vec<&str> = with_attribute(&document, "id").collect();
        let needed = with_attribute(&document, "dependencyId").flat_map(str::split_whitespace);
        needed.for_each(|id| assert!(ids.contains(&id), "{name}: there is no Representation {id}"));
    }
}

/// The values of an attribute of Representations.
fn with_attribute<'a>(document: &'a roxmltree::Document<'_>, name: &'a str) -> impl Iterator<Item = &'a str> {
    let representations = document.descendants().filter(|node| node.has_tag_name("Representation"));
    representations.filter_map(move |node| node.attribute(name))
}

/// Files give a stream, which packages again, or an error.
fn unpackaged(files: &Files) {
    if let Ok(stream) = unpackage(&given(files), &LIMITS) {
        let bytes: usize = files.iter().map(|(_, bytes)| bytes.len()).sum();
        assert!(stream.len() <= bytes, "the stream is longer than its files");
        assert!(Package::of(&stream, &Options::default(), &LIMITS).is_ok(), "it cannot be packaged");
    }
}

/// A manifest that is accepted is the same when it is written and read again.
fn described(text: &[u8]) {
    if let Ok(manifest) = Manifest::parse(text) {
        assert_eq!(Manifest::parse(manifest.to_json().as_bytes()).as_ref(), Ok(&manifest));
    }
}

/// The files of one of the valid streams with edits.
fn edited(data: &[u8]) -> Files {
    let (choice, edits) = data.split_first().unwrap_or((&0, &[]));
    let stream = streams::ALL[usize::from(*choice) % streams::ALL.len()];
    let layout = if usize::from(*choice) < streams::ALL.len() { Layout::Gop } else { Layout::Frame };
    let options = Options { layout, ..Options::default() };
    let package = Package::of(stream, &options, &LIMITS);
    let mut files = files(&package.expect("a valid stream can be packaged"));
    for &[what, low, middle, high, value] in edits.as_chunks::<EDIT>().0.iter().take(MAX_EDITS) {
        apply(&mut files, what, u32::from_le_bytes([low, middle, high, 0]) as usize, value);
    }
    files
}

fn apply(files: &mut Files, what: u8, at: usize, value: u8) {
    let count = files.len();
    let Some((_, bytes)) = files.get_mut(usize::from(what >> 3) % count.max(1)) else { return };
    let index = at % bytes.len().max(1);
    match what & 7 {
        0..=3 if !bytes.is_empty() => bytes[index] = value,
        4 => bytes.truncate(index),
        5 => bytes.insert(index, value),
        6 if !bytes.is_empty() => {
            bytes.remove(index);
        }
        7 => files.swap_remove(usize::from(what >> 3) % count).1.clear(),
        _ => {}
    }
}

fn files(package: &Package<'_>) -> Files {
    let names = package.files().map(str::to_owned);
    names
        .map(|name| {
            let mut bytes = Vec::new();
            package.write(&name, &mut bytes).expect("memory takes all bytes");
            (name, bytes)
        })
        .collect()
}

fn given(files: &Files) -> Vec<(String, &[u8])> {
    files.iter().map(|(name, bytes)| (name.clone(), bytes.as_slice())).collect()
}
