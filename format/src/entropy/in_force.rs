//! Clause 6.12: the plane models that `reuse` refers to in an increment and in the cells of a frame header.

use super::layout::{Layout, Section};
use super::model::PlaneModel;
use std::sync::Arc;

/// The planes of a section and their models.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SectionModels {
    /// The planes.
    pub layout: Layout,
    /// One model a plane.
    pub models: Vec<PlaneModel>,
}

/// For each section, the models of the last unit that had it.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ModelsInForce {
    sections: [Option<Arc<SectionModels>>; Section::COUNT],
}

impl ModelsInForce {
    /// For each plane of a section the model that `reuse` stands for, if there is one.
    pub fn reusable(&self, section: Section, layout: &Layout) -> Vec<Option<&PlaneModel>> {
        let known = self.get(section).map(|known| (&known.layout, known.models.as_slice()));
        layout.reusable(known)
    }

    /// The models of a section.
    pub fn get(&self, section: Section) -> Option<&SectionModels> {
        self.sections.get(section.index()).and_then(Option::as_deref)
    }

    /// Takes the models of a section that a unit has.
    pub fn replace(&mut self, section: Section, models: SectionModels) {
        if let Some(slot) = self.sections.get_mut(section.index()) {
            *slot = Some(Arc::new(models));
        }
    }
}

/// The models in force for the next unit of a frame, by its refinement.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ModelsOfFrame {
    /// For the cells of the frame header, and for a unit of refinement 0: of the next spatial layer, or of a frame that
    /// refers to this one. A frame starts with those of the frame it refers to; the cells of its header replace theirs.
    pub first: ModelsInForce,
    /// For a unit of a higher refinement: those after the unit before it.
    current: ModelsInForce,
}

impl ModelsOfFrame {
    /// Of a frame that has no unit yet, with `first` of the frame it refers to.
    pub fn starting_with(first: ModelsInForce) -> Self {
        Self { first, ..Self::default() }
    }

    /// Those in force for a unit.
    pub const fn before(&self, refinement: u8) -> &ModelsInForce {
        if refinement == 0 { &self.first } else { &self.current }
    }

    /// Takes those in force after a unit.
    pub fn follow(&mut self, refinement: u8, models: ModelsInForce) {
        if refinement == 0 {
            self.first = models.clone();
        }
        self.current = models;
    }
}
