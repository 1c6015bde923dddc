//! Down the slope of what pictures miss and of what values take in bits.
//!
//! Each iteration decodes the values as they would be coded now, draws the result in a few views, and takes the slopes of
//! what is missing there for those of the values before they were rounded: so each goes on until it is rounded to the
//! other side, and no further. Values are counted in their own steps, which makes one rate right for all attributes.
//!
//! A bit is worth what it would bring elsewhere: steps that are halved cost a bit for nearly each value and divide the error
//! by four, so that at the margin a bit brings 2 ln 2 of the error by the bits of an octave.
#![expect(clippy::arithmetic_side_effects, reason = "sums and products of floats; counts of views")]

use super::latent::{Decoded, Latent};
use super::pictures::{BACKGROUND, Pictures, View, squared_error};
use super::rate::Rate;
use super::{Finetune, FinetuneReport};
use crate::allocation::Attribute;
use crate::error::Error;
use core::f64::consts::{LN_2, PI};
use splatstream_gaussians::GaussianFrame;
use splatstream_render::PreparedFrame;
use splatstream_render::gradient::{Adam, Gradients, Rates};
use std::time::Instant;

/// Views of an iteration.
const VIEWS: usize = 2;

/// How far an iteration takes a value at first, steps.
const RATE: f32 = 0.02;

/// The price of a bit, of what it would bring where steps are made finer.
const PRICE: f64 = 1.0;

/// Iterations from one choice of models, and one look of the judges, to the next.
const EVERY: u32 = 20;

/// The error that prices go by is that of about so many of the last views.
const REMEMBERED: f64 = 20.0;

/// Looks of the judges, one after the other, at nothing better after which it ends: each halves the rate.
const PATIENCE: u32 = 5;

/// What halving all steps brings, dB.
const DECIBELS_AN_OCTAVE: f64 = 6.02;

/// A fit under way.
pub(super) struct Descent<'a> {
    latent: Latent<'a>,
    pictures: Pictures<'a>,
    finetune: &'a Finetune,
    adam: Adam,
    rate: f32,
    start: Instant,
    /// The error of a view, about.
    error: f64,
    best: Option<Best>,
}

/// What judges liked most.
struct Best {
    /// Decibels, less what its bits would have brought by finer steps.
    worth: f64,
    offsets: GaussianFrame,
    /// The first look, and the one at this.
    before: Look,
    after: Look,
    /// Looks since then.
    waited: u32,
}

/// What judges saw.
#[derive(Clone, Copy)]
struct Look {
    psnr: f64,
    bits: f64,
}

impl<'a> Descent<'a> {
    pub(super) fn new(latent: Latent<'a>, pictures: Pictures<'a>, finetune: &'a Finetune) -> Self {
        let adam = Adam::new(&latent.offsets);
        Self { latent, pictures, finetune, adam, rate: RATE, start: Instant::now(), error: 0.0, best: None }
    }

    /// Goes on as long as it may; gives the values that judges like most, and what has been done.
    pub(super) fn run(mut self) -> Result<(Latent<'a>, FinetuneReport), Error> {
        let mut rate = Rate::new(&self.latent)?;
        let mut done = 0;
        while done < self.finetune.iterations && self.share(done) < 1.0 {
            let mut decoded = self.latent.decoded()?;
            if done % EVERY == 0 {
                rate = Rate::new(&self.latent)?;
                if !self.look(&decoded, &rate) {
                    if self.best.as_ref().is_some_and(|best| best.waited >= PATIENCE) {
                        break;
                    }
                    decoded = self.back()?;
                    rate = Rate::new(&self.latent)?;
                }
            }
            self.step(&decoded, &rate, done)?;
            done += 1;
        }
        let last = self.latent.decoded()?;
        self.look(&last, &Rate::new(&self.latent)?);
        let mut report = FinetuneReport {
            iterations: done,
            seconds: self.start.elapsed().as_secs_f64(),
            ..FinetuneReport::default()
        };
        if let Some(Best { offsets, before, after, .. }) = self.best {
            self.latent.offsets = offsets;
            report.psnr = [before.psnr, after.psnr];
            report.bits = [before.bits, after.bits];
        }
        Ok((self.latent, report))
    }

    /// The share of the iterations, or of the time, that has gone.
    fn share(&self, done: u32) -> f64 {
        let of_time =
            |budget: core::time::Duration| self.start.elapsed().as_secs_f64() / budget.as_secs_f64();
        let of_time = self.finetune.time_budget.map_or(0.0, of_time);
        (f64::from(done) / f64::from(self.finetune.iterations.max(1))).max(of_time)
    }

    /// Goes back to the best values, with shorter steps from there.
    fn back(&mut self) -> Result<Decoded, Error> {
        if let Some(best) = &self.best {
            self.latent.offsets = best.offsets.clone();
        }
        self.adam = Adam::new(&self.latent.offsets);
        self.rate *= 0.5;
        self.latent.decoded()
    }

    /// Lets the judges look; whether there was nothing better before. What is worse than the start is never kept, whatever
    /// bits it saves.
    fn look(&mut self, decoded: &Decoded, rate: &Rate) -> bool {
        let now = Look { psnr: self.pictures.judge(&decoded.frame), bits: rate.bits };
        let before = self.best.as_ref().map_or(now, |best| best.before);
        let worth = now.psnr - DECIBELS_AN_OCTAVE * (now.bits - before.bits) / rate.bits_an_octave.max(1.0);
        let is_better = |best: &Best| worth > best.worth && now.psnr >= before.psnr;
        match &mut self.best {
            Some(best) if !is_better(best) => {
                best.waited += 1;
                false
            }
            best => {
                let offsets = self.latent.offsets.clone();
                *best = Some(Best { worth, offsets, before, after: now, waited: 0 });
                true
            }
        }
    }

    /// One iteration.
    fn step(&mut self, decoded: &Decoded, rate: &Rate, done: u32) -> Result<(), Error> {
        let mut gradients = Gradients::zero(&decoded.frame);
        let prepared = PreparedFrame::new(&decoded.frame);
        let mut views = 0.0;
        for View { camera, wanted } in (0..VIEWS).map_while(|_| self.pictures.next()) {
            let drawing = prepared.draw(&camera, BACKGROUND);
            let (error, slopes) = squared_error(&wanted, &drawing.rendering().colour);
            drawing.backward(&slopes, &mut gradients)?;
            let is_first = done == 0 && views == 0.0;
            self.error += (error - self.error) * if is_first { 1.0 } else { 1.0 / REMEMBERED };
            views += 1.0;
        }
        self.latent.to_steps(&decoded.frame, &mut gradients);
        // Slopes are sums over the views.
        let price = PRICE * views * 2.0 * LN_2 * self.error / rate.bits_an_octave.max(1.0);
        rate.add(&self.latent, decoded, price as f32, gradients.planes_mut());
        let slower = (0.5 + 0.5 * libm::cos(PI * self.share(done))) as f32;
        self.adam.step(&mut self.latent.offsets, &gradients, &self.finetune.rates(self.rate * slower))?;
        Ok(())
    }
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
