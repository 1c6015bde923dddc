//! A rule in another program, which is asked in lines of JSON over its standard input and answers over its standard output.

use std::error::Error;
use std::io::{BufRead, BufReader, Write};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use serde_json::{Value, json};
use splatstream_stream::control::{Pick, Request, SingleRule, Situation};

/// A running program; it ends when its input does.
pub(crate) struct Peer {
    child: Child,
    input: Option<ChildStdin>,
    output: BufReader<ChildStdout>,
    begun: bool,
    told: Option<(u64, u64)>,
}

impl Peer {
    /// Starts the words of a command.
    pub(crate) fn start(command: &str) -> Result<Self, Box<dyn Error>> {
        let mut words = command.split_whitespace();
        let program = words.next().ok_or("a peer needs a command")?;
        let mut child =
            Command::new(program).args(words).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn()?;
        let output = BufReader::new(child.stdout.take().ok_or("a peer has no output")?);
        let input = child.stdin.take();
        Ok(Self { child, input, output, begun: false, told: None })
    }

    /// Asks one question. Without an answer there is no result: the program ends.
    fn ask(&mut self, question: &Value) -> Value {
        self.exchange(question).unwrap_or_else(|error| {
            let _ = writeln!(std::io::stderr(), "a peer does not answer: {error}");
            std::process::exit(1)
        })
    }

    fn exchange(&mut self, question: &Value) -> Result<Value, Box<dyn Error>> {
        let input = self.input.as_mut().ok_or("its input is closed")?;
        writeln!(input, "{question}")?;
        let mut line = String::new();
        self.output.read_line(&mut line)?;
        Ok(serde_json::from_str(&line)?)
    }

    fn begin(&mut self, situation: &Situation<'_>) {
        if self.begun {
            return;
        }
        self.begun = true;
        let bitrates: Vec<f64> = situation.rungs.iter().map(|rung| rung.bitrate).collect();
        let qualities: Vec<f64> = situation.rungs.iter().map(|rung| rung.quality).collect();
        self.ask(&json!({
            "ask": "begin", "gop_seconds": situation.duration, "gops": situation.gops, "full_seconds": situation.full,
            "bitrates": bitrates, "qualities": qualities,
        }));
    }
}

/// What every question says.
fn state(situation: &Situation<'_>) -> Value {
    json!({
        "now": situation.now_us as f64 / 1e6, "gop": situation.gop, "buffer": situation.buffer, "last": situation.last,
        "bytes": situation.bytes,
    })
}

impl SingleRule for Peer {
    fn pick(&mut self, situation: &Situation<'_>) -> Pick {
        self.begin(situation);
        let mut question = state(situation);
        question["ask"] = "pick".into();
        let last = situation.network.last().filter(|last| self.told != Some((last.sent_us, last.last_us)));
        if let Some(last) = last {
            self.told = Some((last.sent_us, last.last_us));
            question["transfer"] = json!({
                "sent": last.sent_us as f64 / 1e6, "latency": last.latency(), "duration": last.duration(), "bytes": last.bytes,
            });
        }
        let answer = self.ask(&question);
        let rung = answer["rung"].as_u64().and_then(|rung| usize::try_from(rung).ok()).unwrap_or(0);
        let wait_us = (answer["wait"].as_f64().unwrap_or(0.0) * 1e6) as u64;
        Pick { rung, wait_us }
    }

    fn give_up(&mut self, situation: &Situation<'_>, request: &Request) -> Option<usize> {
        let mut question = state(situation);
        question["ask"] = "progress".into();
        question["request"] = json!({
            "sent": request.progress.sent_us as f64 / 1e6, "first": request.progress.first_us as f64 / 1e6,
            "received": request.progress.bytes, "bytes": request.fetch.bytes(),
        });
        let answer = self.ask(&question);
        answer["rung"].as_u64().and_then(|rung| usize::try_from(rung).ok())
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        self.input = None;
        let _ = self.child.wait();
    }
}
