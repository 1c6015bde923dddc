//! A stream whose Gaussians a network predicts: an arbitrary one that decodes, with the digests that it lacks.

use super::noise;
use arbitrary::{Arbitrary, Unstructured};
use splatstream_decoder::process::Options;
use splatstream_decoder::stream::decode_stream;
use splatstream_format::arbitrary_stream::dynamic::{ArbitraryIncrement, DynamicStream};
use splatstream_format::{ErrorKind, Limits};
use std::ops::ControlFlow;

/// Large enough for a predicted frame with a network, small enough for a seed.
const SIZES: std::ops::Range<usize> = 1000..3000;

pub(crate) fn stream() -> Vec<u8> {
    let arbitrary = |seed| {
        let noise = noise(seed, 2000);
        let mut stream = DynamicStream::arbitrary(&mut Unstructured::new(&noise)).ok()?;
        stream.points = None;
        let bytes = stream.to_bytes().ok()?;
        let unverified = Options { verify: false, ..Options::default() };
        let unlearned = Limits { max_learned: 0, ..Limits::default() };
        let is_learned = matches!(
            error(&bytes, &Options { limits: unlearned, ..unverified }),
            Some(ErrorKind::OverLimit { limit: "max_learned", .. })
        );
        (is_learned && SIZES.contains(&bytes.len()) && error(&bytes, &unverified).is_none()).then_some(stream)
    };
    with_digests((0..).find_map(arbitrary).unwrap())
}

fn error(bytes: &[u8], options: &Options) -> Option<ErrorKind> {
    decode_stream(bytes, options, |_, _| ControlFlow::Continue(())).end.map(|error| error.kind)
}

fn increments(stream: &mut DynamicStream) -> impl Iterator<Item = &mut ArbitraryIncrement> {
    stream.gops.iter_mut().flat_map(|gop| &mut gop.frames).flat_map(|frame| &mut frame.increments)
}

/// Puts what the decoder computes in the place of each digest that it refuses.
fn with_digests(mut stream: DynamicStream) -> Vec<u8> {
    for (number, increment) in (0..).zip(increments(&mut stream)) {
        (increment.header.refinement_digest, increment.header.carried_digest) = (2 * number, 2 * number + 1);
    }
    loop {
        let bytes = stream.to_bytes().unwrap();
        let Some(kind) = error(&bytes, &Options::default()) else { return bytes };
        let ErrorKind::Digest { stored, computed } = kind else { panic!("{kind:?}") };
        let headers = increments(&mut stream).map(|increment| &mut increment.header);
        let mut digests =
            headers.flat_map(|header| [&mut header.refinement_digest, &mut header.carried_digest]);
        *digests.find(|digest| **digest == stored).unwrap() = computed;
    }
}
