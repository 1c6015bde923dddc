//! How far a measurement has come.

/// Somebody who shows how far a measurement has come. Steps take about the same time.
pub trait Progress {
    /// The step that is under way.
    fn step(&self, name: String);

    /// A step is done.
    fn advance(&self);
}
