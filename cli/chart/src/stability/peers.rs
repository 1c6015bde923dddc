//! Other formats on a sample, frame by frame: what comes back of what they write.

use super::attempt::Attempt;
use super::sample::Sample;
use super::sog::quantised;
use splatstream_files::{ReadLimits, SceneError, splat, spz};
use splatstream_gaussians::GaussianFrame;

/// A frame that came back, and the bytes it took; none where nothing is packed.
pub(super) type Returned = (GaussianFrame, Option<u64>);

/// Every frame of a sample by itself.
pub(super) fn attempt(sample: &Sample, code: fn(&GaussianFrame) -> Result<Returned, SceneError>) -> Attempt {
    match sample.frames.iter().map(code).collect::<Result<Vec<Returned>, _>>() {
        Err(error) => Attempt { detected: vec![format!("writer refuses: {error}")], ..Attempt::default() },
        Ok(frames) => Attempt {
            bytes: frames.iter().map(|(_, bytes)| *bytes).sum(),
            shown: frames.into_iter().map(|(frame, _)| Some(frame)).collect(),
            ..Attempt::default()
        },
    }
}

/// SPZ as our writer makes it: what the format can hold, with the reference's bits.
pub(super) fn spz(frame: &GaussianFrame) -> Result<Returned, SceneError> {
    let bytes = spz::write(frame)?;
    Ok((spz::read(&bytes, &ReadLimits::default())?, Some(bytes.len() as u64)))
}

/// `.splat`.
pub(super) fn splat(frame: &GaussianFrame) -> Result<Returned, SceneError> {
    let bytes = splat::write(frame)?;
    Ok((splat::read(&bytes, &ReadLimits::default())?, Some(bytes.len() as u64)))
}

/// The values that SOG's images can hold.
pub(super) fn sog(frame: &GaussianFrame) -> Result<Returned, SceneError> {
    frame.validate().map_err(SceneError::from)?;
    Ok((quantised(frame), None))
}
