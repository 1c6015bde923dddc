//! Inside an increment: its sections one after the other.

use super::section::Elements;
use super::{Inspector, variable_row};
use crate::Result;
use crate::entropy::in_force::SectionModels;
use crate::entropy::layout::{Layout, ShCoding};
use crate::entropy::model::read_models;
use crate::payload::{CodedSection, Increment};
use crate::syntax::{IncrementHeader, after};
use crate::unit::Unit;

impl Inspector<'_> {
    /// The elements of an increment; its sections only where all of them can be divided.
    pub(super) fn increment(&mut self, unit: &Unit<'_>) -> Result<()> {
        let (payload, at) = (unit.payload, unit.payload_at);
        if !self.levels.takes(&unit.header) {
            let value = format!("{} bytes", payload.len());
            let meaning = "passed over: the reference frame has fewer refinements";
            self.show(at, payload.len(), "payload".into(), value, meaning, "7.13.3", "increment");
            return Ok(());
        }
        self.fixed(&IncrementHeader::TABLE, payload, at);
        let sequence = self.sequence_at(at)?;
        let increment = Increment::parse(payload, at, &sequence, &self.limits)?;
        let (dc_rank, sh_rank) = self.coding.frame_ranks;
        let sh = ShCoding::of(&increment.header.sh(), sh_rank);
        let mut models = self.coding.in_force.before(unit.header.refinement).clone();
        let mut here = after(at, IncrementHeader::SIZE);
        for coded in &increment.sections {
            let layout = Layout::of_section(coded.section, dc_rank, sh);
            let mut elements = Elements::default();
            let reusable = models.reusable(coded.section, &layout);
            let read =
                read_models(coded.model, coded.model_at, &layout.alphabets(), &reusable, &mut elements);
            here = self.section(payload, at, here, coded, &elements, read.as_ref().map(|_| &layout))?;
            // Like those of a refinement, models that cannot be read are shown as such.
            if let Ok(read) = read {
                models.replace(coded.section, SectionModels { layout, models: read });
            }
        }
        self.coding.in_force.follow(unit.header.refinement, models);
        Ok(())
    }

    /// One section, which starts at `here` of the payload that starts at `payload_at`; gives where it ends.
    fn section(
        &mut self,
        payload: &[u8],
        payload_at: u64,
        here: u64,
        coded: &CodedSection<'_>,
        elements: &Elements,
        read: core::result::Result<&Layout, &crate::Error>,
    ) -> Result<u64> {
        const RECORD: &str = "section";
        let place = |rest: &[u8]| after(payload_at, payload.len().saturating_sub(rest.len()));
        if let Some(row) = variable_row(RECORD, "lanes_log2") {
            let value = format!("{} ({})", coded.lanes_log2, coded.section.name());
            self.show(here, 1, "lanes_log2".into(), value, row.meaning, row.clause, RECORD);
        }
        let start = usize::try_from(here.saturating_sub(payload_at)).unwrap_or(usize::MAX).saturating_add(1);
        let mut rest = payload.get(start..).unwrap_or_default();
        self.number(RECORD, "model_length", None, &mut rest, place)?;
        self.models(RECORD, elements, read, coded.model, coded.model_at);
        rest = rest.get(coded.model.len()..).unwrap_or_default();
        for block in 0..coded.blocks.len() {
            self.number(RECORD, "block_length", Some(block), &mut rest, place)?;
        }
        let mut end = place(rest);
        for (number, &(block, at)) in coded.blocks.iter().enumerate() {
            self.block(RECORD, number, block, at, coded.lanes_log2);
            end = after(at, block.len());
        }
        Ok(end)
    }
}
