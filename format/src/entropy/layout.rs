//! Clauses 8.1 and 8.5: which planes a unit codes, in which order, and which contexts each may use.

use super::model::{PlaneModel, Source};
pub use super::section::Section;
use super::token::Alphabet;
use crate::syntax::{NO_CODEBOOK, ShHeader, ShMode};
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
    /// Morton deltas of the cells that a frame moves, one plane.
    Cell,
    /// Whether what a cell carries is out of date, one plane.
    Stale,
    /// Translation of a cell: three planes.
    Translation,
    /// Rotation of a cell: three planes.
    CellRotation,
    /// What becomes of a parent, one plane.
    Mode,
    /// Position residual of a parent: three planes.
    Move,
    /// Predictor of a run of new Gaussians, one plane.
    Predictor,
    /// Predictor of a run of moves, one plane.
    MovePredictor,
}

impl Attribute {
    /// Every attribute: those of a Gaussian in coding order, then what increments code besides.
    pub const ALL: [Self; 14] = [
        Self::Position,
        Self::LogScale,
        Self::Opacity,
        Self::Rotation,
        Self::Dc,
        Self::Sh,
        Self::Cell,
        Self::Stale,
        Self::Translation,
        Self::CellRotation,
        Self::Mode,
        Self::Move,
        Self::Predictor,
        Self::MovePredictor,
    ];

    /// The name used in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Position => "position",
            Self::LogScale => "log_scale",
            Self::Opacity => "opacity",
            Self::Rotation => "rotation",
            Self::Dc => "dc",
            Self::Sh => "sh",
            Self::Cell => "cell",
            Self::Stale => "stale",
            Self::Translation => "translation",
            Self::CellRotation => "cell_rotation",
            Self::Mode => "mode",
            Self::Move => "move",
            Self::Predictor => "predictor",
            Self::MovePredictor => "move_predictor",
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
    /// What a header says, for an sh transform of `rank` components.
    pub fn of(header: &ShHeader, rank: u8) -> Self {
        match header.mode() {
            Some(ShMode::Coefficients) => Self::Coefficients { rank },
            Some(ShMode::VectorQuantised) => Self::VectorQuantised { stages: header.vq_stage_count },
            _ => Self::None,
        }
    }

    /// What a header says of it, with the identifiers of the codebooks of the stages.
    pub fn header(self, codebooks: impl IntoIterator<Item = u8>) -> ShHeader {
        let (mode, vq_stage_count) = match self {
            Self::None => (ShMode::None, 0),
            Self::Coefficients { .. } => (ShMode::Coefficients, 0),
            Self::VectorQuantised { stages } => (ShMode::VectorQuantised, stages),
        };
        let mut codebook_ids = [NO_CODEBOOK; 4];
        codebook_ids.iter_mut().zip(codebooks).for_each(|(slot, id)| *slot = id);
        ShHeader { sh_mode: mode.code(), vq_stage_count, codebook_ids }
    }
}

/// One coded plane.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PlaneInfo {
    /// The section it stands in.
    pub section: Section,
    /// What the plane belongs to.
    pub attribute: Attribute,
    /// Its index among the planes of the attribute.
    pub index: u8,
    /// What its values may be.
    pub alphabet: Alphabet,
}

impl PlaneInfo {
    /// Whether the values are Morton deltas.
    pub const fn is_position(&self) -> bool {
        matches!(self.alphabet, Alphabet::Position)
    }
}

/// The coded planes of a section, in order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Layout {
    planes: Vec<PlaneInfo>,
}

impl Layout {
    /// The planes of the section `new` for a dc transform of `dc_rank` components and the given SH coding.
    pub fn new(dc_rank: u8, sh: ShCoding) -> Self {
        let mut layout = Self { planes: Vec::new() };
        layout.add(Section::New, Attribute::Position, 1, Alphabet::Position);
        layout.add_attributes(Section::New, dc_rank, sh);
        layout
    }

    /// The planes of a section.
    pub fn of_section(section: Section, dc_rank: u8, sh: ShCoding) -> Self {
        let mut layout = Self { planes: Vec::new() };
        match section {
            Section::Cells => {
                layout.add(section, Attribute::Cell, 1, Alphabet::Position);
                layout.add(section, Attribute::Stale, 1, Alphabet::Attribute);
                layout.add(section, Attribute::Translation, 3, Alphabet::Attribute);
                layout.add(section, Attribute::CellRotation, 3, Alphabet::Attribute);
            }
            Section::Modes => layout.add(section, Attribute::Mode, 1, Alphabet::Attribute),
            Section::MovePredictors => {
                layout.add(section, Attribute::MovePredictor, 1, Alphabet::Attribute);
            }
            Section::Moves => layout.add(section, Attribute::Move, 3, Alphabet::Attribute),
            Section::Updates => layout.add_attributes(section, dc_rank, sh),
            Section::Predictors => layout.add(section, Attribute::Predictor, 1, Alphabet::Attribute),
            Section::New => return Self::new(dc_rank, sh),
        }
        layout
    }

    fn add(&mut self, section: Section, attribute: Attribute, count: u8, alphabet: Alphabet) {
        self.planes.extend((0..count).map(|index| PlaneInfo { section, attribute, index, alphabet }));
    }

    fn add_attributes(&mut self, section: Section, dc_rank: u8, sh: ShCoding) {
        self.add(section, Attribute::LogScale, 3, Alphabet::Attribute);
        self.add(section, Attribute::Opacity, 1, Alphabet::Attribute);
        self.add(section, Attribute::Rotation, 3, Alphabet::Attribute);
        self.add(section, Attribute::Dc, dc_rank, Alphabet::Attribute);
        match sh {
            ShCoding::None => {}
            ShCoding::Coefficients { rank } => {
                self.add(section, Attribute::Sh, rank, Alphabet::Attribute);
            }
            ShCoding::VectorQuantised { stages } => {
                self.add(section, Attribute::Sh, stages, Alphabet::Index);
            }
        }
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
            let index = layout.planes.iter().position(|known| known == plane)?;
            models.get(index)
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
    use Attribute::{LogScale, Opacity, Rotation};
    let PlaneInfo { section, attribute, index, alphabet } = plane;
    if alphabet == Alphabet::Position {
        return matches!(source, Source::None | Source::NeighbourSum);
    }
    match source {
        Source::None => true,
        Source::NeighbourSum | Source::NeighbourMagnitude => alphabet == Alphabet::Attribute,
        Source::PreviousPlane => index > 0 || follows_signed(plane),
        Source::GroupMagnitude => index > 0,
        // What is known of a whole Gaussian, which the other sections do not code.
        _ if section != Section::New => false,
        Source::PositionSpacing => true,
        Source::LargestLogScale => attribute != LogScale || index > 0,
        Source::MiddleLogScale => attribute != LogScale || index > 1,
        Source::LogVolume | Source::Anisotropy | Source::StepExponent => attribute >= Opacity,
        Source::Opacity => attribute >= Rotation,
    }
}

/// Whether the first plane of an attribute comes after a plane of its section whose values can be a context.
fn follows_signed(plane: PlaneInfo) -> bool {
    let first = matches!(
        plane.attribute,
        Attribute::LogScale
            | Attribute::Stale
            | Attribute::Mode
            | Attribute::MovePredictor
            | Attribute::Move
            | Attribute::Predictor
    );
    !first && plane.alphabet == Alphabet::Attribute
}
