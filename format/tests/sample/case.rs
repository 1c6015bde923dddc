//! A broken rule, and what is said about it.

use splatstream_format::Error;

/// What is broken, and what is said about it.
pub(crate) struct Case {
    pub(crate) unit: usize,
    pub(crate) edit: fn(&mut Vec<u8>),
    pub(crate) code: &'static str,
    pub(crate) clause: &'static str,
    /// Offset of the fault in the payload, in the unit header or in the file.
    pub(crate) fault: u64,
}

pub(crate) const fn case(
    unit: usize,
    edit: fn(&mut Vec<u8>),
    code: &'static str,
    clause: &'static str,
    fault: u64,
) -> Case {
    Case { unit, edit, code, clause, fault }
}

pub(crate) fn put(bytes: &mut [u8], at: usize, value: impl AsRef<[u8]>) {
    bytes[at..at + value.as_ref().len()].copy_from_slice(value.as_ref());
}

/// The class of a code, as the table of 9.2 has it.
fn class_of(code: &str) -> &'static str {
    match code {
        "TRUNCATED" => "truncated",
        "SIGNATURE" | "CHECKSUM" | "SHORT_SECTION" | "TRAILING_BYTES" | "NUMBER" | "PADDING" => "malformed",
        "RESERVED_BITS" | "RESERVED" => "unsupported",
        "OVER_LIMIT" => "over-limit",
        _ => "invalid",
    }
}

pub(crate) fn assert_refused(what: &str, error: Option<Error>, case: &Case, at: u64) {
    let Some(error) = error else { panic!("{what}: accepted, {} was expected", case.code) };
    let found = (error.class().name(), error.kind.code(), error.clause, error.at);
    assert_eq!(found, (class_of(case.code), case.code, case.clause, at), "{what}: {error}");
}
