//! The header of `.splat4d`: counts, steps, and where everything is.

use std::io::{Read, Seek, SeekFrom};

use serde::Deserialize;

use super::{NOT_SPLAT4D, Source};
use crate::error::SceneError;
use crate::format::SPLAT4D;
use crate::limits::Budget;

/// Bytes that a byte of JSON turns into, at most.
const PARSED: u64 = 16;

/// What a file says of all its frames.
pub(super) struct Header {
    pub(super) gaussians: usize,
    pub(super) frames: u32,
    pub(super) steps: Steps,
    pub(super) still: Section,
    groups: Vec<Group>,
}

/// What a value is a multiple of. Steps of colours, opacities and rotations are whole.
#[derive(Deserialize)]
pub(super) struct Steps {
    #[serde(rename = "pos")]
    pub(super) position: f64,
    #[serde(rename = "scale_log")]
    pub(super) log_scale: f64,
    #[serde(rename = "rgb")]
    pub(super) colour: f64,
    #[serde(rename = "alpha")]
    pub(super) opacity: f64,
    #[serde(rename = "rot")]
    pub(super) rotation: f64,
    /// Of what does not change.
    #[serde(rename = "base_pos")]
    pub(super) base_position: f64,
    #[serde(rename = "base_scale_log")]
    pub(super) base_log_scale: f64,
}

#[derive(Deserialize, Clone, Copy)]
pub(super) struct Section {
    pub(super) offset: u64,
    #[serde(rename = "len")]
    pub(super) length: u64,
}

/// A group of frames that can be read by itself.
#[derive(Deserialize, Clone)]
pub(super) struct Group {
    pub(super) offset: u64,
    #[serde(rename = "len")]
    pub(super) length: u64,
    /// The first frame and the last.
    #[serde(rename = "f0")]
    pub(super) first: usize,
    #[serde(rename = "f1")]
    pub(super) last: usize,
}

#[derive(Deserialize)]
struct Json {
    n: u32,
    t: u32,
    steps: Steps,
    static_section: Section,
    gops: Vec<Group>,
}

impl Group {
    pub(super) fn frames(&self) -> usize {
        self.last.saturating_sub(self.first).saturating_add(1)
    }
}

impl Header {
    /// Reads and checks it: sections lie in the file, frames are not more than its bytes, and groups have each
    /// frame once, in order.
    pub(super) fn read(source: &mut Box<dyn Source>, budget: &mut Budget) -> Result<Self, SceneError> {
        let size = source.seek(SeekFrom::End(0))?;
        source.rewind()?;
        let mut head = [0; 12];
        source.read_exact(&mut head).map_err(|_| SceneError::truncated(0, "the header", 12, size))?;
        let [[a, b, c, d], [version, _, _, _], length] = *head.as_chunks().0 else {
            return Err(SceneError::malformed(0, "no header", NOT_SPLAT4D));
        };
        if [a, b, c, d] != SPLAT4D {
            return Err(SceneError::malformed(0, "the magic number is another", NOT_SPLAT4D));
        }
        if version != 1 {
            return Err(SceneError::unsupported(
                format!(".splat4d of version {version}"),
                "version 1 is known",
            ));
        }
        let length = u64::from(u32::from_le_bytes(length));
        let there = size.saturating_sub(12);
        if length > there {
            return Err(SceneError::truncated(12, "the description", length, there));
        }
        budget.take(length.saturating_mul(PARSED), "the description")?;
        let mut json = budget.room(length, "the description")?;
        source.take(length).read_to_end(&mut json)?;
        let json: Json = serde_json::from_slice(&json).map_err(|error| broken(error.to_string()))?;
        let header = Self {
            gaussians: json.n as usize,
            frames: json.t,
            steps: json.steps,
            still: json.static_section,
            groups: json.gops,
        };
        header.check(size)?;
        Ok(header)
    }

    fn check(&self, size: u64) -> Result<(), SceneError> {
        // A group in which nothing changes has no streams however many frames it says, so a few bytes could stand for frames
        // without end. Encoders give a group a second or so, and it takes some forty bytes of the description alone.
        if u64::from(self.frames) > size {
            let what =
                format!("{} frames in a file of {size} bytes, a frame takes a byte or more", self.frames);
            return Err(broken(what));
        }
        let lies_inside =
            |offset: u64, length: u64| offset.checked_add(length).is_some_and(|end| end <= size);
        if !lies_inside(self.still.offset, self.still.length) {
            return Err(SceneError::truncated(self.still.offset, "the static section", self.still.length, 0));
        }
        let mut next = 0_usize;
        for (index, group) in self.groups.iter().enumerate() {
            if group.first != next || group.last < group.first {
                return Err(broken(format!("group {index} has frames {} to {}", group.first, group.last)));
            }
            if !lies_inside(group.offset, group.length) {
                return Err(SceneError::truncated(group.offset, "a group of frames", group.length, 0));
            }
            next = group.last.saturating_add(1);
        }
        match next == self.frames as usize {
            true => Ok(()),
            false => Err(broken(format!("its groups have {next} frames, it says {}", self.frames))),
        }
    }

    /// The group that has a frame, and its place.
    pub(super) fn group_of(&self, frame: usize) -> Option<(usize, &Group)> {
        let index = self.groups.partition_point(|group| group.last < frame);
        Some((index, self.groups.get(index)?))
    }
}

fn broken(what: String) -> SceneError {
    SceneError::inconsistent(format!("the description of the file: {what}"), NOT_SPLAT4D)
}
