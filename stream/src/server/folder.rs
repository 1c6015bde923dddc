//! Files of the folder, and nothing outside it.

use std::fs::File;
use std::io;
use std::path::{Component, Path, PathBuf};
use std::time::{Duration, SystemTime};

/// A folder whose files are served.
#[derive(Debug)]
pub(super) struct Folder {
    /// Without symbolic links.
    root: PathBuf,
}

/// A file of the folder.
#[derive(Debug)]
pub(super) struct Found {
    pub(super) file: File,
    pub(super) length: u64,
    pub(super) modified: SystemTime,
    pub(super) content_type: &'static str,
    pub(super) cache_control: &'static str,
}

/// A file that was modified within this time may still be being written.
const GROWING: Duration = Duration::from_secs(10);

impl Folder {
    pub(super) fn new(root: &Path) -> io::Result<Self> {
        let root = root.canonicalize()?;
        match root.is_dir() {
            true => Ok(Self { root }),
            false => Err(io::ErrorKind::NotADirectory.into()),
        }
    }

    /// The file that a request's path names; a path that ends with a slash names its `index.html`. None where no regular
    /// file of the folder is there, or one that is hidden. Symbolic links are followed if they stay inside.
    ///
    /// Whoever can change the folder while it is served is trusted: between this look and the opening a file can become a
    /// link.
    pub(super) fn open(&self, path: &str) -> io::Result<Option<Found>> {
        let Some(path) = self.path_of(path) else { return Ok(None) };
        let Ok(path) = path.canonicalize() else { return Ok(None) };
        let is_inside = path.strip_prefix(&self.root).is_ok_and(|inside| !is_hidden(inside));
        // Opening a pipe or a device could wait, or do something.
        if !is_inside || !path.metadata().is_ok_and(|metadata| metadata.is_file()) {
            return Ok(None);
        }
        match File::open(&path) {
            Ok(file) => Found::new(file, &path).map(Some),
            Err(error) if is_absence(&error) => Ok(None),
            Err(error) => Err(error),
        }
    }

    fn path_of(&self, path: &str) -> Option<PathBuf> {
        let decoded = percent_encoding::percent_decode_str(path.strip_prefix('/')?).decode_utf8().ok()?;
        let mut path = self.root.clone();
        let (above, name) =
            decoded.rsplit_once('/').map_or((None, &*decoded), |(above, name)| (Some(above), name));
        for part in above.into_iter().flat_map(|above| above.split('/')) {
            path.push(plain(part)?);
        }
        path.push(plain(if name.is_empty() { "index.html" } else { name })?);
        Some(path)
    }
}

/// A name that is one component of a path on this system, and not hidden.
fn plain(part: &str) -> Option<&str> {
    let mut components = Path::new(part).components();
    let is_name = matches!(components.next(), Some(Component::Normal(name)) if name == part);
    (is_name && components.next().is_none() && !part.starts_with('.')).then_some(part)
}

fn is_hidden(path: &Path) -> bool {
    path.iter().any(|part| part.as_encoded_bytes().starts_with(b"."))
}

fn is_absence(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::NotFound | io::ErrorKind::PermissionDenied)
}

impl Found {
    fn new(file: File, path: &Path) -> io::Result<Self> {
        let metadata = file.metadata()?;
        let modified = metadata.modified()?;
        let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
        let age = SystemTime::now().duration_since(modified).unwrap_or_default();
        Ok(Self {
            length: metadata.len(),
            modified,
            content_type: content_type(extension),
            cache_control: cache_control(extension, age),
            file,
        })
    }
}

/// By the extension. Tracks of Gaussians are no video: what packages say of their files, `application/mp4`, is said here
/// too.
fn content_type(extension: &str) -> &'static str {
    match extension {
        "mpd" => "application/dash+xml",
        "mp4" | "m4s" => "application/mp4",
        "json" => "application/json",
        "wasm" => "application/wasm",
        "html" => "text/html; charset=utf-8",
        "js" | "mjs" => "text/javascript; charset=utf-8",
        "css" => "text/css; charset=utf-8",
        "txt" => "text/plain; charset=utf-8",
        "svg" => "image/svg+xml",
        "png" => "image/png",
        _ => "application/octet-stream",
    }
}

/// How long caches may keep a file. Media of a package never change under their names, MPDs and manifests of live packages
/// do with every GOP; of anything else a cache asks each time, and it keeps nothing that is still being written.
fn cache_control(extension: &str, age: Duration) -> &'static str {
    match extension {
        "mp4" | "m4s" => "public, max-age=31536000, immutable",
        "mpd" | "json" => "public, max-age=1",
        _ if age < GROWING => "no-store",
        _ => "no-cache",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_plain_names_become_paths() {
        let folder = Folder { root: PathBuf::from("root") };
        let path = |path: &str| folder.path_of(path);
        assert_eq!(path("/a/b%20c.mp4"), Some(PathBuf::from("root/a/b c.mp4")));
        assert_eq!(path("/"), Some(PathBuf::from("root/index.html")));
        assert_eq!(path("/a/"), Some(PathBuf::from("root/a/index.html")));
        for hostile in
            ["", "a", "//a", "/a//b", "/./a", "/a/../b", "/%2e%2e/a", "/..%2fa", "/.git/a", "/%ff", "/a/."]
        {
            assert_eq!(path(hostile), None, "{hostile}");
        }
    }

    #[test]
    fn caches_keep_what_does_not_change() {
        let (new, old) = (Duration::ZERO, Duration::from_secs(3600));
        assert_eq!(cache_control("m4s", new), cache_control("mp4", old));
        assert_eq!(cache_control("mpd", old), "public, max-age=1");
        assert_eq!((cache_control("gss", new), cache_control("gss", old)), ("no-store", "no-cache"));
    }
}
