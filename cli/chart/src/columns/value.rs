//! Values of cells, with their units, as programs and as people read them.

use crate::numbers::{fixed, grouped};
use serde::{Serialize, Serializer};

/// Decimals of numbers in files.
const DECIMALS: usize = 6;

/// A value.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Value {
    /// Words.
    Words(String),
    /// A number of things.
    Count(u64),
    /// A share, percent.
    Percent(u8),
    /// Bytes.
    Bytes(u64),
    /// Gaussians per second.
    Speed(f64),
    /// A number, the decimals that people see, and its unit if cells have it.
    Number(f64, usize, &'static str),
    /// A difference and its unit: people see its sign.
    Difference(f64, &'static str),
    /// A number in as few letters as it takes.
    Short(f64),
    /// Nothing to say, or nothing was measured.
    None,
}

impl Value {
    /// Words; nothing if there are none.
    pub(crate) fn words(words: impl Into<String>) -> Self {
        Self::Words(words.into())
    }

    /// Of a number without a unit, if there is one.
    pub(crate) fn number(value: impl Into<Option<f64>>, decimals: usize) -> Self {
        value.into().map_or(Self::None, |value| Self::Number(value, decimals, ""))
    }

    /// Of a speed, if there is one.
    pub(crate) fn speed(value: impl Into<Option<f64>>) -> Self {
        value.into().map_or(Self::None, Self::Speed)
    }

    /// Of a difference, if there is one.
    pub(crate) fn difference(value: impl Into<Option<f64>>, unit: &'static str) -> Self {
        value.into().map_or(Self::None, |value| Self::Difference(value, unit))
    }

    /// For files: without units and groups of digits.
    pub(super) fn exact(&self) -> String {
        match self {
            Self::Words(words) => words.clone(),
            Self::Count(count) | Self::Bytes(count) => count.to_string(),
            Self::Percent(percent) => percent.to_string(),
            Self::Speed(value) | Self::Number(value, ..) | Self::Difference(value, _)
                if value.is_finite() =>
            {
                fixed(*value, DECIMALS)
            }
            Self::Short(value) => short(*value),
            Self::Speed(_) | Self::Number(..) | Self::Difference(..) | Self::None => String::new(),
        }
    }

    /// For people.
    pub(super) fn readable(&self) -> String {
        match self {
            Self::Words(words) if words.is_empty() => "-".to_owned(),
            Self::Words(words) => words.clone(),
            Self::Count(count) => grouped(*count),
            Self::Percent(percent) => format!("{percent} %"),
            Self::Bytes(bytes) => size(*bytes),
            Self::Speed(value) => speed(*value),
            Self::Number(value, decimals, unit) => fixed(*value, *decimals) + unit,
            Self::Difference(value, unit) => signed(*value) + unit,
            Self::Short(value) => short(*value),
            Self::None => "-".to_owned(),
        }
    }

    /// Whether there is something to say.
    pub(super) fn is_there(&self) -> bool {
        !matches!(self, Self::None)
    }

    /// Whether it is no number.
    pub(super) fn is_words(&self) -> bool {
        matches!(self, Self::Words(_))
    }
}

/// As JSON has it: numbers with all their digits.
impl Serialize for Value {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Words(words) => serializer.serialize_str(words),
            Self::Count(count) | Self::Bytes(count) => serializer.serialize_u64(*count),
            Self::Percent(percent) => serializer.serialize_u8(*percent),
            Self::Speed(value)
            | Self::Number(value, ..)
            | Self::Difference(value, _)
            | Self::Short(value) => serializer.serialize_f64(*value),
            Self::None => serializer.serialize_none(),
        }
    }
}

/// Bytes in kB or MB.
fn size(bytes: u64) -> String {
    match bytes {
        0..1_000 => format!("{bytes} B"),
        1_000..1_000_000 => format!("{:.1} kB", bytes as f64 / 1e3),
        _ => format!("{:.2} MB", bytes as f64 / 1e6),
    }
}

/// Gaussians per second.
fn speed(speed: f64) -> String {
    match speed {
        0.0..1e4 => format!("{:.1} k/s", speed / 1e3),
        1e4..1e6 => format!("{:.0} k/s", speed / 1e3),
        _ => format!("{:.2} M/s", speed / 1e6),
    }
}

/// A number with its sign; nothing has none.
fn signed(value: f64) -> String {
    let text = fixed(value, 2);
    if value > 0.0 && text != "0.00" { format!("+{text}") } else { text }
}

/// A number in few letters.
pub(crate) fn short(value: f64) -> String {
    if value == 0.0 || (1e-3..1e5).contains(&value) { format!("{value}") } else { format!("{value:e}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_has_no_sign() {
        let differences = [-0.001, -1.5, 2.0].map(|value| Value::Difference(value, " dB").readable());
        assert_eq!(differences, ["0.00 dB", "-1.50 dB", "+2.00 dB"]);
        assert_eq!(Value::number(-0.0, 3).readable(), "0.000");
        assert_eq!(Value::number(-1e-9, 3).exact(), "0.000000");
    }

    #[test]
    fn sizes_and_speeds_have_three_digits_or_so() {
        assert_eq!([999, 1500, 2_340_000].map(size), ["999 B", "1.5 kB", "2.34 MB"]);
        assert_eq!([650.0, 21_700.0, 3.0e6].map(speed), ["0.7 k/s", "22 k/s", "3.00 M/s"]);
    }

    #[test]
    fn short_numbers_are_short() {
        let numbers = [0.0, 0.001, 0.03, 100.0, 1e10, 1e-6].map(short);
        assert_eq!(numbers, ["0", "0.001", "0.03", "100", "1e10", "1e-6"]);
    }

    #[test]
    fn what_was_not_measured_is_empty_in_files_and_null_in_json() {
        let missing = Value::number(None, 2);
        assert_eq!((missing.exact(), missing.readable()), (String::new(), "-".to_owned()));
        assert_eq!(serde_json::to_string(&missing).unwrap(), "null");
        assert_eq!(Value::number(f64::INFINITY, 2).exact(), "");
    }
}
