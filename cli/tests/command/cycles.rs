//! Commands that are stopped at any time, or that have no room or no right to write: what stands under the name that they
//! were given is whole, or what it was, and nothing else is left.
//!
//! `SPLATSTREAM_DAMAGE=full` makes a campaign of what is a sample otherwise: `.ci/reports damage`.

use crate::common::{directory, text, write_still, write_stream};
use splatstream_gaussians::random::SplitMix64;
use std::collections::BTreeMap;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// What a cycle does to the command.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
enum Harm {
    Interrupt,
    Terminate,
    Kill,
    FullDisk,
    ReadOnly,
    None,
}

const HARMS: [Harm; 6] =
    [Harm::Interrupt, Harm::Terminate, Harm::Kill, Harm::FullDisk, Harm::ReadOnly, Harm::None];

/// A command: its arguments but for the output, the name of that, and how long it takes and what it writes in peace.
struct Job {
    arguments: Vec<String>,
    output: &'static str,
    takes: Duration,
    writes: BTreeMap<PathBuf, Vec<u8>>,
}

impl Job {
    fn new(arguments: &[&str], output: &'static str) -> Self {
        let arguments = arguments.iter().map(|word| (*word).to_owned()).collect();
        let mut job = Self { arguments, output, takes: Duration::ZERO, writes: BTreeMap::new() };
        let folder = directory();
        let start = Instant::now();
        assert!(job.run(folder.path(), Harm::None, &mut SplitMix64::new(0)).success());
        (job.takes, job.writes) = (start.elapsed(), files(folder.path()));
        assert!(!job.writes.is_empty());
        job
    }

    /// The program as a harm lets it run.
    fn program(&self, harm: Harm, random: &mut SplitMix64) -> Command {
        let program = env!("CARGO_BIN_EXE_splatstream");
        let within = |words: &[&str]| {
            let mut command = Command::new(words[0]);
            command.args(&words[1..]).arg(program);
            command
        };
        match harm {
            Harm::FullDisk => {
                let most = self.writes.values().map(|bytes| bytes.len() / 512).max().unwrap_or(0);
                let line = format!("trap '' XFSZ; ulimit -f {}; exec \"$@\"", random.below(most + 1));
                within(&["sh", "-c", &line, "sh"])
            }
            // Permissions hold up everybody but root.
            Harm::ReadOnly if is_root() => {
                within(&["setpriv", "--reuid=65534", "--regid=65534", "--clear-groups"])
            }
            _ => Command::new(program),
        }
    }

    /// Runs it with a harm.
    fn run(&self, folder: &Path, harm: Harm, random: &mut SplitMix64) -> ExitStatus {
        let mut command = self.program(harm, random);
        let output = folder.join(self.output);
        command.args(&self.arguments).arg("-o").arg(&output).stdout(Stdio::null()).stderr(Stdio::null());
        let mut child = command.spawn().unwrap();
        let signal = match harm {
            Harm::Interrupt => "-INT",
            Harm::Terminate => "-TERM",
            Harm::Kill => "-KILL",
            Harm::FullDisk | Harm::ReadOnly | Harm::None => return child.wait().unwrap(),
        };
        let micros = random.below(self.takes.as_micros() as usize * 5 / 4 + 1);
        std::thread::sleep(Duration::from_micros(micros as u64));
        // It may have ended before.
        let _ = Command::new("kill").args([signal, &child.id().to_string()]).stderr(Stdio::null()).status();
        child.wait().unwrap()
    }
}

/// Whether permissions mean nothing to this process.
fn is_root() -> bool {
    let status = fs::read_to_string("/proc/self/status").unwrap();
    let users = status.lines().find_map(|line| line.strip_prefix("Uid:")).unwrap();
    users.split_whitespace().nth(1) == Some("0")
}

/// The files in a folder and in those in it.
fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![folder.to_path_buf()];
    while let Some(next) = folders.pop() {
        for entry in fs::read_dir(&next).unwrap().map(Result::unwrap) {
            match entry.file_type().unwrap().is_dir() {
                true => folders.push(entry.path()),
                false => {
                    let name = entry.path().strip_prefix(folder).unwrap().to_path_buf();
                    found.insert(name, fs::read(entry.path()).unwrap());
                }
            }
        }
    }
    found
}

fn is_temporary(name: &Path) -> bool {
    name.file_name().unwrap().to_str().unwrap().starts_with(".splatstream-")
}

/// What came of the cycles with one harm.
#[derive(Default)]
struct Tally {
    cycles: u32,
    succeeded: u32,
    /// Temporary files that commands that were killed left behind.
    left: u32,
}

/// One cycle: what is there afterwards is whole, or what was there before.
fn cycle(job: &Job, harm: Harm, random: &mut SplitMix64, tally: &mut Tally) {
    let folder = directory();
    let place = folder.path();
    let old = b"what was there".to_vec();
    // A single file replaces an old one in every other cycle.
    let has_old = !job.output.ends_with("frames") && random.below(2) == 0;
    if has_old {
        fs::write(place.join(job.output), &old).unwrap();
    }
    let before = files(place);
    if harm == Harm::ReadOnly {
        fs::set_permissions(place, fs::Permissions::from_mode(0o555)).unwrap();
    }
    let status = job.run(place, harm, random);
    fs::set_permissions(place, fs::Permissions::from_mode(0o755)).unwrap();
    let after = files(place);
    for (name, bytes) in &after {
        if is_temporary(name) {
            assert_eq!(harm, Harm::Kill, "{harm:?} of {:?} leaves {}", job.arguments, name.display());
            tally.left += 1;
            continue;
        }
        let is_old = before.get(name) == Some(bytes);
        let is_whole = job.writes.get(name) == Some(bytes);
        assert!(is_old || is_whole, "{harm:?} of {:?}: {} is half written", job.arguments, name.display());
    }
    if status.success() {
        assert_eq!(after, job.writes, "{:?} succeeded", job.arguments);
        tally.succeeded += 1;
    } else {
        assert!(before.keys().all(|name| after.contains_key(name)), "{:?} loses a file", job.arguments);
    }
    assert!(
        harm != Harm::ReadOnly || (!status.success() && after == before),
        "{:?} writes where it may not",
        job.arguments
    );
    tally.cycles += 1;
}

#[test]
fn nothing_is_half_written_and_nothing_is_left() {
    let is_full = std::env::var("SPLATSTREAM_DAMAGE").is_ok_and(|word| word == "full");
    let count = if is_full { 1000 } else { 24 };
    let inputs = directory();
    // Another user reads them where permissions are what stops a command.
    fs::set_permissions(inputs.path(), fs::Permissions::from_mode(0o755)).unwrap();
    let (still, stream) = (write_still(inputs.path()), write_stream(inputs.path()));
    let jobs = [
        Job::new(&["encode", text(&still), "--preset", "fast", "--quality", "low"], "out.gss"),
        Job::new(&["decode", text(&stream)], "frames"),
        Job::new(&["extract", text(&stream), "--op", "s0,t0,r1"], "out.gss"),
        Job::new(&["decode", text(&stream), "--frames", "1..2"], "frame.ply"),
    ];
    let mut random = SplitMix64::new(19);
    let mut tallies: BTreeMap<Harm, Tally> = BTreeMap::new();
    for number in 0..count {
        let (job, harm) = (&jobs[number % jobs.len()], HARMS[number / jobs.len() % HARMS.len()]);
        cycle(job, harm, &mut random, tallies.entry(harm).or_default());
    }
    println!("cycles of encoding and decoding: {count}; nothing half written");
    for (harm, Tally { cycles, succeeded, left }) in tallies {
        println!("{harm:?}: {cycles}, of which {succeeded} were done before; temporary files left: {left}");
    }
}
