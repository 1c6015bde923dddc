//! Records and payloads: what is read is written, what is written is read, and both refuse the same for the same reason.

use crate::LIMITS;
use crate::seal::seal;
use arbitrary::Unstructured;
use core::fmt::Debug;
use splatstream_format::arbitrary_stream::sequence_parameters;
use splatstream_format::entropy::layout::{Layout, ShCoding};
use splatstream_format::entropy::model::{PlaneModel, read_models, write_models};
use splatstream_format::payload::{
    CellsBytes, Codebook, CodedSection, FramePayload, Increment, Index, OperatingPoints, SceneDescription,
    SectionBytes, Transform, Weights, write_frame, write_increment,
};
use splatstream_format::syntax::{
    CodebookHeader, EndOfStream, FileHeader, FixedRecord, FrameHeader, GopHeader, IndexEntry, IndexHeader,
    OperatingPointEntry, OperatingPointsHeader, Profile, SequenceParameters, UnitHeader, WeightsHeader,
};
use splatstream_format::{Error, Result};

/// Bytes that sequence parameters are made of, for records that need some.
pub const SEQUENCE: usize = 96;

/// The first byte of the input chooses the record or payload, four say at which offset it stands; what sequence
/// parameters are made of and the bytes of the record follow.
pub fn run(data: &[u8]) {
    let Some((&[choice, ref at @ ..], data)) = data.split_first_chunk::<5>() else { return };
    let (head, raw) = data.split_at_checked(SEQUENCE).unwrap_or((data, &[]));
    let Ok(sequence) = sequence_parameters(&mut Unstructured::new(head), Profile::Dynamic) else { return };
    let case = Case { raw, at: u32::from_le_bytes(*at).into(), sequence };
    let (_, law) = LAWS[usize::from(choice) % LAWS.len()];
    law(&case);
}

/// What a record is tried on.
pub struct Case<'a> {
    raw: &'a [u8],
    at: u64,
    sequence: SequenceParameters,
}

/// A record of clause 5 whose bytes stand by themselves.
trait Record: Sized + Debug + PartialEq + FixedRecord {
    const BYTES: usize;

    fn read(raw: &[u8], at: u64, profile: Profile, sequence: &SequenceParameters) -> Result<Self>;

    fn write(&self, sequence: &SequenceParameters) -> Result<Vec<u8>>;

    /// Makes checksums fit.
    fn seal(raw: &[u8]) -> Vec<u8> {
        raw.to_vec()
    }
}

fn law<R: Record>(case: &Case<'_>) {
    let Case { raw, at, ref sequence } = *case;
    let read = |raw: &[u8], profile| R::read(raw, at, profile, sequence);
    let Some(raw) = raw.get(..R::BYTES).map(R::seal) else {
        let error = read(raw, Profile::Dynamic).expect_err("a record that is cut is refused");
        assert!(error.at <= at + raw.len() as u64, "{error} is outside the record");
        return;
    };
    let made = R::take(&mut &raw[..]).expect("any bytes are a record, before its values are looked at");
    // Offsets of errors of a writer count from the record.
    let written = made.write(sequence).map_err(|error| Error { at: error.at + at, ..error });
    assert_eq!(read(&raw, Profile::Dynamic).map(|_| raw.clone()), written);
    for read in [Profile::Intra, Profile::Dynamic].into_iter().flat_map(|profile| read(&raw, profile)) {
        assert_eq!(read, made);
    }
}

macro_rules! records {
    ($($Record:ident(|$raw:pat_param, $at:pat_param, $profile:pat_param, $sequence:pat_param| $read:expr);)+) => {
        $(impl Record for $Record {
            const BYTES: usize = Self::SIZE;

            fn read($raw: &[u8], $at: u64, $profile: Profile, $sequence: &SequenceParameters) -> Result<Self> {
                $read
            }

            fn write(&self, _: &SequenceParameters) -> Result<Vec<u8>> {
                self.to_bytes()
            }
        })+
    };
}

records! {
    SequenceParameters(|raw, at, profile, _| Self::parse_payload(raw, at, profile));
    GopHeader(|raw, at, profile, _| Self::parse_payload(raw, at, profile));
    FrameHeader(|raw, at, _, _| Self::parse_payload(raw, at));
    CodebookHeader(|raw, at, _, _| Self::parse_payload(raw, at));
    IndexHeader(|raw, at, _, _| Self::parse_payload(raw, at));
    IndexEntry(|raw, at, _, _| Self::parse_payload(raw, at));
    EndOfStream(|raw, at, _, _| Self::parse_payload(raw, at));
    OperatingPointsHeader(|raw, at, _, _| Self::parse_payload(raw, at));
    OperatingPointEntry(|raw, at, _, _| Self::parse_payload(raw, at));
    WeightsHeader(|raw, at, _, _| Self::parse_payload(raw, at));
}

impl Record for FileHeader {
    const BYTES: usize = Self::SIZE;

    /// It stands at the start of the stream, whatever the case says.
    fn read(raw: &[u8], at: u64, _: Profile, _: &SequenceParameters) -> Result<Self> {
        let read = Self::parse(raw).map(|(record, _)| record);
        read.map_err(|error| Error { at: error.at + at, ..error })
    }

    fn write(&self, _: &SequenceParameters) -> Result<Vec<u8>> {
        self.to_bytes()
    }

    fn seal(raw: &[u8]) -> Vec<u8> {
        seal(raw.to_vec())
    }
}

impl Record for UnitHeader {
    const BYTES: usize = Self::SIZE;

    fn read(raw: &[u8], at: u64, _: Profile, _: &SequenceParameters) -> Result<Self> {
        Self::parse(raw, at).map(|(record, _)| record)
    }

    fn write(&self, _: &SequenceParameters) -> Result<Vec<u8>> {
        self.to_bytes()
    }

    /// As the first unit of a stream, of which only the header is there.
    fn seal(raw: &[u8]) -> Vec<u8> {
        seal([&[0; FileHeader::SIZE], raw].concat()).split_off(FileHeader::SIZE)
    }
}

/// What is accepted has one form.
fn writes_back<T>(case: &Case<'_>, read: Result<T>, write: impl FnOnce(&T) -> Result<Vec<u8>>) {
    if let Ok(read) = read {
        assert_eq!(write(&read).as_deref(), Ok(case.raw));
    }
}

/// A law of payloads that are read with limits, or without, and written by themselves.
macro_rules! payload {
    ($Payload:ident $(, $limits:expr)?) => {
        |case| writes_back(case, $Payload::parse(case.raw, case.at $(, $limits)?), $Payload::to_bytes)
    };
}

fn transform(case: &Case<'_>) {
    let read = Transform::parse(case.raw, case.at, &case.sequence);
    writes_back(case, read, |read| read.to_bytes(&case.sequence));
}

fn frame(case: &Case<'_>) {
    writes_back(case, FramePayload::parse(case.raw, case.at, &case.sequence, &LIMITS), |read| {
        let cells = read.cells.as_ref().map(|cells| CellsBytes {
            cell_count: cells.coded.count,
            cell_log2: cells.cell_log2,
            section: written(&cells.coded),
        });
        write_frame(&read.header, read.carried_digest, cells.as_ref(), &case.sequence)
    });
}

fn increment(case: &Case<'_>) {
    let read = Increment::parse(case.raw, case.at, &case.sequence, Profile::Dynamic, &LIMITS);
    writes_back(case, read, |read| {
        let sections: Vec<SectionBytes> = read.sections.iter().map(written).collect();
        write_increment(&read.header, &case.sequence, &sections)
    });
}

/// The parts of a section that was read.
fn written(section: &CodedSection<'_>) -> SectionBytes {
    SectionBytes {
        lanes_log2: section.lanes_log2,
        model: section.model.to_vec(),
        blocks: section.blocks.iter().map(|(block, _)| block.to_vec()).collect(),
    }
}

/// Models have several forms; the one that is written stands for the same models.
fn models(case: &Case<'_>) {
    let [dc_rank, coding, sh_rank, section @ ..] = case.raw else { return };
    let (dc_rank, sh_rank) = (dc_rank % 3 + 1, sh_rank % 45 + 1);
    let coding = match coding % 3 {
        0 => ShCoding::None,
        1 => ShCoding::Coefficients { rank: sh_rank },
        _ => ShCoding::VectorQuantised { stages: sh_rank % 4 + 1 },
    };
    let alphabets = Layout::new(dc_rank, coding).alphabets();
    let first = vec![None; alphabets.len()];
    let Ok(models) = read_models(section, 0, &alphabets, &first, &mut ()) else { return };
    let written = write_models(&models, &alphabets, None);
    let again = read_models(&written, 0, &alphabets, &first, &mut ()).expect("what is written can be read");
    assert_eq!(distributions(&again), distributions(&models));
    let reused = write_models(&models, &alphabets, Some(&models));
    let reusable: Vec<_> = models.iter().map(Some).collect();
    assert_eq!(read_models(&reused, 0, &alphabets, &reusable, &mut ()).as_ref(), Ok(&models));
}

/// What models say of tokens, in whatever form their tables are carried.
fn distributions(models: &[PlaneModel]) -> Vec<impl PartialEq + std::fmt::Debug + '_> {
    let tables = |model: &'_ PlaneModel| {
        model.tables.iter().map(|table| table.of_token().to_vec()).collect::<Vec<_>>()
    };
    models
        .iter()
        .map(|model| (model.bias, model.direct_log2, &model.axes, tables(model), &model.table_of_context))
        .collect()
}

/// A law and the name of its seeds.
pub type Law = (&'static str, fn(&Case<'_>));

/// By the first byte of the input.
pub const LAWS: [Law; 21] = [
    ("file-header", law::<FileHeader>),
    ("unit-header", law::<UnitHeader>),
    ("sequence-parameters", law::<SequenceParameters>),
    ("gop-header", law::<GopHeader>),
    ("frame-header", law::<FrameHeader>),
    ("codebook-header", law::<CodebookHeader>),
    ("index-header", law::<IndexHeader>),
    ("index-entry", law::<IndexEntry>),
    ("end", law::<EndOfStream>),
    ("operating-points-header", law::<OperatingPointsHeader>),
    ("operating-point", law::<OperatingPointEntry>),
    ("weights-header", law::<WeightsHeader>),
    ("scene-description", payload!(SceneDescription)),
    ("transform", transform),
    ("codebook", payload!(Codebook, &LIMITS)),
    ("weights", payload!(Weights)),
    ("frame", frame),
    ("increment", increment),
    ("index", payload!(Index)),
    ("operating-points", payload!(OperatingPoints)),
    ("models", models),
];
