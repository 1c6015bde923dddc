//! Frames as the encoder takes them: every value is finite, every rotation has a direction.

use crate::error::Error;
use crate::memory::Footprint;
use crate::report::Dropped;
use crate::settings::Settings;
use crate::source::FrameSource;
use splatstream_gaussians::{Defects, GaussianFrame};
use std::collections::BTreeMap;
use xxhash_rust::xxh64::Xxh64;

/// Refuses Gaussians with values that no frame may hold, or leaves them out; and frames that take more memory to encode than
/// there may be.
pub(crate) struct CheckedSource<'a> {
    source: &'a mut dyn FrameSource,
    settings: &'a Settings,
    /// Most memory that encoding may take, bytes.
    max_memory: u64,
    /// By frame.
    dropped: BTreeMap<u32, Defects>,
    /// Gaussians that each frame shall have, and its digest; empty where that is not known.
    expected: (&'a [u32], &'a [u64]),
    /// Digests of the frames that were read, where they are wanted.
    digests: Option<BTreeMap<u32, u64>>,
}

/// A frame that is not the one that it should be.
#[derive(Debug, thiserror::Error)]
enum Unplanned {
    #[error("its number of Gaussians is {found}, and should be {planned}")]
    Count { found: u32, planned: u32 },
    #[error("it has other values than it should have")]
    Values,
}

/// A frame with values that no frame may hold.
#[derive(Debug, thiserror::Error)]
#[error("{} of its Gaussians have values that are not finite, or a rotation without direction", .0.rows.len())]
struct Invalid(Defects);

impl<'a> CheckedSource<'a> {
    pub(crate) fn new(source: &'a mut dyn FrameSource, settings: &'a Settings) -> Self {
        let max_memory = settings.max_memory;
        Self { source, settings, max_memory, dropped: BTreeMap::new(), expected: (&[], &[]), digests: None }
    }

    /// The same where some of the memory is taken already.
    pub(crate) fn beside(self, taken: u64) -> Self {
        Self { max_memory: self.max_memory.saturating_sub(taken), ..self }
    }

    /// Refuses frames that have other numbers of Gaussians, or other digests.
    pub(crate) fn expecting(self, counts: &'a [u32], digests: &'a [u64]) -> Self {
        Self { expected: (counts, digests), ..self }
    }

    /// Takes a digest of each frame that is read.
    pub(crate) fn with_digests(self) -> Self {
        Self { digests: Some(BTreeMap::new()), ..self }
    }

    /// The digests of the frames that were read, in their order.
    pub(crate) fn into_digests(self) -> Vec<u64> {
        self.digests.into_iter().flatten().map(|(_, digest)| digest).collect()
    }

    /// Whether a frame is the one that it should be.
    fn check(&self, number: u32, frame: &GaussianFrame) -> Result<(), Unplanned> {
        let (counts, digests) = self.expected;
        let found = u32::try_from(frame.len()).unwrap_or(u32::MAX);
        match (counts.get(number as usize), digests.get(number as usize)) {
            (Some(&planned), _) if found != planned => Err(Unplanned::Count { found, planned }),
            (_, Some(&planned)) if digest(frame) != planned => Err(Unplanned::Values),
            _ => Ok(()),
        }
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
        Footprint::of(&frame, self.source.len(), self.settings).check(number, self.max_memory)?;
        self.check(number, &frame)?;
        if let Some(digests) = &mut self.digests {
            digests.entry(number).or_insert_with(|| digest(&frame));
        }
        let Some(defects) = frame.defects() else { return Ok(frame) };
        if !self.settings.drop_invalid {
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
                Ok(other) => match *other {
                    Unplanned::Count { found, planned } => Error::OtherFrame { frame, found, planned },
                    Unplanned::Values => Error::ChangedFrame { frame },
                },
                Err(source) => match source.downcast::<Error>() {
                    Ok(error) => *error,
                    Err(source) => Error::Source { frame, source },
                },
            },
        },
        other => other,
    }
}

/// A number that two frames have in common only if all of their values are the same.
pub(crate) fn digest(frame: &GaussianFrame) -> u64 {
    const VALUES: usize = 1 << 10;
    let mut hash = Xxh64::new(0);
    hash.update(&[frame.sh_degree(), frame.antialiased().into()]);
    let mut bytes = Vec::with_capacity(VALUES.saturating_mul(size_of::<f32>()));
    for values in frame.planes().iter().flat_map(|plane| plane.chunks(VALUES)) {
        bytes.clear();
        bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        hash.update(&bytes);
    }
    hash.digest()
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
