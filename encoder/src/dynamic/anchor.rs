//! Intra frames in spatial layers: each layer adds Gaussians and halves the steps of those below it.

use super::unit::{Draft, UnitCoder};
use super::{CodedUnit, Reference};
use crate::error::Error;
use crate::lattice::Geometry;
use splatstream_decoder::digest::{UnitDigest, frame_digest, unit_digest};
use splatstream_decoder::frame::QuantizedFrame;
use splatstream_decoder::frame_state::FrameState;
use splatstream_decoder::home::Home;
use splatstream_decoder::increment::Situation;
use splatstream_decoder::increment::values::{SectionValues, UnitValues};
use splatstream_decoder::layout::{Section, ShCoding};
use splatstream_decoder::position::morton;
use splatstream_format::entropy::in_force::ModelsInForce;
use splatstream_format::syntax::prefix_length;
use std::sync::Arc;

/// Share of the Gaussians, most important first, up to each spatial layer, percent.
const fn shares(layers: u8) -> &'static [u8] {
    match layers {
        0 | 1 => &[100],
        2 => &[60, 100],
        3 => &[50, 75, 100],
        _ => &[40, 60, 80, 100],
    }
}

/// A frame on the finest lattices, in the order of its source.
pub(crate) struct AnchorTarget<'a> {
    pub(crate) geometry: &'a Geometry,
    pub(crate) dc: &'a [Vec<i32>],
    /// Components, or codebook indices.
    pub(crate) sh: &'a [Vec<i32>],
    /// Most important first.
    pub(crate) order: &'a [u32],
    /// Row of each Gaussian in its file, and rows of the file.
    pub(crate) rows: &'a [u32],
    pub(crate) row_count: u32,
}

/// An intra frame being coded.
struct Anchor<'a> {
    coder: &'a UnitCoder<'a>,
    target: &'a AnchorTarget<'a>,
    homes: Vec<Home>,
    /// Gaussians of each home, by place in the target.
    members: Vec<Vec<u32>>,
    /// Components coded so far, by place in the target.
    dc: Vec<Vec<i32>>,
    sh: Vec<Vec<i32>>,
    first_models: ModelsInForce,
    models: ModelsInForce,
    units: Vec<CodedUnit>,
}

/// Codes an intra frame.
///
/// # Errors
/// What the decoder's own checks refuse.
pub(crate) fn code_anchor(
    coder: &UnitCoder<'_>,
    target: &AnchorTarget<'_>,
    predictors: super::predictors::Chooser,
) -> Result<(Vec<CodedUnit>, Reference), Error> {
    let sequence = coder.sequence;
    let refinements = usize::from(sequence.refinement_count);
    let sh_planes = usize::from(sequence.sh_dimension());
    let zeros = |planes: &[Vec<i32>]| planes.iter().map(|plane| vec![0; plane.len()]).collect::<Vec<_>>();
    let mut anchor = Anchor {
        coder,
        target,
        homes: vec![Home::empty(sh_planes); refinements],
        members: vec![Vec::new(); refinements],
        dc: zeros(target.dc),
        sh: zeros(target.sh),
        first_models: ModelsInForce::default(),
        models: ModelsInForce::default(),
        units: Vec::new(),
    };
    for layer in 0..sequence.spatial_layer_count {
        anchor.layer(layer, predictors)?;
    }
    let Anchor { homes, members, first_models, units, .. } = anchor;
    let rows = members.iter().map(|home| home.iter().map(|&place| target.rows[place as usize]).collect());
    let reference = Reference {
        rows: rows.collect(),
        row_count: target.row_count,
        state: FrameState {
            anchor: Arc::new(homes.clone()),
            carried: homes.iter().cloned().map(Some).collect(),
            homes,
            fields: Vec::new(),
            models: first_models,
        },
    };
    Ok((units, reference))
}

/// x / 2^shift to the nearest integer.
fn nearest(x: i32, shift: u8) -> i32 {
    if shift == 0 { x } else { (x + (1 << (shift - 1))) >> shift }
}

impl Anchor<'_> {
    /// Codes the units of a layer.
    fn layer(&mut self, layer: u8, predictors: super::predictors::Chooser) -> Result<(), Error> {
        let sequence = self.coder.sequence;
        let layers = sequence.spatial_layer_count;
        let shift = (layers - 1 - layer).min(sequence.position_bits - 1);
        let total = self.target.order.len() as u32;
        let end = prefix_length(shares(layers)[usize::from(layer)], total) as usize;
        let start = match layer {
            0 => 0,
            _ => prefix_length(shares(layers)[usize::from(layer) - 1], total) as usize,
        };
        let mut digests: Vec<UnitDigest> = Vec::new();
        let mut before = 0_usize;
        for refinement in 0..sequence.refinement_count {
            let after = sequence.prefix_length(refinement, total) as usize;
            let added = self.target.order.get(start.max(before)..end.min(after)).unwrap_or_default();
            before = after;
            self.unit(layer, refinement, shift, added.to_vec(), &mut digests, predictors)?;
        }
        Ok(())
    }

    fn unit(
        &mut self,
        layer: u8,
        refinement: u8,
        shift: u8,
        mut added: Vec<u32>,
        digests: &mut Vec<UnitDigest>,
        predictors: super::predictors::Chooser,
    ) -> Result<(), Error> {
        let home = usize::from(refinement);
        let parents = self.homes[home].clone();
        added.sort_by_key(|&place| (self.code(place, shift), place));
        let mut draft = Draft { header: self.coder.blank(), values: UnitValues::default() };
        draft.header.position_shift = shift;
        let book = matches!(self.coder.colour.mode, ShCoding::VectorQuantised { .. });
        draft.header.attribute_shift = [shift, shift, shift, shift, if book { 0 } else { shift }];
        self.refine(&mut draft, &parents, home, shift);
        self.add(&mut draft, &added, shift);
        let lower: Vec<&QuantizedFrame> = self.homes[..home].iter().map(|home| &home.planes).collect();
        let situation = Situation { around: [&lower, &[]], parents_follow: true };
        let applied = predictors
            .choose(self.coder, &mut draft, &parents, &situation, &added, |place| self.wanted(place))?;
        let mut models = if refinement == 0 { self.first_models.clone() } else { self.models.clone() };
        let sections = self.coder.sections(&draft, &mut models)?;
        if refinement == 0 {
            self.first_models = models.clone();
        }
        self.models = models;
        digests.push(unit_digest(&applied.home.planes, 0..applied.home.len()));
        draft.header.refinement_digest = frame_digest(digests);
        draft.header.carried_digest = frame_digest(&[]);
        self.units.push(CodedUnit {
            spatial_layer: layer,
            refinement,
            payload: self.coder.payload(&draft.header, &sections)?,
            header: draft.header,
            predicted: super::predictors::used(&draft),
        });
        self.homes[home] = applied.home;
        self.members[home].extend(added);
        Ok(())
    }

    fn code(&self, place: u32, shift: u8) -> u64 {
        let [x, y, z] = self.target.geometry.position.each_ref().map(|plane| plane[place as usize] >> shift);
        morton(x, y, z)
    }

    /// The integers a Gaussian shall have in the end: log-scales, opacity, rotation.
    fn wanted(&self, place: u32) -> ([i32; 3], i32, [i32; 3]) {
        let place = place as usize;
        let geometry = self.target.geometry;
        let of = |planes: &[Vec<i32>; 3]| planes.each_ref().map(|plane| plane[place]);
        (of(&geometry.log_scale), geometry.opacity[place], of(&geometry.rotation))
    }

    /// Halves the steps of what lower layers have coded.
    fn refine(&mut self, draft: &mut Draft, parents: &Home, home: usize, shift: u8) {
        let members = &self.members[home];
        if members.is_empty() {
            return;
        }
        let count = members.len() as u32;
        (draft.header.parent_count, draft.header.move_count, draft.header.update_count) =
            (count, count, count);
        let block = 1 << self.coder.sequence.block_log2;
        let section = |planes| SectionValues { deltas: Vec::new(), planes, block };
        draft.values.set(Section::Modes, section(vec![vec![3; members.len()]]));
        let moves = (0..3).map(|axis: usize| {
            let wanted = &self.target.geometry.position[axis];
            let now = &parents.planes.position[axis];
            let residual = |(&place, &now): (&u32, &u32)| wanted[place as usize] as i32 - now as i32;
            members.iter().zip(now).map(residual).map(|x| nearest(x, shift)).collect()
        });
        draft.values.set(Section::Moves, section(moves.collect()));
        let mut planes: Vec<Vec<i32>> = vec![Vec::with_capacity(members.len()); 7];
        for (row, &place) in members.iter().enumerate() {
            let (scales, opacity, rotation) = self.wanted(place);
            let now = parents.planes.log_scale.each_ref().map(|plane| plane[row]);
            let residuals = scale_residuals(now, scales, shift);
            planes.iter_mut().zip(residuals).for_each(|(plane, value)| plane.push(value));
            planes[3].push(nearest(opacity - parents.planes.opacity[row], shift));
            for axis in 0..3 {
                planes[4 + axis].push(nearest(rotation[axis] - parents.planes.rotation[axis][row], shift));
            }
        }
        let members = members.clone();
        planes.extend(components(self.target.dc, &mut self.dc, &members, shift));
        match self.coder.colour.mode {
            ShCoding::None => {}
            ShCoding::Coefficients { .. } => {
                planes.extend(components(self.target.sh, &mut self.sh, &members, shift));
            }
            // Entry 0 is zero: a codebook refines nothing.
            ShCoding::VectorQuantised { .. } => {
                planes.extend(self.target.sh.iter().map(|_| vec![0; members.len()]));
            }
        }
        draft.values.set(Section::Updates, section(planes));
    }

    /// The values of new Gaussians without prediction.
    fn add(&mut self, draft: &mut Draft, added: &[u32], shift: u8) {
        draft.header.new_count = added.len() as u32;
        let block = 1 << self.coder.sequence.block_log2;
        let codes: Vec<u64> = added.iter().map(|&place| self.code(place, shift)).collect();
        let mut planes: Vec<Vec<i32>> = vec![Vec::with_capacity(added.len()); 7];
        for &place in added {
            let (scales, opacity, rotation) = self.wanted(place);
            let residuals = scale_residuals([0; 3], scales, shift);
            planes.iter_mut().zip(residuals).for_each(|(plane, value)| plane.push(value));
            planes[3].push(nearest(opacity, shift));
            (0..3).for_each(|axis| planes[4 + axis].push(nearest(rotation[axis], shift)));
        }
        planes.extend(components(self.target.dc, &mut self.dc, added, shift));
        match self.coder.colour.mode {
            ShCoding::None => {}
            ShCoding::Coefficients { .. } => {
                planes.extend(components(self.target.sh, &mut self.sh, added, shift));
            }
            ShCoding::VectorQuantised { .. } => {
                let pick = |plane: &Vec<i32>| added.iter().map(|&place| plane[place as usize]).collect();
                planes.extend(self.target.sh.iter().map(pick));
            }
        }
        draft.values.set(Section::New, SectionValues { deltas: deltas(&codes, block), planes, block });
    }
}

/// Differences of rising codes; they start anew in each block.
pub(crate) fn deltas(codes: &[u64], block: usize) -> Vec<u64> {
    let before = |place: usize| if place % block == 0 { 0 } else { codes[place - 1] };
    codes.iter().enumerate().map(|(place, &code)| code - before(place)).collect()
}

/// What brings log-scales near those wanted: of the largest, and of the two differences (7.16).
pub(crate) fn scale_residuals(now: [i32; 3], wanted: [i32; 3], shift: u8) -> [i32; 3] {
    let first = nearest(wanted[0] - now[0], shift);
    let largest = now[0] + (first << shift);
    let second = nearest(largest - wanted[1] - (now[0] - now[1]), shift);
    let middle = largest - (now[0] - now[1]) - (second << shift);
    let third = nearest(middle - wanted[2] - (now[1] - now[2]), shift);
    [first, second, third]
}

/// Residuals of components, which join what is coded of them.
fn components(wanted: &[Vec<i32>], coded: &mut [Vec<i32>], places: &[u32], shift: u8) -> Vec<Vec<i32>> {
    let of_plane = |(wanted, coded): (&Vec<i32>, &mut Vec<i32>)| {
        let mut residual = |&place: &u32| {
            let place = place as usize;
            let value = nearest(wanted[place] - coded[place], shift);
            coded[place] += value << shift;
            value
        };
        places.iter().map(&mut residual).collect()
    };
    wanted.iter().zip(coded).map(of_plane).collect()
}
