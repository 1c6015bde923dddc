//! Every case on a base.

use super::attempt::Attempt;
use super::base::{Base, Size};
use super::cases::{self, Case, Make};
use super::loss;
use super::rows::{BaseReport, CaseReport, Row, Verdict};
use super::sample::{Quality, Sample, Views};
use super::sequences;
use super::tools::Tool;
use super::{HEIGHT, Stability, Warnings};
use crate::Progress;
use crate::numbers::{bits_per_gaussian, counted};
use splatstream_gaussians::GaussianFrame;

/// A tool on the base itself: what cases are compared with.
struct Plain {
    tool: Tool,
    attempt: Attempt,
    quality: Quality,
}

/// What all cases of a base have in common.
struct Bench<'a> {
    base: &'a Base,
    size: Size,
    /// Rows of a picture.
    height: u32,
    /// What a user is told of a stream.
    warnings: Warnings<'a>,
    /// On the scene and on the sequence.
    scene: Vec<Plain>,
    sequence: Vec<Plain>,
}

/// Steps of progress that [`measure`] takes.
pub(super) fn steps(base: &Base, size: Size) -> u32 {
    cases::of(base).map(|case| case.strengths(size).len() as u32).sum()
}

/// Measures all cases.
pub(super) fn measure(base: &Base, how: &Stability<'_>, progress: &dyn Progress) -> BaseReport {
    progress.step(format!("{}: without any case", base.name));
    let height = how.height.unwrap_or(HEIGHT);
    let (scene, sequence) = (Vec::new(), Vec::new());
    let mut bench = Bench { base, size: how.size, height, warnings: how.warnings, scene, sequence };
    bench.scene = bench.plain(&Sample::scene(base.scene.clone(), &base.scene), &Tool::OF_SCENES);
    if base.len() > 1 {
        bench.sequence = bench.plain(&sequences::plain(base), &Tool::OF_SEQUENCES);
    }
    let cases = cases::of(base).map(|case| bench.case(case, progress)).collect();
    BaseReport { name: base.name.clone(), facts: bench.facts(), cases }
}

impl Bench<'_> {
    fn plain(&self, sample: &Sample, tools: &[Tool]) -> Vec<Plain> {
        let views = self.views(sample);
        let one = |&tool: &Tool| {
            let attempt = tool.attempt(sample, None, self.warnings);
            Plain { tool, quality: views.judged(&attempt.shown).unwrap_or_default(), attempt }
        };
        tools.iter().map(one).collect()
    }

    fn views(&self, sample: &Sample) -> Views<'static> {
        sample.views(self.size.cameras(), self.height)
    }

    fn case(&self, case: &'static Case, progress: &dyn Progress) -> CaseReport {
        let mut rows = Vec::new();
        for strength in case.strengths(self.size) {
            progress.step(format!("{}: {}, {} {strength}", self.base.name, case.title, case.axis));
            rows.extend(match case.make {
                Make::Scene(make) => {
                    self.coded(case, &make(&self.base.scene, strength), strength, &self.scene)
                }
                Make::Sequence(make) => {
                    self.coded(case, &make(self.base, strength), strength, &self.sequence)
                }
                Make::Loss => self.lost(case, strength),
            });
            progress.advance();
        }
        CaseReport { case, rows }
    }

    /// A sample by all tools.
    fn coded(&self, case: &'static Case, sample: &Sample, strength: f64, plains: &[Plain]) -> Vec<Row> {
        let views = self.views(sample);
        let one = |plain: &Plain| {
            let report = plain.attempt.coded.as_ref().map(|(_, report)| report);
            let attempt = plain.tool.attempt(sample, report, self.warnings);
            let quality = views.judged(&attempt.shown);
            Row {
                scene: self.base.name.clone(),
                case,
                tool: plain.tool,
                strength,
                quality,
                wanted: plain.quality,
                bpg: attempt.bytes.map(|bytes| bits_per_gaussian(bytes, sample.gaussians())),
                verdict: Verdict::of(quality, &plain.quality, !attempt.detected.is_empty()),
                detected: attempt.detected.join("; "),
                fallback: attempt.fallback.join("; "),
            }
        };
        plains.iter().map(one).collect()
    }

    /// The streams of the sequence with units missing.
    fn lost(&self, case: &'static Case, share: f64) -> Vec<Row> {
        let sample = sequences::plain(self.base);
        let views = self.views(&sample);
        let one = |plain: &Plain| {
            let (stream, report) = plain.attempt.coded.as_ref()?;
            let remains = loss::remains(stream, share, sample.frames.len(), &views);
            Some(Row {
                scene: self.base.name.clone(),
                case,
                tool: plain.tool,
                strength: share,
                quality: remains.quality,
                wanted: plain.quality,
                bpg: Some(bits_per_gaussian(report.bytes, sample.gaussians())),
                verdict: Verdict::of(remains.quality, &plain.quality, remains.always_detected),
                detected: remains.detected.unwrap_or_default(),
                fallback: String::new(),
            })
        };
        self.sequence.iter().filter_map(one).collect()
    }

    /// What the cases are made from, and what tools give for it.
    fn facts(&self) -> String {
        let of_tools = |plains: &[Plain]| {
            let one = |plain: &Plain| format!("{} {:.1} dB", plain.tool.name(), plain.quality.psnr);
            plains.iter().map(one).collect::<Vec<_>>().join(", ")
        };
        let scene = &self.base.scene;
        let gaussians = |frame: &GaussianFrame| counted(frame.len() as u64, "Gaussian");
        let (count, degree) = (gaussians(scene), scene.sh_degree());
        let mut facts = format!(
            "A scene of {count}, spherical harmonics of degree {degree}: without any case {}.",
            of_tools(&self.scene)
        );
        if let Some(first) = self.base.frames.first() {
            let (frames, count) = (counted(self.base.len() as u64, "frame"), gaussians(first));
            facts += &format!(
                " A sequence of {frames} of {count}: without any case {}.",
                of_tools(&self.sequence)
            );
        }
        facts
    }
}
