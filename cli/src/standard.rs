//! The names that stand for standard input and standard output.

use std::path::Path;

/// The name that stands for standard input and standard output.
pub(crate) const STANDARD: &str = "-";

/// Whether a path stands for standard input or output. A file of that name is `./-`.
pub(crate) fn is_standard(path: &Path) -> bool {
    path == Path::new(STANDARD) || ["/dev/stdout", "/dev/fd/1"].iter().any(|name| path == Path::new(name))
}
