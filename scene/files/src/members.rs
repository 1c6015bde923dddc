//! The files inside archives.

use std::io::Read;
use std::path::Path;

use zip::read::ZipFile;

use crate::error::SceneError;
use crate::limits::Budget;

pub(crate) const MEMBER: &str = "a member of the archive";
pub(crate) const DAMAGED: &str = "the archive is damaged; pack it again";

/// Extensions of files that hold one scene each.
pub const EXTENSIONS: [&str; 7] = ["ply", "spz", "sog", "splat", "ksplat", "glb", "gltf"];

/// Whether the name of a member is that of a frame.
pub(crate) fn is_frame(name: &str) -> bool {
    kind(name).is_some()
}

/// Whether a member is what systems put beside files.
pub(crate) fn is_hidden(name: &str) -> bool {
    let file = Path::new(name).file_name();
    file.is_some_and(|file| file.as_encoded_bytes().starts_with(b".")) || name.starts_with("__MACOSX/")
}

/// The format that the name of a member promises; none for folders and for what systems put beside files.
pub(crate) fn kind(name: &str) -> Option<&'static str> {
    let extension = Path::new(name).extension()?.to_str()?;
    // The buffers of a .gltf would be other members.
    let known =
        EXTENSIONS.into_iter().find(|known| extension.eq_ignore_ascii_case(known) && *known != "gltf");
    known.filter(|_| !is_hidden(name) && !name.ends_with('/'))
}

/// The bytes of a member of a ZIP archive, as many as it says.
pub(crate) fn read_member<R: Read>(
    mut member: ZipFile<'_, R>,
    budget: &mut Budget,
) -> Result<Vec<u8>, SceneError> {
    let refuse = |what: String| SceneError::inconsistent(what, DAMAGED);
    let name = member.name().map_or_else(|_| MEMBER.to_owned(), |name| name.escape_default().to_string());
    let size = member.size();
    let mut content = budget.room(size, MEMBER)?;
    let read = (&mut member).take(size).read_to_end(&mut content);
    // The checksum is compared when the member ends.
    let over = read.and_then(|_| member.read(&mut [0]));
    if over.map_err(|error| refuse(format!("{name}: {error}")))? > 0 || (content.len() as u64) < size {
        return Err(refuse(format!("{name} is not as long as the archive says, {size} bytes")));
    }
    Ok(content)
}
