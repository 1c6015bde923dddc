//! One frame of Gaussians in PLY's domain.

use crate::rotation::normalise_rows;
use crate::sh::{MAX_SH_DEGREE, rest_index, sh_planes};
use rayon::prelude::*;
use std::collections::TryReserveError;
use std::fmt;
use std::sync::Arc;

/// The attributes of a frame, one vector a scalar; row `i` of every vector belongs to Gaussian `i`.
///
/// Plain data for building a [`GaussianFrame`], which checks that the lengths agree.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Planes {
    /// Centre: x right, y down, z forward; the scene's length unit, metres where the source has any.
    pub position: [Vec<f32>; 3],
    /// Natural log of the three semi-axes (standard deviations), same unit as `position`.
    pub log_scale: [Vec<f32>; 3],
    /// Unit quaternion, order w, x, y, z. Columns of its matrix are the axes that `log_scale` measures.
    pub rotation: [Vec<f32>; 4],
    /// Opacity before the sigmoid.
    pub opacity_logit: Vec<f32>,
    /// DC coefficient of red, green, blue: colour = 0.5 + 0.2821 × dc.
    pub dc: [Vec<f32>; 3],
    /// Bands 1 and up. Plane = coefficient × 3 + channel; coefficient 0 is the first of band 1.
    pub sh: Vec<Vec<f32>>,
}

/// The values of a [`GaussianFrame`], to be changed in place; the planes are those of [`Planes`].
#[derive(Debug)]
pub struct PlanesMut<'a> {
    /// Centres.
    pub position: [&'a mut [f32]; 3],
    /// Natural log of the semi-axes.
    pub log_scale: [&'a mut [f32]; 3],
    /// Quaternions w, x, y, z.
    pub rotation: [&'a mut [f32]; 4],
    /// Opacity before the sigmoid.
    pub opacity_logit: &'a mut [f32],
    /// DC coefficients.
    pub dc: [&'a mut [f32]; 3],
    /// Bands 1 and up.
    pub sh: Vec<&'a mut [f32]>,
}

impl PlanesMut<'_> {
    /// Every plane to change, in the order of the fields.
    pub fn iter_mut(&mut self) -> impl Iterator<Item = &mut [f32]> {
        let Self { position, log_scale, rotation, opacity_logit, dc, sh } = self;
        let before = position.iter_mut().chain(log_scale).chain(rotation).chain([opacity_logit]);
        before.chain(dc).chain(sh).map(|plane| &mut **plane)
    }
}

/// The values of a [`GaussianFrame`], to be read; the planes are those of [`Planes`].
#[derive(Clone, Copy, Debug)]
pub struct PlanesRef<'a> {
    /// Centres.
    pub position: &'a [Vec<f32>; 3],
    /// Natural log of the semi-axes.
    pub log_scale: &'a [Vec<f32>; 3],
    /// Quaternions w, x, y, z.
    pub rotation: &'a [Vec<f32>; 4],
    /// Opacity before the sigmoid.
    pub opacity_logit: &'a Vec<f32>,
    /// DC coefficients.
    pub dc: &'a [Vec<f32>; 3],
    /// Bands 1 and up.
    pub sh: &'a [Vec<f32>],
}

impl<'a> PlanesRef<'a> {
    /// Every plane, in the order of the fields.
    pub fn iter(self) -> impl Iterator<Item = &'a Vec<f32>> {
        let Self { position, log_scale, rotation, opacity_logit, dc, sh } = self;
        position.iter().chain(log_scale).chain(rotation).chain([opacity_logit]).chain(dc).chain(sh)
    }

    /// Every plane with its PLY name, in PLY's usual order apart from `f_rest_*`, which come in plane order.
    pub(crate) fn named(self, sh_degree: u8) -> impl Iterator<Item = (String, &'a Vec<f32>)> {
        let planes: Vec<&Vec<f32>> = self.iter().collect();
        let order = (0..3).chain(11..planes.len()).chain([10]).chain(3..10);
        order.filter_map(move |at| Some((property(at, sh_degree), *planes.get(at)?)))
    }
}

/// The PLY names of all planes but those of bands 1 and up, in the order of the fields of [`Planes`].
const NAMES: [&str; 14] = [
    "x", "y", "z", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3", "opacity", "f_dc_0",
    "f_dc_1", "f_dc_2",
];

/// The PLY name of a plane by its place among all.
fn property(plane: usize, sh_degree: u8) -> String {
    match NAMES.get(plane) {
        Some(&name) => name.to_owned(),
        None => format!("f_rest_{}", rest_index(plane.saturating_sub(NAMES.len()), sh_degree)),
    }
}

/// A frame of Gaussians: structure of arrays, equal lengths by construction, `f32`, PLY's domain. A clone shares the
/// values until either is changed.
///
/// Values are not checked by construction: see [`GaussianFrame::validate`]. Readers call it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GaussianFrame {
    sh_degree: u8,
    antialiased: bool,
    // Each shared by copies of the frame until one of them changes it: an encoder turns axes, and neither moves nor colours
    // Gaussians, whose colours are most of what a frame holds.
    places: Arc<Places>,
    axes: Arc<Axes>,
    colours: Arc<Colours>,
}

/// Where Gaussians are, and how much of what is behind them they hide.
#[derive(Clone, Debug, Default, PartialEq)]
struct Places {
    position: [Vec<f32>; 3],
    opacity_logit: Vec<f32>,
}

/// How large they are, and which way they are turned.
#[derive(Clone, Debug, Default, PartialEq)]
struct Axes {
    log_scale: [Vec<f32>; 3],
    rotation: [Vec<f32>; 4],
}

/// Which colours they have.
#[derive(Clone, Debug, Default, PartialEq)]
struct Colours {
    dc: [Vec<f32>; 3],
    sh: Vec<Vec<f32>>,
}

/// Why planes do not make a frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FrameError {
    /// No such SH degree.
    ShDegree(u8),
    /// The number of SH planes does not fit the degree.
    ShPlanes {
        /// The degree asked for.
        degree: u8,
        /// Planes that degree has.
        expected: usize,
        /// Planes given.
        found: usize,
    },
    /// A plane of another length than the first, which is `x`.
    Length {
        /// PLY name of the plane.
        property: String,
        /// Rows of the first plane.
        expected: usize,
        /// Rows of this one.
        found: usize,
    },
}

impl fmt::Display for FrameError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::ShDegree(degree) => write!(f, "SH degree {degree} is outside 0 to {MAX_SH_DEGREE}"),
            Self::ShPlanes { degree, expected, found } => {
                write!(f, "SH degree {degree} has {expected} planes, {found} given")
            }
            Self::Length { property, expected, found } => {
                write!(f, "{property} has {found} rows, x has {expected}")
            }
        }
    }
}

impl std::error::Error for FrameError {}

impl Planes {
    /// Empty planes with as many SH planes as `sh_degree` has, and room for `rows`.
    pub fn with_capacity(sh_degree: u8, rows: usize) -> Self {
        let mut planes = Self::of_degree(sh_degree);
        planes.iter_mut().for_each(|plane| plane.reserve_exact(rows));
        planes
    }

    /// As [`Planes::with_capacity`], and memory that there is not is an error.
    ///
    /// # Errors
    /// The machine refuses the memory.
    pub fn try_with_capacity(sh_degree: u8, rows: usize) -> Result<Self, TryReserveError> {
        let mut planes = Self::of_degree(sh_degree);
        planes.iter_mut().try_for_each(|plane| plane.try_reserve_exact(rows))?;
        Ok(planes)
    }

    /// Empty planes, as many as `sh_degree` has.
    fn of_degree(sh_degree: u8) -> Self {
        Self { sh: vec![Vec::new(); sh_planes(sh_degree)], ..Self::default() }
    }

    /// Every plane, in the order of the fields.
    pub fn iter(&self) -> impl Iterator<Item = &Vec<f32>> {
        PlanesRef::from(self).iter()
    }

    /// Every plane to change, in the order of the fields.
    pub fn iter_mut(&mut self) -> impl Iterator<Item = &mut Vec<f32>> {
        let Self { position, log_scale, rotation, opacity_logit, dc, sh } = self;
        position.iter_mut().chain(log_scale).chain(rotation).chain([opacity_logit]).chain(dc).chain(sh)
    }
}

impl<'a> From<&'a Planes> for PlanesRef<'a> {
    fn from(planes: &'a Planes) -> Self {
        let Planes { position, log_scale, rotation, opacity_logit, dc, sh } = planes;
        Self { position, log_scale, rotation, opacity_logit, dc, sh }
    }
}

/// Values that are gathered before another core has woken up.
const FEW: usize = 1 << 14;

/// Some values of a plane.
#[expect(
    clippy::indexing_slicing,
    reason = "a row that is not there is a fault of the caller, as `select` says"
)]
fn picked(plane: &[f32], rows: &[u32]) -> Vec<f32> {
    rows.iter().map(|&row| plane[row as usize]).collect()
}

impl GaussianFrame {
    /// A frame of `planes`.
    ///
    /// # Errors
    /// A degree above 3, a number of SH planes that does not fit it, or planes of different lengths.
    pub fn from_planes(sh_degree: u8, planes: Planes) -> Result<Self, FrameError> {
        if sh_degree > MAX_SH_DEGREE {
            return Err(FrameError::ShDegree(sh_degree));
        }
        let (expected, found) = (sh_planes(sh_degree), planes.sh.len());
        if found != expected {
            return Err(FrameError::ShPlanes { degree: sh_degree, expected, found });
        }
        let rows = planes.position[0].len();
        if let Some((at, plane)) = planes.iter().enumerate().find(|(_, plane)| plane.len() != rows) {
            let property = property(at, sh_degree);
            return Err(FrameError::Length { property, expected: rows, found: plane.len() });
        }
        Ok(Self::made_of(planes, sh_degree, false))
    }

    /// Of planes that make a frame.
    fn made_of(planes: Planes, sh_degree: u8, antialiased: bool) -> Self {
        let Planes { position, log_scale, rotation, opacity_logit, dc, sh } = planes;
        Self {
            sh_degree,
            antialiased,
            places: Arc::new(Places { position, opacity_logit }),
            axes: Arc::new(Axes { log_scale, rotation }),
            colours: Arc::new(Colours { dc, sh }),
        }
    }

    /// The same Gaussians, rotations at unit length; those without direction stay as they are.
    #[must_use]
    pub fn with_unit_rotations(mut self) -> Self {
        normalise_rows(&mut Arc::make_mut(&mut self.axes).rotation);
        self
    }

    /// How many Gaussians.
    pub fn len(&self) -> usize {
        self.places.opacity_logit.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Degree of the spherical harmonics, 0 to 3.
    pub fn sh_degree(&self) -> u8 {
        self.sh_degree
    }

    /// Whether opacities were fitted for a renderer that makes up for its low-pass filter.
    pub fn antialiased(&self) -> bool {
        self.antialiased
    }

    /// The same Gaussians, for a renderer that makes up for its low-pass filter, or for one that does not.
    #[must_use]
    pub fn with_antialiased(self, antialiased: bool) -> Self {
        Self { antialiased, ..self }
    }

    /// Centres: x right, y down, z forward.
    pub fn position(&self) -> &[Vec<f32>; 3] {
        &self.places.position
    }

    /// Natural log of the three semi-axes.
    pub fn log_scale(&self) -> &[Vec<f32>; 3] {
        &self.axes.log_scale
    }

    /// Unit quaternions: w, x, y, z.
    pub fn rotation(&self) -> &[Vec<f32>; 4] {
        &self.axes.rotation
    }

    /// Opacity before the sigmoid.
    pub fn opacity_logit(&self) -> &[f32] {
        &self.places.opacity_logit
    }

    /// DC coefficients of red, green, blue.
    pub fn dc(&self) -> &[Vec<f32>; 3] {
        &self.colours.dc
    }

    /// Planes of bands 1 and up: plane = coefficient × 3 + channel.
    pub fn sh(&self) -> &[Vec<f32>] {
        &self.colours.sh
    }

    /// All the planes.
    pub fn planes(&self) -> PlanesRef<'_> {
        let Places { position, opacity_logit } = &*self.places;
        let Axes { log_scale, rotation } = &*self.axes;
        let Colours { dc, sh } = &*self.colours;
        PlanesRef { position, log_scale, rotation, opacity_logit, dc, sh }
    }

    /// The values, to be changed; planes keep their number and their length, so that the frame stays one.
    pub fn planes_mut(&mut self) -> PlanesMut<'_> {
        let Places { position, opacity_logit } = Arc::make_mut(&mut self.places);
        let Axes { log_scale, rotation } = Arc::make_mut(&mut self.axes);
        let Colours { dc, sh } = Arc::make_mut(&mut self.colours);
        PlanesMut {
            position: position.each_mut().map(Vec::as_mut_slice),
            log_scale: log_scale.each_mut().map(Vec::as_mut_slice),
            rotation: rotation.each_mut().map(Vec::as_mut_slice),
            opacity_logit,
            dc: dc.each_mut().map(Vec::as_mut_slice),
            sh: sh.iter_mut().map(Vec::as_mut_slice).collect(),
        }
    }

    /// Log-scales and quaternions (w, x, y, z), to be changed. All other values stay shared with copies of the frame.
    pub fn axes_mut(&mut self) -> ([&mut [f32]; 3], [&mut [f32]; 4]) {
        let Axes { log_scale, rotation } = Arc::make_mut(&mut self.axes);
        (log_scale.each_mut().map(Vec::as_mut_slice), rotation.each_mut().map(Vec::as_mut_slice))
    }

    /// The planes themselves.
    pub fn into_planes(self) -> Planes {
        let Places { position, opacity_logit } = Arc::unwrap_or_clone(self.places);
        let Axes { log_scale, rotation } = Arc::unwrap_or_clone(self.axes);
        let Colours { dc, sh } = Arc::unwrap_or_clone(self.colours);
        Planes { position, log_scale, rotation, opacity_logit, dc, sh }
    }

    /// The memory of the planes, to be used again, as far as no other frame shares it. That of w of the quaternions is let go: it
    /// follows from x, y and z, so that those who make frames of integers have no plane for it.
    pub fn into_memory(self) -> Vec<Vec<f32>> {
        let mut memory = Vec::new();
        if let Some(Places { position, opacity_logit }) = Arc::into_inner(self.places) {
            memory.extend(position);
            memory.push(opacity_logit);
        }
        if let Some(Axes { log_scale, rotation: [_, x, y, z] }) = Arc::into_inner(self.axes) {
            memory.extend(log_scale);
            memory.extend([x, y, z]);
        }
        if let Some(Colours { dc, sh }) = Arc::into_inner(self.colours) {
            memory.extend(dc);
            memory.extend(sh);
        }
        memory
    }

    /// The Gaussians at `indices`, in that order; an index may come more than once. Planes are gathered side by side: one
    /// core waits for memory most of the time.
    ///
    /// # Panics
    /// If an index is not below [`GaussianFrame::len`].
    #[must_use]
    pub fn select(&self, indices: &[u32]) -> Self {
        let mut planes = Planes::of_degree(self.sh_degree);
        let pairs: Vec<(&mut Vec<f32>, &Vec<f32>)> = planes.iter_mut().zip(self.planes().iter()).collect();
        let fewest = FEW.div_ceil(indices.len().max(1));
        pairs.into_par_iter().with_min_len(fewest).for_each(|(slot, plane)| *slot = picked(plane, indices));
        Self::made_of(planes, self.sh_degree, self.antialiased)
    }

    /// The same in the frame's own memory, one plane after the other, if nobody else has the frame.
    ///
    /// # Panics
    /// If an index is not below [`GaussianFrame::len`].
    #[must_use]
    pub fn into_selected(self, indices: &[u32]) -> Self {
        if indices.iter().copied().eq(0..self.len() as u32) {
            return self;
        }
        let (sh_degree, antialiased) = (self.sh_degree, self.antialiased);
        let mut planes = self.into_planes();
        planes.iter_mut().for_each(|plane| *plane = picked(plane, indices));
        Self::made_of(planes, sh_degree, antialiased)
    }
}

impl GaussianFrame {
    /// The same Gaussians with another degree of spherical harmonics, 0 to 3: bands above it are left out, and missing ones
    /// are 0.
    ///
    /// # Errors
    /// A degree above 3.
    pub fn with_sh_degree(self, sh_degree: u8) -> Result<Self, FrameError> {
        if sh_degree == self.sh_degree {
            return Ok(self);
        }
        let (rows, antialiased) = (self.len(), self.antialiased);
        let mut planes = self.into_planes();
        planes.sh.resize(sh_planes(sh_degree), vec![0.0; rows]);
        Ok(Self::from_planes(sh_degree, planes)?.with_antialiased(antialiased))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn one(sh_degree: u8) -> Planes {
        let mut planes = Planes::with_capacity(sh_degree, 1);
        planes.iter_mut().for_each(|plane| plane.push(0.5));
        planes
    }

    #[test]
    fn planes_of_different_lengths_make_no_frame() {
        let mut planes = one(0);
        planes.log_scale[2].push(1.0);
        let error = GaussianFrame::from_planes(0, planes).unwrap_err();
        assert_eq!(error.to_string(), "scale_2 has 2 rows, x has 1");
    }

    #[test]
    fn another_degree_leaves_bands_out_or_adds_empty_ones() {
        let mut planes = one(2);
        (1_u8..).zip(&mut planes.sh).for_each(|(value, plane)| plane[0] = f32::from(value));
        let frame = GaussianFrame::from_planes(2, planes).unwrap().with_antialiased(true);
        let lower = frame.clone().with_sh_degree(1).unwrap();
        assert_eq!((lower.sh_degree(), lower.sh(), lower.antialiased()), (1, &frame.sh()[..9], true));
        let higher = frame.clone().with_sh_degree(3).unwrap();
        assert_eq!(higher.sh()[..24], *frame.sh());
        assert_eq!(higher.sh()[24..], vec![vec![0.0]; 21]);
        assert!(frame.with_sh_degree(4).is_err());
    }

    #[test]
    fn the_degree_fixes_the_number_of_planes() {
        assert!(GaussianFrame::from_planes(1, one(0)).is_err());
        assert!(GaussianFrame::from_planes(4, one(0)).is_err());
    }

    #[test]
    fn selecting_gathers_in_the_order_asked() {
        let mut planes = one(0);
        for plane in planes.position.iter_mut().chain(&mut planes.log_scale) {
            plane.push(2.0);
        }
        for plane in planes.rotation.iter_mut().chain(&mut planes.dc) {
            plane.push(3.0);
        }
        planes.opacity_logit.push(4.0);
        let frame = GaussianFrame::from_planes(0, planes).unwrap();
        assert_eq!(frame.select(&[1, 0, 1]).opacity_logit(), [4.0, 0.5, 4.0]);
    }
}
