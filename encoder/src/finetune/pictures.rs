//! The pictures that values are fitted to, and how far those of the decoded frame are from them.
#![expect(clippy::arithmetic_side_effects, reason = "sums and products of floats; counts of pictures")]

use super::loss::FinetuneLoss;
use super::receivers::{LINES, Receiver};
use super::request::{Finetune, Photograph};
use crate::error::Error;
use crate::settings::Settings;
use splatstream_gaussians::GaussianFrame;
use splatstream_render::camera::{Scattered, held_out};
use splatstream_render::metrics::{LOSSLESS_DB, psnr};
use splatstream_render::{Camera, Image, PreparedFrame, render};

/// Views by which it is judged what is kept, of none of which a slope is taken.
const JUDGES: usize = 6;

/// Views by which nothing is chosen, to report by.
const WITNESSES: u32 = 5;

/// Of so many photographs one is for judges, and one to report by.
const OF_PHOTOGRAPHS: usize = 8;

/// Bytes of a pixel of what views should show, and of those of an iteration, which are drawn and whose slopes are taken.
const OF_WANTED: u64 = 12;
const OF_DRAWN: u64 = 160;

/// Width of the views that are made, heights.
const USUAL_WIDTH: f64 = 16.0 / 9.0;

/// Seeds of the views that slopes are taken of, and of those of judges.
const SEEDS: [u64; 2] = [1, 2];

/// A view, and what it should show.
pub(super) struct View {
    pub(super) camera: Camera,
    pub(super) wanted: Image,
}

/// Where views come from.
enum Supply<'a> {
    /// From anywhere: no view comes twice.
    Scattered(&'a GaussianFrame, Scattered),
    /// In turn.
    Photographs(Vec<&'a Photograph>),
}

/// Views without end for receivers of operating points, and some to judge and to report by.
pub(super) struct Pictures<'a> {
    supply: Supply<'a>,
    /// Around the scene.
    pub(super) background: [f32; 3],
    taken: usize,
    turns: Vec<Turn>,
    loss: FinetuneLoss,
    judges: Vec<Judges>,
    witnesses: Vec<Judges>,
}

/// What judges say of what a receiver has: means over their views.
#[derive(Default)]
pub(super) struct Verdict {
    /// dB.
    pub(super) psnr: f64,
    /// What is made small, as decibels below 1: the PSNR where that is the squared error.
    pub(super) quality: f64,
}

/// A loss of a picture, a mean over its pixels, below which it shows what it should.
const LEAST: f64 = 1e-9;

/// A look of a receiver.
struct Sight {
    /// Which receiver.
    place: usize,
    /// Lines of its picture.
    lines: u32,
    /// Looks of all receivers before it.
    number: usize,
}

/// When a receiver is the next to look.
struct Turn {
    weight: f64,
    /// How much it has waited for.
    due: f64,
    /// Lines of its pictures in turn, and how many it has had.
    lines: Vec<u32>,
    taken: usize,
}

/// Views of some lines, each the next of them in turn; receivers whose pictures have the same lines share them.
struct Judges {
    lines: Vec<u32>,
    views: Vec<View>,
}

/// What photographs are used for.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Role {
    Fit,
    Judge,
    Witness,
}

impl<'a> Pictures<'a> {
    /// Of a source, or the photographs that were given.
    pub(super) fn new(
        source: &'a GaussianFrame,
        finetune: &'a Finetune,
        settings: &'a Settings,
        receivers: &[Receiver],
    ) -> Self {
        let turn = |receiver: &Receiver| Turn {
            weight: receiver.weight,
            due: 0.0,
            lines: receiver.lines.clone(),
            taken: 0,
        };
        let turns = receivers.iter().map(turn).collect();
        let background = settings.description.background.unwrap_or_default();
        let views = |role: Role, lines: &[u32]| match finetune.photographs.is_empty() {
            true => drawn_for(role, lines, source, (settings, background)),
            false => finetune
                .of_role(role)
                .zip(lines.iter().cycle())
                .map(|(one, &lines)| one.view(lines))
                .collect(),
        };
        let all = |role: Role, lines: &dyn Fn(&Receiver) -> Vec<u32>| {
            let mut all: Vec<Judges> = Vec::new();
            for lines in receivers.iter().map(lines) {
                if all.iter().all(|judges| judges.lines != lines) {
                    all.push(Judges { views: views(role, &lines), lines });
                }
            }
            all
        };
        let judges = all(Role::Judge, &|receiver| receiver.lines.clone());
        let witnesses = all(Role::Witness, &|receiver| vec![receiver.own_lines]);
        let supply = match finetune.photographs.is_empty() {
            true => {
                let [own, _] = SEEDS;
                Supply::Scattered(
                    source,
                    Scattered::new(source, settings.up(), &settings.cameras, own, LINES),
                )
            }
            false => Supply::Photographs(finetune.of_role(Role::Fit).collect()),
        };
        Self { supply, background, taken: 0, turns, loss: finetune.loss, judges, witnesses }
    }

    /// What judges say of what a receiver has.
    ///
    /// # Errors
    /// None: their pictures are of the sizes that they should have.
    pub(super) fn judge(&self, receiver: &Receiver, frame: &GaussianFrame) -> Result<Verdict, Error> {
        let FinetuneLoss::L1Ssim { .. } = self.loss else {
            let psnr = mean_psnr(&self.judges, &receiver.lines, frame, self.background);
            return Ok(Verdict { psnr, quality: psnr });
        };
        let views = views_of(&self.judges, &receiver.lines);
        let prepared = PreparedFrame::new(frame);
        let mut verdict = Verdict::default();
        for View { camera, wanted } in views {
            let drawing = prepared.draw(camera, self.background);
            let picture = &drawing.rendering().colour;
            let (loss, _) = self.loss.of(wanted, picture)?;
            verdict.psnr += psnr(wanted, picture).min(LOSSLESS_DB);
            verdict.quality -= 10.0 * libm::log10(loss.max(LEAST));
        }
        let count = views.len().max(1) as f64;
        let Verdict { psnr, quality } = verdict;
        Ok(Verdict { psnr: psnr / count, quality: quality / count })
    }

    /// The same in views of the lines of its layer by which nothing is chosen.
    pub(super) fn witness(&self, receiver: &Receiver, frame: &GaussianFrame) -> f64 {
        mean_psnr(&self.witnesses, &[receiver.own_lines], frame, self.background)
    }

    /// The next view, and which receiver looks: each as often as its weight says.
    pub(super) fn next(&mut self) -> Option<(usize, View)> {
        let Sight { place, lines, number } = self.turn()?;
        let view = match &mut self.supply {
            Supply::Scattered(source, cameras) => {
                cameras.next().map(|camera| drawn(source, camera.scaled_to_height(lines), self.background))
            }
            Supply::Photographs(photographs) => {
                Some(photographs.get(number % photographs.len().max(1))?.view(lines))
            }
        };
        view.map(|view| (place, view))
    }

    /// Passes over views that an earlier run has looked at, and draws none of them.
    pub(super) fn skip(&mut self, views: usize) {
        for _ in 0..views {
            self.turn();
            if let Supply::Scattered(_, cameras) = &mut self.supply {
                cameras.next();
            }
        }
    }

    /// Who looks next, and at what.
    fn turn(&mut self) -> Option<Sight> {
        self.turns.iter_mut().for_each(|turn| turn.due += turn.weight);
        let longest = |best: (usize, f64), (place, turn): (usize, &Turn)| {
            if turn.due > best.1 { (place, turn.due) } else { best }
        };
        let (place, _) = self.turns.iter().enumerate().fold((0, f64::NEG_INFINITY), longest);
        let turn = self.turns.get_mut(place)?;
        turn.due -= 1.0;
        let lines = turn.lines.get(turn.taken % turn.lines.len().max(1)).copied().unwrap_or(LINES);
        turn.taken = turn.taken.wrapping_add(1);
        let number = self.taken;
        self.taken = number.wrapping_add(1);
        Some(Sight { place, lines, number })
    }
}

/// The views of some lines.
fn views_of<'a>(judges: &'a [Judges], lines: &[u32]) -> &'a [View] {
    judges.iter().find(|judges| judges.lines == lines).map_or(&[], |judges| &judges.views)
}

/// Mean PSNR of a frame in the views of some lines, dB.
fn mean_psnr(judges: &[Judges], lines: &[u32], frame: &GaussianFrame, background: [f32; 3]) -> f64 {
    let views = views_of(judges, lines);
    let prepared = PreparedFrame::new(frame);
    let of_view = |View { camera, wanted }: &View| {
        psnr(wanted, &prepared.draw(camera, background).rendering().colour).min(LOSSLESS_DB)
    };
    views.iter().map(of_view).sum::<f64>() / views.len().max(1) as f64
}

/// Views of a source from elsewhere than slopes are taken.
fn drawn_for(
    role: Role,
    lines: &[u32],
    source: &GaussianFrame,
    (settings, background): (&Settings, [f32; 3]),
) -> Vec<View> {
    let [_, others] = SEEDS;
    let cameras = match role {
        Role::Witness => held_out(source, settings.up(), &settings.cameras, WITNESSES, LINES),
        Role::Fit | Role::Judge => {
            Scattered::new(source, settings.up(), &settings.cameras, others, LINES).take(JUDGES).collect()
        }
    };
    let of_lines = cameras.into_iter().zip(lines.iter().cycle());
    of_lines.map(|(camera, &lines)| drawn(source, camera.scaled_to_height(lines), background)).collect()
}

impl Finetune {
    /// What pictures take that are there at the same time, bytes.
    pub(crate) fn bytes_of_pictures(&self, settings: &Settings) -> u64 {
        let width = |camera: &Camera| f64::from(camera.width) / f64::from(camera.height.max(1));
        let cameras = settings.cameras.iter().chain(self.photographs.iter().map(|one| &one.camera));
        let widest = cameras.map(width).fold(USUAL_WIDTH, f64::max);
        let pixels = |lines: u32| (widest * f64::from(lines) * f64::from(lines)) as u64;
        let kept = match self.photographs.len() {
            0 => JUDGES + WITNESSES as usize,
            photographs => 2 * photographs.div_ceil(OF_PHOTOGRAPHS),
        };
        let of_pixel = (kept as u64).saturating_mul(OF_WANTED).saturating_add(OF_DRAWN);
        let all = self.lines_of_pictures(settings).into_iter().map(pixels).fold(0, u64::saturating_add);
        all.saturating_mul(of_pixel)
    }

    /// The photographs that are used for something.
    fn of_role(&self, role: Role) -> impl Iterator<Item = &Photograph> {
        let role_of = |number: usize| match number % OF_PHOTOGRAPHS {
            0 => Role::Judge,
            // The one that training holds out as a rule.
            place if place == OF_PHOTOGRAPHS / 2 => Role::Witness,
            _ => Role::Fit,
        };
        let numbered = self.photographs.iter().enumerate();
        numbered.filter(move |(number, _)| role_of(*number) == role).map(|(_, photograph)| photograph)
    }
}

fn drawn(source: &GaussianFrame, camera: Camera, background: [f32; 3]) -> View {
    let wanted = render(source, &camera, background).colour;
    View { camera, wanted }
}

impl Photograph {
    /// In the lines of other pictures, if it has more.
    fn view(&self, lines: u32) -> View {
        let lines = self.camera.height.min(lines);
        let camera = self.camera.scaled_to_height(lines);
        let wanted = self.picture.averaged(camera.width as usize, camera.height as usize);
        View { camera, wanted }
    }
}
