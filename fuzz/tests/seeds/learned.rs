//! A stream whose Gaussians a network predicts: an arbitrary one that decodes, with the digests that it lacks.

use super::noise;
use arbitrary::Unstructured;
use splatstream_decoder::process::Options;
use splatstream_decoder::stream::decode_stream;
use splatstream_format::arbitrary_stream::ArbitraryStream;
use splatstream_format::syntax::Profile;
use splatstream_format::{Error, ErrorKind, Limits};
use std::ops::ControlFlow;

/// Large enough for a predicted frame, small enough for a seed.
const SIZES: std::ops::Range<usize> = 1000..3000;

/// A stream whose Gaussians a network predicts.
pub(crate) fn stream() -> Vec<u8> {
    let unverified = Options { verify: false, ..Options::default() };
    let unlearned = Limits { max_learned: 0, ..Limits::default() };
    let is_refused = |error: &Error| matches!(error.kind, ErrorKind::OverLimit { limit: "max_learned", .. });
    let arbitrary = |seed| {
        let noise = noise(seed, 2000);
        let mut stream =
            ArbitraryStream::of_profile(Profile::Dynamic, &mut Unstructured::new(&noise)).ok()?;
        stream.points = None;
        let bytes = stream.to_bytes().ok()?;
        let refused = errors(&bytes, &Options { limits: unlearned, ..unverified });
        let is_learned = refused.first().is_some_and(is_refused) && SIZES.contains(&bytes.len());
        (is_learned && errors(&bytes, &unverified).is_empty()).then_some(stream)
    };
    with_digests((0..).find_map(arbitrary).unwrap())
}

fn errors(bytes: &[u8], options: &Options) -> Vec<Error> {
    decode_stream(bytes, options, |_, _| ControlFlow::Continue(())).errors
}

/// Puts what the decoder computes in the place of each digest that it refuses.
fn with_digests(mut stream: ArbitraryStream) -> Vec<u8> {
    let mut next = 0..;
    digests(&mut stream, |digest| *digest = next.next().unwrap());
    loop {
        let bytes = stream.to_bytes().unwrap();
        let errors = errors(&bytes, &Options::default());
        let Some(error) = errors.first() else { return bytes };
        let ErrorKind::Digest { stored, computed } = error.kind else { panic!("{error}") };
        digests(&mut stream, |digest| {
            if *digest == stored {
                *digest = computed;
            }
        });
    }
}

fn digests(stream: &mut ArbitraryStream, mut visit: impl FnMut(&mut u64)) {
    for frame in stream.gops.iter_mut().flat_map(|gop| &mut gop.frames) {
        frame.carried_digest.iter_mut().for_each(&mut visit);
        frame.increments.iter_mut().for_each(|increment| visit(&mut increment.header.refinement_digest));
    }
}
