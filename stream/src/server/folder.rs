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
            Ok(file) => Found::new(file, &path, may_grow(&path)).map(Some),
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

/// Whether a file of a GOP of a live package may still get frames: there is none of the next GOP, nor of the end.
fn may_grow(path: &Path) -> bool {
    let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    let parts = name.strip_suffix(".m4s").and_then(|stem| stem.rsplit_once('-'));
    let Some((id, number)) = parts.and_then(|(id, number)| Some((id, number.parse::<u64>().ok()?))) else {
        return false;
    };
    let next = format!("{id}-{}.m4s", number.saturating_add(1));
    !path.with_file_name(next).exists() && !path.with_file_name("s0-end.m4s").exists()
}

fn is_absence(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::NotFound | io::ErrorKind::PermissionDenied)
}

impl Found {
    fn new(file: File, path: &Path, may_grow: bool) -> io::Result<Self> {
        let metadata = file.metadata()?;
        let modified = metadata.modified()?;
        let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
        let age = SystemTime::now().duration_since(modified).unwrap_or_default();
        Ok(Self {
            length: metadata.len(),
            modified,
            content_type: content_type(extension),
            cache_control: cache_control(extension, age, may_grow),
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

/// How long caches may keep a file. Media of a package never change under their names, but for the last GOP of a live one,
/// which may grow. MPDs and manifests of live packages change with every GOP or frame: a cache asks each time whether they
/// have, or once a second where they rest. Of anything else it asks each time, and keeps nothing that is still being written.
fn cache_control(extension: &str, age: Duration, may_grow: bool) -> &'static str {
    match extension {
        "mp4" | "m4s" if !may_grow => "public, max-age=31536000, immutable",
        "mpd" | "json" if age >= GROWING => "public, max-age=1",
        "mp4" | "m4s" | "mpd" | "json" => "no-cache",
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
        let control = |extension, age| cache_control(extension, age, false);
        assert_eq!(control("m4s", new), control("mp4", old));
        assert_eq!((control("mpd", old), control("json", new)), ("public, max-age=1", "no-cache"));
        assert_eq!((control("gss", new), control("gss", old)), ("no-store", "no-cache"));
        assert_eq!(cache_control("m4s", old, true), "no-cache");
    }

    #[test]
    fn the_last_gop_may_grow() {
        let folder = tempfile::tempdir().expect("there is room");
        let grows = |name: &str| may_grow(&folder.path().join(name));
        let write = |name: &str| std::fs::write(folder.path().join(name), "").expect("there is room");
        ["s0-init.mp4", "s0-1.m4s", "s0-2.m4s", "t0-2.m4s"].into_iter().for_each(write);
        assert!(!grows("s0-init.mp4") && !grows("s0-1.m4s") && grows("s0-2.m4s") && grows("t0-2.m4s"));
        write("s0-end.m4s");
        assert!(!grows("s0-2.m4s") && !grows("s0-end.m4s"));
    }
}
