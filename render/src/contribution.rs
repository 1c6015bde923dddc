//! How much each Gaussian matters to a set of views.

mod small_views;

pub use small_views::SmallViews;

use crate::camera::Camera;
use crate::rasterise::{Blend, Ink, Lanes, Light, Shapes, Sight, Splat, TILE, Tile, View, blend_tile};
use pulp::{Simd, WithSimd};
use rayon::prelude::*;
use splatstream_gaussians::GaussianFrame;

/// What each Gaussian gives to the pictures: transmittance times alpha, summed over the pixels of all views.
/// At least 0, in pixels.
///
/// Equal on every machine and for any number of threads. A Gaussian that no view sees has 0.
pub fn contribution(frame: &GaussianFrame, cameras: &[Camera]) -> Vec<f64> {
    worth(frame, cameras).into_iter().map(|worth| worth.contribution).collect()
}

/// What a Gaussian is to a set of views.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Worth {
    /// What it gives: see [`contribution`].
    pub contribution: f64,
    /// What the pictures lose without it: see [`removal`].
    pub loss: f64,
    /// Its transmittance times alpha, squared and summed over the pixels of all views: what the pictures lose, in one
    /// channel, if its colour changes by 1 there.
    pub energy: f64,
}

/// What the pictures lose without each Gaussian: the squared change of colour if that one alone is taken away and
/// what lies behind it shows, summed over the pixels of all views and the three channels. At least 0.
///
/// With transmittance T in front of it, alpha a, its colour c and the light R that is composited behind it, the colour
/// of a pixel changes by T·a·c − R·a / (1 − a). Equal on every machine and for any number of threads.
pub fn removal(frame: &GaussianFrame, cameras: &[Camera]) -> Vec<f64> {
    worth(frame, cameras).into_iter().map(|worth| worth.loss).collect()
}

/// All measures of each Gaussian.
pub fn worth(frame: &GaussianFrame, cameras: &[Camera]) -> Vec<Worth> {
    let mut sums = vec![Worth::default(); frame.len()];
    let shapes = Shapes::of(frame);
    for camera in cameras {
        add(&View::new(frame, &shapes, &Sight::of(camera)), &mut sums);
    }
    sums
}

/// Adds what each Gaussian is to a view.
#[expect(clippy::arithmetic_side_effects, reason = "counts of Gaussians in memory")]
fn add(view: &View, sums: &mut [Worth]) {
    let rows = (0..view.rows.len()).into_par_iter().with_max_len(1);
    let shares: Vec<Vec<OfTile>> =
        rows.map(|row| pulp::Arch::new().dispatch(RowShares { view, row })).collect();
    // Each thread adds what belongs to its part of the Gaussians, in the order of the rows.
    let part = sums.len().div_ceil(rayon::current_num_threads()).max(1);
    sums.par_chunks_mut(part).enumerate().for_each(|(number, sums)| {
        let first = (number * part) as u32;
        for (gaussian, share) in shares.iter().flatten() {
            if let Some(sum) = sums.get_mut(gaussian.wrapping_sub(first) as usize) {
                share.add_to(sum);
            }
        }
    });
}

/// What an ellipse is to a tile or to a small picture: sums over its pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Share {
    contribution: f32,
    loss: f32,
    energy: f32,
}

impl Share {
    fn add_to(&self, sum: &mut Worth) {
        sum.contribution += f64::from(self.contribution);
        sum.loss += f64::from(self.loss);
        sum.energy += f64::from(self.energy);
    }
}

/// A Gaussian of the frame, and what it is to a tile.
type OfTile = (u32, Share);

/// What each ellipse is to the tiles of a row.
struct RowShares<'a> {
    view: &'a View,
    row: usize,
}

impl WithSimd for RowShares<'_> {
    type Output = Vec<OfTile>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
        let View { splats, rows } = self.view;
        let entries = rows.entries(self.row, splats);
        let mut shares = Vec::new();
        let mut trace = Trace::default();
        for column in 0..entries.tiles() {
            let places = entries.of_tile(column);
            if places.is_empty() {
                continue;
            }
            trace.clear();
            let tile = || Tile::new(self.row, column, rows.size());
            blend_tile(splats, places, &mut tile(), &mut trace);
            if trace.is_whole() {
                trace.shares(&mut shares);
                continue;
            }
            let (light, lines) = (trace.ink.light, Vec::new());
            let mut again = Again { light, lines, shares: &mut shares };
            blend_tile(splats, places, &mut tile(), &mut again);
        }
        shares
    }
}

/// Lines of a tile that are kept at most. A tile that has more, for it can have millions of Gaussians, is blended twice.
const LINES: usize = 1 << 14;

/// What a tile was blended from, to be gone through again when all of its light is known.
#[derive(Default)]
struct Trace {
    ink: Ink,
    lines: Vec<Line>,
    /// Gaussians that have lines: which they are, their colours, and where their lines end.
    ellipses: Vec<(u32, [f32; 3], usize)>,
}

/// What a Gaussian adds to a line.
struct Line {
    line: u32,
    visible: Lanes,
    passing: Lanes,
}

impl Blend for Trace {
    #[inline(always)]
    fn line(&mut self, colour: [f32; 3], line: usize, visible: &Lanes, passing: &Lanes) {
        self.ink.line(colour, line, visible, passing);
        if self.lines.len() < LINES {
            self.lines.push(Line { line: line as u32, visible: *visible, passing: *passing });
        }
    }

    #[inline(always)]
    fn done(&mut self, splat: &Splat, _entry: usize) {
        let before = self.ellipses.last().map_or(0, |&(_, _, end)| end);
        if self.lines.len() > before {
            self.ellipses.push((splat.gaussian, splat.colour, self.lines.len()));
        }
    }
}

impl Trace {
    #[inline(always)]
    fn clear(&mut self) {
        self.ink = Ink::default();
        self.lines.clear();
        self.ellipses.clear();
    }

    /// Whether all lines are kept.
    fn is_whole(&self) -> bool {
        self.lines.len() < LINES
    }

    /// Sums what each Gaussian is to the tile: the light behind it is what is left of all of it.
    #[inline(always)]
    #[expect(clippy::indexing_slicing, reason = "lines are counted by the ellipses that have them")]
    fn shares(&mut self, shares: &mut Vec<OfTile>) {
        let mut start = 0;
        for &(gaussian, colour, end) in &self.ellipses {
            shares.extend(share(gaussian, colour, &self.lines[start..end], &mut self.ink.light));
            start = end;
        }
    }
}

/// A tile that is blended again, when all of its light is known.
struct Again<'a> {
    /// What is left of the light.
    light: Light,
    /// Lines of the Gaussian that is blended.
    lines: Vec<Line>,
    shares: &'a mut Vec<OfTile>,
}

impl Blend for Again<'_> {
    #[inline(always)]
    fn line(&mut self, _: [f32; 3], line: usize, visible: &Lanes, passing: &Lanes) {
        self.lines.push(Line { line: line as u32, visible: *visible, passing: *passing });
    }

    #[inline(always)]
    fn done(&mut self, splat: &Splat, _entry: usize) {
        self.shares.extend(share(splat.gaussian, splat.colour, &self.lines, &mut self.light));
        self.lines.clear();
    }
}

/// What a Gaussian is to a tile, if that shows it: from its lines, and from the light of it and of what lies behind it, which
/// it is taken from.
#[inline(always)]
#[expect(clippy::indexing_slicing, reason = "lines and lanes are those of a tile")]
fn share(gaussian: u32, colour: [f32; 3], lines: &[Line], light: &mut Light) -> Option<OfTile> {
    let [mut given, mut lost, mut squared] = [[0.0; TILE]; 3];
    for Line { line, visible, passing } in lines {
        for lane in 0..TILE {
            given[lane] += visible[lane];
            squared[lane] += visible[lane] * visible[lane];
        }
        let mut ratio = [0.0; TILE];
        for lane in 0..TILE {
            // What passes is T (1 - a): a pixel that is done has a negative sign there, and nothing visible.
            ratio[lane] = visible[lane] / passing[lane].abs().max(f32::MIN_POSITIVE);
        }
        for (behind, colour) in light[*line as usize].iter_mut().zip(colour) {
            for lane in 0..TILE {
                let own = visible[lane] * colour;
                behind[lane] -= own;
                let change = own - behind[lane] * ratio[lane];
                lost[lane] += change * change;
            }
        }
    }
    let contribution: f32 = given.iter().sum();
    let (loss, energy) = (lost.iter().sum(), squared.iter().sum());
    (contribution > 0.0).then_some((gaussian, Share { contribution, loss, energy }))
}
