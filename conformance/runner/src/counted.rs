//! Numbers with their nouns.

/// A number with its noun: 1 case, 1338 vectors. Thousands are not set apart, as in the numbers of a report; the tables of the command,
/// which this crate does not depend on, set them apart.
pub fn counted(number: usize, what: &str) -> String {
    format!("{number} {what}{}", if number == 1 { "" } else { "s" })
}
