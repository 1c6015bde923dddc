//! Clause 9: what is wrong with a stream, where, and which clause says so.

use core::fmt;

/// The result of reading or writing syntax.
pub type Result<T> = core::result::Result<T, Error>;

/// What a caller can do about an error (clause 9.1); the number is the exit code of the tools.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Class {
    /// The bytes do not parse: signature, checksum, length, entropy state.
    Malformed,
    /// The bytes parse, and break a constraint of the specification.
    Invalid,
    /// A reserved value or a feature of another profile or version.
    Unsupported,
    /// Above a limit that the caller or the level sets.
    OverLimit,
    /// The stream ends before its end unit.
    Truncated,
}

impl Class {
    /// Every class, in the order of the exit codes.
    pub const ALL: [Self; 5] =
        [Self::Malformed, Self::Invalid, Self::Unsupported, Self::OverLimit, Self::Truncated];

    /// The class that an exit code stands for.
    pub fn of_exit_code(code: i32) -> Option<Self> {
        Self::ALL.into_iter().find(|class| i32::from(class.exit_code()) == code)
    }

    /// The exit code of the tools, clause 9.1.
    pub const fn exit_code(self) -> u8 {
        match self {
            Self::Malformed => 10,
            Self::Invalid => 11,
            Self::Unsupported => 12,
            Self::OverLimit => 13,
            Self::Truncated => 14,
        }
    }

    /// The name used in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Malformed => "malformed",
            Self::Invalid => "invalid",
            Self::Unsupported => "unsupported",
            Self::OverLimit => "over-limit",
            Self::Truncated => "truncated",
        }
    }
}

/// One error: absolute byte offset, clause, cause. `Copy`, no strings made at run time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Error {
    /// Absolute offset in the stream of the first byte of the offending element.
    pub at: u64,
    /// The clause of the specification that is broken.
    pub clause: &'static str,
    /// The cause.
    pub kind: ErrorKind,
}

/// The causes; [`ErrorKind::code`] is stable, the wording is not.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum ErrorKind {
    /// The stream ends inside an element or before the end unit.
    Truncated {
        /// The syntax element that is cut.
        element: &'static str,
    },
    /// The eight signature bytes are wrong.
    Signature,
    /// A checksum does not fit the bytes it covers.
    Checksum {
        /// The syntax element holding the checksum.
        element: &'static str,
        /// The value in the stream.
        stored: u32,
        /// The value of the bytes.
        computed: u32,
    },
    /// A payload or section is shorter than the elements it must hold.
    ShortSection {
        /// The syntax element that does not fit.
        element: &'static str,
    },
    /// Bytes are left over where none may be.
    TrailingBytes {
        /// The structure that should have ended.
        element: &'static str,
        /// How many bytes are left.
        bytes: u64,
    },
    /// A number is not written in its shortest form, or is too long.
    Number {
        /// The syntax element.
        element: &'static str,
    },
    /// Padding bits that are not zero.
    Padding {
        /// The structure that is padded.
        element: &'static str,
    },
    /// The entropy decoder did not end in its initial state with all words used.
    EntropyFinalState,
    /// Bits or bytes that shall be zero in this version.
    ReservedBits {
        /// The syntax element.
        element: &'static str,
        /// Its value.
        value: u64,
    },
    /// A value kept for a later version or another profile.
    Reserved {
        /// The syntax element.
        element: &'static str,
        /// Its value.
        value: u64,
    },
    /// A value outside the range its semantics allow.
    OutOfRange {
        /// The syntax element.
        element: &'static str,
        /// Its value.
        value: i64,
        /// Smallest allowed value.
        min: i64,
        /// Largest allowed value.
        max: i64,
    },
    /// A value that contradicts another element.
    Mismatch {
        /// The syntax element.
        element: &'static str,
        /// Its value.
        value: u64,
        /// The value that the rest of the stream implies.
        expected: u64,
    },
    /// A constraint that has no single number: the element names it.
    Constraint {
        /// The rule in a few words.
        rule: &'static str,
    },
    /// A unit where it may not stand.
    UnexpectedUnit {
        /// The kind of unit.
        unit: &'static str,
    },
    /// An identifier that no unit before has defined.
    Undefined {
        /// The syntax element that refers.
        element: &'static str,
        /// The identifier.
        id: u64,
    },
    /// The reconstruction differs from the digest in the stream.
    Digest {
        /// The value in the stream.
        stored: u64,
        /// The value of the decoded planes.
        computed: u64,
    },
    /// More than the caller's [`Limits`](crate::Limits) allow.
    OverLimit {
        /// The name of the limit.
        limit: &'static str,
        /// What the stream asks for.
        asked: u64,
        /// What is allowed.
        allowed: u64,
    },
    /// What a decoder has computed contradicts itself: a defect of the decoder, and nothing that the stream does wrong. It has no
    /// row in clause 9, and its class is that of what this version cannot decode.
    Fault {
        /// What should always hold, in a few words.
        broken: &'static str,
    },
}

impl fmt::Display for ErrorKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Truncated { element } => write!(f, "the stream ends in {element}"),
            Self::Signature => f.write_str("not a SplatStream file: the signature is wrong"),
            Self::Checksum { element, stored, computed } => {
                write!(f, "{element} is {stored:#x}, the bytes it covers give {computed:#x}")
            }
            Self::ShortSection { element } => write!(f, "{element} does not fit in the bytes left for it"),
            Self::TrailingBytes { element, bytes } => write!(f, "{bytes} byte(s) after the end of {element}"),
            Self::Number { element } => write!(f, "{element} is not a well-formed number"),
            Self::Padding { element } => write!(f, "padding after {element} is not zero"),
            Self::EntropyFinalState => f.write_str("the entropy decoder does not end where the block ends"),
            Self::ReservedBits { element, value } => {
                write!(f, "reserved bits of {element} are set ({value:#x})")
            }
            Self::Reserved { element, value } => write!(f, "{element} has the reserved value {value}"),
            Self::OutOfRange { element, value, min, max } => {
                write!(f, "{element} is {value}, allowed are {min} to {max}")
            }
            Self::Mismatch { element, value, expected } => {
                write!(f, "{element} is {value}, {expected} follows from the elements before it")
            }
            Self::Constraint { rule } => write!(f, "constraint broken: {rule}"),
            Self::UnexpectedUnit { unit } => write!(f, "a {unit} unit may not stand here"),
            Self::Undefined { element, id } => write!(f, "{element} {id} has not been defined"),
            Self::Digest { stored, computed } => {
                write!(f, "reconstruction digest is {computed:#018x}, the stream says {stored:#018x}")
            }
            Self::OverLimit { limit, asked, allowed } => {
                write!(f, "the stream asks for {asked}, {limit} allows at most {allowed}")
            }
            Self::Fault { broken } => {
                write!(
                    f,
                    "a defect of the decoder, not of the stream: {broken} does not hold; please report this"
                )
            }
        }
    }
}

impl core::error::Error for ErrorKind {}

impl ErrorKind {
    /// The class a caller acts on (clause 9.1).
    pub const fn class(&self) -> Class {
        match self {
            Self::Truncated { .. } => Class::Truncated,
            Self::Signature
            | Self::Checksum { .. }
            | Self::ShortSection { .. }
            | Self::TrailingBytes { .. }
            | Self::Number { .. }
            | Self::Padding { .. }
            | Self::EntropyFinalState => Class::Malformed,
            Self::ReservedBits { .. } | Self::Reserved { .. } | Self::Fault { .. } => Class::Unsupported,
            Self::OutOfRange { .. }
            | Self::Mismatch { .. }
            | Self::Constraint { .. }
            | Self::UnexpectedUnit { .. }
            | Self::Undefined { .. }
            | Self::Digest { .. } => Class::Invalid,
            Self::OverLimit { .. } => Class::OverLimit,
        }
    }

    /// The stable code of the cause, as in the table of clause 9.2, which knows no defects of decoders.
    pub const fn code(&self) -> &'static str {
        match self {
            Self::Truncated { .. } => "TRUNCATED",
            Self::Signature => "SIGNATURE",
            Self::Checksum { .. } => "CHECKSUM",
            Self::ShortSection { .. } => "SHORT_SECTION",
            Self::TrailingBytes { .. } => "TRAILING_BYTES",
            Self::Number { .. } => "NUMBER",
            Self::Padding { .. } => "PADDING",
            Self::EntropyFinalState => "ENTROPY_FINAL_STATE",
            Self::ReservedBits { .. } => "RESERVED_BITS",
            Self::Reserved { .. } => "RESERVED",
            Self::OutOfRange { .. } => "OUT_OF_RANGE",
            Self::Mismatch { .. } => "MISMATCH",
            Self::Constraint { .. } => "CONSTRAINT",
            Self::UnexpectedUnit { .. } => "UNEXPECTED_UNIT",
            Self::Undefined { .. } => "UNDEFINED",
            Self::Digest { .. } => "DIGEST",
            Self::OverLimit { .. } => "OVER_LIMIT",
            Self::Fault { .. } => "FAULT",
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { at, clause, kind } = self;
        if self.is_fault() {
            return kind.fmt(f);
        }
        write!(f, "byte {at:#x}: {kind} (clause {clause})")
    }
}

impl core::error::Error for Error {}

impl Error {
    /// An error at an absolute byte offset.
    pub const fn new(at: u64, clause: &'static str, kind: ErrorKind) -> Self {
        Self { at, clause, kind }
    }

    /// A defect of the decoder: `broken` is what should always hold. It stands at no byte and breaks no clause.
    pub const fn fault(broken: &'static str) -> Self {
        Self::new(0, "", ErrorKind::Fault { broken })
    }

    /// Whether the decoder is at fault, and not the stream.
    pub const fn is_fault(&self) -> bool {
        matches!(self.kind, ErrorKind::Fault { .. })
    }

    /// The class a caller acts on.
    pub const fn class(&self) -> Class {
        self.kind.class()
    }
}
