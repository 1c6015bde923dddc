//! The light that still passes each pixel of a small picture, and what ellipses take of it.
//!
//! Most ellipses show in a few pixels, on a few lines. So four lines are looked at side by side, and where an ellipse is
//! narrow there all pixels of a box around it, whether all are wanted or not. What comes out is the same, bit by bit, as
//! pixel by pixel.
#![expect(clippy::arithmetic_side_effects, reason = "floats; places of pixels in memory")]
#![expect(clippy::indexing_slicing, reason = "pixels are those of the picture, lanes those of a box")]

use super::ellipses::{Ellipse, REACH};
use crate::rasterise::{MAX_ALPHA, exp2};
use std::f32::consts::LOG2_E;

/// Lines that are looked at side by side.
const LINES: usize = 4;

/// Pixels of a line of a box, where an ellipse is narrow; and of what is cut from the lines of a wide one.
const NARROW: usize = 4;
const WIDE: usize = 8;

/// A pixel is done where less of the light would pass than this: the rest changes no order.
const MIN_PASSING: f32 = 1e-3;

/// What an ellipse adds to a pixel.
pub(super) struct Touch {
    pub(super) pixel: u32,
    /// What it hides of what is behind it, by what it lets pass: alpha / (1 - alpha).
    pub(super) ratio: f32,
    /// Transmittance times alpha.
    pub(super) visible: f32,
}

/// The light that still passes each pixel; 0 where a pixel is done. Boxes may reach beyond the last pixel of a line and
/// beyond the last line: nothing passes there.
#[derive(Default)]
pub(super) struct Picture {
    size: [usize; 2],
    /// Pixels from one line to the next.
    stride: usize,
    passing: Vec<f32>,
}

/// Where an ellipse is on some lines.
struct Spans {
    /// Where each line is nearest to its middle, and the exponent there.
    middle: [f32; LINES],
    rest: [f32; LINES],
    /// The first pixel and the last; the last comes before the first where there is none.
    first: [f32; LINES],
    last: [f32; LINES],
}

impl Picture {
    /// Of a size, and all light passes.
    pub(super) fn start(&mut self, size: [usize; 2]) {
        self.size = size;
        self.stride = size[0] + WIDE;
        self.passing.clear();
        self.passing.resize(self.stride * (size[1] + LINES), 0.0);
        self.clear();
    }

    /// All light passes again.
    pub(super) fn clear(&mut self) {
        let [width, height] = self.size;
        let lines = self.passing.chunks_exact_mut(self.stride).take(height);
        lines.for_each(|line| line[..width].fill(1.0));
    }

    /// What passes each pixel, and what lies beyond.
    pub(super) fn passing(&self) -> &[f32] {
        &self.passing
    }

    /// So much passes as passed before.
    pub(super) fn set(&mut self, passing: &[f32]) {
        self.passing.copy_from_slice(passing);
    }

    /// Takes the light that an ellipse stops, and keeps what it adds to each pixel: line by line, from the left.
    #[inline(always)]
    pub(super) fn blend(&mut self, ellipse: &Ellipse, touches: &mut Vec<Touch>) {
        let [mut line, last] = ellipse.lines.map(|line| line as usize);
        while line <= last {
            let spans = Spans::new(ellipse, line, self.size[0]);
            if let Some((left, right)) = spans.ends() {
                let first = line * self.stride + left as usize;
                let columns = right - left;
                if columns < NARROW as f32 {
                    self.cut::<LINES, NARROW, { LINES * NARROW }>(ellipse, &spans.cut(left), first, touches);
                } else if columns < WIDE as f32 {
                    self.cut::<LINES, WIDE, { LINES * WIDE }>(ellipse, &spans.cut(left), first, touches);
                } else {
                    self.wide(ellipse, &spans, line, touches);
                }
            }
            line += LINES;
        }
    }

    /// The same on lines of which one at least is longer than a box.
    #[inline(always)]
    fn wide(&mut self, ellipse: &Ellipse, spans: &Spans, line: usize, touches: &mut Vec<Touch>) {
        for number in 0..LINES {
            let (left, right) = (spans.first[number], spans.last[number]);
            if left > right {
                continue;
            }
            let start = (line + number) * self.stride;
            for first in (left as usize..=right as usize).step_by(WIDE) {
                let cut = Cut {
                    from: [first as f32 - spans.middle[number]],
                    before: [0.0],
                    last: [right - first as f32],
                    rest: [spans.rest[number]],
                };
                self.cut::<1, WIDE, WIDE>(ellipse, &cut, start + first, touches);
            }
        }
    }

    /// Blends what an ellipse has in a box, whose first pixel is at a place.
    #[inline(always)]
    fn cut<const HEIGHT: usize, const WIDTH: usize, const PIXELS: usize>(
        &mut self,
        ellipse: &Ellipse,
        cut: &Cut<HEIGHT>,
        first: usize,
        touches: &mut Vec<Touch>,
    ) {
        let mut passing = [0.0; PIXELS];
        for (line, passing) in passing.chunks_exact_mut(WIDTH).enumerate() {
            let start = first + line * self.stride;
            passing.copy_from_slice(&self.passing[start..start + WIDTH]);
        }
        let (mut places, mut wanted, mut bits) = ([0.0; PIXELS], [false; PIXELS], 0_u32);
        for pixel in 0..PIXELS {
            let (line, column) = (pixel / WIDTH, (pixel % WIDTH) as f32);
            places[pixel] = column - cut.before[line];
            wanted[pixel] = (places[pixel] >= 0.0) & (column <= cut.last[line]) & (passing[pixel] > 0.0);
            bits |= u32::from(wanted[pixel]) << pixel;
        }
        if bits == 0 {
            return;
        }
        let [mut visible, mut ratios] = [[0.0; PIXELS]; 2];
        for pixel in 0..PIXELS {
            let line = pixel / WIDTH;
            let apart = cut.from[line] + places[pixel];
            let square = ellipse.xx * apart * apart + cut.rest[line];
            // Pixels that are not wanted may lie so far out that 2 to their exponent is no number.
            let square = if square < 2.0 * REACH { square } else { 2.0 * REACH };
            let alpha = ellipse.peak * exp2(-0.5 * LOG2_E * square);
            let alpha = if alpha < MAX_ALPHA { alpha } else { MAX_ALPHA };
            let before = passing[pixel];
            visible[pixel] = before * alpha;
            ratios[pixel] = alpha / (1.0 - alpha);
            let after = before - visible[pixel];
            let after = if after < MIN_PASSING { 0.0 } else { after };
            passing[pixel] = if wanted[pixel] { after } else { before };
        }
        for (line, passing) in passing.chunks_exact(WIDTH).enumerate() {
            let start = first + line * self.stride;
            self.passing[start..start + WIDTH].copy_from_slice(passing);
        }
        while bits != 0 {
            let pixel = bits.trailing_zeros() as usize % PIXELS;
            let place = first + pixel / WIDTH * self.stride + pixel % WIDTH;
            touches.push(Touch { pixel: place as u32, ratio: ratios[pixel], visible: visible[pixel] });
            bits &= bits - 1;
        }
    }
}

/// A box of pixels, by lines.
struct Cut<const HEIGHT: usize> {
    /// How far the first pixel of the ellipse is from where the line is nearest to its middle.
    from: [f32; HEIGHT],
    /// Pixels of the box before that.
    before: [f32; HEIGHT],
    /// The last column.
    last: [f32; HEIGHT],
    /// The exponent where the line is nearest to the middle.
    rest: [f32; HEIGHT],
}

impl Spans {
    /// On the lines from one on.
    #[inline(always)]
    fn new(ellipse: &Ellipse, line: usize, width: usize) -> Self {
        let ([x, y], [_, last_line]) = (ellipse.centre, ellipse.lines);
        let zero = [0.0; LINES];
        let mut spans = Self { middle: zero, rest: zero, first: zero, last: zero };
        let most = width as f32 - 1.0;
        for number in 0..LINES {
            let line = line as f32 + number as f32;
            let dy = line + 0.5 - y;
            let rest = ellipse.yy * dy * dy;
            let square = (REACH - rest) / ellipse.xx;
            let square: f32 = if square > 0.0 { square } else { 0.0 };
            let half = square.sqrt();
            let middle = x - ellipse.skew * dy - 0.5;
            let (first, last) = ((middle - half).ceil(), (middle + half).floor());
            let last = if last < most { last } else { most };
            spans.middle[number] = middle;
            spans.rest[number] = rest;
            spans.first[number] = if first > 0.0 { first } else { 0.0 };
            spans.last[number] = if line <= last_line { last } else { -1.0 };
        }
        spans
    }

    /// The first column and the last of all lines; none where there is no pixel.
    #[inline(always)]
    fn ends(&self) -> Option<(f32, f32)> {
        let (mut left, mut right) = (f32::MAX, -1.0_f32);
        for (&first, &last) in self.first.iter().zip(&self.last) {
            let (first, last) = if first <= last { (first, last) } else { (f32::MAX, -1.0) };
            left = if first < left { first } else { left };
            right = if last > right { last } else { right };
        }
        (left <= right).then_some((left, right))
    }

    /// The box that begins with a column.
    #[inline(always)]
    fn cut(&self, left: f32) -> Cut<LINES> {
        let zero = [0.0; LINES];
        let mut cut = Cut { from: zero, before: zero, last: zero, rest: self.rest };
        for number in 0..LINES {
            cut.from[number] = self.first[number] - self.middle[number];
            cut.before[number] = self.first[number] - left;
            cut.last[number] = self.last[number] - left;
        }
        cut
    }
}
