//! What a user should know of a stream that was encoded without an error.

use super::PSNR_ALLOWED;
use super::pictures::Goal;
use crate::likeness::Unlike;
use crate::numbers::counted;
use serde::Serialize;
use splatstream_chart::numbers::{bits_per_gaussian, grouped};
use splatstream_encoder::{
    Dropped, FrameReport, Isolated, Preset, Report, Settings, Size, Structure, VerifiedFrame,
};
use splatstream_format::syntax::FrameType;
use std::fmt::Write as _;

/// A PSNR is missed by more than this in the views that steps are fitted in, decibels.
const MISSED: f64 = 0.5;

/// And by more than this in views that decide nothing, decibels: these differ from the others.
const MISSED_UNSEEN: f64 = 1.0;

/// From this PSNR on quantisers are about as fine as values of 16 bits can have them, decibels.
const FINEST: f64 = 70.0;

/// P and B frames may be below I frames by so much, decibels.
const PULSE: f64 = 1.0;

/// And one frame below what was asked for.
const OUTLIER: f64 = 2.0;

/// A size is missed by more than this part of it.
const MISSED_SIZE: f64 = 0.03;

/// A warning. Codes do not change, messages may.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Warning {
    /// What it is about.
    pub(crate) code: &'static str,
    /// In words.
    pub(crate) message: String,
}

impl Warning {
    pub(crate) fn new(code: &'static str, message: String) -> Self {
        Self { code, message }
    }

    /// For people.
    pub(crate) fn text(&self) -> String {
        format!("warning: {}", self.message)
    }
}

impl From<Warning> for splatstream_chart::stability::Warning {
    fn from(Warning { code, message }: Warning) -> Self {
        Self { code, message }
    }
}

/// All warnings about a stream; `file_of` says what a frame is called.
pub(crate) fn warnings(
    report: &Report,
    settings: &Settings,
    file_of: &dyn Fn(u32) -> String,
) -> Vec<Warning> {
    let mut warnings: Vec<Warning> =
        report.dropped.iter().take(1).map(|first| dropped(report, first, file_of)).collect();
    warnings.extend(report.isolated.iter().map(|isolated| isolated_values(isolated, file_of)));
    match Goal::of(settings) {
        Goal::Psnr(wanted) => warnings.extend(psnr(report, settings, wanted)),
        Goal::Size(size) => warnings.extend(missed_size(report, size)),
        Goal::Nothing => {}
    }
    warnings.extend(empty_frames(report));
    warnings.extend(pulses(report));
    warnings.extend(short_gops(report, settings));
    warnings.extend(short_time(report, settings).or_else(|| useless_fitting(report, settings)));
    warnings
}

/// What is said of files that are hardly frames of one sequence; nothing where frames that do not predict each other are coded by
/// themselves already. `shards`: the option by which the sequence is divided, which scenes of their own are encoded without.
pub(super) fn unlike_frames(unlike: &Unlike, is_intra: bool, shards: Option<&str>) -> Option<Warning> {
    let (fewest, most) = unlike.gaussians;
    let mut message = "the files were taken for the frames of one sequence, and have ".to_owned();
    if fewest < most {
        let _infallible = write!(message, "from {} to ", grouped(fewest as u64));
    }
    message += &format!("{} each", counted(most as u64, "Gaussian"));
    if let Some((least, most)) = unlike.extents {
        let _infallible = write!(message, ", extents from {least:.3} to {most:.3}");
    }
    if unlike.are_apart {
        message += ", and places that do not touch";
    }
    let apart = "--all-intra codes each by itself, and splatstream track makes one sequence of frames that were trained apart";
    let without = shards.map(|option| format!(" and without {option}")).unwrap_or_default();
    let each = format!("if they are scenes of their own, give the files with --each -o DIR{without}");
    let advice: Vec<&str> =
        [(!is_intra).then_some(apart), unlike.is_unrelated.then_some(&each)].into_iter().flatten().collect();
    (!advice.is_empty()).then(|| Warning::new("unlike-frames", format!("{message}: {}", advice.join("; "))))
}

fn psnr(report: &Report, settings: &Settings, wanted: f64) -> Vec<Warning> {
    // Values that were fitted to photographs are not to show what the source does.
    if settings.finetune.as_ref().is_some_and(|finetune| !finetune.photographs.is_empty()) {
        return Vec::new();
    }
    let Some(pictures) = &report.pictures else { return Vec::new() };
    let Some(measured) = pictures.psnr() else {
        let message = "the quality could not be checked: pictures of the scene are blank from all around; \
                       give views of it with --cameras";
        return vec![Warning::new("blank-pictures", message.to_owned())];
    };
    let fitted = pictures.fitted_psnr().unwrap_or(measured);
    let below = wanted - measured.min(fitted);
    if wanted - fitted > MISSED || wanted - measured > MISSED_UNSEEN {
        let advice = missed_psnr_advice(report, settings);
        let message = format!(
            "pictures have a PSNR of {:.1} dB, {below:.1} dB less than the {wanted} dB asked for; {advice}",
            wanted - below
        );
        return vec![Warning::new("psnr-missed", message)];
    }
    let least = measured.min(fitted);
    if least - wanted > MISSED {
        let message = format!(
            "pictures have a PSNR of {least:.1} dB, {:.1} dB more than the {wanted} dB asked for; the stream is larger than it \
             needs to be",
            least - wanted
        );
        return vec![Warning::new("psnr-exceeded", message)];
    }
    let of_frame = |frame: &VerifiedFrame| Some((frame.fitted_psnr.or(frame.psnr)?, frame.number));
    let worst = pictures.frames.iter().filter_map(of_frame);
    let worst = worst.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let far = worst.filter(|(psnr, _)| wanted - psnr > OUTLIER);
    far.map(|(psnr, frame)| {
        let message = format!(
            "pictures of frame {frame} have a PSNR of {psnr:.1} dB, {:.1} dB less than the {wanted} dB asked for; \
             give a higher --psnr, or encode that part of the sequence by itself",
            wanted - psnr
        );
        Warning::new("frame-psnr-missed", message)
    })
    .into_iter()
    .collect()
}

/// What may be done about pictures that finer steps do not mend.
fn missed_psnr_advice(report: &Report, settings: &Settings) -> &'static str {
    let (of_source, coded) = report.sh_degree;
    if !report.isolated.is_empty() {
        "repair the values that are far beyond what a scene has"
    } else if settings.sh_degree.is_some() && coded < of_source {
        "pictures are compared with those of all spherical harmonics: give a higher --sh-degree"
    } else if settings.prune.is_some() {
        "what was left out counts: give a higher --prune"
    } else if settings.psnr.is_some_and(|wanted| f64::from(wanted) >= FINEST) {
        "quantisers can hardly be finer, since values have 16 bits: look for Gaussians that are far larger or brighter than all \
         others"
    } else {
        "give a higher --psnr, or look for Gaussians that are far larger or brighter than all others"
    }
}

fn missed_size(report: &Report, size: Size) -> Option<Warning> {
    let (asked, has, unit) = match size {
        Size::BitsPerGaussian(bits) => {
            (bits, bits_per_gaussian(report.bytes, report.gaussians), "bits per Gaussian")
        }
        Size::Bytes(bytes) => (bytes as f64 / 1e6, report.bytes as f64 / 1e6, "megabytes"),
    };
    let missed = has / asked - 1.0;
    if missed.abs() <= MISSED_SIZE {
        return None;
    }
    let fitted = report.target.map_or(0.0, |target| target.fitted);
    let advice = match missed > 0.0 {
        true if fitted <= *PSNR_ALLOWED.start() && report.sh_degree.1 > 0 => {
            "no coarser quantisers are tried: leave out spherical harmonics with --sh-degree, use fewer layers or refinements, or \
             thin the scene out"
        }
        true if fitted <= *PSNR_ALLOWED.start() => {
            "no coarser quantisers are tried: use fewer layers or refinements, or thin the scene out"
        }
        false if f64::from(fitted) >= FINEST => "finer quantisers would change nothing that can be seen",
        _ => {
            "of the sizes that were tried this is the nearest, as some are leapt over: give another one, or a --psnr"
        }
    };
    let message = format!(
        "the stream has {has:.3} {unit}, {:.1} % {} the {asked} asked for; {advice}",
        100.0 * missed.abs(),
        if missed > 0.0 { "above" } else { "below" },
    );
    Some(Warning::new("size-missed", message))
}

/// Frames of a sequence in which nothing is to be seen.
fn empty_frames(report: &Report) -> Option<Warning> {
    let count = report.coded.iter().filter(|frame| frame.gaussians == 0).count();
    let message = format!(
        "{} of {} {} no Gaussians that can be seen: nothing is shown then",
        grouped(count as u64),
        counted(report.coded.len() as u64, "frame"),
        if count == 1 { "has" } else { "have" },
    );
    (1..report.coded.len()).contains(&count).then(|| Warning::new("empty-frames", message))
}

/// Predicted frames that are worse than the I frames between them are seen as a pulse.
fn pulses(report: &Report) -> Option<Warning> {
    let pictures = report.pictures.as_ref()?;
    let intra = pictures.psnr_of(FrameType::Intra)?;
    let types = [FrameType::Predicted, FrameType::Enhancement];
    let means = types.iter().filter_map(|&of| Some((pictures.psnr_of(of)?, of)));
    let (worst, of) = means.min_by(|a, b| a.0.total_cmp(&b.0))?;
    let below = intra - worst;
    let tolerance = match report.coded.iter().any(|frame| frame.by_pictures) {
        true => "a lower --tolerance, or ",
        false => "",
    };
    (below > PULSE).then(|| {
        let message = format!(
            "{} frames have {below:.1} dB less than I frames ({worst:.1} and {intra:.1} dB), which may be seen as a pulse \
             at each I frame; if it is seen: {tolerance}--all-intra, which codes every frame by itself and takes several times as \
             many bytes",
            of.name()
        );
        Warning::new("quality-pulses", message)
    })
}

/// Gaussians of a frame below which headers decide whether it is predicted.
const FEW: u64 = 500;

/// What helps frames that have nothing in common.
const TRACK: &str = "`splatstream track` makes one sequence of frames that were trained apart";

/// A sequence in which hardly any frame can be predicted.
fn short_gops(report: &Report, settings: &Settings) -> Option<Warning> {
    if report.stands_alone && report.gaussians < FEW * u64::from(report.frames) {
        let message = "no layers, and every frame by itself: headers of more units would take more bytes than predicting \
                       frames of so few Gaussians saves; --all-intra does the same, and faster";
        return Some(Warning::new("short-gops", message.to_owned()));
    }
    let alone = "frames have too little in common with the ones before to be predicted for fewer bytes";
    let asked = (report.frames as usize).div_ceil(settings.gop.max(1) as usize);
    let count = report.gops.len();
    let is_intra = |frame: &FrameReport| frame.frame_type == FrameType::Intra;
    let may_predict = settings.structure != Structure::Intra && (count as u64) < u64::from(report.frames);
    let message = if report.stands_alone {
        format!(
            "no layers, and every frame by itself: {alone}; --all-intra does the same, and faster; {TRACK}"
        )
    } else if may_predict && report.coded.iter().all(is_intra) {
        format!("no frame is predicted: {alone}; --all-intra does the same, and faster; {TRACK}")
    } else if count > 2 * asked && 2 * count > report.frames as usize {
        format!(
            "{count} GOPs for {}: most {alone}; --all-intra codes them as small, and faster; {TRACK}",
            counted(report.frames.into(), "frame")
        )
    } else {
        return None;
    };
    Some(Warning::new("short-gops", message))
}

/// A time in which fitting to pictures came to nothing: too short for an iteration, or for one that gains anything.
fn short_time(report: &Report, settings: &Settings) -> Option<Warning> {
    let budget = settings.finetune.as_ref()?.time_budget?;
    // In a sequence, more than the time counts.
    let is_given_up = report.frames == 1 && report.target.is_some_and(|target| target.without_finetune);
    let is_idle = report.finetuned.iter().any(|fitted| fitted.iterations == 0);
    let message = format!(
        "--finetune came to nothing in the {} s of --time-budget, which may have been over before the first iteration: give \
         more, or leave out --time-budget",
        budget.as_secs_f64(),
    );
    (is_given_up || is_idle).then(|| Warning::new("nothing-fitted", message))
}

/// Fitting to pictures that was asked for, took its time, and is not in the stream.
fn useless_fitting(report: &Report, settings: &Settings) -> Option<Warning> {
    let is_given_up = report.target.is_some_and(|target| target.without_finetune);
    let message = "--finetune came to nothing: at equal PSNR the stream takes fewer bytes without it, and is written without; leave \
                   it out here, or give more iterations";
    // What belongs to a preset nobody has asked for.
    (is_given_up && settings.preset != Preset::Small)
        .then(|| Warning::new("nothing-fitted", message.to_owned()))
}

fn dropped(report: &Report, first: &Dropped, file_of: &dyn Fn(u32) -> String) -> Warning {
    let all: u64 = report.dropped.iter().map(|dropped| u64::from(dropped.gaussians)).sum();
    let properties: Vec<String> =
        first.properties.iter().map(|(name, count)| format!("{name} {}", grouped((*count).into()))).collect();
    let message = format!(
        "{} {} left out, of {}: values that are not finite; {} has {} ({})",
        counted(all, "Gaussian"),
        if all == 1 { "was" } else { "were" },
        counted(report.dropped.len() as u64, "frame"),
        file_of(first.frame),
        grouped(first.gaussians.into()),
        properties.join(", "),
    );
    Warning::new("dropped", message)
}

fn isolated_values(isolated: &Isolated, file_of: &dyn Fn(u32) -> String) -> Warning {
    let Isolated { attribute, count, frame, row, value, farthest: (far_frame, far_row, far), .. } = *isolated;
    let farthest = match (far_frame, far_row) == (frame, row) {
        true => String::new(),
        false => format!("; the farthest is Gaussian {far_row} of {} with {far}", file_of(far_frame)),
    };
    let message = format!(
        "{} {} a {attribute} far beyond what a scene has, for example Gaussian {row} of {} with {value}{farthest}; the \
         nearest sensible value is coded instead, and nothing else is worse for it; remove or repair such Gaussians",
        counted(count, "Gaussian"),
        if count == 1 { "has" } else { "have" },
        file_of(frame),
    );
    Warning::new("isolated-values", message)
}
