//! Clauses 8.1 and 8.5: which planes a refinement unit codes, in which order, and which contexts each may use.

use super::model::{PlaneModel, Source};
use super::token::Alphabet;
use crate::syntax::{RefinementHeader, ShMode};
use crate::{Error, ErrorKind, Result};

/// What a coded plane belongs to, in coding order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Attribute {
    /// Morton deltas, one plane.
    Position,
    /// Largest log-scale and two differences, three planes.
    LogScale,
    /// One plane.
    Opacity,
    /// Quaternion x, y, z: three planes.
    Rotation,
    /// One plane a component of the dc transform.
    Dc,
    /// One plane a component of the sh transform, or a stage of vector quantisation.
    Sh,
}

impl Attribute {
    /// Every attribute in coding order.
    pub const ALL: [Self; 6] =
        [Self::Position, Self::LogScale, Self::Opacity, Self::Rotation, Self::Dc, Self::Sh];

    /// The name used in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Position => "position",
            Self::LogScale => "log_scale",
            Self::Opacity => "opacity",
            Self::Rotation => "rotation",
            Self::Dc => "dc",
            Self::Sh => "sh",
        }
    }
}

/// How the SH coefficients of a unit are coded (elements sh_mode and vq_stage_count).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ShCoding {
    /// Not at all: every coefficient is 0.
    None,
    /// The components of the transform, one plane each.
    Coefficients {
        /// Components of the sh transform.
        rank: u8,
    },
    /// Codebook entries in the transform's domain, added up over the stages.
    VectorQuantised {
        /// How many codebooks are added.
        stages: u8,
    },
}

impl ShCoding {
    /// What a refinement header says, for an sh transform of `rank` components.
    pub fn of(header: &RefinementHeader, rank: u8) -> Self {
        match header.mode() {
            Some(ShMode::Coefficients) => Self::Coefficients { rank },
            Some(ShMode::VectorQuantised) => Self::VectorQuantised { stages: header.vq_stage_count },
            _ => Self::None,
        }
    }
}

/// One coded plane.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PlaneInfo {
    /// What the plane belongs to.
    pub attribute: Attribute,
    /// Its place among the planes of the attribute.
    pub place: u8,
    /// What its values may be.
    pub alphabet: Alphabet,
}

/// The coded planes of a refinement unit, in order; the first is the position.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Layout {
    planes: Vec<PlaneInfo>,
}

impl Layout {
    /// The planes for a dc transform of `dc_rank` components and the given SH coding.
    pub fn new(dc_rank: u8, sh: ShCoding) -> Self {
        let mut planes =
            vec![PlaneInfo { attribute: Attribute::Position, place: 0, alphabet: Alphabet::Position }];
        let mut add = |attribute, count, alphabet| {
            planes.extend((0..count).map(|place| PlaneInfo { attribute, place, alphabet }));
        };
        add(Attribute::LogScale, 3, Alphabet::Attribute);
        add(Attribute::Opacity, 1, Alphabet::Attribute);
        add(Attribute::Rotation, 3, Alphabet::Attribute);
        add(Attribute::Dc, dc_rank, Alphabet::Attribute);
        match sh {
            ShCoding::None => {}
            ShCoding::Coefficients { rank } => add(Attribute::Sh, rank, Alphabet::Attribute),
            ShCoding::VectorQuantised { stages } => add(Attribute::Sh, stages, Alphabet::Index),
        }
        Self { planes }
    }

    /// The planes in coding order.
    pub fn planes(&self) -> &[PlaneInfo] {
        &self.planes
    }

    /// What the values of each plane may be.
    pub fn alphabets(&self) -> Vec<Alphabet> {
        self.planes.iter().map(|plane| plane.alphabet).collect()
    }

    /// For each plane the model of the same plane in the unit before, if there is one (6.12).
    pub fn reusable<'m>(&self, before: Option<(&Self, &'m [PlaneModel])>) -> Vec<Option<&'m PlaneModel>> {
        let find = |plane: &PlaneInfo| {
            let (layout, models) = before?;
            let place = layout.planes.iter().position(|known| known == plane)?;
            models.get(place)
        };
        self.planes.iter().map(find).collect()
    }

    /// Checks that every model uses only sources that its plane may use.
    ///
    /// # Errors
    /// Invalid by clause 6.12 otherwise; `at` is the offset of the model section.
    pub fn check(&self, models: &[PlaneModel], at: u64) -> Result<()> {
        for (plane, model) in self.planes.iter().zip(models) {
            for axis in &model.axes {
                if !is_available(*plane, axis.source) {
                    let rule = "a context source is used before its values are decoded";
                    return Err(Error::new(at, "6.12", ErrorKind::Constraint { rule }));
                }
            }
        }
        Ok(())
    }
}

/// The availability column of the table of clause 8.5.
pub fn is_available(plane: PlaneInfo, source: Source) -> bool {
    use Attribute::{LogScale, Opacity, Position, Rotation};
    let PlaneInfo { attribute, place, alphabet } = plane;
    if attribute == Position {
        return matches!(source, Source::None | Source::NeighbourSum);
    }
    match source {
        Source::None | Source::PositionSpacing => true,
        Source::NeighbourSum | Source::NeighbourMagnitude => alphabet == Alphabet::Attribute,
        Source::PreviousPlane => attribute != LogScale && alphabet == Alphabet::Attribute || place > 0,
        Source::GroupMagnitude => place > 0,
        Source::LargestLogScale => attribute != LogScale || place > 0,
        Source::MiddleLogScale => attribute != LogScale || place > 1,
        Source::LogVolume | Source::Anisotropy => attribute >= Opacity,
        Source::Opacity => attribute >= Rotation,
    }
}
