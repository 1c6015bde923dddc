//! Increments are lost on the way: losing units of list h costs lists from h on, in the frame and in those that refer
//! to it, and nothing else.

use super::{Decoded, PLAIN};
use splatstream_decoder::process::{DecodedFrame, Decoder};
use splatstream_format::Result;
use splatstream_format::syntax::{GopHeader, IncrementHeader, Profile, SequenceParameters, UnitType};
use splatstream_format::unit::{Stream, Unit};

/// `whole` is what the whole stream decodes to; each bit of `losses`, in turn, says whether an increment is lost.
pub fn hold(bytes: &[u8], whole: &Decoded, losses: u32) -> Result<()> {
    let stream = Stream::open(bytes, &PLAIN.limits)?;
    let mut decoder = Decoder::new(stream.header(), PLAIN);
    let mut ledger =
        Ledger { profile: stream.header().profile(), sequence: None, gop: None, frames: Vec::new() };
    let mut frames = Vec::new();
    for (index, unit) in (0_u32..).zip(stream.units()) {
        let unit = unit?;
        let is_increment = unit.header.unit_type() == UnitType::Increment;
        let is_lost = is_increment && losses.rotate_right(index) & 1 == 1;
        ledger.follow(&unit, is_lost)?;
        if !is_lost {
            frames.extend(decoder.unit(&unit));
        }
    }
    assert_eq!(frames.len(), whole.frames.len(), "there are as many frames");
    for (part, whole) in frames.iter().zip(&whole.frames) {
        ledger.compare(part, whole);
    }
    Ok(())
}

/// What is known of a stream from its headers.
struct Ledger {
    profile: Profile,
    sequence: Option<SequenceParameters>,
    /// The GOP in progress and its first frame.
    gop: Option<(GopHeader, u32)>,
    frames: Vec<Frame>,
}

struct Frame {
    index: u32,
    /// Lists that no loss concerns, and of those that this frame offers to others.
    intact: u8,
    offered: u8,
    /// Gaussians of each list.
    sizes: [usize; 10],
}

impl Ledger {
    fn follow(&mut self, unit: &Unit<'_>, is_lost: bool) -> Result<()> {
        let (header, at) = (&unit.header, unit.payload_at);
        match header.unit_type() {
            UnitType::SequenceParameters => {
                self.sequence = Some(SequenceParameters::parse_payload(unit.payload, at, self.profile)?);
            }
            UnitType::GopHeader => {
                self.gop = Some((GopHeader::parse_payload(unit.payload, at, self.profile)?, header.frame));
            }
            UnitType::FrameHeader => {
                let reference =
                    self.gop.and_then(|(gop, first)| Some(first + gop.role(header.frame - first).reference?));
                let known = reference.and_then(|index| self.frames.iter().find(|frame| frame.index == index));
                let offered = known.map_or(u8::MAX, |frame| frame.offered);
                self.frames.push(Frame { index: header.frame, intact: offered, offered, sizes: [0; 10] });
            }
            UnitType::Increment => self.increment(unit, is_lost)?,
            _ => {}
        }
        Ok(())
    }

    fn increment(&mut self, unit: &Unit<'_>, is_lost: bool) -> Result<()> {
        let (Some(sequence), Some(frame)) = (&self.sequence, self.frames.last_mut()) else { return Ok(()) };
        let refinement = unit.header.refinement;
        if is_lost {
            let is_anchor = self.gop.is_some_and(|(_, first)| first == frame.index);
            frame.intact = frame.intact.min(refinement);
            // A whole anchor of which something is lost is of no use to others.
            let is_all = sequence.whole_anchor() && is_anchor;
            frame.offered = if is_all { 0 } else { frame.offered.min(refinement) };
        }
        // Of a unit that is discarded anything may be there.
        let parsed = IncrementHeader::parse(unit.payload, unit.payload_at, sequence, self.profile);
        if let (Ok((increment, _)), Some(size)) = (parsed, frame.sizes.get_mut(usize::from(refinement))) {
            *size = increment.list_size() as usize;
        }
        Ok(())
    }

    /// The lists that no loss concerns are those of the whole frame.
    fn compare(&self, part: &DecodedFrame, whole: &DecodedFrame) {
        let frame =
            self.frames.iter().find(|frame| frame.index == whole.index).expect("it has a frame_header");
        let lists = frame.intact.min(whole.level);
        assert!(part.index == whole.index && part.level >= lists, "frame {} lost too much", whole.index);
        let count = frame.sizes.iter().take(lists.into()).sum();
        let first = |frame: &DecodedFrame| {
            let mut planes = frame.planes.clone();
            planes.truncate(count);
            planes
        };
        assert!(first(part) == first(whole), "lists of frame {} depend on later ones", whole.index);
    }
}
