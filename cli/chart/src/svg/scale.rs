//! From values to places on an axis, and the numbers beside it.

use crate::numbers::{grouped, rounded};

/// Ratio of the largest to the smallest value from which an axis of rates or speeds is logarithmic.
const WIDE: f64 = 6.0;

/// An axis.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scale {
    logarithmic: bool,
    /// Values at the ends.
    values: (f64, f64),
    /// Places of the ends.
    places: (f64, f64),
}

impl Scale {
    /// An axis that holds all values with some room; logarithmic if the values spread and are allowed to.
    pub(super) fn over(values: impl Iterator<Item = f64>, may_log: bool, places: (f64, f64)) -> Self {
        let ends = |(low, high): (f64, f64), value: f64| (low.min(value), high.max(value));
        let (low, high) = values.filter(|v| v.is_finite()).fold((f64::INFINITY, f64::NEG_INFINITY), ends);
        let (low, high) = if low <= high { (low, high) } else { (0.0, 1.0) };
        if may_log && low > 0.0 && high / low > WIDE {
            let room = libm::pow(high / low, 0.07);
            return Self { logarithmic: true, values: (low / room, high * room), places };
        }
        let room = if high > low { 0.07 * (high - low) } else { 0.05 * high.abs().max(0.1) };
        let floor = if low > 0.0 { 0.0 } else { f64::NEG_INFINITY };
        Self { logarithmic: false, values: ((low - room).max(floor), high + room), places }
    }

    /// An axis from 0.
    pub(super) fn from_zero(most: f64, places: (f64, f64)) -> Self {
        Self { logarithmic: false, values: (0.0, if most > 0.0 { most } else { 1.0 }), places }
    }

    /// The same axis in another unit: values times `factor`.
    pub(super) fn times(self, factor: f64) -> Self {
        Self { values: (self.values.0 * factor, self.values.1 * factor), ..self }
    }

    /// Where a value is.
    pub(super) fn place(&self, value: f64) -> f64 {
        let (low, high) = self.values;
        let share = if self.logarithmic {
            libm::log(value.max(f64::MIN_POSITIVE) / low) / libm::log(high / low)
        } else {
            (value - low) / (high - low)
        };
        self.places.0 + share * (self.places.1 - self.places.0)
    }

    /// Round values on the axis, and how they are written.
    pub(super) fn ticks(&self, most: usize) -> Vec<(f64, String)> {
        let (low, high) = self.values;
        if self.logarithmic {
            for steps in [&[1.0, 2.0, 5.0][..], &[1.0, 3.0], &[1.0]] {
                let ticks = decade_ticks(low, high, steps);
                if (3..=most).contains(&ticks.len()) {
                    return ticks.into_iter().map(|value| (value, number(value))).collect();
                }
            }
            let decades = decade_ticks(low, high, &[1.0]);
            if decades.len() > most {
                let every = decades.len().div_ceil(most);
                return decades.into_iter().step_by(every).map(|value| (value, number(value))).collect();
            }
        }
        let step = round_step((high - low) / most as f64);
        let first = libm::ceil(low / step - 1e-9) as i64;
        let last = libm::floor(high / step + 1e-9) as i64;
        let decimals = (-libm::floor(libm::log10(step) + 1e-9)).max(0.0) as usize;
        // A step of 2.5 has a digit more than its size says.
        let decimals =
            if (step * libm::exp10(decimals as f64)).fract() > 1e-6 { decimals + 1 } else { decimals };
        let written = |value: f64| {
            if decimals == 0 && value.abs() >= 1000.0 { number(value) } else { rounded(value, decimals) }
        };
        (first..=last).map(|count| count as f64 * step).map(|value| (value, written(value))).collect()
    }
}

fn decade_ticks(low: f64, high: f64, steps: &[f64]) -> Vec<f64> {
    let decades = libm::floor(libm::log10(low)) as i32..=libm::ceil(libm::log10(high)) as i32;
    let all = decades.flat_map(|decade| steps.iter().map(move |step| step * libm::exp10(f64::from(decade))));
    all.filter(|&value| value >= low * (1.0 - 1e-9) && value <= high * (1.0 + 1e-9)).collect()
}

/// The round number at or above a step.
fn round_step(step: f64) -> f64 {
    let size = libm::exp10(libm::floor(libm::log10(step)));
    let rounds = [1.0, 2.0, 2.5, 5.0, 10.0];
    size * rounds.into_iter().find(|round| round * size >= step * (1.0 - 1e-9)).unwrap_or(10.0)
}

/// A number of an axis, without digits that say nothing.
fn number(value: f64) -> String {
    if value >= 1e7 || (value > 0.0 && value < 1e-3) {
        return format!("{value:.0e}");
    }
    if value >= 1000.0 {
        return grouped(libm::round(value) as u64);
    }
    let text = rounded(value, 4);
    let text = text.trim_end_matches('0').trim_end_matches('.');
    text.to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(scale: Scale, most: usize) -> Vec<String> {
        scale.ticks(most).into_iter().map(|(_, text)| text).collect()
    }

    #[test]
    fn ticks_are_round_and_within_the_axis() {
        let scale = Scale::over([24.1, 40.3].into_iter(), false, (0.0, 100.0));
        assert_eq!(texts(scale, 6), ["25", "30", "35", "40"]);
        let scale = Scale::over([0.91, 0.99].into_iter(), false, (0.0, 100.0));
        assert_eq!(texts(scale, 5), ["0.92", "0.94", "0.96", "0.98"]);
        let scale = Scale::over([3.0, 300.0].into_iter(), true, (0.0, 100.0));
        assert_eq!(texts(scale, 8), ["5", "10", "20", "50", "100", "200"]);
        assert_eq!(texts(Scale::from_zero(4000.0, (0.0, 1.0)), 4), ["0", "1,000", "2,000", "3,000", "4,000"]);
    }

    #[test]
    fn many_decades_have_few_ticks() {
        let scale = Scale::over([1e2, 1e10].into_iter(), true, (0.0, 100.0));
        assert_eq!(texts(scale, 8), ["100", "10,000", "1,000,000", "1e8", "1e10"]);
        let scale = Scale::over([1e-6, 1.0].into_iter(), true, (0.0, 100.0));
        assert_eq!(texts(scale, 4), ["1e-6", "1e-4", "0.01", "1"]);
    }

    #[test]
    fn one_value_alone_has_an_axis() {
        let scale = Scale::over([7.0].into_iter(), true, (0.0, 100.0));
        assert!((scale.place(7.0) - 50.0).abs() < 1e-9);
        assert!(!scale.ticks(5).is_empty());
        assert!(!Scale::over([].into_iter(), true, (0.0, 1.0)).ticks(5).is_empty());
    }

    #[test]
    fn a_logarithmic_axis_gives_equal_ratios_equal_lengths() {
        let scale = Scale::over([1.0, 100.0].into_iter(), true, (0.0, 100.0));
        let [a, b, c] = [1.0, 10.0, 100.0].map(|value| scale.place(value));
        assert!((b - a - (c - b)).abs() < 1e-9);
    }
}
