//! A network by the names of 6.17, and the bytes of 5.17 that carry it.

use crate::crafted::sample::Dice;
use splatstream_format::syntax::NetworkHeader;
use std::collections::BTreeMap;

/// The elements of 5.17.1, and the arrays of 6.17.2 row by row; an array of one dimension is one row.
#[derive(Debug, Clone)]
pub(crate) struct Network {
    pub(crate) header: NetworkHeader,
    arrays: BTreeMap<&'static str, Vec<Vec<i64>>>,
}

/// Bits of `network_flags`.
pub(crate) const FULL_ATTENTION: u8 = 1;
pub(crate) const GATED: u8 = 2;
pub(crate) const NORMALISED: u8 = 4;
pub(crate) const KNN_BASE: u8 = 8;

/// Name of an array, whether its values are i16, rows and values of a row.
type Array = (&'static str, bool, usize, usize);

/// The table of 6.17.2.
fn table(header: &NetworkHeader) -> [Array; 18] {
    let [d, e, g] =
        [1 << header.width_log2, header.feed_forward_width, header.geometry_width].map(usize::from);
    let n = usize::from(header.dc_count + header.sh_count);
    let if_flag = |flag: u8, holds: bool| if (header.network_flags & flag != 0) == holds { d } else { 0 };
    [
        ("geometry", false, g, 3),
        ("geometry_bias", true, 1, g),
        ("geometry_embedding", false, d, g),
        ("embedding", false, d, n + 8),
        ("rank_embedding", true, header.rank_count.into(), d),
        ("query", false, 1, if_flag(FULL_ATTENTION, false)),
        ("attention", false, d, d),
        ("fourier", false, 1, 6 * usize::from(header.fourier_count)),
        ("value", false, d, d),
        ("value_bias", true, 1, d),
        ("gain", false, 1, if_flag(NORMALISED, true)),
        ("gain_bias", true, 1, if_flag(NORMALISED, true)),
        ("widening", false, e, d),
        ("widening_bias", true, 1, e),
        ("narrowing", false, d, e),
        ("narrowing_bias", true, 1, if e > 0 { d } else { 0 }),
        ("head", false, n, d),
        ("head_bias", true, 1, n),
    ]
}

impl Network {
    /// A network whose parameters `value` gives: of the name of the array and the range of its values.
    pub(crate) fn new(header: NetworkHeader, mut value: impl FnMut(&str, i64, i64) -> i64) -> Self {
        let mut array = |(name, is_wide, rows, columns): Array| {
            let most = if is_wide { 32_767 } else { 127 };
            let mut row = || (0..columns).map(|_| value(name, -most - 1, most)).collect();
            (name, (0..rows).map(|_| row()).collect())
        };
        Self { header, arrays: table(&header).into_iter().map(&mut array).collect() }
    }

    /// Any small network, of parameters that let most activations be neither 0 nor at the end of their range.
    pub(crate) fn drawn(dice: &mut Dice) -> Self {
        let mut below = |end: u64| dice.below(end) as u8;
        let dc_count = below(4);
        let header = NetworkHeader {
            network_flags: below(16),
            width_log2: 3 + below(2),
            feed_forward_width: [0, 5, 8][usize::from(below(3))],
            geometry_width: [0, 3, 8][usize::from(below(3))],
            fourier_count: below(5),
            rank_count: 1 + below(16),
            dc_count,
            sh_count: below(4) + u8::from(dc_count == 0),
            token_shift: below(3),
            output_shift: below(5),
            layer_shift: [(); 8].map(|()| 6 + below(3)),
        };
        Self::new(header, |name, least, most| {
            // Biases as large as the sums to which they are added.
            let share = if most > 127 { 8 } else { 1 };
            if name == "head_bias" {
                dice.within(-500, 500)
            } else {
                dice.within(least / share, most / share)
            }
        })
    }

    /// An array of two dimensions.
    pub(crate) fn rows(&self, name: &str) -> &[Vec<i64>] {
        &self.arrays[name]
    }

    /// An array of one dimension.
    pub(crate) fn row(&self, name: &str) -> &[i64] {
        &self.arrays[name][0]
    }

    /// Gives a parameter another value.
    pub(crate) fn set(&mut self, name: &str, row: usize, place: usize, value: i64) {
        self.arrays.get_mut(name).unwrap()[row][place] = value;
    }

    /// Whether a bit of `network_flags` is set.
    pub(crate) fn is(&self, flag: u8) -> bool {
        self.header.network_flags & flag != 0
    }

    /// The payload of the weights unit.
    pub(crate) fn payload(&self) -> Vec<u8> {
        let h = &self.header;
        let sizes = [h.network_flags, h.width_log2, h.feed_forward_width, h.geometry_width, h.fourier_count];
        let counts = [h.rank_count, h.dc_count, h.sh_count, h.token_shift, h.output_shift];
        let mut bytes = [&[0], &sizes[..], &counts[..], &h.layer_shift[..]].concat();
        for (name, is_wide, ..) in table(h) {
            for &value in self.arrays[name].iter().flatten() {
                let two = i16::try_from(value).unwrap().to_le_bytes();
                bytes.extend(if is_wide {
                    two.to_vec()
                } else {
                    i8::try_from(value).unwrap().to_le_bytes().to_vec()
                });
            }
        }
        bytes
    }
}
