//! The first frame of a sequence, which steps and views are made for.

use crate::canonical::{canonicalise, visible};
use crate::error::Error;
use crate::importance::Ranking;
use crate::isolated;
use crate::settings::Settings;
use crate::source::FrameSource;
use splatstream_gaussians::GaussianFrame;

/// The ranking of the first frame that steps are fitted with, which knows its order.
///
/// # Errors
/// A frame that cannot be read.
pub(crate) fn first_ranking(source: &mut dyn FrameSource, settings: &Settings) -> Result<Ranking, Error> {
    let frame = first_frame(source, settings)?;
    let mut ranking = Ranking::new(settings);
    ranking.rank_first(&frame);
    Ok(ranking)
}

/// The ranking with the views of the sequence, if they are to be made.
///
/// # Errors
/// A frame that cannot be read.
pub(crate) fn looking(
    source: &mut dyn FrameSource,
    mut ranking: Ranking,
    settings: &Settings,
) -> Result<Ranking, Error> {
    if ranking.is_blind() {
        // Views follow from what can be seen, whatever its form.
        let frame = read_first(source)?;
        let shown = visible(&frame, settings.keep_invisible);
        ranking.look_at(&frame.into_selected(&shown));
    }
    Ok(ranking)
}

/// The first frame as it is coded.
pub(crate) fn first_frame(source: &mut dyn FrameSource, settings: &Settings) -> Result<GaussianFrame, Error> {
    Ok(coded_form(read_first(source)?, settings))
}

/// The first frame as its source has it.
///
/// # Errors
/// A frame that cannot be read.
pub(crate) fn read_first(source: &mut dyn FrameSource) -> Result<GaussianFrame, Error> {
    source.frame(0).map_err(|source| Error::Source { frame: 0, source })
}

/// A first frame as it is coded.
pub(crate) fn coded_form(frame: GaussianFrame, settings: &Settings) -> GaussianFrame {
    let shown = visible(&frame, settings.keep_invisible);
    let frame = canonicalise(frame.into_selected(&shown), true);
    isolated::colours(frame, &shown, 0).0
}
