//! A process that answers many requests, one line each.

use crate::answer::Ending;
use crate::command;
use crate::limits::Limits;
use crate::process_group::ProcessGroup;
use crate::protocol::{Request, Said, parse_answer};
use crate::watchdog::Watchdog;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Write};
use std::process::{ChildStdin, ChildStdout, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::thread;
use std::time::{Duration, Instant};

/// Bytes of the longest answer: a process that never ends its line shall not fill our memory.
const MAX_ANSWER: u64 = 1 << 16;
/// How long a process may take to end after its standard input was closed.
const END_TIMEOUT: Duration = Duration::from_millis(500);

/// A running decoder.
pub(super) struct Persistent {
    group: ProcessGroup,
    requests: Option<ChildStdin>,
    answers: Receiver<String>,
}

/// The reply to a request.
pub(super) struct Reply {
    pub(super) ending: Ending,
    pub(super) said: Said,
    /// How the protocol was violated.
    pub(super) fault: Option<String>,
}

impl Reply {
    fn silent(ending: Ending) -> Self {
        Self { ending, said: Said::Nothing, fault: None }
    }
}

impl Persistent {
    pub(super) fn start(words: &[String], stderr: File, limits: &Limits) -> io::Result<Self> {
        let mut command = command::of(words);
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(stderr);
        let mut group = ProcessGroup::start(&mut command, limits)?;
        let (sender, answers) = sync_channel(1);
        let requests = group.child().stdin.take();
        if let Some(stdout) = group.child().stdout.take() {
            thread::spawn(move || forward(stdout, &sender));
        }
        Ok(Self { group, requests, answers })
    }

    /// Asks one case and waits for its answer.
    pub(super) fn ask(&mut self, request: &Request, watchdog: &mut Watchdog<'_>) -> Reply {
        let asked = self
            .requests
            .as_mut()
            .map(|pipe| pipe.write_all(request.line().as_bytes()).and_then(|()| pipe.flush()));
        if !matches!(asked, Some(Ok(()))) {
            return self.died(watchdog);
        }
        loop {
            match self.answers.recv_timeout(watchdog.wait()) {
                Ok(line) => {
                    return match parse_answer(&line) {
                        Ok((code, said)) => Reply { ending: Ending::Code(code), said, fault: None },
                        Err(why) => Reply { fault: Some(why), ..Reply::silent(Ending::NoAnswer) },
                    };
                }
                Err(RecvTimeoutError::Disconnected) => return self.died(watchdog),
                Err(RecvTimeoutError::Timeout) => {}
            }
            if let Some(ending) = watchdog.check(&self.group) {
                return Reply::silent(ending);
            }
        }
    }

    /// How a process ended that answers no more: by itself, or by closing its standard output.
    fn died(&mut self, watchdog: &Watchdog<'_>) -> Reply {
        if let Some(ending) = watchdog.check_output() {
            return Reply::silent(ending);
        }
        let ended = self.wait_to_end();
        let (ending, how) = match self.group.end() {
            // An exit code is not an answer: the process should have gone on.
            Ok(status) if ended => match Ending::from(status) {
                Ending::Code(code) => {
                    (Ending::NoAnswer, format!("the process ended with exit code {code} before it answered"))
                }
                ending => (ending, "the process was ended by a signal before it answered".to_owned()),
            },
            _ => (Ending::NoAnswer, "the process closed its standard output before it answered".to_owned()),
        };
        Reply { fault: Some(how), ..Reply::silent(ending) }
    }

    fn wait_to_end(&mut self) -> bool {
        let start = Instant::now();
        while start.elapsed() < END_TIMEOUT {
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

/// Forwards lines until the pipe ends or the receiver is gone.
fn forward(stdout: ChildStdout, answers: &SyncSender<String>) {
    let mut reader = BufReader::new(stdout);
    loop {
        let mut line = Vec::new();
        let read = reader.by_ref().take(MAX_ANSWER).read_until(b'\n', &mut line);
        let ended = !matches!(read, Ok(bytes) if bytes > 0);
        if ended || answers.send(String::from_utf8_lossy(&line).into_owned()).is_err() {
            return;
        }
    }
}
