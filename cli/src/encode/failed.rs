//! Errors of the encoder in the words of the command line.

use super::finetune::not_kept;
use super::warnings::unlike_frames;
use crate::failure::Failure;
use crate::frame_files::{FrameFiles, unread};
use crate::numbers::counted;
use crate::over_limit::of_encoding;
use splatstream_encoder::Error;
use splatstream_gaussians::Defect;
use std::path::Path;

/// The encoder counts frames; a user has files. `memory`: what there is for reading and encoding together.
pub(super) fn failed(source: &FrameFiles, (out, memory): (&Path, u64), error: &Error) -> Failure {
    match error {
        // Errors of reading name the file.
        Error::Source { source, .. } => unread(source.as_ref()),
        Error::Invalid { frame, count, first } => {
            let Defect { row, property, value, kind } = first;
            let path = source.name(*frame);
            let more = match count - 1 {
                0 => String::new(),
                1 => ", and 1 more Gaussian of this frame has such values".to_owned(),
                more => {
                    format!(", and {} of this frame have such values", counted(more as u64, "more Gaussian"))
                }
            };
            Failure::other(format!(
                "{path}: frame {frame}, Gaussian {row}: {property} is {value}: {kind}{more}\n  \
                 repair the file, or leave such Gaussians out with --drop-invalid"
            ))
        }
        Error::OverMemory { frame, asked, allowed, .. } => {
            // What is allowed is what readers leave.
            let beside = memory.saturating_sub(*allowed);
            let advice = of_encoding(asked.saturating_add(beside));
            Failure::Memory(format!("{}: {error}\n  {advice}", source.name(*frame)))
        }
        Error::OutOfGrid { frame, farthest_row, .. } => {
            let name = source.name(*frame);
            // Steps are those of all frames: of two scenes one may be out of reach of the other.
            let unlike =
                source.likeness().unlike(false).and_then(|unlike| unlike_frames(&unlike, false, None));
            let advice = unlike.map_or_else(
                || {
                    format!(
                        "repair or remove Gaussian {farthest_row} first: steps follow the whole scene, and one value far from all \
                         others can put the rest out of reach"
                    )
                },
                |warning| warning.message,
            );
            Failure::other(format!("{name}: {error}\n  {advice}"))
        }
        Error::TooManyGaussians { frame, .. }
        | Error::TooManyPerSecond { frame, .. }
        | Error::OtherFrame { frame, .. }
        | Error::ChangedFrame { frame } => Failure::other(format!("{}: {error}", source.name(*frame))),
        Error::FinetuneState(error) => not_kept(error),
        Error::Output(cause) => Failure::file("write", out, cause),
        Error::Setting { .. } => Failure::Usage(error.to_string()),
        _ => Failure::other(error.to_string()),
    }
}
