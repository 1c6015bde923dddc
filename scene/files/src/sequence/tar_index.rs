//! What a tar archive holds, and where.

use std::io::{Read, Seek};

use tar::{Archive, EntryType, PaxExtensions};

use crate::error::SceneError;
use crate::limits::Budget;
use crate::members::DAMAGED;

/// Names are no longer than this: what says more is no name.
const LONGEST_NAME: u64 = 64 << 10;

/// A file of a tar archive.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Member {
    pub(super) name: String,
    /// Where its content begins, and its bytes.
    pub(super) at: u64,
    pub(super) size: u64,
}

/// The regular files of an archive, in its order. Records that only say how the next file is called are read here, as much of
/// them as a name can be.
pub(super) fn members(source: impl Read + Seek, budget: &mut Budget) -> Result<Vec<Member>, SceneError> {
    let refuse = |error| SceneError::inconsistent(format!("cannot list the archive: {error}"), DAMAGED);
    let mut archive = Archive::new(source);
    let entries = archive.entries_with_seek().map_err(refuse)?.raw(true);
    let (mut members, mut given) = (Vec::new(), None);
    for entry in entries {
        let mut entry = entry.map_err(refuse)?;
        let kind = entry.header().entry_type();
        match kind {
            EntryType::GNULongName | EntryType::XHeader => {
                let text = read_name(&mut entry).map_err(refuse)?;
                let name = if kind == EntryType::XHeader { pax_path(&text) } else { Some(text) };
                given = name.or(given);
            }
            EntryType::Regular | EntryType::Continuous => {
                let name = given.take().unwrap_or_else(|| entry.path_bytes().into_owned());
                let name = String::from_utf8_lossy(&name).trim_end_matches('\0').to_owned();
                budget.take(
                    (name.len() as u64).saturating_add(size_of::<Member>() as u64).saturating_mul(2),
                    "names",
                )?;
                members.push(Member {
                    name,
                    at: entry.raw_file_position(),
                    size: entry.header().size().map_err(refuse)?,
                });
            }
            EntryType::XGlobalHeader => {}
            _ => given = None,
        }
    }
    Ok(members)
}

fn read_name(entry: &mut impl Read) -> std::io::Result<Vec<u8>> {
    let mut name = Vec::new();
    entry.take(LONGEST_NAME).read_to_end(&mut name)?;
    Ok(name)
}

/// The name that a record of the POSIX extensions gives.
fn pax_path(record: &[u8]) -> Option<Vec<u8>> {
    let mut extensions = PaxExtensions::new(record).filter_map(Result::ok);
    extensions.find(|extension| extension.key_bytes() == b"path").map(|path| path.value_bytes().to_vec())
}
