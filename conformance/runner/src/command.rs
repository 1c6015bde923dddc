//! The command of a decoder under test. It is split as a shell splits it, but no shell runs.

use crate::capabilities::{Capabilities, Points};
use crate::error::{Error, Result};
use crate::protocol::Request;
use crate::vector::Mode;
use std::io::{self, ErrorKind};
use std::path::Path;
use std::process::Command;

/// The placeholders of a command.
const PLACEHOLDERS: [&str; 4] = ["{in}", "{op}", "{mode}", "{out}"];

/// A command with the placeholders `{in}`, `{op}`, `{mode}`, `{out}`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Template {
    words: Vec<String>,
}

impl Template {
    /// A command that is run for each case.
    ///
    /// # Errors
    /// A quote is left open, `{in}` or `{out}` is missing, or something else is in braces.
    pub fn parse(text: &str) -> Result<Self> {
        let words = split(text)?;
        if let Some(name) =
            words.iter().flat_map(|word| names_in_braces(word)).find(|name| !is_placeholder(name))
        {
            let message = format!("'{{{name}}}' is not a placeholder; there are {}", PLACEHOLDERS.join(" "));
            return Err(Error::Usage(message));
        }
        let template = Self { words };
        for placeholder in ["{in}", "{out}"] {
            if !template.has(placeholder) {
                let message = format!(
                    "the command has no {placeholder}; write --decoder 'CMD {{in}} {{op}} {{mode}} {{out}}'"
                );
                return Err(Error::Usage(message));
            }
        }
        Ok(template)
    }

    /// Whether the decoder gets all parts of the requests that its claim permits.
    ///
    /// # Errors
    /// `{op}` or `{mode}` is missing, and the claim is not limited to one point or mode.
    pub fn check_claim(&self, claim: &Capabilities) -> Result<()> {
        let lacks = [
            ("{op}", "operating point", "\"points\": \"full\"", claim.points == Points::Full),
            ("{mode}", "mode", "\"modes\": [\"full\"]", claim.modes == [Mode::Full]),
        ];
        for (placeholder, what, narrow, is_narrow) in lacks {
            if !self.has(placeholder) && !is_narrow {
                let message = format!(
                    "the command has no {placeholder}, so the decoder does not get the {what}\n  \
                    add {placeholder}, or claim only {narrow} in a file for --capabilities"
                );
                return Err(Error::Usage(message));
            }
        }
        Ok(())
    }

    fn has(&self, placeholder: &str) -> bool {
        self.words.iter().any(|word| word.contains(placeholder))
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

    /// The words with their placeholders.
    pub fn raw_words(&self) -> &[String] {
        &self.words
    }
}

fn is_placeholder(name: &str) -> bool {
    PLACEHOLDERS.iter().any(|placeholder| {
        placeholder.strip_prefix('{').and_then(|placeholder| placeholder.strip_suffix('}')) == Some(name)
    })
}

/// Names in braces in a text. `${NAME}` belongs to a shell.
fn names_in_braces(text: &str) -> impl Iterator<Item = &str> {
    let is_name =
        |name: &&str| name.starts_with(char::is_alphabetic) && !name.contains(|c: char| !c.is_alphanumeric());
    let named = move |(at, _): (usize, &str)| {
        let (before, brace) = text.split_at(at);
        let (name, _) = brace.strip_prefix('{')?.split_once('}')?;
        Some(name).filter(is_name).filter(|_| !before.ends_with('$'))
    };
    text.match_indices('{').filter_map(named)
}

/// The words of a command.
///
/// # Errors
/// A quote is left open, or there are no words.
pub fn split(text: &str) -> Result<Vec<String>> {
    let words = shlex::split(text).filter(|words| !words.is_empty());
    words.ok_or_else(|| {
        Error::Usage(format!("'{text}' is not a command: it is empty or a quote is left open"))
    })
}

/// The words of the command of a process that answers many requests.
///
/// # Errors
/// As [`split`]; or there are placeholders.
pub fn split_persistent(text: &str) -> Result<Vec<String>> {
    let words = split(text)?;
    if let Some(placeholder) =
        PLACEHOLDERS.into_iter().find(|placeholder| words.iter().any(|word| word.contains(placeholder)))
    {
        let message =
            format!("--stdio takes no {placeholder}: requests come on standard input; --decoder takes it");
        return Err(Error::Usage(message));
    }
    Ok(words)
}

/// A word that only a shell understands, if there is one and the command is not a shell's.
pub fn shell_word(words: &[String]) -> Option<&str> {
    const OPERATORS: [&str; 10] = ["|", "||", "&", "&&", ";", "<", ">", ">>", "2>", "2>&1"];
    if words.get(1).is_some_and(|word| word == "-c") {
        return None;
    }
    let first = words.first().filter(|word| *word == "cd" || word.contains('='));
    let operator = words.iter().find(|word| OPERATORS.contains(&word.as_str()) || word.ends_with(';'));
    first.or(operator).map(String::as_str)
}

/// A command made of words.
pub(crate) fn of(words: &[String]) -> Command {
    let (program, arguments) =
        words.split_first().map_or(("", [].as_slice()), |(first, rest)| (first.as_str(), rest));
    let mut command = Command::new(program);
    command.args(arguments);
    command
}

/// Why a command does not start, and what to do.
pub(crate) fn cannot_start(words: &[String], source: &io::Error) -> Error {
    /// The error for a file that is not a program of this machine.
    const ENOEXEC: i32 = 8;
    let program = words.first().cloned().unwrap_or_default();
    let path = Path::new(&program);
    let why = if let Some(word) = shell_word(words) {
        format!("'{word}' is for a shell, but no shell runs; use sh -c '...'")
    } else if path.is_dir() {
        "it is a folder\n  give the program in it".to_owned()
    } else if source.kind() == ErrorKind::NotFound && path.is_file() {
        "the interpreter in its first line does not exist".to_owned()
    } else if source.kind() == ErrorKind::NotFound {
        "there is no such program\n  check the path; a name without / is looked for in PATH".to_owned()
    } else if source.kind() == ErrorKind::PermissionDenied {
        format!("it is not executable\n  chmod +x {program}")
    } else if source.raw_os_error() == Some(ENOEXEC) {
        "it is neither a program for this machine nor a script\n  a script starts with #! and its interpreter, as in \
            #!/usr/bin/env python3"
            .to_owned()
    } else {
        format!("{source}\n  check the path and that it can be executed")
    };
    Error::Start { program, why }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn placeholders_are_filled_inside_words_and_quotes_keep_words_together() {
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
    fn a_command_without_placeholders_or_with_an_open_quote_is_refused() {
        for wrong in ["", "decoder {in}", "decoder {out}", "'decoder {in} {out}"] {
            assert!(Template::parse(wrong).is_err(), "{wrong}");
        }
        let error = Template::parse("decoder {in} {mod} {out}").unwrap_err().to_string();
        assert_eq!(error, "'{mod}' is not a placeholder; there are {in} {op} {mode} {out}");
        assert!(Template::parse("sh -c 'echo ${HOME} {} {\"a\":1}' {in} {out}").is_ok());
        assert!(split_persistent("decoder {in}").is_err());
    }

    #[test]
    fn a_decoder_that_does_not_get_point_or_mode_claims_one_of_them() {
        let narrow = |points, modes: &[Mode]| Capabilities {
            points,
            modes: modes.to_vec(),
            ..Capabilities::everything("mine")
        };
        let check =
            |command: &str, claim: &Capabilities| Template::parse(command).unwrap().check_claim(claim);
        let all = narrow(Points::All, &[Mode::Full, Mode::Subset]);
        assert!(check("decoder {in} {op} {mode} {out}", &all).is_ok());
        assert!(
            check("decoder {in} {mode} {out}", &all)
                .unwrap_err()
                .to_string()
                .contains("\"points\": \"full\"")
        );
        assert!(
            check("decoder {in} {op} {out}", &all).unwrap_err().to_string().contains("\"modes\": [\"full\"]")
        );
        assert!(check("decoder {in} {out}", &narrow(Points::Full, &[Mode::Full])).is_ok());
    }

    #[test]
    fn a_command_that_does_not_start_is_explained() {
        let folder = tempfile::tempdir().unwrap();
        let script = folder.path().join("script");
        std::fs::write(&script, "exit 0\n").unwrap();
        let why = |words: &[&str], kind: ErrorKind| {
            let words: Vec<String> = words.iter().map(|&word| word.to_owned()).collect();
            cannot_start(&words, &io::Error::from(kind)).to_string()
        };
        let (folder, script) = (folder.path().to_str().unwrap(), script.to_str().unwrap());
        assert!(why(&["cd", "x", "&&", "mydec"], ErrorKind::NotFound).contains("'cd' is for a shell"));
        assert!(why(&["nowhere", "|", "cat"], ErrorKind::NotFound).contains("'|' is for a shell"));
        let asked = ["sh", "-c", "mydec;"].map(str::to_owned);
        assert_eq!(shell_word(&asked), None);
        assert!(why(&[folder], ErrorKind::PermissionDenied).contains("is a folder"));
        assert!(why(&[script], ErrorKind::PermissionDenied).contains("chmod +x"));
        assert!(why(&[script], ErrorKind::NotFound).contains("interpreter"));
        assert!(why(&["nowhere"], ErrorKind::NotFound).contains("no such program"));
    }
}
