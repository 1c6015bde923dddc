//! A network that is known in advance: bandwidth over time, exactly.

use std::fmt;

/// Bandwidth over time, repeated without end. Bytes and times are exact: what it carries until a time is an integer number
/// of millionths of a bit.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Trace {
    /// Start of each step in microseconds, from 0, and its bandwidth in bits per second.
    steps: Vec<(u64, u64)>,
    /// Millionths of a bit that are carried before each step.
    carried: Vec<u128>,
    period_us: u64,
    period_carried: u128,
}

/// Why a trace is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum TraceError {
    /// It has no steps.
    Empty,
    /// A line, counted from 1, is not two numbers from 0, a time in seconds and megabits per second, or its time is not
    /// after the one before.
    Line(usize),
}

impl fmt::Display for TraceError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Empty => write!(f, "a trace must have at least one step"),
            Self::Line(line) => write!(
                f,
                "line {line}: a time in seconds after the one before, a comma and Mbit/s are expected"
            ),
        }
    }
}

impl std::error::Error for TraceError {}

impl Trace {
    /// A trace of steps: durations in microseconds, above 0, and bandwidths in bits per second.
    ///
    /// # Errors
    ///
    /// [`TraceError::Empty`] without steps or with one of no duration.
    pub fn new(durations: &[(u64, u64)]) -> Result<Self, TraceError> {
        if durations.is_empty() || durations.iter().any(|&(duration_us, _)| duration_us == 0) {
            return Err(TraceError::Empty);
        }
        let (mut steps, mut carried) = (Vec::new(), Vec::new());
        let (mut period_us, mut period_carried) = (0_u64, 0_u128);
        for &(duration_us, rate) in durations {
            steps.push((period_us, rate));
            carried.push(period_carried);
            period_us = period_us.saturating_add(duration_us);
            period_carried =
                period_carried.saturating_add(u128::from(duration_us).saturating_mul(u128::from(rate)));
        }
        Ok(Self { steps, carried, period_us, period_carried })
    }

    /// A constant bandwidth in bits per second.
    pub fn constant(rate: u64) -> Self {
        let period_us = 1_000_000;
        let period_carried = u128::from(rate).saturating_mul(1_000_000);
        Self { steps: vec![(0, rate)], carried: vec![0], period_us, period_carried }
    }

    /// Reads CSV: a line of titles, then lines of a time in seconds and the bandwidth from then on in Mbit/s. The last step
    /// is as long as the one before, or a second if there is none.
    ///
    /// # Errors
    ///
    /// [`TraceError::Line`] and [`TraceError::Empty`]
    pub fn parse(csv: &str) -> Result<Self, TraceError> {
        let mut rows: Vec<(u64, u64)> = Vec::new();
        for (line, number) in csv.lines().zip(1_usize..).skip(1).filter(|(line, _)| !line.trim().is_empty()) {
            let row = line.split_once(',').and_then(|(time, rate)| Some((decimal(time)?, decimal(rate)?)));
            let row = row.filter(|row| rows.last().is_none_or(|last| row.0 > last.0));
            rows.push(row.ok_or(TraceError::Line(number))?);
        }
        let mut steps: Vec<(u64, u64)> = Vec::new();
        for (row, next) in rows.iter().zip(rows.iter().skip(1)) {
            steps.push((next.0.saturating_sub(row.0), row.1));
        }
        if let Some(last) = rows.last() {
            steps.push((steps.last().map_or(1_000_000, |step| step.0), last.1));
        }
        Self::new(&steps)
    }

    /// The same from a time on.
    #[must_use]
    pub fn since(&self, start_us: u64) -> Self {
        let at = start_us.checked_rem(self.period_us).unwrap_or(0);
        let ends = self.steps.iter().skip(1).map(|step| step.0).chain([self.period_us]);
        let steps = || self.steps.iter().zip(ends.clone()).map(|(&(start, rate), end)| (start, end, rate));
        let after = steps().filter(|step| step.1 > at).map(|(start, end, rate)| (start.max(at), end, rate));
        let before = steps().filter(|step| step.0 < at).map(|(start, end, rate)| (start, end.min(at), rate));
        let durations: Vec<(u64, u64)> =
            after.chain(before).map(|(start, end, rate)| (end.saturating_sub(start), rate)).collect();
        // It has the steps of this one.
        Self::new(&durations).unwrap_or_else(|_| self.clone())
    }

    /// Duration after which it repeats, in microseconds.
    pub fn period_us(&self) -> u64 {
        self.period_us
    }

    /// Mean bandwidth in bits per second, rounded down.
    pub fn mean(&self) -> u64 {
        let mean = self.period_carried.checked_div(u128::from(self.period_us)).unwrap_or(0);
        u64::try_from(mean).unwrap_or(u64::MAX)
    }

    /// Millionths of a bit that the network carries from the start to a time.
    pub fn carried(&self, until_us: u64) -> u128 {
        let rounds = until_us.checked_div(self.period_us).unwrap_or(0);
        let within = until_us.checked_rem(self.period_us).unwrap_or(0);
        let index = self.steps.partition_point(|step| step.0 <= within).saturating_sub(1);
        let (start, rate) = self.steps.get(index).copied().unwrap_or_default();
        let part = u128::from(within.saturating_sub(start)).saturating_mul(u128::from(rate));
        let whole = u128::from(rounds).saturating_mul(self.period_carried);
        whole.saturating_add(self.carried.get(index).copied().unwrap_or(0)).saturating_add(part)
    }

    /// The first microsecond until which so many millionths of a bit are carried; none if that never happens.
    pub fn time_of(&self, carried: u128) -> Option<u64> {
        if carried == 0 {
            return Some(0);
        }
        let rounds = carried.saturating_sub(1).checked_div(self.period_carried)?;
        let left = carried.saturating_sub(rounds.saturating_mul(self.period_carried));
        let index = self.carried.partition_point(|&before| before < left).saturating_sub(1);
        let (start, rate) = self.steps.get(index).copied()?;
        let missing = left.saturating_sub(self.carried.get(index).copied()?);
        let within = u64::try_from(
            missing.checked_add(u128::from(rate))?.checked_sub(1)?.checked_div(u128::from(rate))?,
        )
        .ok()?;
        let before = u64::try_from(rounds).ok()?.checked_mul(self.period_us)?;
        before.checked_add(start)?.checked_add(within)
    }
}

/// A decimal number from 0 in millionths; digits after the sixth are dropped.
fn decimal(text: &str) -> Option<u64> {
    let (whole, part) = text.trim().split_once('.').unwrap_or((text.trim(), ""));
    if !part.bytes().all(|byte| byte.is_ascii_digit()) || part.len() > 18 {
        return None;
    }
    let digits: String = part.chars().chain("000000".chars()).take(6).collect();
    whole.parse::<u64>().ok()?.checked_mul(1_000_000)?.checked_add(digits.parse().ok()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_carried_is_exact() {
        let trace = Trace::parse("t_s,mbps\n0.000,1.5\n0.5,0\n2,4\n").expect("it is a trace");
        assert_eq!(
            trace,
            Trace::new(&[(500_000, 1_500_000), (1_500_000, 0), (1_500_000, 4_000_000)])
                .expect("it has steps")
        );
        assert_eq!((trace.period_us(), trace.mean()), (3_500_000, 1_928_571));
        assert_eq!(trace.carried(500_000), 750_000 * 1_000_000);
        assert_eq!(trace.carried(2_000_001), trace.carried(500_000) + 4_000_000);
        assert_eq!(trace.carried(7_000_000), 2 * 6_750_000 * 1_000_000);
        assert_eq!(trace.time_of(trace.carried(500_000)), Some(500_000));
        assert_eq!(trace.time_of(trace.carried(500_000) + 1), Some(2_000_001));
        assert_eq!(Trace::constant(0).time_of(1), None);
    }

    #[test]
    fn a_trace_from_a_time_on_carries_the_rest() {
        let trace = Trace::parse("t_s,mbps\n0.000,1.5\n0.5,0\n2,4\n").expect("it is a trace");
        for start in [0, 1, 500_000, 1_999_999, 3_499_999, 3_500_000, 8_000_000] {
            let rest = trace.since(start);
            assert_eq!((rest.period_us(), rest.mean()), (trace.period_us(), trace.mean()));
            for time in [0, 1, 400_000, 1_700_000, 9_000_000] {
                assert_eq!(rest.carried(time), trace.carried(start + time) - trace.carried(start));
            }
        }
    }

    #[test]
    fn broken_traces_are_refused() {
        let bad = [
            "t_s,mbps\n0,1\n0,2\n",
            "t_s,mbps\n0,1\n1;2\n",
            "t_s,mbps\n0,1\n1,-2\n",
            "t_s,mbps\n0,1\n1,2e3\n",
        ];
        for csv in bad {
            assert_eq!(Trace::parse(csv), Err(TraceError::Line(3)));
        }
        assert_eq!(Trace::parse("t_s,mbps\n"), Err(TraceError::Empty));
        assert_eq!(Trace::new(&[(0, 1)]), Err(TraceError::Empty));
    }
}
