//! Where a node puts Gaussians: translation, rotation and scale, in the axes of frames.

use super::spin::Spin;
use crate::axes::Flip;
use glam::{DMat3, DMat4, DQuat, DVec3};
use splatstream_gaussians::GaussianFrame;

/// Axes of a matrix are this nearly at right angles, by the cosine between them.
const RIGHT_ANGLE: f64 = 1e-4;

/// Scales that differ by no more than this part count as equal: matrices in files are rounded.
const EQUAL: f64 = 1e-6;

/// A transform that Gaussians can follow.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Placement {
    translation: DVec3,
    rotation: DQuat,
    /// Along the axes of what is placed; positive.
    scale: DVec3,
}

impl Placement {
    /// The transform of a matrix in glTF's axes. None if it mirrors, shears or flattens, or has numbers that are none.
    pub(super) fn of(matrix: DMat4) -> Option<Self> {
        let flip = DVec3::from(Flip::of_gltf().position().map(f64::from));
        let (axes, translation) = (DMat3::from_mat4(matrix), matrix.w_axis.truncate());
        let scale = DVec3::new(axes.x_axis.length(), axes.y_axis.length(), axes.z_axis.length());
        if !scale.is_finite() || scale.min_element() <= 0.0 || !translation.is_finite() {
            return None;
        }
        let axes = DMat3::from_cols(axes.x_axis / scale.x, axes.y_axis / scale.y, axes.z_axis / scale.z);
        let cosines =
            [axes.x_axis.dot(axes.y_axis), axes.y_axis.dot(axes.z_axis), axes.z_axis.dot(axes.x_axis)];
        if axes.determinant() <= 0.0 || !cosines.iter().all(|cosine| cosine.abs() <= RIGHT_ANGLE) {
            return None;
        }
        // Half a turn about z on both sides: what it does to a vector it does to the axis of a rotation.
        let rotation = DQuat::from_mat3(&axes);
        let axis = DVec3::new(rotation.x, rotation.y, rotation.z) * flip;
        let rotation = DQuat::from_xyzw(axis.x, axis.y, axis.z, rotation.w).normalize();
        Some(Self { translation: translation * flip, rotation, scale })
    }

    /// Whether it leaves everything where it is.
    fn is_nothing(&self) -> bool {
        self.translation == DVec3::ZERO && self.scale == DVec3::ONE && self.rotation == DQuat::IDENTITY
    }

    fn centre(&self, centre: DVec3) -> DVec3 {
        self.rotation * (centre * self.scale) + self.translation
    }

    /// The scale, if it is the same along all axes.
    fn uniform_scale(&self) -> Option<f64> {
        let (least, most) = (self.scale.min_element(), self.scale.max_element());
        (most / least - 1.0 <= EQUAL).then_some((least * most).sqrt())
    }
}

/// A frame where a node puts it. Values that are not finite stay so: checks of frames name them.
pub(super) fn placed(mut frame: GaussianFrame, placement: &Placement) -> GaussianFrame {
    if placement.is_nothing() {
        return frame;
    }
    let planes = frame.planes_mut();
    let [x, y, z] = planes.position;
    for ((x, y), z) in x.iter_mut().zip(y).zip(z) {
        let centre = placement.centre(DVec3::new((*x).into(), (*y).into(), (*z).into()));
        [*x, *y, *z] = centre.to_array().map(|part| part as f32);
    }
    let [w, x, y, z] = planes.rotation;
    let [a, b, c] = planes.log_scale;
    let rotations = w.iter_mut().zip(x).zip(y).zip(z);
    let scales = a.iter_mut().zip(b).zip(c);
    for ((((w, x), y), z), ((a, b), c)) in rotations.zip(scales) {
        let shape = (DQuat::from_xyzw((*x).into(), (*y).into(), (*z).into(), (*w).into()), [*a, *b, *c]);
        let (rotation, log_scale) = shaped(shape, placement);
        [*x, *y, *z, *w] = rotation.to_array().map(|part| part as f32);
        [*a, *b, *c] = log_scale;
    }
    Spin::of(placement.rotation).turn(planes.sh);
    frame
}

/// The rotation and the logs of the semi-axes of a Gaussian that is placed.
fn shaped((rotation, log_scale): (DQuat, [f32; 3]), placement: &Placement) -> (DQuat, [f32; 3]) {
    if let Some(scale) = placement.uniform_scale() {
        let more = libm::log(scale);
        return (placement.rotation * rotation, log_scale.map(|log| (f64::from(log) + more) as f32));
    }
    // The ellipsoid is stretched along axes that are not its own: its new axes are those of its covariance.
    let length = rotation.length();
    if length <= 0.0 || !length.is_finite() {
        return (rotation, log_scale);
    }
    let scale = DVec3::from(log_scale.map(|log| libm::exp(log.into())));
    let shape = DMat3::from_diagonal(placement.scale)
        * DMat3::from_quat(rotation / length)
        * DMat3::from_diagonal(scale);
    let (axes, squares) = principal_axes(shape * shape.transpose());
    let logs = squares.to_array().map(|square| (0.5 * libm::log(square.max(f64::MIN_POSITIVE))) as f32);
    (placement.rotation * DQuat::from_mat3(&axes), logs)
}

/// The eigenvectors, as a rotation, and the eigenvalues of a symmetric matrix: Jacobi's method, which turns two axes at a time
/// until nothing is left between them. A few sweeps reach the last bit.
fn principal_axes(mut matrix: DMat3) -> (DMat3, DVec3) {
    const SWEEPS: usize = 12;
    let mut axes = DMat3::IDENTITY;
    for (p, q) in [(0, 1), (0, 2), (1, 2)].into_iter().cycle().take(SWEEPS * 3) {
        let (between, of_p, of_q) = (matrix.col(q)[p], matrix.col(p)[p], matrix.col(q)[q]);
        if between == 0.0 {
            continue;
        }
        let ratio = (of_q - of_p) / (2.0 * between);
        let tangent = if ratio < 0.0 { -1.0 } else { 1.0 } / (ratio.abs() + (ratio * ratio + 1.0).sqrt());
        let cosine = 1.0 / (tangent * tangent + 1.0).sqrt();
        let sine = tangent * cosine;
        let mut turn = DMat3::IDENTITY;
        (turn.col_mut(p)[p], turn.col_mut(q)[q]) = (cosine, cosine);
        (turn.col_mut(q)[p], turn.col_mut(p)[q]) = (sine, -sine);
        matrix = turn.transpose() * matrix * turn;
        axes *= turn;
    }
    (axes, DVec3::new(matrix.x_axis.x, matrix.y_axis.y, matrix.z_axis.z))
}

#[cfg(test)]
mod tests {
    use super::*;
    use splatstream_gaussians::Planes;

    fn covariance(rotation: DQuat, log_scale: [f32; 3]) -> DMat3 {
        let scale = DVec3::from(log_scale.map(|log| libm::exp(log.into())));
        let shape = DMat3::from_quat(rotation) * DMat3::from_diagonal(scale);
        shape * shape.transpose()
    }

    #[test]
    fn a_placed_ellipsoid_is_the_transformed_one() {
        let rotation = DQuat::from_xyzw(0.1, -0.5, 0.3, 0.8).normalize();
        let log_scale = [-1.0, -3.0, 0.5];
        let turn = DQuat::from_xyzw(-0.2, 0.4, 0.6, 0.5).normalize();
        for scale in [DVec3::splat(2.5), DVec3::new(0.5, 3.0, 1.0)] {
            let placement = Placement { translation: DVec3::ZERO, rotation: turn, scale };
            let (placed, logs) = shaped((rotation, log_scale), &placement);
            let transform = DMat3::from_quat(turn) * DMat3::from_diagonal(scale);
            let expected = transform * covariance(rotation, log_scale) * transform.transpose();
            let error = (covariance(placed, logs) - expected).to_cols_array();
            assert!(error.iter().all(|part| part.abs() < 1e-5), "{scale}: {error:?}");
        }
    }

    #[test]
    fn a_transform_in_gltf_is_that_of_the_flipped_frame() {
        let turn = DQuat::from_xyzw(0.3, -0.1, 0.7, 0.6).normalize();
        let matrix =
            DMat4::from_scale_rotation_translation(DVec3::splat(2.0), turn, DVec3::new(1.0, 2.0, 3.0));
        let planes = Planes {
            position: [vec![0.5], vec![-1.5], vec![4.0]],
            rotation: [vec![1.0], vec![0.0], vec![0.0], vec![0.0]],
            log_scale: [vec![0.0], vec![0.0], vec![0.0]],
            opacity_logit: vec![0.0],
            dc: [vec![0.0], vec![0.0], vec![0.0]],
            sh: Vec::new(),
        };
        let frame = GaussianFrame::from_planes(0, planes).unwrap();
        let placed = placed(frame, &Placement::of(matrix).unwrap());
        let there = matrix.transform_point3(DVec3::new(-0.5, 1.5, 4.0)) * DVec3::new(-1.0, -1.0, 1.0);
        for (axis, there) in there.to_array().into_iter().enumerate() {
            assert!((f64::from(placed.position()[axis][0]) - there).abs() < 1e-5);
        }
    }

    #[test]
    fn what_gaussians_cannot_follow_is_refused() {
        let scaled = |x, y, z| DMat4::from_scale(DVec3::new(x, y, z));
        assert!(Placement::of(scaled(1.0, 2.0, 3.0)).is_some());
        for matrix in [scaled(-1.0, 1.0, 1.0), scaled(0.0, 1.0, 1.0), scaled(f64::NAN, 1.0, 1.0)] {
            assert_eq!(Placement::of(matrix), None, "{matrix}");
        }
        let sheared = scaled(1.0, 2.0, 1.0) * DMat4::from_rotation_z(0.5);
        assert_eq!(Placement::of(sheared), None);
    }
}
