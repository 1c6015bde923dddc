//! Whether the files that are encoded as frames look like frames of one sequence.

use splatstream_gaussians::GaussianFrame;
use std::collections::BTreeMap;

/// Frames are unlike if one has more than so many times the Gaussians of the other.
const COUNT: usize = 2;

/// Or if the box of one is so many times as large as that of the other.
const EXTENT: f32 = 3.0;

/// Rows of a frame that are looked at: enough for a box to a few percent.
const ROWS: usize = 4096;

/// Part of the rows that lies beyond the box at each end of an axis, one in so many: floaters say nothing about a scene.
const BEYOND: usize = 20;

/// One in so many pairs of neighbours is unlike: these frames predict each other badly. A cut or two are not as many.
const UNLIKE: usize = 4;

/// One in so many is: these are hardly frames of one scene.
const UNRELATED: usize = 2;

/// What tells one scene from another: how many Gaussians there are, and where most of them are.
#[derive(Debug, Clone, Copy)]
struct Outline {
    gaussians: usize,
    /// The least and the greatest coordinate, axis by axis; none where no centre is finite.
    bounds: Option<[(f32, f32); 3]>,
}

impl Outline {
    fn of(frame: &GaussianFrame) -> Self {
        let [x, y, z] = frame.position().each_ref().map(|plane| bounds(plane));
        Self { gaussians: frame.len(), bounds: x.zip(y).zip(z).map(|((x, y), z)| [x, y, z]) }
    }

    /// The longest side of the box.
    fn extent(&self) -> Option<f32> {
        self.bounds.map(|bounds| bounds.iter().map(|(low, high)| high - low).fold(0.0, f32::max))
    }

    /// Whether the boxes of two frames do not touch.
    fn is_apart(&self, other: &Self) -> bool {
        self.bounds.zip(other.bounds).is_some_and(|(a, b)| {
            a.iter()
                .zip(&b)
                .any(|((low, high), (other_low, other_high))| high < other_low || other_high < low)
        })
    }

    /// Whether two frames have nothing to predict each other from: other numbers of Gaussians, other sizes, or other places.
    fn is_unlike(&self, other: &Self) -> bool {
        let differs = |a: usize, b: usize| a > b.saturating_mul(COUNT);
        let outgrows = |a: Option<f32>, b: Option<f32>| a.zip(b).is_some_and(|(a, b)| a > b * EXTENT);
        differs(self.gaussians, other.gaussians)
            || differs(other.gaussians, self.gaussians)
            || outgrows(self.extent(), other.extent())
            || outgrows(other.extent(), self.extent())
            || self.is_apart(other)
    }
}

/// Where most of the values of a plane are.
fn bounds(plane: &[f32]) -> Option<(f32, f32)> {
    let step = plane.len().div_ceil(ROWS).max(1);
    let mut values: Vec<f32> =
        plane.iter().step_by(step).copied().filter(|value| value.is_finite()).collect();
    values.sort_by(f32::total_cmp);
    let beyond = values.len() / BEYOND;
    Some((*values.get(beyond)?, *values.get(values.len().checked_sub(beyond + 1)?)?))
}

/// What a sequence of frames looks like, as far as they were read.
#[derive(Debug, Default)]
pub(crate) struct Likeness {
    outlines: BTreeMap<u32, Outline>,
}

/// How frames of what should be one sequence differ.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Unlike {
    /// The fewest and the most Gaussians of a frame.
    pub(crate) gaussians: (usize, usize),
    /// The smallest and the largest extent, where that of none is more than three times that of another.
    pub(crate) extents: Option<(f32, f32)>,
    /// Whether neighbours lie in places that do not touch.
    pub(crate) are_apart: bool,
    /// Whether they look like scenes that have nothing to do with each other.
    pub(crate) is_unrelated: bool,
}

impl Likeness {
    /// Looks at a frame; again at one that was seen takes nothing.
    pub(crate) fn add(&mut self, number: u32, frame: &GaussianFrame) {
        self.outlines.entry(number).or_insert_with(|| Outline::of(frame));
    }

    /// How the frames differ, if they are hardly frames of one sequence. Files that were `named` one by one may more easily be
    /// scenes of their own: they are unlike too where any two have very different numbers of Gaussians.
    pub(crate) fn unlike(&self, named: bool) -> Option<Unlike> {
        let outlines: Vec<Outline> = self.outlines.values().copied().collect();
        let pairs = outlines.len().saturating_sub(1);
        let neighbours = || outlines.iter().zip(outlines.iter().skip(1));
        let unlike = neighbours().filter(|(a, b)| a.is_unlike(b)).count();
        let are_apart = neighbours().any(|(a, b)| a.is_apart(b));
        let counts = outlines.iter().map(|outline| outline.gaussians);
        let gaussians = (counts.clone().min()?, counts.max()?);
        let is_named = named && gaussians.1 > gaussians.0.saturating_mul(COUNT);
        if !is_named && (unlike == 0 || unlike * UNLIKE < pairs) {
            return None;
        }
        let extents = outlines.iter().filter_map(Outline::extent);
        let least = extents.clone().min_by(f32::total_cmp);
        let extents =
            least.zip(extents.max_by(f32::total_cmp)).filter(|(least, most)| *most > least * EXTENT);
        let is_unrelated = is_named || unlike * UNRELATED >= pairs;
        Some(Unlike { gaussians, extents, are_apart, is_unrelated })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use splatstream_files::builtin::BuiltinScene;

    /// Frames of a scene, from the first on, each with a number of Gaussians.
    fn likeness(counts: &[u32]) -> Likeness {
        let mut likeness = Likeness::default();
        for (number, &gaussians) in (0..).zip(counts) {
            let scene = BuiltinScene { gaussians, frames: 1, sh_degree: 0, ..BuiltinScene::default() };
            likeness.add(number, &scene.frame(0));
        }
        likeness
    }

    #[test]
    fn a_cut_is_no_other_scene() {
        assert!(likeness(&[200, 210, 220, 230]).unlike(false).is_none());
        assert!(likeness(&[200]).unlike(true).is_none());
        assert!(Likeness::default().unlike(true).is_none());
        // Slow growth, and one cut of five.
        assert!(likeness(&[100, 160, 260, 420, 680]).unlike(false).is_none());
        assert!(likeness(&[200, 210, 700, 710, 720, 730]).unlike(false).is_none());
        // One of four, and one of two.
        let of = |counts: &[u32]| likeness(counts).unlike(false).expect("unlike").is_unrelated;
        assert_eq!([of(&[200, 210, 700, 710, 720]), of(&[200, 210, 700])], [false, true]);
        // Files that were named.
        assert!(likeness(&[100, 160, 260, 420, 680]).unlike(true).expect("unlike").is_unrelated);
    }

    #[test]
    fn extents_and_places_tell_scenes_apart() {
        let outline = |from: f32, to: f32| Outline { gaussians: 10, bounds: Some([(from, to); 3]) };
        assert!(!outline(0.0, 1.0).is_unlike(&outline(0.5, 3.0)));
        assert!(outline(0.0, 1.0).is_unlike(&outline(0.5, 4.0)));
        assert!(
            outline(0.0, 1.0).is_unlike(&outline(1.5, 2.5))
                && outline(1.5, 2.5).is_unlike(&outline(0.0, 1.0))
        );
        // A floater does not make a box, nor do values that are none.
        let mut plane: Vec<f32> = (0..100).map(|value| value as f32).collect();
        plane.extend([1e9, f32::NAN, f32::INFINITY]);
        assert_eq!(bounds(&plane), Some((5.0, 95.0)));
        assert_eq!([bounds(&[]), bounds(&[f32::NAN])], [None, None]);
    }
}
