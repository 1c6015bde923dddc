//! Values of elements: typed for programs, and in words for people.

use core::fmt::{self, Display};

/// A number as its type has it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Number {
    /// An unsigned integer.
    Unsigned(u64),
    /// A signed integer.
    Signed(i64),
    /// A float; it may be infinite or no number.
    Float(f32),
}

/// The value of an element. Displayed, it is what people read: a name in brackets after a code, lists in square brackets.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// One number.
    Number(Number),
    /// Numbers of an array.
    List(Vec<Number>),
    /// A code and what it stands for.
    Code {
        /// The code.
        number: u64,
        /// Its name in the specification.
        name: &'static str,
    },
    /// Flags of which some are set.
    Flags {
        /// All bits.
        number: u64,
        /// The flags that are set, from the lowest bit.
        names: Vec<&'static str>,
    },
    /// A checksum or a digest.
    Hexadecimal {
        /// The number.
        number: u64,
        /// Its bytes, 1 to 8.
        bytes: usize,
    },
    /// Numbers that people read in hexadecimal: a signature, states, words.
    Hexadecimals {
        /// The numbers.
        numbers: Vec<u64>,
        /// Bytes of each, 1 to 8.
        bytes: usize,
    },
    /// So many bytes that are not taken apart.
    Bytes(usize),
    /// Many numbers: how many, and between which two they lie.
    Spread {
        /// How many, 1 or more.
        count: usize,
        /// The smallest.
        least: i64,
        /// The largest.
        most: i64,
    },
    /// Text of the stream.
    Text(String),
    /// Words of the inspector.
    Words(String),
}

impl Value {
    /// A code and its name.
    pub(super) const fn code(number: u64, name: &'static str) -> Self {
        Self::Code { number, name }
    }

    /// How many values there are and between which two they lie.
    pub(super) fn spread<T: Ord + Copy + Into<i64>>(values: &[T]) -> Self {
        match (values.iter().min(), values.iter().max()) {
            (Some(&least), Some(&most)) => {
                Self::Spread { count: values.len(), least: least.into(), most: most.into() }
            }
            _ => Self::Words("no values".to_owned()),
        }
    }
}

impl Display for Number {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unsigned(number) => number.fmt(f),
            Self::Signed(number) => number.fmt(f),
            Self::Float(number) => number.fmt(f),
        }
    }
}

impl Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => number.fmt(f),
            Self::List(numbers) => list(f, numbers.iter()),
            Self::Code { number, name } => write!(f, "{number} ({name})"),
            Self::Flags { number, names } => write!(f, "{number} ({})", names.join(", ")),
            Self::Hexadecimal { number, bytes } => {
                write!(f, "{number:#0width$x}", width = bytes.saturating_mul(2).saturating_add(2))
            }
            Self::Hexadecimals { numbers, bytes: 1 } => {
                list(f, numbers.iter().map(|number| format!("{number:02X}")))
            }
            Self::Hexadecimals { numbers, bytes } => {
                let width = bytes.saturating_mul(2);
                list(f, numbers.iter().map(|number| format!("{number:0width$x}")))
            }
            Self::Bytes(count) => write!(f, "{count} bytes"),
            Self::Spread { count, least, most } => write!(f, "{count} values, {least} to {most}"),
            Self::Text(text) => write!(f, "{text:?}"),
            Self::Words(words) => f.write_str(words),
        }
    }
}

/// Parts in square brackets.
fn list(f: &mut fmt::Formatter<'_>, parts: impl Iterator<Item = impl Display>) -> fmt::Result {
    f.write_str("[")?;
    for (index, part) in parts.enumerate() {
        if index > 0 {
            f.write_str(", ")?;
        }
        part.fmt(f)?;
    }
    f.write_str("]")
}
