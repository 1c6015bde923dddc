//! Values that no frame may hold.

use crate::frame::GaussianFrame;
use rayon::prelude::*;
use std::fmt;

/// A value that no frame may hold.
#[derive(Clone, Debug, PartialEq)]
pub struct Defect {
    /// Index of the Gaussian, from 0.
    pub row: usize,
    /// PLY name of the property.
    pub property: String,
    /// Why the value is refused.
    pub kind: DefectKind,
    /// The value; 0 for a quaternion without direction.
    pub value: f32,
}

/// Why a value is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DefectKind {
    /// NaN or infinite.
    NotFinite,
    /// All four components of the quaternion are zero.
    ZeroRotation,
}

impl fmt::Display for Defect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { row, property, kind, value } = self;
        write!(f, "Gaussian {row}: {property} is {value}: {kind}; remove or repair that Gaussian")
    }
}

impl std::error::Error for Defect {}

impl fmt::Display for DefectKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NotFinite => "every value must be finite",
            Self::ZeroRotation => "a rotation must have a length",
        })
    }
}

/// Values that are looked at together: more than vectors need, and few enough to end soon where one is bad.
const AT_ONCE: usize = 1 << 12;

/// And so many times as many by one core, at least.
const PARTS: usize = 1 << 4;

/// What is called a quaternion without direction.
const ROTATION: &str = "rot_0..rot_3";

/// The Gaussians of a frame that have a value that no frame may hold.
#[derive(Clone, Debug, PartialEq)]
pub struct Defects {
    /// Their indices, rising.
    pub rows: Vec<u32>,
    /// The bad properties by their PLY names, each with the number of its bad values; in the order of
    /// [`GaussianFrame::validate`].
    pub properties: Vec<(String, u32)>,
    /// The error of [`GaussianFrame::validate`].
    pub first: Defect,
}

impl GaussianFrame {
    /// Checks that every value is finite and every rotation has a direction.
    ///
    /// # Errors
    /// The first bad value of the first bad plane: position, DC, SH, opacity, scale, rotation.
    pub fn validate(&self) -> Result<(), Defect> {
        // Nearly all frames are sound: that is found out in whole vectors, on all cores.
        let is_sound = |plane: &[f32]| !plane.iter().fold(false, |is_bad, value| is_bad | !value.is_finite());
        let parts: Vec<&[f32]> = self.planes().iter().flat_map(|plane| plane.chunks(AT_ONCE)).collect();
        if !parts.into_par_iter().with_min_len(PARTS).all(is_sound) {
            for (property, plane) in self.planes().named(self.sh_degree()) {
                if let Some((row, &value)) = plane.iter().enumerate().find(|(_, value)| !value.is_finite()) {
                    return Err(Defect { row, property, kind: DefectKind::NotFinite, value });
                }
            }
        }
        match self.zero_rotations().next() {
            Some(row) => {
                let property = ROTATION.to_owned();
                Err(Defect { row, property, kind: DefectKind::ZeroRotation, value: 0.0 })
            }
            None => Ok(()),
        }
    }

    /// Every Gaussian that [`GaussianFrame::validate`] refuses; none if it accepts the frame.
    pub fn defects(&self) -> Option<Defects> {
        let first = self.validate().err()?;
        let mut is_bad = vec![false; self.len()];
        let mut properties = Vec::new();
        let mut count = |property: String, rows: &mut dyn Iterator<Item = usize>| {
            let mut found = 0_u32;
            for row in rows {
                is_bad.get_mut(row).into_iter().for_each(|is_bad| *is_bad = true);
                found = found.saturating_add(1);
            }
            if found > 0 {
                properties.push((property, found));
            }
        };
        for (property, plane) in self.planes().named(self.sh_degree()) {
            let bad = plane.iter().enumerate().filter(|(_, value)| !value.is_finite());
            count(property, &mut bad.map(|(row, _)| row));
        }
        count(ROTATION.to_owned(), &mut self.zero_rotations());
        let rows = (0..).zip(&is_bad).filter(|&(_, &bad)| bad).map(|(row, _)| row).collect();
        Some(Defects { rows, properties, first })
    }

    /// Gaussians whose quaternion has no direction.
    fn zero_rotations(&self) -> impl Iterator<Item = usize> {
        let [w, x, y, z] = self.rotation();
        let rotations = w.iter().zip(x).zip(y).zip(z).enumerate();
        rotations
            .filter(|(_, (((w, x), y), z))| [*w, *x, *y, *z].iter().all(|part| **part == 0.0))
            .map(|(row, _)| row)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Planes;

    /// A frame of three Gaussians, all values 0.5.
    fn planes(sh_degree: u8) -> Planes {
        let mut planes = Planes::with_capacity(sh_degree, 3);
        planes.iter_mut().for_each(|plane| plane.extend([0.5; 3]));
        planes
    }

    #[test]
    fn the_defect_names_the_row_and_the_property() {
        let mut planes = planes(1);
        planes.sh[4][1] = f32::NAN;
        let defect = GaussianFrame::from_planes(1, planes).unwrap().validate().unwrap_err();
        // Plane 4 is the second coefficient of green; green starts at f_rest_3.
        assert_eq!((defect.row, defect.property.as_str()), (1, "f_rest_4"));
        assert!(defect.to_string().starts_with("Gaussian 1: f_rest_4 is NaN"));
    }

    #[test]
    fn defects_are_counted_by_property_and_gaussians_once() {
        let mut planes = planes(0);
        planes.position[1][2] = f32::INFINITY;
        planes.opacity_logit = vec![f32::NEG_INFINITY, 0.0, f32::NAN];
        planes.rotation.iter_mut().for_each(|plane| plane[0] = 0.0);
        let defects = GaussianFrame::from_planes(0, planes).unwrap().defects().unwrap();
        assert_eq!(defects.rows, [0, 2]);
        let counts = [("y", 1), ("opacity", 2), ("rot_0..rot_3", 1)];
        assert_eq!(defects.properties, counts.map(|(name, count)| (name.to_owned(), count)));
        assert_eq!((defects.first.row, defects.first.property.as_str()), (2, "y"));
        assert_eq!(GaussianFrame::from_planes(0, self::planes(0)).unwrap().defects(), None);
    }
}
