//! 7.11: operating points and extraction; B.3: random access; annex A: levels and limits.

use crate::crafted::expect::{decode, decode_at, decode_with, planes, point};
use crate::crafted::sample;
use crate::crafted::scene::{Gop, Scene, codebook};
use crate::crafted::{FILE_HEADER, Part, Script, seal_header};
use splatstream_decoder::operating_point::{OperatingPoint, extract, operating_points};
use splatstream_decoder::process::{DecodedFrame, Decoder, Options};
use splatstream_format::syntax::UnitType::{Codebook, End, FrameHeader, GopHeader, Index, Refinement};
use splatstream_format::syntax::{UnitId, UnitType};
use splatstream_format::unit::Stream;
use splatstream_format::{Error, Limits};

fn extracted(bytes: &[u8], refinement: u8) -> Vec<u8> {
    extract(bytes, point(refinement), &Limits::default()).unwrap()
}

/// The stream that 7.11 describes: a script without the units above the point.
fn by_hand(script: &Script, refinement: u8) -> Vec<u8> {
    let mut script = script.clone();
    script.parts.retain(|part| match part {
        Part::Unit(id, _) => id.refinement <= refinement && id.spatial_layer == 0 && id.temporal_layer == 0,
        _ => true,
    });
    script.bytes()
}

/// The sample with frames of different lengths and private units, some of them in higher layers.
fn mixed() -> Script {
    let mut scene = sample::scene();
    scene.gops[0].frames[0].units.truncate(1);
    scene.gops[0].frames[0].count = Some(10);
    let mut script = scene.script();
    for (place, refinement, spatial_layer) in [(0, 0, 0), (4, 1, 0), (9, 200, 0), (12, 0, 1), (14, 2, 0)] {
        let id = UnitId { refinement, spatial_layer, ..UnitId::stream(UnitType::User(130)) };
        script.parts.insert(place, Part::Unit(id, vec![place as u8; place]));
    }
    script
}

// covers: SS-OP-001, SS-OP-004, SS-OP-005, SS-UH-004
#[test]
fn extraction_leaves_out_what_does_not_belong_and_counts_anew() {
    for script in [sample::scene().script(), mixed()] {
        let bytes = script.bytes();
        let all = decode(&bytes);
        assert_eq!(all.end, None);
        for r in 0..3 {
            let small = extracted(&bytes, r);
            assert_eq!(small, by_hand(&script, r), "r{r}");
            let at_point = decode_at(&bytes, r);
            let of_small = decode(&small);
            assert_eq!((at_point.end, of_small.end), (None, None), "r{r}");
            assert_eq!(of_small.frames, at_point.frames, "r{r}");
            for lower in 0..=r {
                assert_eq!(extracted(&small, lower), extracted(&bytes, lower), "r{r}, then r{lower}");
            }
        }
    }
    let bytes = sample::scene().bytes();
    assert_eq!(extracted(&bytes, 2), bytes, "every unit belongs");
    assert_eq!(extract(&bytes, OperatingPoint::ALL, &Limits::default()).unwrap(), bytes);
}

// covers: SS-OP-004, SS-FH-004
#[test]
fn extraction_copies_the_file_header_and_needs_no_index() {
    let mut scene = sample::scene();
    scene.index = false;
    let mut bytes = scene.bytes();
    bytes[9] = 5;
    let crc = crate::crafted::crc32(&bytes[..12]);
    bytes[12..16].copy_from_slice(&crc.to_le_bytes());
    let small = extracted(&bytes, 0);
    assert_eq!(small[..FILE_HEADER], bytes[..FILE_HEADER]);
    assert_eq!(small[FILE_HEADER..], by_hand(&scene.script(), 0)[FILE_HEADER..]);
    assert_eq!(decode(&small).end, None);
}

// covers: SS-OP-002
#[test]
fn the_highest_operating_point_is_the_last_refinement_of_the_sequence() {
    let mut scene = sample::scene();
    let points = |scene: &Scene| {
        let points = operating_points(&scene.bytes(), &Limits::default()).unwrap();
        points.iter().map(|info| (info.point, info.gaussians)).collect::<Vec<_>>()
    };
    assert_eq!(points(&scene), [(point(0), 6), (point(1), 15), (point(2), 30)]);
    for frame in scene.gops.iter_mut().flat_map(|gop| &mut gop.frames) {
        frame.units.truncate(2);
        frame.count = Some(10);
    }
    assert_eq!(points(&scene), [(point(0), 6), (point(1), 15), (point(2), 15)]);
}

// covers: SS-OP-003
#[test]
fn a_frame_at_a_refinement_is_the_beginning_of_the_frame_at_a_higher_one() {
    let bytes = sample::scene().bytes();
    let shown: Vec<_> = (0..3).map(|r| decode_at(&bytes, r).frames).collect();
    for (low, high) in [(0, 1), (0, 2), (1, 2)] {
        for (few, many) in shown[low].iter().zip(&shown[high]) {
            let length = few.planes.len();
            let beginning = planes(&many.planes).into_iter().map(|plane| plane[..length].to_vec());
            assert_eq!(planes(&few.planes), beginning.collect::<Vec<_>>());
        }
    }
}

/// Decodes the sequence parameters and then the units from an offset on.
fn from_inside(bytes: &[u8], offset: u64) -> (Vec<DecodedFrame>, Option<Error>) {
    let stream = Stream::open(bytes, &Limits::default()).unwrap();
    let mut decoder = Decoder::starting_inside(stream.header(), Options::default());
    let mut frames = Vec::new();
    for unit in stream.units().take(1).chain(stream.units_from(offset)) {
        match unit.and_then(|unit| decoder.unit(&unit)) {
            Ok(frame) => frames.extend(frame),
            Err(error) => return (frames, Some(error)),
        }
    }
    (frames, None)
}

// covers: SS-BS-008, SS-GH-001, SS-EN-001, SS-IX-001
#[test]
fn decoding_from_a_gop_on_gives_the_frames_from_there() {
    let mut scene = sample::scene();
    scene.gops.push(Gop { frames: vec![sample::frame(4), sample::frame(5)], ..sample::tools() });
    scene.sequence.frame_count = 5;
    let script = scene.script();
    let bytes = script.bytes();
    let whole = decode(&bytes);
    assert_eq!(whole.end, None);
    for (gop, first) in [(0, 0), (1, 2), (2, 3)] {
        let offset = script.at(script.find(GopHeader, gop));
        let (frames, end) = from_inside(&bytes, offset);
        assert_eq!((end, &frames[..]), (None, &whole.frames[first..]), "from GOP {gop}");
    }
    // Values of the index and of the end are ignored, later GOPs are not.
    let mut other = script.clone();
    other.payload(Index, 0)[0] = 1;
    other.payload(Index, 0).truncate(20);
    other.payload(End, 0).fill(9);
    let second = other.at(other.find(GopHeader, 1));
    assert_eq!(from_inside(&other.bytes(), second).1, None);
    other.payload(GopHeader, 2)[0] = 7;
    let error = from_inside(&other.bytes(), second).1.unwrap();
    assert_eq!((error.kind.code(), error.clause), ("MISMATCH", "6.5"));
    let mut frame = script.clone();
    frame.id(FrameHeader, 2).frame = 3;
    let second = frame.at(frame.find(GopHeader, 1));
    assert_eq!(from_inside(&frame.bytes(), second).1.unwrap().kind.code(), "MISMATCH");
}

// covers: SS-GH-001
#[test]
fn no_gop_follows_the_last_display_index() {
    let mut scene = sample::scene();
    scene.gops.push(Gop { frames: vec![sample::frame(4)], ..sample::tools() });
    let mut script = scene.script();
    let (last, after) = (script.find(GopHeader, 1), script.find(GopHeader, 2));
    for (place, part) in script.parts.iter_mut().enumerate().skip(last) {
        if let Part::Unit(id, _) = part {
            id.frame = if place < after { u32::MAX } else { 0 };
        }
    }
    let end = from_inside(&script.bytes(), script.at(last)).1;
    assert_eq!(code_at(end), Some(("MISMATCH", script.at(after) + 8)));
}

fn code_at(error: Option<Error>) -> Option<(&'static str, u64)> {
    error.map(|error| (error.kind.code(), error.at))
}

// covers: SS-LM-001, SS-FR-003, SS-LM-002, SS-LM-003
#[test]
fn frames_stay_within_the_level_and_within_what_the_decoder_was_told() {
    let wide = Limits { max_gaussians: u32::MAX, ..Limits::default() };
    for (level, log2) in [(1, 18), (2, 20), (3, 22), (4, 24)] {
        let mut script = sample::scene().script();
        script.level = level;
        let at = script.at(script.find(FrameHeader, 0)) + 24;
        let verdict = |script: &Script, limits: Limits, refinement: u8| {
            let options = Options { limits, operating_point: point(refinement), ..Options::default() };
            code_at(decode_with(&script.bytes(), &options).verdict())
        };
        script.put(FrameHeader, 0, 4, ((1_u32 << log2) + 1).to_le_bytes());
        for refinement in [0, 2] {
            // At every operating point, although r0 would have fewer.
            assert_eq!(verdict(&script, wide, refinement), Some(("OVER_LIMIT", at)), "level {level}");
        }
        // At the limit the count itself is right; the units then have too few Gaussians.
        script.put(FrameHeader, 0, 4, (1_u32 << log2).to_le_bytes());
        assert_eq!(verdict(&script, wide, 2).unwrap().0, "MISMATCH", "level {level}");
        let lower = Limits { max_gaussians: (1 << log2) - 1, ..wide };
        assert_eq!(verdict(&script, lower, 2), Some(("OVER_LIMIT", at)), "level {level}");
        // A level alone is no reason to refuse.
        let mut script = sample::scene().script();
        script.level = level;
        assert_eq!(verdict(&script, Limits { max_gaussians: 10, ..Limits::default() }, 2), None);
        assert_eq!(
            verdict(&script, Limits { max_gaussians: 9, ..Limits::default() }, 2),
            Some(("OVER_LIMIT", at))
        );
    }
}

// covers: SS-LM-001, SS-LM-003, SS-CB-002
#[test]
fn codebooks_of_a_gop_stay_within_their_limit_together() {
    // 6 and 4 values a GOP.
    let script = sample::scene().script();
    let verdict = |script: &Script, max_codebook_values: u32| {
        let limits = Limits { max_codebook_values, ..Limits::default() };
        code_at(decode_with(&script.bytes(), &Options { limits, ..Options::default() }).verdict())
    };
    let at = |n: usize| script.at(script.find(Codebook, n)) + 22;
    assert_eq!(verdict(&script, 10), None);
    assert_eq!(verdict(&script, 9), Some(("OVER_LIMIT", at(1))));
    assert_eq!(verdict(&script, 5), Some(("OVER_LIMIT", at(0))));
    // Before the entries are read.
    let mut short = script.clone();
    short.payload(Codebook, 1).truncate(5);
    assert_eq!(verdict(&short, 9), Some(("OVER_LIMIT", at(1))));
    assert_eq!(verdict(&short, 10).unwrap().0, "SHORT_SECTION");
    // The limit of annex A: 2^23 values. Three codebooks of 65536 times 45, each as short as can be.
    let mut large = script.clone();
    let head = |id: u8| vec![id, 45, 0xFF, 0xFF, 1];
    let entries = vec![0; 65536 * 45];
    for (n, id) in [(0, 5), (1, 6)] {
        *large.payload(Codebook, n) = [head(id), entries.clone()].concat();
    }
    let mut third = codebook(7, 38, 1, vec![0; 38]).to_bytes().unwrap();
    // 2^23 - 2 * 65536 * 45 is 65536 * 38.
    third.splice(1..5, [38, 0xFF, 0xFF, 1]);
    third.resize(5 + 65536 * 38, 0);
    large.insert_before(FrameHeader, 0, Part::unit(Codebook, 0, third.clone()));
    let code = |script: &Script| decode(&script.bytes()).verdict().map(|error| error.kind.code());
    // All of it fits; the refinements then miss codebook 1.
    assert_eq!(code(&large), Some("MISMATCH"));
    large.insert_before(
        FrameHeader,
        0,
        Part::unit(Codebook, 0, codebook(8, 1, 1, vec![0]).to_bytes().unwrap()),
    );
    assert_eq!(code(&large), Some("OVER_LIMIT"));
}

// covers: SS-LM-001, SS-LM-003
#[test]
fn payloads_and_the_number_of_units_are_limited() {
    let script = sample::scene().script();
    let bytes = script.bytes();
    let verdict =
        |limits: Limits| code_at(decode_with(&bytes, &Options { limits, ..Options::default() }).verdict());
    let units = script.parts.len() as u32;
    assert_eq!(verdict(Limits { max_units: units, ..Limits::default() }), None);
    let last = script.at(units as usize - 1);
    assert_eq!(verdict(Limits { max_units: units - 1, ..Limits::default() }), Some(("OVER_LIMIT", last)));
    assert_eq!(verdict(Limits { max_payload: 50, ..Limits::default() }), Some(("OVER_LIMIT", 16 + 12)));
    // 2^30 bytes may be announced, and are then missed; one more may not.
    for (length, code, offset) in [(1_u32 << 30, "TRUNCATED", 20), ((1 << 30) + 1, "OVER_LIMIT", 12)] {
        let mut bytes = script.bytes();
        let at = script.at(script.find(Refinement, 1)) as usize;
        bytes[at + 12..at + 16].copy_from_slice(&length.to_le_bytes());
        seal_header(&mut bytes[at..]);
        assert_eq!(code_at(decode(&bytes).verdict()), Some((code, at as u64 + offset)));
    }
}
