//! Units on their way out.

use crate::error::Error;
use crate::report::GopReport;
use crate::sequence::Analysis;
use crate::verification::Verifier;
use splatstream_decoder::operating_point::Tally;
use splatstream_format::payload::{Index, SceneDescription};
use splatstream_format::syntax::{
    EndOfStream, GopHeader, IndexEntry, Profile, SequenceParameters, UnitHeader, UnitId, UnitType,
};
use splatstream_format::unit::{Unit, write_file_header, write_unit};
use std::io::Write;

/// Writes units, and keeps what the end of the stream says about them.
pub(crate) struct UnitWriter<'a> {
    sink: &'a mut dyn Write,
    record: &'a mut Record,
}

/// What is known of the units that have been written. A stream that is written GOP by GOP goes on with it.
pub(crate) struct Record {
    profile: Profile,
    sequence: SequenceParameters,
    /// Bytes written.
    pub(crate) offset: u64,
    units: u32,
    /// Where GOPs start.
    index: Vec<IndexEntry>,
    /// The GOPs that have been started.
    pub(crate) gops: Vec<GopReport>,
    /// What the units add to the operating points.
    tally: Tally,
    /// Is shown everything that is written, if there is one.
    pub(crate) verifier: Option<Verifier>,
}

impl Record {
    /// Of nothing.
    pub(crate) fn new(profile: Profile, sequence: &SequenceParameters) -> Self {
        Self {
            profile,
            sequence: *sequence,
            offset: 0,
            units: 0,
            index: Vec::new(),
            gops: Vec::new(),
            tally: Tally::new(profile),
            verifier: None,
        }
    }
}

impl<'a> UnitWriter<'a> {
    /// Begins or goes on with the stream of a record.
    pub(crate) fn new(sink: &'a mut dyn Write, record: &'a mut Record) -> Self {
        Self { sink, record }
    }

    /// What stands before the first GOP.
    pub(crate) fn start(&mut self, analysis: &Analysis, description: &SceneDescription) -> Result<(), Error> {
        let mut head = write_file_header(self.record.profile, analysis.level)?;
        self.bytes(&head)?;
        let (id, sequence) = (UnitId::stream(UnitType::SequenceParameters), self.record.sequence.to_bytes()?);
        self.unit(id, &sequence)?;
        if let Some(verifier) = &mut self.record.verifier {
            write_unit(&mut head, id, &sequence)?;
            verifier.head(&head);
        }
        let description = SceneDescription { bounds: analysis.bounds, ..description.clone() };
        self.unit(UnitId::stream(UnitType::SceneDescription), &description.to_bytes()?)
    }

    /// GOPs that have been started.
    pub(crate) fn gops(&self) -> u32 {
        self.record.index.len() as u32
    }

    /// Starts a GOP. The sequence parameters are repeated before each but the first: a stream of which the beginning is
    /// lost or damaged can still be decoded.
    pub(crate) fn gop(&mut self, header: &GopHeader, frame: u32) -> Result<(), Error> {
        if !self.record.index.is_empty() {
            self.unit(UnitId::stream(UnitType::SequenceParameters), &self.record.sequence.to_bytes()?)?;
        }
        self.record.index.push(IndexEntry { frame, reserved_zero: 0, offset: self.record.offset });
        self.record.gops.push(GopReport { first: frame, frames: header.gop_frame_count });
        if let Some(verifier) = &mut self.record.verifier {
            verifier.start_gop(header, frame)?;
        }
        self.unit(UnitId::of_frame(UnitType::GopHeader, frame), &header.to_bytes()?)
    }

    /// What stands after the last GOP.
    pub(crate) fn finish(mut self) -> Result<(), Error> {
        if let Some(verifier) = &mut self.record.verifier {
            verifier.end_gop()?;
        }
        if self.record.profile == Profile::Dynamic {
            let points = self.record.tally.list().to_bytes()?;
            self.unit(UnitId::stream(UnitType::OperatingPoints), &points)?;
        }
        let index_offset = self.record.offset;
        let index = Index { entries: core::mem::take(&mut self.record.index) };
        self.unit(UnitId::stream(UnitType::Index), &index.to_bytes()?)?;
        let frame_count = self.record.gops.iter().map(|gop| gop.frames).sum();
        let end = EndOfStream { frame_count, unit_count: self.record.units, index_offset };
        self.unit(UnitId::stream(UnitType::End), &end.to_bytes()?)
    }

    /// Writes a unit.
    #[expect(clippy::arithmetic_side_effects, reason = "units and bytes that were written")]
    pub(crate) fn unit(&mut self, id: UnitId, payload: &[u8]) -> Result<(), Error> {
        let header = UnitHeader::new(id, payload)?;
        self.record.units += 1;
        self.record.tally.unit(&Unit { at: 0, header, payload, payload_at: 0 });
        if let Some(verifier) = &mut self.record.verifier {
            verifier.unit(&header, payload)?;
        }
        self.bytes(&header.to_bytes()?)?;
        self.bytes(payload)
    }

    #[expect(clippy::arithmetic_side_effects, reason = "units and bytes that were written")]
    fn bytes(&mut self, bytes: &[u8]) -> Result<(), Error> {
        self.sink.write_all(bytes)?;
        self.record.offset += bytes.len() as u64;
        Ok(())
    }
}
