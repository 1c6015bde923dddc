//! Steps for a quality or a size that is asked for.
//!
//! The [fit](Fit) makes steps for a PSNR out of models of errors and bits. What comes out is measured: the PSNR
//! of the [verification](crate::verification), or the size of the stream. Where that misses, the fit is asked for more
//! or less, by the [secant](crate::secant) through what is known.
#![expect(clippy::arithmetic_side_effects, reason = "counts of encodings and frames; layers are at most 4")]

mod fitting;

use crate::error::Error;
use crate::finetune::{Finetune, FinetuneLoss};
use crate::importance::Ranking;
use crate::pass::{encode_once, encode_smaller};
use crate::plan::share_of_intra;
use crate::progress::Progress;
use crate::report::{Report, TargetReport};
use crate::secant::Secant;
use crate::sequence;
use crate::settings::{Settings, ShChoice, Size};
use crate::source::FrameSource;
use crate::window::FirstFrames;
use fitting::{Fitting, Way};
use splatstream_format::syntax::FrameType;
use std::io::Write;

/// A PSNR is near enough within so many decibels of what is this much higher than the one that is asked for: a little too
/// good is better than not good enough, and either is better than another encoding.
const NEAR_DECIBELS: f64 = 0.45;
const ABOVE: f64 = 0.05;
/// A size is near enough within this part of it.
const NEAR_SIZE: f64 = 0.015;

/// The PSNR that is tried first for a size, decibels, and by how much the logarithm of the size grows for each: from real
/// scenes.
const FIRST: f64 = 47.0;
const GROWTH: f64 = 0.036;

/// Finer steps are given up where pictures gain less than this share of what they should.
const LEAST_GAIN: f64 = 0.05;

/// Where fitting brings pictures of a single frame less than this, it is tried without as well, decibels. Sequences whose
/// frames are predicted are always tried without: what their first frames gain, the others may lose.
const DOUBTFUL_GAIN: f64 = 0.5;

/// Frames of a sequence that is fitted to pictures each stand for themselves where predicted they take more than this part of
/// what I frames do, all together: of I frames fitting takes more, and it gains in each.
const ALONE: f64 = 0.85;

/// Encodings for a PSNR and for a size, at most.
const MOST_FOR_PSNR: usize = 4;
const MOST_FOR_SIZE: usize = 6;
/// And without a codebook, where a size is found with one.
const MOST_WITHOUT_CODEBOOK: usize = 3;

/// Frames of a sequence on which sizes are tried: with one or two temporal layers, and with more.
const PART_FOR_SIZE: [u32; 2] = [5, 9];

/// Frames of a sequence on which a PSNR is tried, at most: errors grow from frame to frame for about so long.
const PART_FOR_PSNR: u32 = 9;

/// By how much the PSNR of such a part is lower for each frame after its first, decibels: in most sequences at least.
const DRIFT: f64 = 0.0375;

/// Encodes so that the quality or the size of the settings is reached, as far as it can be.
///
/// # Errors
/// As [`encode`](crate::encode).
pub(crate) fn reach(
    source: &mut dyn FrameSource,
    settings: &Settings,
    sink: &mut dyn Write,
    progress: Progress<'_>,
) -> Result<Report, Error> {
    // Before anything is fitted to what no stream can carry.
    sequence::check(settings)?;
    let mut seeker = Seeker::new(source, settings, progress)?;
    let Found { fitted, encoded, .. } = seeker.find()?;
    let mut report = match encoded {
        Some(encoded) => {
            sink.write_all(&encoded.bytes)?;
            encoded.report
        }
        None => seeker.whole(fitted, sink)?,
    };
    report.target = Some(seeker.told(fitted));
    report.savings.extend(seeker.fitting.worth_of_laws(fitted, seeker.source)?);
    Ok(report)
}

/// Settings that reach what is asked for on the frames of `source`, the ranking of the first frame, and how they were found.
///
/// # Errors
/// As [`encode`](fn@crate::encode).
pub(crate) fn fit(
    source: &mut dyn FrameSource,
    settings: &Settings,
) -> Result<(Settings, Ranking, TargetReport), Error> {
    let mut progress = |_, _| ();
    let mut seeker = Seeker::new(source, settings, &mut progress)?;
    let found = seeker.find()?;
    // The one that the plan is made for.
    seeker.encodings += u32::from(found.encoded.is_none());
    Ok((
        seeker.fitting.at(found.fitted, seeker.source)?,
        seeker.fitting.ranking.clone(),
        seeker.told(found.fitted),
    ))
}

/// Settings that reach what is asked for on the frames of `source`, the order of the first frame, and how they were found.
///
/// # Errors
/// As [`encode`](crate::encode).
pub(crate) fn settle(
    source: &mut dyn FrameSource,
    settings: &Settings,
) -> Result<(Settings, Ranking, Report), Error> {
    let mut progress = |_, _| ();
    let mut seeker = Seeker::new(source, settings, &mut progress)?;
    let Found { fitted, encoded, .. } = seeker.find()?;
    let mut report = match encoded {
        Some(encoded) => encoded.report,
        None => seeker.whole(fitted, &mut std::io::sink())?,
    };
    report.target = Some(seeker.told(fitted));
    let mut settled = Settings { psnr: None, size: None, ..seeker.fitting.at(fitted, seeker.source)? };
    if report.stands_alone {
        settled = settled.alone();
    }
    Ok((settled, seeker.fitting.ranking, report))
}

/// Looks for the PSNR to fit for.
struct Seeker<'a> {
    source: &'a mut dyn FrameSource,
    fitting: Fitting<'a>,
    progress: Progress<'a>,
    encodings: u32,
    trials: u32,
}

/// A stream in memory.
struct Encoded {
    bytes: Vec<u8>,
    report: Report,
}

/// The PSNR to fit for, and what it gives.
struct Found {
    fitted: f64,
    /// What a Gaussian of the frames that were encoded to find it takes: see [`price`].
    price: f64,
    /// What fitting values to pictures has brought them, decibels, if it was done: the least of all frames.
    gained: Option<f64>,
    /// What a Gaussian of theirs takes, as a part of what one of an I frame does.
    share_of_intra: f64,
    /// Entries of their codebooks of SH.
    codebook_entries: u32,
    /// The stream, if these were all frames.
    encoded: Option<Encoded>,
}

impl Found {
    fn new(fitted: f64, encoded: Encoded, is_whole: bool) -> Self {
        let report = &encoded.report;
        let (price, gained, share_of_intra) = (price(report), gained(report), share_of_intra(report));
        let codebook_entries = report.sh_codebook_entries;
        let encoded = is_whole.then_some(encoded);
        Self { fitted, price, gained, share_of_intra, codebook_entries, encoded }
    }
}

impl<'a> Seeker<'a> {
    fn new(
        source: &'a mut dyn FrameSource,
        settings: &'a Settings,
        progress: Progress<'a>,
    ) -> Result<Self, Error> {
        let fitting = Fitting::new(source, settings)?;
        Ok(Self { source, fitting, progress, encodings: 0, trials: 0 })
    }

    /// What to fit for, so that the stream has what the settings ask for, with values fitted to pictures only where that
    /// takes fewer bits at equal PSNR.
    ///
    /// Of few Gaussians there may be nothing to gain, and what fitting was expected to bring was paid for with coarser steps. In a
    /// sequence whose frames were trained apart, a fitted frame is farther from the next one.
    fn find(&mut self) -> Result<Found, Error> {
        if self.fitting.settings.finetune.is_none() || self.fitting.leaves_source() {
            return self.search();
        }
        let is_single = self.source.len() == 1;
        // It takes a small part of the time, and shows whether frames are best predicted.
        let before = (!is_single && self.may_lose()).then(|| self.search_plain()).transpose()?;
        if let Some((plain, _)) = &before {
            self.fitting.way.alone = Some(plain.share_of_intra > ALONE);
        }
        let fitted = self.search()?;
        // Where there is nothing, nothing is fitted.
        let Some(gained) = fitted.gained else { return Ok(fitted) };
        let (plain, way) = match before {
            Some(before) => before,
            None if is_single && gained < DOUBTFUL_GAIN => self.search_plain()?,
            None => return Ok(fitted),
        };
        // Where nothing was gained the values are those of the source, and a lower price is chance.
        if gained <= 0.0 || plain.price < fitted.price {
            self.fitting.way = way;
            return Ok(plain);
        }
        Ok(fitted)
    }

    /// Whether frames that are predicted from fitted ones may be dearer. Only where nothing but the PSNR of all Gaussians counts
    /// is it known what that is worth.
    fn may_lose(&self) -> bool {
        let settings = self.fitting.settings;
        let is_plain = |finetune: &Finetune| {
            finetune.loss == FinetuneLoss::SquaredError
                && finetune.optimise_for.is_empty()
                && finetune.held.is_empty()
        };
        settings.may_predict() && settings.finetune.as_ref().is_some_and(is_plain)
    }

    /// What to fit for with the values of the source, and how that is done.
    fn search_plain(&mut self) -> Result<(Found, Way), Error> {
        let plain = Way::new(false, self.fitting.settings);
        let way = core::mem::replace(&mut self.fitting.way, plain);
        let found = self.search()?;
        Ok((found, core::mem::replace(&mut self.fitting.way, way)))
    }

    /// What to fit for, so that the stream has what the settings ask for.
    fn search(&mut self) -> Result<Found, Error> {
        match (self.fitting.settings.size, self.fitting.settings.psnr) {
            (Some(size), _) => self.size(size),
            (None, Some(decibels)) => self.quality(decibels.into()),
            (None, None) => Err(Error::Setting {
                name: "target",
                value: "none".to_owned(),
                allowed: "a PSNR or a size, if steps are to be found for one",
            }),
        }
    }

    /// How it was found.
    fn told(&self, fitted: f64) -> TargetReport {
        TargetReport {
            fitted: fitted as f32,
            encodings: self.encodings,
            trials: self.trials,
            without_codebook: self.fitting.way.sh != self.fitting.settings.sh,
            without_finetune: self.fitting.settings.finetune.is_some() && !self.fitting.way.fits_values,
        }
    }

    /// What to fit for pictures of a PSNR. Of a sequence its first frames are tried. What will be fitted to photographs is tried
    /// as it is before that.
    fn quality(&mut self, wanted: f64) -> Result<Found, Error> {
        let mut secant = Secant::new(wanted + ABOVE, NEAR_DECIBELS, 1.0, MOST_FOR_PSNR);
        let frames_of_part = self.frames_of_part_for_psnr();
        let predicted = frames_of_part.min(self.source.len()).saturating_sub(1);
        let mut drift = DRIFT * f64::from(predicted);
        let in_part = self.source.len() > frames_of_part || self.fitting.leaves_source();
        let mut best: Option<Found> = None;
        // What was fitted for first, and the PSNR that was measured.
        let mut start = None;
        let mut next = Some(wanted + drift - self.fitting.gain());
        while let Some(at) = next {
            let encoded = if in_part { self.part(at, frames_of_part)? } else { self.kept(at)? };
            if drift > 0.0 && !is_predicted(&encoded.report) {
                // Nothing drifts.
                next = Some(at - core::mem::take(&mut drift));
                continue;
            }
            // Where nothing can be seen nothing is too bad.
            let measured = encoded.report.pictures.as_ref().and_then(|pictures| pictures.fitted_psnr());
            let measured = measured.unwrap_or(wanted);
            // The same steps with coefficients.
            if self.fitting.gives_up_codebook(&encoded.report, wanted + ABOVE - measured) {
                continue;
            }
            let (from, first) = *start.get_or_insert((at, measured));
            // Something else than the steps spoils the pictures: finer ones would only cost bits.
            if at > from && measured - first < LEAST_GAIN * (at - from) {
                break;
            }
            if secant.take(at, measured) {
                best = Some(Found::new(at, encoded, !in_part));
            }
            next = secant.next();
        }
        best.ok_or(Error::NoFrames)
    }

    /// What to fit for a stream of a size. Of a long sequence a part is tried first.
    fn size(&mut self, size: Size) -> Result<Found, Error> {
        let goal = libm::log(match size {
            Size::BitsPerGaussian(bits) => bits,
            Size::Bytes(bytes) => bytes as f64,
        });
        let (frames, frames_of_part) = (self.source.len(), self.frames_of_part_for_size());
        let (mut first, mut slope) = (FIRST, GROWTH);
        if frames > 2 * frames_of_part {
            let mut secant = Secant::new(goal, NEAR_SIZE, slope, MOST_FOR_SIZE);
            let mut next = Some(first);
            while let Some(at) = next {
                let part = self.part(at, frames_of_part)?;
                secant.take(at, libm::log(self.size_from_part(size, &part.report)));
                next = secant.next();
            }
            (first, slope) = (secant.best(), secant.slope());
        }
        let found = self.size_near(size, goal, (first, slope, MOST_FOR_SIZE))?;
        if !self.fitting.may_do_without_codebook(found.codebook_entries) {
            return Ok(found);
        }
        // The fit knows of coefficients only, and a size does not say what a codebook costs pictures.
        let auto = core::mem::replace(&mut self.fitting.way.sh, ShChoice::Coefficients);
        let without = self.size_near(size, goal, (found.fitted, slope, MOST_WITHOUT_CODEBOOK))?;
        if without.price < found.price {
            return Ok(without);
        }
        self.fitting.way.sh = auto;
        Ok(found)
    }

    /// The same from a PSNR on, with a slope and a number of encodings at most.
    fn size_near(
        &mut self,
        size: Size,
        goal: f64,
        (first, slope, most): (f64, f64, usize),
    ) -> Result<Found, Error> {
        let mut secant = Secant::new(goal, NEAR_SIZE, slope, most);
        let mut best: Option<Found> = None;
        let mut next = Some(first);
        while let Some(at) = next {
            let encoded = self.kept(at)?;
            let measured = size_of(size, encoded.report.bytes as f64, encoded.report.gaussians as f64);
            if secant.take(at, libm::log(measured)) {
                best = Some(Found::new(at, encoded, true));
            }
            next = secant.next();
        }
        best.ok_or(Error::NoFrames)
    }

    /// No more than a GOP has, and one where none is predicted from others.
    fn frames_of_part_for_psnr(&self) -> u32 {
        let settings = self.fitting.settings;
        let stand_alone = settings.temporal_layers() == 0 || self.fitting.way.alone == Some(true);
        if stand_alone { 1 } else { PART_FOR_PSNR.min(settings.gop) }
    }

    fn frames_of_part_for_size(&self) -> u32 {
        let [few_layers, many_layers] = PART_FOR_SIZE;
        if self.fitting.settings.temporal_layers() > 2 { many_layers } else { few_layers }
    }

    /// The size of the whole sequence if the rest is like a part from its start: a GOP is one frame like the first and
    /// others like the others.
    fn size_from_part(&self, size: Size, part: &Report) -> f64 {
        let frames = f64::from(self.source.len());
        let mean = |is_first: bool, value: fn(&crate::FrameReport) -> f64| {
            let of =
                || part.coded.iter().filter(|f| (f.frame_type == FrameType::Intra) == is_first).map(value);
            of().sum::<f64>() / of().count().max(1) as f64
        };
        let gops = match is_predicted(part) {
            true => (frames / f64::from(self.fitting.settings.gop)).ceil().min(frames),
            false => frames,
        };
        let of_frames: u64 = part.coded.iter().map(|frame| frame.bytes).sum();
        let once = (part.bytes - of_frames) as f64 / part.gops.len().max(1) as f64;
        let bytes = gops * mean(true, |frame| frame.bytes as f64)
            + (frames - gops) * mean(false, |frame| frame.bytes as f64)
            + once * (frames / f64::from(self.fitting.settings.gop)).ceil();
        let gaussians = part.gaussians as f64 / part.coded.len().max(1) as f64 * frames;
        size_of(size, bytes, gaussians)
    }

    /// All frames, with the steps for a PSNR.
    fn whole(&mut self, fitted: f64, sink: &mut dyn Write) -> Result<Report, Error> {
        self.encodings += 1;
        let (settings, ranking) = (self.fitting.at(fitted, self.source)?, self.fitting.ranking.clone());
        if let Some(stands_alone) = self.fitting.way.alone {
            let report = encode_once(self.source, &settings, ranking, sink, self.progress)?;
            return Ok(Report { stands_alone, ..report });
        }
        let tried = self.fitting.tried(fitted);
        encode_smaller(self.source, &settings, (ranking, tried), sink, self.progress)
    }

    /// The same in memory.
    fn kept(&mut self, fitted: f64) -> Result<Encoded, Error> {
        let mut bytes = Vec::new();
        let report = self.whole(fitted, &mut bytes)?;
        Ok(Encoded { bytes, report })
    }

    /// The first frames, not fitted to photographs.
    fn part(&mut self, fitted: f64, frames: u32) -> Result<Encoded, Error> {
        self.trials += 1;
        let (mut settings, ranking) = (self.fitting.at(fitted, self.source)?, self.fitting.ranking.clone());
        if self.fitting.leaves_source() {
            settings.finetune = None;
        }
        let mut bytes = Vec::new();
        let mut part = FirstFrames { source: self.source, frames };
        let report = encode_once(&mut part, &settings, ranking, &mut bytes, &mut |_, _| ())?;
        Ok(Encoded { bytes, report })
    }
}

/// What fitting values to pictures has brought, decibels: the least of all frames, if any was fitted.
fn gained(report: &Report) -> Option<f64> {
    report.finetuned.iter().map(|fitted| fitted.psnr[1] - fitted.psnr[0]).min_by(f64::total_cmp)
}

/// Whether any frame refers to another.
fn is_predicted(report: &Report) -> bool {
    report.coded.iter().any(|frame| frame.frame_type != FrameType::Intra)
}

/// The logarithm of what a Gaussian of encoded frames would take at a PSNR that is the same for all.
fn price(report: &Report) -> f64 {
    // Where a size was asked for, the views of the fit are not looked at.
    let psnr = report.pictures.as_ref().and_then(|pictures| pictures.fitted_psnr().or(pictures.psnr()));
    let psnr = psnr.unwrap_or(0.0);
    libm::log(report.bytes.max(1) as f64 / report.gaussians.max(1) as f64) - GROWTH * psnr
}

/// A size in the unit that it is asked for in; never 0.
fn size_of(size: Size, bytes: f64, gaussians: f64) -> f64 {
    match size {
        Size::BitsPerGaussian(_) => 8.0 * bytes / gaussians.max(1.0),
        Size::Bytes(_) => bytes,
    }
}
