//! Frames as the encoder takes them: every value is finite, every rotation has a direction.

use crate::error::Error;
use crate::report::Dropped;
use crate::source::FrameSource;
use splatstream_gaussians::{Defects, GaussianFrame};
use std::collections::BTreeMap;

/// Refuses Gaussians with values that no frame may hold, or leaves them out.
pub(crate) struct CheckedSource<'a> {
    source: &'a mut dyn FrameSource,
    drop_invalid: bool,
    /// By frame.
    dropped: BTreeMap<u32, Defects>,
    /// Gaussians that each frame shall have; empty where that is not known.
    expected: &'a [u32],
}

/// A frame that has not the Gaussians that it should have.
#[derive(Debug, thiserror::Error)]
#[error("it has {found} Gaussians, and should have {planned}")]
struct Unplanned {
    found: u32,
    planned: u32,
}

/// A frame with values that no frame may hold.
#[derive(Debug, thiserror::Error)]
#[error("{} of its Gaussians have values that are not finite, or a rotation without direction", .0.rows.len())]
struct Invalid(Defects);

impl<'a> CheckedSource<'a> {
    pub(crate) fn new(source: &'a mut dyn FrameSource, drop_invalid: bool) -> Self {
        Self { source, drop_invalid, dropped: BTreeMap::new(), expected: &[] }
    }

    /// Refuses frames that have other numbers of Gaussians.
    pub(crate) fn expecting(self, counts: &'a [u32]) -> Self {
        Self { expected: counts, ..self }
    }

    /// What was left out of each frame that was read.
    pub(crate) fn into_dropped(self) -> Vec<Dropped> {
        let of_frame = |(frame, defects): (u32, Defects)| Dropped {
            frame,
            gaussians: defects.rows.len() as u32,
            properties: defects.properties,
            first: defects.first,
        };
        self.dropped.into_iter().map(of_frame).collect()
    }
}

impl FrameSource for CheckedSource<'_> {
    fn len(&self) -> u32 {
        self.source.len()
    }

    fn frame(&mut self, number: u32) -> Result<GaussianFrame, Box<dyn std::error::Error + Send + Sync>> {
        let frame = self.source.frame(number)?;
        let found = u32::try_from(frame.len()).unwrap_or(u32::MAX);
        if let Some(&planned) = self.expected.get(number as usize)
            && found != planned
        {
            return Err(Box::new(Unplanned { found, planned }));
        }
        let Some(defects) = frame.defects() else { return Ok(frame) };
        if !self.drop_invalid {
            return Err(Box::new(Invalid(defects)));
        }
        let frame = without(frame, &defects.rows);
        self.dropped.insert(number, defects);
        Ok(frame)
    }
}

/// The error of a frame that was refused is one of the frame, not of reading it.
pub(crate) fn named(error: Error) -> Error {
    match error {
        Error::Source { frame, source } => match source.downcast::<Invalid>() {
            Ok(invalid) => {
                let Defects { rows, first, .. } = invalid.0;
                Error::Invalid { frame, count: rows.len(), first }
            }
            Err(source) => match source.downcast::<Unplanned>() {
                Ok(other) => Error::OtherFrame { frame, found: other.found, planned: other.planned },
                Err(source) => Error::Source { frame, source },
            },
        },
        other => other,
    }
}

/// A frame in which some rows hold nothing: their opacity is 0, that is, its logit is minus infinity, which
/// [`visible`](crate::canonical::visible) leaves out. All other rows keep their places, by which frames are tracked.
#[expect(clippy::indexing_slicing, reason = "rows of defects are rows of the frame that they were found in")]
pub(crate) fn without(mut frame: GaussianFrame, rows: &[u32]) -> GaussianFrame {
    // A row that is in the scene, so that nothing else is told apart from the rest.
    let model = (0..frame.len() as u32).find(|row| rows.binary_search(row).is_err());
    let mut planes = frame.planes_mut();
    for &row in rows {
        let row = row as usize;
        for plane in planes.position.iter_mut().chain(&mut planes.log_scale) {
            plane[row] = model.map_or(0.0, |model| plane[model as usize]);
        }
        for plane in planes.dc.iter_mut().chain(&mut planes.sh).chain(&mut planes.rotation) {
            plane[row] = 0.0;
        }
        planes.rotation[0][row] = 1.0;
        planes.opacity_logit[row] = f32::NEG_INFINITY;
    }
    frame
}
