//! The command of a decoder under test. It is split as a shell splits it, and no shell runs.

use crate::error::{Error, Result};
use crate::protocol::Request;
use std::path::Path;
use std::process::Command;

/// A command with places for what is asked: `{in}`, `{op}`, `{mode}`, `{out}`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Template {
    words: Vec<String>,
}

impl Template {
    /// A command that is run for each case.
    ///
    /// # Errors
    /// A quote is left open, or `{in}` or `{out}` has no place.
    pub fn parse(text: &str) -> Result<Self> {
        let words = split(text)?;
        for place in ["{in}", "{out}"] {
            if !words.iter().any(|word| word.contains(place)) {
                let message = format!(
                    "the command has no {place}; write --decoder 'CMD {{in}} {{op}} {{mode}} {{out}}'"
                );
                return Err(Error::Usage(message));
            }
        }
        Ok(Self { words })
    }

    /// The words of the command for a request.
    pub fn words(&self, request: &Request) -> Vec<String> {
        let path = |path: &Path| path.display().to_string();
        let fill = |word: &String| {
            word.replace("{op}", &request.op)
                .replace("{mode}", request.mode.name())
                .replace("{in}", &path(&request.input))
                .replace("{out}", &path(&request.out))
        };
        self.words.iter().map(fill).collect()
    }

    /// The program.
    pub fn program(&self) -> &str {
        self.words.first().map_or("", String::as_str)
    }
}

/// The words of a command.
///
/// # Errors
/// A quote is left open, or there is no word.
pub fn split(text: &str) -> Result<Vec<String>> {
    let words = shlex::split(text).filter(|words| !words.is_empty());
    words.ok_or_else(|| {
        Error::Usage(format!("'{text}' is not a command: it is empty or a quote is left open"))
    })
}

/// A command made of words.
pub(crate) fn of(words: &[String]) -> Command {
    let (program, arguments) =
        words.split_first().map_or(("", [].as_slice()), |(first, rest)| (first.as_str(), rest));
    let mut command = Command::new(program);
    command.args(arguments);
    command
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vector::Mode;

    #[test]
    fn places_are_filled_inside_words_and_quotes_hold_words_together() {
        let template = Template::parse("'my decoder' --in={in} --show \"{mode} {op}\" {out}").unwrap();
        let request = Request {
            input: "a b.gss".into(),
            op: "s0,t0,r1".to_owned(),
            mode: Mode::Subset,
            out: "out".into(),
        };
        let words = ["my decoder", "--in=a b.gss", "--show", "subset s0,t0,r1", "out"];
        assert_eq!(template.words(&request), words);
    }

    #[test]
    fn a_command_without_places_or_with_an_open_quote_is_refused() {
        for wrong in ["", "decoder {in}", "decoder {out}", "'decoder {in} {out}"] {
            assert!(Template::parse(wrong).is_err(), "{wrong}");
        }
    }
}
