//! What some work took: on the clock, and of all processors.

use std::time::{Duration, Instant};

/// What some work took.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Spent {
    /// Seconds on the clock.
    pub(crate) wall: f64,
    /// Seconds of all threads of this process; none where the system does not say.
    pub(crate) processor: Option<f64>,
}

impl Spent {
    /// Does some work.
    pub(crate) fn of<T>(work: impl FnOnce() -> T) -> (T, Self) {
        let (processor, wall) = (processor_time(), Instant::now());
        let result = work();
        let wall = wall.elapsed().as_secs_f64();
        let processor =
            processor_time().zip(processor).map(|(after, before)| after.saturating_sub(before).as_secs_f64());
        (result, Self { wall, processor })
    }
}

/// Processor time of all threads of this process so far.
fn processor_time() -> Option<Duration> {
    #[cfg(unix)]
    {
        Duration::try_from(rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime)).ok()
    }
    #[cfg(not(unix))]
    None
}

/// Seconds of several measurements of the same work.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Timing {
    /// On the clock, the one in the middle.
    pub(crate) median: f64,
    /// The shortest.
    pub(crate) least: f64,
    /// The longest.
    pub(crate) most: f64,
    /// Of all threads, the one in the middle; none where the system does not say.
    pub(crate) processor: Option<f64>,
}

impl Timing {
    /// Of some measurements, one or more.
    pub(crate) fn of(spent: &[Spent]) -> Self {
        let mut seconds: Vec<f64> = spent.iter().map(|one| one.wall).collect();
        let processor: Option<Vec<f64>> = spent.iter().map(|one| one.processor).collect();
        let median = median(&mut seconds);
        let end = |place: Option<&f64>| place.copied().unwrap_or(f64::NAN);
        let processor = processor.map(|mut seconds| self::median(&mut seconds));
        Self { median, least: end(seconds.first()), most: end(seconds.last()), processor }
    }

    /// The mean of several: of work of about the same size.
    pub(crate) fn over(timings: &[Self]) -> Self {
        let mean = |of: fn(&Self) -> f64| timings.iter().map(of).sum::<f64>() / timings.len().max(1) as f64;
        let processor = timings.iter().all(|one| one.processor.is_some()).then(|| mean(Self::work));
        let end = |of: fn(&Self) -> f64, better: fn(f64, f64) -> f64| timings.iter().map(of).reduce(better);
        Self {
            median: mean(|one| one.median),
            least: end(|one| one.least, f64::min).unwrap_or(f64::NAN),
            most: end(|one| one.most, f64::max).unwrap_or(f64::NAN),
            processor,
        }
    }

    /// Seconds of all threads, or on the clock where those are not known.
    pub(crate) fn work(&self) -> f64 {
        self.processor.unwrap_or(self.median)
    }
}

/// The number in the middle, or the mean of the two there; sorts.
fn median(seconds: &mut [f64]) -> f64 {
    seconds.sort_by(f64::total_cmp);
    let at = |index: usize| seconds.get(index).copied().unwrap_or(f64::NAN);
    let middle = seconds.len() / 2;
    let low = if seconds.len().is_multiple_of(2) { middle.saturating_sub(1) } else { middle };
    0.5 * (at(low) + at(middle))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_of_an_even_number_is_between_the_two_in_the_middle() {
        let of = |walls: &[f64]| {
            let spent: Vec<Spent> =
                walls.iter().map(|&wall| Spent { wall, processor: Some(2.0 * wall) }).collect();
            Timing::of(&spent)
        };
        let processor = Some(4.0);
        assert_eq!(of(&[3.0, 1.0, 2.0]), Timing { median: 2.0, least: 1.0, most: 3.0, processor });
        assert_eq!(of(&[4.0, 1.0, 2.0, 3.0]).median, 2.5);
        assert_eq!(of(&[7.0]).work(), 14.0);
    }

    #[test]
    fn what_one_run_does_not_know_is_not_known() {
        let spent = [Some(1.0), None].map(|processor| Spent { wall: 3.0, processor });
        let timing = Timing::of(&spent);
        assert_eq!((timing.processor, timing.work()), (None, 3.0));
    }
}
