//! Points in the order of their Morton codes.
//!
//! A radix sort, digit by digit from the lowest: its time grows with the number of points alone, whatever a stream makes
//! of their codes.
//!
//! What is added here counts points or is an index of one, so that no sum is above the number of points.

use crate::cores;
use crate::interrupt::Interrupt;
use crate::position::morton;
use crate::vector::{Task, vectorized};
use splatstream_format::entropy::machine::Machine;

/// Bits of a digit.
const DIGIT: u32 = 11;
/// Values of a digit.
const VALUES: usize = 1 << DIGIT;
/// Digits of a code, which has at most 63 bits.
const DIGITS: usize = 6;
/// Codes below which comparisons are faster.
const FEW: usize = 512;

/// Points whose codes one task computes.
const RUN: usize = 4096;
/// Points between two looks at the interrupt.
const PART: usize = 1 << 16;

/// The Morton codes of points, given by their planes x, y, z of one length. Coordinates are below 2^21. Where an interrupt is
/// requested, they mean nothing.
pub(crate) fn codes([xs, ys, zs]: [&[u32]; 3], interrupt: &Interrupt) -> Vec<u64> {
    let mut codes = vec![0; xs.len()];
    let runs = codes.chunks_mut(RUN).zip(xs.chunks(RUN).zip(ys.chunks(RUN)).zip(zs.chunks(RUN)));
    cores::for_each(interrupt, xs.len().saturating_mul(3), runs, |(codes, ((xs, ys), zs))| {
        vectorized(Codes { points: [xs, ys, zs], codes });
    });
    codes
}

struct Codes<'c> {
    points: [&'c [u32]; 3],
    codes: &'c mut [u64],
}

impl Task for Codes<'_> {
    #[inline(always)]
    fn run(self, _: impl Machine) {
        let [xs, ys, zs] = self.points;
        for (code, ((&x, &y), &z)) in self.codes.iter_mut().zip(xs.iter().zip(ys).zip(zs)) {
            *code = morton(x, y, z);
        }
    }
}

/// The indices of codes in the order of (code, index); where an interrupt is requested, the order means nothing.
pub(crate) fn order(codes: impl ExactSizeIterator<Item = u64>, interrupt: &Interrupt) -> Vec<(u64, u32)> {
    let mut points: Vec<(u64, u32)> = codes.zip(0..).collect();
    if points.len() < FEW {
        points.sort_unstable();
        return points;
    }
    if interrupt.is_requested() {
        return points;
    }
    let all = points.iter().fold(0, |all, (code, _)| all | code);
    let bits = u64::BITS.wrapping_sub(all.leading_zeros());
    let mut counts = vec![[0_u32; VALUES]; DIGITS.min(bits.div_ceil(DIGIT) as usize)];
    for (code, _) in parts(&points, interrupt).flatten() {
        for (position, counts) in (0_u32..).zip(&mut counts) {
            if let Some(count) = counts.get_mut(digit(*code, position)) {
                *count = count.wrapping_add(1);
            }
        }
    }
    let mut sorted = vec![(0, 0); points.len()];
    for (position, counts) in (0_u32..).zip(&mut counts) {
        let most = counts.iter().copied().max().map_or(0, |most| most as usize);
        if interrupt.is_requested() {
            break;
        }
        if most == points.len() {
            // All points have the same digit.
            continue;
        }
        let mut next = 0_u32;
        for count in counts.iter_mut() {
            let first = next;
            next = next.wrapping_add(*count);
            *count = first;
        }
        for point in parts(&points, interrupt).flatten() {
            let Some(place) = counts.get_mut(digit(point.0, position)) else { continue };
            if let Some(slot) = sorted.get_mut(*place as usize) {
                *slot = *point;
            }
            *place = place.wrapping_add(1);
        }
        core::mem::swap(&mut points, &mut sorted);
    }
    points
}

/// The points, as long as no interrupt is requested.
fn parts<'p>(points: &'p [(u64, u32)], interrupt: &'p Interrupt) -> impl Iterator<Item = &'p [(u64, u32)]> {
    points.chunks(PART).take_while(|_| !interrupt.is_requested())
}

#[inline(always)]
fn digit(code: u64, position: u32) -> usize {
    (code.wrapping_shr(position.wrapping_mul(DIGIT)) as usize) & (VALUES - 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn codes_come_in_their_order(
            mut codes in proptest::collection::vec(prop_oneof![0_u64..1 << 63, 0_u64..99, Just(7)], 0..2000),
            shift in 0_u32..60,
        ) {
            codes.iter_mut().for_each(|code| *code >>= shift);
            let mut expected: Vec<(u64, u32)> = codes.iter().copied().zip(0..).collect();
            expected.sort_unstable();
            prop_assert_eq!(order(codes.into_iter(), Interrupt::NEVER), expected);
        }
    }
}
