//! Speed of the learned predictor, of [`GAUSSIANS`] with eight neighbours: a millisecond is 100 ns a Gaussian.
//!
//! `cargo bench -p splatstream-decoder --bench transformer`
//!
//! `scalar` is the text line by line, one lane after the other, which no decoder has to run; `portable` takes what every
//! machine of the target has, SSE2 on x86-64; `fastest` what this machine has, AVX2 where it can. Where there are no
//! instructions to add products of pairs, decoders run `without_instructions`.
#![allow(clippy::unwrap_used, missing_docs, reason = "a panic is a failed benchmark")]

use core::fmt;
use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use splatstream_decoder::transformer::{Batch, LANES, LaneNetwork, Machine, Seen, scalar};
use splatstream_format::payload::{Layer, Network, Part};
use splatstream_format::syntax::NetworkHeader;

const GAUSSIANS: usize = 10_000;
const NEIGHBOURS: usize = 8;

fn main() {
    divan::main();
}

/// Which network.
#[derive(Clone, Copy)]
struct Case {
    width_log2: u8,
    full_attention: bool,
}

const fn case(width_log2: u8, full_attention: bool) -> Case {
    Case { width_log2, full_attention }
}

const CASES: [Case; 4] = [case(4, false), case(5, false), case(4, true), case(5, true)];

impl fmt::Display for Case {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let attention = if self.full_attention { "full attention" } else { "single query" };
        write!(f, "d = {}, {attention}", 1 << self.width_log2)
    }
}

fn random(state: &mut u64) -> i32 {
    *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*state >> 40) as i32
}

/// A network with every part, and what it sees.
fn inputs(case: Case) -> (Network, Vec<Batch>) {
    let mut state = 1;
    let header = NetworkHeader {
        network_flags: NetworkHeader::flags(case.full_attention, true, true, true),
        width_log2: case.width_log2,
        feed_forward_width: 2 << case.width_log2,
        geometry_width: 8,
        fourier_count: 2,
        rank_count: NEIGHBOURS as u8,
        dc_count: 3,
        sh_count: 9,
        token_shift: 3,
        output_shift: 1,
        layer_shift: [7; 8],
    };
    let layers = Part::ALL.map(|part| {
        let (weights, biases) = part.lengths(&header);
        Layer {
            weights: (0..weights).map(|_| random(&mut state) as i8).collect(),
            bias: (0..biases).map(|_| random(&mut state) as i16 >> 4).collect(),
        }
    });
    let network = Network::new(header, layers).unwrap();
    let batches = (0..GAUSSIANS / LANES).map(|_| batch(&header, &mut state)).collect();
    (network, batches)
}

fn batch(header: &NetworkHeader, state: &mut u64) -> Batch {
    let mut batch = Batch::new(header, NEIGHBOURS);
    for lane in 0..LANES {
        let mut offsets = Vec::new();
        for rank in 0..NEIGHBOURS {
            let components: Vec<i64> =
                (0..header.outputs()).map(|_| i64::from(random(state)) - (1 << 23)).collect();
            let geometry = [(); 7].map(|()| random(state) % 60 - 30);
            let seen = Seen {
                components: &components,
                geometry,
                affinity: 3000,
                distance: rank as u64,
                ..Seen::default()
            };
            batch.set_token(header, (lane, rank), &seen, NEIGHBOURS as u64);
            offsets.push([(); 3].map(|()| random(state) % 200 - 100));
        }
        batch.set_near(lane, &offsets);
    }
    batch
}

#[divan::bench(args = CASES, sample_count = 10, sample_size = 1)]
fn scalar(bencher: Bencher, case: Case) {
    let (network, batches) = inputs(case);
    let lanes =
        |batch: &Batch| (0..LANES).map(|lane| scalar::outputs(&network, batch, lane)).collect::<Vec<_>>();
    bencher
        .counter(ItemsCount::new(GAUSSIANS))
        .bench_local(|| black_box(&batches).iter().for_each(|batch| drop(black_box(lanes(batch)))));
}

#[divan::bench(args = CASES, sample_count = 20, sample_size = 1)]
fn without_instructions(bencher: Bencher, case: Case) {
    run(bencher, case, Machine::Portable);
}

/// With AVX2 this is SSE2, what every x86-64 has.
#[divan::bench(args = CASES, sample_count = 50, sample_size = 1)]
fn portable(bencher: Bencher, case: Case) {
    let machines = Machine::all();
    run(bencher, case, *machines.get(1).unwrap_or(&machines[0]));
}

#[divan::bench(args = CASES, sample_count = 50, sample_size = 1)]
fn fastest(bencher: Bencher, case: Case) {
    run(bencher, case, *Machine::all().last().unwrap());
}

fn run(bencher: Bencher<'_, '_>, case: Case, machine: Machine) {
    let (network, batches) = inputs(case);
    let network = LaneNetwork::new(&network);
    bencher.counter(ItemsCount::new(GAUSSIANS)).bench_local(|| {
        for batch in black_box(&batches) {
            black_box(network.outputs_on(machine, batch));
        }
    });
}
