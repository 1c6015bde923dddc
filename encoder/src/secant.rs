//! Where a growing function of the PSNR that steps are fitted for has a value, if it takes long to compute.

/// The PSNR that steps are fitted for, decibels: where functions are defined.
const RANGE: [f64; 2] = [20.0, 90.0];

/// The next place is no further from the best one than this.
const LARGEST_STEP: f64 = 12.0;

/// Places nearer to each other than this count as one.
const SAME: f64 = 0.02;

/// Follows the secant through the two best points; between a point that is too low and one that is too high it never
/// leaves them.
pub(crate) struct Secant {
    goal: f64,
    /// Values this near the goal will do.
    near: f64,
    /// The slope before two points are known, and by which the measured one is judged.
    guess: f64,
    /// Values that are asked for at most.
    most: usize,
    /// Known places and values, nearest to the goal first.
    known: Vec<(f64, f64)>,
}

impl Secant {
    pub(crate) fn new(goal: f64, near: f64, slope: f64, most: usize) -> Self {
        Self { goal, near, guess: slope, most, known: Vec::new() }
    }

    /// Takes a value; whether it is nearer to the goal than all before.
    pub(crate) fn take(&mut self, at: f64, value: f64) -> bool {
        let apart = |&(_, value): &(f64, f64)| (value - self.goal).abs();
        let place = self.known.iter().take_while(|other| apart(other) <= apart(&(at, value))).count();
        self.known.insert(place, (at, value));
        place == 0
    }

    /// The best place so far; the middle of the range if none is known.
    pub(crate) fn best(&self) -> f64 {
        self.known.first().map_or(0.5 * (RANGE[0] + RANGE[1]), |&(at, _)| at)
    }

    /// The slope near the goal.
    pub(crate) fn slope(&self) -> f64 {
        let [(a, low), (b, high), ..] = self.known[..] else { return self.guess };
        let slope = (high - low) / (b - a);
        // A function with noise may be flat, or fall, between places that are close.
        if slope.is_finite() { slope.clamp(self.guess / 3.0, self.guess * 3.0) } else { self.guess }
    }

    /// Where to look next; none if the goal is reached or cannot be.
    pub(crate) fn next(&self) -> Option<f64> {
        let &(at, value) = self.known.first()?;
        if (value - self.goal).abs() <= self.near || self.known.len() >= self.most {
            return None;
        }
        let step = ((self.goal - value) / self.slope()).clamp(-LARGEST_STEP, LARGEST_STEP);
        let next = (at + step).clamp(RANGE[0], RANGE[1]);
        let places = |is_low: bool| {
            let side = self.known.iter().filter(move |known| (known.1 < self.goal) == is_low);
            side.map(|&(at, _)| at)
        };
        let [low, high] = [places(true).reduce(f64::max), places(false).reduce(f64::min)];
        let bracket = low.zip(high).filter(|(low, high)| low < high);
        let is_inside = bracket.is_none_or(|(low, high)| (low..=high).contains(&next));
        let middle = bracket.map(|(low, high)| 0.5 * (low + high));
        let is_new = |next: &f64| self.known.iter().all(|&(at, _)| (at - next).abs() > SAME);
        Some(next).filter(|next| is_inside && is_new(next)).or(middle.filter(is_new))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The place found and the values asked for.
    fn found(goal: f64, first: f64, function: impl Fn(f64) -> f64) -> (f64, usize) {
        let mut secant = Secant::new(goal, 0.01, 0.04, 6);
        let mut next = Some(first);
        while let Some(at) = next {
            secant.take(at, function(at));
            next = secant.next();
        }
        (secant.best(), secant.known.len())
    }

    #[test]
    fn a_smooth_function_is_found_in_few_steps() {
        let function = |at: f64| 0.05 * at + 0.0002 * at * at;
        let (at, asked) = found(function(52.0), 47.0, function);
        assert!((function(at) - function(52.0)).abs() <= 0.01 && asked <= 4, "{at} {asked}");
    }

    #[test]
    fn what_cannot_be_reached_ends_at_the_edge() {
        let (at, asked) = found(0.0, 47.0, |at| 0.04 * at);
        assert!(at == 20.0 && asked <= 4, "{at} {asked}");
        assert_eq!(found(99.0, 80.0, |at| 0.04 * at).0, 90.0);
    }

    #[test]
    fn steps_in_the_function_do_not_hold_it_up() {
        let (at, asked) = found(2.0, 47.0, |at| if at < 50.3 { 1.0 } else { 3.0 });
        assert!((20.0..=90.0).contains(&at) && asked <= 6);
    }
}
