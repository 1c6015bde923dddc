//! One decoder under test, asked one case after another.

mod persistent;

use crate::answer::{Answer, Ending};
use crate::command::{self, Template};
use crate::error::{Error, Result};
use crate::group::Group;
use crate::guard::Guard;
use crate::limits::Limits;
use crate::protocol::{Request, Said};
use crate::stop::Stop;
use crate::vector::Mode;
use persistent::{Persistent, Reply};
use std::fs::{self, File, OpenOptions};
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::process::Stdio;
use tempfile::TempDir;

/// How much is kept of what a decoder says, bytes.
const COMPLAINT: u64 = 4096;

/// How a decoder is asked.
#[derive(Debug, Clone)]
pub enum Decoder {
    /// A process a case.
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

/// A decoder with a folder for what it writes.
pub(crate) struct Session<'a> {
    decoder: &'a Decoder,
    limits: &'a Limits,
    stop: &'a Stop,
    // Before the folder, so that nobody writes into it when it goes.
    process: Option<Persistent>,
    folder: TempDir,
}

impl<'a> Session<'a> {
    pub(crate) fn new(decoder: &'a Decoder, limits: &'a Limits, stop: &'a Stop) -> Result<Self> {
        let above = std::env::temp_dir();
        let folder = tempfile::Builder::new().prefix("splatstream-conformance-").tempdir_in(&above);
        let folder = folder.map_err(Error::file("make a folder in", &above))?;
        Ok(Self { decoder, limits, stop, process: None, folder })
    }

    /// The folder with what the decoder wrote in the last case.
    pub(crate) fn out(&self) -> PathBuf {
        self.folder.path().join("out")
    }

    /// Asks one case.
    pub(crate) fn ask(&mut self, stream: &Path, op: &str, mode: Mode) -> Result<Answer> {
        let request =
            Request { input: stream.to_path_buf(), op: op.to_owned(), mode, out: self.clean_out()? };
        match self.decoder {
            Decoder::Once(template) => self.ask_once(&template.words(&request)),
            Decoder::Persistent(words) => self.ask_persistent(words, &request),
        }
    }

    /// The folder for files, empty.
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
        let complaints = self.complaints()?;
        let mut command = command::of(words);
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(complaints);
        let mut guard = Guard::new(self.limits, self.stop, self.folder.path());
        let mut group = Group::start(&mut command, self.limits)
            .map_err(|source| command::cannot_start(words, &source))?;
        let ending = loop {
            match group.has_ended() {
                Ok(false) => {}
                Ok(true) | Err(_) => break guard.look_at_output(),
            }
            if let Some(ending) = guard.look(&group) {
                break Some(ending);
            }
            std::thread::sleep(guard.wait());
        };
        let status = group.end().map_err(|source| command::cannot_start(words, &source))?;
        let took = guard.took();
        let complaint = self.complaint();
        let ending = ending.unwrap_or_else(|| status.into());
        let fault = self.limits.passed(ending);
        Ok(Answer { ending, said: Said::in_last_line(&complaint), fault, complaint, took })
    }

    fn ask_persistent(&mut self, words: &[String], request: &Request) -> Result<Answer> {
        let mut process = match self.process.take() {
            Some(process) => process,
            None => Persistent::start(words, self.complaints()?, self.limits)
                .map_err(|source| command::cannot_start(words, &source))?,
        };
        self.forget_complaints()?;
        let mut guard = Guard::new(self.limits, self.stop, self.folder.path());
        let Reply { ending, said, fault } = process.ask(request, &mut guard);
        let took = guard.took();
        let complaint = self.complaint();
        let said = if said == Said::Nothing { Said::in_last_line(&complaint) } else { said };
        // Whoever breaks the protocol once is started anew.
        if matches!(ending, Ending::Code(_)) {
            self.process = Some(process);
        }
        let fault = fault.or_else(|| self.limits.passed(ending)).map(|fault| match ending {
            Ending::TimedOut => format!("{fault}; an answer is a line, with its newline and a flush"),
            _ => fault,
        });
        Ok(Answer { ending, said, fault, complaint, took })
    }

    /// The file for standard error, empty.
    fn complaints(&self) -> Result<File> {
        self.forget_complaints()?;
        let path = self.complaints_path();
        OpenOptions::new().append(true).open(&path).map_err(Error::file("write", &path))
    }

    fn forget_complaints(&self) -> Result<()> {
        let path = self.complaints_path();
        File::create(&path).map(drop).map_err(Error::file("write", &path))
    }

    fn complaints_path(&self) -> PathBuf {
        self.folder.path().join("stderr")
    }

    /// The end of what the decoder said; what cannot be read was not said.
    fn complaint(&self) -> String {
        let read = || {
            let mut file = File::open(self.complaints_path())?;
            let length = file.metadata()?.len();
            file.seek(SeekFrom::Start(length.saturating_sub(COMPLAINT)))?;
            let mut bytes = Vec::new();
            file.take(COMPLAINT).read_to_end(&mut bytes)?;
            Ok::<_, std::io::Error>(String::from_utf8_lossy(&bytes).into_owned())
        };
        read().unwrap_or_default()
    }
}
