//! Products are what they say, whatever vectors a machine has.

use super::super::lane::{Lane, ZERO};
use super::super::matrix::{Matrix, add_outer};
use super::*;
use pulp::Arch;

fn any(count: usize, random: &mut SplitMix64) -> Vec<Lane> {
    (0..count).map(|_| [(); LANES].map(|()| random.signed())).collect()
}

/// Bits, lane by lane.
fn bits(lanes: &[Lane]) -> Vec<u32> {
    lanes.as_flattened().iter().map(|value| value.to_bits()).collect()
}

#[test]
fn products_are_the_same_in_vectors_and_without() {
    let mut random = SplitMix64::new(11);
    for (rows, columns) in [(1, 1), (8, 3), (13, 8), (19, 16), (16, 27), (5, 0), (0, 5)] {
        let weights: Vec<f32> = (0..rows * columns).map(|_| random.signed()).collect();
        let (x, start) = (any(columns, &mut random), any(rows, &mut random));
        let mut wanted = start.clone();
        for (row, sums) in wanted.iter_mut().enumerate() {
            for (column, x) in x.iter().enumerate() {
                sums.iter_mut().zip(x).for_each(|(sum, x)| *sum += weights[row * columns + column] * x);
            }
        }
        for arch in [Arch::Scalar, Arch::new()] {
            let matrix = Matrix::new(arch, rows, columns, |row, column| weights[row * columns + column]);
            let mut out = start.clone();
            matrix.multiply(&x, &mut out);
            assert_eq!(bits(&out), bits(&wanted), "{rows} x {columns}");
        }
    }
}

#[test]
fn slopes_of_matrices_are_the_same_in_vectors_and_without() {
    let mut random = SplitMix64::new(12);
    for (rows, columns, times) in [(1, 1, 1), (8, 3, 5), (13, 8, 2), (19, 16, 1), (5, 0, 3), (0, 5, 3)] {
        let (slopes, x) = (any(rows * times, &mut random), any(columns * times, &mut random));
        let mut wanted = vec![ZERO; rows * columns];
        for (index, sums) in wanted.iter_mut().enumerate() {
            for time in 0..times {
                let (row, column) = (index / columns, index % columns);
                let factors = slopes[time * rows + row].iter().zip(&x[time * columns + column]);
                sums.iter_mut().zip(factors).for_each(|(sum, (slope, x))| *sum += slope * x);
            }
        }
        for arch in [Arch::Scalar, Arch::new()] {
            let mut gradient = vec![ZERO; rows * columns];
            add_outer(arch, (&slopes, rows), (&x, columns), &mut gradient);
            assert_eq!(bits(&gradient), bits(&wanted), "{rows} x {columns}");
        }
    }
}
