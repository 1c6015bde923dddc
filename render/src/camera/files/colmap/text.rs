//! Models as text.

use super::{
    CameraError, CapturedPoint, Lens, MAX_PARAMETERS, MAX_POINTS, MAX_VIEWS, MODELS, Pose, Source,
    colmap_error, point, room,
};
use std::collections::BTreeMap;
use std::io::{BufRead, Read};
use std::str::FromStr;

/// Bytes of a line that are looked at: tracks of points and points of images follow, of any length.
const MAX_LINE: u64 = 4096;

pub(super) fn lenses(source: Source) -> Result<BTreeMap<u32, Lens>, CameraError> {
    let mut lines = Lines::new(source);
    let mut lenses = BTreeMap::new();
    while lines.next_record()? {
        let lens = lens(&lines.line).and_then(|lens| room(lenses.len(), MAX_VIEWS, "cameras").map(|()| lens));
        let (number, lens) = lens.map_err(|why| lines.refused(why))?;
        lenses.insert(number, lens);
    }
    Ok(lenses)
}

pub(super) fn poses(source: Source) -> Result<Vec<Pose>, CameraError> {
    let mut lines = Lines::new(source);
    let mut poses = Vec::new();
    while lines.next_record()? {
        let pose = pose(&lines.line, lines.place()).and_then(|pose| {
            room(poses.len(), MAX_VIEWS, "images")?;
            Ok(pose)
        });
        poses.push(pose.map_err(|why| lines.refused(why))?);
        // The points that were found in it, which may be none.
        lines.next()?;
    }
    Ok(poses)
}

pub(super) fn points(source: Source) -> Result<Vec<CapturedPoint>, CameraError> {
    let mut lines = Lines::new(source);
    let mut points = Vec::new();
    while lines.next_record()? {
        let point = of_point(&lines.line).and_then(|point| {
            room(points.len(), MAX_POINTS, "points")?;
            Ok(point)
        });
        points.push(point.map_err(|why| lines.refused(why))?);
    }
    Ok(points)
}

/// CAMERA_ID MODEL WIDTH HEIGHT PARAMS[].
fn lens(line: &str) -> Result<(u32, Lens), String> {
    let mut words = line.split_ascii_whitespace();
    let number = word(&mut words, "CAMERA_ID")?;
    let name: String = word(&mut words, "MODEL")?;
    let size = [word(&mut words, "WIDTH")?, word(&mut words, "HEIGHT")?];
    let parameters = words.take(MAX_PARAMETERS + 1).map(|text| parsed(text, "PARAMS"));
    let parameters = parameters.collect::<Result<Vec<f64>, _>>()?;
    let model = MODELS.iter().find(|model| model.0 == name);
    let model = model.ok_or_else(|| format!("{name} is no model of a camera that is known"))?;
    Ok((number, Lens::new(*model, size, &parameters)?))
}

/// IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, where the name may have blanks.
fn pose(line: &str, place: String) -> Result<Pose, String> {
    let mut words = line.split_ascii_whitespace();
    let _number: u32 = word(&mut words, "IMAGE_ID")?;
    let mut number = |what| word::<f64>(&mut words, what);
    let rotation = [number("QW")?, number("QX")?, number("QY")?, number("QZ")?];
    let translation = [number("TX")?, number("TY")?, number("TZ")?];
    let lens = word(&mut words, "CAMERA_ID")?;
    let name = words.collect::<Vec<_>>().join(" ");
    if name.is_empty() {
        return Err("NAME is missing".to_owned());
    }
    Ok(Pose { rotation, translation, lens, name, place })
}

/// POINT3D_ID X Y Z R G B ERROR TRACK[].
fn of_point(line: &str) -> Result<CapturedPoint, String> {
    let mut words = line.split_ascii_whitespace();
    let _number: u64 = word(&mut words, "POINT3D_ID")?;
    let position = [word(&mut words, "X")?, word(&mut words, "Y")?, word(&mut words, "Z")?];
    let colour = [word(&mut words, "R")?, word(&mut words, "G")?, word(&mut words, "B")?];
    point(position, colour)
}

fn word<'a, T: FromStr>(words: &mut impl Iterator<Item = &'a str>, what: &str) -> Result<T, String> {
    parsed(words.next().ok_or_else(|| format!("{what} is missing"))?, what)
}

fn parsed<T: FromStr>(text: &str, what: &str) -> Result<T, String> {
    let shown: String = text.chars().take(40).collect();
    text.parse().map_err(|_| format!("{what} is '{shown}', which is no such number"))
}

/// The lines of a file, of which the beginnings are kept.
struct Lines {
    source: Source,
    line: String,
    /// Lines that were read.
    count: u64,
}

impl Lines {
    fn new(source: Source) -> Self {
        Self { source, line: String::new(), count: 0 }
    }

    /// Goes to the next line; false after the last.
    fn next(&mut self) -> Result<bool, CameraError> {
        let mut bytes = Vec::new();
        self.source.reader.by_ref().take(MAX_LINE).read_until(b'\n', &mut bytes)?;
        if bytes.is_empty() {
            return Ok(false);
        }
        self.count = self.count.saturating_add(1);
        if bytes.last() != Some(&b'\n') {
            self.source.reader.skip_until(b'\n')?;
        }
        self.line = String::from_utf8_lossy(&bytes).trim().to_owned();
        Ok(true)
    }

    /// Goes to the next line that is neither empty nor a remark; false after the last.
    fn next_record(&mut self) -> Result<bool, CameraError> {
        while self.next()? {
            if !self.line.is_empty() && !self.line.starts_with('#') {
                return Ok(true);
            }
        }
        Ok(false)
    }

    fn place(&self) -> String {
        format!("line {}", self.count)
    }

    fn refused(&self, why: String) -> CameraError {
        colmap_error(self.source.name.clone(), self.place(), &why)
    }
}
