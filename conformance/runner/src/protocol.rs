//! The protocol between runner and decoder: requests, exit codes, the last line of standard error, and the lines of a
//! process that answers many requests.

use crate::vector::Mode;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// The highest operating point: every unit belongs to it.
pub const EVERYTHING: &str = "s3,t3,r9";

/// What a decoder may report besides its verdict: the last line of its standard error, or the end of its answer. Other
/// keys of the object are ignored.
#[derive(Debug, Clone, Default, PartialEq, Eq, Deserialize, Serialize)]
pub struct Diagnosis {
    /// Class of clause 9.1, in words.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub class: Option<String>,
    /// Code of clause 9.2.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub code: Option<String>,
    /// The violated clause.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub clause: Option<String>,
    /// Index of the unit with the error.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<u64>,
    /// Absolute offset of the error.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub byte: Option<u64>,
    /// Display indices of lost frames that are not output, as ranges with both ends included.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lost: Option<Vec<[u32; 2]>>,
}

/// What a decoder reports besides its verdict.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub enum Said {
    /// Nothing.
    #[default]
    Nothing,
    /// A JSON object that can be understood.
    Diagnosis(Diagnosis),
    /// Something else: what is wrong with it.
    Unclear(String),
}

impl Said {
    /// What the last line of a text says.
    pub fn in_last_line(text: &str) -> Self {
        let line = text.trim_end().lines().next_back().unwrap_or_default();
        Self::of("the last line on standard error", line)
    }

    fn of(source: &str, text: &str) -> Self {
        let text = text.trim();
        if text.is_empty() {
            return Self::Nothing;
        }
        // An array would be taken for an object whose keys are left out.
        let is_object = text.starts_with('{');
        match serde_json::from_str(text) {
            Ok(diagnosis) if is_object => Self::Diagnosis(diagnosis),
            Err(error) if is_object => Self::Unclear(format!("{source}, {}: {error}", quoted(text))),
            _ => Self::Unclear(format!("{source} is not a JSON object: {}", quoted(text))),
        }
    }
}

/// A text in quotes, shortened.
fn quoted(text: &str) -> String {
    const MAX: usize = 80;
    let start: String = text.chars().take(MAX).collect();
    let rest = if text.chars().nth(MAX).is_some() { "..." } else { "" };
    format!("{start:?}{rest}")
}

/// One request to a decoder.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Request {
    /// The stream.
    pub input: PathBuf,
    /// An operating point as 7.2 writes it.
    pub op: String,
    /// The mode.
    pub mode: Mode,
    /// An empty folder for the output.
    pub out: PathBuf,
}

impl Request {
    /// The line that a persistent process reads.
    pub fn line(&self) -> String {
        format!("{}\t{}\t{}\t{}\n", self.input.display(), self.op, self.mode, self.out.display())
    }

    /// The request in a line; none if it is not one.
    pub fn parse(line: &str) -> Option<Self> {
        let mut parts = line.trim_end_matches(['\r', '\n']).split('\t');
        let (input, op, mode) = (parts.next()?, parts.next()?, parts.next()?.parse().ok()?);
        let out = parts.next().filter(|_| parts.next().is_none())?;
        let path = |text: &str| Path::new(text).to_path_buf();
        Some(Self { input: path(input), op: op.to_owned(), mode, out: path(out) })
    }
}

/// The answer of a persistent process: an exit code, and a diagnosis if one follows after a tab.
///
/// # Errors
/// Why the line is not an answer.
pub fn parse_answer(line: &str) -> Result<(i32, Said), String> {
    let line = line.trim_end_matches(['\r', '\n']);
    let (code, rest) = line.split_once('\t').unwrap_or((line, ""));
    let code = code.trim().parse().map_err(|_| {
        let first = line.split_whitespace().next().unwrap_or_default();
        match first.parse::<i32>() {
            Ok(_) => format!("the answer {} has no tab after the exit code", quoted(line)),
            Err(_) => {
                let advice = "standard output is for answers only";
                format!("the answer {} does not start with an exit code; {advice}", quoted(line))
            }
        }
    })?;
    Ok((code, Said::of("what follows the tab of the answer", rest)))
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
        let said = Said::Diagnosis(diagnosis);
        assert_eq!(parse_answer("11\t{\"code\":\"RANGE\",\"byte\":7}\n"), Ok((11, said)));
        assert_eq!(parse_answer("0\r\n"), Ok((0, Said::Nothing)));
        assert!(matches!(parse_answer("11\tbroken"), Ok((11, Said::Unclear(_)))));
        assert!(parse_answer("11 {}\n").unwrap_err().ends_with("has no tab after the exit code"));
        let error = parse_answer("decoding in.gss\n").unwrap_err();
        assert!(
            error.starts_with("the answer \"decoding in.gss\" does not start with an exit code"),
            "{error}"
        );
    }

    #[test]
    fn a_diagnosis_is_the_last_line_and_nothing_else() {
        let code = |text| match Said::in_last_line(text) {
            Said::Diagnosis(diagnosis) => diagnosis.code.unwrap_or_default(),
            Said::Unclear(why) => why,
            Said::Nothing => "nothing".to_owned(),
        };
        assert_eq!(code("warning\n{\"code\":\"X\",\"mine\":1}\n"), "X");
        assert_eq!(code(""), "nothing");
        for (text, why) in [
            ("{\"code\":\"X\"}\nbye\n", "is not a JSON object: \"bye\""),
            ("[\"invalid\",\"X\",null,null,null]", "is not a JSON object"),
            ("{\"code\":5}", "invalid type"),
        ] {
            assert!(code(text).contains(why), "{}", code(text));
        }
    }
}
