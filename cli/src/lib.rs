//! The `splatstream` command. The only crate of the workspace that prints, exits or opens files by name.
//!
//! One file a subcommand; `console` speaks to the user, `failure` says what went wrong and what to do. A library, so that
//! the Python package has the same command ([`main`]) and the same options of encoding ([`EncodeOptions`]).

mod assumed_up;
mod cameras;
mod capture_files;
mod chart;
mod compare;
mod completions;
mod concat;
mod conformance;
mod console;
mod decode;
mod demo;
mod encode;
mod extract;
mod failure;
mod fit;
mod frame_files;
mod frame_name;
mod frames;
mod input_args;
mod inspect;
mod kept_settings;
mod likeness;
mod machine;
mod manual;
mod memory_bound;
mod missing_frames;
mod numbers;
mod output_directory;
mod output_file;
mod over_limit;
mod package;
mod play;
mod progress;
mod read_notes;
mod render;
mod seek;
mod serve;
mod setting_names;
mod short_frames;
mod simulate;
mod standard;
mod stream_file;
mod track;
mod train;
mod unfinished;
mod unpackage;
mod validate;
mod view;
mod whole_file;

use clap::{ArgMatches, CommandFactory, FromArgMatches, Parser, Subcommand};
use console::{Console, written};
use failure::{Failure, FailureReport};
use splatstream_format::syntax::SPECIFICATION;
use std::ffi::OsString;
use std::io::{self, Write};
use std::iter;
use std::sync::Arc;

pub use encode::{EncodeOptions, OptionsError, Prepared};

/// SplatStream: scalable, exact bitstreams of dynamic 3D Gaussian splatting.
#[derive(Parser)]
#[command(
    name = "splatstream",
    version = format!("{} (specification {SPECIFICATION})", env!("CARGO_PKG_VERSION")),
    about,
    after_help = "Example:\n  splatstream demo\n\n\
        Exit codes: 0 done, 1 files or settings, 2 usage, 3 a decoder that failed; of streams: 10 malformed, 11 invalid,\n\
        12 unsupported, 13 over a limit, 14 truncated; 130 interrupted.\n\n\
        Outputs: a file of the name given with -o is replaced, in one step when the new one is whole; a command that\n\
        fails leaves it as it was. Refused are files that the command reads, disks, and directories with files of an\n\
        earlier run. Those --force replaces, all together when the new ones are whole: until then the disk holds both.\n\n\
        The keys that --json prints are described in cli/json.md."
)]
struct Cli {
    /// Threads to use; default is one per processor. The result is the same with any number.
    #[arg(long, global = true, display_order = 100, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Print the result as JSON on standard output.
    #[arg(long, global = true, display_order = 100)]
    json: bool,
    /// Print no report and show no progress: nothing but warnings and errors, and with --json the JSON. The exit code tells the
    /// rest.
    #[arg(short, long, global = true, display_order = 100)]
    quiet: bool,
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Demo(demo::Demo),
    Encode(Box<encode::Encode>),
    Decode(decode::Decode),
    Inspect(inspect::Inspect),
    Validate(validate::Validate),
    Extract(extract::Extract),
    Concat(concat::Concat),
    Compare(compare::Compare),
    Render(render::Render),
    Chart(chart::Chart),
    Package(package::PackageStream),
    Unpackage(unpackage::Unpackage),
    Serve(serve::Serve),
    Play(play::Play),
    View(view::View),
    Train(train::Train),
    Simulate(simulate::Simulate),
    Fit(fit::Fit),
    Track(track::Track),
    Conformance(conformance::Conformance),
    Completions(completions::Completions),
    Manual(manual::Manual),
}

/// Runs the command with its arguments, the first of which is its name, and gives the exit code. Ends the process by
/// itself where arguments make no command, and after help.
pub fn main(arguments: &[OsString]) -> u8 {
    let matches =
        Cli::command().try_get_matches_from(arguments).unwrap_or_else(|error| refuse(&error, arguments));
    let command = name_of(&matches);
    let cli = Cli::from_arg_matches(&matches).unwrap_or_else(|error| error.exit());
    let console = Arc::new(Console::new(cli.json, cli.quiet));
    progress::set_quiet(cli.quiet);
    let told = Arc::clone(&console);
    unfinished::tell_by(cli.json, move |failure| told.fail(failure));
    let ended = in_threads(cli.threads, || cli.command.run(&console));
    let kept = unfinished::end(ended.is_ok());
    match ended {
        Ok(()) => 0,
        Err(failure) => {
            console.fail(&failure);
            kept.iter().for_each(|text| console.complain(&format!("  {text}")));
            if matches!(failure, Failure::Usage(_)) {
                console.complain(&format!("  {command} --help shows an example"));
            }
            failure.exit_code()
        }
    }
}

/// Arguments that make no command: told as usual, and as JSON where that is among them. Help is no error, unless it cannot be
/// written.
fn refuse(error: &clap::Error, arguments: &[OsString]) -> ! {
    if !error.use_stderr() {
        let shown = error.print().and_then(|()| io::stdout().flush());
        std::process::exit(written(shown).map_or_else(
            |failure| {
                Console::new(false, false).fail(&failure);
                failure.exit_code().into()
            },
            |()| 0,
        ));
    }
    if arguments.iter().any(|argument| argument == "--json") {
        let failure = Failure::Usage(error.to_string().trim_end().to_owned());
        let _nobody_listens = Console::new(true, true).report(&FailureReport::from(&failure), String::new);
    }
    error.exit()
}

/// The command with its subcommands, as it was called.
fn name_of(matches: &ArgMatches) -> String {
    let below = iter::successors(matches.subcommand(), |(_, matches)| matches.subcommand());
    iter::once("splatstream").chain(below.map(|(name, _)| name)).collect::<Vec<_>>().join(" ")
}

/// Runs `work` with so many threads, or one per processor.
fn in_threads(threads: Option<u16>, work: impl FnOnce() -> Result<(), Failure>) -> Result<(), Failure> {
    // 0 is one per processor. The thread that is here is none of them: it may wait for work without keeping any from it.
    let builder = rayon::ThreadPoolBuilder::new().num_threads(threads.unwrap_or(0).into());
    builder.build_global().map_err(|error| Failure::other(cannot_start(threads, &error.to_string())))?;
    work()
}

/// What to say where so many threads cannot be started, or one per processor.
fn cannot_start(threads: Option<u16>, error: &str) -> String {
    match threads {
        None => {
            format!("cannot start a thread per processor: {error}\n  give a number of them with --threads")
        }
        // Fewer would be none.
        Some(1) => format!(
            "cannot start a thread: {error}\n  the system lets this program have none: end others, or raise the limits of \
             processes and memory, as ulimit -u and -v show them"
        ),
        Some(count) => format!("cannot start {count} threads: {error}\n  give fewer with --threads"),
    }
}

impl Command {
    fn run(&self, console: &Console) -> Result<(), Failure> {
        match self {
            Self::Demo(command) => command.run(console),
            Self::Encode(command) => command.run(console),
            Self::Decode(command) => command.run(console),
            Self::Inspect(command) => command.run(console),
            Self::Validate(command) => command.run(console),
            Self::Extract(command) => command.run(console),
            Self::Concat(command) => command.run(console),
            Self::Compare(command) => command.run(console),
            Self::Render(command) => command.run(console),
            Self::Chart(command) => command.run(console),
            Self::Package(command) => command.run(console),
            Self::Unpackage(command) => command.run(console),
            Self::Serve(command) => command.run(console),
            Self::Play(command) => command.run(console),
            Self::View(command) => command.run(console),
            Self::Train(command) => command.run(console),
            Self::Simulate(command) => command.run(console),
            Self::Fit(command) => command.run(console),
            Self::Track(command) => command.run(console),
            Self::Conformance(command) => command.run(console),
            Self::Completions(command) => command.run(console),
            Self::Manual(command) => command.run(console),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::cannot_start;

    #[test]
    fn fewer_than_one_thread_is_no_advice() {
        let [one, two, all] = [Some(1), Some(2), None].map(|threads| cannot_start(threads, "no room"));
        assert!(one.starts_with("cannot start a thread: no room\n") && !one.contains("--threads"), "{one}");
        assert!(two.starts_with("cannot start 2 threads: no room\n") && two.contains("fewer"), "{two}");
        assert!(
            all.starts_with("cannot start a thread per processor: no room\n") && all.contains("--threads"),
            "{all}"
        );
    }
}
