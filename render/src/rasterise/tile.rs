//! Front-to-back blending of one tile, sixteen pixels at a time.

use super::lanes::{Lanes, TILE};
use super::project::{LOG2_255, Splat};
use std::f32::consts::LN_2;

/// The most that one Gaussian may cover.
pub(crate) const MAX_ALPHA: f32 = 0.99;

/// log2 of that.
pub(crate) const LOG2_MAX_ALPHA: f32 = -0.014_499_556;

/// A pixel is done where less of the light would pass than this.
const MIN_TRANSMITTANCE: f32 = 1e-4;

/// Ellipses of a tile that are brought together at once; as many as a cache holds beside the tile.
const AHEAD: usize = 4 * TILE;

/// Receives what a Gaussian adds to the picture.
pub(crate) trait Blend {
    /// The lines that follow are of this Gaussian.
    fn begin(&mut self, _splat: &Splat) {}

    /// `visible` is transmittance times alpha of each pixel of a line of the tile, of which one at least is not 0; `passing` the
    /// transmittance behind it, negative where the pixel is done.
    fn line(&mut self, colour: [f32; 3], line: usize, visible: &Lanes, passing: &Lanes);

    /// A Gaussian, at this place of the tile's entries, has added all its lines.
    fn done(&mut self, _splat: &Splat, _entry: usize) {}
}

/// The light that still passes each pixel of a tile.
pub(crate) struct Tile {
    /// Centre of the top left pixel.
    origin: [f32; 2],
    /// Negative where a pixel is done: its transmittance is the magnitude.
    passing: [Lanes; TILE],
    alive: [bool; TILE],
}

impl Tile {
    /// The tile at a row and column, with all light passing where the picture is and none outside.
    #[expect(clippy::arithmetic_side_effects, reason = "places within a picture in memory")]
    pub(crate) fn new(row: usize, column: usize, [width, height]: [usize; 2]) -> Self {
        let (left, top) = (column * TILE, row * TILE);
        let light = |inside: bool| if inside { 1.0 } else { 0.0 };
        let line = |y| std::array::from_fn(|x| light(top + y < height && left + x < width));
        Self {
            origin: [left as f32 + 0.5, top as f32 + 0.5],
            passing: std::array::from_fn(line),
            alive: [true; TILE],
        }
    }

    /// Transmittance of each pixel, line by line.
    pub(crate) fn transmittance(&self) -> impl Iterator<Item = Lanes> {
        self.passing.iter().map(|line| line.map(f32::abs))
    }

    /// Finds the lines that are done; whether all are.
    fn finished(&mut self) -> bool {
        for (alive, line) in self.alive.iter_mut().zip(&self.passing) {
            *alive = *alive && line.iter().any(|&passing| passing > 0.0);
        }
        !self.alive.contains(&true)
    }
}

/// Blends the ellipses at `entries`, nearest first, until no light passes.
///
/// They are brought together some at a time: they lie far apart in memory, and waiting for one hides no other wait.
#[inline(always)]
#[expect(clippy::indexing_slicing, reason = "places are those of the splats")]
#[expect(clippy::arithmetic_side_effects, reason = "places of entries in memory")]
pub(crate) fn blend_tile(splats: &[Splat], entries: &[u32], tile: &mut Tile, blend: &mut impl Blend) {
    let mut near = [Splat::default(); AHEAD];
    for (chunk, places) in entries.chunks(AHEAD).enumerate() {
        for (splat, &place) in near.iter_mut().zip(places) {
            *splat = splats[place as usize];
        }
        for (entry, splat) in (chunk * AHEAD..).zip(near.iter().take(places.len())) {
            if entry % TILE == TILE - 1 && tile.finished() {
                return;
            }
            blend_splat((splat, entry), tile, blend);
        }
    }
}

/// Blends one ellipse, which is at a place of the tile's entries.
#[inline(always)]
#[expect(clippy::indexing_slicing, reason = "lines are those of a tile")]
fn blend_splat((splat, entry): (&Splat, usize), tile: &mut Tile, blend: &mut impl Blend) {
    let middle = splat.centre[1] - tile.origin[1];
    let first = (middle - splat.extent[1]).ceil().max(0.0) as usize;
    let last = (middle + splat.extent[1]).floor().min((TILE - 1) as f32);
    // A float below 0 would become line 0.
    if last < 0.0 {
        return;
    }
    blend.begin(splat);
    for line in first..=last as usize {
        if tile.alive[line] {
            let visible = blend_line(splat, tile.origin, line, &mut tile.passing[line]);
            // Nothing visible is below 0, so that bits say what values do.
            if visible.iter().fold(0, |bits, visible| bits | visible.to_bits()) != 0 {
                blend.line(splat.colour, line, &visible, &tile.passing[line]);
            }
        }
    }
    blend.done(splat, entry);
}

/// Takes the light that a Gaussian stops on one line; returns transmittance times alpha.
#[inline(always)]
#[expect(
    clippy::indexing_slicing,
    reason = "lines and lanes are those of a tile; places are those of the splats"
)]
fn blend_line(splat: &Splat, origin: [f32; 2], line: usize, passing: &mut Lanes) -> Lanes {
    let dy = origin[1] + line as f32 - splat.centre[1];
    let along = origin[0] - splat.centre[0] + splat.skew * dy;
    let constant = splat.yy * dy * dy + splat.peak;
    let mut visible = [0.0; TILE];
    // Everything is computed and then chosen: without branches the sixteen pixels go side by side.
    for lane in 0..TILE {
        let along = along + lane as f32;
        let exponent = splat.xx * (along * along) + constant;
        let before = passing[lane];
        let reached = if exponent >= -LOG2_255 { exponent } else { -LOG2_255 };
        let alpha = exp2(reached);
        let alpha = if alpha < MAX_ALPHA { alpha } else { MAX_ALPHA };
        let alpha = if exponent >= -LOG2_255 { alpha } else { 0.0 };
        let alpha = if before > 0.0 { alpha } else { 0.0 };
        let stopped = alpha * before;
        let after = before - stopped;
        // A pixel that was done already has a transmittance below the least, and stays as it is.
        let done = after < MIN_TRANSMITTANCE;
        visible[lane] = if done { 0.0 } else { stopped };
        passing[lane] = if done { -before.abs() } else { after };
    }
    visible
}

/// 2^x for -126 < x < 128, relative error below 2^-22; only operations that vectorise everywhere.
#[inline(always)]
pub(crate) fn exp2(x: f32) -> f32 {
    // Adding 1.5 * 2^23 rounds to the nearest integer, which is then in the low bits.
    const ROUND: f32 = 12_582_912.0;
    let rounded = x + ROUND;
    let part = x - (rounded - ROUND);
    // Value and slope at 0 are exact; the rest makes the largest relative error least, 1.1e-7 before rounding.
    let polynomial =
        ((((1.330_060_5e-3 * part + 9.669_691e-3) * part + 5.550_558_5e-2) * part + 2.402_228_3e-1) * part
            + LN_2)
            * part
            + 1.0;
    f32::from_bits(polynomial.to_bits().wrapping_add(rounded.to_bits() << 23))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_exponent_of_the_most_alpha_is_its_logarithm() {
        assert!((LOG2_MAX_ALPHA - libm::log2f(MAX_ALPHA)).abs() < 1e-8);
    }

    #[test]
    fn exp2_is_right_to_the_last_two_bits_where_alpha_lies() {
        for step in 0..=80_000 {
            let x = -8.0 + step as f32 * 1e-4;
            let exact = libm::exp2(f64::from(x));
            let error = (f64::from(exp2(x)) / exact - 1.0).abs();
            assert!(error < 2.4e-7, "{x}: {error:e}");
        }
    }
}
