//! What `encode -o` names: a stream, or a web page that plays it.

use crate::failure::Failure;
use crate::output_file::{OutputFile, check_stream_name};
use crate::view::name_of;
use splatstream_web::page_with;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// A stream that is being written.
pub(super) struct Output {
    file: OutputFile,
    page: Option<Page>,
}

/// The page that the stream goes into, once it is whole.
struct Page {
    title: String,
    stream: Vec<u8>,
}

impl Output {
    /// A stream, or a page for names that end in `.html`; not in the place of `inputs`. Without a title the page has the name
    /// of its file.
    pub(super) fn create(path: &Path, inputs: &[PathBuf], title: Option<&str>) -> Result<Self, Failure> {
        let file = OutputFile::create(path, inputs)?;
        let title = title.map_or_else(|| name_of(path), str::to_owned);
        let page = is_page(path).then(|| Page { title, stream: Vec::new() });
        Ok(Self { file, page })
    }

    /// Gives the file its name; the bytes of the page, if it is one.
    pub(super) fn finish(self) -> Result<Option<u64>, Failure> {
        let page = self.page.map(|page| page_with(&page.title, &page.stream));
        self.file.finish_with(page.as_deref().unwrap_or_default().as_bytes())?;
        Ok(page.map(|page| page.len() as u64))
    }
}

impl Write for Output {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match &mut self.page {
            None => self.file.write(bytes),
            Some(page) => page.stream.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

/// Refuses names that promise neither a stream nor a page.
pub(super) fn check_name(path: &Path) -> Result<(), Failure> {
    if is_page(path) { Ok(()) } else { check_stream_name(path) }
}

/// Whether a name promises a web page.
pub(super) fn is_page(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("html"))
}
