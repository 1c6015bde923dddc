//! The settings that the frames in a directory were made with, in a hidden file beside them. A run that keeps frames of an earlier
//! one must have the same: otherwise the frames of one sequence would be made in two ways, and nothing would say so.

use crate::failure::Failure;
use crate::output_directory::OutputDirectory;
use crate::output_file::OutputFile;
use crate::unfinished::files_below;
use crate::whole_file::read_text;
use serde::Serialize;
use serde_json::{Map, Value};
use std::path::{Path, PathBuf};

/// What an input is known by: its name and its size, of a directory that of all files in it. Where it is may differ from machine to
/// machine.
#[derive(Serialize)]
pub(crate) struct InputName {
    name: String,
    bytes: u64,
}

impl InputName {
    /// Of a file or a directory.
    pub(crate) fn of(path: impl AsRef<Path>) -> Self {
        let path = path.as_ref();
        let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        let size = |file: &Path| file.metadata().map_or(0, |file| file.len());
        let bytes = match path.is_dir() {
            true => files_below(path).unwrap_or_default().iter().map(|file| size(file)).sum(),
            false => size(path),
        };
        Self { name, bytes }
    }
}

/// The key of what is read: more may come.
const INPUTS: &str = "inputs";

/// The settings of a run.
pub(crate) struct KeptSettings {
    file: String,
    settings: Map<String, Value>,
}

impl KeptSettings {
    /// Those of a command: each key is the name of its option, or of what it reads.
    pub(crate) fn new(command: &str, settings: &impl Serialize) -> Result<Self, Failure> {
        let value = serde_json::to_value(settings).map_err(|error| Failure::other(error.to_string()))?;
        let Value::Object(settings) = value else {
            return Err(Failure::other(format!("the settings of {command} have no names")));
        };
        Ok(Self { file: file_of(command), settings })
    }

    /// Writes them, before the first frame.
    pub(crate) fn write(&self, directory: &mut OutputDirectory) -> Result<(), Failure> {
        directory.write(&self.file, self.text().as_bytes())
    }

    /// The directory of an earlier run with the same settings, which goes on. `frames`: what it has left. Inputs may have been
    /// added since.
    pub(crate) fn resume(
        &self,
        path: &Path,
        inputs: &[PathBuf],
        frames: impl FnOnce(&Path) -> bool,
    ) -> Result<OutputDirectory, Failure> {
        let directory = OutputDirectory::resumed(path, inputs)?;
        let (file, has_frames) = (path.join(&self.file), frames(path));
        if !file.exists() && has_frames {
            return Err(Failure::Usage(format!(
                "{}: it has frames, but no {}, so that nobody knows what they were made with\n  \
                 give another directory, or --force in place of --resume",
                path.display(),
                self.file
            )));
        }
        let is_longer = !file.exists() || self.compare(&read_text(&file)?, path, has_frames)?;
        if is_longer {
            OutputFile::write_apart(&file, inputs, self.text().as_bytes())?;
            // Another run may have begun at the same time.
            self.compare(&read_text(&file)?, path, has_frames)?;
        }
        Ok(directory)
    }

    /// Refuses settings that differ from those in a file; says whether there are more inputs than there.
    fn compare(&self, text: &str, path: &Path, has_frames: bool) -> Result<bool, Failure> {
        let failed = |why: serde_json::Error| {
            let file = path.join(&self.file);
            Failure::other(format!("{}: {why}; give another directory", file.display()))
        };
        let earlier: Map<String, Value> = serde_json::from_str(text).map_err(failed)?;
        // As numbers come out of a file.
        let own: Map<String, Value> = serde_json::from_str(&self.text()).map_err(failed)?;
        let inputs = [&own, &earlier].map(|settings| settings.get(INPUTS).and_then(Value::as_array));
        let both = || inputs[0].into_iter().flatten().zip(inputs[1].into_iter().flatten());
        let keys = own.keys().chain(earlier.keys().filter(|key| !own.contains_key(*key)));
        let differs = |key: &&String| *key != INPUTS && own.get(*key) != earlier.get(*key);
        let shown = |settings: &Map<String, Value>, key: &str| {
            settings.get(key).map_or_else(|| "nothing".to_owned(), Value::to_string)
        };
        let what = match (keys.filter(differs).min(), both().find(|(own, earlier)| own != earlier)) {
            (Some(key), _) => {
                format!("other settings: {key} is {}, and was {}", shown(&own, key), shown(&earlier, key))
            }
            (None, Some((own, earlier))) => format!("other inputs: there is {own}, and was {earlier}"),
            (None, None) => {
                let [now, then] = inputs.map(|inputs| inputs.map_or(0, Vec::len));
                return Ok(now > then);
            }
        };
        let made = if has_frames { "its frames were made with" } else { "another run has begun with" };
        Err(Failure::Usage(format!(
            "{}: {made} {what}\n  give those of the earlier run, another directory, or --force in place of --resume",
            path.display(),
        )))
    }

    fn text(&self) -> String {
        // Strings and finite numbers are always JSON.
        let text = serde_json::to_string_pretty(&self.settings).unwrap_or_default();
        format!("{text}\n")
    }
}

/// The names of such files in a directory that others are written to: they are of frames that are no longer there.
pub(crate) fn settings_in(directory: &Path) -> impl Iterator<Item = PathBuf> {
    let paths = ["fit", "track"].map(|command| directory.join(file_of(command)));
    paths.into_iter().filter(|path| path.is_file())
}

fn file_of(command: &str) -> String {
    format!(".{command}-settings.json")
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn the_setting_that_differs_is_named_and_inputs_may_be_added() {
        let of = |settings: Value| KeptSettings::new("track", &settings).unwrap();
        let background = |hold: f64, inputs: &[&str]| json!({"background": [0.03_f32, 0.1, 1.0 / 3.0], "hold": hold, "inputs": inputs});
        let earlier = of(background(0.3, &["a", "b"])).text();
        let said = |settings: Value| of(settings).compare(&earlier, Path::new("out"), true);
        assert!(matches!(said(background(0.3, &["a", "b"])), Ok(false)));
        assert!(matches!(said(background(0.3, &["a", "b", "c"])), Ok(true)));
        assert!(matches!(said(background(0.3, &["a"])), Ok(false)));
        let refused = |settings| said(settings).unwrap_err().to_string();
        let differing = refused(background(0.5, &["a"]));
        assert!(
            differing.contains("frames were made with other settings: hold is 0.5, and was 0.3"),
            "{differing}"
        );
        let lacking = refused(json!({"inputs": ["a"], "hold": 0.3}));
        assert!(lacking.contains("background is nothing"), "{lacking}");
        let other = refused(background(0.3, &["a", "c"]));
        assert!(other.contains(r#"other inputs: there is "c", and was "b""#), "{other}");
        let begun = of(background(0.5, &[])).compare(&earlier, Path::new("out"), false).unwrap_err();
        assert!(begun.to_string().contains("another run has begun with"), "{begun}");
    }
}
