//! `splatstream encode --each`: every input is a scene of its own, and becomes a stream of its own.

use super::Encode;
use super::encoded::Encoded;
use crate::console::Console;
use crate::failure::Failure;
use crate::frame_files::inputs_of;
use crate::output_file::{check_directory, make_directory, refuse_inputs};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::slice;

/// What `--json` prints.
#[derive(Serialize)]
struct Report<'a> {
    output: &'a Path,
    streams: Vec<Encoded>,
    failed: Vec<Failed<'a>>,
}

/// An input that gave no stream.
#[derive(Serialize)]
struct Failed<'a> {
    input: &'a Path,
    message: String,
}

/// Encodes one input after the other; those that fail are left out, and the first failure is that of the command.
pub(super) fn run(command: &Encode, console: &Console) -> Result<(), Failure> {
    check_directory(&command.out, "the streams of --each")?;
    let outputs = outputs(command)?;
    make_directory(&command.out)?;
    // What cannot be read is told where it is encoded.
    let files_of = |input| inputs_of(slice::from_ref(input)).unwrap_or_default();
    let files: Vec<PathBuf> = command.inputs.iter().flat_map(files_of).collect();
    let mut report = Report { output: &command.out, streams: Vec::new(), failed: Vec::new() };
    let mut first = None;
    for (input, out) in command.inputs.iter().zip(&outputs) {
        // No stream replaces a scene that comes after it.
        let encoded =
            refuse_inputs(out, &files).and_then(|()| command.one(console, slice::from_ref(input), out));
        match encoded {
            Ok(encoded) => report.streams.push(encoded),
            Err(failure) => {
                let message = failure.to_string();
                // The last word of the command is about the first failure.
                if first.is_some() {
                    console.complain(&message);
                }
                report.failed.push(Failed { input, message });
                first = first.or(Some(failure));
            }
        }
    }
    console.report(&report, || report.streams.iter().map(Encoded::text).collect())?;
    first.map_or(Ok(()), Err)
}

/// The stream of each input: its name in the directory, with another suffix.
fn outputs(command: &Encode) -> Result<Vec<PathBuf>, Failure> {
    let mut inputs = BTreeMap::new();
    let output = |input: &PathBuf| {
        let out = command.out.join(format!("{}.gss", stem(input)));
        match inputs.insert(out.clone(), input.clone()) {
            None => Ok(out),
            Some(other) => Err(Failure::Usage(format!(
                "{} and {}: both would become {}; rename one, or encode it by itself",
                other.display(),
                input.display(),
                out.display()
            ))),
        }
    };
    command.inputs.iter().map(output).collect()
}

/// A name without the suffix of a scene; a folder may have points in its name.
fn stem(input: &Path) -> String {
    let name = input.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    if input.is_dir() {
        return name;
    }
    let stem = Path::new(&name).file_stem().map(|stem| stem.to_string_lossy().into_owned());
    let stem = stem.unwrap_or_default();
    let stem = [".compressed", ".tar"].iter().find_map(|suffix| stem.strip_suffix(suffix)).unwrap_or(&stem);
    stem.to_owned()
}
