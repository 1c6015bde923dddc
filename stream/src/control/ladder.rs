//! What a player knows of a presentation: per GOP the pieces it can fetch, and what they are worth together.

use std::fmt;

use super::levels::Levels;
use super::number::{real, size};

/// What a Representation carries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layer {
    /// Spatial layer of the I frames, from 0.
    Spatial(u8),
    /// Temporal layer of the frames between them: 0 for P frames, from 1 for temporal-enhancement (B) frames.
    Temporal(u8),
}

/// One file of a presentation: a layer of all GOPs, whose refinements are prefixes of one byte range per GOP. Where P and B
/// frames need complete I frames (`whole_anchor`), the Representations of I frames have one refinement.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Representation {
    /// What it carries.
    pub layer: Layer,
    /// Indices of the Representations that it is predicted from or that it adds to; all are smaller than its own. A
    /// refinement needs the same refinement of these, or their last one.
    pub needs: Vec<usize>,
}

/// What one refinement of one Representation adds to a GOP.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Piece {
    /// Length.
    pub bytes: u64,
    /// Gaussians that it adds to a frame, at most.
    pub gaussians: u64,
}

/// Name of an operating point: which layers are played, and up to which refinement.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct OperatingPoint {
    /// Highest spatial layer.
    pub spatial: u8,
    /// Highest temporal layer; none if only the I frame is played, which stands still for the whole GOP.
    pub temporal: Option<u8>,
    /// Highest refinement.
    pub refinement: u8,
}

impl fmt::Display for OperatingPoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.temporal {
            Some(temporal) => write!(f, "s{},t{temporal},r{}", self.spatial, self.refinement),
            None => write!(f, "s{},i,r{}", self.spatial, self.refinement),
        }
    }
}

/// What can be played of a GOP if certain pieces are there.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// Its name.
    pub name: OperatingPoint,
    /// The pieces it needs.
    pub levels: Levels,
    /// Bytes of all of these.
    pub bytes: u64,
    /// Gaussians of a frame, at most.
    pub gaussians: u64,
    /// Frames that are decoded.
    pub frames: u32,
    /// Quality of the whole GOP in dB; higher is better.
    pub quality: f64,
}

/// One GOP, as the packager describes it.
#[derive(Clone, Debug, PartialEq)]
pub struct Description {
    /// Duration in microseconds, above 0.
    pub duration_us: u64,
    /// Per Representation the number of frames it adds; the first of an I frame has 1, what adds to it 0.
    pub frames: Vec<u32>,
    /// Per Representation its refinements, from 1 to 16; none where the GOP has nothing for one that is not the base.
    pub pieces: Vec<Vec<Piece>>,
    /// Quality in dB of operating points, as displayed over the whole GOP: frames that are not there count as the one
    /// before, standing still. If a point is missing, all get estimates, which are only good for comparing points of one GOP.
    pub quality: Vec<(OperatingPoint, f64)>,
}

/// One GOP of a [`Ladder`].
#[derive(Clone, Debug, PartialEq)]
pub struct Gop {
    duration_us: u64,
    pieces: Vec<Vec<Piece>>,
    points: Vec<Point>,
}

impl Gop {
    /// Duration in microseconds.
    pub fn duration_us(&self) -> u64 {
        self.duration_us
    }

    /// Number of Representations.
    pub fn representations(&self) -> usize {
        self.pieces.len()
    }

    /// Refinements of a Representation.
    pub fn pieces(&self, representation: usize) -> &[Piece] {
        self.pieces.get(representation).map_or(&[], Vec::as_slice)
    }

    /// What can be played, from fewest to most bytes; the first is the base, which all others contain.
    pub fn points(&self) -> &[Point] {
        &self.points
    }

    /// The best point all of whose pieces are in a set.
    pub fn playable(&self, arrived: &Levels) -> Option<&Point> {
        let there = self.points.iter().filter(|point| arrived.contains(&point.levels));
        there.max_by(|a, b| a.quality.total_cmp(&b.quality))
    }

    /// Bytes of the pieces of one set that are not in another.
    pub fn missing_bytes(&self, wanted: &Levels, arrived: &Levels) -> u64 {
        let of = |(index, pieces): (usize, &Vec<Piece>)| {
            let missing = usize::from(arrived.of(index))..usize::from(wanted.of(index));
            pieces
                .get(missing)
                .unwrap_or_default()
                .iter()
                .map(|piece| piece.bytes)
                .fold(0, u64::saturating_add)
        };
        self.pieces.iter().enumerate().map(of).fold(0, u64::saturating_add)
    }
}

/// Why a description is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum LadderError {
    /// The first Representation is not spatial layer 0 without dependencies, or another one needs none, itself, or one
    /// that comes after it.
    Dependencies,
    /// A GOP lists fewer or more Representations than there are, a base without refinements, or one with over 16.
    Pieces,
    /// A GOP has no duration, or a quality is not a number.
    Values,
}

impl fmt::Display for LadderError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Dependencies => {
                "a Representation other than the base must need earlier ones, and the base none"
            }
            Self::Pieces => "a GOP must list all Representations, with 1 to 16 refinements of the base and up to 16 of the others",
            Self::Values => "a GOP must have a duration, and its qualities must be numbers",
        })
    }
}

impl std::error::Error for LadderError {}

/// A presentation as a player sees it: Representations, and GOPs in the order they are played, of which more may follow.
///
/// ```
/// use splatstream_stream::control::{Description, Ladder, Layer, OperatingPoint, Piece, Representation};
///
/// // I frames with two refinements, and P frames that need the same refinement of them.
/// let mut ladder = Ladder::new(vec![
///     Representation { layer: Layer::Spatial(0), needs: vec![] },
///     Representation { layer: Layer::Temporal(0), needs: vec![0] },
/// ])?;
/// ladder.push(Description {
///     duration_us: 500_000,
///     frames: vec![1, 14],
///     pieces: vec![
///         vec![Piece { bytes: 40_000, gaussians: 5_000 }, Piece { bytes: 300_000, gaussians: 51_000 }],
///         vec![Piece { bytes: 90_000, gaussians: 5_000 }, Piece { bytes: 800_000, gaussians: 51_000 }],
///     ],
///     quality: vec![],
/// })?;
/// let points: Vec<String> = ladder.gops()[0].points().iter().map(|point| format!("{} {}", point.name, point.bytes)).collect();
/// assert_eq!(points, ["s0,i,r0 40000", "s0,t0,r0 130000", "s0,i,r1 340000", "s0,t0,r1 1230000"]);
/// # Ok::<(), splatstream_stream::control::LadderError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Ladder {
    representations: Vec<Representation>,
    gops: Vec<Gop>,
}

impl Ladder {
    /// A presentation without GOPs.
    ///
    /// # Errors
    ///
    /// [`LadderError::Dependencies`]
    pub fn new(representations: Vec<Representation>) -> Result<Self, LadderError> {
        let orderly = representations.iter().enumerate().all(|(index, representation)| {
            let base = representation.layer == Layer::Spatial(0) && representation.needs.is_empty();
            let above =
                !representation.needs.is_empty() && representation.needs.iter().all(|&need| need < index);
            if index == 0 { base } else { above }
        });
        if representations.is_empty() || !orderly {
            return Err(LadderError::Dependencies);
        }
        Ok(Self { representations, gops: Vec::new() })
    }

    /// Appends a GOP.
    ///
    /// # Errors
    ///
    /// [`LadderError::Pieces`] and [`LadderError::Values`]
    pub fn push(&mut self, description: Description) -> Result<(), LadderError> {
        let count = self.representations.len();
        let counted = description.pieces.len() == count && description.frames.len() == count;
        let has_base = description.pieces.first().is_some_and(|base| !base.is_empty());
        if !counted || !has_base || description.pieces.iter().any(|pieces| pieces.len() > 16) {
            return Err(LadderError::Pieces);
        }
        if description.duration_us == 0 || description.quality.iter().any(|(_, quality)| !quality.is_finite())
        {
            return Err(LadderError::Values);
        }
        let points = self.points(&description);
        self.gops.push(Gop { duration_us: description.duration_us, pieces: description.pieces, points });
        Ok(())
    }

    /// Its Representations.
    pub fn representations(&self) -> &[Representation] {
        &self.representations
    }

    /// Its GOPs so far.
    pub fn gops(&self) -> &[Gop] {
        &self.gops
    }

    /// Duration of all GOPs in microseconds.
    pub fn duration_us(&self) -> u64 {
        self.gops.iter().map(Gop::duration_us).fold(0, u64::saturating_add)
    }

    /// All operating points of a GOP whose pieces differ, each under its lowest name. They are as many as what the GOP has can
    /// make, and the same pieces are found in a sorted list: a manifest of many GOPs costs no more than it says of them.
    fn points(&self, gop: &Description) -> Vec<Point> {
        let mut points: Vec<Point> = Vec::new();
        let mut known: Vec<Levels> = Vec::new();
        for name in self.names(gop) {
            let Some(levels) = self.levels(name, gop) else { continue };
            if let Err(place) = known.binary_search(&levels) {
                known.insert(place, levels.clone());
                points.push(point(name, levels, gop));
            }
        }
        points.shrink_to_fit();
        estimate(&mut points, &gop.quality);
        points.sort_by(|a, b| a.bytes.cmp(&b.bytes).then(a.name.cmp(&b.name)));
        points
    }

    /// Names of all combinations of refinements and of layers of which the GOP has something.
    fn names(&self, gop: &Description) -> Vec<OperatingPoint> {
        let mut spatial = Vec::new();
        let mut temporal = vec![None];
        let there = self.representations.iter().zip(&gop.pieces).filter(|(_, pieces)| !pieces.is_empty());
        for (representation, _) in there {
            match representation.layer {
                Layer::Spatial(layer) => spatial.push(layer),
                Layer::Temporal(layer) => temporal.push(Some(layer)),
            }
        }
        let refinements =
            gop.pieces.iter().map(Vec::len).max().and_then(|most| u8::try_from(most).ok()).unwrap_or(1);
        let mut names = Vec::new();
        for refinement in 0..refinements {
            for &spatial in &spatial {
                names.extend(temporal.iter().map(|&temporal| OperatingPoint {
                    spatial,
                    temporal,
                    refinement,
                }));
            }
        }
        names
    }

    /// The pieces of an operating point; none if it lacks what one of its temporal layers needs. Of what a GOP has nothing of,
    /// nothing is lacking.
    fn levels(&self, name: OperatingPoint, gop: &Description) -> Option<Levels> {
        let mut levels = Levels::none(self.representations.len());
        let has = |need: usize| gop.pieces.get(need).is_some_and(|pieces| !pieces.is_empty());
        for (index, (representation, pieces)) in self.representations.iter().zip(&gop.pieces).enumerate() {
            let wanted = match representation.layer {
                Layer::Spatial(layer) => layer <= name.spatial,
                Layer::Temporal(layer) => Some(layer) <= name.temporal,
            };
            let wanted = wanted && !pieces.is_empty();
            if wanted && representation.needs.iter().any(|&need| has(need) && levels.of(need) == 0) {
                return None;
            }
            if wanted {
                let own = u8::try_from(pieces.len()).unwrap_or(u8::MAX);
                levels.raise(index, name.refinement.saturating_add(1).min(own));
            }
        }
        Some(levels)
    }
}

/// What an operating point costs; its quality is found later.
fn point(name: OperatingPoint, levels: Levels, gop: &Description) -> Point {
    let mut point = Point { name, levels, bytes: 0, gaussians: 0, frames: 0, quality: f64::NAN };
    for (index, (pieces, &frames)) in gop.pieces.iter().zip(&gop.frames).enumerate() {
        let own = pieces.get(..usize::from(point.levels.of(index))).unwrap_or_default();
        point.bytes = own.iter().fold(point.bytes, |sum, piece| sum.saturating_add(piece.bytes));
        // Only the I frame is a sum of layers: other frames replace one another.
        let gaussians = own.iter().fold(0_u64, |sum, piece| sum.saturating_add(piece.gaussians));
        let layered = frames == 0 || index == 0;
        point.gaussians =
            if layered { point.gaussians.saturating_add(gaussians) } else { point.gaussians.max(gaussians) };
        if !own.is_empty() {
            point.frames = point.frames.saturating_add(frames);
        }
    }
    point
}

/// A GOP, or all of them, a point and its quality.
pub(crate) type QualityRow = (Option<u32>, OperatingPoint, f64);

/// Rows by GOP and point, of each the first. Sorted once, they are found in any number without looking at all of them.
pub(crate) fn first_of_each(mut rows: Vec<QualityRow>) -> Vec<QualityRow> {
    rows.sort_by_key(|row| (row.0, row.1));
    rows.dedup_by_key(|row| (row.0, row.1));
    rows
}

/// The quality of a point in rows of one GOP, sorted by point.
pub(crate) fn quality_of(rows: &[QualityRow], name: OperatingPoint) -> Option<f64> {
    let place = rows.binary_search_by(|row| row.1.cmp(&name)).ok()?;
    rows.get(place).map(|row| row.2)
}

/// Gives points their quality: from the table or, if that lacks one of them, 6 dB per factor of ten in bytes below 36 dB, less
/// up to 6 dB for frames that stand still.
fn estimate(points: &mut [Point], table: &[(OperatingPoint, f64)]) {
    let by_name = first_of_each(table.iter().map(|&(name, quality)| (None, name, quality)).collect());
    let known = |point: &Point| quality_of(&by_name, point.name);
    let complete = points.iter().all(|point| known(point).is_some());
    let most = real(points.iter().map(|point| point.bytes).max().unwrap_or(1).max(1));
    let all = f64::from(points.iter().map(|point| point.frames).max().unwrap_or(1).max(1));
    for point in points {
        let share = real(point.bytes.max(1)) / most;
        let guess = 36.0 + 6.0 * libm::log10(share) - 6.0 * (1.0 - f64::from(point.frames) / all);
        point.quality = known(point).filter(|_| complete).unwrap_or(guess);
    }
}

/// The quality of the best and of the least point, means over all GOPs; 0 without GOPs.
pub(crate) fn quality_range(gops: &[Gop]) -> (f64, f64) {
    let mean = |of: fn(&Gop) -> f64| gops.iter().map(of).sum::<f64>() / real(size(gops.len()).max(1));
    let least = |gop: &Gop| gop.points.first().map_or(0.0, |point| point.quality);
    let most = |gop: &Gop| gop.points.iter().map(|point| point.quality).fold(f64::NEG_INFINITY, f64::max);
    (mean(least), mean(most))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn representation(layer: Layer, needs: &[usize]) -> Representation {
        Representation { layer, needs: needs.to_vec() }
    }

    #[test]
    fn representations_must_be_in_order() {
        let base = || representation(Layer::Spatial(0), &[]);
        let refused = [
            vec![],
            vec![representation(Layer::Temporal(0), &[])],
            vec![base(), representation(Layer::Temporal(0), &[])],
            vec![base(), representation(Layer::Temporal(0), &[1])],
            vec![
                base(),
                representation(Layer::Temporal(0), &[0, 2]),
                representation(Layer::Spatial(1), &[0]),
            ],
        ];
        for representations in refused {
            assert_eq!(Ladder::new(representations), Err(LadderError::Dependencies));
        }
    }

    #[test]
    fn incomplete_descriptions_are_refused() {
        let piece = Piece { bytes: 1, gaussians: 1 };
        let mut ladder = Ladder::new(vec![representation(Layer::Spatial(0), &[])]).expect("it is the base");
        let good =
            Description { duration_us: 1, frames: vec![1], pieces: vec![vec![piece]], quality: vec![] };
        let name = OperatingPoint { spatial: 0, temporal: None, refinement: 0 };
        let refused = [
            (Description { frames: vec![], ..good.clone() }, LadderError::Pieces),
            (Description { pieces: vec![vec![]], ..good.clone() }, LadderError::Pieces),
            (Description { pieces: vec![vec![piece; 17]], ..good.clone() }, LadderError::Pieces),
            (Description { duration_us: 0, ..good.clone() }, LadderError::Values),
            (Description { quality: vec![(name, f64::NAN)], ..good.clone() }, LadderError::Values),
        ];
        for (description, error) in refused {
            assert_eq!(ladder.push(description), Err(error));
        }
        assert_eq!((ladder.push(good), ladder.gops().len()), (Ok(()), 1));
    }

    #[test]
    fn a_gop_has_no_points_for_layers_that_it_has_nothing_of() {
        let representations = vec![
            representation(Layer::Spatial(0), &[]),
            representation(Layer::Spatial(1), &[0]),
            representation(Layer::Temporal(0), &[0, 1]),
            representation(Layer::Temporal(1), &[0, 1, 2]),
        ];
        let mut ladder = Ladder::new(representations).expect("they are in order");
        let piece = |bytes| Piece { bytes, gaussians: bytes };
        let both = vec![piece(1), piece(2)];
        let gops = [
            (vec![vec![piece(0)], vec![], vec![], vec![]], vec!["s0,i,r0"]),
            // The enhancement plays without the frames below it, which are not there.
            (vec![both.clone(), vec![], vec![], both], vec!["s0,i,r0", "s0,t1,r0", "s0,i,r1", "s0,t1,r1"]),
        ];
        for (pieces, expected) in gops {
            let description =
                Description { duration_us: 1, frames: vec![1, 0, 0, 3], pieces, quality: vec![] };
            ladder.push(description).expect("the base is there");
            let gop = ladder.gops().last().expect("it was appended");
            let names: Vec<String> = gop.points().iter().map(|point| point.name.to_string()).collect();
            assert_eq!(names, expected);
            assert_eq!(gop.points[0].levels.of(1), 0);
        }
    }

    #[test]
    fn points_are_those_whose_dependencies_are_met() {
        // P frames need both spatial layers, whose I frames have no refinements.
        let representations = vec![
            representation(Layer::Spatial(0), &[]),
            representation(Layer::Spatial(1), &[0]),
            representation(Layer::Temporal(0), &[0, 1]),
        ];
        let mut ladder = Ladder::new(representations).expect("they are in order");
        let piece = |bytes| Piece { bytes, gaussians: bytes };
        let pieces = vec![vec![piece(10)], vec![piece(5)], vec![piece(2), piece(20)]];
        let frames = vec![1, 0, 3];
        ladder.push(Description { duration_us: 1, frames, pieces, quality: vec![] }).expect("it is complete");
        let points = ladder.gops()[0].points().iter();
        let points: Vec<_> = points
            .map(|point| (point.name.to_string(), point.bytes, point.gaussians, point.frames))
            .collect();
        let expected = [
            ("s0,i,r0", 10, 10, 1),
            ("s1,i,r0", 15, 15, 1),
            ("s1,t0,r0", 17, 15, 4),
            ("s1,t0,r1", 37, 22, 4),
        ];
        let expected =
            expected.map(|(name, bytes, gaussians, frames)| (name.to_owned(), bytes, gaussians, frames));
        assert_eq!(points, expected);
    }
}
