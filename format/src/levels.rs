//! Which increments of predicted frames are discarded because the reference frame has fewer refinements, from headers
//! alone. Their payload may be anything.

use crate::syntax::{GopHeader, Profile, SequenceParameters, UnitHeader, UnitType};
use crate::unit::Unit;

/// The levels of the frames of a GOP, if every unit is there and good.
#[derive(Debug, Clone, Default)]
pub struct Levels {
    /// The GOP in progress, if its frames are predicted, and the display index of its first frame.
    gop: Option<(GopHeader, u32)>,
    sequence: Option<SequenceParameters>,
    /// Increments of the I frame so far: all, and those of the top spatial layer.
    anchor: (u32, u8),
    /// Level of each frame that came, by its index in the GOP: at most 1024 of them.
    levels: Vec<u8>,
}

impl Levels {
    /// Takes note of a unit that is intact, for what it says of the sequence or of a GOP.
    pub fn follow(&mut self, unit: &Unit<'_>, profile: Profile) {
        match unit.header.unit_type() {
            UnitType::SequenceParameters => {
                self.sequence =
                    SequenceParameters::parse_payload(unit.payload, unit.payload_at, profile).ok();
            }
            UnitType::GopHeader => {
                let parsed = GopHeader::parse_payload(unit.payload, unit.payload_at, profile).ok();
                let predicted = parsed.filter(GopHeader::is_predicted);
                self.gop = predicted.map(|header| (header, unit.header.frame));
                self.anchor = (0, 0);
                self.levels.clear();
            }
            _ => {}
        }
    }

    /// Takes note of the header of a unit; whether it is decoded, as far as the reference frame goes.
    pub fn takes(&mut self, header: &UnitHeader) -> bool {
        let (Some((gop, first)), Some(sequence)) = (self.gop, self.sequence) else { return true };
        let in_gop = header.frame.checked_sub(first).filter(|index| *index < gop.gop_frame_count);
        let (UnitType::Increment, Some(index)) = (header.unit_type(), in_gop) else { return true };
        let Some(reference) = gop.role(index).reference else {
            let top = header.spatial_layer.saturating_add(1) == sequence.spatial_layer_count;
            self.anchor.0 = self.anchor.0.saturating_add(1);
            self.anchor.1 = self.anchor.1.saturating_add(top.into());
            return true;
        };
        if header.refinement >= self.level(reference, &sequence)
            && header.refinement < sequence.refinement_count
        {
            return false;
        }
        let index = usize::try_from(index).unwrap_or(0);
        if self.levels.len() <= index {
            self.levels.resize(index.saturating_add(1), 0);
        }
        if let Some(level) = self.levels.get_mut(index) {
            *level = level.saturating_add(1);
        }
        true
    }

    /// 7.3: the level of the frame with an index in the GOP.
    fn level(&self, index: u32, sequence: &SequenceParameters) -> u8 {
        let (all, of_top) = self.anchor;
        let refinements = sequence.refinement_count;
        let whole = u32::from(refinements).saturating_mul(sequence.spatial_layer_count.into());
        match index {
            0 if !sequence.whole_anchor() => of_top,
            0 if all == whole => refinements,
            0 => 0,
            _ => usize::try_from(index).ok().and_then(|index| self.levels.get(index)).copied().unwrap_or(0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::syntax::UnitId;

    fn sequence(whole_anchor: bool) -> SequenceParameters {
        let (spatial_layer_count, refinement_count) = (2, 3);
        let sequence_flags = SequenceParameters::flags(false, false, whole_anchor);
        let bytes = [0; SequenceParameters::SIZE];
        let (zero, _): (SequenceParameters, _) =
            crate::syntax::decode(&SequenceParameters::TABLE, &bytes, 0).unwrap();
        SequenceParameters { spatial_layer_count, refinement_count, sequence_flags, ..zero }
    }

    /// What is decoded of a frame with so many refinements at a layer.
    fn taken(levels: &mut Levels, frame: u32, layer: u8, refinements: u8) -> Vec<bool> {
        let unit = |refinement| {
            let id = UnitId::of_increment(frame, refinement).on_layers(layer, 0);
            levels.takes(&UnitHeader::new(id, &[]).unwrap())
        };
        (0..refinements).map(unit).collect()
    }

    #[test]
    fn a_frame_has_no_more_refinements_than_its_reference() {
        for whole_anchor in [false, true] {
            let gop = Some((GopHeader::predicted(0, 8, 1), 40));
            let mut levels = Levels { gop, sequence: Some(sequence(whole_anchor)), ..Levels::default() };
            assert_eq!(taken(&mut levels, 40, 0, 3), [true; 3]);
            assert_eq!(taken(&mut levels, 40, 1, 2), [true; 2], "refinement 2 of the top layer is absent");
            let of_anchor = [!whole_anchor, !whole_anchor, false];
            assert_eq!(taken(&mut levels, 42, 1, 3), of_anchor, "refers to 40");
            assert_eq!(taken(&mut levels, 43, 1, 3), of_anchor, "refers to 42");
            assert_eq!(taken(&mut levels, 47, 1, 1), [false], "refers to 46, which is absent");
        }
    }
}
