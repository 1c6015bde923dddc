//! The units of a stream that was made for fuzzing, to be compared with what they were made of.

use splatstream_format::Limits;
use splatstream_format::payload::Transform;
use splatstream_format::syntax::{Profile, SequenceParameters, UnitType};
use splatstream_format::unit::{Stream, Unit, Units};

/// The units not yet compared. What differs is a panic.
pub(crate) struct ReadBack<'a> {
    units: Units<'a>,
}

impl<'a> ReadBack<'a> {
    /// The units behind the sequence parameters.
    pub(crate) fn start(
        bytes: &'a [u8],
        limits: &Limits,
        (profile, level): (Profile, u8),
        made: &SequenceParameters,
    ) -> Self {
        let stream = Stream::open(bytes, limits).expect("it starts with a file header");
        assert_eq!((stream.header().profile(), stream.header().level), (profile, level));
        let mut units = Self { units: stream.units() };
        let unit = units.next(UnitType::SequenceParameters);
        let read = SequenceParameters::parse_payload(unit.payload, unit.payload_at, profile);
        assert_eq!(read.as_ref(), Ok(made));
        units
    }

    /// The next unit, which is of the type expected.
    pub(crate) fn next(&mut self, expected: UnitType) -> Unit<'a> {
        let unit = self.units.next().expect("there are more units").expect("units lie back to back");
        assert_eq!(unit.header.unit_type(), expected);
        unit
    }

    /// The next units are transforms.
    pub(crate) fn transforms(&mut self, made: &[Transform], sequence: &SequenceParameters) {
        for transform in made {
            let unit = self.next(UnitType::Transform);
            assert_eq!(Transform::parse(unit.payload, unit.payload_at, sequence).as_ref(), Ok(transform));
        }
    }

    /// Nothing but the end is left.
    pub(crate) fn end(mut self) {
        self.next(UnitType::End);
        assert_eq!(self.units.next(), None);
    }
}
