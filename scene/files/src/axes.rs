//! The directions of a format's axes, and what changes sign when they flip.

use crate::error::SceneError;

/// Which of x, y, z point the other way than in a frame here; ±1 each.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Flip([f32; 3]);

/// Right, down, forward: the axes of PLY and of frames here, as SPZ numbers them.
const RIGHT_DOWN_FORWARD: u32 = 6;
/// Right, up, back: SPZ's own axes.
const RIGHT_UP_BACK: u32 = 4;
/// Left, up, forward: the axes of glTF.
const LEFT_UP_FORWARD: u32 = 7;

impl Default for Flip {
    fn default() -> Self {
        Self::between(RIGHT_UP_BACK)
    }
}

impl Flip {
    /// The flip for a coordinate system that a file names: 1 to 8 are the directions of x, y, z as bits of
    /// the number less 1; 0 is unspecified, which means SPZ's own.
    ///
    /// # Errors
    /// The eight systems with y and z exchanged, and numbers that mean nothing.
    pub(crate) fn of_system(system: u32) -> Result<Self, SceneError> {
        match system {
            0 => Ok(Self::default()),
            1..=8 => Ok(Self::between(system)),
            _ => Err(SceneError::unsupported(
                format!("SPZ coordinate system {system} exchanges y and z, or is unknown"),
                "convert the file to right-up-back axes",
            )),
        }
    }

    /// The flip between glTF's axes and those of frames, either way: half a turn about z.
    pub(crate) fn of_gltf() -> Self {
        Self::between(LEFT_UP_FORWARD)
    }

    fn between(system: u32) -> Self {
        let differing = system.wrapping_sub(1) ^ (RIGHT_DOWN_FORWARD - 1);
        Self([0, 1, 2].map(|axis| if differing >> axis & 1 == 1 { -1.0 } else { 1.0 }))
    }

    /// Signs of x, y, z of a centre.
    pub(crate) fn position(self) -> [f32; 3] {
        self.0
    }

    /// Signs of x, y, z of a quaternion: each imaginary part is that of the plane the two other axes span.
    pub(crate) fn rotation(self) -> [f32; 3] {
        let [x, y, z] = self.0;
        [y * z, x * z, x * y]
    }

    /// Signs of the SH coefficients of bands 1 to 3: those of the polynomials in x, y, z that they multiply.
    pub(crate) fn sh(self) -> [f32; 15] {
        let [x, y, z] = self.0;
        [y, z, x, x * y, y * z, 1.0, x * z, 1.0, y, x * y * z, y, z, x, z, x]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use splatstream_gaussians::sh_basis;

    #[test]
    fn a_flipped_basis_is_the_basis_of_the_flipped_direction() {
        let direction = [0.48, -0.6, 0.64];
        for system in 1..=8 {
            let flip = Flip::of_system(system).unwrap();
            let signs = flip.position().map(f64::from);
            let flipped = [0, 1, 2].map(|axis| direction[axis] * signs[axis]);
            for ((there, here), sign) in sh_basis(flipped).iter().zip(sh_basis(direction)).zip(flip.sh()) {
                assert!((there - here * f64::from(sign)).abs() < 1e-12, "system {system}");
            }
        }
    }

    #[test]
    fn gltf_axes_flip_x_and_y() {
        assert_eq!(Flip::of_gltf().position(), [-1.0, -1.0, 1.0]);
        assert_eq!(Flip::of_gltf().rotation(), [-1.0, -1.0, 1.0]);
    }

    #[test]
    fn spz_axes_flip_y_and_z() {
        assert_eq!(Flip::default().position(), [1.0, -1.0, -1.0]);
        assert_eq!(Flip::default().rotation(), [1.0, -1.0, -1.0]);
        assert_eq!(Flip::of_system(6).unwrap().position(), [1.0; 3]);
        assert!(Flip::of_system(9).is_err());
    }
}
