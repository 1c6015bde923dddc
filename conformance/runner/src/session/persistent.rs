//! A process that answers many requests, a line each.

use crate::answer::Ending;
use crate::command;
use crate::group::Group;
use crate::guard::Guard;
use crate::limits::Limits;
use crate::protocol::{Request, Said, parse_answer};
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Write};
use std::process::{ChildStdin, ChildStdout, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::thread;
use std::time::{Duration, Instant};

/// The longest answer, bytes: a process that never ends its line does not fill our memory.
const LONGEST: u64 = 1 << 16;
/// How long a process may take to end once nothing more is asked.
const FAREWELL: Duration = Duration::from_millis(500);

/// A running decoder.
pub(super) struct Persistent {
    group: Group,
    requests: Option<ChildStdin>,
    answers: Receiver<String>,
}

/// What came of a request.
pub(super) struct Reply {
    pub(super) ending: Ending,
    pub(super) said: Said,
    /// How the protocol was broken.
    pub(super) fault: Option<String>,
}

impl Reply {
    fn without_words(ending: Ending) -> Self {
        Self { ending, said: Said::Nothing, fault: None }
    }
}

impl Persistent {
    pub(super) fn start(words: &[String], complaints: File, limits: &Limits) -> io::Result<Self> {
        let mut command = command::of(words);
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(complaints);
        let mut group = Group::start(&mut command, limits)?;
        let (sender, answers) = sync_channel(1);
        let requests = group.child().stdin.take();
        if let Some(stdout) = group.child().stdout.take() {
            thread::spawn(move || pass_on(stdout, &sender));
        }
        Ok(Self { group, requests, answers })
    }

    /// Asks one case and waits for its answer.
    pub(super) fn ask(&mut self, request: &Request, guard: &mut Guard<'_>) -> Reply {
        let asked = self
            .requests
            .as_mut()
            .map(|pipe| pipe.write_all(request.line().as_bytes()).and_then(|()| pipe.flush()));
        if !matches!(asked, Some(Ok(()))) {
            return self.died(guard);
        }
        loop {
            match self.answers.recv_timeout(guard.wait()) {
                Ok(line) => {
                    return match parse_answer(&line) {
                        Ok((code, said)) => Reply { ending: Ending::Code(code), said, fault: None },
                        Err(why) => Reply { fault: Some(why), ..Reply::without_words(Ending::NoAnswer) },
                    };
                }
                Err(RecvTimeoutError::Disconnected) => return self.died(guard),
                Err(RecvTimeoutError::Timeout) => {}
            }
            if let Some(ending) = guard.look(&self.group) {
                return Reply::without_words(ending);
            }
        }
    }

    /// How a process ended that no longer answers: by itself, or not at all with its standard output closed.
    fn died(&mut self, guard: &Guard<'_>) -> Reply {
        if let Some(ending) = guard.look_at_output() {
            return Reply::without_words(ending);
        }
        let ended = self.wait_to_end();
        let (ending, how) = match self.group.end() {
            // An exit code is no answer: the process was to go on.
            Ok(status) if ended => match Ending::from(status) {
                Ending::Code(code) => {
                    (Ending::NoAnswer, format!("the process ended with exit code {code} before it answered"))
                }
                ending => (ending, "the process was ended by a signal before it answered".to_owned()),
            },
            _ => (Ending::NoAnswer, "the process closed its standard output before it answered".to_owned()),
        };
        Reply { fault: Some(how), ..Reply::without_words(ending) }
    }

    fn wait_to_end(&mut self) -> bool {
        let start = Instant::now();
        while start.elapsed() < FAREWELL {
            if self.group.has_ended().unwrap_or(true) {
                return true;
            }
            thread::sleep(Duration::from_millis(1));
        }
        false
    }
}

impl Drop for Persistent {
    /// Closing standard input asks the process to end; the group kills what does not.
    fn drop(&mut self) {
        drop(self.requests.take());
        self.wait_to_end();
    }
}

/// Hands on line by line, until the pipe ends or nobody listens.
fn pass_on(stdout: ChildStdout, answers: &SyncSender<String>) {
    let mut reader = BufReader::new(stdout);
    loop {
        let mut line = Vec::new();
        let read = reader.by_ref().take(LONGEST).read_until(b'\n', &mut line);
        let ended = !matches!(read, Ok(bytes) if bytes > 0);
        if ended || answers.send(String::from_utf8_lossy(&line).into_owned()).is_err() {
            return;
        }
    }
}
