//! Files that are read as a whole, and no more of them than such a file can sensibly have: they may have no end.

use crate::failure::Failure;
use std::fs::File;
use std::io::{self, ErrorKind, Read};
use std::path::Path;

/// The most of a file that a person or a program writes as text, bytes.
const MOST_TEXT: u64 = 256 << 20;

/// The bytes of a file, which are at most `most`.
pub(crate) fn read_whole(path: &Path, most: u64) -> Result<Vec<u8>, Failure> {
    whole(path, most).map_err(|error| Failure::file("read", path, &error))
}

/// The text of a file.
pub(crate) fn read_text(path: &Path) -> Result<String, Failure> {
    let text = whole(path, MOST_TEXT).and_then(|bytes| {
        if bytes.is_empty() {
            return Err(io::Error::new(ErrorKind::InvalidData, "it is empty"));
        }
        String::from_utf8(bytes).map_err(|_| io::Error::new(ErrorKind::InvalidData, "it is not UTF-8 text"))
    });
    text.map_err(|error| Failure::file("read", path, &error))
}

fn whole(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    File::open(path)?.take(most.saturating_add(1)).read_to_end(&mut bytes)?;
    match bytes.len() as u64 > most {
        true => {
            let error = format!("it has more than {most} bytes, and no such file needs as many");
            Err(io::Error::new(ErrorKind::FileTooLarge, error))
        }
        false => Ok(bytes),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_more_than_the_most_is_read() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("file");
        std::fs::write(&path, "four").unwrap();
        assert_eq!(read_whole(&path, 4).unwrap(), b"four");
        let said = read_whole(&path, 3).unwrap_err().to_string();
        assert!(said.contains("it has more than 3 bytes"), "{said}");
        assert_eq!(read_text(&path).unwrap(), "four");
        std::fs::write(&path, []).unwrap();
        assert!(read_text(&path).unwrap_err().to_string().contains("it is empty"));
        std::fs::write(&path, [0xff]).unwrap();
        assert!(read_text(&path).unwrap_err().to_string().contains("not UTF-8"));
    }
}
