//! Where refinements end, chosen by what pictures gain.
//!
//! A receiver with room for some bytes shows the longest prefix that fits. If all amounts of room up to the whole frame are
//! equally likely, the mean PSNR of what receivers show is the area under a staircase: each step is as wide as the bytes from one
//! boundary to the next, and as high as the PSNR of the prefix that ends where the step begins. The boundaries are those under
//! which this area is largest: close together where the PSNR rises steeply, far apart where it does not.
//!
//! Bytes are taken to be proportional to Gaussians. The prefixes are drawn from the source, over the views that orders go by, and
//! the error that the quantisers will make is added: prefixes that differ by less than that differ for nobody.

use crate::checked::{CheckedSource, named};
use crate::error::Error;
use crate::first_frame::first_frame;
use crate::importance::Ranking;
use crate::settings::{Quality, Settings};
use crate::source::FrameSource;
use splatstream_format::syntax::{MAX_REFINEMENTS, prefix_length};
use splatstream_gaussians::GaussianFrame;
use splatstream_render::ReferencePictures;

/// Percentages at which a refinement may end, each about a quarter more than the one before up to a half.
const CANDIDATES: [u8; 18] = [1, 2, 3, 4, 5, 7, 9, 12, 15, 20, 25, 30, 40, 50, 60, 70, 80, 100];

/// Lines of the pictures.
const LINES: u32 = 144;

/// Percentages of the Gaussians up to each of `count` refinements, rising, the last 100, so that pictures of the first frame are
/// as good as they can be for receivers that take any part of its bytes. What the settings say about refinements is not read.
///
/// This ranks the frame once more, down to the first place where a refinement may end: that takes a little longer than the
/// ranking of a frame whose first refinement ends later.
///
/// # Errors
/// `count` outside 1 to 10, no frame, or a first frame that [`encode`](crate::encode) would refuse.
pub fn refinements_by_slope(
    source: &mut dyn FrameSource,
    settings: &Settings,
    count: u8,
) -> Result<Vec<u8>, Error> {
    if !(1..=MAX_REFINEMENTS).contains(&count) {
        let allowed = "1 to 10";
        return Err(Error::Setting { name: "the number of refinements", value: count.to_string(), allowed });
    }
    if source.is_empty() {
        return Err(Error::NoFrames);
    }
    if count == 1 {
        return Ok(vec![100]);
    }
    let mut checked = CheckedSource::new(source, settings);
    let frame = first_frame(&mut checked, settings).map_err(named)?;
    // Where a size is asked for, the PSNR is that of a usual stream.
    let whole = settings.psnr.unwrap_or(Quality::High.decibels());
    Ok(best_boundaries(&psnr_of_prefixes(&frame, settings, whole.into())?, count))
}

/// The PSNR, dB, of nothing at all and of the prefix that ends at each candidate, where the error of a whole frame is so many dB.
fn psnr_of_prefixes(frame: &GaussianFrame, settings: &Settings, whole: f64) -> Result<Vec<f64>, Error> {
    let mut ranking = Ranking::new(&Settings { refinements: CANDIDATES.to_vec(), ..settings.clone() });
    let mut order = ranking.order(frame);
    let cameras =
        ranking.cameras(frame).iter().map(|camera| camera.scaled_to_height(LINES.min(camera.height)));
    let pictures = ReferencePictures::new(frame, cameras.collect());
    let of_prefix = |percent: u8| {
        let prefix = order.get_mut(..prefix_length(percent, frame.len() as u32) as usize);
        let prefix = prefix.ok_or(Error::Fault("a prefix ends beyond its frame"))?;
        // The order of the source decides between Gaussians that are equally far away. Longer prefixes have these too.
        prefix.sort_unstable();
        let errors: Vec<f64> = pictures.psnr(&frame.select(prefix)).map(mean_square).collect();
        let mean = errors.iter().sum::<f64>() / errors.len().max(1) as f64;
        Ok(-10.0 * libm::log10(mean + mean_square(whole)))
    };
    [0].into_iter().chain(CANDIDATES).map(of_prefix).collect()
}

/// What a picture of a PSNR of so many dB differs by, mean square.
fn mean_square(psnr: f64) -> f64 {
    libm::pow(10.0, -psnr / 10.0)
}

/// The best `count` boundaries, the last 100 %, for the PSNR of nothing and of each candidate.
///
/// The best way to a candidate by some number of boundaries goes by the best way to the one before it, so that all ways are
/// known from those with one boundary less. Of ways that are equally good it is that with the earlier boundaries.
fn best_boundaries(psnr: &[f64], count: u8) -> Vec<u8> {
    /// The area so far, and the boundaries.
    type Way = (f64, Vec<u8>);
    let places: Vec<(u8, f64)> = [0].into_iter().chain(CANDIDATES).zip(psnr.iter().copied()).collect();
    let step = |from: &(u8, f64), to: &(u8, f64)| (f64::from(to.0) - f64::from(from.0)) * from.1;
    let mut ways: Vec<Option<Way>> = vec![None; places.len()];
    if let Some(start) = ways.first_mut() {
        *start = Some((0.0, Vec::new()));
    }
    for _ in 0..count {
        let reached = |(number, to): (usize, &(u8, f64))| -> Option<Way> {
            let before = places.iter().zip(&ways).take(number);
            let by =
                before.filter_map(|(from, way)| way.as_ref().map(|way| (way.0 + step(from, to), &way.1)));
            let (area, boundaries) = by.reduce(|best, other| if other.0 > best.0 { other } else { best })?;
            Some((area, boundaries.iter().copied().chain([to.0]).collect()))
        };
        ways = places.iter().enumerate().map(reached).collect();
    }
    ways.pop().flatten().map_or_else(|| vec![100], |(_, boundaries)| boundaries)
}

#[cfg(test)]
mod tests {
    use super::*;
    use splatstream_files::builtin::BuiltinScene;

    /// The area under the staircase of some boundaries.
    fn area(psnr: &[f64], boundaries: &[u8]) -> f64 {
        let height = |percent: u8| match CANDIDATES.iter().position(|&candidate| candidate == percent) {
            Some(number) => psnr[number + 1],
            None => psnr[0],
        };
        let starts = [0].into_iter().chain(boundaries.iter().copied());
        starts.zip(boundaries).map(|(start, &end)| f64::from(end - start) * height(start)).sum()
    }

    #[test]
    fn no_other_boundaries_are_better() {
        let psnr: Vec<f64> =
            [0].into_iter().chain(CANDIDATES).map(|percent| 20.0 + 3.0 * f64::from(percent).sqrt()).collect();
        let best = best_boundaries(&psnr, 3);
        assert_eq!((best.len(), best.last()), (3, Some(&100)));
        for a in CANDIDATES {
            for b in CANDIDATES.into_iter().filter(|&b| b > a && b < 100) {
                assert!(area(&psnr, &[a, b, 100]) <= area(&psnr, &best), "{a} {b} {best:?}");
            }
        }
    }

    #[test]
    fn boundaries_are_where_the_psnr_rises() {
        // All that matters comes by 5 %, or not before 50 %.
        let early = |percent: &u8| if *percent < 5 { 10.0 } else { 40.0 };
        let late = |percent: &u8| if *percent < 50 { 10.0 } else { 40.0 };
        let places: Vec<u8> = [0].into_iter().chain(CANDIDATES).collect();
        assert_eq!(best_boundaries(&places.iter().map(early).collect::<Vec<_>>(), 2), [5, 100]);
        assert_eq!(best_boundaries(&places.iter().map(late).collect::<Vec<_>>(), 2), [50, 100]);
    }

    #[test]
    fn a_scene_has_as_many_as_are_wanted() {
        let scene = BuiltinScene { gaussians: 400, frames: 1, ..BuiltinScene::default() };
        let mut source = vec![scene.frame(0)];
        for count in 1..=MAX_REFINEMENTS {
            let percents = refinements_by_slope(&mut source, &Settings::default(), count).unwrap();
            assert!(
                percents.len() == usize::from(count) && percents.is_sorted_by(|a, b| a < b),
                "{percents:?}"
            );
            assert_eq!(percents.last(), Some(&100));
        }
        for count in [0, MAX_REFINEMENTS + 1] {
            assert!(refinements_by_slope(&mut source, &Settings::default(), count).is_err());
        }
        assert!(refinements_by_slope(&mut Vec::new(), &Settings::default(), 2).is_err());
    }
}
