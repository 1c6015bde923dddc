//! The settings that the frames in a directory were made with, in a hidden file beside them. A run that keeps frames of an earlier
//! one must have the same: otherwise the frames of one sequence would be made in two ways, and nothing would say so.

use crate::failure::Failure;
use crate::output_directory::OutputDirectory;
use crate::output_file::OutputFile;
use crate::whole_file::read_text;
use serde::Serialize;
use serde_json::{Map, Value};
use std::path::{Path, PathBuf};

/// What an input is known by: its name, and its size if it is a file. Its directory may be another one on another machine.
#[derive(Serialize)]
pub(crate) struct InputName {
    name: String,
    bytes: Option<u64>,
}

impl InputName {
    /// Of a file or a directory.
    pub(crate) fn of(path: impl AsRef<Path>) -> Self {
        let path = path.as_ref();
        let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        let bytes = path.metadata().ok().filter(std::fs::Metadata::is_file).map(|file| file.len());
        Self { name, bytes }
    }
}

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
        Ok(Self { file: format!(".{command}-settings.json"), settings })
    }

    /// Writes them, before the first frame.
    pub(crate) fn write(&self, directory: &mut OutputDirectory) -> Result<(), Failure> {
        directory.write(&self.file, self.text().as_bytes())
    }

    /// The directory of an earlier run with the same settings, which goes on. `frames`: what it has left.
    pub(crate) fn resume(
        &self,
        path: &Path,
        inputs: &[PathBuf],
        frames: impl FnOnce(&Path) -> bool,
    ) -> Result<OutputDirectory, Failure> {
        let directory = OutputDirectory::resumed(path, inputs)?;
        let file = path.join(&self.file);
        if file.exists() {
            self.compare(&read_text(&file)?, path)?;
        } else if frames(path) {
            return Err(Failure::Usage(format!(
                "{}: it has frames, but no {}, so that nobody knows what they were made with\n  \
                 give another directory, or --force in place of --resume",
                path.display(),
                self.file
            )));
        } else {
            OutputFile::write_apart(&file, inputs, self.text().as_bytes())?;
        }
        Ok(directory)
    }

    /// Refuses settings that differ from those in a file.
    fn compare(&self, text: &str, path: &Path) -> Result<(), Failure> {
        let named = |why: String| Failure::other(format!("{}: {why}", path.join(&self.file).display()));
        let earlier: Map<String, Value> =
            serde_json::from_str(text).map_err(|error| named(format!("{error}; give another directory")))?;
        let keys = self.settings.keys().chain(earlier.keys().filter(|key| !self.settings.contains_key(*key)));
        let shown = |settings: &Map<String, Value>, key: &str| {
            settings.get(key).map_or_else(|| "nothing".to_owned(), Value::to_string)
        };
        let differs = |key: &&String| self.settings.get(*key) != earlier.get(*key);
        let Some(key) = keys.filter(differs).min() else { return Ok(()) };
        let what = match key.as_str() {
            "inputs" => "its frames were made from inputs with other names or sizes".to_owned(),
            key => {
                let [now, then] = [&self.settings, &earlier].map(|settings| shown(settings, key));
                format!("its frames were made with other settings: {key} is {now}, and was {then}")
            }
        };
        Err(Failure::Usage(format!(
            "{}: {what}\n  give those of the earlier run, another directory, or --force in place of --resume",
            path.display(),
        )))
    }

    fn text(&self) -> String {
        // Strings and finite numbers are always JSON.
        let text = serde_json::to_string_pretty(&self.settings).unwrap_or_default();
        format!("{text}\n")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn the_setting_that_differs_is_named() {
        let of = |settings: Value| KeptSettings::new("track", &settings).unwrap();
        let earlier = of(json!({"gop": 16, "hold": 0.3, "inputs": ["a"]})).text();
        let said = |settings: Value| of(settings).compare(&earlier, Path::new("out"));
        assert!(said(json!({"gop": 16, "hold": 0.3, "inputs": ["a"]})).is_ok());
        let refused = said(json!({"gop": 8, "hold": 0.3, "inputs": ["a"]})).unwrap_err();
        assert!(refused.to_string().contains("gop is 8, and was 16"), "{refused}");
        let refused = said(json!({"gop": 16, "inputs": ["a"]})).unwrap_err();
        assert!(refused.to_string().contains("hold is nothing, and was 0.3"), "{refused}");
        let refused = said(json!({"gop": 16, "hold": 0.3, "inputs": ["b"]})).unwrap_err();
        assert!(refused.to_string().contains("inputs with other names"), "{refused}");
    }
}
