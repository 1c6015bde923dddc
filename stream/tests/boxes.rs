//! C.2 to C.6: another reader of ISO BMFF finds in the files what the annex says. What tests cover
//! stands before them; `conformance/coverage/carriage.csv` is made of it.
#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

mod common;

use common::{File, package, read, words, worked_example};
use mp4_atom::{Codec, FourCC};
use splatstream_format::Limits;
use splatstream_format::syntax::{EndOfStream, UnitId, UnitType};
use splatstream_format::unit::{Stream, write_unit};
use splatstream_stream::division::Division;
use splatstream_stream::package::{Clock, Layout, Options};

const BOTH: [Layout; 2] = [Layout::Gop, Layout::Frame];

fn read_all(layout: Layout) -> Vec<File> {
    let stream = worked_example();
    read(&package(&stream, &Options { layout, ..Options::default() }))
}

fn division() -> Division {
    Division::of(&worked_example(), &Limits::default()).unwrap()
}

// covers: SS-CR-003, SS-CR-019
#[test]
fn boxes_come_in_the_order_of_the_annex() {
    for layout in BOTH {
        for file in read_all(layout) {
            let kinds = file.kinds().join(" ");
            let rest = kinds.strip_prefix("ftyp moov sidx ssix moof mdat").unwrap();
            let rest = rest.strip_suffix(" gssT");
            assert_eq!(rest.is_some(), file.name == "s0.mp4", "{kinds}");
            let fragments = rest.unwrap_or(kinds.strip_prefix("ftyp moov sidx ssix moof mdat").unwrap());
            assert_eq!(fragments.replace(" moof mdat", ""), "", "{kinds}");
        }
    }
    let stream = worked_example();
    let files = read_all(Layout::Gop);
    let tail = usize::try_from(division().tail_start).unwrap();
    assert_eq!(files[0].body("gssT").unwrap(), [&[0; 4], &stream[tail..]].concat());
}

// covers: SS-CR-008, SS-CR-009, SS-CR-010
#[test]
fn the_movie_has_a_track_for_each_refinement() {
    let (stream, division) = (worked_example(), division());
    let head = &stream[..usize::try_from(division.head_end).unwrap()];
    for file in read_all(Layout::Gop) {
        let moov = file.moov();
        assert_eq!(moov.trak.len(), usize::from(division.sequence.refinement_count));
        for (refinement, track) in (0_u8..).zip(&moov.trak) {
            assert_eq!(track.tkhd.track_id, u32::from(refinement) + 1);
            assert_eq!(track.mdia.mdhd.timescale, division.sequence.ticks_per_second);
            assert_eq!(track.mdia.hdlr.handler, FourCC::new(b"volv"));
            assert_eq!(track.tref.is_some(), refinement > 0);
            let Codec::Unknown(kind, entry) = &track.mdia.minf.stbl.stsd.codecs[0] else { panic!("known") };
            assert_eq!(*kind, FourCC::new(b"gss1"));
            let (kind, layer) = file.name.split_at(1);
            let layer: u8 = layer.strip_suffix(".mp4").unwrap().parse().unwrap();
            let fixed = [u8::from(kind == "t"), layer, refinement, division.sequence.refinement_count];
            let of_track = if refinement == 0 { head } else { &[] };
            assert_eq!(entry[40..], [&entry[40..44], b"gssC\0\0\0\0", &fixed, of_track].concat());
        }
    }
}

// covers: SS-CR-011
#[test]
fn every_track_is_a_level() {
    for file in read_all(Layout::Gop) {
        let (start, end, _) = file.boxes[1];
        let moov = &file.bytes[start..end];
        let at = moov.windows(4).position(|four| four == b"leva").unwrap();
        let refinements = division().sequence.refinement_count;
        let levels: Vec<u8> = (1..=refinements).flat_map(|level| [0, 0, 0, level, 3]).collect();
        assert_eq!(moov[at + 4..], [&[0, 0, 0, 0, refinements], levels.as_slice()].concat());
    }
}

// covers: SS-CR-004, SS-CR-006, SS-CR-007, SS-CR-012, SS-CR-013
#[test]
fn samples_are_the_pieces_of_their_frames() {
    let (stream, division) = (worked_example(), division());
    let ticks = u64::from(Clock::of(&division.sequence).frame_ticks);
    for layout in BOTH {
        for file in read_all(layout) {
            let mut carried = 0;
            for (number, (at, moof)) in (1..).zip(file.fragments()) {
                assert_eq!((moof.mfhd.sequence_number, moof.traf.len()), (number, 1));
                let traf = &moof.traf[0];
                assert!(traf.tfhd.default_base_is_moof);
                let mut time = traf.tfdt.as_ref().unwrap().base_media_decode_time;
                let Some(run) = traf.trun.first() else { continue };
                let mut from = at + usize::try_from(run.data_offset.unwrap()).unwrap();
                for index in 0..run.samples.len() {
                    let sample = run.samples.get(index).unwrap();
                    let frame = u32::try_from(time / ticks).unwrap();
                    let pieces = division.gops.iter().flat_map(|gop| &gop.pieces);
                    let mut of_it = pieces.filter(|piece| {
                        let place = piece.place;
                        place.frame == frame
                            && place.representation.file_name() == file.name
                            && u32::from(place.refinement) + 1 == traf.tfhd.track_id
                    });
                    let size = sample.size.unwrap() as usize;
                    let bytes = of_it
                        .next()
                        .map_or(&[][..], |piece| &stream[piece.start as usize..piece.end as usize]);
                    assert_eq!(&file.bytes[from..from + size], bytes);
                    carried += usize::from(size > 0);
                    from += size;
                    time += u64::from(sample.duration.unwrap());
                }
            }
            let pieces = division.gops.iter().flat_map(|gop| &gop.pieces);
            let all = pieces.filter(|piece| piece.place.representation.file_name() == file.name).count();
            assert_eq!(carried, all, "{}", file.name);
        }
    }
}

// covers: SS-CR-015, SS-CR-016, SS-CR-018
#[test]
fn indices_lead_to_subsegments_and_their_levels() {
    let division = division();
    let refinements = usize::from(division.sequence.refinement_count);
    let end =
        division.gops.last().map(|gop| u64::from(gop.first_frame + gop.header.gop_frame_count)).unwrap();
    for layout in BOTH {
        for file in read_all(layout) {
            let (after, index) = file.index();
            let levels = words(&file.body("ssix").unwrap()[4..]);
            assert_eq!(levels[0] as usize, index.references.len());
            let mut levels = levels[1..].iter();
            let mut at = after + usize::try_from(index.first_offset).unwrap();
            let (mut time, mut gops) = (index.earliest_presentation_time, 0);
            let fragments = file.fragments();
            let mut fragments = fragments.iter();
            for reference in &index.references {
                assert_eq!(*levels.next().unwrap() as usize, refinements);
                let mut sum = 0;
                for level in 1..=refinements {
                    let range = *levels.next().unwrap();
                    let (start, moof) = fragments.next().unwrap();
                    assert_eq!((range >> 24) as usize, level);
                    assert_eq!(*start, at + sum);
                    assert_eq!(moof.traf[0].tfdt.as_ref().unwrap().base_media_decode_time, time);
                    sum += (range & 0xFF_FFFF) as usize;
                }
                assert_eq!(sum, reference.referenced_size as usize);
                assert_eq!(reference.starts_with_sap, reference.sap_type == 1);
                gops += usize::from(reference.starts_with_sap);
                at += sum;
                time += u64::from(reference.subsegment_duration);
            }
            assert_eq!(time, end * u64::from(Clock::of(&division.sequence).frame_ticks));
            assert_eq!(gops, if file.name.starts_with('s') { division.gops.len() } else { 0 });
            assert_eq!(at, file.bytes.len() - file.body("gssT").map_or(0, |tail| tail.len() + 8));
        }
    }
}

// covers: SS-CR-017
#[test]
fn a_gop_that_is_too_large_becomes_several_subsegments() {
    let stream = worked_example();
    let whole = read_all(Layout::Gop);
    let most = whole
        .iter()
        .map(|file| file.index().1.references.iter().map(|one| one.referenced_size).max().unwrap());
    let most = most.max().unwrap();
    let options = Options { max_subsegment: most - 1, ..Options::default() };
    if let Ok(package) = splatstream_stream::package::Package::of(&stream, &options, &Limits::default()) {
        let count = |files: &[File]| files.iter().map(|file| file.index().1.references.len()).sum::<usize>();
        let files = read(&package);
        assert!(count(&files) > count(&whole));
        assert!(
            files.iter().flat_map(|file| &file.index().1.references).all(|one| one.referenced_size < most)
        );
    }
    let options = Options { max_subsegment: 100, ..Options::default() };
    let error = splatstream_stream::package::Package::of(&stream, &options, &Limits::default()).unwrap_err();
    assert_eq!((error.clause, error.kind.code()), ("C.5.2", "OVER_LIMIT"));
}

/// The worked example with a private unit of so many bytes before its first frame.
fn with_private_unit(length: usize) -> Vec<u8> {
    let stream = worked_example();
    let parsed = Stream::open(&stream, &Limits::default()).unwrap();
    let units: Vec<_> = parsed.units().map(Result::unwrap).collect();
    let (gop, end) = (units[1], units.last().unwrap());
    assert_eq!(gop.header.unit_type(), UnitType::GopHeader);
    let after = gop.payload_at as usize + gop.payload.len();
    let mut out = stream[..after].to_vec();
    write_unit(&mut out, UnitId::stream(UnitType::User(200)), &vec![7; length]).unwrap();
    let more = out.len() - after;
    out.extend_from_slice(&stream[after..end.at as usize]);
    let counted = EndOfStream::parse_payload(end.payload, end.payload_at).unwrap();
    let counted = EndOfStream {
        unit_count: counted.unit_count + 1,
        index_offset: counted.index_offset + more as u64,
        ..counted
    };
    write_unit(&mut out, UnitId::stream(UnitType::End), &counted.to_bytes().unwrap()).unwrap();
    out
}

// covers: SS-CR-018
#[test]
fn a_level_of_more_than_24_bits_has_several_ranges() {
    let stream = with_private_unit(40_000_000);
    let package = package(&stream, &Options::default());
    let s0 = &read(&package)[0];
    let index = words(&s0.body("ssix").unwrap()[4..]);
    let ranges: Vec<(u32, u32)> = index[2..].iter().map(|range| (range >> 24, range & 0xFF_FFFF)).collect();
    assert_eq!(index[..2], [1, 4]);
    assert_eq!(ranges.iter().map(|range| range.0).collect::<Vec<_>>(), [1, 1, 1, 2]);
    assert_eq!((ranges[0].1, ranges[1].1), (16_777_215, 16_777_215));
    let first =
        s0.boxes.iter().filter(|(_, _, found)| ["moof", "mdat"].contains(&found.kind().to_string().as_str()));
    let sizes: Vec<usize> = first.map(|(at, end, _)| end - at).collect();
    let level: u32 = ranges[..3].iter().map(|range| range.1).sum();
    assert_eq!(level as usize, sizes[0] + sizes[1]);
    assert_eq!(s0.index().1.references[0].referenced_size, level + ranges[3].1);
}
