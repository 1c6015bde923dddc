//! Clause 7.15: cells and displacement, in the words of the specification.

use super::gaussian::{Splat, round, within};
use splatstream_format::syntax::SequenceParameters;

/// A cell as 7.15.1 gives it: sums taken, bias added.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Cell {
    pub(crate) code: u64,
    pub(crate) stale: i64,
    pub(crate) translation: [i64; 3],
    pub(crate) turn: [i64; 3],
}

/// The cells of a frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Field<'a> {
    pub(crate) sequence: &'a SequenceParameters,
    pub(crate) cell_log2: u8,
    pub(crate) cells: &'a [Cell],
}

fn dot(a: [i64; 3], b: [i64; 3]) -> i64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [i64; 3], b: [i64; 3]) -> [i64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The largest n with `n * n <= a`, bit by bit.
pub(super) fn isqrt(a: i64) -> i64 {
    (0..31).rev().fold(0, |n, bit| if (n + (1 << bit)) * (n + (1 << bit)) <= a { n + (1 << bit) } else { n })
}

/// U of SS-MO-003: `min(32767, (2^(E+1) + M) / (2 * M))` for a step of `M * 2^-E`.
pub(crate) fn unit(rotation_step: u32) -> i64 {
    let exponent = rotation_step >> 23 & 0xFF;
    assert!(exponent > 0, "steps are not subnormal");
    let m = u128::from(rotation_step & 0x7F_FFFF | 0x80_0000);
    let e = 127 + 23 - exponent;
    i64::try_from(((1_u128 << (e + 1)) + m) / (2 * m)).unwrap().min(32767)
}

impl Field<'_> {
    fn bits(&self) -> u8 {
        self.sequence.position_bits.saturating_sub(self.cell_log2).max(1)
    }

    /// SS-MO-001 and SS-MO-002.
    pub(crate) fn is_allowed(&self) -> bool {
        let codes = self.cells.windows(2).all(|pair| pair[0].code < pair[1].code);
        let ranges = self.cells.iter().all(|cell| {
            let translated = cell.translation.into_iter().all(|t| within(t, -(1 << 20), 1 << 20).is_some());
            let turned = cell.turn.into_iter().all(|t| within(t, -8192, 8192).is_some());
            cell.code < 1 << (3 * self.bits()) && within(cell.stale, 0, 1).is_some() && translated && turned
        });
        codes && ranges
    }

    fn coordinates(&self, code: u64) -> [i64; 3] {
        [0, 1, 2].map(|axis| (0..self.bits()).map(|b| ((code >> (3 * b + axis) & 1) as i64) << b).sum())
    }

    /// The cell in which a Gaussian lies, with its coordinates.
    pub(crate) fn of(&self, splat: &Splat) -> Option<([i64; 3], &Cell)> {
        let x = splat.position().map(|position| position >> self.cell_log2);
        let all = self.cells.iter().map(|cell| (self.coordinates(cell.code), cell));
        all.into_iter().find(|(coordinates, _)| *coordinates == x)
    }

    pub(crate) fn is_stale(&self, splat: &Splat) -> bool {
        self.of(splat).is_some_and(|(_, cell)| cell.stale == 1)
    }

    /// 7.15.2.
    pub(crate) fn displaced(&self, splat: &Splat) -> Splat {
        let Some((x, cell)) = self.of(splat) else { return splat.clone() };
        let v = cell.turn;
        let w = isqrt((1 << 28) - dot(v, v));
        let centre = x.map(|x| (x << (self.cell_log2 + 6)) + (1 << (self.cell_log2 + 5)));
        let d = [0, 1, 2].map(|a| splat.position_fine[a] - centre[a]);
        let m = cross(v, d);
        let u = cross(v, m);
        let last = ((1 << self.sequence.position_bits) - 1) * 64;
        let place = |a: usize| {
            let p = centre[a] + d[a] + round(w * m[a] + u[a], 27) + cell.translation[a] * 8;
            p.clamp(0, last)
        };
        let r = splat.rotation_fine;
        let one = 64 * unit(self.sequence.rotation_step);
        let big_w = isqrt((one * one - dot(r, r)).max(0));
        let c = cross(v, r);
        let turn = |k: usize| {
            let n = round(w * r[k] + v[k] * big_w + c[k], 14);
            let n = if w * big_w - dot(v, r) < 0 { -n } else { n };
            n.clamp(-32767 * 64, 32767 * 64)
        };
        Splat {
            position_fine: [place(0), place(1), place(2)],
            rotation_fine: [turn(0), turn(1), turn(2)],
            ..splat.clone()
        }
    }
}
