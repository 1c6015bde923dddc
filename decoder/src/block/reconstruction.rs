//! Clause 7.6 for a block of new Gaussians without predictors: planes become attributes as they are decoded, while they
//! are near, and give their memory to the planes after them.
//!
//! Planes are those of the layout and come in its order, so that what is asked of a block is there; a plane of a block has as many
//! values as the part of the frame that it goes to.

use super::UnitParameters;
use crate::attribute::{self, ATTRIBUTE_RANGE, in_range};
use crate::buffers::{Buffers, left_or_new};
use crate::coded_block::CodedBlock;
use crate::colour::ShValues;
use crate::components::Components;
use crate::frame::FrameSlice;
use crate::layout::{Attribute, PlaneInfo, ShCoding};
use crate::position;
use crate::stage::Stage;
use splatstream_format::Result;

/// Index of the first plane of an attribute of a [`FrameSlice`].
const OPACITY: usize = 3;
const ROTATION: usize = 4;
const DC: usize = 7;

/// A block on its way to integer attributes.
pub(super) struct Reconstruction<'u, 'o, 'f> {
    unit: &'u UnitParameters<'u>,
    at: u64,
    out: &'o mut FrameSlice<'f>,
    /// Of dc and sh, from their first plane on.
    components: [Option<Components>; 2],
    /// The first error of the rotations. It comes after those of what is checked last.
    rotations: Result<()>,
}

impl<'u, 'o, 'f> Reconstruction<'u, 'o, 'f> {
    /// Of a block at absolute offset `at`, of as many Gaussians as `out` holds.
    pub(super) fn new(unit: &'u UnitParameters<'u>, at: u64, out: &'o mut FrameSlice<'f>) -> Self {
        Self { unit, at, out, components: [None, None], rotations: Ok(()) }
    }

    /// Takes the plane that was decoded last, number `plane`, and the memory of the one before.
    pub(super) fn take(
        &mut self,
        block: &mut CodedBlock,
        plane: usize,
        info: PlaneInfo,
        bias: i32,
        buffers: &mut Buffers,
    ) {
        let has_indices = matches!(self.unit.colour.mode, ShCoding::VectorQuantised { .. });
        match info.attribute {
            Attribute::Rotation => self.rotation(block, plane, info, bias),
            Attribute::Dc => self.component(block, plane, Stage::Dc, bias, buffers),
            Attribute::Sh if !has_indices => self.component(block, plane, Stage::Sh, bias, buffers),
            _ => return,
        }
        // What is left are the log-scales and opacities, which the block has besides, and indices.
        let before = plane.checked_sub(1).and_then(|before| block.coded.get_mut(before));
        buffers.take(before.map(core::mem::take).unwrap_or_default());
    }

    fn rotation(&mut self, block: &CodedBlock, plane: usize, info: PlaneInfo, bias: i32) {
        let place = ROTATION.wrapping_add(usize::from(info.index));
        let coded = block.coded.get(plane).map(Vec::as_slice).unwrap_or_default();
        self.out.write(place, coded);
        let values = self.out.planes.get_mut(place).map(|plane| &mut **plane).unwrap_or_default();
        let exponents = block.exponents(Stage::Rotation);
        self.rotations = self.rotations.and(attribute::rotations(values, bias, exponents, self.at));
    }

    fn component(
        &mut self,
        block: &CodedBlock,
        plane: usize,
        stage: Stage,
        bias: i32,
        buffers: &mut Buffers,
    ) {
        let [dc, sh] = &mut self.components;
        let (components, attribute) =
            if stage == Stage::Dc { (dc, Attribute::Dc) } else { (sh, Attribute::Sh) };
        let components = components.get_or_insert_with(|| {
            let planes = self.unit.layout.planes().iter();
            let rank = planes.filter(|info| info.attribute == attribute).count();
            let memory = left_or_new(&mut buffers.components);
            Components::new(block.len(), rank, block.exponents(stage), memory)
        });
        components.add(block.coded.get(plane).map(Vec::as_slice).unwrap_or_default(), bias, self.at);
    }

    /// Ends the block, all planes of which have been taken.
    ///
    /// # Errors
    /// Invalid if a value is out of range.
    pub(super) fn finish(self, block: &CodedBlock, buffers: &mut Buffers) -> Result<()> {
        let Self { unit, at, out, components, rotations } = self;
        position::positions(&block.deltas, unit.position_bits, unit.position_shift, &mut out.position, at)?;
        let log_scale = block.log_scale.each_ref().map(Vec::as_slice);
        attribute::check_log_scales(log_scale, unit.canonical_axes, at)?;
        in_range(&block.opacity, &ATTRIBUTE_RANGE, "opacity", "7.6.2", at)?;
        for (index, plane) in log_scale.into_iter().enumerate() {
            out.write(index, plane);
        }
        out.write(OPACITY, &block.opacity);
        rotations?;
        let [dc, sh] = components.map(Option::unwrap_or_default);
        let first_sh = unit.layout.planes().iter().take_while(|info| info.attribute < Attribute::Sh).count();
        let of_sh = match unit.colour.mode {
            ShCoding::VectorQuantised { .. } => ShValues::Indices {
                planes: block.coded.get(first_sh..).unwrap_or_default(),
                exponents: block.exponents(Stage::Sh),
            },
            _ => ShValues::Components(&sh),
        };
        let colour = out.planes.get_mut(DC..).unwrap_or_default();
        let reconstructed = unit.colour.reconstruct(&dc, &of_sh, colour, at);
        // The larger one is taken first from the end, and sh come after dc.
        buffers.components.extend([sh, dc].map(Components::into_memory));
        reconstructed
    }
}
