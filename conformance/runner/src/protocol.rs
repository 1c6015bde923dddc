//! What runner and decoder say to each other: exit codes, the last line of standard error, lines of a process that
//! answers many requests.

use crate::vector::Mode;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// The operating point of a decoder that is not told one: every unit of known type belongs to it (SS-OP-006).
pub const EVERYTHING: &str = "s3,t3,r9";

/// What a decoder may say about its verdict: the last line of its standard error, or the end of its answer.
/// What else the object holds is the decoder's own business.
#[derive(Debug, Clone, Default, PartialEq, Eq, Deserialize, Serialize)]
pub struct Diagnosis {
    /// Class of clause 9.1, in words.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub class: Option<String>,
    /// Code of clause 9.2.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub code: Option<String>,
    /// The broken clause.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub clause: Option<String>,
    /// Index of the unit at fault.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<u64>,
    /// Absolute offset of the fault.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub byte: Option<u64>,
}

impl Diagnosis {
    /// The diagnosis in the last line of a text, if that is one.
    pub fn in_last_line(text: &str) -> Option<Self> {
        serde_json::from_str(text.trim_end().lines().next_back()?.trim()).ok()
    }
}

/// One thing that a decoder is asked to do.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Request {
    /// The stream.
    pub input: PathBuf,
    /// An operating point as 7.11 writes it.
    pub op: String,
    /// What to show.
    pub mode: Mode,
    /// An empty folder for what is shown.
    pub out: PathBuf,
}

impl Request {
    /// The line that asks a persistent process.
    pub fn line(&self) -> String {
        format!("{}\t{}\t{}\t{}\n", self.input.display(), self.op, self.mode, self.out.display())
    }

    /// The request that a line asks; none if it is not one.
    pub fn parse(line: &str) -> Option<Self> {
        let mut parts = line.trim_end_matches(['\r', '\n']).split('\t');
        let (input, op, mode) = (parts.next()?, parts.next()?, parts.next()?.parse().ok()?);
        let out = parts.next().filter(|_| parts.next().is_none())?;
        let path = |text: &str| Path::new(text).to_path_buf();
        Some(Self { input: path(input), op: op.to_owned(), mode, out: path(out) })
    }
}

/// The answer of a persistent process: an exit code, and a diagnosis if it follows after a tab.
pub fn parse_answer(line: &str) -> Option<(i32, Option<Diagnosis>)> {
    let line = line.trim_end_matches(['\r', '\n']);
    let (code, rest) = line.split_once('\t').unwrap_or((line, ""));
    Some((code.trim().parse().ok()?, serde_json::from_str(rest).ok()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_request_reads_as_it_is_written() {
        let request = Request {
            input: "a b/in.gss".into(),
            op: EVERYTHING.to_owned(),
            mode: Mode::Subset,
            out: "a b/out".into(),
        };
        assert_eq!(Request::parse(&request.line()), Some(request));
        for wrong in ["", "in\ts0,t0,r0\tfull", "in\top\thalf\tout", "in\top\tfull\tout\tmore"] {
            assert_eq!(Request::parse(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn an_answer_is_a_code_and_perhaps_a_diagnosis() {
        let diagnosis = Diagnosis { code: Some("RANGE".into()), byte: Some(7), ..Diagnosis::default() };
        assert_eq!(parse_answer("11\t{\"code\":\"RANGE\",\"byte\":7}\n"), Some((11, Some(diagnosis))));
        assert_eq!(parse_answer("0\r\n"), Some((0, None)));
        assert_eq!(parse_answer("done\n"), None);
    }

    #[test]
    fn a_diagnosis_is_the_last_line_and_nothing_else() {
        let found = |text| Diagnosis::in_last_line(text).and_then(|diagnosis| diagnosis.code);
        assert_eq!(found("warning\n{\"code\":\"X\",\"mine\":1}\n").as_deref(), Some("X"));
        assert_eq!(found("{\"code\":\"X\"}\nbye\n"), None);
        assert_eq!(found(""), None);
    }
}
