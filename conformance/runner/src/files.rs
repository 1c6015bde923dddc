//! The files that a decoder wrote for a case, beside those that it should have written.

use crate::attribute::Attribute;
use crate::case::Case;
use crate::output::{Output, floats_name};
use crate::vector::State;

/// How the files of a case differ from those that it should have.
#[derive(Debug, Default)]
pub(crate) struct Files<'a> {
    /// Frames and attributes that were not written.
    pub(crate) missing: Vec<(&'a State, Attribute)>,
    /// Those with other bytes.
    pub(crate) wrong: Vec<(&'a State, Attribute)>,
    /// Names of files that should not be there.
    pub(crate) extra: Vec<String>,
}

impl<'a> Files<'a> {
    /// Compares the folder of a case with its vector. If the vector does not say what is shown, only names are checked.
    pub(crate) fn compare(case: &Case<'a>, output: &Output) -> Self {
        let mut files = Self { extra: output.extra.clone(), ..Self::default() };
        let Some(states) = case.states() else { return files };
        for state in &states {
            for (&attribute, wanted) in &state.planes {
                match output.planes.get(&(state.frame, attribute)) {
                    None => files.missing.push((state, attribute)),
                    Some(found) if found.sha256 != *wanted => files.wrong.push((state, attribute)),
                    Some(_) => {}
                }
            }
        }
        let is_expected = |frame: u32, attribute| {
            states.iter().any(|state| state.frame == frame && state.planes.contains_key(&attribute))
        };
        let unexpected = output.planes.keys().filter(|&&(frame, attribute)| !is_expected(frame, attribute));
        let floats = output.floats.keys().filter(|&&frame| !states.iter().any(|state| state.frame == frame));
        files.extra.extend(floats.map(|&frame| floats_name(frame)));
        files.extra.extend(unexpected.map(|&(frame, attribute)| attribute.file_name(frame)));
        files
    }
}
