//! `.splat4d`: sequences of splats4D, in which frames have one count and differ from each other by integers.
//!
//! A header, a list of groups of frames in JSON, a section of what does not change, and a chunk for each group. Values are
//! integers times a step. What a Gaussian has for the whole sequence stands in the static section; the rest is in a chunk,
//! where the first frame of the group has values and the others differences from the frame before. A file of more frames than it
//! has bytes is refused.

mod header;
mod streams;

use std::io::{Read, Seek, SeekFrom};

use super::{Frames, Source};
use crate::byte_values::logit_of_byte;
use crate::error::SceneError;
use crate::limits::Budget;
use crate::reading::frame_of;
use header::{Group, Header};
use splatstream_gaussians::GaussianFrame;
use splatstream_gaussians::activation::dc_of_colour;
use streams::{Chunk, Stream, unzigzag};

const NOT_SPLAT4D: &str = "this is no .splat4d file, or it is damaged";

/// Attributes in the order of their numbers: position, rotation, colour, opacity, scale; and the values that each has.
const CHANNELS: [usize; 5] = [3, 4, 3, 1, 3];
const POSITION: usize = 0;
const ROTATION: usize = 1;
const COLOUR: usize = 2;
const OPACITY: usize = 3;
const SCALE: usize = 4;

/// A file that is open, at one frame of one group.
pub(super) struct Splat4d {
    source: Box<dyn Source>,
    header: Header,
    still: Still,
    /// Memory that the header and what is still take.
    used: u64,
    group: Option<OpenGroup>,
}

/// What holds for all frames.
struct Still {
    /// A bit for each Gaussian, from the highest: set where it does not change.
    masks: [Stream; 5],
    /// Multiples of the finer steps.
    position: Vec<i32>,
    log_scale: Vec<i32>,
    colour: Stream,
    opacity: Stream,
    rotation: Stream,
}

/// A group of frames: its streams, and the values of one of its frames.
struct OpenGroup {
    index: usize,
    chunk: Chunk,
    /// The frame that `values` are of, from the first of the group.
    frame: usize,
    values: [Vec<i32>; 5],
    used: u64,
}

impl Splat4d {
    pub(super) fn open(mut source: Box<dyn Source>, budget: &mut Budget) -> Result<Self, SceneError> {
        let before = budget.left();
        let header = Header::read(&mut source, budget)?;
        let still = Still::read(&mut source, &header, budget)?;
        let used = before.saturating_sub(budget.left());
        Ok(Self { source, header, still, used, group: None })
    }

    /// How many Gaussians have values of their own in each frame.
    fn changing(&self, attribute: usize) -> usize {
        let mask = self.still.masks.get(attribute);
        let still =
            mask.map_or(0, |mask| (0..self.header.gaussians).filter(|&row| is_set(mask, row)).count());
        self.header.gaussians.saturating_sub(still)
    }

    /// The group of a frame, read if another one is open.
    fn open_group(
        &mut self,
        index: usize,
        group: &Group,
        budget: &mut Budget,
    ) -> Result<OpenGroup, SceneError> {
        if let Some(open) = self.group.take_if(|open| open.index == index) {
            budget.take(open.used, "a group of frames")?;
            return Ok(open);
        }
        self.group = None;
        let before = budget.left();
        self.source.seek(SeekFrom::Start(group.offset))?;
        let mut bytes = budget.room(group.length, "a group of frames")?;
        self.source.by_ref().take(group.length).read_to_end(&mut bytes)?;
        let counts: [usize; 5] = std::array::from_fn(|attribute| {
            let channels = CHANNELS.get(attribute).copied().unwrap_or(0);
            self.changing(attribute).saturating_mul(channels)
        });
        let chunk = Chunk::read(&bytes, group, &counts, budget)?;
        budget.give_back(group.length);
        let mut values: [Vec<i32>; 5] = Default::default();
        for ((values, key), count) in values.iter_mut().zip(&chunk.keys).zip(counts) {
            *values = budget.room(count as u64, "the values of a frame")?;
            values.extend(key.iter().map(unzigzag));
        }
        let used = before.saturating_sub(budget.left());
        Ok(OpenGroup { index, chunk, frame: 0, values, used })
    }
}

impl OpenGroup {
    /// Comes to a frame of the group.
    fn go_to(&mut self, frame: usize) {
        if frame < self.frame {
            for (values, key) in self.values.iter_mut().zip(&self.chunk.keys) {
                values.iter_mut().zip(key.iter()).for_each(|(value, symbol)| *value = unzigzag(symbol));
            }
            self.frame = 0;
        }
        for step in self.frame..frame {
            for (values, deltas) in self.values.iter_mut().zip(&self.chunk.deltas) {
                let first = step.saturating_mul(values.len());
                for (value, symbol) in values.iter_mut().zip(deltas.iter_from(first)) {
                    *value = value.wrapping_add(unzigzag(symbol));
                }
            }
        }
        self.frame = frame;
    }
}

impl Still {
    fn read(source: &mut Box<dyn Source>, header: &Header, budget: &mut Budget) -> Result<Self, SceneError> {
        let (offset, length) = (header.still.offset, header.still.length);
        source.seek(SeekFrom::Start(offset))?;
        let mut bytes: Vec<u8> = budget.room(length, "the static section")?;
        source.take(length).read_to_end(&mut bytes)?;
        let mut cursor = streams::Cursor::new(&bytes, offset);
        let rows = header.gaussians;
        let bits = rows.div_ceil(8);
        let mut next = |count: usize, what, budget: &mut Budget| cursor.stream(count, what, budget);
        let mut masks: [Stream; 5] = Default::default();
        for mask in &mut masks {
            *mask = next(bits, "a mask of what changes", budget)?;
        }
        let still = Self {
            masks,
            position: spread(&next(rows.saturating_mul(3), "positions", budget)?, budget)?,
            log_scale: spread(&next(rows.saturating_mul(3), "scales", budget)?, budget)?,
            colour: next(rows.saturating_mul(3), "colours", budget)?,
            opacity: next(rows, "opacities", budget)?,
            rotation: next(rows.saturating_mul(4), "rotations", budget)?,
        };
        budget.give_back(length);
        Ok(still)
    }
}

/// Values of three channels that were stored as differences from the row before.
fn spread(stream: &Stream, budget: &mut Budget) -> Result<Vec<i32>, SceneError> {
    let mut values = budget.room(stream.len() as u64, "values that do not change")?;
    let mut before = [0_i32; 3];
    for (at, symbol) in stream.iter().enumerate() {
        if let Some(before) = before.get_mut(at % 3) {
            *before = before.wrapping_add(unzigzag(symbol));
            values.push(*before);
        }
    }
    Ok(values)
}

fn is_set(mask: &Stream, row: usize) -> bool {
    mask.get(row / 8) << (row % 8) & 128 != 0
}

impl Frames for Splat4d {
    fn len(&self) -> u32 {
        self.header.frames
    }

    fn read(&mut self, frame: u32, budget: &mut Budget) -> Result<GaussianFrame, SceneError> {
        budget.take(self.used, "what does not change")?;
        let found = self.header.group_of(frame as usize).map(|(index, group)| (index, group.clone()));
        let (index, group) =
            found.ok_or_else(|| SceneError::inconsistent("a frame in no group", NOT_SPLAT4D))?;
        let mut open = self.open_group(index, &group, budget)?;
        open.go_to((frame as usize).saturating_sub(group.first));
        let planes = self.planes(&open, budget);
        self.group = Some(open);
        frame_of(0, planes?)
    }
}

impl Splat4d {
    fn planes(
        &self,
        open: &OpenGroup,
        budget: &mut Budget,
    ) -> Result<splatstream_gaussians::Planes, SceneError> {
        let mut planes = budget.planes(0, self.header.gaussians as u64)?;
        let (still, steps) = (&self.still, &self.header.steps);
        // The next values of each attribute, of those Gaussians that change.
        let mut changing = open.values.each_ref().map(|values| values.iter().copied());
        let mut value_of = |attribute: usize, row: usize, at_rest: &dyn Fn(usize) -> f64, step: f64| {
            let channels = CHANNELS.get(attribute).copied().unwrap_or(0);
            let is_still = still.masks.get(attribute).is_some_and(|mask| is_set(mask, row));
            let mut values = [0.0; 4];
            for (channel, value) in values.iter_mut().enumerate().take(channels) {
                *value = match (is_still, changing.get_mut(attribute)) {
                    (false, Some(next)) => f64::from(next.next().unwrap_or(0)) * step,
                    _ => at_rest(row.saturating_mul(channels).saturating_add(channel)),
                };
            }
            values
        };
        let of =
            |values: &[i32], at: usize, step: f64| f64::from(values.get(at).copied().unwrap_or(0)) * step;
        for row in 0..self.header.gaussians {
            let at_rest = |at| of(&still.position, at, steps.base_position);
            let position = value_of(POSITION, row, &at_rest, steps.position);
            planes.position.iter_mut().zip(position).for_each(|(plane, value)| plane.push(value as f32));
            let at_rest = |at| f64::from(still.rotation.get(at)) - 128.0;
            let rotation = value_of(ROTATION, row, &at_rest, steps.rotation);
            let parts = rotation.map(|part| (part.clamp(-128.0, 127.0) / 128.0) as f32);
            planes.rotation.iter_mut().zip(parts).for_each(|(plane, part)| plane.push(part));
            let colour = value_of(COLOUR, row, &|at| f64::from(still.colour.get(at)), steps.colour);
            let dc = colour.map(|level| dc_of_colour(level.clamp(0.0, 255.0) / 255.0));
            planes.dc.iter_mut().zip(dc).for_each(|(plane, value)| plane.push(value));
            let [opacity, ..] = value_of(OPACITY, row, &|at| f64::from(still.opacity.get(at)), steps.opacity);
            // `as` saturates.
            planes.opacity_logit.push(logit_of_byte(opacity as u8));
            let at_rest = |at| of(&still.log_scale, at, steps.base_log_scale);
            let log_scale = value_of(SCALE, row, &at_rest, steps.log_scale);
            planes.log_scale.iter_mut().zip(log_scale).for_each(|(plane, value)| plane.push(value as f32));
        }
        Ok(planes)
    }
}
