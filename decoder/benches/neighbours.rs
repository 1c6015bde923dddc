//! Speed of the search for neighbours and of the displacement by cells.
//!
//! `cargo bench -p splatstream-decoder`
#![allow(clippy::unwrap_used, missing_docs, reason = "a panic is a failed benchmark")]

use divan::{Bencher, black_box};
use splatstream_decoder::displacement::{Cell, CellField};
use splatstream_decoder::neighbours::NeighbourSearch;
use splatstream_decoder::position::morton;

const POINTS: usize = 150_000;
const NEIGHBOURS: usize = 8;

fn main() {
    divan::main();
}

fn random(state: &mut u64) -> u32 {
    *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*state >> 40) as u32
}

/// Points near the surface of a ball in a grid of 16 bits, in Morton order as they are coded.
fn shell(seed: u64) -> [Vec<u32>; 3] {
    let mut state = seed;
    let mut points: Vec<[u32; 3]> = (0..POINTS)
        .map(|_| {
            let side = [(); 3].map(|()| f64::from(random(&mut state)) / f64::from(1 << 23) - 1.0);
            let length = side.iter().map(|part| part * part).sum::<f64>().sqrt().max(0.1);
            let radius = 30_000.0 + f64::from(random(&mut state) >> 14);
            side.map(|part| (32_768.0 + part / length * radius) as u32)
        })
        .collect();
    points.sort_by_key(|&[x, y, z]| morton(x, y, z));
    [0, 1, 2].map(|axis| points.iter().map(|point| point[axis]).collect())
}

fn slices(planes: &[Vec<u32>; 3]) -> [&[u32]; 3] {
    planes.each_ref().map(Vec::as_slice)
}

#[divan::bench(sample_count = 20, sample_size = 1)]
fn build(bencher: Bencher) {
    let points = shell(1);
    bencher.bench(|| NeighbourSearch::new(black_box(slices(&points))));
}

/// Of as many points again.
#[divan::bench(sample_count = 10, sample_size = 1)]
fn eight_nearest(bencher: Bencher) {
    let (points, others) = (shell(1), shell(2));
    let search = NeighbourSearch::new(slices(&points));
    bencher.bench(|| search.nearest_to_all(black_box(slices(&others)), NEIGHBOURS));
}

/// All points in one place: ties are told apart by index.
#[divan::bench(sample_count = 10, sample_size = 1)]
fn eight_nearest_of_equal_points(bencher: Bencher) {
    let points = [(); 3].map(|()| vec![77; POINTS]);
    let search = NeighbourSearch::new(slices(&points));
    bencher.bench(|| search.nearest_to_all(black_box(slices(&points)), NEIGHBOURS));
}

/// Every Gaussian in a cell that turns and shifts; cells of 2^11 grid steps.
#[divan::bench(sample_count = 20, sample_size = 1)]
fn displacement(bencher: Bencher) {
    let points = shell(1);
    let cell_log2 = 11;
    let motion =
        Cell { stale: false, coordinates: [0; 3], translation: [3, -5, 8], rotation: [100, -80, 60] };
    let [xs, ys, zs] = &points;
    let mut cells: Vec<(u64, Cell)> = xs
        .iter()
        .zip(ys)
        .zip(zs)
        .map(|((x, y), z)| [x, y, z].map(|at| at >> cell_log2))
        .map(|[x, y, z]| (morton(x, y, z), Cell { coordinates: [x, y, z], ..motion }))
        .collect();
    cells.dedup_by_key(|&mut (code, _)| code);
    let field = CellField::new(cell_log2, 16, 128, cells);
    let position =
        points.each_ref().map(|plane| plane.iter().map(|&at| (at as i32) << 6).collect::<Vec<_>>());
    let rotation = [1000, -2000, 3000].map(|part| vec![part; POINTS]);
    bencher.with_inputs(|| (position.clone(), rotation.clone())).bench_values(
        |(mut position, mut rotation)| {
            let stale = field.displace_planes(&mut position, &mut rotation);
            (position, rotation, stale)
        },
    );
}
