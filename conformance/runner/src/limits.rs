//! How many resources a decoder under test may use.

use crate::answer::Ending;
use serde::{Deserialize, Deserializer, Serialize};
use std::fmt;
use std::str::FromStr;
use std::time::Duration;

/// Limits of one case.
///
/// Memory is the resident memory of all processes of the decoder, and output is what it has written, standard error
/// included; both are checked every few milliseconds. On Linux the kernel stops what grows faster: data segments of twice
/// the memory, and files as large as the output.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Limits {
    /// Wall time, milliseconds.
    #[serde(rename = "time_ms", serialize_with = "milliseconds", deserialize_with = "from_milliseconds")]
    pub time: Duration,
    /// Resident memory, bytes.
    #[serde(rename = "memory_bytes")]
    pub memory: u64,
    /// Files and standard error, bytes.
    #[serde(rename = "output_bytes")]
    pub output: u64,
}

impl Default for Limits {
    fn default() -> Self {
        Self { time: Duration::from_secs(10), memory: 2 << 30, output: 256 << 20 }
    }
}

impl Limits {
    /// Which limit a decoder has exceeded that ended so, and how to raise it.
    pub(crate) fn exceeded(&self, ending: Ending) -> Option<String> {
        match ending {
            Ending::TimedOut => {
                Some(format!("no answer within {} s; --time SECONDS allows more", self.time.as_secs_f64()))
            }
            Ending::TooMuchMemory => {
                Some(format!("it used more than {}; --memory SIZE allows more", Size(self.memory)))
            }
            Ending::TooMuchOutput => {
                Some(format!("it wrote more than {}; --output SIZE allows more", Size(self.output)))
            }
            _ => None,
        }
    }
}

fn milliseconds<S: serde::Serializer>(time: &Duration, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_u64(u64::try_from(time.as_millis()).unwrap_or(u64::MAX))
}

fn from_milliseconds<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Duration, D::Error> {
    u64::deserialize(deserializer).map(Duration::from_millis)
}

/// A number of bytes as people write it: `512M`, `2G`, `65536`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Size(pub u64);

impl FromStr for Size {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (digits, shift) = match text.strip_suffix(['K', 'M', 'G']) {
            Some(digits) if text.ends_with('K') => (digits, 10),
            Some(digits) if text.ends_with('M') => (digits, 20),
            Some(digits) => (digits, 30),
            None => (text, 0),
        };
        let number = digits.parse::<u64>().ok().filter(|&number| number > 0);
        let bytes = number.and_then(|number| number.checked_mul(1 << shift));
        bytes.map(Self).ok_or_else(|| format!("'{text}' is not a size; write 512M or 2G"))
    }
}

impl fmt::Display for Size {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            bytes if bytes % (1 << 30) == 0 => write!(f, "{}G", bytes >> 30),
            bytes if bytes % (1 << 20) == 0 => write!(f, "{}M", bytes >> 20),
            bytes if bytes % (1 << 10) == 0 => write!(f, "{}K", bytes >> 10),
            bytes => write!(f, "{bytes}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_size_reads_as_it_is_written() {
        for text in ["1", "3K", "512M", "2G"] {
            assert_eq!(text.parse::<Size>().unwrap().to_string(), text);
        }
        for wrong in ["", "G", "0", "-1M", "2T", "99999999999G"] {
            assert!(wrong.parse::<Size>().is_err(), "{wrong}");
        }
    }
}
