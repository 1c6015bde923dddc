//! Changes of decoded frames.

use splatstream_decoder::frame::QuantizedFrame;
use splatstream_decoder::process::{Compensation, DecodedFrame};

/// Applies `change` to the planes after compensation.
fn change_shown(frames: &mut [DecodedFrame], change: impl Fn(&mut QuantizedFrame)) {
    for frame in frames {
        let mut shown = frame.clone().into_shown();
        change(&mut shown);
        frame.planes = shown;
        frame.compensation = Compensation::default();
    }
}

/// Applies `change` to each value; positions stay unsigned.
fn change_values(planes: &mut QuantizedFrame, mut change: impl FnMut(i32) -> i32) {
    for value in planes.position.iter_mut().flatten() {
        *value = change(value.cast_signed()).unsigned_abs();
    }
    planes.signed_planes_mut().flatten().for_each(|value| *value = change(*value));
}

/// Values unrelated to the right ones, the same in every run.
pub(crate) fn fill_with_noise(frames: &mut [DecodedFrame]) {
    change_shown(frames, |planes| {
        let mut state = 1_u32;
        change_values(planes, |_| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 12).cast_signed()
        });
    });
}

/// Zeros.
pub(crate) fn fill_with_zeros(frames: &mut [DecodedFrame]) {
    change_shown(frames, |planes| change_values(planes, |_| 0));
}

/// Adds one to the last opacity of the last frame that has any, in display order.
pub(crate) fn flip_last_bit(frames: &mut [DecodedFrame]) {
    let last = frames.iter_mut().filter(|frame| !frame.planes.is_empty()).max_by_key(|frame| frame.index);
    change_shown(last.map_or(&mut [], std::slice::from_mut), |planes| {
        if let Some(value) = planes.opacity.last_mut() {
            *value = value.wrapping_add(1);
        }
    });
}

/// The Gaussians in the reverse order.
pub(crate) fn reverse(frames: &mut [DecodedFrame]) {
    change_shown(frames, |planes| {
        planes.position.iter_mut().for_each(|plane| plane.reverse());
        planes.signed_planes_mut().for_each(|plane| plane.reverse());
    });
}

/// All Gaussians but the last.
pub(crate) fn drop_last_gaussian(frames: &mut [DecodedFrame]) {
    change_shown(frames, |planes| planes.truncate(planes.len().saturating_sub(1)));
}

/// I and P frames.
pub(crate) fn keep_all_but_b(frames: &mut Vec<DecodedFrame>) {
    frames.retain(|frame| frame.frame_type.name() != "B");
}

/// The values before compensation (7.8.3).
pub(crate) fn forget_compensation(frames: &mut [DecodedFrame]) {
    frames.iter_mut().for_each(|frame| frame.compensation = Compensation::default());
}
