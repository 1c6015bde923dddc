//! A span on its way through the threads of rayon.

use super::span::{Common, Span};
use crate::error::Error;
use crate::gop::SpanCoder;
use crate::importance::Ranking;
use crate::report::Report;
use crate::source::FrameSource;
use crate::window::Window;
use crate::writer::Coded;
use rayon::{Scope, Yield};
use std::io;
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};
use std::time::Duration;

/// A thread of the pool that has nothing else to do looks this often whether a span is coded.
const PAUSE: Duration = Duration::from_millis(1);

/// A span that is being coded.
pub(super) struct Job {
    pub(super) span: Span,
    events: Receiver<Event>,
}

/// What comes from the thread that codes a span.
enum Event {
    /// So many of its frames are done.
    Frames(u32),
    /// It is coded, or it cannot be.
    Done(Box<Result<(Coded, Report), Error>>),
}

impl Job {
    /// Reads the frames of a span, and hands it to another thread. A frame that cannot be read is an error of the span.
    pub(super) fn start<'s>(
        scope: &Scope<'s>,
        source: &mut dyn FrameSource,
        common: Common<'s>,
        span: Span,
        ranking: Ranking,
    ) -> Self {
        let (sender, events) = channel();
        match read(source, span) {
            Ok(window) => scope.spawn(move |_| code(window, common, span, ranking, &sender)),
            // The receiver is there.
            Err(error) => drop(sender.send(Event::Done(Box::new(Err(error))))),
        }
        Self { span, events }
    }

    /// What was coded, once it is. `progress` is told how many frames are done.
    pub(super) fn finish(self, progress: &mut dyn FnMut(u32)) -> Result<(Coded, Report), Error> {
        loop {
            match self.next() {
                Some(Event::Frames(frames)) => progress(frames),
                Some(Event::Done(result)) => return *result,
                // The thread has panicked, which the scope passes on when it ends.
                None => return Err(Error::Output(io::Error::other("a thread of the encoder has stopped"))),
            }
        }
    }

    /// Waits for what comes next. A thread of the pool works on meanwhile: it may be the only one.
    fn next(&self) -> Option<Event> {
        if rayon::current_thread_index().is_none() {
            return self.events.recv().ok();
        }
        loop {
            match self.events.try_recv() {
                Ok(event) => return Some(event),
                Err(TryRecvError::Disconnected) => return None,
                Err(TryRecvError::Empty) => {}
            }
            if rayon::yield_now() != Some(Yield::Executed)
                && let Ok(event) = self.events.recv_timeout(PAUSE)
            {
                return Some(event);
            }
        }
    }
}

fn read(source: &mut dyn FrameSource, span: Span) -> Result<Window, Error> {
    let read = |number| source.frame(number).map_err(|source| Error::Source { frame: number, source });
    let frames = (span.first..span.end).map(read).collect::<Result<_, _>>()?;
    Ok(Window { first: span.first, frames, ..Window::default() })
}

fn code(mut window: Window, common: Common<'_>, span: Span, ranking: Ranking, sender: &Sender<Event>) {
    let mut coded = Coded::default();
    // Nobody listens any more where an earlier span has failed.
    let mut progress = |frames| drop(sender.send(Event::Frames(frames)));
    let coder = SpanCoder::new(&mut window, common, ranking, &mut coded, &mut progress);
    let report = coder.code(span);
    drop(sender.send(Event::Done(Box::new(report.map(|report| (coded, report))))));
}
