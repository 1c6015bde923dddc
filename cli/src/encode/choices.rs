//! What the encoder chose, and why.

use super::choice::Choice;
use super::prune::pruned;
use crate::assumed_up::AssumedUp;
use crate::numbers::{counted, frames};
use splatstream_chart::numbers::{bits_per_gaussian, grouped, percent};
use splatstream_decoder::predictor::Predictor;
use splatstream_encoder::{
    Basis, FinetuneLoss, FrameReport, Importance, Laws, PredictorChoice, Predictors, Preset, Report,
    Settings, ShChoice, Steps, Structure, Tool, Tools,
};
use splatstream_format::syntax::FrameType;

/// What a tool saves, if the report says it.
fn saved(report: &Report, tool: Tool) -> Option<(f64, Basis)> {
    report.savings.iter().find(|saving| saving.tool == tool).map(|saving| (saving.bits, saving.basis))
}

/// Every decision in the report.
pub(crate) fn choices(report: &Report, settings: &Settings) -> Vec<Choice> {
    // Nothing is chosen where nothing is coded.
    if report.gaussians == 0 {
        return vec![invisible(report, settings)];
    }
    let mut choices = vec![positions(report, settings), axes(report, settings), degree(report, settings)];
    choices.extend(steps(report, settings));
    choices.extend(laws(report, settings));
    choices.extend(tables(report));
    if report.sh_degree.1 > 0 {
        choices.push(harmonics(report, settings));
        choices.push(transform(report, settings));
    }
    choices.extend(order(report, settings));
    choices.extend(refinements(report, settings));
    choices.extend(layers(report, settings));
    choices.extend(prediction(report, settings));
    choices.extend(survivors(report));
    choices.extend(fidelity(report, settings));
    choices.extend(predictors(report, settings));
    choices.extend(network(report, settings));
    choices.extend(fitting(report, settings));
    choices.push(invisible(report, settings));
    choices.extend(pruned(report, settings));
    choices.extend(left_out(settings));
    choices
}

/// What was taken to point up where nobody said it.
pub(super) fn up(assumed: AssumedUp) -> Choice {
    Choice::new("up", AssumedUp::NAME, assumed.why())
}

fn positions(report: &Report, settings: &Settings) -> Choice {
    let bits = report.position_bits;
    let choice = format!("{} per axis, grid step {}", counted(bits.into(), "bit"), report.position_step);
    let inner = report.steps.unwrap_or(settings.steps).position_bits;
    let why = format!(
        "the core of the scene spans 2^{inner:.2} cells at this quality; the rest is for what lies outside"
    );
    Choice::new("position", choice, why)
}

/// The steps that were fitted; those of a quality are in its documentation.
fn steps(report: &Report, settings: &Settings) -> Option<Choice> {
    let (decibels, steps) = (settings.psnr?, report.steps?);
    let Steps { log_scale, rotation, opacity, dc, sh, .. } = steps;
    let mut choice =
        format!("log-scale {log_scale:.3}, rotation {rotation:.4}, opacity {opacity:.3}, dc {dc:.3}");
    if report.sh_degree.1 > 0 {
        choice += &format!(", sh {sh:.3}");
    }
    Some(Choice::new(
        "steps",
        choice,
        format!("the fewest bits for {decibels} dB, measured on the first frame"),
    ))
}

fn axes(report: &Report, settings: &Settings) -> Choice {
    let (sorted, [bits_sorted, bits_unsorted]) = report.canonical_axes;
    let cost = format!(
        "scale and rotation take {bits_sorted:.2} bits per Gaussian sorted, {bits_unsorted:.2} as they come, without contexts"
    );
    let why = match (sorted, settings.tools.axis_sort) {
        (false, false) => format!("{cost}; --without axis-sort"),
        (false, true) if bits_sorted < bits_unsorted => {
            format!("{cost}; frames are sorted only where all stand for themselves, in one layer")
        }
        _ => cost,
    };
    let choice = Choice::new("axes", if sorted { "sorted by size" } else { "as they come" }, why);
    choice.saving(saved(report, Tool::Axes))
}

fn degree(report: &Report, settings: &Settings) -> Choice {
    let (source, stream) = report.sh_degree;
    let why = match settings.sh_degree {
        Some(asked) => format!("--sh-degree {asked}, the source has {source}"),
        None if stream < source => {
            format!("the source has {source}; no coefficient above {stream} reaches a quarter of a step")
        }
        None if source == 0 => "the source has no spherical harmonics".to_owned(),
        None => format!("the source has {source}, and its highest band rises above a quarter of a step"),
    };
    Choice::new("sh degree", stream.to_string(), why)
}

fn harmonics(report: &Report, settings: &Settings) -> Choice {
    let rank = report.sh_rank;
    let choice = match report.sh_codebook_entries {
        0 => format!("{rank} coefficients"),
        entries => format!("codebook of {} entries, {rank} components", grouped(entries.into())),
    };
    let trial = report.sh_trial.map(|[(bits, error), (book_bits, book_error)]| {
        format!(
            "coefficients take {bits:.2} bits per Gaussian (squared error {error:.3} steps), \
             a codebook {book_bits:.2} ({book_error:.3})"
        )
    });
    let asked = match settings.sh {
        ShChoice::Auto => None,
        ShChoice::Coefficients => Some("--sh coefficients".to_owned()),
        ShChoice::VectorQuantised => Some("--sh vq".to_owned()),
    };
    let reasons: Vec<String> = asked.into_iter().chain(trial).collect();
    let why = if reasons.is_empty() { "the only one tried".to_owned() } else { reasons.join("; ") };
    Choice::new("sh coding", choice, why).saving(saved(report, Tool::ShCoding))
}

/// How many of the components of spherical harmonics are needed, and what they are.
fn transform(report: &Report, settings: &Settings) -> Choice {
    let degree = report.sh_degree.1;
    let coefficients = 3 * (usize::from(degree + 1).pow(2) - 1);
    let choice = match settings.tools.sh_transform {
        true => format!("{} of {coefficients} principal components", report.sh_rank),
        false => format!("{} coefficients as they are", report.sh_rank),
    };
    let why = match usize::from(report.sh_rank) < coefficients {
        true => "all others round to 0 for every Gaussian",
        false => "each of them is needed by some Gaussian",
    };
    Choice::new("sh transform", choice, why).saving(saved(report, Tool::ShTransform))
}

/// Steps by size, opacity and importance.
fn laws(report: &Report, settings: &Settings) -> Option<Choice> {
    let laws = report.laws.filter(|laws| *laws != Laws::default())?;
    let refinements = settings.refinements.len();
    let coarser: Vec<String> = laws.coarser.iter().take(refinements).map(ToString::to_string).collect();
    let choice = format!("size to -{}, opacity to -{}", laws.area, laws.opacity);
    let why =
        format!("what pictures show least is coarsest: refinements by {} half octaves", coarser.join(", "));
    Some(Choice::new("step laws", choice, why).saving(saved(report, Tool::AdaptiveSteps)))
}

/// How tables of symbols are chosen.
fn tables(report: &Report) -> Vec<Choice> {
    let contexts = saved(report, Tool::Contexts).map(|saving| {
        let why = "against one table for each plane of a unit";
        Choice::new("contexts", "tables chosen by what is decoded before", why).saving(Some(saving))
    });
    let reuse = saved(report, Tool::TableReuse).map(|saving| {
        let choice = if saving.0 > 0.0 { "some are those of the refinement before" } else { "all are sent" };
        Choice::new("tables", choice, "whichever takes fewer bits, plane by plane").saving(Some(saving))
    });
    contexts.into_iter().chain(reuse).collect()
}

fn order(report: &Report, settings: &Settings) -> Option<Choice> {
    let (choice, why) = match report.importance? {
        Importance::Removal => {
            ("removal", "what pictures gain by a Gaussian and lose without it, weighed again as others go")
        }
        Importance::Contribution => {
            ("contribution", "transmittance times alpha over the pixels of all views")
        }
        Importance::Footprint => (
            "footprint",
            "opacity, the pixels covered and an estimate of the light that reaches it, mean of all views; weighed again as neighbours go",
        ),
        Importance::Volume => ("volume", "opacity times volume, no views"),
    };
    let views = match (report.importance?, settings.cameras.len()) {
        (Importance::Volume, _) => String::new(),
        (_, 0) => "; views made all around the scene".to_owned(),
        (_, count) => format!("; {} given", counted(count as u64, "view")),
    };
    Some(Choice::new("order", choice, format!("{why}{views}")))
}

/// The refinements, and what they cost.
fn refinements(report: &Report, settings: &Settings) -> Option<Choice> {
    let saving = saved(report, Tool::Refinements)?;
    let percents: Vec<String> = settings.refinements.iter().map(ToString::to_string).collect();
    let choice = format!("{} of up to {} %", percents.len(), percents.join(", "));
    let why = "positions and tables take more in several lists; their steps are in step laws";
    Some(Choice::new("refinements", choice, why).saving(Some(saving)))
}

/// Layers of a stream, and what its frames cost by type.
fn layers(report: &Report, settings: &Settings) -> Option<Choice> {
    if report.coded.is_empty() {
        return None;
    }
    let (spatial, structure) = match report.stands_alone {
        true => (1, Structure::Intra),
        false => (settings.spatial_layer_count(), settings.structure),
    };
    let temporal = match structure {
        Structure::Intra => "every frame by itself".to_owned(),
        Structure::Predicted { layers } => format!("{layers} temporal"),
    };
    let of_type = |frame_type: FrameType| {
        let frames = report.coded.iter().filter(|frame| frame.frame_type == frame_type);
        let (bytes, gaussians) = frames
            .fold((0, 0), |(bytes, gaussians), f| (bytes + f.bytes, gaussians + u64::from(f.gaussians)));
        (gaussians > 0).then(|| {
            format!(
                "{} frames take {:.2} bits per Gaussian",
                frame_type.name(),
                bytes as f64 * 8.0 / gaussians as f64
            )
        })
    };
    let types = [FrameType::Intra, FrameType::Predicted, FrameType::Enhancement];
    let costs: Vec<String> = types.into_iter().filter_map(of_type).collect();
    let choice = Choice::new("layers", format!("{spatial} spatial, {temporal}"), costs.join(", "));
    Some(choice.saving(saved(report, Tool::SpatialLayers)))
}

/// What predicted frames save against I frames like those that there are, and what longer GOPs would.
fn prediction(report: &Report, settings: &Settings) -> Option<Choice> {
    let sum = |is_intra: bool| {
        let frames = report.coded.iter().filter(|frame| (frame.frame_type == FrameType::Intra) == is_intra);
        frames.fold((0, 0, 0_u64), |(count, bytes, gaussians), frame| {
            (count + 1, bytes + frame.bytes, gaussians + u64::from(frame.gaussians))
        })
    };
    let ((count, bytes, gaussians), (others, other_bytes, other_gaussians)) = (sum(true), sum(false));
    if gaussians == 0 || other_gaussians == 0 {
        return None;
    }
    let [intra, predicted] =
        [bits_per_gaussian(bytes, gaussians), bits_per_gaussian(other_bytes, other_gaussians)];
    let all = bits_per_gaussian(bytes + other_bytes, gaussians + other_gaussians);
    let choice = format!("{} of {}", grouped(others), counted(count + others, "frame"));
    // With twice as many frames in a GOP half of the I frames would be predicted.
    let longer = (count > 1).then(|| {
        let percent = 0.5 * percent(count, count + others) * (intra - predicted) / all;
        format!("; twice as many would save about {percent:.1} %, where they can be predicted")
    });
    let why = format!("GOPs of up to {}{}", frames(settings.gop_length()), longer.unwrap_or_default());
    Some(Choice::new("prediction", choice, why).saving(Some((intra - all, Basis::Estimated))))
}

/// What became of the Gaussians of references.
fn survivors(report: &Report) -> Option<Choice> {
    let frames = || report.coded.iter().filter(|frame| frame.frame_type != FrameType::Intra);
    let sum = |count: fn(&FrameReport) -> u32| frames().map(|frame| u64::from(count(frame))).sum::<u64>();
    let parents = sum(|frame| frame.parents);
    if parents == 0 {
        return None;
    }
    let share = |count: u64| percent(count, parents);
    let choice = format!(
        "{:.1} % moved, {:.1} % updated, {:.1} % removed, {:.1} % new",
        share(sum(|frame| frame.moved)),
        share(sum(|frame| frame.updated)),
        share(sum(|frame| frame.removed)),
        share(sum(|frame| frame.new)),
    );
    let cells = sum(|frame| frame.cells) / frames().count().max(1) as u64;
    let why = format!("the rest is moved by {} per frame where it belongs, or stays", counted(cells, "cell"));
    Some(Choice::new("survivors", choice, why))
}

/// What untracked frames are true to.
fn fidelity(report: &Report, settings: &Settings) -> Option<Choice> {
    let frames = report.coded.iter().filter(|frame| frame.by_pictures).count();
    let why =
        format!("files are not tracked; what costs pictures less than {} dB is not sent", settings.tolerance);
    (frames > 0)
        .then(|| Choice::new("fidelity", format!("pictures in {}", counted(frames as u64, "frame")), why))
}

/// New Gaussians of all frames by predictor: none, knn, bilateral, transformer.
fn predicted(report: &Report) -> [u64; 4] {
    [0, 1, 2, 3].map(|index| report.coded.iter().map(|frame| frame.predicted[index]).sum())
}

fn predictors(report: &Report, settings: &Settings) -> Option<Choice> {
    let counts = predicted(report);
    let all: u64 = counts.iter().sum();
    if all == 0 {
        return None;
    }
    let names = ["none", "knn", "bilateral", "transformer"];
    let share = |(name, count): (&str, u64)| format!("{name} {:.1} %", percent(count, all));
    let choice = names.into_iter().zip(counts).map(share).collect::<Vec<_>>().join(", ");
    let why = match (settings.predictors, settings.predictor_choice) {
        (Predictors::NONE, _) => "--predictor none",
        (_, PredictorChoice::Bits) => "of new Gaussians; a unit is predicted where that makes it smaller",
        (_, PredictorChoice::Difference) => "of new Gaussians; the smallest sum of residuals, --choose-by l1",
    };
    let bytes: u64 = report.coded.iter().map(|frame| frame.prediction_saves).sum();
    let saving = (bits_per_gaussian(bytes, report.gaussians), Basis::Measured);
    let is_measured =
        settings.predictor_choice == PredictorChoice::Bits && counts.iter().skip(1).any(|&count| count > 0);
    Some(Choice::new("predictors", choice, why).saving(Some(saving).filter(|_| is_measured)))
}

/// Whether there is a network, where one may be.
fn network(report: &Report, settings: &Settings) -> Option<Choice> {
    let predicted = predicted(report);
    let [.., by_network] = predicted;
    let may_predict = settings.structure != Structure::Intra || settings.spatial_layers > 1;
    if !may_predict || predicted.iter().all(|&count| count == 0) {
        return None;
    }
    let is_tried = settings.network.is_some() || !settings.predictors.allows(Predictor::Bilateral);
    Some(match (by_network, is_tried) {
        (0, false) => {
            Choice::new("network", "none", "not tried: --network trained or --predictor transformer try one")
        }
        (0, true) => Choice::new("network", "none", "no unit of new Gaussians takes fewer bytes with it"),
        (count, _) => {
            let why = format!("it predicts {}", counted(count, "new Gaussian"));
            Choice::new("network", "sent with each GOP that needs it", why)
        }
    })
}

/// Whether values are fitted to pictures, where that was asked for or belongs to the preset.
fn fitting(report: &Report, settings: &Settings) -> Option<Choice> {
    let belongs = settings.preset == Preset::Small;
    let stands_alone = report.stands_alone || settings.structure == Structure::Intra;
    let (choice, why) = match (&settings.finetune, settings.structure) {
        (Some(_), _) if report.target.is_some_and(|target| target.without_finetune) => {
            ("none".to_owned(), "without, the stream takes fewer bytes at equal PSNR")
        }
        (Some(finetune), _) => {
            let loss = match finetune.loss {
                FinetuneLoss::SquaredError => "squared error",
                FinetuneLoss::L1Ssim { .. } => "L1 and SSIM",
            };
            let choice = format!("{}, {loss}", counted(finetune.iterations.into(), "iteration"));
            let why = if stands_alone {
                "values of frames are chosen by pictures"
            } else {
                "values of I frames are chosen by pictures, and frames that are predicted from them follow"
            };
            (choice, why)
        }
        (None, Structure::Predicted { .. }) if belongs => (
            "none".to_owned(),
            "--finetune has I frames fitted, and frames that are predicted from them follow",
        ),
        (None, _) if belongs => ("none".to_owned(), "--finetune 0"),
        (None, _) => return None,
    };
    Some(Choice::new("fitting", choice, why))
}

fn left_out(settings: &Settings) -> Option<Choice> {
    let Tools { contexts, axis_sort, sh_transform, table_reuse, adaptive_steps, cell_motion, survivors } =
        settings.tools;
    let tools = [
        (contexts, "contexts"),
        (axis_sort, "axis-sort"),
        (sh_transform, "sh-transform"),
        (table_reuse, "table-reuse"),
        (adaptive_steps, "adaptive-steps"),
        (cell_motion, "cell-motion"),
        (survivors, "survivors"),
    ];
    let names: Vec<&str> = tools.into_iter().filter(|(used, _)| !used).map(|(_, name)| name).collect();
    (!names.is_empty()).then(|| Choice::new("left out", names.join(", "), "--without"))
}

fn invisible(report: &Report, settings: &Settings) -> Choice {
    if settings.keep_invisible {
        return Choice::new("invisible", "kept", "--keep-invisible");
    }
    let share = percent(report.invisible, report.invisible + report.gaussians);
    let choice = format!("{} left out ({share:.2} %)", grouped(report.invisible));
    Choice::new("invisible", choice, "opacity below 1/255 everywhere; --keep-invisible keeps them")
}
