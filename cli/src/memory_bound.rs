//! The bound on what a command may take that holds what it works on in memory.
//!
//! An allocation that fails ends the program without a word. So a command says before what it takes at most, and is refused where
//! that is more than there is, or than it may.

use crate::failure::Failure;
use crate::input_args::parse_size;
use crate::machine;
use crate::numbers::counted;
use crate::over_limit::allow;
use clap::Args;
use splatstream_gaussians::{GaussianFrame, sh_planes};
use splatstream_render::Camera;

/// The option of these commands.
#[derive(Args, Debug, Clone, Copy)]
pub(crate) struct MemoryArgs {
    /// Most memory that the command may take, as in 512M or 4G: what takes more is refused before (exit code 13) [default: three
    /// quarters of what this machine has free].
    #[arg(long, value_name = "SIZE", value_parser = parse_size)]
    max_memory: Option<u64>,
}

impl MemoryArgs {
    /// The bound asked for, or what there is.
    pub(crate) fn bound(self) -> MemoryBound {
        MemoryBound::of(self.max_memory.unwrap_or_else(machine::memory))
    }
}

/// What a command may take, and what it keeps of that.
#[derive(Debug, Clone, Copy)]
pub(crate) struct MemoryBound {
    /// Bytes.
    allowed: u64,
    /// Bytes that are taken until the command ends.
    kept: u64,
}

impl MemoryBound {
    /// Of so many bytes, of which none is taken.
    pub(crate) const fn of(allowed: u64) -> Self {
        Self { allowed, kept: 0 }
    }

    /// Bytes that are left.
    pub(crate) const fn left(&self) -> u64 {
        self.allowed.saturating_sub(self.kept)
    }

    /// Bytes that are left are so many fewer from now on.
    pub(crate) fn keep(&mut self, bytes: u64) {
        self.kept = self.kept.saturating_add(bytes);
    }

    /// Refuses work that takes more bytes than are left. `what`: who takes them; `less`: what takes fewer.
    pub(crate) fn check(&self, asked: u64, what: &str, less: &str) -> Result<(), Failure> {
        let (asked, allowed) = (asked.saturating_add(self.kept), self.allowed);
        if asked <= allowed {
            return Ok(());
        }
        Err(Failure::Memory(format!(
            "{what} takes up to {asked} bytes of memory, at most {allowed} are allowed\n  \
             close other programs, or {} where there is as much; {less}",
            allow(asked)
        )))
    }
}

/// What drawing takes of each pixel, bytes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PixelBytes {
    /// Of the picture that is worked on.
    pub(crate) of_one: u64,
    /// Of those of all cameras, which stay.
    pub(crate) of_each: u64,
}

impl PixelBytes {
    /// Refuses cameras whose pictures take more than there is.
    pub(crate) fn check(self, cameras: &[Camera], bound: MemoryBound) -> Result<(), Failure> {
        let pixels = |camera: &Camera| u64::from(camera.width).saturating_mul(camera.height.into());
        let Some(largest) = cameras.iter().max_by_key(|camera| pixels(camera)) else { return Ok(()) };
        let all = cameras.iter().map(pixels).fold(0, u64::saturating_add);
        let asked =
            pixels(largest).saturating_mul(self.of_one).saturating_add(all.saturating_mul(self.of_each));
        let (many, width, height) = (counted(cameras.len() as u64, "picture"), largest.width, largest.height);
        let what = format!("drawing {many} of up to {width} x {height} pixels");
        bound.check(asked, &what, "a smaller --height and fewer cameras take less")
    }
}

/// Bytes of the values of so many Gaussians.
pub(crate) fn bytes_of_gaussians(gaussians: u64, sh_degree: u8) -> u64 {
    // Centres, log-scales, rotations, opacities and constant colours, and harmonics.
    let values = 14_u64.saturating_add(sh_planes(sh_degree) as u64);
    values.saturating_mul(size_of::<f32>() as u64).saturating_mul(gaussians)
}

/// Bytes of a frame.
pub(crate) fn bytes_of(frame: &GaussianFrame) -> u64 {
    bytes_of_gaussians(frame.len() as u64, frame.sh_degree())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_of_all_cameras_count_where_they_stay() {
        let camera = |side| Camera::of_pose("a".into(), [0.0; 3], [1.0, 0.0, 0.0, 0.0], 1.0, [side; 2]);
        let cameras = [camera(10), camera(20), camera(10)];
        let takes = |of_one, of_each, bytes| {
            PixelBytes { of_one, of_each }.check(&cameras, MemoryBound::of(bytes)).is_ok()
        };
        assert!(takes(3, 0, 1200) && !takes(3, 0, 1199));
        assert!(takes(3, 1, 1800) && !takes(3, 1, 1799));
        assert!(takes(u64::MAX, 1, u64::MAX) && !takes(u64::MAX, 1, u64::MAX - 1));
        assert!(PixelBytes { of_one: 1, of_each: 1 }.check(&[], MemoryBound::of(0)).is_ok());
    }

    #[test]
    fn what_is_kept_counts() {
        let mut bound = MemoryBound::of(10 << 20);
        assert!(bound.check(10 << 20, "this", "less").is_ok());
        bound.keep(1);
        let said = bound.check(10 << 20, "this", "give less").unwrap_err();
        assert_eq!(said.exit_code(), 13);
        assert!(said.to_string().contains("--max-memory 11M"), "{said}");
        assert_eq!(bound.left(), (10 << 20) - 1);
    }
}
