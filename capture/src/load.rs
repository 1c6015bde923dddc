//! Pictures and points of a capture, from their files.

use crate::photograph::{Photograph, SizeError, camera_of};
use rayon::prelude::*;
use splatstream_files::{ReadLimits, SceneError, ply};
use splatstream_render::camera::{Capture, CapturedPoint, CapturedView};
use splatstream_render::image::ImageError;
use splatstream_render::{Camera, Image};
use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::{Path, PathBuf};

/// Why the pictures or points of a capture cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// A file could not be read.
    #[error("{path}: cannot read: {error}; check the path", path = shown(path))]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        error: io::Error,
    },
    /// A directory, a device or a pipe, which may never end.
    #[error("{path}: it is no regular file, and nothing else is opened for a capture; name a file", path = shown(path))]
    NoFile {
        /// What is there.
        path: PathBuf,
    },
    /// A file of more bytes than are read.
    #[error("{path}: the file has more than {most} bytes, the most that is read; give a smaller one", path = shown(path))]
    TooLong {
        /// The file.
        path: PathBuf,
        /// Bytes that it may have.
        most: u64,
    },
    /// A file that is no picture.
    #[error("{path}: {error}", path = shown(path))]
    Picture {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        error: ImageError,
    },
    /// A picture of another shape than its camera's.
    #[error("{path}: {error}", path = shown(path))]
    Size {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        error: SizeError,
    },
    /// Points that cannot be read.
    #[error("{path}: {error}", path = shown(path))]
    Points {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        error: SceneError,
    },
    /// A view that names no picture.
    #[error("view {0} names no picture; give a capture whose views do (file_path, or img_name)")]
    Unnamed(
        /// What the view is called.
        String,
    ),
    /// A lens that is no pinhole.
    #[error(
        "view {0} has a lens that bends straight lines, which is not undone here; undistort the pictures first, with \
         colmap image_undistorter or the like"
    )]
    Distorted(
        /// What the view is called.
        String,
    ),
    /// Too many pixels.
    #[error("the pictures take {bytes} bytes of memory, at most {most} are allowed; give a smaller --height")]
    OverLimit {
        /// Bytes that all pictures would take.
        bytes: u64,
        /// Bytes that they may.
        most: u64,
    },
}

/// A path as messages show it: it may come from a file of anybody, and terminals obey characters of control.
fn shown(path: &Path) -> String {
    let text = path.to_string_lossy();
    text.chars()
        .map(|c| if c.is_control() { c.escape_default().to_string() } else { c.to_string() })
        .collect()
}

/// Memory that all pictures of one capture may take: 100 of 4K, or 400 of 1080 lines.
const MAX_BYTES: u64 = 1 << 32;

/// Bytes of the longest picture or file of points that is read: 256 MiB, more than twice an 8K picture without any compression.
const MAX_FILE: u64 = 1 << 28;

/// Memory that pictures may take while they are decoded, all threads together: as much as the largest picture that is read.
const MAX_DECODING: u64 = Image::MAX_PIXELS * Image::DECODING_BYTES;

/// Endings of pictures whose names lack one.
const ENDINGS: [&str; 5] = ["png", "jpg", "jpeg", "JPG", "webp"];

/// The pictures of a capture, in the order of its views, in `height` rows if that is fewer than they have; where they let
/// light pass, over a colour. `folder` is where to look for them instead of where the capture says.
///
/// Sizes are read from the heads of all files and compared with the cameras before anything is decoded. Memory peaks at 3 bytes
/// a pixel of the result, and 2 GiB for the pictures that are being decoded, or what the file and the decoding of one take
/// ([`Image::decoded`]) where that is more.
///
/// # Errors
/// A picture that is not there, is none, or is of another shape than its camera says; one that is no regular file, or a file
/// of more than 256 MiB; one of more than [`Image::MAX_PIXELS`]; lenses that are not pinholes; more than 4 GiB.
pub fn load_photographs(
    capture: &Capture,
    folder: Option<&Path>,
    height: Option<u32>,
    background: [f32; 3],
) -> Result<Vec<Photograph>, LoadError> {
    within_limit(capture.views.iter().map(|view| &view.camera), height)?;
    let found = |view| FoundPicture::find(capture, view, folder);
    let pictures = capture.views.par_iter().map(found).collect::<Result<Vec<_>, _>>()?;
    within_limit(pictures.iter().map(|picture| &picture.camera), height)?;
    let mut photographs = Vec::with_capacity(pictures.len());
    for batch in batches(&pictures) {
        let load = |picture: &FoundPicture| picture.load(height, background);
        photographs.append(&mut batch.par_iter().map(load).collect::<Result<Vec<_>, _>>()?);
    }
    Ok(photographs)
}

/// # Errors
/// Pictures of such cameras take more than [`MAX_BYTES`].
fn within_limit<'a>(cameras: impl Iterator<Item = &'a Camera>, height: Option<u32>) -> Result<(), LoadError> {
    let bytes = |&Camera { width, height: all, .. }: &Camera| {
        let rows = u64::from(height.unwrap_or(all).min(all));
        let width = u64::from(width).saturating_mul(rows).div_ceil(u64::from(all.max(1)));
        width.saturating_mul(rows).saturating_mul(3)
    };
    let bytes = cameras.map(bytes).fold(0, u64::saturating_add);
    if bytes > MAX_BYTES {
        return Err(LoadError::OverLimit { bytes, most: MAX_BYTES });
    }
    Ok(())
}

/// The picture of a view in its file, whose head alone was read.
struct FoundPicture<'a> {
    view: &'a CapturedView,
    path: PathBuf,
    /// In pixels of the picture.
    camera: Camera,
    /// Memory that its file takes, and its decoding.
    bytes: u64,
}

impl<'a> FoundPicture<'a> {
    /// # Errors
    /// Those of [`load_photographs`] that can be said before a picture is decoded.
    fn find(capture: &Capture, view: &'a CapturedView, folder: Option<&Path>) -> Result<Self, LoadError> {
        let name = || view.camera.name.clone();
        if view.is_distorted {
            return Err(LoadError::Distorted(name()));
        }
        let picture = view.picture.as_deref().ok_or_else(|| LoadError::Unnamed(name()))?;
        let path = found(folder.unwrap_or(&capture.pictures), picture, folder.is_some());
        let file = opened(&path)?;
        let length = file.metadata().map_err(|error| unread(&path, error))?.len();
        let size = match Image::size_of_file(BufReader::new(file)) {
            Ok(size) => size.map(|side| side as usize),
            Err(error) => return Err(LoadError::Picture { path, error }),
        };
        let camera = match camera_of(&view.camera, size) {
            Ok(camera) => camera,
            Err(error) => return Err(LoadError::Size { path, error }),
        };
        let pixels = u64::from(camera.width).saturating_mul(camera.height.into());
        let bytes = pixels.saturating_mul(Image::DECODING_BYTES).saturating_add(length);
        Ok(Self { view, path, camera, bytes })
    }

    fn load(&self, height: Option<u32>, background: [f32; 3]) -> Result<Photograph, LoadError> {
        let path = || self.path.clone();
        let picture = Image::decoded(&contents(&self.path)?, background)
            .map_err(|error| LoadError::Picture { path: path(), error })?;
        let whole = Photograph::whole(&self.view.camera, &picture)
            .map_err(|error| LoadError::Size { path: path(), error })?;
        // Making it smaller takes a picture of floats again: there must not be two.
        drop(picture);
        Ok(whole.at_most(height))
    }
}

/// Pictures that are decoded at one time: as many as [`MAX_DECODING`] has room for, whatever the number of threads, or one.
fn batches<'a, 'b>(mut pictures: &'b [FoundPicture<'a>]) -> impl Iterator<Item = &'b [FoundPicture<'a>]> {
    std::iter::from_fn(move || {
        let mut bytes = 0_u64;
        let fits = |picture: &&FoundPicture<'_>| {
            bytes = bytes.saturating_add(picture.bytes);
            bytes <= MAX_DECODING
        };
        let count = pictures.iter().take_while(fits).count().max(1);
        let (batch, rest) = pictures.split_at_checked(count)?;
        pictures = rest;
        Some(batch)
    })
}

/// The bytes of a file that a capture names.
///
/// # Errors
/// Anything but a regular file of at most [`MAX_FILE`] bytes.
fn contents(path: &Path) -> Result<Vec<u8>, LoadError> {
    let mut bytes = Vec::new();
    let file = opened(path)?;
    file.take(MAX_FILE.saturating_add(1)).read_to_end(&mut bytes).map_err(|error| unread(path, error))?;
    // It may have grown since it was opened.
    match bytes.len() as u64 > MAX_FILE {
        true => Err(LoadError::TooLong { path: path.to_path_buf(), most: MAX_FILE }),
        false => Ok(bytes),
    }
}

/// A file that a capture names, which may come from anybody: a device has no end, and a pipe without a writer does not even
/// open, so what it is is asked before it is opened.
fn opened(path: &Path) -> Result<File, LoadError> {
    let found = std::fs::metadata(path).map_err(|error| unread(path, error))?;
    if !found.is_file() {
        return Err(LoadError::NoFile { path: path.to_path_buf() });
    }
    if found.len() > MAX_FILE {
        return Err(LoadError::TooLong { path: path.to_path_buf(), most: MAX_FILE });
    }
    File::open(path).map_err(|error| unread(path, error))
}

fn unread(path: &Path, error: io::Error) -> LoadError {
    LoadError::Io { path: path.to_path_buf(), error }
}

/// The file of a picture: as it is named, or with an ending; in a folder that was given also by its last part.
fn found(folder: &Path, name: &Path, is_given: bool) -> PathBuf {
    let last = name.file_name().map(Path::new).filter(|_| is_given);
    let names = [Some(name), last].into_iter().flatten();
    let with_ending = |path: PathBuf, ending: &str| {
        let mut text = path.into_os_string();
        text.push(format!(".{ending}"));
        PathBuf::from(text)
    };
    let mut places = names.flat_map(|name| {
        let path = folder.join(name);
        let endings = ENDINGS.map(|ending| with_ending(path.clone(), ending));
        std::iter::once(path).chain(endings)
    });
    places.find(|path| path.is_file()).unwrap_or_else(|| folder.join(name))
}

/// The points of a capture: those of its model, or of the PLY file that it names; none if it has neither.
///
/// # Errors
/// A file of points that cannot be read, or has more than 256 MiB.
pub fn load_points(capture: &Capture) -> Result<Vec<CapturedPoint>, LoadError> {
    let Some(path) = capture.points_file.as_ref().filter(|_| capture.points.is_empty()) else {
        return Ok(capture.points.clone());
    };
    let bytes = contents(path)?;
    let points = ply::read_points(&bytes, &ReadLimits::default())
        .map_err(|error| LoadError::Points { path: path.clone(), error })?;
    let [x, y, z] = points.position;
    let [r, g, b] = points.colour;
    let positions = x.into_iter().zip(y).zip(z).map(|((x, y), z)| [x, y, z]);
    let colours = r.into_iter().zip(g).zip(b).map(|((r, g), b)| [r, g, b]);
    Ok(positions.zip(colours).map(|(position, colour)| CapturedPoint { position, colour }).collect())
}
