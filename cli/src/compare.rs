//! `splatstream compare`: how far apart two scenes or streams are, attribute by attribute.

pub(crate) mod errors;
mod flicker;
mod grid;
pub(crate) mod matching;
pub(crate) mod pictures;

use crate::console::Console;
use crate::failure::{Failure, StreamFault, faults_text};
use crate::frames::{Frames, Opened};
use crate::input_args::InputArgs;
use crate::memory_bound::MemoryBound;
use crate::numbers::counted;
use crate::progress::Progress;
use crate::standard::STANDARD;
use crate::stream_file::LimitArgs;
use clap::{Args, ValueEnum};
use errors::{AttributeErrors, ErrorSums};
use matching::Matching;
use pictures::{PictureArgs, PictureErrors, Pictures};
use serde::Serialize;
use splatstream_encoder::canonical::canonicalise;
use splatstream_gaussians::GaussianFrame;
use std::cmp::Ordering;
use std::path::{Path, PathBuf};

/// Compare two scenes or streams: the error of each attribute and, with cameras, of pictures.
///
/// A and B are streams, scene files, or directories of frames; they are compared frame by frame, those that only one of them has
/// are left out. Files are frames in the order of their names; those of a directory with fewer frames than the other side are the
/// frames that their names number, as decode writes them. Both are brought into canonical form first, so that Gaussians
/// that render alike count as alike. Every Gaussian of the smaller frame is compared with its partner in the larger one.
#[derive(Args)]
#[command(after_help = "Examples:\n  splatstream compare frames/ talk.gss\n  \
    splatstream compare garden.ply garden.gss --match nearest --json\n  \
    splatstream compare garden.ply garden.gss --cameras ring:8 --height 1080")]
pub(crate) struct Compare {
    /// A stream, a scene, or a directory of frames; - is a stream or a scene on standard input, but no .splat or .ksplat.
    a: PathBuf,
    /// Another.
    b: PathBuf,
    /// How Gaussians find their partners.
    #[arg(long = "match", value_enum, default_value_t = Match::Auto)]
    matching: Match,
    #[command(flatten)]
    pictures: PictureArgs,
    #[command(flatten)]
    limits: LimitArgs,
    #[command(flatten)]
    reading: InputArgs,
}

/// How Gaussians find their partners.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Match {
    /// By order where counts are equal and positions correspond, by position elsewhere.
    Auto,
    /// The first with the first, and so on; counts must be equal.
    Order,
    /// The nearest; among those equally near, the one most alike.
    Nearest,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Report {
    a: PathBuf,
    b: PathBuf,
    frames: u32,
    frames_a: u32,
    frames_b: u32,
    gaussians_a: u64,
    gaussians_b: u64,
    pairs: u64,
    /// The matching of each frame.
    matched_by: Vec<Matching>,
    attributes: AttributeErrors,
    /// Errors of the streams.
    errors_a: Vec<StreamFault>,
    errors_b: Vec<StreamFault>,
    #[serde(flatten)]
    pictures: PictureErrors,
}

impl Compare {
    /// Compares frame by frame; frames that only one side has are counted and left alone.
    pub(crate) fn run(&self, console: &Console) -> Result<(), Failure> {
        if [&self.a, &self.b].iter().all(|path| path.as_path() == Path::new(STANDARD)) {
            return Err(Failure::Usage("only one of A and B can be standard input".to_owned()));
        }
        let options = self.limits.options_to_draw();
        let (opened_a, opened_b) =
            (Opened::open(&self.a, self.reading)?, Opened::open(&self.b, self.reading)?);
        let (mut frames_a, mut frames_b) =
            (opened_a.frames(&options, None)?, opened_b.frames(&options, None)?);
        let numbered = number_by_name(&mut frames_a, &mut frames_b);
        let mut report = self.empty_report();
        let mut sums = ErrorSums::default();
        let description =
            opened_a.description(&options.limits).or_else(|| opened_b.description(&options.limits));
        // 0 where it is not known.
        let is_sequence = [&frames_a, &frames_b].iter().all(|frames| frames.expected() != 1);
        let memory = MemoryBound::of(self.limits.memory());
        let mut pictures = self.pictures.start(description.unwrap_or_default(), memory, is_sequence)?;
        self.frames([&mut frames_a, &mut frames_b], &mut report, &mut sums, &mut pictures)?;
        report.pairs = sums.pairs();
        report.attributes = sums.errors();
        report.pictures = pictures.errors();
        (report.errors_a, report.errors_b) = (frames_a.faults(), frames_b.faults());
        report.pictures.warning().into_iter().for_each(|warning| console.complain(&warning));
        report.left_out(numbered).into_iter().for_each(|warning| console.complain(&warning));
        let notes = frames_a.warnings().into_iter().chain(frames_b.warnings());
        notes.for_each(|warning| console.complain(&warning.text()));
        console.report(&report, || report.text())?;
        frames_a.verdict().and_then(|()| frames_b.verdict())
    }

    /// Compares the frames that both sides have.
    fn frames(
        &self,
        [frames_a, frames_b]: [&mut Frames<'_>; 2],
        report: &mut Report,
        sums: &mut ErrorSums,
        pictures: &mut Pictures<'_>,
    ) -> Result<(), Failure> {
        let progress = Progress::frames("comparing", frames_a.expected().max(frames_b.expected()));
        let mut a = next(frames_a, &mut report.frames_a)?;
        let mut b = next(frames_b, &mut report.frames_b)?;
        while let Some(order) = order(a.as_ref(), b.as_ref()) {
            if let (Ordering::Equal, Some((number, a)), Some((_, b))) = (order, &a, &b) {
                self.frame(*number, [a, b], report, sums, pictures)?;
            }
            if order.is_le() {
                a = next(frames_a, &mut report.frames_a)?;
            }
            if order.is_ge() {
                b = next(frames_b, &mut report.frames_b)?;
            }
            progress.at(report.frames_a.max(report.frames_b));
        }
        Ok(())
    }

    fn empty_report(&self) -> Report {
        Report {
            a: self.a.clone(),
            b: self.b.clone(),
            frames: 0,
            frames_a: 0,
            frames_b: 0,
            gaussians_a: 0,
            gaussians_b: 0,
            pairs: 0,
            matched_by: Vec::new(),
            attributes: AttributeErrors::default(),
            errors_a: Vec::new(),
            errors_b: Vec::new(),
            pictures: PictureErrors::default(),
        }
    }

    fn frame(
        &self,
        number: u32,
        [a, b]: [&GaussianFrame; 2],
        report: &mut Report,
        sums: &mut ErrorSums,
        pictures: &mut Pictures<'_>,
    ) -> Result<(), Failure> {
        if self.matching == Match::Order && a.len() != b.len() {
            let [a, b] = [a, b].map(|frame| counted(frame.len() as u64, "Gaussian"));
            return Err(Failure::Usage(format!(
                "frame {number}: --match order needs equal counts, A has {a} and B {b}; \
                 use --match nearest"
            )));
        }
        report.frames += 1;
        report.gaussians_a += a.len() as u64;
        report.gaussians_b += b.len() as u64;
        report.matched_by.push(compare_frames(a, b, self.matching, sums));
        pictures.add(number, [a, b])
    }
}

/// Adds the errors between two frames; says how they were matched.
pub(crate) fn compare_frames(
    a: &GaussianFrame,
    b: &GaussianFrame,
    choice: Match,
    sums: &mut ErrorSums,
) -> Matching {
    let [a, b] = [a, b].map(|frame| canonicalise(frame.clone(), true));
    let (small, large) = if b.len() <= a.len() { (&b, &a) } else { (&a, &b) };
    let (matching, partners) = matching::partners(small, large, choice);
    sums.add(small, large, &partners);
    matching
}

/// Where one side has fewer frames, and they are files: takes them for the frames that their names number. Says which side that is.
fn number_by_name(a: &mut Frames<'_>, b: &mut Frames<'_>) -> Option<&'static str> {
    let (of_a, of_b) = (a.expected(), b.expected());
    match of_a.cmp(&of_b) {
        Ordering::Less => a.number_by_name(of_b).then_some("A"),
        Ordering::Greater => b.number_by_name(of_a).then_some("B"),
        Ordering::Equal => None,
    }
}

/// Which of two frames comes first in display order; none if there is no frame.
fn order(a: Option<&(u32, GaussianFrame)>, b: Option<&(u32, GaussianFrame)>) -> Option<Ordering> {
    match (a, b) {
        (None, None) => None,
        (Some(_), None) => Some(Ordering::Less),
        (None, Some(_)) => Some(Ordering::Greater),
        (Some((a, _)), Some((b, _))) => Some(a.cmp(b)),
    }
}

fn next(frames: &mut Frames<'_>, count: &mut u32) -> Result<Option<(u32, GaussianFrame)>, Failure> {
    let frame = frames.next()?;
    *count += u32::from(frame.is_some());
    Ok(frame)
}

impl Report {
    /// What to say where a side has frames that the other one lacks. `numbered`: the side whose frames names number.
    fn left_out(&self, numbered: Option<&str>) -> Option<String> {
        let [a, b] = [self.frames_a, self.frames_b].map(|frames| frames.saturating_sub(self.frames));
        let of_side = |count: u32, side: &str| {
            (count > 0).then(|| format!("{} that only {side} has", crate::numbers::frames(count)))
        };
        let left_out: Vec<String> = [of_side(a, "A"), of_side(b, "B")].into_iter().flatten().collect();
        let by_name = numbered.map(|side| format!("; frames of {side} are those that their names number"));
        (!left_out.is_empty())
            .then(|| format!("warning: not compared: {}{}", left_out.join(", "), by_name.unwrap_or_default()))
    }

    fn text(&self) -> String {
        let side = |name, path: &Path, frames: u32, gaussians, errors: &[StreamFault]| {
            let (path, frames) = (path.display(), crate::numbers::frames(frames));
            let gaussians = counted(gaussians, "Gaussian");
            let errors = faults_text(errors);
            format!("{name} {path}: {frames}, {gaussians} in those compared\n{errors}")
        };
        let mut text = side("A", &self.a, self.frames_a, self.gaussians_a, &self.errors_a);
        text += &side("B", &self.b, self.frames_b, self.gaussians_b, &self.errors_b);
        let by_order = self.matched_by.iter().filter(|matching| **matching == Matching::Order).count() as u32;
        text += &format!(
            "{} compared, {}; {} matched by order, {} by nearest position\n\n",
            crate::numbers::frames(self.frames),
            counted(self.pairs, "pair"),
            crate::numbers::frames(by_order),
            self.frames - by_order,
        );
        text + &self.attributes.text() + &self.pictures.text()
    }
}
