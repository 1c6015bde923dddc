//! Clause 8.1: what the coded planes of a frame stand in.

/// The sections of a frame (5.15): that of a frame header, then those of an increment in stream order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Section {
    /// Motion of cells.
    Cells,
    /// What becomes of each parent.
    Modes,
    /// Predictors of the moves.
    MovePredictors,
    /// Position residuals of parents.
    Moves,
    /// Attribute residuals of parents.
    Updates,
    /// Predictors of the new Gaussians.
    Predictors,
    /// The new Gaussians.
    New,
}

impl Section {
    /// The sections of an increment, in stream order.
    pub const OF_INCREMENT: [Self; 6] =
        [Self::Modes, Self::MovePredictors, Self::Moves, Self::Updates, Self::Predictors, Self::New];

    /// Every section, in stream order.
    pub const ALL: [Self; Self::COUNT] = [
        Self::Cells,
        Self::Modes,
        Self::MovePredictors,
        Self::Moves,
        Self::Updates,
        Self::Predictors,
        Self::New,
    ];

    /// How many sections there are; their indices are below it.
    pub const COUNT: usize = 7;

    /// The name in the table of clause 8.1.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Cells => "cells",
            Self::Modes => "modes",
            Self::MovePredictors => "move_predictors",
            Self::Moves => "moves",
            Self::Updates => "updates",
            Self::Predictors => "predictors",
            Self::New => "new",
        }
    }

    /// The index in stream order.
    pub const fn index(self) -> usize {
        match self {
            Self::Cells => 0,
            Self::Modes => 1,
            Self::MovePredictors => 2,
            Self::Moves => 3,
            Self::Updates => 4,
            Self::Predictors => 5,
            Self::New => 6,
        }
    }
}
