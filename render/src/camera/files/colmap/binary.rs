//! Models as bytes, little endian.

use super::{
    CameraError, CapturedPoint, Lens, MAX_PARAMETERS, MAX_POINTS, MAX_VIEWS, MODELS, Pose, Source,
    colmap_error, point, room,
};
use std::collections::BTreeMap;
use std::io::{BufRead, Read};

/// The longest name of a picture, bytes.
const MAX_NAME: u64 = 4096;

pub(super) fn lenses(source: Source) -> Result<BTreeMap<u32, Lens>, CameraError> {
    let mut bytes = Bytes::new(source);
    let count = bytes.u64()?;
    let mut lenses = BTreeMap::new();
    for _ in 0..count {
        let start = bytes.at;
        let number = bytes.u32()?;
        let model = bytes.u32()?;
        let size = [bytes.u64()?, bytes.u64()?];
        let model = MODELS
            .get(model as usize)
            .copied()
            .ok_or_else(|| bytes.refused(start, format!("{model} is no model of a camera that is known")))?;
        let mut parameters = [0.0; MAX_PARAMETERS];
        let used = parameters.get_mut(..model.1).unwrap_or_default();
        for parameter in used.iter_mut() {
            *parameter = bytes.f64()?;
        }
        let lens = Lens::new(model, size, used).and_then(|lens| {
            room(lenses.len(), MAX_VIEWS, "cameras")?;
            Ok(lens)
        });
        lenses.insert(number, lens.map_err(|why| bytes.refused(start, why))?);
    }
    Ok(lenses)
}

pub(super) fn poses(source: Source) -> Result<Vec<Pose>, CameraError> {
    let mut bytes = Bytes::new(source);
    let count = bytes.u64()?;
    let mut poses = Vec::new();
    for _ in 0..count {
        let start = bytes.at;
        room(poses.len(), MAX_VIEWS, "images").map_err(|why| bytes.refused(start, why))?;
        bytes.u32()?;
        let rotation = bytes.floats()?;
        let translation = bytes.floats()?;
        let lens = bytes.u32()?;
        let name = bytes.name()?;
        let found = bytes.u64()?;
        // x, y and the number of a point.
        bytes.skip(found.saturating_mul(24))?;
        poses.push(Pose { rotation, translation, lens, name, place: format!("byte {start}") });
    }
    Ok(poses)
}

pub(super) fn points(source: Source) -> Result<Vec<CapturedPoint>, CameraError> {
    let mut bytes = Bytes::new(source);
    let count = bytes.u64()?;
    let mut points = Vec::new();
    for _ in 0..count {
        let start = bytes.at;
        bytes.u64()?;
        let position = bytes.floats()?;
        let colour = bytes.take()?;
        let _error = bytes.f64()?;
        let track = bytes.u64()?;
        // An image and a place in its list.
        bytes.skip(track.saturating_mul(8))?;
        let point = point(position, colour).and_then(|point| {
            room(points.len(), MAX_POINTS, "points")?;
            Ok(point)
        });
        points.push(point.map_err(|why| bytes.refused(start, why))?);
    }
    Ok(points)
}

/// The bytes of a file.
struct Bytes {
    source: Source,
    /// Bytes that were read.
    at: u64,
}

impl Bytes {
    fn new(source: Source) -> Self {
        Self { source, at: 0 }
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N], CameraError> {
        let mut bytes = [0; N];
        match self.source.reader.read_exact(&mut bytes) {
            Err(error) if error.kind() == std::io::ErrorKind::UnexpectedEof => Err(self.cut_short()),
            Err(error) => Err(error.into()),
            Ok(()) => {
                self.at = self.at.saturating_add(N as u64);
                Ok(bytes)
            }
        }
    }

    fn u32(&mut self) -> Result<u32, CameraError> {
        self.take().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> Result<u64, CameraError> {
        self.take().map(u64::from_le_bytes)
    }

    fn f64(&mut self) -> Result<f64, CameraError> {
        self.take().map(f64::from_le_bytes)
    }

    fn floats<const N: usize>(&mut self) -> Result<[f64; N], CameraError> {
        let mut floats = [0.0; N];
        for float in &mut floats {
            *float = self.f64()?;
        }
        Ok(floats)
    }

    /// Text that ends in 0.
    fn name(&mut self) -> Result<String, CameraError> {
        let start = self.at;
        let mut name = Vec::new();
        self.source.reader.by_ref().take(MAX_NAME).read_until(0, &mut name)?;
        self.at = self.at.saturating_add(name.len() as u64);
        match name.pop() {
            Some(0) => String::from_utf8(name)
                .map_err(|_| self.refused(start, "the name of a picture is not UTF-8".to_owned())),
            Some(_) if name.len() as u64 >= MAX_NAME.saturating_sub(1) => {
                Err(self.refused(start, format!("the name of a picture has {MAX_NAME} bytes or more")))
            }
            _ => Err(self.cut_short()),
        }
    }

    fn skip(&mut self, count: u64) -> Result<(), CameraError> {
        let skipped = std::io::copy(&mut self.source.reader.by_ref().take(count), &mut std::io::sink())?;
        if skipped < count {
            return Err(self.cut_short());
        }
        self.at = self.at.saturating_add(count);
        Ok(())
    }

    fn cut_short(&self) -> CameraError {
        self.refused(self.at, "the file ends here, too early; copy it again".to_owned())
    }

    fn refused(&self, at: u64, why: String) -> CameraError {
        colmap_error(self.source.name.clone(), format!("byte {at}"), &why)
    }
}
