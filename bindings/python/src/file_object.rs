//! Files of Python as files of Rust.

use pyo3::prelude::*;
use pyo3::types::PyBytes;
use std::io::{self, ErrorKind, Read, Seek, SeekFrom, Write};

/// An object with `read` and `seek`, or with `write`, in binary mode. Threads of Rust use it while Python runs elsewhere.
pub(crate) struct FileObject(Py<PyAny>);

impl FileObject {
    pub(crate) fn new(object: &Bound<'_, PyAny>) -> Self {
        Self(object.clone().unbind())
    }
}

/// An exception stays what it is on its way through Rust.
fn raised(error: PyErr) -> io::Error {
    io::Error::other(error)
}

fn wrong(what: impl Into<String>) -> io::Error {
    io::Error::new(ErrorKind::InvalidData, what.into())
}

impl Read for FileObject {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        Python::attach(|py| {
            let read = self.0.bind(py).call_method1("read", (buffer.len(),)).map_err(raised)?;
            // Files that do not block have nothing yet.
            if read.is_none() {
                return Err(ErrorKind::WouldBlock.into());
            }
            let bytes = read
                .cast::<PyBytes>()
                .map_err(|_| wrong("read() gave no bytes: open the file in binary mode"))?;
            let bytes = bytes.as_bytes();
            let to = buffer
                .get_mut(..bytes.len())
                .ok_or_else(|| wrong("read() gave more bytes than asked for"))?;
            to.copy_from_slice(bytes);
            Ok(bytes.len())
        })
    }
}

impl Seek for FileObject {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let (offset, whence) = match to {
            SeekFrom::Start(offset) => (i128::from(offset), 0),
            SeekFrom::Current(offset) => (i128::from(offset), 1),
            SeekFrom::End(offset) => (i128::from(offset), 2),
        };
        Python::attach(|py| {
            let at = self.0.bind(py).call_method1("seek", (offset, whence)).map_err(raised)?;
            at.extract().map_err(raised)
        })
    }
}

impl Write for FileObject {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        Python::attach(|py| {
            let written =
                self.0.bind(py).call_method1("write", (PyBytes::new(py, bytes),)).map_err(raised)?;
            // Some objects do not say.
            if written.is_none() {
                return Ok(bytes.len());
            }
            let count: Option<usize> = written.extract().ok();
            count.filter(|&count| count <= bytes.len()).ok_or_else(|| {
                let found = written.repr().map(|text| text.to_string()).unwrap_or_default();
                wrong(format!("write() returned {found} and was given {} bytes", bytes.len()))
            })
        })
    }

    fn flush(&mut self) -> io::Result<()> {
        Python::attach(|py| {
            let file = self.0.bind(py);
            if file.hasattr("flush").map_err(raised)? {
                file.call_method0("flush").map_err(raised)?;
            }
            Ok(())
        })
    }
}
