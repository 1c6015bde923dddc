//! Clause 7.17.6: the fast path gives the integers of the text, whatever the network and whatever it sees.
#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

use proptest::prelude::*;
use splatstream_decoder::transformer::{Batch, LANES, LaneNetwork, Machine, Seen, scalar};
use splatstream_format::payload::{Layer, Network, Part};
use splatstream_format::syntax::NetworkHeader;

/// A header with every element in its range.
fn header() -> impl Strategy<Value = NetworkHeader> {
    let widths = (3_u8..=6, 0_u8..=128, 0_u8..=32, 0_u8..=4, 1_u8..=16);
    let rest = ((0_u8..=3, 0_u8..=16), 0_u8..=8, 0_u8..=4, any::<[u8; 8]>(), 0_u8..=7);
    (widths, rest).prop_map(
        |(widths, ((dc_count, sh_count), token_shift, output_shift, shifts, network_flags))| {
            let (width_log2, feed_forward_width, geometry_width, fourier_count, rank_count) = widths;
            NetworkHeader {
                network_flags,
                width_log2,
                feed_forward_width,
                geometry_width,
                fourier_count,
                rank_count,
                dc_count,
                sh_count: sh_count.max(u8::from(dc_count == 0)),
                token_shift,
                output_shift,
                layer_shift: shifts.map(|shift| shift % 15 + 1),
            }
        },
    )
}

/// How parameters and inputs are spread: all alike, at the corners, or anywhere.
#[derive(Debug, Clone, Copy)]
enum Spread {
    Zero,
    Least,
    Most,
    Corners,
    Anywhere,
}

fn spread() -> impl Strategy<Value = Spread> {
    use Spread::*;
    prop_oneof![Just(Zero), Just(Least), Just(Most), Just(Corners), Just(Anywhere), Just(Anywhere)]
}

/// Numbers from a seed.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        self.0 >> 33
    }

    /// A number in `least..=most`.
    fn one(&mut self, spread: Spread, least: i64, most: i64) -> i64 {
        let any = self.next();
        match spread {
            Spread::Zero => 0,
            Spread::Least => least,
            Spread::Most => most,
            Spread::Corners => [least, most][any as usize % 2],
            Spread::Anywhere => least + (any as i64) % (most - least + 1),
        }
    }
}

fn network(header: NetworkHeader, spread: Spread, numbers: &mut Numbers) -> Network {
    let layers = Part::ALL.map(|part| {
        let (weights, biases) = part.lengths(&header);
        Layer {
            weights: (0..weights).map(|_| numbers.one(spread, -128, 127) as i8).collect(),
            bias: (0..biases).map(|_| numbers.one(spread, -32_768, 32_767) as i16).collect(),
        }
    });
    Network::new(header, layers).unwrap()
}

/// What the network sees of [`LANES`] Gaussians.
fn batch(header: &NetworkHeader, neighbours: usize, spread: Spread, numbers: &mut Numbers) -> Batch {
    let mut batch = Batch::new(header, neighbours);
    for lane in 0..LANES {
        let mut offsets = Vec::new();
        for rank in 0..neighbours {
            let components: Vec<i64> = (0..header.outputs())
                .map(|_| numbers.one(spread, -(1 << 48), 1 << 48) >> (numbers.next() % 30))
                .collect();
            let geometry =
                [(); 7].map(|()| numbers.one(spread, -65_535, 65_535) as i32 >> (numbers.next() % 14));
            let affinity = numbers.one(spread, 0, 4096).max(1);
            let distance = numbers.one(spread, 0, 1 << 41).unsigned_abs();
            let seen = Seen { components: &components, geometry, affinity, distance, ..Seen::default() };
            batch.set_token(header, (lane, rank), &seen, 1 << 41);
            offsets.push([(); 3].map(|()| numbers.one(spread, -(1 << 20) + 1, (1 << 20) - 1) as i32));
        }
        batch.set_near(lane, &offsets);
    }
    batch
}

proptest! {
    // covers: SS-TR-003, SS-TR-004, SS-TR-005, SS-TR-006, SS-TR-007, SS-TR-008, SS-TR-009
    #[test]
    fn the_fast_path_gives_the_integers_of_the_text(
        header in header(),
        neighbours in 1_usize..=16,
        spreads in (spread(), spread()),
        seed: u64,
    ) {
        let mut numbers = Numbers(seed);
        let network = network(header, spreads.0, &mut numbers);
        let batch = batch(&header, neighbours, spreads.1, &mut numbers);
        let lanes = LaneNetwork::new(&network);
        let fast = lanes.outputs(&batch);
        // With the instructions of this machine, and with those of every machine.
        for machine in Machine::all() {
            prop_assert_eq!(fast, lanes.outputs_on(machine, &batch), "{:?}", machine);
        }
        for lane in 0..LANES {
            let slow = scalar::outputs(&network, &batch, lane);
            let fast: Vec<i32> = fast.iter().take(header.outputs()).map(|row| row[lane]).collect();
            prop_assert_eq!(&slow, &fast, "lane {}", lane);
        }
    }
}
