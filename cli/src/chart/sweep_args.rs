//! The options that say what is swept.

use crate::setting_names::{PresetName, QualityName, ToolName, spelled};
use clap::{Args, ValueEnum};
use splatstream_chart::sweep::{Group, Sweep, Variant};
use splatstream_encoder::{Quality, Settings};

/// The options that say what is swept.
#[derive(Args, Debug, Clone)]
pub(super) struct SweepArgs {
    /// Presets; default is all.
    #[arg(long, value_enum, value_name = "PRESET,...", value_delimiter = ',')]
    presets: Vec<PresetName>,
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
    /// One preset, few points, small pictures, one timing: a look at the page, no measurement.
    #[arg(long)]
    pub(super) quick: bool,
}

impl SweepArgs {
    /// The sweep asked for, with the defaults of a full or a quick one.
    pub(super) fn sweep(&self, ticks: (u32, u32)) -> Sweep {
        let quick = self.quick;
        let presets = given(&self.presets, quick, &[PresetName::Balanced]);
        let asked = given(&self.qualities, quick, &[QualityName::Low, QualityName::High]);
        let asked: Vec<Quality> = asked.into_iter().map(Quality::from).collect();
        let qualities = Quality::ALL.into_iter().filter(|quality| asked.contains(quality)).collect();
        let refinements = match (self.refinements.as_slice(), quick) {
            ([], true) => vec![20, 100],
            ([], false) => Settings::default().refinements,
            (asked, _) => asked.to_vec(),
        };
        let settings = |preset: PresetName| Settings {
            preset: preset.into(),
            refinements: refinements.clone(),
            ticks,
            ..Settings::default()
        };
        let base = presets.iter().copied().find(|&preset| preset == PresetName::Balanced);
        let base = base.or(presets.first().copied()).unwrap_or(PresetName::Balanced);
        let baseline = Variant {
            name: spelled(base),
            group: Group::Baseline,
            reorders: false,
            settings: settings(base),
        };
        let others = presets.iter().filter(|&&preset| preset != base).map(|&preset| Variant {
            name: spelled(preset),
            group: Group::Preset,
            reorders: false,
            settings: settings(preset),
        });
        let tools = given(&self.without, quick, &[ToolName::Contexts]);
        let without = tools.iter().map(|&tool| {
            let mut settings = settings(base);
            tool.leave_out_of(&mut settings);
            let reorders = tool == ToolName::ViewImportance;
            Variant { name: format!("without {}", spelled(tool)), group: Group::Without, reorders, settings }
        });
        let variants = std::iter::once(baseline).chain(others).chain(without).collect();
        let repeat = self.repeat.unwrap_or(if quick { 1 } else { 3 });
        Sweep { variants, qualities, refinements, repeat }
    }
}

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
            quick,
        };
        args.sweep((30, 1))
    }

    #[test]
    fn the_baseline_comes_first_and_every_variant_differs_from_it() {
        let sweep = sweep(&[PresetName::Small, PresetName::Balanced], false);
        let names: Vec<&str> = sweep.variants.iter().map(|variant| variant.name.as_str()).collect();
        assert_eq!(names, ["balanced", "small", "without prune"]);
        let [baseline, others @ ..] = sweep.variants.as_slice() else { panic!("variants") };
        assert_eq!(baseline.group, Group::Baseline);
        assert!(others.iter().all(|variant| variant.settings != baseline.settings));
        assert_eq!((sweep.quality(), sweep.runs().count()), (Quality::High, 12));
    }

    #[test]
    fn a_quick_sweep_has_two_qualities_and_one_preset() {
        let sweep = sweep(&[], true);
        assert_eq!((sweep.variants.len(), sweep.qualities.len(), sweep.repeat), (2, 2, 1));
        assert_eq!(sweep.refinements, [20, 100]);
    }
}
