//! What a measurement leaves: files, still in memory.

/// A file that belongs into the directory of a report.
#[derive(Debug, Clone)]
pub struct File {
    /// Its path from the directory, parts joined by `/`.
    pub name: String,
    /// Its content.
    pub bytes: Vec<u8>,
}

/// A measurement.
#[derive(Debug)]
pub struct Report<S> {
    /// Tables and figures.
    pub files: Vec<File>,
    /// Pictures that the page leads to.
    pub pictures: Vec<File>,
    /// The page, as HTML; it leads to the files by their names.
    pub page: String,
    /// What is said of it: for people as text, for programs as JSON.
    pub summary: S,
}
