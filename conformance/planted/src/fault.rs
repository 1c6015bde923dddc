//! The planted errors.

use crate::frames::{
    drop_last_gaussian, fill_with_noise, fill_with_zeros, flip_last_bit, forget_compensation, keep_all_but_b,
    reverse,
};
use crate::streams::{with_whole_anchor, without_increments_after};
use clap::ValueEnum;
use splatstream_conformance::protocol::{Diagnosis, EVERYTHING, Request};
use splatstream_conformance::reference::{Decoded, decode};
use splatstream_conformance::vector::Mode;
use splatstream_format::{Class, ErrorKind};
use std::fs::{self, OpenOptions};
use std::io::{self, Write};
use std::path::Path;
use std::process::abort;
use std::thread;
use std::time::Duration;

/// What a planted decoder does wrong; everything else is right.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Fault {
    /// Nothing: the reference.
    None,
    /// Accepts and writes nothing.
    #[value(name = "always-0")]
    Always0,
    /// Calls every stream invalid.
    AlwaysReject,
    /// Accepts streams with errors, and shows their frames.
    AcceptsEverything,
    /// Accepts truncated streams.
    AcceptsTruncated,
    /// Writes noise into files that are right by name and size.
    GarbageOut,
    /// Aborts instead of rejecting.
    Crash,
    /// Aborts.
    CrashAlways,
    /// Never ends.
    Hang,
    /// One value of the last frame is off by one.
    OneLsbInLastFrame,
    /// The Gaussians of a frame are in another order.
    SortedDifferently,
    /// Frames lack their last Gaussian.
    WrongCount,
    /// B frames are not shown.
    IgnoresB,
    /// Decodes everything at each operating point.
    WrongOperatingPoint,
    /// Writes a file that is not expected.
    ExtraFiles,
    /// Writes zeros, and reports that they are right.
    SelfReportedHash,
    /// Calls invalid streams malformed, and all others invalid.
    WrongClass,
    /// Reports the code RESERVED for every error.
    WrongCode,
    /// Shows carried lists in a subset too.
    IgnoresSubsetMode,
    /// Shows values without compensation.
    IgnoresCompensation,
    /// Shows no carried lists in frames with exact lists.
    NoMixedLists,
    /// Decodes every stream as if `whole_anchor` were 1.
    WholeAnchor,
    /// Drops all increments of a GOP after the first error.
    IgnoresLimit,
    /// Does not go on after an error that costs the rest of a GOP.
    NoResynchronisation,
    /// Reports no lost frames.
    ForgetsLost,
    /// Decodes an input that starts inside a stream as if it were a whole one.
    IgnoresInside,
    /// The last entropy state is wrong.
    WrongEntropy,
    /// Writes the bytes of each value in reverse order.
    BigEndian,
    /// Removes its output folder.
    RemovesFolder,
    /// Allocates memory until there is no more.
    OutOfMemory,
    /// Writes until the disk is full.
    EndlessOutput,
}

/// Exit code and diagnosis.
type Answer = (i32, Option<Diagnosis>);

impl Fault {
    /// Answers a request with this error.
    pub(crate) fn answer(self, request: &Request) -> io::Result<Answer> {
        match self {
            Self::Always0 => Ok((0, None)),
            Self::AlwaysReject => Ok((Class::Invalid.exit_code().into(), None)),
            Self::CrashAlways => abort(),
            Self::Hang => loop {
                thread::sleep(Duration::from_secs(1));
            },
            Self::OutOfMemory => take_memory(),
            Self::EndlessOutput => fill_disk(request),
            Self::WrongOperatingPoint => {
                write(decode(&Request { op: EVERYTHING.to_owned(), ..request.clone() })?, request)
            }
            Self::IgnoresSubsetMode => write(in_mode(request, Mode::Subset, Mode::Full)?, request),
            Self::NoMixedLists => write(in_mode(request, Mode::Full, Mode::Subset)?, request),
            Self::IgnoresInside => write(in_mode(request, Mode::Inside, Mode::Full)?, request),
            Self::WholeAnchor => write(of_changed(request, with_whole_anchor)?, request),
            Self::IgnoresLimit => {
                let Some(error) = decode(request)?.error else { return write(decode(request)?, request) };
                let change = |stream: &[u8]| without_increments_after(stream, error.at);
                write(of_changed(request, change)?, request)
            }
            _ => self.change(decode(request)?, request),
        }
    }

    /// Changes what the reference decoded.
    fn change(self, mut decoded: Decoded, request: &Request) -> io::Result<Answer> {
        let frames = &mut decoded.frames;
        match self {
            Self::GarbageOut => fill_with_noise(frames),
            Self::OneLsbInLastFrame => flip_last_bit(frames),
            Self::SortedDifferently => reverse(frames),
            Self::WrongCount => drop_last_gaussian(frames),
            Self::IgnoresB => keep_all_but_b(frames),
            Self::SelfReportedHash => {
                fill_with_zeros(frames);
                fs::write(request.out.join("meta.json"), "{\"result\":\"pass\",\"planes\":\"equal\"}\n")?;
            }
            Self::IgnoresCompensation => forget_compensation(frames),
            Self::NoResynchronisation => {
                let first_lost = decoded.lost.first().map_or(u32::MAX, |range| range[0]);
                frames.retain(|frame| frame.index < first_lost);
            }
            Self::ExtraFiles => fs::write(request.out.join("decoder.log"), "done\n")?,
            Self::WrongEntropy => decoded.entropy.last_mut().into_iter().for_each(|(_, state)| *state ^= 1),
            Self::ForgetsLost => decoded.lost.clear(),
            Self::Crash if decoded.error.is_some() => abort(),
            _ => {}
        }
        let is_truncated = matches!(decoded.error.map(|error| error.kind), Some(ErrorKind::Truncated { .. }));
        let (code, mut diagnosis) = write(decoded, request)?;
        match self {
            Self::BigEndian => reverse_bytes(&request.out)?,
            Self::RemovesFolder => fs::remove_dir_all(&request.out)?,
            Self::WrongCode => {
                let code = |diagnosis: &mut Diagnosis| diagnosis.code = Some("RESERVED".to_owned());
                diagnosis.as_mut().into_iter().for_each(code);
            }
            _ => {}
        }
        Ok(match (self, Class::of_exit_code(code)) {
            (Self::AcceptsEverything, _) => (0, None),
            (Self::AcceptsTruncated, _) if is_truncated => (0, None),
            (Self::WrongClass, Some(Class::Invalid)) => (Class::Malformed.exit_code().into(), None),
            (Self::WrongClass, Some(_)) => (Class::Invalid.exit_code().into(), None),
            _ => (code, diagnosis),
        })
    }
}

/// Decodes as the request says, but in another mode than one.
fn in_mode(request: &Request, mode: Mode, instead: Mode) -> io::Result<Decoded> {
    let mode = if request.mode == mode { instead } else { request.mode };
    decode(&Request { mode, ..request.clone() })
}

/// Decodes a changed stream.
fn of_changed(request: &Request, change: impl FnOnce(&[u8]) -> Vec<u8>) -> io::Result<Decoded> {
    let point = request.op.parse().map_err(|error| io::Error::new(io::ErrorKind::InvalidInput, error))?;
    Ok(Decoded::of(&change(&fs::read(&request.input)?), point, request.mode))
}

/// Writes frames; returns the answer.
fn write(decoded: Decoded, request: &Request) -> io::Result<Answer> {
    let answer = decoded.verdict();
    decoded.write(&request.out)?;
    Ok(answer)
}

/// Reverses each four bytes of the files of planes in a folder.
fn reverse_bytes(folder: &Path) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.extension().is_some_and(|extension| extension == "i32") {
            let mut bytes = fs::read(&path)?;
            bytes.chunks_mut(4).for_each(<[u8]>::reverse);
            fs::write(&path, bytes)?;
        }
    }
    Ok(())
}

/// Allocates memory and keeps it.
fn take_memory() -> ! {
    let mut taken: Vec<Vec<u8>> = Vec::new();
    loop {
        taken.push(vec![1; 1 << 20]);
    }
}

/// Appends to a file with a right name.
fn fill_disk(request: &Request) -> io::Result<Answer> {
    let mut file =
        OpenOptions::new().create(true).append(true).open(request.out.join("f0000.position.i32"))?;
    loop {
        file.write_all(&[0; 1 << 16])?;
    }
}
