//! Sets of pieces of a GOP.

/// How many refinements of each Representation are meant: a set of pieces, of which each Representation has a prefix.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Levels(Vec<u8>);

impl Levels {
    /// A set without pieces, of so many Representations.
    pub fn none(representations: usize) -> Self {
        Self(vec![0; representations])
    }

    /// A set of all pieces that there can be.
    pub fn all(representations: usize) -> Self {
        Self(vec![u8::MAX; representations])
    }

    /// How many refinements of a Representation are in the set.
    pub fn of(&self, representation: usize) -> u8 {
        self.0.get(representation).copied().unwrap_or(0)
    }

    /// Whether all pieces of another set are in this one.
    pub fn contains(&self, other: &Self) -> bool {
        other.0.iter().enumerate().all(|(index, &count)| count <= self.of(index))
    }

    /// Whether there are no pieces in the set.
    pub fn is_empty(&self) -> bool {
        self.0.iter().all(|&count| count == 0)
    }

    /// Adds refinements of a Representation, up to a count.
    pub fn raise(&mut self, representation: usize, count: u8) {
        if let Some(own) = self.0.get_mut(representation) {
            *own = (*own).max(count);
        }
    }

    /// Removes the refinements of a Representation from a count on.
    pub fn lower(&mut self, representation: usize, count: u8) {
        if let Some(own) = self.0.get_mut(representation) {
            *own = (*own).min(count);
        }
    }

    /// The pieces that are in both sets.
    pub fn intersection(&self, other: &Self) -> Self {
        Self(self.0.iter().enumerate().map(|(index, &count)| count.min(other.of(index))).collect())
    }

    /// The pieces of both sets.
    pub fn union(&self, other: &Self) -> Self {
        Self(self.0.iter().enumerate().map(|(index, &count)| count.max(other.of(index))).collect())
    }
}
