//! The worst streams of each level: what they cost a decoder, beside what annex A.3 says that they may.
//!
//! `cargo run --release -p splatstream-fuzz --example bounds -- [LEVEL]... [CASE]...` makes every case, or those named, at
//! the levels named (1), decodes each in a process of its own, and prints a table. Processor time is that of decoding with
//! all digests compared, of all threads together.
//!
//! `... --example bounds -- --interrupt [LEVEL]... [CASE]...` interrupts the decoder of each at many places, and prints for
//! how long it goes on, on one thread. `... -- --interrupt-file FILE LEVEL` prints the milliseconds for a stream of one's own, the
//! shortest first.

use rustix::time::{ClockId, clock_gettime};
use splatstream_decoder::process::Options;
use splatstream_decoder::stream::decode_stream;
use splatstream_format::Limits;
use std::ops::ControlFlow;
use std::process::{Command, Stdio};
use std::time::Duration;

mod cases;
mod healing;
mod interrupted;
mod stream;

/// Asks for the table of interrupted decoders.
const INTERRUPT: &str = "--interrupt";
/// What the process that decodes a stream is told, before its file and its level.
const DECODE_FILE: &str = "--decode-file";
/// The same of the process that is interrupted.
const INTERRUPT_FILE: &str = "--interrupt-file";

const HEAD: &str = "\
| Case | Level | Bytes | Frames | CPU s | CPU ms a frame | A.3 counts in a frame | ns each | Peak MB | A.3 MB |
|---|--:|--:|--:|--:|--:|---|--:|--:|--:|";

type Result<T> = core::result::Result<T, Box<dyn std::error::Error>>;

fn main() -> Result<()> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    match words.as_slice() {
        [word, path, level] if word == DECODE_FILE => return measured(path, level.parse()?),
        [word, path, level] if word == INTERRUPT_FILE => {
            let found = interrupted::milliseconds(path, level.parse()?)?;
            found.iter().for_each(|one| println!("{one}"));
            return Ok(());
        }
        _ => {}
    }
    let is_interrupted = words.first().is_some_and(|word| word == INTERRUPT);
    let words = words.into_iter().skip(usize::from(is_interrupted));
    let (levels, names): (Vec<String>, Vec<String>) = words.partition(|word| word.parse::<u8>().is_ok());
    let levels = if levels.is_empty() { vec!["1".to_owned()] } else { levels };
    match is_interrupted {
        true => println!("| Case | Level | Median ms | Largest ms |\n|---|--:|--:|--:|"),
        false => println!("{HEAD}"),
    }
    for level in &levels {
        for (name, make) in cases::ALL {
            if names.is_empty() || names.iter().any(|wanted| wanted == name) {
                let level = level.parse()?;
                let case = make(level, &Limits::of_level(level));
                match is_interrupted {
                    true => print_interrupted(name, level, &case)?,
                    false => print(name, level, &case)?,
                }
            }
        }
    }
    Ok(())
}

/// What a process of its own says of a case.
fn told_by_process(what: &str, level: u8, case: &cases::Case) -> Result<String> {
    let path = std::env::temp_dir().join(format!("bounds-{}.gss", std::process::id()));
    std::fs::write(&path, &case.bytes)?;
    let mut process = Command::new(std::env::current_exe()?);
    if what == INTERRUPT_FILE {
        process.env("RAYON_NUM_THREADS", "1");
    }
    let output = process.arg(what).arg(&path).arg(level.to_string()).stderr(Stdio::inherit()).output()?;
    std::fs::remove_file(&path)?;
    match output.status.success() {
        true => Ok(String::from_utf8(output.stdout)?),
        false => Err(format!("the decoder: {}", output.status).into()),
    }
}

/// Has a case decoded and interrupted, and prints its line.
fn print_interrupted(name: &str, level: u8, case: &cases::Case) -> Result<()> {
    let told = told_by_process(INTERRUPT_FILE, level, case)?;
    let found = told.lines().map(str::parse).collect::<core::result::Result<Vec<f64>, _>>()?;
    let [median, largest] = [found.get(found.len() / 2), found.last()].map(|one| one.copied().unwrap_or(0.0));
    println!("| {name} | {level} | {median:.1} | {largest:.1} |");
    Ok(())
}

/// Has a case decoded, and prints its line.
fn print(name: &str, level: u8, case: &cases::Case) -> Result<()> {
    let line = told_by_process(DECODE_FILE, level, case)?;
    let [frames, seconds, peak, errors] = line.split_whitespace().collect::<Vec<_>>()[..] else {
        return Err(format!("{name}: {line}").into());
    };
    let (seconds, peak, errors) = (seconds.parse::<f64>()?, peak.parse::<f64>()?, errors.parse::<u32>()?);
    if errors > 0 && !case.is_damaged {
        return Err(format!("{name}: {errors} errors").into());
    }
    let per_frame = seconds / f64::from(case.frames.max(1));
    println!(
        "| {name} | {level} | {} | {frames} | {seconds:.2} | {:.2} | {:.3e} {} | {:.1} | {:.0} | {:.0} |",
        case.bytes.len(),
        per_frame * 1e3,
        case.work as f64,
        case.unit,
        per_frame * 1e9 / case.work as f64,
        peak / 1e6,
        case.memory as f64 / 1e6,
    );
    Ok(())
}

/// Decodes a file, and prints frames, processor seconds, peak bytes and errors.
fn measured(path: &str, level: u8) -> Result<()> {
    let bytes = std::fs::read(path)?;
    let before = processor_time();
    let options = Options { limits: Limits::of_level(level), ..Options::default() };
    let summary = decode_stream(&bytes, &options, |_, _| ControlFlow::Continue(()));
    let seconds = processor_time().saturating_sub(before).as_secs_f64();
    println!("{} {seconds} {} {}", summary.frames, peak_bytes()?, summary.errors.len());
    if let Some(error) = summary.verdict() {
        eprintln!("{error}");
    }
    Ok(())
}

/// Processor time of this process so far, of all threads.
fn processor_time() -> Duration {
    let now = clock_gettime(ClockId::ProcessCPUTime);
    Duration::new(now.tv_sec.unsigned_abs(), now.tv_nsec.unsigned_abs() as u32)
}

/// The largest memory in use so far.
fn peak_bytes() -> Result<u64> {
    let status = std::fs::read_to_string("/proc/self/status")?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).ok_or("no peak")?;
    Ok(line.trim().trim_end_matches(" kB").parse::<u64>()? * 1024)
}
