//! The units that start GOPs and frames: sequence_parameters, gop_header and frame_header.

use super::frame::{FrameInProgress, Progress, unit_bytes};
use super::lists::Lists;
use super::phase::{mismatch, same, unexpected};
use super::references::References;
use super::{Context, Decoder};
use crate::budget::Shape;
use crate::buffers::left_or_new;
use crate::displacement::CellField;
use crate::entropy_state::{UnitEntropy, of_sections};
use crate::gop::{Gop, element_at};
use crate::increment::field;
use crate::increment::values::{PreparedSections, SectionCoding};
use crate::layout::{Section, ShCoding};
use crate::steps::StepRule;
use splatstream_format::entropy::in_force::ModelsInForce;
use splatstream_format::payload::{Cells, FramePayload, SceneDescription};
use splatstream_format::syntax::{
    FrameHeader, FrameRole, GopHeader, SequenceParameters, UnitHeader, UnitType,
};
use splatstream_format::unit::Unit;
use splatstream_format::{Error, ErrorKind, Result};
use std::sync::Arc;

impl Decoder {
    /// What the stream says of its scene, once that has come.
    pub fn scene(&self) -> Option<&SceneDescription> {
        self.scene.as_deref()
    }

    /// Takes a unit that follows the sequence parameters where decoding goes on from a GOP (B.3), if it is a scene
    /// description. One with a fault is left out and is no error: a decoder that starts there need not have any.
    pub(crate) fn take_description(&mut self, unit: &Unit<'_>) {
        if unit.header.unit_type() == UnitType::SceneDescription && unit.check_header(self.profile).is_ok() {
            let _left_out = self.content(unit, false);
        }
    }

    pub(super) fn scene_description(&mut self, unit: &Unit<'_>) -> Result<()> {
        self.scene = Some(Box::new(SceneDescription::parse(unit.payload, unit.payload_at)?));
        Ok(())
    }

    /// The first sequence_parameters count; copies are the same, byte for byte.
    pub(super) fn sequence_parameters(&mut self, unit: &Unit<'_>) -> Result<()> {
        let sequence = SequenceParameters::parse_payload(unit.payload, unit.payload_at, self.profile)?;
        match &self.sequence {
            None => {
                self.sequence = Some((sequence, unit.payload.to_vec()));
                Ok(())
            }
            Some((_, first)) if first == unit.payload => Ok(()),
            Some(_) => {
                let rule = "a stream has one set of sequence parameters";
                Err(Error::new(unit.payload_at, "6.4", ErrorKind::Constraint { rule }))
            }
        }
    }

    /// `was_lost` says that GOPs may be missing for a reason that has been reported.
    pub(super) fn gop_header(&mut self, unit: &Unit<'_>, was_lost: bool) -> Result<()> {
        let header = GopHeader::parse_payload(unit.payload, unit.payload_at, self.profile)?;
        let layers = self.sequence().map_or(1, |sequence| sequence.temporal_layer_count);
        header.validate_layers(unit.payload_at, layers)?;
        header.validate_from(unit.payload_at, unit.header.frame)?;
        let (frame, gop_index) = (u64::from(unit.header.frame), u64::from(header.gop_index));
        if self.starts_inside && self.gop.is_none() {
            (self.next_frame, self.next_gop) = (frame, gop_index);
        }
        let frame_at = element_at(&UnitHeader::TABLE, unit.at, "frame");
        let relations = [
            mismatch(frame_at, "6.5", "frame", frame, self.next_frame),
            mismatch(unit.payload_at, "6.5", "gop_index", gop_index, self.next_gop),
        ];
        if frame < self.next_frame || gop_index < self.next_gop {
            let [of_frame, of_index] = relations;
            return Err(if frame < self.next_frame { of_frame } else { of_index });
        }
        // GOPs are missing: the unit takes effect all the same.
        let gap = relations.into_iter().zip([frame > self.next_frame, gop_index > self.next_gop]);
        if let (Some((error, _)), false) = (gap.into_iter().find(|(_, differs)| *differs), was_lost) {
            self.report(error);
        }
        self.report.lose(self.next_frame, frame);
        self.references = References::default();
        self.spent.start_gop();
        self.next_gop = gop_index.saturating_add(1);
        self.next_frame = frame;
        self.frames_left = header.gop_frame_count.into();
        self.counted.gops.push((unit.header.frame, unit.at));
        self.gop = Some(Gop::new(header, unit.header.frame));
        Ok(())
    }

    /// Ends the GOP in progress, of which all frames, or of a predicted one the first, shall have come; `at` is the offset
    /// of the unit that ends it.
    pub(super) fn close_gop(&mut self, at: u64) {
        let (Some(gop), 1..) = (&self.gop, self.frames_left) else { return };
        let announced = u64::from(gop.header.gop_frame_count);
        let is_enough = gop.header.is_predicted() && self.next_frame > u64::from(gop.first_frame);
        let end = self.next_frame.saturating_add(self.frames_left);
        if !is_enough {
            let present = announced.saturating_sub(self.frames_left);
            self.report(mismatch(at, "6.5", "gop_frame_count", announced, present));
            self.report.lose(self.next_frame, end);
        }
        self.next_frame = end;
        self.frames_left = 0;
    }

    /// A transform, codebook or weights unit.
    pub(super) fn gop_tool(&mut self, unit: &Unit<'_>) -> Result<()> {
        let (Some(gop), Some((sequence, _))) = (&mut self.gop, &self.sequence) else {
            return Err(unexpected(unit));
        };
        let at = element_at(&UnitHeader::TABLE, unit.at, "frame");
        same(at, "6.3", "frame", unit.header.frame, gop.first_frame)?;
        gop.tool(unit, sequence, &self.options.limits)
    }

    pub(super) fn frame_header(&mut self, unit: &Unit<'_>) -> Result<()> {
        let role = self.role(unit)?;
        let (Some(gop), Some((sequence, _))) = (&self.gop, &self.sequence) else {
            return Err(unexpected(unit));
        };
        let at = unit.payload_at;
        let FramePayload { header, carried_digest, carried_digest_at, cells } =
            FramePayload::parse(unit.payload, at, sequence, &self.options.limits)?;
        header.validate_role(at, &role)?;
        let of_count = element_at(&FrameHeader::TABLE, at, "gaussian_count");
        let shape = Shape::new(sequence, &gop.header, self.options.ahead);
        let spent = self.spent.frame(header.gaussian_count, &shape, &self.options.budget, of_count);
        self.is_exhausted = spent.is_err();
        spent?;
        gop.transforms(&header, at)?;
        let reference = role.reference.map(|reference| gop.first_frame.saturating_add(reference));
        let kept = reference.and_then(|reference| self.references.find(reference));
        let context = self.context(kept).ok_or_else(|| unexpected(unit))?;
        let moved = context.moved(cells.as_ref(), at)?;
        let limit = match role.reference {
            None => sequence.refinement_count,
            Some(_) => context.reference.map_or(0, |reference| reference.level),
        };
        let absent = reference.filter(|_| kept.is_none()).map(|reference| undefined(unit, reference));
        self.skip_to(unit);
        self.frame = Some(FrameInProgress {
            index: unit.header.frame,
            point: self.options.operating_point,
            payload_at: at,
            header,
            role,
            carried_digest: carried_digest.map(|digest| (digest, carried_digest_at)),
            reference: kept,
            field: Arc::new(moved.field),
            seen: false,
            pending: Vec::new(),
            expected: Progress::new(limit),
            decoded: Progress::new(limit),
            lists: Lists::new(moved.models, self.next_identity, left_or_new(&mut self.spares)),
            bytes: unit_bytes(unit),
            entropy: moved.entropy.into_iter().collect(),
            error: absent,
            identities: (self.next_identity, 0),
            is_cut: false,
            has_ended: false,
        });
        absent.into_iter().for_each(|error| self.report(error));
        Ok(())
    }

    /// The type, temporal layer and reference of the frame that a frame_header starts: one of those still to come.
    fn role(&self, unit: &Unit<'_>) -> Result<FrameRole> {
        let Some(gop) = &self.gop else { return Err(unexpected(unit)) };
        let to_come = self.next_frame..self.next_frame.saturating_add(self.frames_left);
        if !to_come.contains(&unit.header.frame.into()) {
            return Err(self.unexpected_frame(unit));
        }
        let role = gop.header.role(unit.header.frame.saturating_sub(gop.first_frame));
        let at = element_at(&UnitHeader::TABLE, unit.at, "temporal_layer");
        same(at, "7.3.1", "temporal_layer", unit.header.temporal_layer, role.temporal_layer)?;
        Ok(role)
    }

    fn unexpected_frame(&self, unit: &Unit<'_>) -> Error {
        let at = element_at(&UnitHeader::TABLE, unit.at, "frame");
        mismatch(at, "7.3.2", "frame", unit.header.frame.into(), self.next_frame)
    }

    /// Takes the frame that a frame_header starts, and those before it, from the frames that are to come. In an all-intra
    /// GOP none may be missing before it.
    fn skip_to(&mut self, unit: &Unit<'_>) {
        let index = u64::from(unit.header.frame);
        let is_all_intra = self.gop.as_ref().is_some_and(|gop| !gop.header.is_predicted());
        if is_all_intra && index > self.next_frame {
            self.report(self.unexpected_frame(unit));
            self.report.lose(self.next_frame, index);
        }
        let end = self.next_frame.saturating_add(self.frames_left);
        self.next_frame = index.saturating_add(1);
        self.frames_left = end.saturating_sub(self.next_frame);
    }
}

/// The error of a frame whose reference frame is absent.
fn undefined(unit: &Unit<'_>, reference: u32) -> Error {
    let kind = ErrorKind::Undefined { element: "reference frame", id: reference.into() };
    Error::new(unit.at, "7.3.2", kind)
}

/// What the cells of a frame make of the state of its reference frame.
struct Moved {
    field: CellField,
    models: ModelsInForce,
    entropy: Option<UnitEntropy>,
}

impl Context<'_> {
    /// Decodes the cells of a frame, if there is something that they move.
    fn moved(&self, cells: Option<&Cells<'_>>, at: u64) -> Result<Moved> {
        // An I frame starts without models (6.12).
        let models = self.reference.map_or_else(ModelsInForce::default, |reference| reference.models.clone());
        let mut moved = Moved { field: CellField::default(), models, entropy: None };
        let is_available = self.reference.is_some_and(|reference| reference.carried.is_some());
        let Some(cells) = cells.filter(|_| is_available) else { return Ok(moved) };
        let sections = core::slice::from_ref(&cells.coded);
        let steps = StepRule::new(self.sequence, [0; 5]);
        let coding = SectionCoding { dc_rank: 0, sh: ShCoding::None, steps };
        let prepared = PreparedSections::new(sections, &coding, &mut moved.models, &mut ())?;
        let values = prepared.decode(self.sequence, self.workspace())?;
        moved.field = field(values.section(Section::Cells), cells.cell_log2, self.sequence, at)?;
        if self.options.entropy {
            moved.entropy =
                of_sections(sections, &values)?.map(|state| UnitEntropy { payload_at: at, state });
        }
        Ok(moved)
    }
}
