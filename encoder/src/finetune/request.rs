//! What is asked for where values are fitted to pictures.

use super::loss::FinetuneLoss;
use super::state::FinetuneState;
use super::watch::FinetuneWatch;
use crate::attribute::Attribute;
use core::time::Duration;
use splatstream_decoder::operating_point::OperatingPoint;
use splatstream_render::{Camera, Image};

/// How values of I frames are fitted to pictures. Frames that are predicted from them follow the fitted values.
///
/// Where steps are found for a PSNR or a size, a sequence with predicted frames is also tried without, and coded so where that
/// takes fewer bytes at equal PSNR; its frames are not predicted where that saves little. Not where operating points, attributes
/// or another loss are named.
///
/// The same settings give the same bytes on every machine, unless there is a time budget.
#[derive(Debug, Clone, PartialEq)]
pub struct Finetune {
    /// Steps of descent at most, each over two views; fewer are taken where nothing gets better. 1 or more.
    pub iterations: u32,
    /// Time for each I frame. What comes out depends on the speed of the machine then; none: on nothing but the iterations.
    pub time_budget: Option<Duration>,
    /// What is made small.
    pub loss: FinetuneLoss,
    /// What pictures should show; none: what those of the source do.
    pub photographs: Vec<Photograph>,
    /// Lines of the pictures that each spatial layer is for, from the lowest up; where there are too few, 540, 720, 1080 and
    /// 2160, or of two layers 540 and 1080.
    pub lines: Vec<u32>,
    /// Lines of the pictures that slopes are taken of, in turn, whatever layer they are of; none: those of the layer. What is named
    /// twice counts twice. Quality is reported at the lines of the layer in any case.
    pub resolutions: Vec<u32>,
    /// The operating points that matter, of which receivers see pictures; values that none of these points shows stay the nearest.
    /// None: all Gaussians of each spatial layer, or of the highest one where frames are predicted.
    pub optimise_for: Vec<PointWeight>,
    /// Attributes that keep the nearest values, to see what fitting the others is worth.
    pub held: Vec<Attribute>,
    /// Who is told how far it has come.
    pub watch: FinetuneWatch,
    /// Where it is kept how far it has come, so that another run can go on; by default nowhere.
    pub state: FinetuneState,
}

impl Default for Finetune {
    /// 200 iterations, by squared error, against pictures of the source.
    fn default() -> Self {
        Self {
            iterations: 200,
            time_budget: None,
            loss: FinetuneLoss::default(),
            photographs: Vec::new(),
            lines: Vec::new(),
            resolutions: Vec::new(),
            optimise_for: Vec::new(),
            held: Vec::new(),
            watch: FinetuneWatch::default(),
            state: FinetuneState::default(),
        }
    }
}

/// An operating point, and what a decibel there is worth beside one at the others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointWeight {
    /// One of the stream. Its temporal layer makes no difference to an I frame.
    pub point: OperatingPoint,
    /// Above 0; only the ratios of weights matter.
    pub weight: f64,
}

/// A photograph of the scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Photograph {
    /// Where it was taken; of as many pixels as the picture.
    pub camera: Camera,
    /// What it shows.
    pub picture: Image,
}
