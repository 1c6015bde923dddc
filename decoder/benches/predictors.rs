//! Cost of a predicted Gaussian, without the search for its neighbours, by predictor: [`GAUSSIANS`] with eight
//! neighbours and SH of degree 3, on one thread. A millisecond is 100 ns a Gaussian.
//!
//! `cargo bench -p splatstream-decoder --bench predictors`
#![allow(clippy::unwrap_used, missing_docs, reason = "a panic is a failed benchmark")]

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use splatstream_decoder::colour::Colour;
use splatstream_decoder::frame::QuantizedFrame;
use splatstream_decoder::increment::prediction::{Predicting, Prediction};
use splatstream_decoder::increment::residual::Attributes;
use splatstream_decoder::interrupt::Interrupt;
use splatstream_decoder::layout::ShCoding;
use splatstream_decoder::predictor::Predictor;
use splatstream_decoder::steps::Stage;
use splatstream_format::payload::{Network, REGISTRY, Transform};
use splatstream_format::syntax::{IncrementHeader, TransformHeader};

const GAUSSIANS: usize = 10_000;
const SH_PLANES: usize = 45;

fn main() {
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    one.install(divan::main);
}

fn random(state: &mut u64) -> i32 {
    *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*state >> 40) as i32
}

fn plane(state: &mut u64, count: usize, range: i32) -> Vec<i32> {
    (0..count).map(|_| random(state) % range).collect()
}

/// Gaussians of a reference, in Morton order as in streams: neighbours are near each other in memory.
fn reference(state: &mut u64, count: usize) -> QuantizedFrame {
    let mut set = QuantizedFrame::zeroed(count, SH_PLANES);
    let mut codes: Vec<u64> = (0..count).map(|_| random(state) as u64 * 64).collect();
    codes.sort_unstable();
    let axis = |code: &u64, axis: u32| {
        (0..10).map(|bit| ((code >> (3 * bit + axis)) & 1) << bit).sum::<u64>() as u32
    };
    set.position = [0, 1, 2].map(|part| codes.iter().map(|code| axis(code, part)).collect());
    set.log_scale = [(); 3].map(|()| plane(state, count, 40));
    set.opacity = plane(state, count, 40);
    set.rotation = [(); 3].map(|()| plane(state, count, 60));
    set.dc = [(); 3].map(|()| plane(state, count, 4000));
    set.sh = (0..SH_PLANES).map(|_| plane(state, count, 1000)).collect();
    set
}

fn transform(state: &mut u64, rank: u8, dimension: usize) -> Transform {
    let header = TransformHeader { transform_id: 0, transform_kind: 0, dimension: dimension as u8, rank };
    let basis = (0..usize::from(rank) * dimension).map(|_| random(state) as i16 >> 4).collect();
    Transform { header, mean: vec![0; dimension], basis }
}

#[divan::bench(args = [Predictor::Knn, Predictor::Bilateral, Predictor::Transformer], sample_count = 20, sample_size = 1)]
fn predicted(bencher: Bencher, predictor: Predictor) {
    let mut state = 1;
    let set = reference(&mut state, 5 * GAUSSIANS);
    let new = reference(&mut state, GAUSSIANS);
    let (dc, sh) = (transform(&mut state, 3, 3), transform(&mut state, SH_PLANES as u8, SH_PLANES));
    let colour = Colour {
        dc: &dc,
        sh: Some(&sh),
        mode: ShCoding::Coefficients { rank: SH_PLANES as u8 },
        codebooks: [None; 4],
    };
    let network = Network::parse(REGISTRY[0].1, 0).unwrap();
    let header = IncrementHeader {
        predictor_block_log2: 6,
        neighbour_count: 8,
        bilateral_spatial: 32,
        bilateral_feature: 32,
        ..IncrementHeader::PLAIN
    };
    let by = Predicting {
        header: &header,
        colour,
        network: Some(&network),
        feature_shift: 0,
        interrupt: Interrupt::NEVER,
    };
    let predictors = vec![predictor; GAUSSIANS.div_ceil(64)];
    bencher
        .counter(ItemsCount::new(GAUSSIANS))
        .with_inputs(|| {
            let position = new.position.each_ref().map(Vec::as_slice);
            let prediction = Prediction::new(&set, position, &predictors, &by).unwrap();
            (prediction, Attributes::unpredicted(GAUSSIANS, &colour, SH_PLANES))
        })
        .bench_local_values(|(mut prediction, mut attributes)| {
            for stage in Stage::ALL {
                prediction.predict(stage, &mut attributes);
                prediction.learn(stage, &attributes);
            }
            black_box(attributes)
        });
}
