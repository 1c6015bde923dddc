//! Values of I frames that are chosen by pictures, and not for being nearest to those of the source.
//!
//! Errors of Gaussians that are seen through each other can make up for each other. Which way a value is rounded, and where it
//! goes beyond, is [found](descent) by the slopes of what [pictures](pictures) of the decoded frame miss, and of what the
//! values [take](rate) in bits; what a decoder makes of them comes from [its own functions](latent). Order, steps, transforms
//! and codebooks stay those of the source.

mod descent;
mod latent;
mod loss;
mod means;
mod pictures;
mod rate;
mod receivers;
pub(crate) mod report;
pub(crate) mod request;
mod resumption;
mod state;
mod state_error;
mod watch;

use crate::checked::digest;
use crate::error::Error;
use crate::frame::compensation::Compensator;
use crate::frame::ladder::Ladder;
use crate::frame::residuals::Wanted;
use crate::frame::unit::UnitCoder;
use crate::refinements::parts;
use crate::settings::Settings;
use crate::value_digest::digest_of;
use descent::{Descent, Finished};
use latent::{Latent, List};
pub use loss::FinetuneLoss;
use pictures::Pictures;
use receivers::Receiver;
pub use report::{FinetuneReport, PointReport};
pub use request::{Finetune, Photograph, PointWeight};
use splatstream_decoder::layout::ShCoding;
use splatstream_decoder::list::GaussianList;
use splatstream_gaussians::GaussianFrame;
pub use state::FinetuneState;
use state::entry::{Entry, Stage};
pub use state_error::StateError;
pub use watch::{FinetuneProgress, FinetuneWatch};

impl Finetune {
    /// Whether it can be done.
    ///
    /// # Errors
    /// The first value that is out of range, an operating point that the stream will not have, or photographs of which none is
    /// left to judge by.
    pub(crate) fn check(&self, settings: &Settings) -> Result<(), Error> {
        let setting = |name, value: String, allowed| Err(Error::Setting { name, value, allowed });
        if self.iterations == 0 {
            return setting("finetune iterations", "0".to_owned(), "1 or more");
        }
        if self.time_budget.is_some_and(|budget| budget.is_zero()) {
            return setting("finetune time budget", "0 seconds".to_owned(), "more than 0");
        }
        if let Some(lines) =
            self.lines.iter().chain(&self.resolutions).find(|lines| !LINES_ALLOWED.contains(lines))
        {
            return setting("finetune lines", lines.to_string(), "1 to 8640");
        }
        if let FinetuneLoss::L1Ssim { similarity } = self.loss
            && !(0.0..=1.0).contains(&similarity)
        {
            return setting("finetune similarity", similarity.to_string(), "0 to 1");
        }
        self.check_points(settings)?;
        if (1..LEAST_PHOTOGRAPHS).contains(&self.photographs.len()) {
            let count = format!("{} photographs", self.photographs.len());
            return setting("finetune photographs", count, "none, or 8 or more: some are kept to judge by");
        }
        for Photograph { camera, picture } in &self.photographs {
            let size = [picture.width(), picture.height()];
            if size != [camera.width as usize, camera.height as usize] || size.contains(&0) {
                let value = format!("of {size:?} pixels in {}", camera.name);
                return setting("finetune photograph", value, "of as many pixels as its camera has");
            }
        }
        Ok(())
    }
}

/// Lines that a picture may have.
const LINES_ALLOWED: core::ops::RangeInclusive<u32> = 1..=8640;

/// Photographs at least, if there are any.
const LEAST_PHOTOGRAPHS: usize = 8;

/// The values that pictures want, Gaussian by Gaussian as they come.
pub(crate) struct Fitted {
    /// Of a stream with spatial layers, those of the lowest.
    pub(crate) lowest: Option<GaussianFrame>,
    /// Of the highest layer.
    pub(crate) highest: GaussianFrame,
    /// Whether the values of the highest layer are others than those of the source.
    pub(crate) is_changed: bool,
    /// What has been done, from the lowest layer up.
    pub(crate) reports: Vec<FinetuneReport>,
}

/// An I frame that is to be fitted to pictures.
pub(crate) struct Fit<'a> {
    /// Canonical.
    pub(crate) frame: &'a GaussianFrame,
    /// Its Gaussians, most important first.
    pub(crate) order: &'a [u32],
    pub(crate) coder: &'a UnitCoder<'a>,
    /// Spatial layers that the frame is coded in.
    pub(crate) layers: u8,
    pub(crate) settings: &'a Settings,
    pub(crate) finetune: &'a Finetune,
    /// What prefixes will be compensated by.
    pub(crate) compensator: Option<&'a Compensator>,
    /// The number of the frame, and a digest of it as it was read, where a state is kept.
    pub(crate) read: (u32, Option<u64>),
}

/// The values of a layer.
struct Layer {
    /// In the order of the lists.
    frame: GaussianFrame,
    lists: Vec<GaussianList>,
    is_changed: bool,
    /// None where no operating point shows it.
    report: Option<FinetuneReport>,
}

impl Fit<'_> {
    /// Fits the values.
    ///
    /// With spatial layers the lowest one, which has all Gaussians, is fitted to what its receivers see. Then it stays as it is, and
    /// what refines it is fitted to what receivers of the others see.
    ///
    /// # Errors
    /// What the decoder's own checks refuse.
    pub(crate) fn run(&self) -> Result<Fitted, Error> {
        let rows = coded_order(self.frame, self.order, self.coder, self.settings);
        let source = self.frame.select(&rows);
        let back = inverse(&rows);
        let entry = |layer| self.entry(layer, &rows);
        let first = self.layer(&source, 0, None, entry(0)?)?;
        let Some(highest) = self.layers.checked_sub(1).filter(|&highest| highest > 0) else {
            let reports = first.report.into_iter().collect();
            let is_changed = first.is_changed;
            return Ok(Fitted { lowest: None, highest: first.frame.select(&back), is_changed, reports });
        };
        let second = self.layer(&source, highest, Some(first.lists), entry(highest)?)?;
        Ok(Fitted {
            lowest: Some(first.frame.select(&back)),
            highest: second.frame.select(&back),
            is_changed: second.is_changed,
            reports: first.report.into_iter().chain(second.report).collect(),
        })
    }

    /// Where the state of a layer is kept. It belongs to this fit alone: to the settings and the frame, and to what is chosen from
    /// trial to trial, of which the order of the Gaussians is a part.
    fn entry(&self, layer: u8, rows: &[u32]) -> Result<Option<Entry>, Error> {
        let (number, Some(source)) = self.read else { return Ok(None) };
        let Settings { steps, laws, sh, structure, spatial_layers, .. } = self.settings;
        let chosen = (steps, laws, sh, structure, spatial_layers, self.layers, self.compensator.is_some());
        let of_coder = (self.coder.sequence, self.coder.colour, self.coder.grains);
        let key = digest_of(&(chosen, of_coder, rows, digest(self.frame)));
        Ok(self.finetune.state.entry((number, source), layer, key)?)
    }

    /// Fits the values of a layer. `parents`: what the lowest layer has, where this is another; `entry`: where its state is kept.
    fn layer(
        &self,
        source: &GaussianFrame,
        layer: u8,
        parents: Option<Vec<GaussianList>>,
        entry: Option<Entry>,
    ) -> Result<Layer, Error> {
        let ladder = Ladder::new(self.layers, &self.settings.refinements);
        let receivers = Receiver::of_layer(layer, self.layers, &ladder, (self.settings, self.finetune));
        let lists = self.lists(layer, &ladder, parents, &receivers);
        // Pictures show what the source has, whatever degree the stream carries of it.
        let coded = source.clone().with_sh_degree(self.coder.sequence.sh_degree)?;
        let mut latent = Latent::new(self.coder, &coded, lists)?;
        let mut report = None;
        if !receivers.is_empty() {
            report = finished(entry.as_ref(), layer, &receivers, &mut latent)?;
            if report.is_none() {
                let pictures = Pictures::new(source, self.finetune, self.settings, &receivers);
                let descent = Descent::new(latent, (receivers, pictures), self.compensator, self.finetune);
                let (fitted, done) = descent.run(layer, entry)?;
                latent = fitted;
                report = Some(done);
            }
        }
        let is_changed = latent.offsets.planes().iter().flatten().any(|&offset| offset != 0.0);
        Ok(Layer { frame: latent.frame()?, lists: latent.lists()?, is_changed, report })
    }

    /// The lists of a layer.
    fn lists(
        &self,
        layer: u8,
        ladder: &Ladder,
        parents: Option<Vec<GaussianList>>,
        receivers: &[Receiver],
    ) -> Vec<List> {
        let has_books = matches!(self.coder.colour.mode, ShCoding::VectorQuantised { .. });
        let position_bits = self.coder.sequence.position_bits;
        let mut parents = parents.map(Vec::into_iter);
        let list = |(list, rows)| List {
            rows,
            grain: ladder.grain(
                layer,
                usize::from(list),
                self.coder.grains.of(list),
                has_books,
                position_bits,
            ),
            parents: parents.as_mut().and_then(Iterator::next),
            is_fitted: receivers.iter().any(|receiver| receiver.lists.get(usize::from(list)) == Some(&true)),
        };
        (0..).zip(parts(&self.settings.refinements, self.order.len())).map(list).collect()
    }
}

/// What an earlier run has made of a layer, if it has finished it: its values go to `latent`.
fn finished(
    entry: Option<&Entry>,
    layer: u8,
    receivers: &[Receiver],
    latent: &mut Latent<'_>,
) -> Result<Option<FinetuneReport>, Error> {
    let Some(entry) = entry else { return Ok(None) };
    let mut report = FinetuneReport::of_points(layer, receivers.iter());
    let is_there = entry.read(Stage::Finished, &mut Finished { latent, report: &mut report })?;
    Ok(is_there.then_some(FinetuneReport { resumed: report.iterations, ..report }))
}

/// The Gaussians list after list, within each along the curve that they are coded along, nearly: moves may change that.
fn coded_order(frame: &GaussianFrame, order: &[u32], coder: &UnitCoder<'_>, settings: &Settings) -> Vec<u32> {
    let wanted = Wanted::new(frame, None, coder);
    let mut rows = order.to_vec();
    for part in parts(&settings.refinements, order.len()) {
        rows.get_mut(part).into_iter().for_each(|rows| rows.sort_by_cached_key(|&row| wanted.code(row, 0)));
    }
    rows
}

/// Where each row stands in an order of all of them.
fn inverse(order: &[u32]) -> Vec<u32> {
    let mut places = vec![0; order.len()];
    for (place, &row) in (0..).zip(order) {
        places.get_mut(row as usize).into_iter().for_each(|slot| *slot = place);
    }
    places
}
