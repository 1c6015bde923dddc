//! Sequences that outgrow one machine: `encode --write-plan` and `encode --shard`.

use super::Encode;
use super::failed::failed;
use super::output::is_page;
use super::warnings::Warning;
use crate::console::Console;
use crate::failure::Failure;
use crate::frame_files::FrameFiles;
use crate::numbers::counted;
use crate::output_file::{OutputFile, refuse_inputs};
use crate::whole_file::read_text;
use clap::Args;
use serde::{Deserialize, Serialize};
use splatstream_encoder::{Error, FrameSource, Plan, PlanRecord, Report, Settings, plan};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// What the file of a plan is.
const FORMAT: &str = "splatstream-plan-1";

/// The options for parts of a sequence.
#[derive(Args)]
pub(super) struct ShardArgs {
    /// Encode part I of N of the sequence, a whole number of GOPs; `splatstream concat` joins all N to the stream of a
    /// single run.
    #[arg(long, value_name = "I/N", value_parser = parse_shard, conflicts_with = "each")]
    shard: Option<(u32, u32)>,
    /// What holds for all shards, as --write-plan has found it with the same inputs and options; without it each shard
    /// finds it again, which reads all frames, fits the steps and codes the first GOP.
    #[arg(long, value_name = "PLAN.json", requires = "shard")]
    plan: Option<PathBuf>,
    /// Write what holds for all shards to OUT, and no stream.
    #[arg(long, conflicts_with_all = ["shard", "each"])]
    write_plan: bool,
}

/// The file of a plan.
#[derive(Serialize, Deserialize)]
struct PlanFile {
    format: String,
    frames: u32,
    /// Shards that it is good for, at most.
    most_shards: u32,
    plan: PlanRecord,
}

/// What `--write-plan --json` prints.
#[derive(Serialize)]
struct Planned<'a> {
    output: &'a Path,
    frames: u32,
    gaussians: u64,
    most_shards: u32,
    digest: String,
    seconds: f64,
    warnings: Vec<Warning>,
}

/// Where a shard is in its sequence.
#[derive(Serialize)]
pub(super) struct ShardReport {
    number: u32,
    count: u32,
    first_frame: u32,
    sequence_frames: u32,
}

impl ShardReport {
    /// A line for people.
    pub(super) fn text(&self) -> String {
        format!(
            "  shard              {} of {}, from frame {} of {} on\n",
            self.number, self.count, self.first_frame, self.sequence_frames
        )
    }
}

impl ShardArgs {
    pub(super) const fn writes_plan(&self) -> bool {
        self.write_plan
    }

    /// The option by which the sequence is divided, if it is.
    pub(super) const fn option(&self) -> Option<&'static str> {
        match (self.write_plan, self.shard) {
            (true, _) => Some("--write-plan"),
            (_, Some(_)) => Some("--shard"),
            _ => None,
        }
    }

    /// The plan that is read, if there is one.
    pub(super) const fn plan_file(&self) -> Option<&PathBuf> {
        self.plan.as_ref()
    }

    /// Refuses a web page of a shard, which has a part of the sequence.
    pub(super) fn check_name(&self, out: &Path) -> Result<(), Failure> {
        match self.shard {
            Some(_) if is_page(out) => Err(Failure::Usage(format!(
                "{}: a shard is a part of a stream: write it as .gss, and make the page of what concat joins, with `splatstream view`",
                out.display()
            ))),
            _ => Ok(()),
        }
    }

    /// The frames that are encoded and where they are in the sequence; none where all of it is.
    pub(super) fn open(
        &self,
        source: &mut FrameFiles,
        settings: &Settings,
        memory: u64,
    ) -> Result<Option<Shard>, Failure> {
        let Some(number) = self.shard else { return Ok(None) };
        let plan = match &self.plan {
            Some(path) => read(path, settings)?,
            None => {
                plan(source, settings).map_err(|error| failed(source, (Path::new("-"), memory), &error))?
            }
        };
        let frames = plan.frames_of_shard(number).map_err(|error| too_many(&error))?;
        let report = ShardReport {
            number: number.0,
            count: number.1,
            first_frame: frames.start,
            sequence_frames: source.len(),
        };
        Ok(Some(Shard { plan, number, frames: frames.end - frames.start, report }))
    }
}

/// A shard that is to be encoded.
pub(super) struct Shard {
    plan: Plan,
    number: (u32, u32),
    /// How many it has.
    pub(super) frames: u32,
    pub(super) report: ShardReport,
}

impl Shard {
    pub(super) fn encode(
        &self,
        source: &mut FrameFiles,
        sink: &mut dyn Write,
        progress: &mut dyn FnMut(u32, u32),
    ) -> Result<Report, Error> {
        self.plan.encode_shard(source, self.number, sink, progress)
    }
}

/// `--write-plan`.
pub(super) fn write_plan(command: &Encode, console: &Console) -> Result<(), Failure> {
    let (out, start) = (&command.out, Instant::now());
    console.claim(Some(out))?;
    refuse_inputs(out, &command.inputs)?;
    let is_json = out.extension().is_none_or(|extension| extension.eq_ignore_ascii_case("json"));
    if !is_json {
        let out = out.display();
        return Err(Failure::Usage(format!(
            "{out}: --write-plan writes JSON; give a name that ends in .json"
        )));
    }
    let memory = command.memory();
    let mut source = FrameFiles::find(&command.inputs, command.reading.within(memory))?.unchecked();
    let read = command.read_files(&source);
    refuse_inputs(out, &read)?;
    let (settings, decided) = command.settings_for(&mut source, (out, memory))?;
    let file = OutputFile::create(out, &read)?;
    let plan = plan(&mut source, &settings).map_err(|error| failed(&source, (out, memory), &error))?;
    let (most_shards, frames) = (plan.shards(), source.len());
    let plan = plan.record().map_err(|error| failed(&source, (out, memory), &error))?;
    let (digest, gaussians) =
        (format!("{:016x}", plan.digest()), plan.gaussians.iter().map(|&n| u64::from(n)).sum());
    let plan = PlanFile { format: FORMAT.to_owned(), frames, most_shards, plan };
    let text = serde_json::to_string_pretty(&plan).map_err(|error| Failure::other(error.to_string()))?;
    file.finish_with(format!("{text}\n").as_bytes())?;
    let seconds = start.elapsed().as_secs_f64();
    let others = command.unlike(&source, &command.inputs).into_iter().chain(source.warnings());
    let warnings: Vec<Warning> = decided.warnings().into_iter().chain(others).collect();
    warnings.iter().for_each(|warning| console.complain(&warning.text()));
    let report = Planned { output: out, frames, gaussians, most_shards, digest, seconds, warnings };
    console.report_beside(Some(out), &report, || {
        format!(
            "{}: {}, {}; for up to {}: --plan {0} --shard 1/N to N/N, with the same inputs and options\n",
            out.display(),
            counted(frames.into(), "frame"),
            counted(gaussians, "Gaussian"),
            counted(most_shards.into(), "shard"),
        )
    })
}

/// The plan of a file, made with these settings.
fn read(path: &Path, settings: &Settings) -> Result<Plan, Failure> {
    let text = read_text(path)?;
    let name = path.display();
    let none = |why: String| {
        Failure::other(format!(
            "{name}: is no plan: {why}\n  make one: `splatstream encode ... --write-plan -o PLAN.json`"
        ))
    };
    let file: PlanFile = serde_json::from_str(&text).map_err(|error| none(error.to_string()))?;
    if file.format != FORMAT {
        return Err(none(format!("its format is {}, this is {FORMAT}", file.format)));
    }
    Plan::from_record(&file.plan, settings).map_err(|error| Failure::other(format!("{name}: {error}")))
}

/// More shards than there can be is a matter of the arguments.
fn too_many(error: &Error) -> Failure {
    Failure::Usage(error.to_string())
}

fn parse_shard(text: &str) -> Result<(u32, u32), String> {
    let parse = || {
        let (number, count) = text.split_once('/')?;
        let (number, count) = (number.parse().ok()?, count.parse().ok()?);
        (1..=count).contains(&number).then_some((number, count))
    };
    parse()
        .ok_or_else(|| format!("'{text}' is not a shard; write 1/8 for the first of eight, 8/8 for the last"))
}
