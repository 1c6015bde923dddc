//! Gaussians as C sees them.

use splatstream::PlanesRef;

/// Gaussians as planes: value i of each plane belongs to Gaussian i, or to slot i.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct SplatstreamPlanes {
    /// Values of each plane.
    pub length: usize,
    /// Centre: x right, y down, z forward, in the unit of the scene.
    pub position: [*const f32; 3],
    /// Natural logarithm of the standard deviation along each axis of the Gaussian.
    pub log_scale: [*const f32; 3],
    /// Unit quaternion w, x, y, z.
    pub rotation: [*const f32; 4],
    /// Opacity before the sigmoid function.
    pub opacity_logit: *const f32,
    /// Coefficient of degree 0 of the spherical harmonics, of red, green and blue: colour = 0.5 + 0.2821 dc.
    pub dc: [*const f32; 3],
    /// Coefficients of degree 1 and up of the spherical harmonics: of the first coefficient red, green and blue, then of
    /// the next.
    pub sh: *const *const f32,
    /// How many planes sh has: 0, 9, 24 or 45.
    pub sh_count: usize,
}

impl SplatstreamPlanes {
    /// Points to planes. `sh` keeps the pointers to those of the spherical harmonics.
    pub(crate) fn of(planes: PlanesRef<'_>, sh: &mut Vec<*const f32>) -> Self {
        sh.clear();
        sh.extend(planes.sh.iter().map(|plane| plane.as_ptr()));
        Self {
            length: planes.opacity_logit.len(),
            position: planes.position.each_ref().map(|plane| plane.as_ptr()),
            log_scale: planes.log_scale.each_ref().map(|plane| plane.as_ptr()),
            rotation: planes.rotation.each_ref().map(|plane| plane.as_ptr()),
            opacity_logit: planes.opacity_logit.as_ptr(),
            dc: planes.dc.each_ref().map(|plane| plane.as_ptr()),
            sh: sh.as_ptr(),
            sh_count: sh.len(),
        }
    }
}
