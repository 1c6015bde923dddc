//! Monotone piecewise cubic Hermite interpolation, and its integral.
//!
//! Source: Fritsch and Butland, "A method for constructing local monotone piecewise cubic interpolants", 1984;
//! slopes at the ends by the three-point formula, kept monotone as Moler, "Numerical computing with MATLAB",
//! section 3.6, does.

/// A curve through points of rising abscissae.
pub(super) struct Pchip {
    pieces: Vec<Piece>,
}

/// A cubic over one interval.
struct Piece {
    from: f64,
    width: f64,
    /// Ordinates at the ends.
    values: [f64; 2],
    /// Slopes at the ends, times the width.
    rises: [f64; 2],
}

impl Pchip {
    /// The curve through `points`, abscissae strictly rising. None if they are fewer than two; a line if two.
    #[expect(
        clippy::indexing_slicing,
        reason = "windows have two points, and there is a slope for each point"
    )]
    #[expect(clippy::arithmetic_side_effects, reason = "there are two points or more")]
    pub(super) fn through(points: &[(f64, f64)]) -> Option<Self> {
        if points.len() < 2 {
            return None;
        }
        let widths: Vec<f64> = points.windows(2).map(|pair| pair[1].0 - pair[0].0).collect();
        let secants: Vec<f64> =
            points.windows(2).zip(&widths).map(|(pair, width)| (pair[1].1 - pair[0].1) / width).collect();
        let slopes = slopes(&widths, &secants);
        let piece = |i: usize| Piece {
            from: points[i].0,
            width: widths[i],
            values: [points[i].1, points[i + 1].1],
            rises: [slopes[i] * widths[i], slopes[i + 1] * widths[i]],
        };
        Some(Self { pieces: (0..widths.len()).map(piece).collect() })
    }

    /// Where the curve begins.
    pub(super) fn from(&self) -> f64 {
        self.pieces.first().map_or(0.0, |piece| piece.from)
    }

    /// Where the curve ends.
    pub(super) fn to(&self) -> f64 {
        self.pieces.last().map_or(0.0, |piece| piece.from + piece.width)
    }

    /// The ordinate at an abscissa; None outside the curve.
    pub(super) fn at(&self, x: f64) -> Option<f64> {
        // An end that was summed up may miss the last point by a rounding.
        let slack = 1e-9 * (self.to() - self.from());
        let after = self.pieces.iter().find(|piece| x <= piece.from + piece.width + slack);
        after.filter(|_| x >= self.from()).map(|piece| piece.at(x))
    }

    /// The area under the curve between two abscissae of it.
    pub(super) fn integral(&self, from: f64, to: f64) -> f64 {
        self.pieces.iter().map(|piece| piece.area_until(to) - piece.area_until(from)).sum()
    }
}

impl Piece {
    fn at(&self, x: f64) -> f64 {
        let t = (x - self.from) / self.width;
        let [start, end] = self.values;
        let [rise_start, rise_end] = self.rises;
        let square = 3.0 * (end - start) - 2.0 * rise_start - rise_end;
        let cube = 2.0 * (start - end) + rise_start + rise_end;
        start + t * (rise_start + t * (square + t * cube))
    }

    /// The area under the piece left of `to`, which may be outside.
    fn area_until(&self, to: f64) -> f64 {
        let t = ((to - self.from) / self.width).clamp(0.0, 1.0);
        let [start, end] = self.values;
        let [rise_start, rise_end] = self.rises;
        // The coefficients of the cubic in t, then Horner's rule on its antiderivative.
        let square = 3.0 * (end - start) - 2.0 * rise_start - rise_end;
        let cube = 2.0 * (start - end) + rise_start + rise_end;
        self.width * t * (start + t * (rise_start / 2.0 + t * (square / 3.0 + t * cube / 4.0)))
    }
}

/// The slope at each point.
#[expect(clippy::indexing_slicing, reason = "windows have two points, and there is a slope for each point")]
#[expect(clippy::arithmetic_side_effects, reason = "there are two points or more")]
fn slopes(widths: &[f64], secants: &[f64]) -> Vec<f64> {
    let last = secants.len() - 1;
    if last == 0 {
        return vec![secants[0]; 2];
    }
    let inner = widths.windows(2).zip(secants.windows(2)).map(|(width, secant)| {
        if secant[0] * secant[1] <= 0.0 {
            return 0.0;
        }
        let (before, after) = (width[0] + 2.0 * width[1], 2.0 * width[0] + width[1]);
        (before + after) / (before / secant[0] + after / secant[1])
    });
    let start = end_slope([widths[0], widths[1]], [secants[0], secants[1]]);
    let end = end_slope([widths[last], widths[last - 1]], [secants[last], secants[last - 1]]);
    std::iter::once(start).chain(inner).chain([end]).collect()
}

/// The slope at an end, from the interval there and the one beside it.
fn end_slope([width, next_width]: [f64; 2], [secant, next_secant]: [f64; 2]) -> f64 {
    let slope = ((2.0 * width + next_width) * secant - width * next_secant) / (width + next_width);
    if slope * secant <= 0.0 {
        0.0
    } else if secant * next_secant <= 0.0 && slope.abs() > 3.0 * secant.abs() {
        3.0 * secant
    } else {
        slope
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_integral_is_that_of_the_line_or_of_its_parts() {
        let line = Pchip::through(&[(0.0, 1.0), (1.0, 3.0), (4.0, 9.0)]).unwrap();
        assert!((line.integral(0.5, 3.5) - 15.0).abs() < 1e-12);
        let curve = Pchip::through(&[(0.0, 0.0), (1.0, 4.0), (2.0, 5.0), (5.0, 6.0)]).unwrap();
        let parts = curve.integral(0.25, 1.5) + curve.integral(1.5, 4.0);
        assert!((curve.integral(0.25, 4.0) - parts).abs() < 1e-12);
    }
}
