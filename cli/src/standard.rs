//! The names that stand for standard input and standard output.

use std::fs::Metadata;
use std::path::Path;

/// The name that stands for standard input and standard output.
pub(crate) const STANDARD: &str = "-";

/// Whether a path stands for standard input or output. A file of that name is `./-`.
pub(crate) fn is_standard(path: &Path) -> bool {
    path == Path::new(STANDARD) || ["/dev/stdout", "/dev/fd/1"].iter().any(|name| path == Path::new(name))
}

/// What standard input comes from, as where a shell reads it from a file.
#[cfg(unix)]
pub(crate) fn behind_input() -> Option<Metadata> {
    behind(&std::io::stdin())
}

/// Where standard output goes, as where a shell writes it to a file.
#[cfg(unix)]
pub(crate) fn behind_output() -> Option<Metadata> {
    behind(&std::io::stdout())
}

#[cfg(unix)]
fn behind(stream: &impl std::os::fd::AsFd) -> Option<Metadata> {
    let file = stream.as_fd().try_clone_to_owned().map(std::fs::File::from);
    file.and_then(|file| file.metadata()).ok()
}

/// Which file it is says nothing there that could be compared.
#[cfg(not(unix))]
pub(crate) const fn behind_input() -> Option<Metadata> {
    None
}

#[cfg(not(unix))]
pub(crate) const fn behind_output() -> Option<Metadata> {
    None
}
