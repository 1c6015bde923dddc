//! `splatstream package --live`: files appear as the stream grows.

use super::Report;
use crate::console::Console;
use crate::failure::Failure;
use crate::output_file::{OutputFile, STANDARD};
use crate::stream_file::{fault, open_pieces};
use chrono::{SecondsFormat, Utc};
use splatstream_format::Limits;
use splatstream_stream::live::{Change, Live};
use splatstream_stream::package::Options;
use std::collections::BTreeMap;
use std::fs::OpenOptions;
use std::io::{ErrorKind, Read, Write};
use std::path::Path;
use std::thread;
use std::time::Duration;

/// Bytes that are read at once.
const PIECE: usize = 1 << 16;
/// How long to wait for a file to grow.
const PAUSE: Duration = Duration::from_millis(50);

/// Packages a stream that is being made, until its end unit.
pub(super) fn run(
    (input, out): (&Path, &Path),
    options: &Options,
    limits: &Limits,
    console: &Console,
) -> Result<(), Failure> {
    let mut reader = open_pieces(input)?;
    let mut live = Live::new(options, limits, &now());
    let mut files = Files { out, sizes: BTreeMap::new() };
    let (mut piece, mut bytes_in) = (vec![0; PIECE], 0);
    while !live.has_ended() {
        let count = match reader.read(&mut piece) {
            Err(error) if error.kind() == ErrorKind::Interrupted => continue,
            count => count.map_err(|error| Failure::file("read", input, &error))?,
        };
        if count == 0 {
            // A pipe that has ended does not go on; a file may.
            if input == Path::new(STANDARD) {
                break;
            }
            thread::sleep(PAUSE);
            continue;
        }
        bytes_in += count as u64;
        let changes = live.push(&piece[..count], &now()).map_err(|error| fault(input, error))?;
        files.apply(changes, input)?;
    }
    files.apply(live.finish(&now()).map_err(|error| fault(input, error))?, input)?;
    let bytes = files.sizes.values().sum();
    let report = Report::of_live(out, options.layout.name(), bytes_in, bytes, files.gops());
    console.report(&report, || report.text())
}

/// The time, as an `xs:dateTime`.
fn now() -> String {
    Utc::now().to_rfc3339_opts(SecondsFormat::Millis, true)
}

/// The files so far.
struct Files<'a> {
    out: &'a Path,
    /// Bytes by name.
    sizes: BTreeMap<String, u64>,
}

impl Files<'_> {
    fn apply(&mut self, changes: Vec<Change>, input: &Path) -> Result<(), Failure> {
        for Change { name, bytes, appends } in changes {
            let path = self.out.join(&name);
            let size = self.sizes.entry(name).or_default();
            if appends {
                let file = OpenOptions::new().append(true).open(&path);
                let written = file.and_then(|mut file| file.write_all(&bytes));
                written.map_err(|error| Failure::file("write", &path, &error))?;
                *size += bytes.len() as u64;
            } else {
                OutputFile::write_apart(&path, &[input.to_path_buf()], &bytes)?;
                *size = bytes.len() as u64;
            }
        }
        Ok(())
    }

    /// Segments of the base.
    fn gops(&self) -> usize {
        let numbers = self.sizes.keys().filter_map(|name| name.strip_prefix("s0-")?.strip_suffix(".m4s"));
        numbers.filter(|number| number.parse::<u64>().is_ok()).count()
    }
}
