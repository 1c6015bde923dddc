//! A progress bar on standard error; none where that is not a terminal.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::{self, IsTerminal, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// What is shown of one frame.
const ONE_FRAME: &str = "{spinner} {msg}, {elapsed} gone";

/// Between two lines where nobody sees a bar.
const LINES: Duration = Duration::from_secs(30);

/// Whether nobody wants to know how far a command has come.
static IS_QUIET: AtomicBool = AtomicBool::new(false);

/// Shows no progress from now on, or again.
pub(crate) fn set_quiet(quiet: bool) {
    IS_QUIET.store(quiet, Ordering::Relaxed);
}

/// How far a command has come.
pub(crate) struct Progress {
    bar: ProgressBar,
    /// The last line, of a command that writes lines instead of a bar.
    line: Option<Mutex<Option<Instant>>>,
}

impl Progress {
    /// A bar for `frames` frames; 0 if their number is not known. `verb` is "encoding" or the like.
    pub(crate) fn frames(verb: &'static str, frames: u32) -> Self {
        // A bar of one frame would stand at 0 until all is done.
        let template =
            if frames == 1 { ONE_FRAME } else { "{msg} {wide_bar} {pos}/{len} frames, {eta} left" };
        Self::new(frames, template).named(verb)
    }

    /// A bar for `files` files.
    pub(crate) fn files(verb: &'static str, files: u32) -> Self {
        Self::new(files, "{msg} {wide_bar} {pos}/{len} files, {eta} left").named(verb)
    }

    /// A bar for `cases` cases of a conformance suite; where standard error is no terminal, a line now and then.
    pub(crate) fn cases(cases: u32) -> Self {
        let mut progress = Self::new(cases, "testing {wide_bar} {pos}/{len} cases, {eta} left");
        progress.line = progress.lines_from(Some(Instant::now()));
        progress
    }

    /// A bar for `steps` steps that take about the same time, each with a name; where standard error is no terminal, the
    /// first name and then one now and then.
    pub(crate) fn steps(steps: u32) -> Self {
        let mut progress = Self::new(steps, "{pos}/{len} {wide_bar} {elapsed} gone, {eta} left\n{msg}");
        progress.line = progress.lines_from(None);
        progress
    }

    /// Lines in place of the bar that nobody sees, the last of them at this time.
    fn lines_from(&self, last: Option<Instant>) -> Option<Mutex<Option<Instant>>> {
        (self.bar.is_hidden() && !IS_QUIET.load(Ordering::Relaxed)).then(|| Mutex::new(last))
    }

    fn new(length: u32, template: &str) -> Self {
        let is_seen = io::stderr().is_terminal() && !IS_QUIET.load(Ordering::Relaxed);
        let target = if is_seen { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
        let length = (length > 0).then_some(u64::from(length));
        let bar = ProgressBar::with_draw_target(length, target);
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        // It takes a thread.
        if is_seen {
            bar.enable_steady_tick(Duration::from_millis(200));
        }
        Self { bar, line: None }
    }

    fn named(self, name: &'static str) -> Self {
        self.bar.set_message(name);
        self
    }

    /// That there are so many frames.
    pub(crate) fn of(&self, frames: u32) {
        self.bar.set_length(frames.into());
    }

    /// Tells what is being done, from any thread.
    pub(crate) fn teller(&self) -> impl Fn(String) + Send + Sync + 'static {
        let bar = self.bar.clone();
        move |what| bar.set_message(what)
    }

    /// `done` frames are done.
    pub(crate) fn at(&self, done: u32) {
        self.bar.set_position(done.into());
    }

    /// Writes a line, if it is time for one.
    fn tell(&self, step: &str) {
        let Some(line) = &self.line else { return };
        let mut last = line.lock().unwrap_or_else(PoisonError::into_inner);
        if last.is_none_or(|last| last.elapsed() >= LINES) {
            *last = Some(Instant::now());
            let done = match self.bar.length() {
                Some(all) => format!("{} of {all} done", self.bar.position()),
                None => "working".to_owned(),
            };
            let step = if step.is_empty() { String::new() } else { format!(": {step}") };
            let _nobody_listens = writeln!(io::stderr().lock(), "{done}{step}");
        }
    }
}

impl splatstream_chart::Progress for Progress {
    fn step(&self, name: String) {
        self.tell(&name);
        self.bar.set_message(name);
    }

    fn advance(&self) {
        self.bar.inc(1);
        self.tell("");
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
