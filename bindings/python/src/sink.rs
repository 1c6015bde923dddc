//! Where the bytes of a stream go.

use crate::errors::os_error;
use crate::file_object::FileObject;
use pyo3::prelude::*;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::mem;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

/// Bytes that are written to a file at once.
const CHUNK: usize = 1 << 18;

/// Memory, a file, or an object of Python with `write`, which gets each unit when it is ready.
pub(crate) enum Sink {
    Memory(Written),
    File(BufWriter<File>),
    Object(FileObject),
}

/// What has been written to memory.
#[derive(Clone, Default)]
pub(crate) struct Written(Arc<Mutex<Vec<u8>>>);

impl Written {
    /// The bytes, which are no longer here then.
    pub(crate) fn take(&self) -> Vec<u8> {
        mem::take(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl Sink {
    /// The sink that Python names: nothing for memory, a path of a new file, or an object with `write`; and what is
    /// written, if that is memory.
    pub(crate) fn of(out: Option<&Bound<'_, PyAny>>) -> PyResult<(Self, Option<Written>)> {
        let Some(out) = out else {
            let written = Written::default();
            return Ok((Self::Memory(written.clone()), Some(written)));
        };
        if out.hasattr("write")? {
            return Ok((Self::Object(FileObject::new(out)), None));
        }
        let path: PathBuf = out.extract()?;
        let file = File::create_new(&path).map_err(|error| os_error(error, Some(&path)))?;
        Ok((Self::File(BufWriter::with_capacity(CHUNK, file)), None))
    }
}

impl Write for Sink {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match self {
            Self::Memory(written) => {
                written.0.lock().unwrap_or_else(PoisonError::into_inner).extend_from_slice(bytes);
                Ok(bytes.len())
            }
            Self::File(file) => file.write(bytes),
            Self::Object(object) => object.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match self {
            Self::Memory(_) => Ok(()),
            Self::File(file) => file.flush(),
            Self::Object(object) => object.flush(),
        }
    }
}
