//! From frames to bytes.

use splatstream_encoder::FrameSource;
pub use splatstream_encoder::{Error as EncodeError, Report, Settings};
use splatstream_gaussians::{GaussianFrame, Planes};
use std::fs::File;
use std::io::{BufReader, BufWriter, Read, Seek, SeekFrom, Write};

/// Encodes frames to a stream.
///
/// A stream begins with the ranges of all its frames, so that its bytes come once the last frame is known: frames wait in
/// an unnamed temporary file, and [`Encoder::finish`] writes each GOP as soon as it is ready. Memory does not grow with
/// the number of frames. Where frames can be read again, [`encode`](crate::encode()) needs no file.
///
/// ```
/// use splatstream::{Encoder, GaussianFrame, Planes, Settings};
///
/// let of = |value: f32| vec![value; 100];
/// let frame = GaussianFrame::from_planes(0, Planes {
///     position: [(0..100).map(|x| x as f32).collect(), of(0.0), of(0.0)],
///     log_scale: [of(-3.0), of(-3.0), of(-3.0)],
///     rotation: [of(1.0), of(0.0), of(0.0), of(0.0)],
///     opacity_logit: of(2.0),
///     dc: [of(0.5), of(0.1), of(0.2)],
///     sh: Vec::new(),
/// })?;
/// let mut bytes = Vec::new();
/// let mut encoder = Encoder::new(&mut bytes, Settings::default())?;
/// encoder.push(&frame)?;
/// let report = encoder.finish()?;
/// assert_eq!((report.frames, report.bytes), (1, bytes.len() as u64));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Encoder<W> {
    sink: W,
    settings: Settings,
    waiting: Waiting,
}

/// Frames in a temporary file.
#[derive(Debug)]
struct Waiting {
    file: BufWriter<File>,
    /// Where each frame begins, and where the next one will.
    starts: Vec<u64>,
    end: u64,
}

impl<W: Write> Encoder<W> {
    /// An encoder that writes to `sink`.
    ///
    /// # Errors
    /// No temporary file can be made.
    pub fn new(sink: W, settings: Settings) -> Result<Self, EncodeError> {
        let file = BufWriter::new(tempfile::tempfile()?);
        Ok(Self { sink, settings, waiting: Waiting { file, starts: Vec::new(), end: 0 } })
    }

    /// Takes the next frame.
    ///
    /// # Errors
    /// The temporary file cannot be written. Frames that cannot be encoded are found by [`Encoder::finish`].
    pub fn push(&mut self, frame: &GaussianFrame) -> Result<(), EncodeError> {
        self.waiting.push(frame)?;
        Ok(())
    }

    /// Encodes the frames and writes the stream.
    ///
    /// # Errors
    /// Settings or frames that cannot be coded, a sink that cannot be written.
    pub fn finish(self) -> Result<Report, EncodeError> {
        self.finish_with(&mut |_, _| {})
    }

    /// The same; `progress` is called after every frame with frames done and frames in all. Where the settings ask for a
    /// size or a PSNR, frames may be encoded several times.
    ///
    /// # Errors
    /// As [`Encoder::finish`].
    pub fn finish_with(mut self, progress: &mut dyn FnMut(u32, u32)) -> Result<Report, EncodeError> {
        self.waiting.file.flush()?;
        let report =
            splatstream_encoder::encode(&mut self.waiting, &self.settings, &mut self.sink, progress)?;
        self.sink.flush()?;
        Ok(report)
    }
}

/// Bytes of what stands before the planes of a frame: degree, antialiasing, Gaussians.
const HEAD: usize = 10;

impl Waiting {
    fn push(&mut self, frame: &GaussianFrame) -> std::io::Result<()> {
        let mut head = [0; HEAD];
        head[..2].copy_from_slice(&[frame.sh_degree(), frame.antialiased().into()]);
        head[2..].copy_from_slice(&(frame.len() as u64).to_le_bytes());
        self.file.write_all(&head)?;
        for value in frame.planes().iter().flatten() {
            self.file.write_all(&value.to_le_bytes())?;
        }
        self.starts.push(self.end);
        self.end += (HEAD + 4 * frame.len() * frame.planes().iter().count()) as u64;
        Ok(())
    }

    fn read(&mut self, number: u32) -> std::io::Result<GaussianFrame> {
        let start = self.starts.get(number as usize).copied().ok_or(std::io::ErrorKind::NotFound)?;
        let mut file = BufReader::new(self.file.get_mut());
        file.seek(SeekFrom::Start(start))?;
        let mut head = [0; HEAD];
        file.read_exact(&mut head)?;
        let [degree, antialiased, count @ ..] = head;
        let count = u64::from_le_bytes(count) as usize;
        let mut planes = Planes::with_capacity(degree, count);
        let mut bytes = vec![0; 4 * count];
        for plane in planes.iter_mut() {
            file.read_exact(&mut bytes)?;
            let (values, _) = bytes.as_chunks::<4>();
            plane.extend(values.iter().map(|value| f32::from_le_bytes(*value)));
        }
        let frame = GaussianFrame::from_planes(degree, planes).map_err(std::io::Error::other)?;
        Ok(frame.with_antialiased(antialiased != 0))
    }
}

impl FrameSource for Waiting {
    fn len(&self) -> u32 {
        self.starts.len() as u32
    }

    fn frame(&mut self, number: u32) -> Result<GaussianFrame, Box<dyn std::error::Error + Send + Sync>> {
        Ok(self.read(number)?)
    }
}
