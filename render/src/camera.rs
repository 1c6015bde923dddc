//! Pinhole cameras: pose and intrinsics, in the axes of a frame.

/// A pinhole camera without distortion. Camera axes are x right, y down, z forward, as a frame's.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// What the view is called; the picture's file is named after it.
    pub name: String,
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Focal lengths along x and y, pixels.
    pub focal: [f32; 2],
    /// Principal point, pixels from the top left corner of the top left pixel.
    pub principal: [f32; 2],
    /// From world to camera: the rows are the camera's right, down and forward axes in the world.
    pub rotation: [[f32; 3]; 3],
    /// Centre of projection in the world.
    pub position: [f32; 3],
}
