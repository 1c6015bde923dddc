//! A progress bar on standard error; none where that is not a terminal.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::{self, IsTerminal};
use std::time::Duration;

/// How far a command has come with its frames.
pub(crate) struct Progress(ProgressBar);

impl Progress {
    /// A bar for `frames` frames; 0 if their number is not known. `verb` is "encoding" or the like.
    pub(crate) fn frames(verb: &'static str, frames: u32) -> Self {
        let target = if io::stderr().is_terminal() {
            ProgressDrawTarget::stderr()
        } else {
            ProgressDrawTarget::hidden()
        };
        let length = (frames > 0).then_some(u64::from(frames));
        let bar = ProgressBar::with_draw_target(length, target).with_message(verb);
        if let Ok(style) = ProgressStyle::with_template("{msg} {wide_bar} {pos}/{len} frames, {eta} left") {
            bar.set_style(style);
        }
        bar.enable_steady_tick(Duration::from_millis(200));
        Self(bar)
    }

    /// `done` frames are done.
    pub(crate) fn at(&self, done: u32) {
        self.0.set_position(done.into());
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
