//! `splatstream render`: frames to pictures.

use crate::assumed_up::AssumedUp;
use crate::cameras::{BackgroundArg, CameraArgs, Views, refuse_distorted};
use crate::console::Console;
use crate::failure::{Failure, StreamFault, faults_text};
use crate::frame_name::{frame_name, is_frame_name};
use crate::frames::{Frames, Opened};
use crate::input_args::InputArgs;
use crate::memory_bound::{MemoryBound, PixelBytes, bytes_of};
use crate::numbers::{FrameRange, counted, frames};
use crate::output_directory::{OutputDirectory, files_in, is_numbered};
use crate::output_file::{OutputFile, check_directory, refuse_inputs, refuse_standard};
use crate::progress::Progress;
use crate::stream_file::LimitArgs;
use clap::Args;
use serde::Serialize;
use splatstream_decoder::operating_point::OperatingPoint;
use splatstream_format::payload::{SceneDescription, UpAxis};
use splatstream_gaussians::GaussianFrame;
use splatstream_render::camera::write_cameras;
use splatstream_render::{Camera, render};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Draw frames of a stream or of scene files to PNG pictures.
///
/// The pictures are those of 3D Gaussian splatting, the same on every machine and with any number of threads.
#[derive(Args)]
#[command(
    after_help = "Examples:\n  splatstream render garden.gss --camera cameras.json -o pictures/ --height 1080\n  \
    splatstream render talk.gss --camera ring:4 -o pictures/ --op s0,t0,r0 --frames 0..1\n  \
    splatstream render source.ply --camera ring:8 --write-cameras ring.json -o source/\n  \
    splatstream render decoded.ply --camera ring.json -o decoded/  # what another codec has made of it, from the same cameras"
)]
pub(crate) struct Render {
    /// A stream, a scene file, or a directory of frames; - is a stream or a scene on standard input, but no .splat or .ksplat.
    #[arg(value_name = "IN")]
    input: PathBuf,
    /// A cameras.json or transforms.json, or a directory with a model of COLMAP; ring:N and forward:N make N cameras for the first frame. Default: the cameras
    /// of the stream, or ring:8.
    #[arg(long, visible_alias = "cameras", value_name = "CAMS.json|ring:N|forward:N")]
    camera: Option<Views>,
    /// Write the cameras to this file as well, a cameras.json: what other scenes are to be drawn or compared from as this one is.
    #[arg(long, value_name = "CAMS.json")]
    write_cameras: Option<PathBuf>,
    /// A directory for the pictures: VIEW.png, of sequences frame_0000_VIEW.png and so on.
    #[arg(short, long = "out", value_name = "DIR")]
    out: PathBuf,
    #[command(flatten)]
    cameras: CameraArgs,
    #[command(flatten)]
    background: BackgroundArg,
    /// The operating point of a stream; default is everything.
    #[arg(long, value_name = "sS,tT,rR")]
    op: Option<OperatingPoint>,
    /// Frames to draw, A..B: from A up to and without B.
    #[arg(long, value_name = "A..B", value_parser = FrameRange::parse)]
    frames: Option<FrameRange>,
    /// Replace the pictures that an earlier run has left in the directory: .png files with the names that pictures are given
    /// (frame_0000_..., ring_00, forward_00, camera_00), or those of the cameras. They go when all new ones are whole, and stay
    /// where the command fails or the stream has an error: the disk has to hold both. Other pictures stay.
    #[arg(long)]
    force: bool,
    /// Make up for the low-pass filter, whatever the scene says: for scenes that were trained so.
    #[arg(long)]
    antialiased: bool,
    #[command(flatten)]
    limits: LimitArgs,
    #[command(flatten)]
    reading: InputArgs,
}

/// A pixel that is drawn and written.
const OF_PIXEL: PixelBytes = PixelBytes { of_one: 32, of_each: 0 };

/// How pictures are drawn, and what is in their way.
struct Drawing {
    cameras: Vec<Camera>,
    background: [f32; 3],
    directory: OutputDirectory,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Drawn {
    output: PathBuf,
    frames: u32,
    /// Frames that the stream or the files have; 0 if that is not known.
    #[serde(skip)]
    expected: u32,
    pictures: Vec<Picture>,
    /// Of drawing alone.
    seconds: f64,
    /// Errors of the stream.
    errors: Vec<StreamFault>,
    /// What was taken to point up where nobody said it and cameras were made; null otherwise.
    assumed_up: Option<Up>,
}

/// What points up where nobody says it.
#[derive(Serialize)]
struct Up {
    axis: &'static str,
    why: String,
}

/// One picture.
#[derive(Serialize)]
struct Picture {
    file: String,
    frame: u32,
    view: String,
    width: u32,
    height: u32,
    seconds: f64,
}

impl Render {
    /// Draws every frame from every camera.
    pub(crate) fn run(&self, console: &Console) -> Result<(), Failure> {
        check_directory(&self.out, "pictures")?;
        self.check_cameras_file()?;
        let opened = Opened::open(&self.input, self.reading)?;
        let options = self.limits.options_to_draw();
        let description = opened.description(&options.limits).unwrap_or_default();
        let mut frames = opened.frames(&options, self.op)?;
        let span = self.frames.unwrap_or(FrameRange::ALL);
        let expected = frames.expected();
        let progress = Progress::frames("drawing", span.count_in(expected));
        let mut drawn = self.nothing();
        let drawing = self.draw_all(&mut frames, &description, &progress, &mut drawn)?;
        drop(progress);
        if drawn.frames == 0 {
            frames.verdict()?;
            return Err(Failure::Usage(format!("{}: it has no such frame", self.input.display())));
        }
        drawn.expected = expected;
        drawn.seconds = drawn.pictures.iter().map(|picture| picture.seconds).sum();
        if let Some(Drawing { directory, cameras, .. }) = drawing {
            // Pictures of a stream with errors replace none.
            if directory.replaces() {
                frames.verdict()?;
            }
            directory.finish()?;
            if let Some(path) = &self.write_cameras {
                OutputFile::write(path, write_cameras(&cameras).as_bytes())?;
            }
        }
        drawn.errors = frames.faults();
        frames.warnings().iter().for_each(|warning| console.complain(&warning.text()));
        console.report(&drawn, || drawn.text())?;
        frames.verdict()
    }

    /// Refuses cameras to be written that are no file, or none of pinholes.
    fn check_cameras_file(&self) -> Result<(), Failure> {
        match (&self.write_cameras, &self.camera) {
            (Some(path), Some(Views::File(cameras))) => {
                refuse_standard(path).and_then(|()| refuse_distorted(cameras))
            }
            (Some(path), _) => refuse_standard(path),
            (None, _) => Ok(()),
        }
    }

    /// Draws the frames that are asked for.
    fn draw_all(
        &self,
        frames: &mut Frames<'_>,
        description: &SceneDescription,
        progress: &Progress,
        drawn: &mut Drawn,
    ) -> Result<Option<Drawing>, Failure> {
        let (inputs, is_sequence) = (self.inputs(frames), frames.expected() != 1);
        let span = self.frames.unwrap_or(FrameRange::ALL);
        let mut drawing = None;
        let mut next = 0;
        while !span.is_over(next) {
            let Some((number, frame)) = frames.next()? else { break };
            let drawing = match &mut drawing {
                Some(drawing) => drawing,
                None => {
                    drawn.assumed_up = self.assumed_up(&frame, description);
                    drawing.insert(self.drawing(&frame, description, &inputs)?)
                }
            };
            if span.contains(number) {
                let antialiased = frame.antialiased() || self.antialiased;
                let frame = frame.with_antialiased(antialiased);
                self.draw(&frame, (number, is_sequence), drawing, drawn)?;
                progress.at(drawn.frames);
            }
            next = number.saturating_add(1);
        }
        Ok(drawing)
    }

    /// What all pictures have in common; cameras may be made for the first frame. None of `inputs` is replaced.
    fn drawing(
        &self,
        first: &GaussianFrame,
        description: &SceneDescription,
        inputs: &[PathBuf],
    ) -> Result<Drawing, Failure> {
        let cameras = named(self.cameras.cameras(self.camera.as_ref(), first, description)?);
        let mut memory = MemoryBound::of(self.limits.memory());
        memory.keep(bytes_of(first));
        OF_PIXEL.check(&cameras, memory)?;
        let cameras_file = self.write_cameras.as_ref().map(|path| refuse_inputs(path, inputs));
        cameras_file.unwrap_or(Ok(()))?;
        let pictures = |out: &Path| files_in(out, |path| is_picture(path, &cameras));
        let directory = OutputDirectory::new(&self.out, pictures, "pictures", inputs, self.force)?;
        Ok(Drawing { cameras, background: self.background.colour(description), directory })
    }

    /// The report before anything is drawn.
    fn nothing(&self) -> Drawn {
        Drawn {
            output: self.out.clone(),
            frames: 0,
            expected: 0,
            pictures: Vec::new(),
            seconds: 0.0,
            errors: Vec::new(),
            assumed_up: None,
        }
    }

    /// The files that it reads, and the photographs that a file of cameras names.
    fn inputs(&self, frames: &Frames<'_>) -> Vec<PathBuf> {
        // Where there is neither a directory yet nor a file to write, there is nothing to replace.
        let may_replace = self.out.is_dir() || self.write_cameras.is_some();
        let cameras = self.camera.iter().filter(|_| may_replace).flat_map(Views::files);
        frames.inputs().into_iter().chain(cameras).collect()
    }

    /// What is taken to point up, if cameras are made and nobody says it.
    fn assumed_up(&self, frame: &GaussianFrame, description: &SceneDescription) -> Option<Up> {
        let are_made = match &self.camera {
            Some(Views::File(_)) => false,
            Some(_) => true,
            None => description.cameras.is_empty(),
        };
        let is_said = self.cameras.up_axis(description) != UpAxis::Unknown;
        (are_made && !is_said).then(|| Up { axis: AssumedUp::NAME, why: AssumedUp::of(frame).why() })
    }

    fn draw(
        &self,
        frame: &GaussianFrame,
        (number, sequence): (u32, bool),
        drawing: &mut Drawing,
        drawn: &mut Drawn,
    ) -> Result<(), Failure> {
        for camera in &drawing.cameras {
            let start = Instant::now();
            let rendering = render(frame, camera, drawing.background);
            let seconds = start.elapsed().as_secs_f64();
            let view = &camera.name;
            let file =
                if sequence { format!("{}_{view}.png", frame_name(number)) } else { format!("{view}.png") };
            let path = drawing.directory.path_of(&file);
            let failed = |error| Failure::other(format!("{}: cannot write: {error}", path.display()));
            let png = rendering.colour.to_png().map_err(failed)?;
            drawing.directory.write(&file, &png)?;
            let (width, height) = (camera.width, camera.height);
            drawn.pictures.push(Picture { file, frame: number, view: view.clone(), width, height, seconds });
        }
        drawn.frames += 1;
        Ok(())
    }
}

/// Names that make files: one each, without directories.
fn named(cameras: Vec<Camera>) -> Vec<Camera> {
    let mut taken = std::collections::BTreeSet::new();
    let name = |(at, camera): (usize, Camera)| {
        let stem = Path::new(&camera.name).file_stem().and_then(|stem| stem.to_str()).map(str::to_owned);
        let numbered = |number: usize| format!("camera_{number:04}");
        let mut name = stem.unwrap_or_else(|| numbered(at));
        for number in at.. {
            if taken.insert(name.clone()) {
                break;
            }
            name = numbered(number);
        }
        Camera { name, ..camera }
    };
    cameras.into_iter().enumerate().map(name).collect()
}

/// Whether a file has a name that pictures are given: of a frame of a sequence, of a camera that was made or had no name,
/// or of one of these cameras.
fn is_picture(path: &Path, cameras: &[Camera]) -> bool {
    let name = path.file_name().and_then(|name| name.to_str());
    let Some(view) = name.and_then(|name| name.strip_suffix(".png")) else { return false };
    let of_sequence = view.match_indices('_').any(|(end, _)| is_frame_name(&view[..end]));
    let is_made = ["ring_", "forward_", "camera_"].iter().any(|made| is_numbered(view, made, 2, ""));
    of_sequence || is_made || cameras.iter().any(|camera| camera.name == view)
}

impl Drawn {
    fn text(&self) -> String {
        let count = self.pictures.len() as u64;
        let hint = match &self.assumed_up {
            Some(Up { axis, why }) => {
                format!("  up           {axis}, {why}\n")
            }
            None => String::new(),
        };
        format!(
            "{}: {} of {}; {:.3} seconds per picture\n{hint}{}",
            self.output.display(),
            counted(count, "picture"),
            match self.expected {
                expected if expected > self.frames => format!("{} of {}", self.frames, frames(expected)),
                _ => frames(self.frames),
            },
            self.seconds / count.max(1) as f64,
            faults_text(&self.errors),
        )
    }
}
