//! Speed of the loops that decoding consists of, on one thread: symbols, colours, floats, digests.
//!
//! `cargo bench -p splatstream-decoder --bench kernels`
//!
//! Whole frames are in `codec.rs` of the encoder.
#![allow(clippy::unwrap_used, missing_docs, reason = "a panic is a failed benchmark")]

use core::fmt;
use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use splatstream_decoder::block::{Buffers, CodedBlock, CodedPlanes, decode_coded};
use splatstream_decoder::colour;
use splatstream_decoder::context::plane_contexts;
use splatstream_decoder::digest::{list_digest, lists_digest};
use splatstream_decoder::frame::QuantizedFrame;
use splatstream_decoder::interrupt::Interrupt;
use splatstream_decoder::layout::{Layout, PlaneInfo, Section, ShCoding};
use splatstream_decoder::output::to_gaussians;
use splatstream_decoder::steps::{Exponents, StepRule};
use splatstream_format::entropy::frequencies::Frequencies;
use splatstream_format::entropy::model::{ContextAxis, PlaneModel, Source};
use splatstream_format::entropy::reader::PlaneDecoder;
use splatstream_format::entropy::token::{split, zigzag};
use splatstream_format::entropy::writer::{BlockWriter, PlaneEncoder};
use splatstream_format::payload::Transform;
use splatstream_format::syntax::{SequenceParameters, TransformHeader};
use splatstream_gaussians::random::SplitMix64;

/// Gaussians of a block.
const BLOCK: usize = 1 << 14;
/// Gaussians of a frame.
const FRAME: usize = 100_000;
/// Planes of SH degree 2.
const SH_PLANES: usize = 24;
const LANES_LOG2: u8 = 5;

fn main() {
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    one.install(divan::main);
}

/// What the planes of a block are like.
#[derive(Clone, Copy)]
struct Case {
    name: &'static str,
    /// Thresholds of the contexts by the magnitude of neighbours, and by their sum.
    thresholds: [usize; 2],
    /// Values below 2 to this power have no raw bits.
    direct_log2: u8,
    /// How far values are from 0.
    magnitude: i32,
}

const fn case(name: &'static str, thresholds: [usize; 2], direct_log2: u8, magnitude: i32) -> Case {
    Case { name, thresholds, direct_log2, magnitude }
}

const CASES: [Case; 5] = [
    case("no context", [0, 0], 7, 20),
    case("no context, raw bits", [0, 0], 4, 1000),
    case("12 contexts", [11, 0], 7, 20),
    case("64 contexts", [7, 7], 7, 20),
    case("64 contexts, raw bits", [7, 7], 4, 1000),
];

impl fmt::Display for Case {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name)
    }
}

impl Case {
    /// An axis whose contexts divide the values of a source.
    fn axis(&self, source: Source, count: usize) -> ContextAxis {
        if count == 0 {
            return ContextAxis::NONE;
        }
        let middle = if source == Source::NeighbourSum { count as i32 / 2 } else { 0 };
        let thresholds = (0..count as i32).map(|index| (index - middle) * self.magnitude / 2 + 1).collect();
        ContextAxis { source, thresholds }
    }

    /// Values whose spread changes along the plane, as it does along a curve through a scene.
    fn values(&self, random: &mut SplitMix64) -> Vec<i32> {
        let value = |index: usize| {
            let spread = self.magnitude * (1 + (index / 100 % 8) as i32) / 4;
            let sum: i32 = (0..3).map(|_| random.below(2 * spread as usize + 1) as i32 - spread).sum();
            sum / 2
        };
        (0..BLOCK).map(value).collect()
    }

    /// The model that fits some values.
    fn model(&self, info: PlaneInfo, block: &CodedBlock, values: &[i32]) -> (PlaneModel, Vec<u8>) {
        let [magnitude, sum] = self.thresholds;
        let axes = [self.axis(Source::NeighbourMagnitude, magnitude), self.axis(Source::NeighbourSum, sum)];
        let contexts = plane_contexts(&axes, 0, info, block, values);
        let mut counts = vec![[0_u64; 256]; (magnitude + 1) * (sum + 1)];
        for (index, &value) in values.iter().enumerate() {
            let context = contexts.get(index).copied().unwrap_or(0);
            let token = split(zigzag(value).into(), self.direct_log2).token;
            counts[usize::from(context)][usize::from(token)] += 1;
        }
        let tables = counts.iter().map(|counts| Frequencies::from_counts(counts)).collect();
        let table_of_context = (0..counts.len() as u8).collect();
        let direct_log2 = self.direct_log2;
        (PlaneModel { bias: 0, direct_log2, axes, tables, table_of_context }, contexts)
    }
}

/// A block of three planes, from its bytes to values.
#[divan::bench(args = CASES, sample_count = 50, sample_size = 1)]
fn symbols(bencher: Bencher, case: Case) {
    let mut random = SplitMix64::new(1);
    let layout = Layout::of_section(Section::Moves, 0, ShCoding::None);
    let steps = StepRule::new(&SequenceParameters::PLAIN, [0; 5]);
    let block = CodedBlock::new(vec![0; BLOCK], LANES_LOG2, steps);
    let mut writer = BlockWriter::new(LANES_LOG2);
    let mut decoders = Vec::new();
    for &info in layout.planes() {
        let values = case.values(&mut random);
        let (model, contexts) = case.model(info, &block, &values);
        let unsigned = values.iter().map(|&value| u64::from(zigzag(value)));
        writer.plane(&PlaneEncoder::new(&model), &contexts, unsigned).unwrap();
        decoders.push(PlaneDecoder::new(&model));
    }
    let bytes = writer.finish();
    let planes = CodedPlanes { lanes_log2: LANES_LOG2, layout: &layout, steps };
    let mut buffers = Buffers::default();
    bencher
        .counter(ItemsCount::new(BLOCK * layout.planes().len()))
        .bench_local(|| decode_coded(black_box(&bytes), 0, BLOCK, &planes, &decoders, &mut buffers).unwrap());
}

fn plane(random: &mut SplitMix64, count: usize) -> Vec<i32> {
    (0..count).map(|_| random.below(1000) as i32 - 500).collect()
}

/// Components to colours, by components: SH of degree 2, and colours of degree 0.
#[divan::bench(args = [3, 12, 24], sample_count = 50, sample_size = 1)]
fn colours(bencher: Bencher, rank: u8) {
    let mut random = SplitMix64::new(2);
    let dimension = if rank == 3 { 3 } else { SH_PLANES };
    let header = TransformHeader { transform_id: 0, transform_kind: 0, dimension: dimension as u8, rank };
    let basis = (0..usize::from(rank) * dimension).map(|_| random.below(8192) as i16 - 4096).collect();
    let transform = Transform { header, mean: vec![0; dimension], basis };
    let components: Vec<Vec<i32>> = (0..rank).map(|_| plane(&mut random, BLOCK)).collect();
    let mut out = vec![vec![0; BLOCK]; dimension];
    bencher.counter(ItemsCount::new(BLOCK)).bench_local(|| {
        let exponents = Exponents::Same(0);
        colour::add_inverse(&transform, black_box(&components), &exponents, &mut out, Interrupt::NEVER, 0)
            .unwrap();
    });
}

/// A frame of SH degree 2.
fn frame() -> QuantizedFrame {
    let mut random = SplitMix64::new(3);
    let mut frame = QuantizedFrame::zeroed(FRAME, SH_PLANES);
    frame.position = [(); 3].map(|()| (0..FRAME).map(|_| random.below(1 << 16) as u32).collect());
    for planes in [&mut frame.log_scale, &mut frame.rotation, &mut frame.dc] {
        planes.iter_mut().for_each(|slot| *slot = plane(&mut random, FRAME));
    }
    frame.opacity = plane(&mut random, FRAME);
    frame.sh.iter_mut().for_each(|slot| *slot = plane(&mut random, FRAME));
    frame
}

#[divan::bench(sample_count = 50, sample_size = 1)]
fn floats(bencher: Bencher) {
    let frame = frame();
    let sequence = SequenceParameters { sh_degree: 2, ..SequenceParameters::PLAIN };
    bencher
        .counter(ItemsCount::new(FRAME))
        .with_inputs(|| frame.clone())
        .bench_local_values(|frame| to_gaussians(frame, &sequence).unwrap());
}

#[divan::bench(sample_count = 50, sample_size = 1)]
fn digests(bencher: Bencher) {
    let frame = frame();
    bencher
        .counter(ItemsCount::new(FRAME))
        .bench_local(|| list_digest(black_box(&frame), 0..FRAME).map(|digest| lists_digest(&[digest])));
}
