//! Down the slope of what pictures miss and of what values take in bits.
//!
//! Each iteration decodes the values as they would be coded now, draws the result in a few views, and takes the slopes of
//! what is missing there for those of the values before they were rounded: so each goes on until it is rounded to the
//! other side, and no further. Values are counted in their own steps, which makes one rate right for all attributes. What
//! judges see, and what is kept, are not the values of one moment but [means](super::means) of what they were rounded to.
//!
//! What is summed over the operating points that count, each as its receivers see it and by its weight, are logarithms of
//! losses, in decibels where these are squared errors. Of losses themselves those of prefixes, a hundred times as large, would be
//! all that matters.
//!
//! A bit is worth what it would bring elsewhere: how much better judges like the values that are nearest to those of the source
//! than the same with steps twice as long, by the bits between them.
#![expect(clippy::arithmetic_side_effects, reason = "sums and products of floats; counts of views")]

mod kept;

use super::latent::{Decoded, Latent};
use super::means::Means;
use super::pictures::{Pictures, Verdict, View};
use super::rate::Rate;
use super::receivers::Receiver;
use super::report::FinetuneReport;
use super::request::Finetune;
use super::state::entry::{Entry, Stage};
use super::watch::FinetuneProgress;
use crate::attribute::Attribute;
use crate::error::Error;
use crate::frame::compensation::{Compensator, compensated};
use core::f64::consts::{LN_10, PI};
use core::mem;
use core::ops::Range;
use core::time::Duration;
pub(super) use kept::Finished;
use rayon::prelude::*;
use splatstream_gaussians::GaussianFrame;
use splatstream_render::PreparedFrame;
use splatstream_render::gradient::{Adam, Gradients, Rates};
use std::borrow::Cow;
use std::time::Instant;

/// Views of an iteration.
const VIEWS: usize = 2;

/// How far an iteration takes a value at first, steps.
const RATE: f32 = 0.015;

/// Iterations from one choice of models, and one look of the judges, to the next.
const EVERY: u32 = 20;

/// Slopes are divided by the loss of about so many of the last views of the same receiver.
const REMEMBERED: f64 = 20.0;

/// Looks of the judges, one after the other, at nothing better after which it ends.
const PATIENCE: u32 = 5;

/// A loss of a picture below which it shows what it should.
const NOTHING: f64 = 1e-9;

/// Bits that the position of a new Gaussian takes less where its steps are twice as long.
const OF_POSITION: f64 = 3.0;

/// A fit under way.
pub(super) struct Descent<'a> {
    latent: Latent<'a>,
    sights: Vec<Sight>,
    compensator: Option<&'a Compensator>,
    pictures: Pictures<'a>,
    finetune: &'a Finetune,
    adam: Adam,
    means: Means,
    /// What a bit is worth, dB of what is made small.
    price: f64,
    /// Iterations that are done.
    done: u32,
    start: Instant,
    /// Time that earlier runs have taken.
    earlier: Duration,
    best: Best,
}

/// How a receiver sees the frame.
struct Sight {
    receiver: Receiver,
    /// What it adds to log-scales and opacities.
    compensation: (i8, i8),
    /// The loss of a view, about; none before the first.
    loss: Option<f64>,
}

/// What judges liked most.
struct Best {
    /// Decibels, less what its bits would have brought by finer steps.
    worth: f64,
    offsets: GaussianFrame,
    compensation: Vec<(i8, i8)>,
    /// The first look, and the one at this.
    before: Look,
    after: Look,
    /// Looks since then.
    waited: u32,
}

/// What judges saw.
#[derive(Clone, Copy, Default)]
struct Look {
    psnr: f64,
    /// What is made small, as decibels below 1.
    quality: f64,
    bits: f64,
}

impl<'a> Descent<'a> {
    pub(super) fn new(
        latent: Latent<'a>,
        (receivers, pictures): (Vec<Receiver>, Pictures<'a>),
        compensator: Option<&'a Compensator>,
        finetune: &'a Finetune,
    ) -> Self {
        let (adam, means) = (Adam::new(&latent.offsets), Means::new(&latent));
        let sight = |receiver| Sight { receiver, compensation: (0, 0), loss: None };
        let sights: Vec<_> = receivers.into_iter().map(sight).collect();
        let best = Best {
            worth: 0.0,
            offsets: latent.offsets.clone(),
            compensation: vec![(0, 0); sights.len()],
            before: Look::default(),
            after: Look::default(),
            waited: 0,
        };
        Self {
            latent,
            sights,
            compensator,
            pictures,
            finetune,
            adam,
            means,
            price: 0.0,
            done: 0,
            start: Instant::now(),
            earlier: Duration::ZERO,
            best,
        }
    }

    /// Goes on as long as it may, with values of `spatial_layer`; gives the values that judges like most, and what has been done.
    /// `entry`: where it is kept how far it has come, and where an earlier run may have left that.
    pub(super) fn run(
        mut self,
        spatial_layer: u8,
        mut entry: Option<Entry>,
    ) -> Result<(Latent<'a>, FinetuneReport), Error> {
        let rate = Rate::new(&self.latent)?;
        let before = self.latent.decoded()?;
        self.begin(&before, rate.bits)?;
        let before = self.witnessed(&before)?;
        self.go_on(entry.as_ref())?;
        let resumed = self.done;
        self.descend(rate, spatial_layer, entry.as_mut())?;
        let receivers = self.sights.iter().map(|sight| &sight.receiver);
        let mut report = FinetuneReport {
            iterations: self.done,
            resumed,
            seconds: self.elapsed().as_secs_f64(),
            psnr: [self.best.before.psnr, self.best.after.psnr],
            bits: [self.best.before.bits, self.best.after.bits],
            ..FinetuneReport::of_points(spatial_layer, receivers)
        };
        self.latent.offsets.clone_from(&self.best.offsets);
        let kept = self.latent.decoded()?;
        self.compensate_as_best();
        let seen = before.into_iter().zip(self.witnessed(&kept)?);
        report.points.iter_mut().zip(seen).for_each(|(point, (before, after))| point.psnr = [before, after]);
        if let Some(entry) = &mut entry {
            entry.write(Stage::Finished, &mut Finished { latent: &mut self.latent, report: &mut report })?;
        }
        Ok((self.latent, report))
    }

    /// All iterations, each from the models of the last look: the first from `rate`.
    fn descend(
        &mut self,
        mut rate: Rate,
        spatial_layer: u8,
        mut entry: Option<&mut Entry>,
    ) -> Result<(), Error> {
        let resumed = self.done;
        loop {
            let is_over = self.done >= self.finetune.iterations || self.share() >= 1.0;
            if !is_over {
                self.keep(entry.as_deref_mut(), resumed)?;
            }
            let decoded = self.latent.decoded()?;
            self.means.add(&self.latent, &decoded.frame, self.done + 1);
            if is_over || (self.done > 0 && self.done.is_multiple_of(EVERY)) {
                rate = self.look()?;
            }
            if is_over || self.best.waited >= PATIENCE {
                break;
            }
            self.step(&decoded, &rate)?;
            self.done += 1;
            let (done, iterations) = (self.done, self.finetune.iterations);
            self.finetune.watch.tell(FinetuneProgress { spatial_layer, done, iterations });
        }
        Ok(())
    }

    /// What a receiver sees.
    fn shown<'b>(&'b self, decoded: &'b Decoded, sight: &Sight) -> Result<Cow<'b, GaussianFrame>, Error> {
        if self.latent.is_complete(&sight.receiver) {
            return Ok(Cow::Borrowed(&decoded.frame));
        }
        let lists = self.latent.received(decoded, &sight.receiver);
        compensated(&lists, sight.compensation, self.latent.coder.sequence).map(Cow::Owned)
    }

    /// Finds what fills the holes of prefixes, as the encoder will when it codes them.
    fn compensate(&mut self, decoded: &Decoded) -> Result<(), Error> {
        let Some(compensator) = self.compensator else { return Ok(()) };
        for Sight { receiver, compensation, .. } in &mut self.sights {
            if receiver.lists.len() < self.latent.lists.len() {
                let lists = self.latent.received(decoded, receiver);
                *compensation = compensator.offsets(&lists, self.latent.coder.sequence)?;
            }
        }
        Ok(())
    }

    /// PSNR of each receiver in views by which nothing is chosen.
    fn witnessed(&self, decoded: &Decoded) -> Result<Vec<f64>, Error> {
        let of_sight =
            |sight: &Sight| Ok(self.pictures.witness(&sight.receiver, self.shown(decoded, sight)?.as_ref()));
        self.sights.iter().map(of_sight).collect()
    }

    /// The time that all runs together have taken.
    fn elapsed(&self) -> Duration {
        self.earlier.saturating_add(self.start.elapsed())
    }

    /// The share of the iterations, or of the time, that has gone.
    fn share(&self) -> f64 {
        let of_time = |budget: Duration| self.elapsed().as_secs_f64() / budget.as_secs_f64();
        let of_time = self.finetune.time_budget.map_or(0.0, of_time);
        (f64::from(self.done) / f64::from(self.finetune.iterations.max(1))).max(of_time)
    }

    /// Fills the holes of prefixes as those of the best values are.
    fn compensate_as_best(&mut self) {
        self.sights
            .iter_mut()
            .zip(&self.best.compensation)
            .for_each(|(sight, &own)| sight.compensation = own);
    }

    /// Lets the judges look at the means of what values were rounded to, and keeps what they like more than all before. Gives the
    /// models of the mean of the last.
    fn look(&mut self) -> Result<Rate, Error> {
        self.best.waited += 1;
        self.show(|means| &mut means.other)?;
        self.show(|means| &mut means.last)
    }

    /// Lets them look at one of the means. What is worse than the start is never kept, whatever bits it saves.
    fn show(&mut self, mean: fn(&mut Means) -> &mut GaussianFrame) -> Result<Rate, Error> {
        mem::swap(&mut self.latent.offsets, mean(&mut self.means));
        let rate = Rate::new(&self.latent)?;
        let decoded = self.latent.decoded()?;
        let now = self.judged(&decoded, rate.bits)?;
        mem::swap(&mut self.latent.offsets, mean(&mut self.means));
        let compensation = self.compensation();
        let best = &mut self.best;
        let worth = now.quality - self.price * (now.bits - best.before.bits);
        if worth > best.worth && now.quality >= best.before.quality {
            best.offsets.clone_from(mean(&mut self.means));
            (best.worth, best.compensation, best.after, best.waited) = (worth, compensation, now, 0);
        }
        Ok(rate)
    }

    /// What prefixes are compensated by now.
    fn compensation(&self) -> Vec<(i8, i8)> {
        self.sights.iter().map(|sight| sight.compensation).collect()
    }

    /// What judges see of a decoded frame of so many bits.
    fn judged(&mut self, decoded: &Decoded, bits: f64) -> Result<Look, Error> {
        self.compensate(decoded)?;
        let mut look = Look { psnr: 0.0, quality: 0.0, bits };
        for sight in &self.sights {
            let Verdict { psnr, quality } =
                self.pictures.judge(&sight.receiver, self.shown(decoded, sight)?.as_ref())?;
            look.psnr += sight.receiver.weight * psnr;
            look.quality += sight.receiver.weight * quality;
        }
        Ok(look)
    }

    /// Lets the judges look at the values before they are changed, `decoded`, of so many bits, and measures what a bit is worth:
    /// what it brings where all steps are made finer, from steps twice as long to these. 0 where bits bring nothing that judges
    /// see: then none is worth saving.
    fn begin(&mut self, decoded: &Decoded, bits: f64) -> Result<(), Error> {
        let coarser = self.latent.an_octave_coarser()?;
        let new = coarser.lists.iter().filter(|list| list.parents.is_none());
        let positions = OF_POSITION * new.map(|list| list.rows.len()).sum::<usize>() as f64;
        let coarser = self.judged(&coarser.decoded()?, Rate::new(&coarser)?.bits)?;
        let own = self.judged(decoded, bits)?;
        let (brought, taken) = (own.quality - coarser.quality, own.bits - coarser.bits + positions);
        self.price = if taken >= 1.0 { (brought / taken).max(0.0) } else { 0.0 };
        let compensation = self.compensation();
        let best = &mut self.best;
        (best.worth, best.compensation, best.before, best.after) = (own.quality, compensation, own, own);
        Ok(())
    }

    /// One iteration.
    fn step(&mut self, decoded: &Decoded, rate: &Rate) -> Result<(), Error> {
        let mut gradients = Gradients::zero(&decoded.frame);
        let views: Vec<_> = (0..VIEWS).map_while(|_| self.pictures.next()).collect();
        for (place, view) in &views {
            self.look_from(decoded, *place, view, &mut gradients)?;
        }
        self.latent.to_steps(&decoded.frame, &mut gradients);
        // Slopes are sums over the views, of natural logarithms.
        let price = self.price * views.len() as f64 * LN_10 / 10.0;
        rate.add(&self.latent, decoded, price as f32, gradients.planes_mut());
        let slower = (0.5 + 0.5 * libm::cos(PI * self.share())) as f32;
        self.adam.step(&mut self.latent.offsets, &gradients, &self.finetune.rates(RATE * slower))?;
        Ok(())
    }

    /// Adds the slopes of the logarithm of what a receiver misses in a view, by each value of this layer that it sees.
    fn look_from(
        &mut self,
        decoded: &Decoded,
        place: usize,
        view: &View,
        sum: &mut Gradients,
    ) -> Result<(), Error> {
        let Some(sight) = self.sights.get(place) else { return Ok(()) };
        let shown = self.shown(decoded, sight)?;
        let prepared = PreparedFrame::new(&shown);
        let drawing = prepared.draw(&view.camera, self.pictures.background);
        let (loss, slopes) = self.finetune.loss.of(&view.wanted, &drawing.rendering().colour)?;
        let before = sight.loss.unwrap_or(loss);
        let mean = before + (loss - before) / REMEMBERED;
        let mut own = Gradients::zero(&shown);
        drawing.backward(&slopes, &mut own)?;
        // Where nothing is missing there is nowhere to go.
        let scale = if mean > NOTHING { 1.0 / mean } else { 0.0 };
        add(&own, scale as f32, &self.latent.seen(&sight.receiver), sum)?;
        if let Some(sight) = self.sights.get_mut(place) {
            sight.loss = Some(mean);
        }
        Ok(())
    }
}

/// Adds multiples of the slopes of some rows.
///
/// # Errors
/// Rows that the slopes do not have.
fn add(own: &Gradients, scale: f32, rows: &[Range<usize>], sum: &mut Gradients) -> Result<(), Error> {
    let planes: Vec<_> = sum.planes_mut().iter_mut().zip(own.planes().iter()).collect();
    planes.into_par_iter().try_for_each(|(sum, own)| {
        for rows in rows {
            let parts = sum.get_mut(rows.clone()).zip(own.get(rows.clone()));
            let (sum, own) = parts.ok_or(Error::Fault("a receiver sees Gaussians without slopes"))?;
            sum.iter_mut().zip(own).for_each(|(sum, slope)| *sum += scale * slope);
        }
        Ok(())
    })
}

impl Finetune {
    /// The rates of the attributes that are fitted.
    fn rates(&self, rate: f32) -> Rates {
        let of = |attribute: Attribute| if self.held.contains(&attribute) { 0.0 } else { rate };
        Rates {
            position: of(Attribute::Position),
            log_scale: of(Attribute::LogScale),
            rotation: of(Attribute::Rotation),
            opacity_logit: of(Attribute::Opacity),
            dc: of(Attribute::Dc),
            sh: of(Attribute::Sh),
        }
    }
}
