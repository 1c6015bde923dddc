//! What readers of scenes have changed on the way, for users.

use crate::encode::warnings::Warning;
use crate::numbers::counted;
use splatstream_files::Note;
use std::collections::BTreeSet;

/// Notes of the frames read so far: the first of each kind, and the frames that have one.
#[derive(Default)]
pub(crate) struct ReadNotes(Vec<(Note, BTreeSet<u32>)>);

impl ReadNotes {
    /// Takes the notes of a frame, which may be read again.
    pub(crate) fn add(&mut self, frame: u32, notes: Vec<Note>) {
        for note in notes {
            match self.0.iter_mut().find(|(known, _)| known.code() == note.code()) {
                Some((_, frames)) => {
                    frames.insert(frame);
                }
                None => self.0.push((note, BTreeSet::from([frame]))),
            }
        }
    }

    /// In words; `name` says what a frame is called.
    pub(crate) fn warnings(&self, name: &dyn Fn(u32) -> String) -> Vec<Warning> {
        let warning = |(note, frames): &(Note, BTreeSet<u32>)| {
            let first = frames.first().map(|&frame| name(frame)).unwrap_or_default();
            let others = match frames.len() {
                0 | 1 => String::new(),
                count => format!("; as in {} more", counted(count as u64 - 1, "frame")),
            };
            Warning::new(note.code(), format!("{first}: {note}{others}"))
        };
        self.0.iter().map(warning).collect()
    }
}
