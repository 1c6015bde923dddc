//! Other codecs on the same scenes: what a peers file says, and how their output looks here.

use super::picture_comparison::Judge;
use super::scenes::Scene;
use crate::Error;
use crate::columns::{Column, Row, Value, metrics};
use serde::Deserialize;
use splatstream_encoder::FrameSource;
use splatstream_render::metrics::{Comparison, LOSSLESS_DB, RatePoint};
use std::path::{Path, PathBuf};

/// The version of the schema that this reads.
const VERSION: u32 = 1;

#[derive(Deserialize)]
struct PeersFile {
    version: u32,
    #[serde(default)]
    scenes: Vec<PeerScene>,
    #[serde(default)]
    results: Vec<PeerResult>,
    #[serde(default)]
    missing: Vec<MissingPeer>,
}

#[derive(Deserialize)]
struct PeerScene {
    scene: String,
    source: Option<PathBuf>,
    reference: Option<PathBuf>,
}

#[derive(Deserialize)]
struct PeerResult {
    scene: String,
    peer: String,
    #[serde(default)]
    version: String,
    #[serde(default)]
    options: String,
    bytes: u64,
    gaussians: u64,
    frames: u32,
    encode_s: Option<f64>,
    decode_s: Option<f64>,
    #[serde(default)]
    timing: String,
    decoded: Option<PathBuf>,
    #[serde(default)]
    command: String,
}

/// A peer that was not measured.
#[derive(Debug, Clone, Deserialize)]
pub(crate) struct MissingPeer {
    /// Its name.
    pub(crate) peer: String,
    /// The scene; none: any.
    pub(crate) scene: Option<String>,
    /// Why.
    pub(crate) why: String,
}

/// Opens the frames that are in a file or in a directory, or says why it cannot.
pub type OpenFrames<'a> = &'a dyn Fn(&Path) -> Result<Box<dyn FrameSource>, String>;

/// What other codecs did, from one file.
pub struct Peers<'a> {
    directory: PathBuf,
    file: PeersFile,
    open: OpenFrames<'a>,
}

/// A peer's result, judged like ours.
#[derive(Debug, Clone)]
pub(crate) struct PeerPoint {
    /// Its name.
    pub(crate) peer: String,
    /// Version and options.
    pub(crate) details: String,
    /// The command that made it.
    pub(crate) command: String,
    /// Bytes of all its frames.
    pub(crate) bytes: u64,
    /// Frames that these bytes hold.
    pub(crate) frames: u32,
    /// Frames that were judged.
    pub(crate) judged: usize,
    /// Bytes a frame over Gaussians a frame of the source, in bits.
    pub(crate) bpg: f64,
    /// Gaussians per second; none if not measured.
    pub(crate) encode_speed: Option<f64>,
    /// Gaussians per second; none if not measured.
    pub(crate) decode_speed: Option<f64>,
    /// How it was timed.
    pub(crate) timing: String,
    /// Bytes that SplatStream's baseline needs for the same PSNR, percent of its own; none outside our range.
    pub(crate) ours_percent: Option<f64>,
    /// Means over cameras and frames.
    pub(crate) figures: Comparison,
}

impl PeerPoint {
    /// Whether its pictures are those of the source: then there is no distortion to draw.
    pub(crate) fn is_lossless(&self) -> bool {
        self.figures.psnr_db >= LOSSLESS_DB
    }

    /// Its place among curves.
    pub(crate) fn rate_point(&self) -> RatePoint {
        RatePoint { rate: self.bpg, quality: self.figures.psnr_db }
    }
}

impl Row for PeerPoint {
    fn columns(_: &[Self]) -> Vec<Column<Self>> {
        let of_frame = |row: &Self| Value::Bytes(row.bytes / u64::from(row.frames.max(1)));
        let ours = |row: &Self| row.ours_percent.map_or(Value::None, |share| Value::Number(share, 0, " %"));
        let mut columns = vec![
            Column::new("peer", "Codec", |row: &Self| Value::words(&row.peer)),
            Column::new("details", "Options", |row: &Self| Value::words(&row.details)),
            Column::of_people("Size per frame", of_frame),
            Column::of_file("bytes", |row: &Self| Value::Bytes(row.bytes)),
            Column::of_file("frames", |row: &Self| Value::Count(row.frames.into())),
            Column::of_file("frames_judged", |row: &Self| Value::Count(row.judged as u64)),
            Column::new("bpg_source", "Bits per Gaussian of the source", |row: &Self| {
                Value::number(row.bpg, 2)
            }),
            Column::new("encode_gaussians_per_s", "Encoding", |row: &Self| Value::speed(row.encode_speed)),
            Column::new("decode_gaussians_per_s", "Decoding", |row: &Self| Value::speed(row.decode_speed)),
            Column::of_file("timing", |row: &Self| Value::words(&row.timing)),
            Column::of_file("command", |row: &Self| Value::words(&row.command)),
        ];
        columns.extend(metrics(|row: &Self| &row.figures));
        columns.push(Column::of_people("Our size at its PSNR", ours));
        columns
    }
}

impl<'a> Peers<'a> {
    /// A peers file of the text `json` in `directory`, from which its paths start. `open` reads what peers decoded.
    ///
    /// # Errors
    /// It is no peers file, or of another version.
    pub fn new(json: &[u8], directory: PathBuf, open: OpenFrames<'a>) -> Result<Self, Error> {
        let file: PeersFile =
            serde_json::from_slice(json).map_err(|error| Error::other(format!("no peers file: {error}")))?;
        if file.version != VERSION {
            return Err(Error::other(format!("version {}; this command reads {VERSION}", file.version)));
        }
        Ok(Self { directory, file, open })
    }

    /// Results of a scene to render: each is a step of progress.
    pub(crate) fn count(&self, scene: &Scene) -> u32 {
        self.results(scene).count() as u32
    }

    /// Renders and judges the results of a scene. What cannot be judged is missing, and says why.
    pub(crate) fn judged(
        &self,
        scene: &Scene,
        judge: &Judge<'_>,
        on_result: impl Fn(),
    ) -> (Vec<PeerPoint>, Vec<MissingPeer>) {
        let name = self.name_of(scene);
        let of_scene = |missing: &&MissingPeer| missing.scene.is_none() || missing.scene.as_deref() == name;
        let mut missing: Vec<MissingPeer> = self.file.missing.iter().filter(of_scene).cloned().collect();
        let mut points = Vec::new();
        for result in self.results(scene) {
            match self.judge(result, scene, judge) {
                Ok(point) => points.push(point),
                Err(why) => missing.push(MissingPeer { peer: result.peer.clone(), scene: None, why }),
            }
            on_result();
        }
        (points, missing)
    }

    fn results(&self, scene: &Scene) -> impl Iterator<Item = &PeerResult> {
        let name = self.name_of(scene);
        self.file.results.iter().filter(move |result| Some(result.scene.as_str()) == name)
    }

    /// What the file calls a scene: by the place of its files, or else by their name.
    fn name_of(&self, scene: &Scene) -> Option<&str> {
        let path = scene.path.as_ref()?;
        let whole = path.canonicalize().ok();
        let same_place = |place: &&PathBuf| {
            let absolute = self.directory.join(place).canonicalize().ok();
            absolute.is_some() && absolute == whole || place.canonicalize().is_ok_and(|p| Some(p) == whole)
        };
        let same_stem = |place: &&PathBuf| stem(place).is_some() && stem(place) == stem(path);
        let paths =
            |scene: &'_ PeerScene| [scene.source.clone(), scene.reference.clone()].into_iter().flatten();
        let mut scenes = self.file.scenes.iter();
        let by_place = scenes.clone().find(|scene| paths(scene).any(|place| same_place(&&place)));
        let found = by_place.or_else(|| {
            scenes.find(|listed| listed.scene == scene.name || paths(listed).any(|place| same_stem(&&place)))
        });
        found.map(|scene| scene.scene.as_str())
    }

    fn judge(&self, result: &PeerResult, scene: &Scene, judge: &Judge<'_>) -> Result<PeerPoint, String> {
        let decoded = result.decoded.as_ref().ok_or("its output was not kept")?;
        let mut files = (self.open)(&self.directory.join(decoded))?;
        let judged = files.len().min(scene.frames.len() as u32);
        let mut views = Vec::new();
        for number in 0..judged {
            let frame = files.frame(number).map_err(|error| error.to_string())?;
            views.extend(judge.views(number, &frame));
        }
        let figures = Comparison::mean(&views).ok_or("its output has no frame")?;
        let bytes_of_frame = result.bytes as f64 / f64::from(result.frames.max(1));
        let gaussians_of_frame = scene.gaussians() as f64 / scene.frames.len().max(1) as f64;
        let speed = |seconds: Option<f64>| seconds.filter(|&s| s > 0.0).map(|s| result.gaussians as f64 / s);
        let details = [result.version.as_str(), result.options.as_str()];
        Ok(PeerPoint {
            peer: result.peer.clone(),
            details: details.into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(", "),
            command: result.command.clone(),
            bytes: result.bytes,
            frames: result.frames,
            judged: judged as usize,
            bpg: 8.0 * bytes_of_frame / gaussians_of_frame.max(1.0),
            encode_speed: speed(result.encode_s),
            decode_speed: speed(result.decode_s),
            timing: result.timing.clone(),
            ours_percent: None,
            figures,
        })
    }
}

/// A file's name up to its first dot.
fn stem(path: &Path) -> Option<String> {
    let name = path.file_name()?.to_string_lossy();
    name.split('.').next().map(str::to_owned).filter(|stem| !stem.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scene_is_found_by_the_name_of_its_file() {
        let text = r#"{"version": 1, "scenes": [
            {"scene": "first", "source": "far/away.splat", "reference": "refs/first.ply"},
            {"scene": "second", "source": null, "reference": "refs/plant.ply"}]}"#;
        let peers =
            Peers::new(text.as_bytes(), PathBuf::new(), &|_| Err("not asked for".to_owned())).unwrap();
        let named = |path: &str| Scene {
            name: "any".to_owned(),
            path: Some(path.into()),
            frames: Vec::new(),
            frames_of_source: 0,
        };
        assert_eq!(peers.name_of(&named("here/plant.compressed.ply")), Some("second"));
        assert_eq!(peers.name_of(&named("away.spz")), Some("first"));
        assert_eq!(peers.name_of(&named("other.ply")), None);
        assert_eq!(peers.count(&named("away.spz")), 0);
    }
}
