//! `.ksplat`: the format of the viewer GaussianSplats3D, at its three levels of compression.
//!
//! A header of 4096 bytes and one of 1024 bytes for each section; then the sections. At level 0 all values but colours are
//! `f32`. At levels 1 and 2 they are 16-bit floats, centres are 16-bit offsets from the centre of a bucket of Gaussians, and
//! at level 2 spherical harmonics are bytes between a least and a greatest value.
//!
//! | part of a Gaussian | level 0 | levels 1 and 2 |
//! |---|---|---|
//! | centre | 3 × `f32` | 3 × `u16`: (value − range) × half block ÷ range from the centre of its bucket |
//! | semi-axes, not their logs | 3 × `f32` | 3 × `f16` |
//! | rotation w, x, y, z | 4 × `f32` | 4 × `f16` |
//! | red, green, blue, opacity | 4 bytes | 4 bytes |
//! | SH, degree by degree, in each one channel after another | `f32` | `f16`, at level 2 bytes |

mod section;

use crate::byte_values::{log_scale_of, logit_of_byte};
use crate::cursor::Cursor;
use crate::error::SceneError;
use crate::limits::{Budget, ReadLimits, bytes_of_planes};
use crate::reading::{checked, frame_of};
use crate::walk::Walk;
use section::{Layout, Level, Section};
use splatstream_gaussians::activation::dc_of_colour;
use splatstream_gaussians::{GaussianFrame, Planes};

/// Bytes of the header of a file.
const HEADER: usize = 4096;

/// What spherical harmonics of level 2 span where a file says 0.
const USUAL_SH: f32 = 1.5;

pub(crate) const NOT_KSPLAT: &str = "this is no .ksplat file, or it is damaged";

/// Reads a `.ksplat` file. Opacity 0 and 255 become finite logits, half a step inside.
///
/// # Errors
/// A version or a level that is not known, sections that do not fit the file, more than `limits` allow, or a value that no
/// frame may hold.
pub fn read(bytes: &[u8], limits: &ReadLimits) -> Result<GaussianFrame, SceneError> {
    checked(read_as_is(bytes, &mut Budget::new(limits))?)
}

/// As [`read`], with values as they are: none is checked.
pub(crate) fn read_as_is(bytes: &[u8], budget: &mut Budget) -> Result<GaussianFrame, SceneError> {
    let contents = Contents::read(&mut Cursor::new(bytes), budget)?;
    let sh_degree = contents.sh_degree();
    let mut planes = budget.planes(sh_degree, contents.header.gaussians.into())?;
    for layout in &contents.sections {
        unpack(&layout.section(bytes), &contents.header, &mut planes)?;
    }
    frame_of(sh_degree, planes)
}

/// Checks what the headers of a file announce: its version, that its sections are there, and that there is room for it and its
/// frame.
///
/// # Errors
/// As [`read`], as far as the headers tell.
pub(crate) fn check(walk: &mut impl Walk, budget: &mut Budget) -> Result<(), SceneError> {
    let size = walk.left();
    let contents = Contents::read(walk, budget)?;
    let planes = bytes_of_planes(contents.sh_degree(), contents.header.gaussians.into());
    budget.check(size.saturating_add(planes), "the frame")
}

/// What the headers of a file say.
struct Contents {
    header: Header,
    sections: Vec<Layout>,
}

impl Contents {
    fn read(walk: &mut impl Walk, budget: &mut Budget) -> Result<Self, SceneError> {
        let header = Header::read(walk)?;
        let sections = section::all(walk, &header, budget)?;
        let gaussians: u64 = sections.iter().map(|section| section.count).sum();
        if gaussians != u64::from(header.gaussians) {
            let what =
                format!("the header has {} Gaussians, the sections have {gaussians}", header.gaussians);
            return Err(SceneError::malformed(16, what, NOT_KSPLAT));
        }
        Ok(Self { header, sections })
    }

    /// The highest of all sections.
    fn sh_degree(&self) -> u8 {
        self.sections.iter().map(|section| section.sh_degree).max().unwrap_or(0)
    }
}

/// What the header says of all sections.
pub(crate) struct Header {
    pub(crate) sections: u32,
    gaussians: u32,
    pub(crate) level: Level,
    /// What the bytes 0 and 255 of spherical harmonics mean at level 2.
    sh: [f32; 2],
}

impl Header {
    fn read(walk: &mut impl Walk) -> Result<Self, SceneError> {
        let header = walk.array::<HEADER>("the header")?;
        let mut header = Cursor::new(&header);
        let [major, minor, _, _] = header.array("the header")?;
        if major != 0 || minor == 0 {
            let what = format!(".ksplat of version {major}.{minor}");
            return Err(SceneError::unsupported(what, "version 0.1 is known; write the file again with it"));
        }
        let [sections, _, _, gaussians] = header.array::<16>("the header").map(words)?;
        let level = Level::of(header.u32("the header")? as u16)?;
        header.take(12, "the header")?;
        let [least, most] = header.array::<8>("the header").map(floats)?;
        let or = |value: f32, usual: f32| if value == 0.0 { usual } else { value };
        Ok(Self { sections, gaussians, level, sh: [or(least, -USUAL_SH), or(most, USUAL_SH)] })
    }
}

fn words(bytes: [u8; 16]) -> [u32; 4] {
    let mut words = [0; 4];
    words.iter_mut().zip(bytes.as_chunks().0).for_each(|(to, &from)| *to = u32::from_le_bytes(from));
    words
}

fn floats(bytes: [u8; 8]) -> [f32; 2] {
    let mut floats = [0.0; 2];
    floats.iter_mut().zip(bytes.as_chunks().0).for_each(|(to, &from)| *to = f32::from_le_bytes(from));
    floats
}

/// Appends the Gaussians of a section; coefficients of degrees that it lacks are 0.
fn unpack(section: &Section<'_>, header: &Header, planes: &mut Planes) -> Result<(), SceneError> {
    let mut buckets = section.buckets();
    for row in section.rows() {
        let offset = buckets.next().ok_or_else(|| {
            let what = format!("Gaussian {} lies in no bucket", planes.opacity_logit.len());
            SceneError::malformed(section.layout.at, what, NOT_KSPLAT)
        })?;
        for (axis, plane) in planes.position.iter_mut().enumerate() {
            plane.push(row.centre(axis, section, offset));
        }
        for (axis, plane) in planes.log_scale.iter_mut().enumerate() {
            plane.push(log_scale_of(row.scale(axis)));
        }
        for (part, plane) in planes.rotation.iter_mut().enumerate() {
            plane.push(row.rotation(part));
        }
        let [red, green, blue, opacity] = row.colour();
        for (plane, byte) in planes.dc.iter_mut().zip([red, green, blue]) {
            plane.push(dc_of_colour(f64::from(byte) / 255.0));
        }
        planes.opacity_logit.push(logit_of_byte(opacity));
        for (at, plane) in planes.sh.iter_mut().enumerate() {
            plane.push(if at < section.sh_values() { row.sh(at, header.sh) } else { 0.0 });
        }
    }
    Ok(())
}
