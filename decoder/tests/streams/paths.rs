//! One result, whichever way it is computed.

use crate::write::{Dice, Plan, Script, decoded};
use core::ops::ControlFlow;
use proptest::prelude::*;
use splatstream_decoder::frame_memory::FrameMemory;
use splatstream_decoder::process::{DecodedFrame, Options};
use splatstream_decoder::stream::{Summary, decode_stream_inside, decode_stream_to};
use splatstream_format::syntax::UnitType;
use std::sync::LazyLock;

fn with_threads(count: usize, bytes: &[u8], options: &Options) -> (Summary, Vec<DecodedFrame>) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(count).build().unwrap();
    pool.install(|| decoded(bytes, options))
}

#[test]
fn blocks_that_go_straight_into_planes_give_what_lists_give() {
    for seed in 0..20 {
        let plan = Plan { percents: vec![7, 30, 60, 100], gaussians: 500, ..Plan::intra(seed) };
        let bytes = plan.script().bytes();
        let (summary, frames) = decoded(&bytes, &Options::default());
        assert_eq!((summary.errors, frames.len()), (Vec::new(), 3));
        // Entropy states need the values of a unit by themselves: then nothing goes straight into planes.
        let (_, mut with_states) = decoded(&bytes, &Options { entropy: true, ..Options::default() });
        assert!(with_states.iter().all(|frame| frame.entropy.len() == 4));
        with_states.iter_mut().for_each(|frame| frame.entropy.clear());
        assert_eq!(frames, with_states, "{seed}");
    }
}

#[test]
fn what_was_in_the_memory_of_a_frame_before_changes_nothing() {
    let memory = FrameMemory::default();
    for plan in [Plan::intra(3), Plan::predicted(4), Plan { gaussians: 90, ..Plan::intra(0) }, Plan::intra(7)]
    {
        let bytes = plan.script().bytes();
        let (expected, fresh) = decoded(&bytes, &Options::default());
        // Such as no frame has.
        let mut junk = fresh[0].planes.clone();
        junk.position.iter_mut().for_each(|plane| plane.fill(u32::MAX));
        junk.signed_planes_mut().for_each(|plane| plane.fill(i32::MIN));
        memory.recycle_integers(junk);
        let mut frames = Vec::new();
        let summary = decode_stream_to(&memory, &bytes, None, &Options::default(), |_, frame| {
            frames.push(frame.clone());
            memory.recycle_integers(frame.planes);
            ControlFlow::Continue(())
        });
        assert_eq!((summary, frames), (expected, fresh));
    }
}

#[test]
fn the_number_of_threads_changes_nothing() {
    for plan in [Plan::intra(3), Plan::predicted(4)] {
        let bytes = plan.script().bytes();
        let one = with_threads(1, &bytes, &Options::default());
        assert_eq!(one.0.errors, []);
        assert_eq!(one, with_threads(5, &bytes, &Options::default()));
    }
}

#[test]
fn a_decoder_that_starts_inside_gives_the_frames_from_there_on() {
    for plan in [Plan::intra(5), Plan::predicted(6)] {
        let script = plan.script();
        let gop = script.offsets()[script.indices(UnitType::GopHeader)[1]];
        let (_, all) = decoded(&script.bytes(), &Options::default());
        let mut frames = Vec::new();
        let summary = decode_stream_inside(&script.bytes(), gop as u64, &Options::default(), |_, frame| {
            frames.push(frame);
            ControlFlow::Continue(())
        });
        assert_eq!((summary.errors, summary.lost), (Vec::new(), Vec::new()));
        assert_eq!(frames, all[plan.gops[0] as usize..]);
    }
}

/// A stream of predicted frames and one of I frames.
static SCRIPTS: LazyLock<[Script; 2]> =
    LazyLock::new(|| [Plan::predicted(0).script(), Plan::intra(0).script()]);

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    /// Whatever happens to a stream: decoding ends, the verdict is the first error, and a decoder that stops there has
    /// given the frames before it.
    #[test]
    fn a_damaged_stream_has_one_verdict(seed: u64, is_intra: bool) {
        let mut dice = Dice::new(seed);
        let mut script = SCRIPTS[usize::from(is_intra)].clone();
        let first = dice.below(script.parts.len() as u64) as usize;
        let second = dice.below(script.parts.len() as u64) as usize;
        match dice.below(4) {
            0 => script.parts.swap(first, second),
            1 => _ = script.parts.remove(first),
            2 => {
                let part = script.parts[second].clone();
                script.parts.insert(first, part);
            }
            _ => {
                let payload = &mut script.parts[first].payload;
                let at = dice.below(payload.len() as u64) as usize;
                payload[at] ^= 1 << dice.below(8);
            }
        }
        let mut bytes = script.bytes();
        if dice.below(2) == 0 {
            let at = dice.below(bytes.len() as u64) as usize;
            bytes[at] ^= 1 << dice.below(8);
        }
        let (summary, frames) = decoded(&bytes, &Options::default());
        let stop = Options { stop_at_first_error: true, ..Options::default() };
        let (stopped, before) = decoded(&bytes, &stop);
        prop_assert_eq!(stopped.errors.first(), summary.errors.first());
        prop_assert_eq!(stopped.errors.len(), summary.errors.len().min(1));
        prop_assert!(frames.starts_with(&before));
        prop_assert!(summary.lost.is_empty() || !summary.errors.is_empty());
        let without = Options { verify: false, ..Options::default() };
        prop_assert!(decoded(&bytes, &without).1.len() >= before.len());
    }
}
