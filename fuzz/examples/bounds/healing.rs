//! Digests for a stream of which only the frames are known: what decodes without digests says what they are.

use splatstream_decoder::digest::{ListDigest, list_digest, lists_digest};
use splatstream_decoder::operating_point::OperatingPoint;
use splatstream_decoder::process::Options;
use splatstream_decoder::stream::decode_stream;
use splatstream_format::syntax::{IncrementHeader, Profile, SequenceParameters, UnitHeader, UnitType};
use splatstream_format::unit::Stream;
use splatstream_format::{ErrorKind, Limits};
use std::collections::BTreeMap;
use std::ops::ControlFlow;

/// Offset of `refinement_digest` in the payload of an increment.
const DIGEST: usize = 2;

/// Puts the digests of lists, and then those of carried lists, into a stream.
pub(crate) fn heal(bytes: &mut [u8], limits: &Limits) {
    let sizes = list_sizes(bytes, limits);
    let layers = sizes.keys().map(|(_, layer)| layer + 1).max().unwrap_or(0);
    let mut elements = Vec::new();
    for layer in 0..layers {
        let point = OperatingPoint { spatial: layer, ..OperatingPoint::ALL };
        let options =
            Options { limits: *limits, verify: false, operating_point: point, ..Options::default() };
        let summary = decode_stream(bytes, &options, |_, frame| {
            let mut start = 0;
            let mut digests: Vec<ListDigest> = Vec::new();
            for &(at, size) in sizes.get(&(frame.index, layer)).into_iter().flatten().take(frame.level.into())
            {
                digests.extend(list_digest(&frame.planes, start..start + size));
                start += size;
                elements.push((at + DIGEST, lists_digest(&digests)));
            }
            ControlFlow::Continue(())
        });
        assert_eq!(summary.verdict(), None, "without digests it decodes");
    }
    put(bytes, &elements);
    let options = Options { limits: *limits, ..Options::default() };
    let summary = decode_stream(bytes, &options, |_, _| ControlFlow::Continue(()));
    let of_carried = summary.errors.iter().filter_map(|error| match error.kind {
        ErrorKind::Digest { computed, .. } => Some((error.at as usize, computed)),
        _ => None,
    });
    put(bytes, &of_carried.collect::<Vec<_>>());
}

fn put(bytes: &mut [u8], elements: &[(usize, u64)]) {
    for &(at, digest) in elements {
        bytes[at..at + 8].copy_from_slice(&digest.to_le_bytes());
    }
    // The checksum of each payload, and then of its unit header.
    let mut at = splatstream_format::syntax::FileHeader::SIZE;
    while at < bytes.len() {
        let (header, rest) = bytes[at..].split_at_mut(UnitHeader::SIZE);
        let length = u32::from_le_bytes(header[12..16].try_into().expect("four bytes")) as usize;
        header[16..20].copy_from_slice(&crc32fast::hash(&rest[..length]).to_le_bytes());
        let covered = [&header[..6], &header[8..]].concat();
        header[6..8].copy_from_slice(&crc32fast::hash(&covered).to_le_bytes()[..2]);
        at += UnitHeader::SIZE + length;
    }
}

/// Offset of the payload and size of each list, by frame and spatial layer.
fn list_sizes(bytes: &[u8], limits: &Limits) -> BTreeMap<(u32, u8), Vec<(usize, usize)>> {
    let stream = Stream::open(bytes, limits).expect("a file header");
    let mut sequence: Option<SequenceParameters> = None;
    let mut sizes: BTreeMap<(u32, u8), Vec<(usize, usize)>> = BTreeMap::new();
    for unit in stream.units().map(|unit| unit.expect("units are intact")) {
        let (payload, at) = (unit.payload, unit.payload_at);
        match unit.header.unit_type() {
            UnitType::SequenceParameters => {
                sequence = SequenceParameters::parse_payload(payload, at, Profile::Dynamic).ok();
            }
            UnitType::Increment => {
                let sequence = sequence.as_ref().expect("parameters come first");
                let parsed = IncrementHeader::parse(payload, at, sequence, Profile::Dynamic);
                let size = parsed.expect("an increment").0.list_size() as usize;
                let lists = sizes.entry((unit.header.frame, unit.header.spatial_layer)).or_default();
                lists.push((at as usize, size));
            }
            _ => {}
        }
    }
    sizes
}
