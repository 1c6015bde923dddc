//! How much each Gaussian matters to a set of views.

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

/// A frame as cameras see it in pictures smaller than theirs, which cost less and show nearly the same of each Gaussian.
///
/// A Gaussian smaller than a pixel covers as much of it as it would cover in the large picture, whatever the filter of
/// the renderer makes of it.
pub struct SmallViews<'a> {
    frame: &'a GaussianFrame,
    shapes: Shapes,
    views: Vec<SmallView>,
    /// The Gaussians that are left, by rising row; none if all are.
    left: Option<Vec<u32>>,
}

/// One of the small pictures.
struct SmallView {
    camera: Camera,
    /// The side of a pixel of the large picture in pixels of this one.
    fine: f32,
    /// The ellipses of the Gaussians that were left when it was looked at last, nearest first, if they are kept.
    ellipses: Option<Vec<Splat>>,
}

/// Bytes of ellipses that are kept from one look to the next, at most, where all Gaussians are left: they take half the
/// time, but ten views of a large scene would take more than the scene.
const KEPT: usize = 1 << 24;

impl<'a> SmallViews<'a> {
    /// Pictures of at most so many lines.
    #[must_use]
    pub fn new(frame: &'a GaussianFrame, cameras: &[Camera], lines: u32) -> Self {
        let small = |camera: &Camera| {
            let (camera, fine) = match camera.height > lines {
                true => (camera.scaled_to_height(lines), lines as f32 / camera.height as f32),
                false => (camera.clone(), 1.0),
            };
            SmallView { camera, fine, ellipses: None }
        };
        let views = cameras.iter().map(small).collect();
        Self { frame, shapes: Shapes::of(frame), views, left: None }
    }

    /// Takes all Gaussians away but those of some rows, which rise and were left so far.
    #[expect(clippy::indexing_slicing, reason = "rows are those of the frame")]
    pub fn leave(&mut self, rows: &[u32]) {
        let mut is_left = vec![false; self.frame.len()];
        rows.iter().for_each(|&row| is_left[row as usize] = true);
        let kept = self.views.par_iter_mut().filter_map(|view| view.ellipses.as_mut());
        kept.for_each(|ellipses| {
            ellipses.retain(|ellipse| is_left[ellipse.gaussian as usize]);
            ellipses.shrink_to_fit();
        });
        self.left = Some(rows.to_vec());
    }

    /// What each of the Gaussians that are left is to the pictures if there are no others, by rising row.
    #[must_use]
    #[expect(clippy::indexing_slicing, reason = "rows are those of the frame")]
    pub fn worth(&mut self) -> Vec<Worth> {
        let mut sums = vec![Worth::default(); self.frame.len()];
        let bytes = |view: &SmallView| view.ellipses.as_deref().map_or(0, size_of_val);
        let mut kept: usize = self.views.iter().map(bytes).sum();
        // Of each Gaussian that is gone there would be another ellipse while those of a view are sorted.
        let gone = self.left.as_ref().map_or(0, |left| self.frame.len().saturating_sub(left.len()));
        let room = KEPT.max(gone.saturating_mul(size_of::<Splat>()));
        for view in &mut self.views {
            let SmallView { camera, fine, ellipses } = view;
            let sight = Sight { rows: self.left.as_deref(), fine: *fine, ..Sight::of(camera) };
            let view = match ellipses.take() {
                Some(splats) => {
                    kept = kept.saturating_sub(size_of_val(splats.as_slice()));
                    View::of(splats, &sight)
                }
                None => View::new(self.frame, &self.shapes, &sight),
            };
            add(&view, &mut sums);
            kept = kept.saturating_add(size_of_val(view.splats.as_slice()));
            match kept <= room {
                true => *ellipses = Some(view.splats),
                false => kept = kept.saturating_sub(size_of_val(view.splats.as_slice())),
            }
        }
        match &self.left {
            Some(rows) => rows.iter().map(|&row| sums[row as usize]).collect(),
            None => sums,
        }
    }
}

/// Adds what each Gaussian is to a view.
#[expect(clippy::arithmetic_side_effects, reason = "counts of Gaussians in memory")]
fn add(view: &View, sums: &mut [Worth]) {
    let rows = (0..view.rows.len()).into_par_iter().with_max_len(1);
    let shares: Vec<Vec<Share>> =
        rows.map(|row| pulp::Arch::new().dispatch(RowShares { view, row })).collect();
    // Each thread adds what belongs to its part of the Gaussians, in the order of the rows.
    let part = sums.len().div_ceil(rayon::current_num_threads()).max(1);
    sums.par_chunks_mut(part).enumerate().for_each(|(number, sums)| {
        let first = (number * part) as u32;
        for share in shares.iter().flatten() {
            if let Some(sum) = sums.get_mut(share.gaussian.wrapping_sub(first) as usize) {
                sum.contribution += f64::from(share.contribution);
                sum.loss += f64::from(share.loss);
                sum.energy += f64::from(share.energy);
            }
        }
    });
}

/// What an ellipse is to a tile: sums over its pixels.
struct Share {
    /// Which Gaussian of the frame.
    gaussian: u32,
    contribution: f32,
    loss: f32,
    energy: f32,
}

/// What each ellipse is to the tiles of a row.
struct RowShares<'a> {
    view: &'a View,
    row: usize,
}

impl WithSimd for RowShares<'_> {
    type Output = Vec<Share>;

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
    fn shares(&mut self, shares: &mut Vec<Share>) {
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
    shares: &'a mut Vec<Share>,
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
fn share(gaussian: u32, colour: [f32; 3], lines: &[Line], light: &mut Light) -> Option<Share> {
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
    (contribution > 0.0).then_some(Share { gaussian, contribution, loss, energy })
}
