//! Goes down the slope of what pictures miss and what bits cost.
#![expect(clippy::arithmetic_side_effects, reason = "sums and products of floats; counts of views")]
#![expect(clippy::indexing_slicing, reason = "planes are those of the latent values")]
#![allow(clippy::print_stderr, reason = "experiment")]

use super::Finetune;
use super::latent::{Decoded, Latent, POSITION, LOG_SCALE, OPACITY, ROTATION, DC, ranks};
use super::pictures::{signs, squared_error};
use super::rate::Rate;
use crate::error::Error;
use rayon::prelude::*;
use splatstream_render::camera::{Scattered, Up};
use splatstream_render::gradient::Gradients;
use splatstream_render::{Camera, PreparedFrame, ReferencePictures, render};

fn parameter(name: &str, default: f64) -> f64 {
    std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(default)
}

/// Lines of pictures.
const LINES: u32 = 540;

pub(super) struct Descent<'a> {
    pub(super) latent: Latent<'a>,
    iterations: u32,
    views: Scattered,
    validation: ReferencePictures,
    curvature: Vec<Vec<f32>>,
    momentum: Vec<Vec<f32>>,
    share: Vec<f32>,
    error: f64,
}

impl<'a> Descent<'a> {
    pub(super) fn new(latent: Latent<'a>, finetune: &Finetune, cameras: &[Camera]) -> Result<Self, Error> {
        let source = latent.source;
        let views = Scattered::new(source, Up::default(), cameras, 1, LINES);
        let of_validation = Scattered::new(source, Up::default(), cameras, 2, LINES).take(6).collect();
        let zeros = || vec![vec![0.0; source.len()]; latent.offsets.len()];
        Ok(Self {
            iterations: finetune.iterations,
            views,
            validation: ReferencePictures::new(source, of_validation),
            curvature: zeros(),
            momentum: zeros(),
            error: 0.0,
            share: vec![1.0; source.len()],
            latent,
        })
    }

    fn measure_curvature(&mut self, count: usize) -> Result<(), Error> {
        let decoded = self.latent.decoded()?;
        let prepared = PreparedFrame::new(&decoded.frame);
        let mut sums = vec![[0.0_f32; 2]; self.latent.source.len()];
        for number in 0..count {
            let Some(camera) = self.views.next() else { break };
            let target = render(self.latent.source, &camera, [0.0; 3]).colour;
            let drawing = prepared.draw(&camera, [0.0; 3]);
            let (error, _) = squared_error(&target, &drawing.rendering().colour);
            self.error += error / count as f64;
            let mut gradients = Gradients::zero(&decoded.frame);
            drawing.backward(&signs(target.width(), target.pixels().len(), number as u64), &mut gradients).map_err(|_| Error::NoFrames)?;
            let unit = splatstream_gaussians::SH_C0 as f32;
            let mut ones = Gradients::zero(&decoded.frame);
            let all = splatstream_render::Image::new(target.width(), vec![[1.0; 3]; target.pixels().len()]);
            drawing.backward(&all, &mut ones).map_err(|_| Error::NoFrames)?;
            for channel in 0..3 {
                for ((sum, one), sign) in sums.iter_mut().zip(&ones.planes().dc[channel]).zip(&gradients.planes().dc[channel]) {
                    sum[0] += one / unit;
                    sum[1] += sign * sign / unit / unit;
                }
            }
            let slopes = self.latent.slopes(&decoded.frame, gradients.planes());
            self.curvature.par_iter_mut().zip(&slopes).for_each(|(sum, slopes)| {
                sum.iter_mut().zip(slopes).for_each(|(sum, slope)| *sum += 2.0 * slope * slope / count as f32);
            });
        }
        self.share = sums.iter().map(|[one, square]| if *one > 0.0 { (square / one).clamp(1e-3, 1.0) } else { 1.0 }).collect();
        let mut sorted = self.share.clone();
        sorted.sort_by(f32::total_cmp);
        let at = |p: usize| sorted[(sorted.len() - 1) * p / 100];
        eprintln!("share 1% {} 10% {} 50% {} 90% {}", at(1), at(10), at(50), at(90));
        Ok(())
    }

    fn validate(&self, decoded: &Decoded) -> f64 {
        self.validation.psnr(&decoded.frame).sum::<f64>() / self.validation.len() as f64
    }

    pub(super) fn run(&mut self) -> Result<(), Error> {
        let start = std::time::Instant::now();
        self.measure_curvature(parameter("CURV", 12.0) as usize)?;
        let per_iteration = parameter("VIEWS", 2.0) as usize;
        let lambda = parameter("LAMBDA", 1.0);
        let eta = parameter("ETA", 0.05) as f32;
        let beta = parameter("BETA", 0.8) as f32;
        let floor = parameter("FLOOR", 0.05) as f32;
        let most = parameter("MOST", 0.2) as f32;
        let every = parameter("EVERY", 25.0) as u32;
        let power = parameter("POWER", 1.0) as f32;
        self.share.iter_mut().for_each(|share| *share = libm::powf(*share, power));
        let share = &self.share;
        let adam = parameter("ADAM", 0.0) > 0.0;
        let mask = parameter("MASK", 63.0) as u32;
        let [dc_rank, _] = ranks(self.latent.coder);
        let class = |plane: usize| match plane {
            p if p < LOG_SCALE => { let _ = POSITION; 0 }
            p if p < OPACITY => 1,
            p if p < ROTATION => 2,
            p if p < DC => 3,
            p if p < DC + dc_rank => 4,
            _ => 5,
        };
        let floors: Vec<f32> = self.curvature.iter().map(|plane| {
            let mean = plane.iter().map(|&c| f64::from(c)).sum::<f64>() / plane.len().max(1) as f64;
            floor * mean as f32
        }).collect();
        let mut second: Vec<Vec<f32>> = if adam { self.momentum.clone() } else { Vec::new() };
        let mut rate = Rate::new(&self.latent)?;
        let bits0 = rate.bits;
        for iteration in 0..self.iterations {
            if iteration > 0 && iteration % every == 0 {
                rate = Rate::new(&self.latent)?;
            }
            let decoded = self.latent.decoded()?;
            if iteration % every == 0 {
                let n = self.latent.source.len() as f64;
                eprintln!("{iteration:4} {:6.1}s validation {:.3} dB bits {:.3} ({:+.3}) per octave {:.2} error {:.1}", start.elapsed().as_secs_f64(),
                    self.validate(&decoded), rate.bits / n, (rate.bits - bits0) / n, rate.bits_an_octave / n, self.error);
            }
            let prepared = PreparedFrame::new(&decoded.frame);
            let mut gradients = Gradients::zero(&decoded.frame);
            let mut total = 0.0;
            for _ in 0..per_iteration {
                let Some(camera) = self.views.next() else { break };
                let target = render(self.latent.source, &camera, [0.0; 3]).colour;
                let drawing = prepared.draw(&camera, [0.0; 3]);
                let (error, slopes) = squared_error(&target, &drawing.rendering().colour);
                total += error;
                drawing.backward(&slopes, &mut gradients).map_err(|_| Error::NoFrames)?;
            }
            self.error += 0.1 * (total / per_iteration as f64 - self.error);
            let mut slopes = self.latent.slopes(&decoded.frame, gradients.planes());
            slopes.par_iter_mut().flatten().for_each(|slope| *slope /= per_iteration as f32);
            let weight = lambda * self.error * 2.0 * core::f64::consts::LN_2 / rate.bits_an_octave;
            rate.add(&self.latent, &decoded, weight as f32, &mut slopes);
            let progress = f64::from(iteration) / f64::from(self.iterations);
            let eta = eta * (0.5 + 0.5 * libm::cos(core::f64::consts::PI * progress)) as f32;
            if adam {
                for ((plane, offsets), (momentum, second)) in (0..).zip(&mut self.latent.offsets).zip(self.momentum.iter_mut().zip(&mut second)) {
                    if mask >> class(plane) & 1 == 0 { continue; }
                    let t = (iteration + 1) as i32;
                    for (((o, m), v), g) in offsets.iter_mut().zip(momentum).zip(second).zip(&slopes[plane]) {
                        *m += 0.1 * (g - *m);
                        *v += 0.01 * (g * g - *v);
                        let (m, v) = (*m / (1.0 - 0.9_f32.powi(t)), *v / (1.0 - 0.99_f32.powi(t)));
                        *o -= eta * m / (v.sqrt() + 1e-12);
                    }
                }
                continue;
            }
            let planes = self.latent.offsets.par_iter_mut().zip(&mut self.momentum).zip(&self.curvature).zip(&slopes).zip(&floors);
            planes.enumerate().for_each(|(plane, ((((offsets, momentum), curvature), slopes), floor))| {
                if mask >> class(plane) & 1 == 0 { return; }
                for ((((offset, momentum), curvature), slope), share) in offsets.iter_mut().zip(momentum).zip(curvature).zip(slopes).zip(share) {
                    *momentum = beta * *momentum + (1.0 - beta) * (share * slope / (curvature + floor));
                    *offset -= (eta * *momentum).clamp(-most, most);
                }
            });
        }
        let decoded = self.latent.decoded()?;
        let rate = Rate::new(&self.latent)?;
        let n = self.latent.source.len() as f64;
        let (db, bits) = (self.validate(&decoded), (rate.bits - bits0) / n);
        eprintln!("end {:6.1}s validation {db:.3} dB bits {:.3} ({bits:+.3})", start.elapsed().as_secs_f64(), rate.bits / n);
        Ok(())
    }
}
