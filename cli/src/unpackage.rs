//! `splatstream unpackage`: the stream that a package was made of.

use crate::console::Console;
use crate::failure::Failure;
use crate::numbers::counted;
use crate::output_file::{OutputFile, check_stream_name};
use crate::stream_file::SizeArgs;
use crate::whole_file::read_whole;
use clap::Args;
use serde::Serialize;
use splatstream_chart::numbers::grouped;
use splatstream_format::Class;
use splatstream_stream::manifest::Manifest;
use splatstream_stream::package::Package;
use splatstream_stream::unpackage::{unpackage, unpackage_growing};
use std::path::{Path, PathBuf};

/// Write the stream that a package was made of, byte for byte.
#[derive(Args)]
#[command(after_help = "Example:\n  splatstream unpackage talk/ -o talk.gss\n\n\
    Reads every .mp4 and .m4s file of the directory. A manifest beside them is used to check the result.")]
pub(crate) struct Unpackage {
    /// The directory of the package.
    #[arg(value_name = "DIR")]
    directory: PathBuf,
    /// The stream to write; - is standard output.
    #[arg(short, long = "out", value_name = "OUT.gss")]
    out: PathBuf,
    /// Of a live package that has not ended: write the GOPs that are complete, with an end made for them.
    #[arg(long)]
    incomplete: bool,
    #[command(flatten)]
    limits: SizeArgs,
}

/// The most that is read of a package, bytes: its stream is put together in memory.
const MOST: u64 = 8 << 30;

/// What `--json` prints.
#[derive(Serialize)]
struct Report<'a> {
    output: &'a Path,
    bytes: u64,
    files: usize,
    /// Whether a manifest says that these are the bytes that were packaged.
    verified: bool,
    /// Whether it is all of the stream: a live package has ended.
    complete: bool,
}

impl Unpackage {
    /// Puts the stream together.
    pub(crate) fn run(&self, console: &Console) -> Result<(), Failure> {
        console.claim(Some(&self.out))?;
        check_stream_name(&self.out)?;
        let mut paths = self.media()?;
        let manifest = self.manifest()?;
        self.check_complete(&paths, manifest.as_ref())?;
        let growing = manifest.as_ref().filter(|manifest| manifest.is_growing());
        match growing {
            Some(_) if !self.incomplete => return Err(self.not_ended()),
            // What comes after the complete GOPs is still being written.
            Some(manifest) => paths.retain(|path| is_complete(path, manifest)),
            None => self.check_ended(&paths)?,
        }
        let complete = growing.is_none();
        let mut files: Vec<(String, Vec<u8>)> = Vec::new();
        for path in &paths {
            let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
            match files.last_mut().filter(|_| part_of(path).is_some_and(|(_, part)| part > 0)) {
                // Segments of a live package follow their initialisation segment.
                Some((_, bytes)) => bytes.extend(read_whole(path, MOST)?),
                None => files.push((name, read_whole(path, MOST)?)),
            }
        }
        let given: Vec<_> = files.iter().map(|(name, bytes)| (name.clone(), bytes.as_slice())).collect();
        let put_together = if complete { unpackage } else { unpackage_growing };
        let stream = put_together(&given, &self.limits.limits());
        let stream = stream.map_err(|error| {
            let path = self.directory.join(&error.file);
            Failure::stream(if path.exists() { &path } else { &self.directory }, error.error)
        })?;
        let verified = self.verify(&stream, manifest.filter(|_| complete))?;
        let inputs = [paths.as_slice(), &[self.directory.join(Package::MANIFEST)]].concat();
        OutputFile::write_apart(&self.out, &inputs, &stream)?;
        let bytes = stream.len() as u64;
        let report = Report { output: &self.out, bytes, files: paths.len(), verified, complete };
        if !complete {
            console.complain(&format!(
                "warning: {}: the package is live and has not ended, so the stream is not complete; unpackage it again at its end",
                self.directory.display()
            ));
        }
        console.report_beside(Some(&self.out), &report, || report.text())
    }

    /// The files of Representations, by name.
    fn media(&self) -> Result<Vec<PathBuf>, Failure> {
        let failed = |error| Failure::file("read", &self.directory, &error);
        let mut paths = Vec::new();
        for entry in std::fs::read_dir(&self.directory).map_err(failed)? {
            let path = entry.map_err(failed)?.path();
            if part_of(&path).is_some() && path.is_file() {
                paths.push(path);
            }
        }
        paths.sort_by_key(|path| part_of(path));
        let bytes: u64 = paths.iter().filter_map(|path| path.metadata().ok()).map(|found| found.len()).sum();
        if bytes > MOST {
            let (directory, bytes) = (self.directory.display(), counted(bytes, "byte"));
            return Err(Failure::other(format!(
                "{directory}: the files have {bytes}, at most {} are read\n  check whether it is a package",
                grouped(MOST)
            )));
        }
        Ok(paths)
    }

    /// The manifest beside the files, if there is one.
    fn manifest(&self) -> Result<Option<Manifest>, Failure> {
        let path = self.directory.join(Package::MANIFEST);
        if !path.exists() {
            return Ok(None);
        }
        let manifest = Manifest::parse(&read_whole(&path, Manifest::MAX_BYTES as u64)?);
        manifest.map(Some).map_err(|error| Failure::other(format!("{}: {error}", path.display())))
    }

    /// Whether all files are there that the manifest names; without one, whether there is any.
    fn check_complete(&self, paths: &[PathBuf], manifest: Option<&Manifest>) -> Result<(), Failure> {
        if paths.is_empty() {
            let directory = self.directory.display();
            return Err(Failure::other(format!("{directory}: no .mp4 or .m4s files here\n  check the path")));
        }
        let mut names = manifest.into_iter().flat_map(files_of);
        match names.find(|name| !self.directory.join(name).is_file()) {
            None => Ok(()),
            Some(name) => Err(Failure::other(format!(
                "{}: the file is missing, and the manifest names it\n  copy the package again",
                self.directory.join(name).display()
            ))),
        }
    }

    /// A package that has not ended is no valid one yet, which is nobody's fault.
    fn not_ended(&self) -> Failure {
        let line = format!(
            "{}: the package is live and has not ended\n  \
             unpackage it when it has ended, or write the GOPs that are complete with --incomplete",
            self.directory.display()
        );
        Failure::Verdict { exit_code: Class::Invalid.exit_code(), line }
    }

    /// Whether a live package, whose manifest does not say that it grows, has its last file.
    fn check_ended(&self, paths: &[PathBuf]) -> Result<(), Failure> {
        let has = |name: &str| paths.iter().any(|path| path.file_name().is_some_and(|own| own == name));
        if !has("s0-init.mp4") || has("s0-end.m4s") {
            return Ok(());
        }
        Err(Failure::other(format!(
            "{}: the file is missing: the package is live and has not ended, or was not copied whole\n  \
             unpackage it when it has ended, or with the manifest that was written with its last GOP",
            self.directory.join("s0-end.m4s").display()
        )))
    }

    /// Whether there is a manifest; a stream that is not the one it describes is refused.
    fn verify(&self, stream: &[u8], manifest: Option<Manifest>) -> Result<bool, Failure> {
        let Some(manifest) = manifest else { return Ok(false) };
        if !manifest.describes(stream) {
            return Err(Failure::other(format!(
                "{}: the files are not those that the manifest was written for\n  copy the package again",
                self.directory.display()
            )));
        }
        Ok(true)
    }
}

/// Whether a file of a live package begins a Representation or has one of the complete GOPs, which are counted from 1.
fn is_complete(path: &Path, manifest: &Manifest) -> bool {
    let gops = manifest.first_gop().saturating_add(manifest.complete_gops() as u64);
    part_of(path).is_some_and(|(_, number)| number <= gops)
}

/// The files with media that a manifest names.
fn files_of(manifest: &Manifest) -> impl Iterator<Item = &str> {
    let of_representations = manifest.representations.iter().flat_map(|info| {
        let tail = info.tail_file.as_deref();
        [Some(info.file.as_str()), tail].into_iter().flatten()
    });
    let subsegments = manifest.gops.iter().flat_map(|gop| &gop.subsegments);
    of_representations.chain(subsegments.filter_map(|subsegment| subsegment.file.as_deref()))
}

/// The Representation that a file says it is of, and its number in it: 0 begins it.
fn part_of(path: &Path) -> Option<(String, u64)> {
    let name = path.file_name()?.to_str()?;
    if let Some(stem) = name.strip_suffix(".mp4") {
        return Some((stem.strip_suffix("-init").unwrap_or(stem).to_owned(), 0));
    }
    let (id, number) = name.strip_suffix(".m4s")?.split_once('-')?;
    let number = if number == "end" { u64::MAX } else { number.parse().ok().filter(|number| *number > 0)? };
    Some((id.to_owned(), number))
}

impl Report<'_> {
    fn text(&self) -> String {
        let verified = match (self.verified, self.complete) {
            (true, _) => ", as the manifest has them",
            (false, true) => "",
            (false, false) => ", up to the last complete GOP",
        };
        let (bytes, files) = (counted(self.bytes, "byte"), counted(self.files as u64, "file"));
        format!("{}: {bytes} from {files}{verified}\n", self.output.display())
    }
}
