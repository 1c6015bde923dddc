//! `splatstream package --live`: files appear as the stream grows.

use super::Report;
use crate::console::Console;
use crate::failure::Failure;
use crate::output_directory::OutputDirectory;
use crate::standard::STANDARD;
use crate::stream_file::{fault, open_pieces};
use splatstream_format::Limits;
use splatstream_stream::live::{Change, Live, Settings};
use splatstream_stream::package::Package;
use std::collections::BTreeMap;
use std::fs::OpenOptions;
use std::io::{ErrorKind, Read, Write};
use std::path::Path;
use std::thread;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// Bytes that are read at once.
const PIECE: usize = 1 << 16;
/// How long to wait for a file to grow.
const PAUSE: Duration = Duration::from_millis(50);

/// Packages a stream that is being made, until its end unit.
pub(super) fn run(
    input: &Path,
    directory: OutputDirectory,
    settings: &Settings,
    limits: &Limits,
    console: &Console,
) -> Result<(), Failure> {
    let mut reader = open_pieces(input)?;
    let mut live = Live::new(settings, limits);
    let mut files = Files { directory, media: 0, texts: BTreeMap::new(), gops: 0 };
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
        let changes = live.push(&piece[..count], now_ms()).map_err(|error| fault(input, error))?;
        files.apply(changes)?;
    }
    files.apply(live.finish(now_ms()).map_err(|error| fault(input, error))?)?;
    let layout = settings.package.layout.name();
    let report = Report::of_live(files.directory.path(), layout, bytes_in, files.bytes(), files.gops);
    console.report(&report, || report.text())
}

/// Milliseconds since 1970.
fn now_ms() -> u64 {
    let passed = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    passed.as_millis() as u64
}

/// The files so far.
struct Files {
    directory: OutputDirectory,
    /// Bytes of media.
    media: u64,
    /// Bytes of the files that are replaced, by name.
    texts: BTreeMap<String, u64>,
    /// Files of the base.
    gops: usize,
}

impl Files {
    fn apply(&mut self, changes: Vec<Change>) -> Result<(), Failure> {
        for Change { name, bytes, appends } in changes {
            // Players read these files while others come, and not together with those of an earlier package.
            self.directory.clear()?;
            if appends {
                let path = self.directory.path_of(&name);
                let file = OpenOptions::new().append(true).open(&path);
                let written = file.and_then(|mut file| file.write_all(&bytes));
                written.map_err(|error| Failure::file("write", &path, &error))?;
            } else {
                self.directory.write(&name, &bytes)?;
                let number = name.strip_prefix("s0-").and_then(|rest| rest.strip_suffix(".m4s"));
                self.gops += usize::from(number.is_some_and(|number| number.parse::<u64>().is_ok()));
            }
            if [Package::MANIFEST, Package::MPD].contains(&name.as_str()) {
                self.texts.insert(name, bytes.len() as u64);
            } else {
                self.media += bytes.len() as u64;
            }
        }
        Ok(())
    }

    fn bytes(&self) -> u64 {
        self.media + self.texts.values().sum::<u64>()
    }
}
