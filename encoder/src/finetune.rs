//! Values of I frames that are chosen by pictures.

mod descent;
mod latent;
mod pictures;
mod rate;

use crate::error::Error;
use crate::frame::unit::UnitCoder;
use crate::refinements::parts;
use descent::Descent;
use latent::{Latent, List};
use splatstream_gaussians::GaussianFrame;
use splatstream_render::Camera;

/// How values are fitted to pictures.
#[derive(Debug, Clone, PartialEq)]
pub struct Finetune {
    /// Steps of descent, each over a few views.
    pub iterations: u32,
}

/// The values of a canonical frame that pictures want, Gaussian by Gaussian as they come.
pub(crate) fn finetuned(
    frame: &GaussianFrame,
    order: &[u32],
    coder: &UnitCoder<'_>,
    refinements: &[u8],
    finetune: &Finetune,
    cameras: &[Camera],
) -> Result<GaussianFrame, Error> {
    let ordered = frame.select(order);
    let lists = (0..).zip(parts(refinements, order.len()));
    let lists = lists.map(|(refinement, rows)| List { rows, grain: coder.grains.of(refinement) }).collect();
    let latent = Latent::new(coder, &ordered, lists)?;
    let mut descent = Descent::new(latent, finetune, cameras)?;
    descent.run()?;
    let fitted = descent.latent.frame()?;
    let mut back = vec![0; order.len()];
    order.iter().zip(0..).for_each(|(&row, place)| back[row as usize] = place);
    Ok(fitted.select(&back))
}
