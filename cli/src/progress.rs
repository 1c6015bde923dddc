//! A progress bar on standard error; none where that is not a terminal.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::{self, IsTerminal};
use std::time::Duration;

/// How far a command has come.
pub(crate) struct Progress(ProgressBar);

impl Progress {
    /// A bar for `frames` frames; 0 if their number is not known. `verb` is "encoding" or the like.
    pub(crate) fn frames(verb: &'static str, frames: u32) -> Self {
        Self::new(frames, "{msg} {wide_bar} {pos}/{len} frames, {eta} left").named(verb)
    }

    /// A bar for `cases` cases of a conformance suite.
    pub(crate) fn cases(cases: u32) -> Self {
        Self::new(cases, "testing {wide_bar} {pos}/{len} cases, {eta} left")
    }

    /// A bar for `steps` steps that take about the same time, each with a name.
    pub(crate) fn steps(steps: u32) -> Self {
        Self::new(steps, "{pos}/{len} {wide_bar} {elapsed} gone, {eta} left\n{msg}")
    }

    fn new(length: u32, template: &str) -> Self {
        let target = if io::stderr().is_terminal() {
            ProgressDrawTarget::stderr()
        } else {
            ProgressDrawTarget::hidden()
        };
        let length = (length > 0).then_some(u64::from(length));
        let bar = ProgressBar::with_draw_target(length, target);
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        bar.enable_steady_tick(Duration::from_millis(200));
        Self(bar)
    }

    fn named(self, name: &'static str) -> Self {
        self.0.set_message(name);
        self
    }

    /// `done` frames are done.
    pub(crate) fn at(&self, done: u32) {
        self.0.set_position(done.into());
    }

    /// The step that is under way.
    pub(crate) fn step(&self, name: String) {
        self.0.set_message(name);
    }

    /// A step is done.
    pub(crate) fn advance(&self) {
        self.0.inc(1);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
