//! Values of I frames that are chosen by pictures, and not for being nearest to those of the source.
//!
//! Errors of Gaussians that are seen through each other can make up for each other. Which way a value is rounded, and where it
//! goes beyond, is [found](descent) by the slopes of what [pictures](pictures) of the decoded frame miss, and of what the
//! values [take](rate) in bits; what a decoder makes of them comes from [its own functions](latent). Order, steps, transforms
//! and codebooks stay those of the source.

mod descent;
mod latent;
mod pictures;
mod rate;

use crate::allocation::Attribute;
use crate::error::Error;
use crate::frame::ladder::Ladder;
use crate::frame::residuals::Wanted;
use crate::frame::unit::UnitCoder;
use crate::refinements::parts;
use crate::settings::Settings;
use core::time::Duration;
use descent::Descent;
use latent::{Latent, List};
use pictures::{LINES, Pictures};
use splatstream_decoder::layout::ShCoding;
use splatstream_decoder::list::GaussianList;
use splatstream_gaussians::GaussianFrame;
use splatstream_render::{Camera, Image};

/// How values of I frames are fitted to pictures.
///
/// The same settings give the same bytes on every machine, unless there is a time budget.
#[derive(Debug, Clone, PartialEq)]
pub struct Finetune {
    /// Steps of descent at most, each over two views; fewer are taken where nothing gets better. 1 or more.
    pub iterations: u32,
    /// Time for each I frame. What comes out depends on the speed of the machine then; none: on nothing but the iterations.
    pub time_budget: Option<Duration>,
    /// What pictures should show; none: what those of the source do.
    pub photographs: Vec<Photograph>,
    /// Lines of the pictures that each spatial layer is for, from the lowest up; where there are too few, 540, 720, 1080 and
    /// 2160, or of two layers 540 and 1080.
    pub lines: Vec<u32>,
    /// Attributes that keep the nearest values, to see what fitting the others is worth.
    pub held: Vec<Attribute>,
}

impl Default for Finetune {
    /// 200 iterations, against pictures of the source.
    fn default() -> Self {
        Self {
            iterations: 200,
            time_budget: None,
            photographs: Vec::new(),
            lines: Vec::new(),
            held: Vec::new(),
        }
    }
}

impl Finetune {
    /// Lines of the pictures that a layer of so many is fitted to, in turn: its own, and of the highest one those of each
    /// layer that refines the lowest.
    fn lines_of(&self, layer: u8, layers: u8) -> Vec<u32> {
        let usual = match layers {
            1 => [LINES; 4],
            2 => [LINES, 2 * LINES, 2 * LINES, 2 * LINES],
            _ => [LINES, LINES / 3 * 4, 2 * LINES, 4 * LINES],
        };
        let of = |layer: u8| {
            let place = usize::from(layer);
            self.lines.get(place).or(usual.get(place)).copied().unwrap_or(LINES)
        };
        let from = layer.min(1);
        (from..=layer).map(of).collect()
    }

    /// Whether it can be done.
    ///
    /// # Errors
    /// The first value that is out of range, or photographs of which none is left to judge by.
    pub(crate) fn check(&self) -> Result<(), Error> {
        let setting = |name, value: String, allowed| Err(Error::Setting { name, value, allowed });
        if self.iterations == 0 {
            return setting("finetune iterations", "0".to_owned(), "1 or more");
        }
        if self.time_budget.is_some_and(|budget| budget.is_zero()) {
            return setting("finetune time budget", "0 seconds".to_owned(), "more than 0");
        }
        if let Some(lines) = self.lines.iter().find(|lines| !LINES_ALLOWED.contains(lines)) {
            return setting("finetune lines", lines.to_string(), "1 to 8640");
        }
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

/// A photograph of the scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Photograph {
    /// Where it was taken; of as many pixels as the picture.
    pub camera: Camera,
    /// What it shows.
    pub picture: Image,
}

/// What fitting an I frame has done.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FinetuneReport {
    /// Display index of the frame.
    pub frame: u32,
    /// The spatial layer.
    pub spatial_layer: u8,
    /// Steps of descent that were taken.
    pub iterations: u32,
    /// How long it took.
    pub seconds: f64,
    /// Mean PSNR before and after, decibels, in views that no slope was taken of, but by which it was chosen what is kept.
    pub psnr: [f64; 2],
    /// Bits of all values but positions before and after, as their models estimate them.
    pub bits: [f64; 2],
}

/// The values that pictures want, Gaussian by Gaussian as they come.
pub(crate) struct Fitted {
    /// Of a stream with spatial layers, those of the lowest.
    pub(crate) lowest: Option<GaussianFrame>,
    /// Of the highest layer.
    pub(crate) highest: GaussianFrame,
    /// What has been done, from the lowest layer up.
    pub(crate) reports: Vec<FinetuneReport>,
}

/// Fits a canonical frame to pictures. `order`: most important first; `layers`: spatial layers.
///
/// With spatial layers the lowest one, which has all Gaussians, is fitted to pictures of the lines it is for. Then it stays as it
/// is, and what refines it is fitted to pictures of the lines of the others.
///
/// # Errors
/// What the decoder's own checks refuse.
pub(crate) fn finetuned(
    (frame, order): (&GaussianFrame, &[u32]),
    coder: &UnitCoder<'_>,
    (settings, layers): (&Settings, u8),
    finetune: &Finetune,
) -> Result<Fitted, Error> {
    let rows = coded_order(frame, order, coder, settings);
    let ordered = frame.select(&rows);
    let back = inverse(&rows);
    let ladder = Ladder::new(layers, &settings.refinements);
    let has_books = matches!(coder.colour.mode, ShCoding::VectorQuantised { .. });
    let grain = |layer: u8, list: u8| {
        let last = coder.grains.of(list);
        ladder.grain(layer, list.into(), last, has_books, coder.sequence.position_bits)
    };
    let lists = |layer: u8, parents: Option<Vec<GaussianList>>| -> Vec<List> {
        let mut parents = parents.map(Vec::into_iter);
        let parts = (0..).zip(parts(&settings.refinements, order.len()));
        let list = |(list, rows)| List {
            rows,
            grain: grain(layer, list),
            parents: parents.as_mut().and_then(Iterator::next),
        };
        parts.map(list).collect()
    };
    let run = |latent: Latent<'_>, layer: u8| {
        let pictures = Pictures::new(&ordered, finetune, settings, finetune.lines_of(layer, layers));
        let (latent, report) = Descent::new(latent, pictures, finetune).run()?;
        Ok::<_, Error>((
            latent.frame()?.select(&back),
            latent.lists()?,
            FinetuneReport { spatial_layer: layer, ..report },
        ))
    };
    let (first, parents, report) = run(Latent::new(coder, &ordered, lists(0, None))?, 0)?;
    let Some(highest) = layers.checked_sub(1).filter(|&highest| highest > 0) else {
        return Ok(Fitted { lowest: None, highest: first, reports: vec![report] });
    };
    let latent = Latent::new(coder, &ordered, lists(highest, Some(parents)))?;
    let (second, _, of_second) = run(latent, highest)?;
    Ok(Fitted { lowest: Some(first), highest: second, reports: vec![report, of_second] })
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
