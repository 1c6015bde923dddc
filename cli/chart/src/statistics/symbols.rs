//! Bits of models and of symbols.

use splatstream_decoder::block::CodedBlock;
use splatstream_decoder::context::{delta_contexts, plane_contexts};
use splatstream_format::entropy::layout::PlaneInfo;
use splatstream_format::entropy::model::{ModelTrace, PlaneModel};
use splatstream_format::entropy::token::{Alphabet, split, zigzag};

/// Adds up the bits of each plane's model: every model begins with its reuse flag.
#[derive(Default)]
pub(super) struct BitsOfPlanes {
    pub(super) bits: Vec<u64>,
}

impl ModelTrace for BitsOfPlanes {
    fn element(&mut self, name: &'static str, _: u64, bits: u64, _: i64) {
        if name == "reuse" {
            self.bits.push(0);
        }
        if let Some(last) = self.bits.last_mut() {
            *last = last.saturating_add(bits);
        }
    }
}

/// The information of a plane's symbols: 12 - log2(frequency) bits per token, and the raw bits.
pub(super) fn symbol_bits(model: &PlaneModel, info: PlaneInfo, plane: usize, block: &CodedBlock) -> f64 {
    let coded = block.coded.get(plane).map(Vec::as_slice).unwrap_or_default();
    let (contexts, values): (Vec<u8>, Vec<u64>) = match info.alphabet {
        Alphabet::Position => {
            (delta_contexts(&model.axes, &block.deltas, block.segments()), block.deltas.clone())
        }
        Alphabet::Attribute | Alphabet::Index => {
            let unsigned = |&value: &i32| match info.alphabet {
                Alphabet::Index => u64::from(value.cast_unsigned()),
                _ => u64::from(zigzag(value)),
            };
            (plane_contexts(&model.axes, plane, info, block, coded), coded.iter().map(unsigned).collect())
        }
    };
    let cost = |(index, &value): (usize, &u64)| {
        let token = split(value, model.direct_log2);
        let context = usize::from(contexts.get(index).copied().unwrap_or(0));
        let frequency = model
            .table_of_context
            .get(context)
            .and_then(|&table| model.tables.get(usize::from(table)))
            .and_then(|table| table.of_token().get(usize::from(token.token)))
            .copied()
            .unwrap_or(1);
        12.0 - f64::from(frequency.max(1)).log2() + f64::from(token.raw_bits)
    };
    values.iter().enumerate().map(cost).sum()
}
