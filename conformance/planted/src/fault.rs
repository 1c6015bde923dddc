//! The faults.

use crate::frames::{
    drop_last_gaussian, fill_with_noise, fill_with_zeros, flip_last_bit, forget_compensation, keep_all_but_b,
    reverse,
};
use clap::ValueEnum;
use splatstream_conformance::protocol::{EVERYTHING, Request};
use splatstream_conformance::reference::{Decoded, decode};
use splatstream_conformance::vector::Mode;
use splatstream_format::Class;
use std::fs::{self, OpenOptions};
use std::io::{self, Write};
use std::path::Path;
use std::process::abort;
use std::thread;
use std::time::Duration;

/// What a planted decoder does wrong; everything else is right.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Fault {
    /// None: the reference.
    None,
    /// Accepts and writes nothing.
    #[value(name = "always-0")]
    Always0,
    /// Calls every stream invalid.
    AlwaysReject,
    /// Shows what there is of a broken stream and accepts it.
    AcceptsEverything,
    /// Writes noise into files that are right by name and size.
    GarbageOut,
    /// Aborts where it should reject.
    Crash,
    /// Aborts.
    CrashAlways,
    /// Never ends.
    Hang,
    /// One value of the last frame is off by one.
    OneLsbInLastFrame,
    /// The Gaussians of a frame stand in another order.
    SortedDifferently,
    /// Frames lack their last Gaussian.
    WrongCount,
    /// B frames are not shown.
    IgnoresB,
    /// Decodes everything, whatever it is asked for.
    WrongOperatingPoint,
    /// Leaves a file that nobody asked for.
    ExtraFiles,
    /// Writes zeros, and says that they are right.
    SelfReportedHash,
    /// Calls malformed what is invalid, and invalid what is anything else.
    WrongClass,
    /// Shows carried Gaussians in a subset too.
    IgnoresSubsetMode,
    /// Shows values without compensation.
    IgnoresCompensation,
    /// The last entropy state is off by one.
    WrongEntropy,
    /// Writes the bytes of each value the other way round.
    BigEndian,
    /// Removes the folder that it was given.
    RemovesFolder,
    /// Takes memory until there is no more.
    OutOfMemory,
    /// Writes until the disk is full.
    EndlessOutput,
}

impl Fault {
    /// Does what is asked, but for the fault; gives the exit code.
    pub(crate) fn answer(self, request: &Request) -> io::Result<i32> {
        match self {
            Self::Always0 => Ok(0),
            Self::AlwaysReject => Ok(Class::Invalid.exit_code().into()),
            Self::CrashAlways => abort(),
            Self::Hang => loop {
                thread::sleep(Duration::from_secs(1));
            },
            Self::OutOfMemory => take_memory(),
            Self::EndlessOutput => fill_disk(request),
            Self::WrongOperatingPoint => {
                write(decode(&Request { op: EVERYTHING.to_owned(), ..request.clone() })?, request)
            }
            Self::IgnoresSubsetMode => {
                write(decode(&Request { mode: Mode::Full, ..request.clone() })?, request)
            }
            _ => self.change(decode(request)?, request),
        }
    }

    /// Changes what the reference decoded.
    fn change(self, mut decoded: Decoded, request: &Request) -> io::Result<i32> {
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
            Self::ExtraFiles => fs::write(request.out.join("decoder.log"), "all is well\n")?,
            Self::WrongEntropy => decoded.entropy.last_mut().into_iter().for_each(|(_, state)| *state ^= 1),
            Self::Crash if decoded.error.is_some() => abort(),
            _ => {}
        }
        let code = write(decoded, request)?;
        match self {
            Self::BigEndian => turn_values(&request.out)?,
            Self::RemovesFolder => fs::remove_dir_all(&request.out)?,
            _ => {}
        }
        Ok(match (self, Class::of_exit_code(code)) {
            (Self::AcceptsEverything, _) => 0,
            (Self::WrongClass, Some(Class::Invalid)) => Class::Malformed.exit_code().into(),
            (Self::WrongClass, Some(_)) => Class::Invalid.exit_code().into(),
            _ => code,
        })
    }
}

/// Writes frames as they are; gives the exit code.
fn write(decoded: Decoded, request: &Request) -> io::Result<i32> {
    let (code, _) = decoded.verdict();
    decoded.write(&request.out)?;
    Ok(code)
}

/// Reverses each four bytes of the files of planes in a folder.
fn turn_values(folder: &Path) -> io::Result<()> {
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

/// Takes memory, page by page, and keeps it.
fn take_memory() -> ! {
    let mut taken: Vec<Vec<u8>> = Vec::new();
    loop {
        taken.push(vec![1; 1 << 20]);
    }
}

/// Appends to a file of the right name.
fn fill_disk(request: &Request) -> io::Result<i32> {
    let mut file =
        OpenOptions::new().create(true).append(true).open(request.out.join("f0000.position.i32"))?;
    loop {
        file.write_all(&[0; 1 << 16])?;
    }
}
