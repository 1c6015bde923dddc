//! Slots hold the frame, whatever order its Gaussians have.

use super::vectors;
use splatstream::{Decoder, Error, Frame, Slots};
use std::collections::HashMap;

/// Shows a frame and checks everything that is promised. `before` are the planes before.
fn check(slots: &mut Slots, frame: &Frame, name: &str) {
    let before: Vec<Vec<f32>> = slots.planes().iter().cloned().collect();
    let known: HashMap<u32, usize> =
        frame.identities().iter().filter_map(|&identity| Some((identity, slots.slot(identity)?))).collect();
    let update = slots.update(frame).unwrap();
    assert_eq!((update.kept, update.kept + update.appeared), (known.len(), frame.len()), "{name}");
    let mut used = vec![false; slots.capacity()];
    for (gaussian, &identity) in frame.identities().iter().enumerate() {
        let slot = slots.slot(identity).unwrap();
        assert!(!std::mem::replace(&mut used[slot], true), "{name}: a slot holds one Gaussian");
        assert!(
            known.get(&identity).is_none_or(|&before| before == slot),
            "{name}: a Gaussian keeps its slot"
        );
        for (mine, theirs) in slots.planes().iter().zip(frame.gaussians().planes().iter()) {
            assert_eq!(mine[slot].to_bits(), theirs[gaussian].to_bits(), "{name}");
        }
    }
    let is_dirty = |slot: usize| update.dirty.iter().any(|range| range.contains(&slot));
    for (slot, used) in used.into_iter().enumerate() {
        let opacity = slots.planes().opacity_logit[slot];
        assert!(used || opacity == f32::NEG_INFINITY, "{name}: a slot without a Gaussian is not seen");
        let mut pairs = slots.planes().iter().zip(&before);
        let is_same = pairs.all(|(now, before)| now[slot].to_bits() == before[slot].to_bits());
        assert!(is_same || is_dirty(slot), "{name}: what changes is told");
    }
}

#[test]
fn slots_hold_the_frames_of_every_vector() {
    for (path, bytes) in vectors::all() {
        let mut slots: Option<Slots> = None;
        for frame in
            Decoder::from_bytes(bytes).map_while(Result::ok).take(8).filter(|frame| frame.len() < 2000)
        {
            check(slots.get_or_insert_with(|| Slots::new(2000)), &frame, &path.display().to_string());
        }
    }
}

#[test]
fn gaussians_survive_within_a_gop() {
    let mut slots = Slots::new(400);
    for frame in Decoder::from_bytes(vectors::talk()) {
        let frame = frame.unwrap();
        let update = slots.update(&frame).unwrap();
        if !frame.is_keyframe() {
            assert!(update.kept > 300, "{update:?}");
            assert!(update.dirty.iter().map(ExactSizeIterator::len).sum::<usize>() < 300, "most stand still");
        }
    }
}

#[test]
fn a_frame_that_does_not_fit_changes_nothing() {
    let frame = Decoder::from_bytes(vectors::talk()).next_frame().unwrap().unwrap();
    let mut slots = Slots::new(399);
    let error = slots.update(&frame).unwrap_err();
    assert!(matches!(error, Error::TooFewSlots { needed: 400, capacity: 399 }));
    assert!(slots.planes().opacity_logit.iter().all(|&opacity| opacity == f32::NEG_INFINITY));
}
