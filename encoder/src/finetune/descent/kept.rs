//! A descent that is ended and gone on with.
//!
//! It is kept before judges look: models are chosen again then, and everything else that the next iterations follow from is a
//! number that is named here, or follows from how many there have been, as views do.

use super::super::state::entry::{Entry, Exchange, Keep, Stage};
use super::{Best, Descent, EVERY, Latent, PATIENCE, VIEWS};
use crate::error::Error;
use crate::finetune::report::FinetuneReport;
use splatstream_gaussians::GaussianFrame;
use std::io;
use std::time::{Duration, Instant};

/// What has come of a fit.
pub(in crate::finetune) struct Finished<'f, 'a> {
    pub(in crate::finetune) latent: &'f mut Latent<'a>,
    /// With the operating points that it was fitted for.
    pub(in crate::finetune) report: &'f mut FinetuneReport,
}

impl Descent<'_> {
    /// Goes on from what an earlier run has left, if it has left something.
    pub(super) fn go_on(&mut self, entry: Option<&Entry>) -> Result<(), Error> {
        let Some(entry) = entry else { return Ok(()) };
        if entry.read(Stage::UnderWay, self)? {
            self.pictures.skip((self.done as usize).saturating_mul(VIEWS));
        }
        Ok(())
    }

    /// Before an iteration: keeps how far it has come where that may be and is not known already, and ends where somebody wants
    /// that. `resumed`: iterations that are known already.
    pub(super) fn keep(&mut self, entry: Option<&mut Entry>, resumed: u32) -> Result<(), Error> {
        let is_cancelled = self.finetune.watch.is_cancelled();
        let may_be = self.done.is_multiple_of(EVERY) && self.done > resumed;
        if let Some(entry) = entry.filter(|entry| may_be && (is_cancelled || entry.is_due())) {
            entry.write(Stage::UnderWay, self)?;
        }
        if is_cancelled { Err(Error::Cancelled) } else { Ok(()) }
    }
}

impl Keep for Descent<'_> {
    fn exchange(&mut self, with: &mut dyn Exchange) -> io::Result<()> {
        let mut seconds = self.elapsed().as_secs_f64();
        with.count(&mut self.done)?;
        with.float(&mut seconds)?;
        frame(&mut self.latent.offsets, with)?;
        frame(&mut self.means.last, with)?;
        frame(&mut self.means.other, with)?;
        self.adam.memory_mut().try_for_each(|values| floats(values, with))?;
        for sight in &mut self.sights {
            // A loss is never below 0.
            let mut loss = sight.loss.unwrap_or(-1.0);
            with.float(&mut loss)?;
            sight.loss = (loss >= 0.0).then_some(loss);
            compensation(&mut sight.compensation, with)?;
        }
        self.best.exchange(with)?;
        let can_be = self.done.is_multiple_of(EVERY) && self.done <= self.finetune.iterations;
        let (true, Ok(earlier)) = (can_be, Duration::try_from_secs_f64(seconds)) else {
            return Err(io::ErrorKind::InvalidData.into());
        };
        (self.earlier, self.start) = (earlier, Instant::now());
        Ok(())
    }
}

impl Keep for Best {
    fn exchange(&mut self, with: &mut dyn Exchange) -> io::Result<()> {
        with.float(&mut self.worth)?;
        for look in [&mut self.before, &mut self.after] {
            [&mut look.psnr, &mut look.quality, &mut look.bits]
                .into_iter()
                .try_for_each(|value| with.float(value))?;
        }
        with.count(&mut self.waited)?;
        frame(&mut self.offsets, with)?;
        self.compensation.iter_mut().try_for_each(|own| compensation(own, with))?;
        if self.waited < PATIENCE { Ok(()) } else { Err(io::ErrorKind::InvalidData.into()) }
    }
}

impl Keep for Finished<'_, '_> {
    fn exchange(&mut self, with: &mut dyn Exchange) -> io::Result<()> {
        let FinetuneReport { iterations, seconds, psnr, bits, points, .. } = self.report;
        with.count(iterations)?;
        let of_points = points.iter_mut().flat_map(|point| &mut point.psnr);
        let values = [seconds].into_iter().chain(psnr).chain(bits).chain(of_points);
        values.into_iter().try_for_each(|value| with.float(value))?;
        frame(&mut self.latent.offsets, with)
    }
}

fn frame(values: &mut GaussianFrame, with: &mut dyn Exchange) -> io::Result<()> {
    values.planes_mut().iter_mut().try_for_each(|values| floats(values, with))
}

/// Numbers that stand for themselves: a file with others is none of ours.
fn floats(values: &mut [f32], with: &mut dyn Exchange) -> io::Result<()> {
    with.floats(values)?;
    match values.iter().all(|value| value.is_finite()) {
        true => Ok(()),
        false => Err(io::ErrorKind::InvalidData.into()),
    }
}

fn compensation((scale, opacity): &mut (i8, i8), with: &mut dyn Exchange) -> io::Result<()> {
    let mut bytes = [*scale, *opacity].map(|value| value as u8);
    with.bytes(&mut bytes)?;
    [*scale, *opacity] = bytes.map(|value| value as i8);
    Ok(())
}
