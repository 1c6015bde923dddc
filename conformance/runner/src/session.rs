//! A session with the decoder under test: one case after another.

mod persistent;

use crate::answer::{Answer, Ending};
use crate::cancel::Cancel;
use crate::case::Case;
use crate::command::{self, Template};
use crate::error::{Error, Result};
use crate::limits::Limits;
use crate::process_group::ProcessGroup;
use crate::protocol::{EVERYTHING, Request, Said};
use crate::vector::Mode;
use crate::watchdog::Watchdog;
use persistent::{Persistent, Reply};
use std::fs::{self, File, OpenOptions};
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::process::Stdio;
use tempfile::TempDir;

/// Bytes that are kept of the end of standard error.
const STDERR_KEPT: u64 = 4096;

/// How a decoder is run.
#[derive(Debug, Clone)]
pub enum Decoder {
    /// A process for each case.
    Once(Template),
    /// A process that answers line by line; the words of its command.
    Persistent(Vec<String>),
}

impl Decoder {
    /// The words of its command.
    pub fn words(&self) -> &[String] {
        match self {
            Self::Once(template) => template.raw_words(),
            Self::Persistent(words) => words,
        }
    }
}

/// A decoder with a folder for its output.
pub(crate) struct Session<'a> {
    decoder: &'a Decoder,
    limits: &'a Limits,
    cancel: &'a Cancel,
    // Before the folder, so that the process has ended when the folder is removed.
    process: Option<Persistent>,
    folder: TempDir,
}

impl<'a> Session<'a> {
    pub(crate) fn new(decoder: &'a Decoder, limits: &'a Limits, cancel: &'a Cancel) -> Result<Self> {
        let above = std::env::temp_dir();
        let folder = tempfile::Builder::new().prefix("splatstream-conformance-").tempdir_in(&above);
        let folder = folder.map_err(Error::file("make a folder in", &above))?;
        Ok(Self { decoder, limits, cancel, process: None, folder })
    }

    /// The folder with the output of the last case.
    pub(crate) fn out(&self) -> PathBuf {
        self.folder.path().join("out")
    }

    /// Asks one case.
    pub(crate) fn ask(&mut self, case: &Case<'_>) -> Result<Answer> {
        let (input, out) = (self.input(case)?, self.clean_out()?);
        let request = Request { input, op: case.op().to_owned(), mode: case.mode(), out };
        match self.decoder {
            Decoder::Once(template) => self.ask_once(&template.words(&request)),
            Decoder::Persistent(words) => self.ask_persistent(words, &request),
        }
    }

    /// Asks about any input; gives the answer and the file of a name that may have been written.
    pub(crate) fn ask_file(&mut self, input: &Path, name: &str) -> Result<(Answer, PathBuf)> {
        let out = self.clean_out()?.join(name);
        let (input, op) = (input.to_path_buf(), EVERYTHING.to_owned());
        let request = Request { input, op, mode: Mode::Full, out: out.clone() };
        let answer = match self.decoder {
            Decoder::Once(template) => self.ask_once(&template.words(&request)),
            Decoder::Persistent(words) => self.ask_persistent(words, &request),
        };
        Ok((answer?, out))
    }

    /// The file that the decoder gets.
    fn input(&self, case: &Case<'_>) -> Result<PathBuf> {
        if case.is_whole() {
            return Ok(case.stream.to_path_buf());
        }
        let path = self.folder.path().join("in.gss");
        fs::write(&path, case.input()?).map_err(Error::file("write", &path))?;
        Ok(path)
    }

    /// The output folder, empty.
    fn clean_out(&self) -> Result<PathBuf> {
        let out = self.out();
        // A decoder may have removed its folder, or have put something else in its place.
        let emptied = match fs::symlink_metadata(&out) {
            Ok(metadata) if metadata.is_dir() => fs::remove_dir_all(&out),
            Ok(_) => fs::remove_file(&out),
            Err(_) => Ok(()),
        };
        emptied.map_err(Error::file("empty", &out))?;
        fs::create_dir_all(&out).map_err(Error::file("make", &out))?;
        Ok(out)
    }

    fn ask_once(&self, words: &[String]) -> Result<Answer> {
        let stderr = self.stderr_file()?;
        let mut command = command::of(words);
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(stderr);
        let mut watchdog = Watchdog::new(self.limits, self.cancel, self.folder.path());
        let mut group = ProcessGroup::start(&mut command, self.limits)
            .map_err(|source| command::cannot_start(words, &source))?;
        let ending = loop {
            match group.has_ended() {
                Ok(false) => {}
                Ok(true) | Err(_) => break watchdog.check_output(),
            }
            if let Some(ending) = watchdog.check(&group) {
                break Some(ending);
            }
            std::thread::sleep(watchdog.wait());
        };
        let status = group.end().map_err(|source| command::cannot_start(words, &source))?;
        let took = watchdog.took();
        let stderr = self.last_stderr();
        let ending = ending.unwrap_or_else(|| status.into());
        let fault = self.limits.exceeded(ending);
        Ok(Answer { ending, said: Said::in_last_line(&stderr), fault, stderr, took })
    }

    fn ask_persistent(&mut self, words: &[String], request: &Request) -> Result<Answer> {
        let mut process = match self.process.take() {
            Some(process) => process,
            None => Persistent::start(words, self.stderr_file()?, self.limits)
                .map_err(|source| command::cannot_start(words, &source))?,
        };
        self.clear_stderr()?;
        let mut watchdog = Watchdog::new(self.limits, self.cancel, self.folder.path());
        let Reply { ending, said, fault } = process.ask(request, &mut watchdog);
        let took = watchdog.took();
        let stderr = self.last_stderr();
        let said = if said == Said::Nothing { Said::in_last_line(&stderr) } else { said };
        // A process that violates the protocol is started again for the next case.
        if matches!(ending, Ending::Code(_)) {
            self.process = Some(process);
        }
        let fault = fault.or_else(|| self.limits.exceeded(ending)).map(|fault| match ending {
            Ending::TimedOut => format!("{fault}; an answer is a line, with its newline and a flush"),
            _ => fault,
        });
        Ok(Answer { ending, said, fault, stderr, took })
    }

    /// The file for standard error, empty.
    fn stderr_file(&self) -> Result<File> {
        self.clear_stderr()?;
        let path = self.stderr_path();
        OpenOptions::new().append(true).open(&path).map_err(Error::file("write", &path))
    }

    fn clear_stderr(&self) -> Result<()> {
        let path = self.stderr_path();
        File::create(&path).map(drop).map_err(Error::file("write", &path))
    }

    fn stderr_path(&self) -> PathBuf {
        self.folder.path().join("stderr")
    }

    /// The end of standard error; empty if it cannot be read.
    fn last_stderr(&self) -> String {
        let read = || {
            let mut file = File::open(self.stderr_path())?;
            let length = file.metadata()?.len();
            file.seek(SeekFrom::Start(length.saturating_sub(STDERR_KEPT)))?;
            let mut bytes = Vec::new();
            file.take(STDERR_KEPT).read_to_end(&mut bytes)?;
            Ok::<_, std::io::Error>(String::from_utf8_lossy(&bytes).into_owned())
        };
        read().unwrap_or_default()
    }
}
