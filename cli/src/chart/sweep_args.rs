//! The options that say what is swept.

use super::QUICK_HEIGHT;
use crate::numbers::counted;
use crate::setting_names::{PresetName, QualityName, ToolName, spelled};
use clap::{Args, ValueEnum};
use splatstream_chart::sweep::{Group, Sweep, Variant};
use splatstream_encoder::{Finetune, Quality, Settings};

/// The options that say what is swept.
#[derive(Args, Debug, Clone)]
pub(super) struct SweepArgs {
    /// Presets on the front of speed and size; default is all. Everything else is measured with balanced, or with the first.
    #[arg(long, value_enum, value_name = "PRESET,...", value_delimiter = ',')]
    presets: Vec<PresetName>,
    /// Iterations of fitting values to pictures that stand on the front, each for two qualities [default: 5,20; 5 if quick].
    #[arg(long, value_name = "ITERATIONS,...", value_delimiter = ',')]
    #[arg(value_parser = clap::value_parser!(u32).range(1..))]
    finetune: Vec<u32>,
    /// Qualities, at least two for a curve; default is all.
    #[arg(long, value_enum, value_name = "QUALITY,...", value_delimiter = ',')]
    qualities: Vec<QualityName>,
    /// Share of the Gaussians up to each refinement, percent: 1 to 10 rising numbers, the last 100.
    #[arg(long, value_name = "PERCENTS", value_delimiter = ',')]
    refinements: Vec<u8>,
    /// Tools of the encoder that are left out one at a time; default is each.
    #[arg(long, value_enum, value_name = "TOOL,...", value_delimiter = ',')]
    without: Vec<ToolName>,
    /// Times that encoding and decoding are timed at the quality of comparison; the median counts.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100))]
    repeat: Option<u32>,
    /// Two presets, few points, small pictures, one timing: a look at the page, no measurement.
    #[arg(long)]
    pub(super) quick: bool,
}

impl SweepArgs {
    /// The sweep asked for, with the defaults of a full or a quick one.
    pub(super) fn sweep(&self, ticks: (u32, u32)) -> Sweep {
        let quick = self.quick;
        let asked = given(&self.qualities, quick, &[QualityName::Low, QualityName::High]);
        let asked: Vec<Quality> = asked.into_iter().map(Quality::from).collect();
        let qualities = Quality::ALL.into_iter().filter(|quality| asked.contains(quality)).collect();
        let refinements = match (self.refinements.as_slice(), quick) {
            ([], true) => vec![20, 100],
            ([], false) => Settings::default().refinements,
            (asked, _) => asked.to_vec(),
        };
        let settings = |preset: PresetName| Settings {
            refinements: refinements.clone(),
            ticks,
            ..Settings::of(preset.into())
        };
        let (baseline, others) = self.efforts(settings);
        let tools = given(&self.without, quick, &[ToolName::Contexts]);
        let without = tools.iter().map(|&tool| {
            let mut settings = baseline.settings.clone();
            tool.leave_out_of(&mut settings);
            let reorders = tool == ToolName::ViewImportance;
            Variant { name: format!("without {}", spelled(tool)), group: Group::Without, reorders, settings }
        });
        let variants = std::iter::once(baseline.clone()).chain(without).collect();
        let efforts = std::iter::once(baseline.clone()).chain(others).collect();
        let repeat = self.repeat.unwrap_or(if quick { 1 } else { 3 });
        Sweep { variants, qualities, refinements, repeat, efforts, choices: !quick }
    }

    /// What stands on the front: the baseline; other presets, and the baseline with values that are fitted to pictures.
    fn efforts(&self, settings: impl Fn(PresetName) -> Settings) -> (Variant, Vec<Variant>) {
        let presets = given(&self.presets, self.quick, &[PresetName::Fast, PresetName::Balanced]);
        let base = presets.iter().copied().find(|&preset| preset == PresetName::Balanced);
        let base = base.or(presets.first().copied()).unwrap_or(PresetName::Balanced);
        let effort = |name: String, group: Group, settings: Settings| Variant {
            name,
            group,
            reorders: false,
            settings,
        };
        let others = presets.iter().filter(|&&preset| preset != base);
        let mut efforts: Vec<Variant> =
            others.map(|&preset| effort(spelled(preset), Group::Preset, settings(preset))).collect();
        let iterations = match (self.finetune.as_slice(), self.quick) {
            ([], true) => &QUICK_ITERATIONS[..],
            ([], false) => &ITERATIONS[..],
            (asked, _) => asked,
        };
        efforts.extend(iterations.iter().map(|&iterations| {
            let lines = if self.quick { vec![QUICK_HEIGHT] } else { Vec::new() };
            let finetune = Some(Finetune { iterations, lines, ..Finetune::default() });
            let name = format!("{}, {}", spelled(base), counted(iterations.into(), "iteration"));
            effort(name, Group::Fitted, Settings { finetune, ..settings(base) })
        }));
        (effort(spelled(base), Group::Baseline, settings(base)), efforts)
    }
}

/// Iterations that stand on the front unless others are asked for.
const ITERATIONS: [u32; 2] = [5, 20];
const QUICK_ITERATIONS: [u32; 1] = [5];

/// What was asked for, or a default: everything, or a few if in a hurry.
fn given<T: ValueEnum + PartialEq>(asked: &[T], quick: bool, few: &[T]) -> Vec<T> {
    let mut values = match (asked, quick) {
        ([], true) => few.to_vec(),
        ([], false) => T::value_variants().to_vec(),
        (asked, _) => asked.to_vec(),
    };
    values.dedup();
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sweep(presets: &[PresetName], quick: bool) -> Sweep {
        let args = SweepArgs {
            presets: presets.to_vec(),
            qualities: Vec::new(),
            refinements: Vec::new(),
            without: vec![ToolName::Prune],
            repeat: None,
            finetune: vec![7],
            quick,
        };
        args.sweep((30, 1))
    }

    #[test]
    fn the_baseline_comes_first_and_every_variant_differs_from_it() {
        let sweep = sweep(&[PresetName::Small, PresetName::Balanced], false);
        let names =
            |variants: &[Variant]| variants.iter().map(|variant| variant.name.clone()).collect::<Vec<_>>();
        assert_eq!(names(&sweep.variants), ["balanced", "without prune"]);
        assert_eq!(names(&sweep.efforts), ["balanced", "small", "balanced, 7 iterations"]);
        for variants in [&sweep.variants, &sweep.efforts] {
            let [baseline, others @ ..] = variants.as_slice() else { panic!("variants") };
            assert_eq!(baseline.group, Group::Baseline);
            assert!(others.iter().all(|variant| variant.settings != baseline.settings));
        }
        assert_eq!((sweep.quality(), sweep.runs().count()), (Quality::High, 8));
    }

    #[test]
    fn a_quick_sweep_has_two_qualities_and_two_presets() {
        let sweep = sweep(&[], true);
        assert_eq!((sweep.variants.len(), sweep.qualities.len(), sweep.repeat), (2, 2, 1));
        assert_eq!((sweep.efforts.len(), sweep.choices), (3, false));
        assert_eq!(sweep.refinements, [20, 100]);
    }
}
