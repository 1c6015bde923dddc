//! The options of `encode` for programs that have frames in memory.

use super::encoded::Encoded;
use super::finetune::Kept;
use super::{Decided, Encode};
use clap::Parser;
use splatstream_encoder::{FrameSource, Report, Settings};
use splatstream_gaussians::GaussianFrame;
use std::fmt;
use std::path::Path;

/// What a user asks of the encoder, in the words of the command line; frames come from elsewhere.
pub struct EncodeOptions(Encode);

/// The settings that follow from options and from the first frame.
#[derive(Debug, Clone)]
pub struct Prepared {
    /// For the encoder.
    pub settings: Settings,
    decided: Decided,
    kept: Kept,
}

/// The options as they stand after `splatstream encode`.
#[derive(Parser)]
#[command(no_binary_name = true)]
struct Line {
    #[command(flatten)]
    encode: Encode,
}

/// Options that make no sense: which, and what would be allowed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OptionsError(String);

impl fmt::Display for OptionsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for OptionsError {}

/// The start of a sequence: what settings follow from.
struct Start<'a> {
    first: &'a GaussianFrame,
    frames: u32,
}

impl FrameSource for Start<'_> {
    fn len(&self) -> u32 {
        self.frames
    }

    fn frame(&mut self, number: u32) -> Result<GaussianFrame, Box<dyn std::error::Error + Send + Sync>> {
        match number {
            0 => Ok(self.first.clone()),
            _ => Err("settings follow from the first frame".into()),
        }
    }
}

impl EncodeOptions {
    /// The options in words as `--psnr`, `52`, without inputs and output.
    ///
    /// # Errors
    /// What the command line would refuse.
    pub fn parse(words: impl IntoIterator<Item = String>) -> Result<Self, OptionsError> {
        let files = ["-", "-o", "-"].map(str::to_owned);
        match Line::try_parse_from(words.into_iter().chain(files)) {
            Ok(line) => Ok(Self(line.encode)),
            Err(error) => {
                let text = error.render().to_string();
                let cause = text.split("\n\n").next().unwrap_or_default();
                Err(OptionsError(cause.trim_start_matches("error: ").to_owned()))
            }
        }
    }

    /// The settings for so many frames of which this is the first; none: for a sequence whose length nobody knows yet. A
    /// sequence gets layers and predicted frames; one frame does not.
    ///
    /// # Errors
    /// Options that do not go together, or that need the length; a file of cameras or of a network that cannot be read.
    pub fn prepare(&self, first: &GaussianFrame, frames: Option<u32>) -> Result<Prepared, OptionsError> {
        if frames.is_none() && self.0.chooses_effort() {
            return Err(OptionsError(
                "--time-budget shares the time among all frames, whose number must be known: give them as a list".to_owned(),
            ));
        }
        let mut start = Start { first, frames: frames.unwrap_or(2) };
        let settings = self.0.settings(&mut start);
        let (mut settings, decided) = settings.map_err(|failure| OptionsError(failure.to_string()))?;
        let put = self.0.refinements.put(&mut start, &mut settings);
        put.map_err(|error| OptionsError(error.to_string()))?;
        let kept = self.0.finetune.keep(&mut settings);
        let kept = kept.map_err(|failure| OptionsError(failure.to_string()))?;
        Ok(Prepared { settings, decided, kept })
    }
}

impl Prepared {
    /// Removes what was kept of fitting, where that was asked for, once the stream is written.
    ///
    /// # Errors
    /// A file that cannot be removed.
    pub fn remove_state(&self) -> Result<(), OptionsError> {
        self.kept.remove().map_err(|failure| OptionsError(failure.to_string()))
    }

    /// The JSON that `splatstream encode --json` prints of a stream that was written with these settings, without the name
    /// of a file: see `cli/json.md`.
    ///
    /// # Errors
    /// None that is known: a report holds what JSON can say.
    pub fn report(&self, report: &Report, seconds: f64) -> serde_json::Result<String> {
        let name_of = |frame| format!("frame {frame}");
        let mut encoded = Encoded::new(Path::new(""), report, &self.settings, &name_of, seconds);
        encoded.chosen.extend(self.decided.choices());
        encoded.warnings.extend(self.decided.warnings());
        serde_json::to_string(&encoded)
    }
}

#[cfg(test)]
mod tests {
    use super::EncodeOptions;
    use splatstream_encoder::{Preset, Structure};
    use splatstream_files::builtin::BuiltinScene;

    fn words(text: &str) -> impl Iterator<Item = String> {
        text.split(' ').map(str::to_owned)
    }

    #[test]
    fn settings_are_those_of_the_command_line() {
        let options = EncodeOptions::parse(words("--psnr 52 --gop 8 --layers 540,1080")).unwrap();
        let first = BuiltinScene { gaussians: 50, ..BuiltinScene::default() }.frame(0);
        let settings = options.prepare(&first, Some(2)).unwrap().settings;
        assert_eq!((settings.psnr, settings.gop, settings.spatial_layers), (Some(52.0), 8, 2));
        assert_eq!(settings.structure, Structure::Predicted { layers: 2 });
        assert_eq!(options.prepare(&first, Some(1)).unwrap().settings.structure, Structure::Intra);
        assert_eq!(
            options.prepare(&first, None).unwrap().settings.structure,
            Structure::Predicted { layers: 2 }
        );
    }

    #[test]
    fn a_time_is_shared_among_a_known_number_of_frames() {
        let options = EncodeOptions::parse(words("--time-budget 60")).unwrap();
        let first = BuiltinScene { gaussians: 50, ..BuiltinScene::default() }.frame(0);
        let preset = |frames| options.prepare(&first, frames).map(|prepared| prepared.settings.preset);
        assert_eq!(preset(Some(1_000_000)), Ok(Preset::Fast));
        assert_ne!(preset(Some(2)), Ok(Preset::Fast));
        assert!(preset(None).unwrap_err().to_string().contains("must be known"));
    }

    #[test]
    fn refinements_are_given_or_chosen() {
        let first = BuiltinScene { gaussians: 50, ..BuiltinScene::default() }.frame(0);
        let refinements = |text: &str| {
            let options = EncodeOptions::parse(words(text)).map_err(|error| error.to_string())?;
            let prepared = options.prepare(&first, Some(1)).map_err(|error| error.to_string())?;
            Ok::<_, String>(prepared.settings.refinements)
        };
        assert_eq!(refinements("--refinements 20,100"), Ok(vec![20, 100]));
        assert!(refinements("--refinements auto:4").is_ok_and(|percents| percents.len() == 4));
        for wrong in ["auto:0", "auto:11", "auto:", "20,x,100", "20,50", "50,20,100"] {
            assert!(refinements(&format!("--refinements {wrong}")).is_err(), "{wrong}");
        }
    }

    #[test]
    fn an_error_names_the_option_and_what_is_allowed() {
        let error = |text| EncodeOptions::parse(words(text)).err().map(|error| error.to_string());
        assert!(error("--psnr 95").unwrap().ends_with("'95' is not a PSNR from 20 to 90 decibels"));
        assert!(error("--psnr 52 --quality low").unwrap().contains("cannot be used with"));
    }
}
