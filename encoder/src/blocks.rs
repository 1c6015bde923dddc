//! Sections in blocks, which are cut from their values when they are wanted: together, with what contexts are taken from, they
//! would take twice what the values take. Codes them under models: clause 5.13.
#![expect(
    clippy::arithmetic_side_effects,
    reason = "biases are means of values of 32 bits that the layouts allow, counts are of what is in memory"
)]
#![expect(clippy::indexing_slicing, reason = "blocks are cut from planes of equal lengths")]

use crate::error::Error;
use rayon::prelude::*;
use splatstream_decoder::block::CodedBlock;
use splatstream_decoder::context;
use splatstream_decoder::increment::values::SectionValues;
use splatstream_decoder::layout::{Layout, PlaneInfo};
use splatstream_decoder::steps::StepRule;
use splatstream_format::entropy::model::PlaneModel;
use splatstream_format::entropy::token::{Alphabet, zigzag};
use splatstream_format::entropy::writer::{BlockWriter, PlaneEncoder};

/// The blocks of a section.
pub(crate) struct Blocks<'v> {
    layout: &'v Layout,
    values: &'v SectionValues,
    /// Taken off each plane.
    biases: &'v [i32],
    size: usize,
    lanes_log2: u8,
    steps: StepRule,
}

impl<'v> Blocks<'v> {
    /// Of 2^`block_log2` values a plane; `steps` are those of the unit.
    pub(crate) fn new(
        layout: &'v Layout,
        values: &'v SectionValues,
        biases: &'v [i32],
        block_log2: u8,
        steps: StepRule,
    ) -> Self {
        let size = 1 << block_log2;
        let lanes_log2 = lanes_log2(values_of_plane(layout, values).min(size));
        Self { layout, values, biases, size, lanes_log2, steps }
    }

    /// The planes of a block.
    pub(crate) fn planes(&self) -> &'v [PlaneInfo] {
        self.layout.planes()
    }

    /// What is taken off each plane.
    pub(crate) fn biases(&self) -> &'v [i32] {
        self.biases
    }

    /// log2 of the lanes of a block.
    pub(crate) fn lanes_log2(&self) -> u8 {
        self.lanes_log2
    }

    /// How many blocks there are.
    pub(crate) fn len(&self) -> usize {
        self.values().div_ceil(self.size)
    }

    /// Values of a plane.
    pub(crate) fn values(&self) -> usize {
        values_of_plane(self.layout, self.values)
    }

    /// Some of the blocks, by their numbers.
    pub(crate) fn cut(&self, numbers: impl IntoIterator<Item = usize>) -> Vec<CodedBlock> {
        let numbers: Vec<usize> = numbers.into_iter().collect();
        numbers.into_par_iter().map(|number| self.block(number)).collect()
    }

    fn block(&self, number: usize) -> CodedBlock {
        let first = first_value_plane(self.layout);
        let start = number * self.size;
        let end = self.values().min(start + self.size);
        let deltas = if first == 1 { self.values.deltas[start..end].to_vec() } else { vec![0; end - start] };
        let mut block = CodedBlock::new(deltas, self.lanes_log2, self.steps);
        for (plane, (&info, &bias)) in self.planes().iter().zip(self.biases).enumerate() {
            let coded = match plane.checked_sub(first) {
                Some(plane) => {
                    self.values.planes[plane][start..end].iter().map(|value| value - bias).collect()
                }
                None => Vec::new(),
            };
            block.push(info, coded, bias);
        }
        block
    }

    /// The bytes of all blocks; one model a plane.
    ///
    /// # Errors
    /// A value that no token codes.
    pub(crate) fn code(&self, models: &[PlaneModel]) -> Result<Vec<Vec<u8>>, Error> {
        let encoders: Vec<PlaneEncoder> = models.iter().map(PlaneEncoder::new).collect();
        let code = |number: usize| -> Result<Vec<u8>, Error> {
            let block = self.block(number);
            let mut writer = BlockWriter::new(self.lanes_log2);
            for (plane, ((&info, model), encoder)) in
                self.planes().iter().zip(models).zip(&encoders).enumerate()
            {
                let contexts = contexts(model, info, plane, &block);
                writer.plane(encoder, &contexts, unsigned_values(info, plane, &block).into_iter())?;
            }
            Ok(writer.finish())
        };
        (0..self.len()).into_par_iter().map(code).collect()
    }
}

/// The unsigned values of a plane of one block, as they are split in tokens.
pub(crate) fn unsigned_values(info: PlaneInfo, plane: usize, block: &CodedBlock) -> Vec<u64> {
    let coded = &block.coded[plane];
    match info.alphabet {
        Alphabet::Position => block.deltas.clone(),
        Alphabet::Index => coded.iter().map(|&index| u64::from(index.unsigned_abs())).collect(),
        Alphabet::Attribute => coded.iter().map(|&value| u64::from(zigzag(value))).collect(),
    }
}

/// The contexts of a plane of one block under a model; none where all of its values have context 0.
pub(crate) fn contexts(model: &PlaneModel, info: PlaneInfo, plane: usize, block: &CodedBlock) -> Vec<u8> {
    if info.is_position() {
        return context::delta_contexts(&model.axes, &block.deltas, block.segments());
    }
    context::plane_contexts(&model.axes, plane, info, block, &block.coded[plane])
}

/// The first plane that is not of the position alphabet.
pub(crate) fn first_value_plane(layout: &Layout) -> usize {
    usize::from(layout.planes().first().is_some_and(PlaneInfo::is_position))
}

fn values_of_plane(layout: &Layout, values: &SectionValues) -> usize {
    match first_value_plane(layout) {
        0 => values.planes.first().map_or(0, Vec::len),
        _ => values.deltas.len(),
    }
}

/// As many states as cost less than a tenth of a bit a Gaussian.
fn lanes_log2(block_gaussians: usize) -> u8 {
    (block_gaussians / 512).checked_ilog2().unwrap_or(0).min(5) as u8
}
