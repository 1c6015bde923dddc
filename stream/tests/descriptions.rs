//! C.7 and C.8: the MPD obeys the rules of the DASH schema, and the manifest its own; both say what the files are.
#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

mod common;

use common::mpd::check;
use common::{files, is_conforming, package, vectors, worked_example};
use roxmltree::{Document, Node};
use serde_json::{Value, json};
use splatstream_format::Limits;
use splatstream_stream::manifest::Manifest;
use splatstream_stream::package::{Layout, Options, Package};

fn elements<'a>(document: &'a Document<'a>, name: &'static str) -> Vec<Node<'a, 'a>> {
    document.descendants().filter(|node| node.tag_name().name() == name).collect()
}

fn number(node: &Node<'_, '_>, attribute: &str) -> u64 {
    node.attribute(attribute).unwrap().parse().unwrap()
}

// covers: SS-CR-020, SS-CR-021, SS-CR-023, SS-CR-024
#[test]
fn the_mpd_has_the_elements_of_the_schema_in_their_order() {
    let stream = worked_example();
    for layout in [Layout::Gop, Layout::Frame] {
        let package = package(&stream, &Options { layout, ..Options::default() });
        let document = Document::parse(&package.mpd).unwrap();
        check(document.root_element());
        let set = elements(&document, "AdaptationSet")[0];
        let info = &package.manifest.stream;
        assert_eq!(set.attribute("codecs"), Some(format!("gss1.{}.{}", info.profile, info.level).as_str()));
        assert_eq!(elements(&document, "ContentComponent").len(), info.refinements.len());
        let files = files(&package);
        let representations = elements(&document, "Representation");
        assert_eq!(representations.len(), files.len());
        let mut before: Vec<&str> = Vec::new();
        for (node, (name, bytes)) in representations.iter().zip(&files) {
            let id = node.attribute("id").unwrap();
            assert_eq!(name, &format!("{id}.mp4"));
            let depends: Vec<&str> =
                node.attribute("dependencyId").into_iter().flat_map(|ids| ids.split(' ')).collect();
            assert_eq!(depends, before);
            before.push(id);
            let base = node.children().find(|child| child.tag_name().name() == "SegmentBase").unwrap();
            let (start, end) = base.attribute("indexRange").unwrap().split_once('-').unwrap();
            let (start, end): (usize, usize) = (start.parse().unwrap(), end.parse().unwrap());
            assert_eq!(&bytes[start + 4..start + 8], b"sidx");
            assert!(matches!(&bytes[end + 5..end + 9], b"moof"));
            let init = base.children().find(Node::is_element).unwrap();
            assert_eq!(init.attribute("range"), Some(format!("0-{}", start - 1).as_str()));
        }
        let rates: Vec<_> = representations.iter().map(|node| node.attribute("frameRate").unwrap()).collect();
        assert!(rates.iter().all(|rate| !rate.is_empty()));
    }
}

// covers: SS-CR-020, SS-CR-021, SS-CR-022, SS-CR-024
#[test]
fn another_reader_of_mpds_finds_the_layers() {
    let stream = worked_example();
    let package = package(&stream, &Options::default());
    let mpd = dash_mpd_core::parse(&package.mpd).unwrap();
    assert_eq!(mpd.mpdtype.as_deref(), Some("static"));
    let set = &mpd.periods[0].adaptations[0];
    assert_eq!(set.mimeType.as_deref(), Some("application/mp4"));
    assert_eq!(set.essential_property.len(), 1);
    assert_eq!(set.representations.len(), package.manifest.representations.len());
    for (read, info) in set.representations.iter().zip(&package.manifest.representations) {
        assert_eq!((read.id.as_deref(), read.bandwidth), (Some(info.id.as_str()), Some(info.bandwidth)));
        assert_eq!(read.dependencyId.clone().unwrap_or_default(), info.depends_on.join(" "));
        assert_eq!(read.BaseURL[0].base, info.file);
        let range = read.SegmentBase.as_ref().unwrap().indexRange.clone().unwrap();
        let index = info.index.as_ref().unwrap();
        assert_eq!(range, format!("{}-{}", index.offset, index.offset + index.size - 1));
        let bandwidths: Vec<u64> =
            read.SubRepresentation.iter().map(|level| level.bandwidth.unwrap()).collect();
        assert_eq!(bandwidths, info.level_bandwidths);
        for (number, level) in (1..).zip(&read.SubRepresentation) {
            let below: Vec<String> = (1..number).map(|below| below.to_string()).collect();
            assert_eq!(level.level, Some(number));
            assert_eq!(level.dependencyLevel.clone().unwrap_or_default(), below.join(" "));
        }
    }
}

// covers: SS-CR-022
#[test]
fn bandwidths_of_levels_add_up_to_those_of_representations() {
    let stream = worked_example();
    let package = package(&stream, &Options::default());
    let document = Document::parse(&package.mpd).unwrap();
    let mut sum = 0;
    for node in elements(&document, "Representation") {
        let mut below = Vec::new();
        for level in node.children().filter(|child| child.tag_name().name() == "SubRepresentation") {
            assert_eq!(level.attribute("dependencyLevel").unwrap_or(""), below.join(" "));
            assert_eq!(level.attribute("contentComponent"), level.attribute("level"));
            below.push(level.attribute("level").unwrap());
            sum += number(&level, "bandwidth");
        }
        assert_eq!(below.len(), package.manifest.stream.refinements.len());
        assert_eq!(number(&node, "bandwidth"), sum);
    }
    // All bytes of a GOP come in its time at that rate.
    let info = &package.manifest.stream;
    for gop in &package.manifest.gops {
        let bytes: u64 =
            gop.subsegments.iter().flat_map(|one| &one.levels).map(|level| level.bytes.size).sum();
        let ticks = u64::from(gop.frame_count) * u64::from(info.ticks_per_frame);
        assert!(bytes * 8 * u64::from(info.ticks_per_second) <= sum * ticks);
    }
}

fn value(manifest: &Manifest) -> Value {
    serde_json::from_str(&manifest.to_json()).unwrap()
}

// covers: SS-CR-025
#[test]
fn ranges_of_the_manifest_are_those_of_the_files() {
    let schema: Value = serde_json::from_str(include_str!("../manifest.schema.json")).unwrap();
    let schema = jsonschema::validator_for(&schema).unwrap();
    let streams = vectors().into_iter().filter(|path| is_conforming(path));
    for path in streams.step_by(7) {
        let stream = std::fs::read(&path).unwrap();
        for layout in [Layout::Gop, Layout::Frame] {
            let package = package(&stream, &Options { layout, ..Options::default() });
            let manifest = value(&package.manifest);
            let wrong: Vec<String> = schema.iter_errors(&manifest).map(|error| error.to_string()).collect();
            assert_eq!(wrong, [""; 0], "{}", path.display());
            for (info, (name, bytes)) in package.manifest.representations.iter().zip(files(&package)) {
                assert_eq!((&info.file, info.bytes), (&name, bytes.len() as u64));
                let subsegments = package.manifest.gops.iter().flat_map(|gop| &gop.subsegments);
                let of_it = subsegments.filter(|one| one.representation == info.id);
                let levels = of_it.flat_map(|one| &one.levels).map(|level| &level.bytes);
                let parts = [Some(&info.init), info.index.as_ref()].into_iter().flatten();
                let mut end = 0;
                for range in parts.chain(levels).chain(info.tail.as_ref()) {
                    assert_eq!(range.offset, end);
                    end = range.offset + range.size;
                    assert!(range.holds(&bytes[range.offset as usize..end as usize]));
                }
                assert_eq!(end, info.bytes, "every byte is in one range");
            }
        }
    }
}

/// A change of the manifest of the worked example, and where it is refused.
const NONSENSE: &[(&str, &str, &str)] = &[
    ("/format", "\"mpd\"", "format"),
    ("/version", "2", "version"),
    ("/layout", "\"tiles\"", "layout"),
    ("/stream/spatial_layers", "9", "stream.spatial_layers"),
    ("/stream/refinements", "[10, 10, 100]", "stream.refinements"),
    ("/stream/ticks_per_frame", "0", "stream.ticks_per_frame"),
    ("/stream/digest", "\"00\"", "stream.digest"),
    ("/representations", "[]", "representations[0].id"),
    ("/representations/0/id", "\"s1\"", "representations[0].layer"),
    ("/representations/1/file", "\"s0.mp4\"", "representations[1].file"),
    ("/representations/0/file", "\"../s0.mp4\"", "representations[0].file"),
    ("/representations/0/file", "\"a\\\\b\"", "representations[0].file"),
    ("/representations/0/file", "\".s0\"", "representations[0].file"),
    ("/representations/1/depends_on", "[]", "representations[1].depends_on"),
    ("/representations/0/init/size", "18446744073709551615", "representations[0].init"),
    ("/representations/0/bytes", "10", "representations[0].init"),
    ("/gops/0/frame_count", "0", "gops[0].frame_count"),
    ("/gops/0/frame_count", "4294967295", "gops[0].frame_count"),
    ("/gops/0/subsegments/0/representation", "\"s3\"", "gops[0].subsegments[0].representation"),
    ("/gops/0/subsegments/0/levels", "[]", "gops[0].subsegments[0].levels"),
    ("/gops/0/subsegments/0/levels/0/offset", "0", "gops[0].subsegments[0].levels[0]"),
    ("/gops/0/subsegments/0/levels/1/size", "18446744073709551615", "gops[0].subsegments[0].levels[1]"),
    ("/gops/0/subsegments/0/frames/0/frame", "4294967295", "gops[0].subsegments[0].frames"),
    ("/gops/0/subsegments/0/frames/0/reference", "7", "gops[0].subsegments[0].frames"),
    ("/quality", "[{\"point\": \"s9,t0,r0\", \"gop\": null, \"psnr_db\": 1, \"ssim\": null}]", "quality[0]"),
    ("/quality", "[{\"point\": \"s0,t0,r0\", \"gop\": 99, \"psnr_db\": 1, \"ssim\": null}]", "quality[0]"),
    ("/gops/0/index", "-1", "line 1"),
    ("/stream/bytes", "1e99", "line 1"),
];

// covers: SS-CR-026
#[test]
fn a_manifest_that_cannot_be_true_is_refused() {
    let stream = worked_example();
    let package = package(&stream, &Options::default());
    for (path, change, at) in NONSENSE {
        let mut manifest = value(&package.manifest);
        manifest["quality"] = json!([]);
        *manifest.pointer_mut(path).unwrap() = serde_json::from_str(change).unwrap();
        let error = Manifest::parse(manifest.to_string().as_bytes()).unwrap_err();
        assert!(error.at.starts_with(at), "{path} {change}: {error}");
        assert_eq!(error.clause, "C.8");
    }
    let mut later = value(&package.manifest);
    later["key_of_a_later_version"] = json!(1);
    later["quality"] = json!([{"point": "s0,t0,r0", "gop": 0, "psnr_db": 30.5, "ssim": null}]);
    assert!(Manifest::parse(later.to_string().as_bytes()).is_ok());
    let deep = "[".repeat(100_000);
    assert!(Manifest::parse(deep.as_bytes()).is_err());
}

// covers: SS-CR-001, SS-CR-005
#[test]
fn units_out_of_order_are_refused() {
    let stream = worked_example();
    let parsed = splatstream_format::unit::Stream::open(&stream, &Limits::default()).unwrap();
    let units: Vec<_> = parsed.units().map(Result::unwrap).collect();
    let bytes = |unit: &splatstream_format::unit::Unit<'_>| {
        stream[unit.at as usize..unit.payload_at as usize + unit.payload.len()].to_vec()
    };
    let increments: Vec<usize> =
        (0..units.len()).filter(|&index| units[index].header.unit_type().name() == "increment").collect();
    let mut swapped: Vec<Vec<u8>> = units.iter().map(bytes).collect();
    swapped.swap(increments[0], increments[1]);
    let swapped = [stream[..16].to_vec(), swapped.concat()].concat();
    let error = Package::of(&swapped, &Options::default(), &Limits::default()).unwrap_err();
    assert_eq!((error.clause, error.kind.code()), ("B.1", "UNEXPECTED_UNIT"));
    let cut = &stream[..stream.len() - 36];
    let error = Package::of(cut, &Options::default(), &Limits::default()).unwrap_err();
    assert_eq!(error.kind.code(), "TRUNCATED");
}
