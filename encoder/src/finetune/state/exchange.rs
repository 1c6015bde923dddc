//! Numbers to a file and back. What is kept names its numbers once, for both ways: a writer takes what they are, a reader puts
//! what they were in their place. Their count follows from what is encoded, so that no file can ask for memory.

use std::io::{self, Read, Write};
use xxhash_rust::xxh64::Xxh64;

/// Numbers that go through memory at once.
const RUN: usize = 1 << 10;

/// Something that is kept.
pub(in crate::finetune) trait Keep {
    /// Hands over all of its numbers, in an order that does not change.
    ///
    /// # Errors
    /// Those of the file, and numbers that cannot be: [`io::ErrorKind::InvalidData`].
    fn exchange(&mut self, with: &mut dyn Exchange) -> io::Result<()>;
}

/// One end of a file.
pub(in crate::finetune) trait Exchange {
    /// Writes the bytes, or reads others in their place.
    ///
    /// # Errors
    /// Those of the file.
    fn bytes(&mut self, bytes: &mut [u8]) -> io::Result<()>;

    /// The same of numbers.
    ///
    /// # Errors
    /// Those of the file.
    fn floats(&mut self, values: &mut [f32]) -> io::Result<()> {
        let mut bytes = Vec::with_capacity(RUN.saturating_mul(size_of::<f32>()));
        for values in values.chunks_mut(RUN) {
            bytes.clear();
            bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
            self.bytes(&mut bytes)?;
            let (found, _) = bytes.as_chunks();
            values.iter_mut().zip(found).for_each(|(value, bytes)| *value = f32::from_le_bytes(*bytes));
        }
        Ok(())
    }

    /// The same of a number.
    ///
    /// # Errors
    /// Those of the file.
    fn float(&mut self, value: &mut f64) -> io::Result<()> {
        let mut bytes = value.to_le_bytes();
        self.bytes(&mut bytes)?;
        *value = f64::from_le_bytes(bytes);
        Ok(())
    }

    /// The same of a count.
    ///
    /// # Errors
    /// Those of the file.
    fn count(&mut self, value: &mut u32) -> io::Result<()> {
        let mut bytes = value.to_le_bytes();
        self.bytes(&mut bytes)?;
        *value = u32::from_le_bytes(bytes);
        Ok(())
    }
}

/// The end that writes.
pub(super) struct Writing<'a> {
    file: &'a mut dyn Write,
    digest: Xxh64,
}

/// The end that reads.
pub(super) struct Reading<R> {
    file: R,
    digest: Xxh64,
}

impl<'a> Writing<'a> {
    pub(super) fn new(file: &'a mut dyn Write) -> Self {
        Self { file, digest: Xxh64::new(0) }
    }

    /// Ends with a digest of everything.
    pub(super) fn finish(self) -> io::Result<()> {
        self.file.write_all(&self.digest.digest().to_le_bytes())
    }
}

impl<R: Read> Reading<R> {
    pub(super) fn new(file: R) -> Self {
        Self { file, digest: Xxh64::new(0) }
    }

    /// Whether the digest of everything is there, and nothing else.
    pub(super) fn finish(mut self) -> io::Result<bool> {
        let mut bytes = [0; 8];
        self.file.read_exact(&mut bytes)?;
        let is_whole = bytes == self.digest.digest().to_le_bytes();
        Ok(is_whole && self.file.read(&mut bytes)? == 0)
    }
}

impl Exchange for Writing<'_> {
    fn bytes(&mut self, bytes: &mut [u8]) -> io::Result<()> {
        self.digest.update(bytes);
        self.file.write_all(bytes)
    }
}

impl<R: Read> Exchange for Reading<R> {
    fn bytes(&mut self, bytes: &mut [u8]) -> io::Result<()> {
        self.file.read_exact(bytes)?;
        self.digest.update(bytes);
        Ok(())
    }
}
