//! Gaussians that pictures hardly miss are left out, where that is asked for.
//!
//! What each Gaussian is to pictures is weighed in views from near and far that look past the middle of the scene as well. Those
//! that are missed least go first, as many as other views of that kind allow: in none of them pictures without these
//! Gaussians have a lower PSNR against pictures with them than the settings say.
#![expect(
    clippy::arithmetic_side_effects,
    reason = "counts of Gaussians in memory, of which a part is taken"
)]
#![expect(clippy::indexing_slicing, reason = "orders are those of the frame, and parts are cut from them")]

use crate::canonical::visible;
use crate::checked::without;
use crate::error::Error;
use crate::importance::unhidden;
use crate::report::Pruned;
use crate::settings::Settings;
use crate::source::FrameSource;
use crate::strips::StripViews;
use crate::verification::HEIGHT;
use rayon::prelude::*;
use splatstream_gaussians::GaussianFrame;
use splatstream_render::Camera;
use splatstream_render::camera::Scattered;
use splatstream_render::contribution::{SmallViews, Worth};
use std::collections::BTreeMap;

/// Views in which Gaussians are weighed, and their lines.
const VIEWS: usize = 16;
const LINES: u32 = 144;
/// Views that say how many may go, and of how many strips one is drawn.
const JUDGES: usize = 8;
const EVERY: u32 = 6;
/// Seeds of both. Others fit values to pictures.
const SEEDS: [u64; 2] = [3, 4];
/// What a Gaussian is worth at least, of what it would be if nothing hid it: other views may show it.
const HIDDEN: f64 = 0.02;
/// The number that may go is found to this part of all Gaussians.
const PRECISION: usize = 256;

/// Refuses settings that leave Gaussians out where frames are not all there when that is decided.
///
/// # Errors
/// The setting.
pub(crate) fn refuse_pruning(settings: &Settings) -> Result<(), Error> {
    match settings.prune {
        None => Ok(()),
        Some(decibels) => Err(Error::Setting {
            name: "prune",
            value: decibels.to_string(),
            allowed: "nothing for shards and for frames that are pushed GOP by GOP: encode them at once",
        }),
    }
}

/// Leaves Gaussians out of frames that each stand for themselves.
pub(crate) struct PrunedSource<'a> {
    source: &'a mut dyn FrameSource,
    settings: &'a Settings,
    /// The least PSNR, dB.
    least: f64,
    /// What has been left out of the frames that were read: rows, and what that does.
    known: BTreeMap<u32, (Vec<u32>, Pruned)>,
}

impl<'a> PrunedSource<'a> {
    pub(crate) fn new(source: &'a mut dyn FrameSource, settings: &'a Settings, least: f32) -> Self {
        Self { source, settings, least: least.into(), known: BTreeMap::new() }
    }

    /// What was left out of each frame.
    pub(crate) fn into_pruned(self) -> Vec<Pruned> {
        self.known.into_values().map(|(_, pruned)| pruned).collect()
    }
}

impl FrameSource for PrunedSource<'_> {
    fn len(&self) -> u32 {
        self.source.len()
    }

    fn frame(&mut self, number: u32) -> Result<GaussianFrame, Box<dyn std::error::Error + Send + Sync>> {
        let frame = self.source.frame(number)?;
        let (rows, _) = self.known.entry(number).or_insert_with(|| {
            let (rows, psnr) = least_missed(&frame, self.settings, self.least);
            let gaussians = rows.len() as u32;
            (rows, Pruned { frame: number, gaussians, bytes: 0, psnr })
        });
        Ok(if rows.is_empty() { frame } else { without(frame, rows) })
    }

    fn original(&mut self, number: u32) -> Result<GaussianFrame, Box<dyn std::error::Error + Send + Sync>> {
        self.source.original(number)
    }
}

/// The rows of the Gaussians that may go, rising, and the PSNR without them in the view that misses them most; none if nothing
/// can be seen.
fn least_missed(frame: &GaussianFrame, settings: &Settings, least: f64) -> (Vec<u32>, Option<f64>) {
    let rows = visible(frame, settings.keep_invisible);
    let frame = frame.select(&rows);
    let cameras = |seed: u64, count: usize, height: u32| -> Vec<Camera> {
        Scattered::new(&frame, settings.up(), &settings.cameras, seed, height).take(count).collect()
    };
    let [weighing, judging] = SEEDS;
    let order = order(&frame, &cameras(weighing, VIEWS, HEIGHT));
    let views = StripViews::new(cameras(judging, JUDGES, HEIGHT), EVERY, &frame);
    let whole: Vec<_> = views.draw(&frame).collect();
    let psnr = |gone: usize| {
        let mut kept = order[gone..].to_vec();
        kept.sort_unstable();
        views.least_psnr(&frame.select(&kept), &whole)
    };
    // Of those counts that were tried the largest that is allowed.
    let (mut allowed, mut refused, mut found) = (0, order.len(), None);
    while refused - allowed > (order.len() / PRECISION).max(1) {
        let tried = allowed + (refused - allowed) / 2;
        match psnr(tried) {
            Some(decibels) if decibels >= least => (allowed, found) = (tried, Some(decibels)),
            _ => refused = tried,
        }
    }
    let mut gone: Vec<u32> = order[..allowed].iter().map(|&row| rows[row as usize]).collect();
    gone.sort_unstable();
    (gone, found)
}

/// The Gaussians of a frame, least missed first.
///
/// The score is that of the [order](crate::importance) of refinements, the geometric mean of what a Gaussian gives and of what
/// is lost without it, and a part of what it would give if nothing hid it.
fn order(frame: &GaussianFrame, cameras: &[Camera]) -> Vec<u32> {
    let small: Vec<Camera> = cameras.iter().map(|camera| camera.scaled_to_height(LINES)).collect();
    let shown = SmallViews::new(frame, cameras, LINES).worth();
    let bare = unhidden(frame, &small);
    let views = cameras.len() as f64;
    let score = |(worth, bare): (&Worth, &Worth)| {
        (worth.contribution * worth.loss).sqrt() + HIDDEN * views * bare.energy
    };
    let mut scored: Vec<(f64, u32)> = shown.iter().zip(&bare).map(score).zip(0..).collect();
    scored.par_sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    scored.into_iter().map(|(_, row)| row).collect()
}
