//! A stream on disk, and how much a command agrees to decode of it.

use crate::failure::{Failure, Instead};
use crate::input_args::parse_size;
use crate::machine;
use crate::standard::STANDARD;
use clap::Args;
use splatstream_decoder::operating_point::OperatingPoint;
use splatstream_decoder::process::{Budget, Options};
use splatstream_format::payload::SceneDescription;
use splatstream_format::syntax::{FileHeader, SIGNATURE, SequenceParameters, UnitType};
use splatstream_format::unit::{Landmark, Stream};
use splatstream_format::unit_reader::{Event, UnitReader};
use splatstream_format::{Error, ErrorKind, Limits};
use splatstream_stream::structure::{Gop, Structure};
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

/// How large a stream may be.
#[derive(Args)]
pub(crate) struct SizeArgs {
    /// Gaussians that a frame may have; a stream that asks for more is refused (exit code 13). Above the default,
    /// the other limits are those of level 4. No stream may have more than its own level allows.
    #[arg(long, value_name = "N", default_value_t = Limits::default().max_gaussians)]
    #[arg(value_parser = clap::value_parser!(u32).range(1..))]
    max_gaussians: u32,
}

/// How much a stream may ask of this machine where it is decoded.
#[derive(Args)]
pub(crate) struct LimitArgs {
    #[command(flatten)]
    size: SizeArgs,

    /// Most memory that decoding may take, as in 512M or 4G; a stream that asks for more is refused (exit code 13)
    /// [default: three quarters of what this machine has free, and a quarter of that where frames are drawn or
    /// compared].
    #[arg(long, value_name = "SIZE", value_parser = parse_size)]
    max_memory: Option<u64>,
}

impl SizeArgs {
    /// The limits asked for.
    pub(crate) fn limits(&self) -> Limits {
        let default = Limits::default();
        // Whoever asks for more Gaussians than the default asks for what goes with them: their rate, and what is learned.
        let others = match self.max_gaussians > default.max_gaussians {
            true => Limits::of_level(*Limits::LEVELS.end()),
            false => default,
        };
        Limits { max_gaussians: self.max_gaussians, ..others }
    }
}

impl LimitArgs {
    /// The limits asked for.
    pub(crate) fn limits(&self) -> Limits {
        self.size.limits()
    }

    /// Bytes of memory that are asked for, or that there are.
    pub(crate) fn memory(&self) -> u64 {
        self.max_memory.unwrap_or_else(machine::memory)
    }

    /// How to decode: all of a stream, within the limits and the memory asked for, or that there is.
    pub(crate) fn options(&self) -> Options {
        self.within(machine::memory())
    }

    /// The same where frames are drawn or compared, which takes up to three times what decoding them takes, and some are
    /// decoded side by side.
    pub(crate) fn options_to_draw(&self) -> Options {
        self.within(machine::memory() / 4)
    }

    fn within(&self, memory: u64) -> Options {
        let budget = Budget { memory: self.max_memory.unwrap_or(memory), ..Budget::UNLIMITED };
        Options { limits: self.limits(), budget, ..Options::default() }
    }
}

/// The failure of a directory that is given for a stream.
fn is_directory(path: &Path) -> Failure {
    let name = path.display();
    let advice = match path.join("manifest.json").is_file() {
        true => format!(
            "it is a package: `splatstream serve {name} --player` plays it, `splatstream unpackage {name}` makes a stream of it"
        ),
        false => "give a file in it".to_owned(),
    };
    Failure::other(format!("{name}: is a directory, and no stream\n  {advice}"))
}

/// The bytes of a stream and the file they came from.
pub(crate) struct StreamFile {
    /// The file.
    pub(crate) path: PathBuf,
    /// All of it, as far as there are units.
    pub(crate) bytes: Vec<u8>,
}

impl StreamFile {
    /// Reads a file, or standard input, as far as it is a stream: of one that does not start like one only the start, which
    /// says so. It may be of any length, or have no end.
    pub(crate) fn read(path: &Path) -> Result<Self, Failure> {
        if path.is_dir() {
            return Err(is_directory(path));
        }
        let bytes = match path == Path::new(STANDARD) {
            true => read_stream(io::stdin().lock()),
            false => File::open(path).and_then(read_stream),
        };
        let bytes = bytes.map_err(|error| Failure::file("read", path, &error))?;
        Ok(Self { path: path.to_path_buf(), bytes })
    }

    /// A failure of this stream.
    pub(crate) fn fault(&self, error: Error) -> Failure {
        Failure::Stream {
            path: self.path.clone(),
            error,
            instead: if self.bytes.is_empty() { Instead::Empty } else { instead(&self.path, &error) },
            level: FileHeader::parse(&self.bytes).ok().map(|(header, _)| header.level),
        }
    }

    /// The first error in the units: one that is cut off, or whose payload is not the one that was written. Nothing is decoded.
    pub(crate) fn damage(&self, limits: &Limits) -> Option<Error> {
        let mut units = match Stream::open(&self.bytes, limits) {
            Ok(stream) => stream.units(),
            Err(error) => return Some(error),
        };
        units.find_map(|unit| unit.and_then(|unit| unit.check_payload()).err())
    }

    /// The first sequence parameters that are intact.
    pub(crate) fn sequence(&self, limits: &Limits) -> Option<SequenceParameters> {
        let stream = Stream::open(&self.bytes, limits).ok()?;
        let at = Landmark::SequenceParameters.find(&self.bytes, FileHeader::SIZE)?;
        let (unit, profile) = (stream.units_from(at as u64).next()?.ok()?, stream.header().profile());
        SequenceParameters::parse_payload(unit.payload, unit.payload_at, profile).ok()
    }

    /// How many frames there are: as many as the stream announces or, where it announces none, as its GOPs have if its end unit
    /// shows that all of them came. 0 if nothing tells.
    pub(crate) fn frame_count(&self, limits: &Limits) -> u32 {
        let announced = self.announced(limits);
        announced.unwrap_or_else(|| Self::counted(&Structure::of(&self.bytes, limits)))
    }

    /// The same where the structure of the stream is known.
    pub(crate) fn frame_count_of(&self, structure: &Structure, limits: &Limits) -> u32 {
        self.announced(limits).unwrap_or_else(|| Self::counted(structure))
    }

    fn announced(&self, limits: &Limits) -> Option<u32> {
        self.sequence(limits).map(|sequence| sequence.frame_count).filter(|&count| count > 0)
    }

    fn counted(structure: &Structure) -> u32 {
        structure.gops.last().filter(|_| structure.has_all_units()).map_or(0, Gop::end)
    }

    /// What the stream says about its scene.
    pub(crate) fn description(&self, limits: &Limits) -> Option<SceneDescription> {
        let stream = Stream::open(&self.bytes, limits).ok()?;
        let before_gops = stream.units().map_while(|unit| match unit {
            Ok(unit) if unit.header.unit_type() == UnitType::GopHeader => None,
            unit => Some(unit),
        });
        let mut found =
            before_gops.flatten().filter(|unit| unit.header.unit_type() == UnitType::SceneDescription);
        let unit = found.next()?;
        SceneDescription::parse(unit.payload, unit.payload_at).ok()
    }

    /// The operating point of all that the stream has.
    pub(crate) fn highest_point(&self, limits: &Limits) -> OperatingPoint {
        self.sequence(limits).map_or(OperatingPoint::ALL, |sequence| OperatingPoint::highest(&sequence))
    }

    /// Refuses an operating point that the stream cannot have: it would silently be another one.
    pub(crate) fn check_point(&self, point: OperatingPoint, limits: &Limits) -> Result<(), Failure> {
        let Some(sequence) = self.sequence(limits) else {
            return Ok(());
        };
        let last = OperatingPoint::highest(&sequence);
        if point.is_within(last) {
            return Ok(());
        }
        let path = self.path.display();
        Err(Failure::Usage(format!(
            "{path}: there is no operating point {point}; the points go from s0,t0,r0 to {last}: \
             `splatstream inspect --ops {path}` lists them"
        )))
    }
}

/// A failure of the stream at a path, which may be a scene instead.
pub(crate) fn fault(path: &Path, error: Error) -> Failure {
    Failure::Stream { path: path.to_path_buf(), error, instead: instead(path, &error), level: level_of(path) }
}

/// What is given for a stream, if it does not begin like one.
fn instead(path: &Path, error: &Error) -> Instead {
    let is_empty = || path.metadata().is_ok_and(|found| found.is_file() && found.len() == 0);
    match error.kind {
        ErrorKind::Signature if splatstream_files::detect(path).is_ok() => Instead::Scene,
        _ if error.at == 0 && is_empty() => Instead::Empty,
        ErrorKind::Signature => of_start(&start_of::<16>(path).unwrap_or_default()),
        _ => Instead::Nothing,
    }
}

/// What a file is that begins with these bytes.
fn of_start(start: &[u8; 16]) -> Instead {
    let [_, _, _, _, kind @ .., _, _, _, _, _, _, _, _] = start;
    match start.to_ascii_lowercase().starts_with(b"<!doctype html") {
        true => Instead::Page,
        false if [b"ftyp", b"styp", b"moof", b"sidx"].contains(&kind) => Instead::Package,
        false => Instead::Nothing,
    }
}

/// The first bytes of a file, if it has as many; of what comes by a pipe, they have gone by.
fn start_of<const COUNT: usize>(path: &Path) -> Option<[u8; COUNT]> {
    let mut start = [0; COUNT];
    let mut file = path.is_file().then(|| File::open(path)).and_then(Result::ok)?;
    file.read_exact(&mut start).ok()?;
    Some(start)
}

/// The level of the stream in a file, if that is known.
fn level_of(path: &Path) -> Option<u8> {
    let start = start_of::<{ FileHeader::SIZE }>(path)?;
    FileHeader::parse(&start).ok().map(|(header, _)| header.level)
}

/// The bytes at a path, or of standard input, as they come.
pub(crate) fn open_pieces(path: &Path) -> Result<Box<dyn Read>, Failure> {
    if path == Path::new(STANDARD) {
        return Ok(Box::new(io::stdin().lock()));
    }
    let file = File::open(path).map_err(|error| Failure::file("read", path, &error))?;
    Ok(Box::new(file))
}

/// Bytes that are read at once.
const PIECE: usize = 1 << 16;

/// Gives `take` the bytes of a stream from where it has come to on, and whether they are the last. It says where it has
/// come to, or nothing if it needs no more. Only what it has not taken yet is kept; gives the number of bytes read.
pub(crate) fn feed(
    reader: &mut dyn Read,
    take: &mut dyn FnMut(&[u8], bool) -> Option<u64>,
) -> io::Result<u64> {
    let (mut kept, mut at, mut bytes) = (Vec::new(), 0_u64, 0);
    let mut piece = vec![0; PIECE];
    loop {
        let count = match reader.read(&mut piece) {
            Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
            count => count?,
        };
        kept.extend_from_slice(&piece[..count]);
        bytes += count as u64;
        let is_end = count == 0;
        let Some(position) = take(&kept, is_end).filter(|_| !is_end) else { return Ok(bytes) };
        let taken = usize::try_from(position - at).map_or(kept.len(), |taken| taken.min(kept.len()));
        kept.drain(..taken);
        at += taken as u64;
    }
}

/// Bytes that are read without an intact unit among them, or as many as there were before if that is more: damage is
/// skipped, but a rest that has no unit and perhaps no end need not be held.
const LOST: u64 = 64 << 20;

/// The bytes of a stream, as far as its units go. What is wrong with those after them can be seen from the first; an
/// error that counts them counts those that were read.
fn read_stream(mut file: impl Read) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut units = UnitReader::new(&Limits { max_units: u32::MAX, ..Limits::default() });
    let mut intact = 0;
    while let Some(missing) = next_missing(&mut units, &bytes, &mut intact) {
        if file.by_ref().take(missing.max(PIECE as u64)).read_to_end(&mut bytes)? == 0 {
            break;
        }
    }
    Ok(bytes)
}

/// Goes over the units that are there, and says how many bytes are missing for the next; none if it is not worth reading on.
/// `intact` is where the last intact unit ends.
fn next_missing(units: &mut UnitReader, bytes: &[u8], intact: &mut u64) -> Option<u64> {
    loop {
        let at = usize::try_from(units.position()).ok()?;
        match units.read(bytes.get(at..).unwrap_or_default(), false) {
            Ok(Event::FileHeader(_)) => *intact = units.position(),
            Ok(Event::Unit(unit)) => {
                if unit.check_payload().is_ok() {
                    *intact = units.position();
                }
                // Decoders look whether it is the end.
                units.reopen();
            }
            Ok(Event::NeedMoreData(missing)) => {
                let lost = units.position().saturating_sub(*intact);
                return (lost <= LOST.max(*intact)).then_some(missing);
            }
            Ok(Event::End) => return None,
            Err(_) => units.scan_for(Landmark::GopHeader),
        }
    }
}

/// Whether a file starts like a stream; no if it cannot be read.
pub(crate) fn is_stream(path: &Path) -> bool {
    let mut start = [0; SIGNATURE.len()];
    File::open(path).and_then(|mut file| file.read_exact(&mut start)).is_ok() && start == SIGNATURE
}

#[cfg(test)]
mod tests {
    use super::*;
    use splatstream_format::syntax::{Profile, UnitId};
    use splatstream_format::unit::{write_file_header, write_unit};

    fn stream() -> Vec<u8> {
        let mut bytes = write_file_header(Profile::Dynamic, 1).unwrap();
        write_unit(&mut bytes, UnitId::stream(UnitType::SceneDescription), &[7; 1000]).unwrap();
        bytes
    }

    #[test]
    fn a_stream_is_read_as_far_as_it_is_one() {
        let whole = stream();
        assert_eq!(read_stream(whole.as_slice()).unwrap(), whole);
        // A rest without an end is left, what it starts with is not.
        let read = read_stream(whole.as_slice().chain(io::repeat(0))).unwrap();
        assert!(read.starts_with(&whole) && read.len() as u64 <= LOST + (1 << 20), "{}", read.len());
        assert!(read_stream(io::repeat(0)).unwrap().len() <= PIECE);
        // A unit is read whole that says how long it is, damaged or not.
        let mut long = whole.clone();
        let payload = vec![1; usize::try_from(LOST).unwrap() + 5];
        write_unit(&mut long, UnitId::stream(UnitType::SceneDescription), &payload).unwrap();
        *long.last_mut().unwrap() ^= 1;
        assert_eq!(read_stream(long.as_slice()).unwrap().len(), long.len());
    }
}
