//! Errors of attributes over pairs of Gaussians.

use rayon::prelude::*;
use serde::Serialize;
use splatstream_chart::table::Table;
use splatstream_gaussians::GaussianFrame;

/// Pairs that one task adds up: sums in tasks of a fixed size are the same with any number of threads.
const TASK: usize = 1 << 14;

/// The error of one attribute over all its components.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub(crate) struct AttributeError {
    rmse: f64,
    max: f64,
}

/// The errors of every attribute, in PLY's domain.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub(crate) struct AttributeErrors {
    position: AttributeError,
    log_scale: AttributeError,
    opacity_logit: AttributeError,
    rotation: AttributeError,
    dc: AttributeError,
    sh: AttributeError,
}

/// Sums from which errors follow.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct ErrorSums {
    pairs: u64,
    position: Sum,
    log_scale: Sum,
    opacity_logit: Sum,
    rotation: Sum,
    dc: Sum,
    sh: Sum,
}

#[derive(Debug, Clone, Copy, Default)]
struct Sum {
    squares: f64,
    count: u64,
    max: f64,
}

impl ErrorSums {
    /// Adds Gaussian `i` of `small` against Gaussian `partners[i]` of `large`, for every `i`. The frames are
    /// in canonical form.
    pub(crate) fn add(&mut self, small: &GaussianFrame, large: &GaussianFrame, partners: &[u32]) {
        let rows: Vec<(usize, usize)> =
            partners.iter().enumerate().map(|(row, &partner)| (row, partner as usize)).collect();
        let tasks: Vec<Self> = rows.par_chunks(TASK).map(|rows| Self::of(small, large, rows)).collect();
        tasks.iter().for_each(|task| self.join(task));
    }

    fn of(small: &GaussianFrame, large: &GaussianFrame, rows: &[(usize, usize)]) -> Self {
        let mut sums = Self { pairs: rows.len() as u64, ..Self::default() };
        sums.position.planes(small.position(), large.position(), rows);
        sums.log_scale.planes(small.log_scale(), large.log_scale(), rows);
        sums.opacity_logit.plane(small.opacity_logit(), large.opacity_logit(), rows);
        sums.dc.planes(small.dc(), large.dc(), rows);
        for plane in 0..small.sh().len().max(large.sh().len()) {
            let values = |frame: &GaussianFrame, row: usize| {
                // A frame of a lower degree has zeros there.
                frame.sh().get(plane).map_or(0.0, |values| values[row])
            };
            rows.iter().for_each(|&(a, b)| sums.sh.push(values(small, a), values(large, b)));
        }
        for &(a, b) in rows {
            let difference = rotation_difference(rotation(small, a), rotation(large, b));
            difference.iter().for_each(|&part| sums.rotation.push(part, 0.0));
        }
        sums
    }

    fn join(&mut self, other: &Self) {
        self.pairs += other.pairs;
        self.position.join(&other.position);
        self.log_scale.join(&other.log_scale);
        self.opacity_logit.join(&other.opacity_logit);
        self.rotation.join(&other.rotation);
        self.dc.join(&other.dc);
        self.sh.join(&other.sh);
    }

    /// Pairs added.
    pub(crate) fn pairs(&self) -> u64 {
        self.pairs
    }

    /// The errors over all pairs added.
    pub(crate) fn errors(&self) -> AttributeErrors {
        AttributeErrors {
            position: self.position.error(),
            log_scale: self.log_scale.error(),
            opacity_logit: self.opacity_logit.error(),
            rotation: self.rotation.error(),
            dc: self.dc.error(),
            sh: self.sh.error(),
        }
    }
}

impl Sum {
    fn push(&mut self, a: f32, b: f32) {
        let difference = (f64::from(a) - f64::from(b)).abs();
        self.squares += difference * difference;
        self.count += 1;
        self.max = self.max.max(difference);
    }

    fn plane(&mut self, a: &[f32], b: &[f32], rows: &[(usize, usize)]) {
        rows.iter().for_each(|&(row, partner)| self.push(a[row], b[partner]));
    }

    fn planes(&mut self, a: &[Vec<f32>; 3], b: &[Vec<f32>; 3], rows: &[(usize, usize)]) {
        a.iter().zip(b).for_each(|(a, b)| self.plane(a, b, rows));
    }

    fn join(&mut self, other: &Self) {
        self.squares += other.squares;
        self.count += other.count;
        self.max = self.max.max(other.max);
    }

    fn error(&self) -> AttributeError {
        AttributeError { rmse: (self.squares / self.count.max(1) as f64).sqrt(), max: self.max }
    }
}

fn rotation(frame: &GaussianFrame, row: usize) -> [f32; 4] {
    frame.rotation().each_ref().map(|plane| plane[row])
}

/// The difference of two rotations of an ellipsoid: the smallest over the half turns about its axes, which
/// change nothing, and over the sign of a quaternion.
pub(crate) fn rotation_difference(a: [f32; 4], b: [f32; 4]) -> [f32; 4] {
    let [w, x, y, z] = b;
    let same = [[w, x, y, z], [-x, w, z, -y], [-y, -z, w, x], [-z, y, -x, w]];
    let signed = same.into_iter().flat_map(|other| [other, other.map(|part| -part)]);
    let differences = signed.map(|other| [0, 1, 2, 3].map(|part: usize| a[part] - other[part]));
    let square = |difference: &[f32; 4]| -> f32 { difference.iter().map(|part| part * part).sum() };
    differences.min_by(|one, other| square(one).total_cmp(&square(other))).unwrap_or_default()
}

impl AttributeErrors {
    /// A table for people.
    pub(crate) fn text(&self) -> String {
        let mut table = Table::new(["attribute", "RMSE", "largest"]);
        let rows = [
            ("position", self.position),
            ("log_scale", self.log_scale),
            ("opacity_logit", self.opacity_logit),
            ("rotation", self.rotation),
            ("dc", self.dc),
            ("sh", self.sh),
        ];
        for (name, error) in rows {
            table.row([name.to_owned(), format!("{:.6}", error.rmse), format!("{:.6}", error.max)]);
        }
        table.text()
            + "rotation: components of a quaternion; that of a round Gaussian may be anything without being seen\n"
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_turns_about_the_axes_are_no_difference() {
        let rotation = [0.8, 0.2, 0.4, 0.4];
        let about_x = [-rotation[1], rotation[0], rotation[3], -rotation[2]];
        for other in [rotation, rotation.map(|part| -part), about_x] {
            assert_eq!(rotation_difference(rotation, other), [0.0; 4]);
        }
        assert!(rotation_difference(rotation, [1.0, 0.0, 0.0, 0.0]).iter().any(|part| part.abs() > 0.1));
    }
}
