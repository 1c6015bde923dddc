//! Words beside points, where they cover neither points nor each other.

/// Height of a line of text.
const HEIGHT: f64 = 14.0;
/// Width of a letter, on the safe side: fonts differ.
const LETTER: f64 = 7.5;

/// A rectangle: left, top, right, bottom.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Area(pub(super) f64, pub(super) f64, pub(super) f64, pub(super) f64);

impl Area {
    /// The square around a point.
    pub(super) fn around((x, y): (f64, f64), half: f64) -> Self {
        Self(x - half, y - half, x + half, y + half)
    }

    fn meets(&self, other: &Self) -> bool {
        self.0 < other.2 && other.0 < self.2 && self.1 < other.3 && other.1 < self.3
    }

    /// How much they share.
    fn shared(&self, other: &Self) -> f64 {
        let (width, height) =
            (self.2.min(other.2) - self.0.max(other.0), self.3.min(other.3) - self.1.max(other.1));
        width.max(0.0) * height.max(0.0)
    }

    fn holds(&self, other: &Self) -> bool {
        self.0 <= other.0 && self.1 <= other.1 && self.2 >= other.2 && self.3 >= other.3
    }
}

/// A text that has its place.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Placed {
    /// Where the text starts, on its base line.
    pub(super) start: (f64, f64),
    /// A line from the point to the text, if it is not beside it.
    pub(super) leader: Option<[(f64, f64); 2]>,
}

/// Finds places.
pub(super) struct Placer {
    bounds: Area,
    /// What must not be covered: points and words.
    hard: Vec<Area>,
    /// What had better not be covered: lines.
    soft: Vec<Area>,
}

impl Placer {
    /// A placer that stays within `bounds`.
    pub(super) fn new(bounds: Area) -> Self {
        Self { bounds, hard: Vec::new(), soft: Vec::new() }
    }

    /// Keeps a point free.
    pub(super) fn point(&mut self, at: (f64, f64)) {
        self.hard.push(Area::around(at, 5.0));
    }

    /// Keeps a line free where possible.
    pub(super) fn line(&mut self, points: &[(f64, f64)]) {
        for pair in points.windows(2) {
            let [(ax, ay), (bx, by)] = [pair[0], pair[1]];
            let steps = (((bx - ax).abs() + (by - ay).abs()) / 5.0).ceil().max(1.0);
            let at = |step: f64| (ax + (bx - ax) * step / steps, ay + (by - ay) * step / steps);
            self.soft.extend((0..=steps as usize).map(|step| Area::around(at(step as f64), 1.5)));
        }
    }

    /// The best place for a text beside a point.
    pub(super) fn place(&mut self, at: (f64, f64), text: &str) -> Placed {
        let width = text.chars().count() as f64 * LETTER + 2.0;
        let candidates = candidates(at, width);
        let free = |soft: bool| {
            candidates.iter().find(|(area, _)| {
                let clear = |taken: &Area| !area.meets(taken);
                self.bounds.holds(area)
                    && self.hard.iter().all(clear)
                    && (!soft || self.soft.iter().all(clear))
            })
        };
        // Where nothing is free, a point is covered rather than words, and of either as little as possible.
        let covered = |area: &Area| self.hard.iter().map(|taken| area.shared(taken)).sum::<f64>();
        let within = || {
            let inside = candidates.iter().filter(|(area, _)| self.bounds.holds(area));
            inside.min_by(|(a, _), (b, _)| covered(a).total_cmp(&covered(b)))
        };
        let found = free(true).or_else(|| free(false)).or_else(within).or(candidates.first());
        let &(area, far) = found.unwrap_or(&(Area::around(at, 0.0), false));
        self.hard.push(area);
        let nearest = (at.0.clamp(area.0, area.2), at.1.clamp(area.1 + 2.0, area.3 - 2.0));
        Placed { start: (area.0 + 1.0, area.3 - 3.5), leader: far.then_some([at, nearest]) }
    }
}

/// Places around a point, the best first, and whether they are far from it.
fn candidates((x, y): (f64, f64), width: f64) -> Vec<(Area, bool)> {
    let mut all = Vec::new();
    for (ring, gap) in [8.0, 20.0, 34.0, 50.0, 68.0, 88.0, 110.0, 134.0].into_iter().enumerate() {
        let middle = y - HEIGHT / 2.0;
        let (left, right, centre) = (x - gap - width, x + gap, x - width / 2.0);
        let (above, below) = (y - gap - HEIGHT, y + gap);
        let corner = 0.5 * gap;
        let starts = [
            (right, middle),
            (centre, above),
            (centre, below),
            (left, middle),
            (x + corner, above),
            (x + corner, below),
            (x - corner - width, above),
            (x - corner - width, below),
        ];
        all.extend(starts.map(|(left, top)| (Area(left, top, left + width, top + HEIGHT), ring > 0)));
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_at_one_point_do_not_cover_each_other() {
        let mut placer = Placer::new(Area(0.0, 0.0, 400.0, 300.0));
        let at = (200.0, 150.0);
        placer.point(at);
        let before = placer.hard.len();
        for _ in 0..12 {
            placer.place(at, "without contexts");
        }
        let words = &placer.hard[before..];
        for (place, a) in words.iter().enumerate() {
            assert!(placer.bounds.holds(a));
            assert!(words[place + 1..].iter().all(|b| !a.meets(b)), "{words:?}");
        }
    }

    #[test]
    fn words_among_many_points_cover_points_and_not_each_other() {
        let mut placer = Placer::new(Area(0.0, 0.0, 600.0, 400.0));
        for place in 0..1500 {
            placer.point((f64::from(place % 50) * 12.0, f64::from(place / 50) * 13.4));
        }
        let before = placer.hard.len();
        for place in 0..8 {
            placer.place((300.0 + f64::from(place), 200.0), "balanced, 5 iterations");
        }
        let words = &placer.hard[before..];
        for (place, a) in words.iter().enumerate() {
            assert!(words[place + 1..].iter().all(|b| !a.meets(b)), "{words:?}");
        }
    }

    #[test]
    fn a_word_at_the_edge_stays_inside() {
        let mut placer = Placer::new(Area(0.0, 0.0, 100.0, 100.0));
        let placed = placer.place((95.0, 50.0), "edge");
        assert!(placed.start.0 < 80.0 && placed.leader.is_none(), "{placed:?}");
    }
}
