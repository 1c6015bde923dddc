//! The fixed records: what is read is written, what is written is read, and both refuse the same for the same reason.

use crate::seal::seal;
use arbitrary::Unstructured;
use core::fmt::Debug;
use deku::DekuContainerRead;
use splatstream_format::arbitrary_stream::sequence_parameters;
use splatstream_format::syntax::{
    CodebookHeader, EndOfStream, FileHeader, FrameHeader, GopHeader, IncrementHeader, IndexEntry,
    IndexHeader, OperatingPointEntry, OperatingPointsHeader, Profile, SequenceParameters, UnitHeader,
    WeightsHeader,
};
use splatstream_format::{Error, Result};

/// Bytes that sequence parameters are made of, for records that need some.
pub const SEQUENCE: usize = 96;

/// The first byte of the input chooses the record, four say at which offset it stands; what sequence parameters are
/// made of and the bytes of the record follow.
pub fn run(data: &[u8]) {
    let Some((&[choice, ref at @ ..], data)) = data.split_first_chunk::<5>() else { return };
    let (head, raw) = data.split_at_checked(SEQUENCE).unwrap_or((data, &[]));
    let Ok(sequence) = sequence_parameters(&mut Unstructured::new(head)) else { return };
    let case = Case { raw, at: u32::from_le_bytes(*at).into(), sequence };
    LAWS[usize::from(choice) % LAWS.len()](&case);
}

/// What a record is tried on.
struct Case<'a> {
    raw: &'a [u8],
    at: u64,
    sequence: SequenceParameters,
}

/// A record of clause 5 whose bytes stand by themselves.
trait Record: Sized + Debug + PartialEq + for<'a> DekuContainerRead<'a> {
    const BYTES: usize;

    fn read(raw: &[u8], at: u64, profile: Profile, sequence: &SequenceParameters) -> Result<Self>;

    fn write(&self, sequence: &SequenceParameters) -> Result<Vec<u8>>;

    /// Makes check sums fit.
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
    let (_, made) =
        R::from_bytes((&raw, 0)).expect("any bytes are a record, before its values are looked at");
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
    FrameHeader(|raw, at, profile, _| Self::parse_payload(raw, at, profile));
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

    fn read(raw: &[u8], at: u64, profile: Profile, _: &SequenceParameters) -> Result<Self> {
        Self::parse(raw, at, profile).map(|(record, _)| record)
    }

    fn write(&self, _: &SequenceParameters) -> Result<Vec<u8>> {
        self.to_bytes()
    }

    /// As the first unit of a stream, of which only the header is there.
    fn seal(raw: &[u8]) -> Vec<u8> {
        seal([&[0; FileHeader::SIZE], raw].concat()).split_off(FileHeader::SIZE)
    }
}

impl Record for IncrementHeader {
    const BYTES: usize = Self::SIZE;

    fn read(raw: &[u8], at: u64, _: Profile, sequence: &SequenceParameters) -> Result<Self> {
        Self::parse(raw, at, sequence).map(|(record, _)| record)
    }

    fn write(&self, sequence: &SequenceParameters) -> Result<Vec<u8>> {
        self.to_bytes(sequence)
    }
}

/// By the first byte of the input. Records that are missing here stand in payloads only, and come back there.
const LAWS: [fn(&Case<'_>); 13] = [
    law::<FileHeader>,
    law::<UnitHeader>,
    law::<SequenceParameters>,
    law::<GopHeader>,
    law::<FrameHeader>,
    law::<CodebookHeader>,
    law::<IndexHeader>,
    law::<IndexEntry>,
    law::<EndOfStream>,
    law::<OperatingPointsHeader>,
    law::<OperatingPointEntry>,
    law::<WeightsHeader>,
    law::<IncrementHeader>,
];
