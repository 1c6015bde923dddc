//! Step 2 of clause 7.13.3, from headers alone: which increments of predicted frames are passed over because the
//! reference frame has fewer refinements. Their payload may be anything.

use crate::syntax::{GopHeader, Profile, SequenceParameters, UnitHeader, UnitType};
use crate::unit::Unit;

/// The refinements of the frames of a group that other frames can refer to, if every unit is there and good.
#[derive(Debug, Clone, Default)]
pub struct Levels {
    gop: Option<(GopHeader, u32)>,
    /// Refinements of the sequence, which an intra frame has that others refer to.
    refinements: u8,
    /// Display index and level, in stream order.
    frames: Vec<(u32, u8)>,
}

impl Levels {
    /// Takes note of a unit that is intact, for what it says of the sequence or of a group.
    pub fn follow(&mut self, unit: &Unit<'_>, profile: Profile) {
        match unit.header.unit_type() {
            UnitType::SequenceParameters => {
                let parsed = SequenceParameters::parse_payload(unit.payload, unit.payload_at, profile);
                self.refinements = parsed.map_or(0, |sequence| sequence.refinement_count);
            }
            UnitType::GopHeader => {
                let parsed = GopHeader::parse_payload(unit.payload, unit.payload_at, profile);
                self.gop = parsed.ok().map(|header| (header, unit.header.frame));
                self.frames.clear();
            }
            _ => {}
        }
    }

    /// Takes note of the header of a unit of the group; whether it is decoded, as far as the reference frame goes.
    pub fn takes(&mut self, header: &UnitHeader) -> bool {
        let Some((gop, first)) = self.gop else { return true };
        let place = gop.place(header.frame.saturating_sub(first));
        let (UnitType::Increment, Some(reference)) = (header.unit_type(), place.reference) else {
            return true;
        };
        let most = match reference {
            0 => self.refinements,
            place => self.level(first.saturating_add(place)),
        };
        if (most..self.refinements).contains(&header.refinement) {
            return false;
        }
        match self.frames.last_mut() {
            Some((frame, level)) if *frame == header.frame => *level = level.saturating_add(1),
            _ => self.frames.push((header.frame, 1)),
        }
        true
    }

    fn level(&self, frame: u32) -> u8 {
        self.frames.iter().rev().find(|(known, _)| *known == frame).map_or(0, |(_, level)| *level)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::syntax::UnitId;

    #[test]
    fn a_frame_has_no_more_refinements_than_its_reference() {
        let gop = Some((GopHeader::predicted(0, 8, 1), 40));
        let mut levels = Levels { gop, refinements: 3, frames: Vec::new() };
        let mut taken = |frame: u32, refinements: u8| -> Vec<bool> {
            let unit = |refinement: u8| {
                let id = UnitId { refinement, ..UnitId::of_frame(UnitType::Increment, frame) };
                levels.takes(&UnitHeader::new(id, &[]).unwrap())
            };
            (0..refinements).map(unit).collect()
        };
        assert_eq!(taken(40, 3), [true; 3], "an intra frame");
        assert_eq!(taken(42, 2), [true; 2]);
        assert_eq!(taken(43, 3), [true, true, false], "refers to 42");
        assert_eq!(taken(44, 3), [true, true, false], "refers to 42");
        assert_eq!(taken(47, 1), [false], "refers to 46, which is absent");
    }
}
