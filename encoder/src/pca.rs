//! Principal components of colour: the rows of a transform unit.

use rayon::prelude::*;

/// Gaussians looked at, at most; more do not change the components by anything that matters.
const SAMPLE: usize = 1 << 15;

/// Mean and orthonormal components, the one of largest variance first.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Components {
    /// Mean of each dimension.
    pub(crate) mean: Vec<f64>,
    /// One row a component.
    pub(crate) rows: Vec<Vec<f64>>,
}

impl Components {
    /// Zero mean, the axes themselves.
    pub(crate) fn identity(dimension: usize) -> Self {
        let row = |index| (0..dimension).map(|axis| if axis == index { 1.0 } else { 0.0 }).collect();
        Self { mean: vec![0.0; dimension], rows: (0..dimension).map(row).collect() }
    }

    /// The components of the vectors whose coordinates stand in `planes`. A single vector is the mean, of which nothing is left.
    #[expect(clippy::indexing_slicing, reason = "the matrix is square, and so are its eigenvectors")]
    pub(crate) fn of(planes: &[&[f32]]) -> Self {
        let dimension = planes.len();
        let count = planes.first().map_or(0, |plane| plane.len());
        if count == 0 {
            return Self::identity(dimension);
        }
        let stride = count.div_ceil(SAMPLE);
        let samples = count.div_ceil(stride);
        let mean: Vec<f64> = planes
            .iter()
            .map(|plane| plane.iter().step_by(stride).map(|&v| f64::from(v)).sum::<f64>() / samples as f64)
            .collect();
        let centred: Vec<Vec<f32>> = planes
            .par_iter()
            .zip(&mean)
            .map(|(plane, &mean)| plane.iter().step_by(stride).map(|&v| v - mean as f32).collect())
            .collect();
        let pairs: Vec<(usize, usize)> = (0..dimension).flat_map(|i| (0..=i).map(move |j| (i, j))).collect();
        let products: Vec<f64> =
            pairs.par_iter().map(|&(i, j)| dot(&centred[i], &centred[j]) / samples as f64).collect();
        let mut covariance = vec![vec![0.0; dimension]; dimension];
        for (&(i, j), &value) in pairs.iter().zip(&products) {
            covariance[i][j] = value;
            covariance[j][i] = value;
        }
        Self { mean, rows: eigenvectors(covariance) }
    }
}

/// The sum of products, in a fixed order of eight partial sums.
fn dot(a: &[f32], b: &[f32]) -> f64 {
    let mut sums = [0.0_f64; 8];
    for (a, b) in a.chunks(8).zip(b.chunks(8)) {
        for (sum, (&a, &b)) in sums.iter_mut().zip(a.iter().zip(b)) {
            *sum += f64::from(a) * f64::from(b);
        }
    }
    sums.iter().sum()
}

/// Cyclic Jacobi: rows are eigenvectors by decreasing eigenvalue, the largest entry of each positive.
#[expect(clippy::indexing_slicing, reason = "the matrix is square, and so are its eigenvectors")]
#[expect(clippy::arithmetic_side_effects, reason = "an index of a dimension")]
fn eigenvectors(mut matrix: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    const SWEEPS: usize = 30;
    let dimension = matrix.len();
    let mut vectors = Components::identity(dimension).rows;
    let scale: f64 = (0..dimension).map(|i| matrix[i][i]).sum();
    for _ in 0..SWEEPS {
        let off: f64 = (0..dimension)
            .flat_map(|i| (0..i).map(move |j| (i, j)))
            .map(|(i, j)| matrix[i][j] * matrix[i][j])
            .sum();
        if off <= scale * scale * 1e-24 {
            break;
        }
        for p in 0..dimension {
            for q in p + 1..dimension {
                rotate(&mut matrix, &mut vectors, p, q);
            }
        }
    }
    let mut order: Vec<usize> = (0..dimension).collect();
    order.sort_by(|&a, &b| matrix[b][b].total_cmp(&matrix[a][a]));
    order.into_iter().map(|index| with_positive_peak(vectors[index].clone())).collect()
}

/// One Jacobi rotation in the plane of axes `p` and `q`; rows of `vectors` turn along.
#[expect(clippy::indexing_slicing, reason = "the matrix is square, and so are its eigenvectors")]
fn rotate(matrix: &mut [Vec<f64>], vectors: &mut [Vec<f64>], p: usize, q: usize) {
    let coupling = matrix[p][q];
    if coupling == 0.0 {
        return;
    }
    let theta = (matrix[q][q] - matrix[p][p]) / (2.0 * coupling);
    let sign = if theta < 0.0 { -1.0 } else { 1.0 };
    let tangent = sign / (theta.abs() + (theta * theta + 1.0).sqrt());
    let cosine = 1.0 / (tangent * tangent + 1.0).sqrt();
    let sine = tangent * cosine;
    for row in matrix.iter_mut() {
        let (a, b) = (row[p], row[q]);
        row[p] = cosine * a - sine * b;
        row[q] = sine * a + cosine * b;
    }
    for rows in [matrix, vectors] {
        for index in 0..rows[p].len() {
            let (a, b) = (rows[p][index], rows[q][index]);
            rows[p][index] = cosine * a - sine * b;
            rows[q][index] = sine * a + cosine * b;
        }
    }
}

fn with_positive_peak(row: Vec<f64>) -> Vec<f64> {
    let peak = row.iter().fold(0.0_f64, |peak, &value| if value.abs() > peak.abs() { value } else { peak });
    if peak < 0.0 { row.into_iter().map(|value| -value).collect() } else { row }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn components_of_a_stretched_cloud_are_its_axes() {
        let spread: Vec<f32> = (0..1000).map(|i| (i % 37) as f32 - 18.0).collect();
        let narrow: Vec<f32> = (0..1000).map(|i| ((i * 7) % 11) as f32 * 0.1).collect();
        let a: Vec<f32> = spread.iter().zip(&narrow).map(|(s, n)| 0.6 * s - 0.8 * n).collect();
        let b: Vec<f32> = spread.iter().zip(&narrow).map(|(s, n)| 0.8 * s + 0.6 * n).collect();
        let components = Components::of(&[&a, &b]);
        assert!((components.rows[0][0] - 0.6).abs() < 0.01 && (components.rows[0][1] - 0.8).abs() < 0.01);
    }

    #[test]
    fn a_cloud_without_extent_has_orthonormal_components() {
        let flat = vec![1.0_f32; 50];
        let rows = Components::of(&[&flat, &flat, &flat]).rows;
        for i in 0..3 {
            for j in 0..3 {
                let product: f64 = (0..3).map(|k| rows[i][k] * rows[j][k]).sum();
                assert!((product - if i == j { 1.0 } else { 0.0 }).abs() < 1e-12);
            }
        }
    }
}
