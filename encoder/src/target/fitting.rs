//! Steps for the first frame, and what is known of them.

use super::{NEAR_DECIBELS, gained};
use crate::allocation::{Fit, finer};
use crate::error::Error;
use crate::first_frame::{coded_form, first_frame, read_first};
use crate::importance::Ranking;
use crate::report::Report;
use crate::savings::Saving;
use crate::settings::{Preset, Settings, ShChoice};
use crate::source::FrameSource;
use crate::steps::Steps;
use crate::strips::StripViews;
use crate::verification::{Tried, Views};

/// Steps are shared differently among attributes where the PSNR is another by more than this, decibels.
const ALIKE: f64 = 4.0;

/// What fitting values to pictures brings on average scenes, decibels, after many iterations; and after how many it has
/// brought two thirds of that.
const GAIN: [f64; 2] = [3.6, 45.0];

/// Fits steps to the first frame.
pub(super) struct Fitting<'a> {
    pub(super) settings: &'a Settings,
    fit: Fit,
    /// Knows the order of the first frame.
    pub(super) ranking: Ranking,
    /// Views of the first frame that decide nothing, where these are the same when the stream is looked at.
    unseen: Option<StripViews>,
    /// How frames are coded besides.
    pub(super) way: Way,
}

/// A way to code frames, and what is known about it.
pub(super) struct Way {
    /// Whether values are fitted to pictures, where the settings say so.
    pub(super) fits_values: bool,
    /// How SH is coded: as the settings say, until a codebook turns out to cost pictures too much.
    pub(super) sh: ShChoice,
    /// Steps by the PSNR that they were fitted for, with the one that they were seen to have.
    known: Vec<(f64, Steps, Option<f64>)>,
    /// Whether frames stand for themselves, where that is settled.
    pub(super) alone: Option<bool>,
}

impl Way {
    pub(super) const fn new(fits_values: bool, settings: &Settings) -> Self {
        Self { fits_values, sh: settings.sh, known: Vec::new(), alone: None }
    }
}

impl<'a> Fitting<'a> {
    pub(super) fn new(source: &mut dyn FrameSource, settings: &'a Settings) -> Result<Self, Error> {
        let frame = read_first(source)?;
        let Views { of_fit, unseen } = Views::of(&frame, settings);
        let frame = coded_form(frame, settings);
        // What is left out of the source is in its pictures.
        let unseen = settings.prune.is_none().then_some(unseen);
        // What is left out counts as an error.
        let whole = match settings.prune {
            Some(_) => {
                let original = source.original(0).map_err(|source| Error::Source { frame: 0, source })?;
                Some(coded_form(original, settings))
            }
            None => None,
        };
        let mut ranking = Ranking::new(settings);
        let ranked = ranking.rank_first(&frame);
        let fit = Fit::new((&frame, whole.as_ref()), &ranked, &of_fit, settings);
        Ok(Self { settings, fit, ranking, unseen, way: Way::new(true, settings) })
    }

    /// What fitting values to pictures will bring, nearly, decibels: steps are looked for that much coarser from the start.
    pub(super) fn gain(&self) -> f64 {
        let is_fitted = self.way.fits_values && !self.leaves_source();
        self.settings.finetune.as_ref().filter(|_| is_fitted).map_or(0.0, |finetune| {
            let [most, iterations] = GAIN;
            let gain = most * (1.0 - libm::exp(-f64::from(finetune.iterations) / iterations));
            gain * finetune.share_of_everything(self.settings)
        })
    }

    /// Gives up a codebook with which pictures miss a PSNR, if nobody asked for one; whether there was one.
    ///
    /// The fit knows of coefficients only. What a codebook costs pictures beyond these, all other attributes would have to
    /// make up for with finer steps, which takes more bits than the codebook saves.
    pub(super) fn gives_up_codebook(&mut self, report: &Report, missed: f64) -> bool {
        let has_one = self.may_do_without_codebook(report.sh_codebook_entries);
        // Nor is it to blame for what fitting was to bring and did not.
        let by_fitting = (self.gain() - gained(report).unwrap_or(0.0)).max(0.0);
        let is_dear = has_one && missed - by_fitting > NEAR_DECIBELS;
        if is_dear {
            self.way.sh = ShChoice::Coefficients;
        }
        is_dear
    }

    /// Whether there is a codebook of so many entries, and nobody asked for it.
    pub(super) fn may_do_without_codebook(&self, entries: u32) -> bool {
        entries > 0 && self.way.sh == ShChoice::Auto
    }

    /// Settings with the steps for a PSNR: those for one that is near, all finer or coarser by the same factor, or new
    /// ones.
    pub(super) fn at(&mut self, decibels: f64, source: &mut dyn FrameSource) -> Result<Settings, Error> {
        let apart = |known: &&(f64, Steps, Option<f64>)| (known.0 - decibels).abs();
        let nearest = self.way.known.iter().min_by(|a, b| apart(a).total_cmp(&apart(b)));
        let steps = match nearest.filter(|known| apart(known) <= ALIKE) {
            Some((from, steps, _)) => self.fit.no_finer(finer(*steps, decibels - from)),
            None => {
                let again = || first_frame(source, self.settings);
                let (steps, psnr) = self.fit.at(decibels as f32, again)?;
                self.way.known.push((decibels, steps, psnr));
                steps
            }
        };
        let finetune = self.settings.finetune.clone().filter(|_| self.way.fits_values);
        let settings =
            Settings { steps, laws: self.fit.laws(), sh: self.way.sh, finetune, ..self.settings.clone() };
        Ok(if self.way.alone == Some(true) { settings.alone() } else { settings })
    }

    /// What fitting has seen of the frame with the steps for a PSNR, if it has drawn it with just these.
    pub(super) fn tried(&self, decibels: f64) -> Option<Tried> {
        let &(_, _, psnr) = self.way.known.iter().find(|known| known.0 == decibels)?;
        Some(Tried { unseen: self.unseen.clone()?, psnr: psnr? })
    }

    /// Whether values will be fitted to photographs: they leave what pictures of the source show, by which steps are found.
    pub(super) fn leaves_source(&self) -> bool {
        self.settings.finetune.as_ref().is_some_and(|finetune| !finetune.photographs.is_empty())
    }

    /// What laws save with the steps for a PSNR; not where time counts.
    pub(super) fn worth_of_laws(
        &mut self,
        decibels: f64,
        source: &mut dyn FrameSource,
    ) -> Result<Option<Saving>, Error> {
        match self.settings.preset {
            Preset::Fast => Ok(None),
            Preset::Balanced | Preset::Small => {
                let steps = self.at(decibels, source)?.steps;
                self.fit.worth_of_laws(&steps)
            }
        }
    }
}
