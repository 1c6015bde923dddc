//! Which differences pictures are worth the bits of.
//!
//! Each difference has an error that pictures show if it is left, [estimated](super::visible_difference) from the source frame as
//! the cameras in use see it, and a number of bits that it takes. It is sent where the error is above the price of the
//! bits. The [price](super::rate_distortion) is as high as the pictures of the frame allow, or where attributes decide as
//! high as those of the frames before [allow](super::steadiness).
#![expect(clippy::arithmetic_side_effects, reason = "lengths of what is in memory; steps are clamped")]

use super::difference::{Apart, Kept};
use super::visible_difference::{Pixels, Seen, Shown};
use crate::grid::nearest_integer;
use pulp::Arch;
use splatstream_format::payload::Codebook;
use splatstream_format::syntax::SequenceParameters;
use splatstream_gaussians::GaussianFrame;
use splatstream_render::contribution::worth;
use splatstream_render::{Camera, ReferencePictures};

/// Bits of a difference of one step, and what each doubling adds; what a zero takes among others that are none.
const FIRST_BITS: f32 = 3.0;
const DOUBLING_BITS: f32 = 2.0;
const ZERO_BITS: f32 = 0.7;

/// Bits by which a Gaussian is named that moves or is updated.
const NAMED_BITS: f32 = 2.0;

/// Bits of an entry of a codebook of SH residuals.
const ENTRY_BITS: f32 = 6.0;

/// What a change of pictures from one frame to the next counts, of an error of the same size: frames that were trained
/// apart flicker where nothing moves. More where rows keep their meaning: what is left as it was costs least there.
const CALM: f32 = 0.02;
const CALM_OF_ROWS: f32 = 0.1;

/// What is further from its partner moves: the square of its distance, in widths of the Gaussian.
const STILL: f32 = 1.0;

/// Bits of a new Gaussian, nearly.
const NEW_BITS: f32 = 60.0;

/// Judges what becomes of the Gaussians of a reference. One that knows nothing has everything sent.
#[derive(Default)]
pub(crate) struct Judge {
    /// What pictures show of each Gaussian of the target.
    seen: Vec<Seen>,
    /// What pictures of the reference, displaced by its cells, lose without each of its Gaussians.
    carried: Vec<f32>,
    /// The share of the error allowed in a view that a bit is worth.
    pub(crate) price: f32,
    /// What a change counts of an error of its size.
    calm: f32,
}

/// A difference in steps, and the error of a squared step of it.
#[derive(Clone, Copy)]
struct Term {
    steps: f32,
    weight: f32,
    /// What a change counts of an error of its size.
    calm: f32,
}

impl Judge {
    /// For a source frame and what the cells bring into it. The errors of each view count as shares of the error that
    /// it may have: so many decibels are worth as much in any view. `least`: the PSNR that each of the pictures must have, dB.
    pub(crate) fn new(
        frame: &GaussianFrame,
        displaced: &GaussianFrame,
        (pictures, least): (&ReferencePictures, &[f64]),
    ) -> Self {
        let cameras = pictures.cameras().cloned().collect::<Vec<_>>();
        let mut carried = vec![0.0; displaced.len()];
        for (camera, least) in cameras.iter().zip(least) {
            let allowed = allowed(camera, *least);
            for (loss, worth) in carried.iter_mut().zip(worth(displaced, core::slice::from_ref(camera))) {
                *loss += (worth.loss / allowed) as f32;
            }
        }
        Self { seen: seen(frame, &cameras, least), carried, price: 0.0, calm: CALM }
    }

    /// For the differences of a source frame whose rows keep their meaning, seen by some cameras: nothing else of it is
    /// left to pictures.
    pub(crate) fn of_rows(frame: &GaussianFrame, (cameras, least): (&[Camera], &[f64]), price: f32) -> Self {
        Self { seen: seen(frame, cameras, least), carried: Vec::new(), price, calm: CALM_OF_ROWS }
    }

    /// Whether a Gaussian of the target that nothing continues is worth its bits.
    pub(crate) fn is_missed(&self, index: u32) -> bool {
        self.seen.get(index as usize).is_none_or(|seen| seen.loss > self.price * NEW_BITS)
    }

    /// Whether a Gaussian of the reference that nothing continues may stay: pictures hardly show it.
    pub(crate) fn may_stay(&self, from: usize) -> bool {
        self.carried.get(from).is_some_and(|&loss| loss <= self.price * NEW_BITS)
    }

    /// What is sent of the differences between a Gaussian and its partner in the target.
    pub(crate) fn kept(
        &self,
        sequence: &SequenceParameters,
        book: Option<&Codebook>,
        apart: &Apart,
        index: usize,
    ) -> Kept {
        let Some(seen) = self.seen.get(index) else { return apart.all_kept(book) };
        let shown = Shown::new(seen, &apart.pose);
        let step = sequence.position_step();
        let widths = shown.widths(apart.position.map(|steps| steps * step));
        let calm = if widths <= STILL { self.calm } else { 0.0 };
        let with_calm = |term: Term| Term { calm, ..term };
        let moves = apart.position.map(|steps| steps / apart.move_step);
        let moved = self.group(&spread(&moves, shown.moved(widths)).map(with_calm), 0.0);
        let terms: Vec<Term> = terms(sequence, apart, &shown).into_iter().map(with_calm).collect();
        let (coded, sh) = match book {
            None => (terms.as_slice(), &[][..]),
            Some(_) => terms.split_at(terms.len() - apart.sh().len()),
        };
        let (entry, gain) = book.map_or((0, 0.0), |book| self.entry(book, apart, sh));
        let mut attributes = self.group(coded, gain);
        let alone = attributes.iter().all(|&steps| steps == 0);
        let entry = if alone && gain < self.price * NAMED_BITS { 0 } else { entry };
        attributes.resize(terms.len(), 0);
        let changes = (0..).zip(attributes).map(|(attribute, steps)| steps as f32 * apart.step_of(attribute));
        let entry = book.map(|_| entry);
        Kept { moves: moved.iter().any(|&steps| steps != 0), attributes: changes.collect(), entry }
    }

    /// The entry of the codebook of SH residuals that is the best bargain, and what it wins over none, which is entry 0.
    #[expect(
        clippy::indexing_slicing,
        reason = "attributes and axes are constants; rows and entries are counted by what they index"
    )]
    fn entry(&self, book: &Codebook, apart: &Apart, terms: &[Term]) -> (i32, f32) {
        let entry = apart.nearest_entry(book);
        let values = book.entries[entry as usize * terms.len()..].iter().map(|&value| f32::from(value));
        let gain: f32 = terms.iter().zip(values).map(|(term, value)| term.gain(value)).sum();
        let gain = gain - self.price * ENTRY_BITS;
        if gain > 0.0 { (entry, gain) } else { (0, 0.0) }
    }

    /// What is sent of differences that are sent together or not at all. `gain`: what is won by sending besides.
    fn group(&self, terms: &[Term], gain: f32) -> Vec<i32> {
        let choices: Vec<(i32, f32)> = terms.iter().map(|term| self.nearest(term)).collect();
        let won: f32 = choices.iter().map(|(_, won)| won).sum();
        let named = NAMED_BITS + ZERO_BITS * terms.len() as f32;
        if won + gain > self.price * named {
            return choices.into_iter().map(|(steps, _)| steps).collect();
        }
        vec![0; terms.len()]
    }

    /// The steps that are the best bargain, and what they win over none.
    fn nearest(&self, term: &Term) -> (i32, f32) {
        let nearest = nearest_integer(term.steps / (1.0 + term.calm));
        let won = |steps: i32| term.gain(steps as f32) - self.price * (bits(steps) - ZERO_BITS);
        let mut best = (0, 0.0);
        for steps in [nearest, nearest - nearest.signum()] {
            if steps != 0 && won(steps) > best.1 {
                best = (steps, won(steps));
            }
        }
        best
    }
}

/// The sum of squared errors of a picture with this PSNR.
fn allowed(camera: &Camera, least: f64) -> f64 {
    let values = 3.0 * f64::from(camera.width) * f64::from(camera.height);
    values * libm::pow(10.0, -0.1 * least)
}

/// What pictures show of each Gaussian of a frame, as shares of the errors allowed in them.
fn seen(frame: &GaussianFrame, cameras: &[Camera], least: &[f64]) -> Vec<Seen> {
    let mut pixels = vec![0.0; frame.len()];
    let position = frame.position().each_ref().map(Vec::as_slice);
    Arch::new().dispatch(Pixels { position, cameras, pixels: &mut pixels });
    let unseen = |pixel| Seen { loss: 0.0, energy: 0.0, pixel };
    let mut seen: Vec<Seen> = pixels.into_iter().map(unseen).collect();
    for (camera, least) in cameras.iter().zip(least) {
        let allowed = allowed(camera, *least);
        for (seen, worth) in seen.iter_mut().zip(worth(frame, core::slice::from_ref(camera))) {
            seen.loss += (worth.loss / allowed) as f32;
            seen.energy += (worth.energy / allowed) as f32;
        }
    }
    seen
}

impl Term {
    /// The error that goes if so many steps are sent, less what the change counts.
    fn gain(&self, sent: f32) -> f32 {
        let left = self.steps - sent;
        self.weight * (self.steps * self.steps - left * left - self.calm * sent * sent)
    }
}

/// Differences that together make an error.
fn spread(steps: &[f32; 3], error: f32) -> [Term; 3] {
    let square: f32 = steps.iter().map(|steps| steps * steps).sum();
    steps.map(|steps| Term { steps, weight: error / square.max(f32::MIN_POSITIVE), calm: 0.0 })
}

/// All differences of attributes, in the steps that they are coded with.
#[expect(
    clippy::indexing_slicing,
    reason = "attributes and axes are constants; rows and entries are counted by what they index"
)]
fn terms(sequence: &SequenceParameters, apart: &Apart, shown: &Shown) -> Vec<Term> {
    let changes = &apart.attributes;
    let square = |step: f32| step * step;
    let of = |attribute: usize, weight: f32| {
        let step = apart.step_of(attribute);
        Term { steps: changes[attribute] / step, weight: weight * square(step), calm: 0.0 }
    };
    let mut terms = Vec::with_capacity(changes.len());
    terms
        .extend([0, 1, 2].map(|axis: usize| of(axis, shown.grown(axis) * square(sequence.log_scale_step()))));
    let from = apart.logit - changes[3] * sequence.opacity_step();
    terms.push(of(3, shown.faded(from, apart.logit) * square(sequence.opacity_step())));
    let turns = [4, 5, 6].map(|part: usize| changes[part] / apart.step_of(part));
    terms.extend(spread(&turns, shown.turned(apart.reference.rotation)));
    let harmonics = changes.len() - apart.sh().len();
    let coloured = |step: f32| shown.coloured() * square(step);
    terms.extend((7..harmonics).map(|part| of(part, coloured(sequence.dc_step()))));
    terms.extend((harmonics..changes.len()).map(|part| of(part, coloured(sequence.sh_step()))));
    terms
}

/// Bits of a difference, nearly.
fn bits(steps: i32) -> f32 {
    match steps.unsigned_abs() {
        0 => ZERO_BITS,
        size => FIRST_BITS + DOUBLING_BITS * libm::log2f(size as f32),
    }
}
