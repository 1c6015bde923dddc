//! Inside a section: the models bit by bit, the blocks part by part.

use super::decode_value::little_endian;
use super::{Element, Inspector, Number, Value};
use crate::entropy::in_force::{ModelsInForce, ModelsOfFrame, SectionModels};
use crate::entropy::layout::{Layout, PlaneInfo, ShCoding};
use crate::entropy::model::{ModelTrace, Source, read_models};
use crate::payload::{CodedSection, leb128};
use crate::syntax::reader::Traced;
use crate::syntax::{FrameHeader, GopHeader, ShHeader, TransformHeader, TransformKind, after};
use std::collections::BTreeMap;

/// What the models of a unit depend on: the ranks of the transforms, and the models before.
#[derive(Default)]
pub(super) struct Coding {
    gop: Option<(GopHeader, u32)>,
    dc_ranks: [u8; 16],
    sh_ranks: [u8; 16],
    frame_ranks: (u8, u8),
    /// Display index of the frame.
    frame: u32,
    /// The models in force for its next unit.
    pub(super) in_force: ModelsOfFrame,
    /// Earlier frames of the GOP, and the models for those that refer to them.
    earlier: BTreeMap<u32, ModelsInForce>,
}

impl Coding {
    pub(super) fn of_gop(header: GopHeader, first: u32) -> Self {
        Self { gop: Some((header, first)), ..Self::default() }
    }

    pub(super) fn define(&mut self, header: &TransformHeader) {
        let ranks = match header.kind() {
            Some(TransformKind::Sh) => &mut self.sh_ranks,
            _ => &mut self.dc_ranks,
        };
        if let Some(rank) = ranks.get_mut(usize::from(header.transform_id)) {
            *rank = header.rank;
        }
    }

    pub(super) fn start_frame(&mut self, header: &FrameHeader, number: u32) {
        let rank = |ranks: &[u8; 16], id: u8| ranks.get(usize::from(id)).copied().unwrap_or(0);
        self.frame_ranks =
            (rank(&self.dc_ranks, header.dc_transform_id), rank(&self.sh_ranks, header.sh_transform_id));
        let reference = self.gop.and_then(|(gop, first)| {
            let role = gop.role(number.checked_sub(first)?);
            first.checked_add(role.reference?)
        });
        self.earlier.insert(self.frame, core::mem::take(&mut self.in_force.first));
        self.frame = number;
        let of_reference = reference.and_then(|reference| self.earlier.get(&reference));
        self.in_force.first = of_reference.cloned().unwrap_or_default();
    }
}

/// The parts of a block, elements of the record `block`: names, which come after `blocks[INDEX].`, and meanings.
pub const BLOCK_PARTS: [(&str, &str); 4] = [
    ("word_count", "16-bit words of the block"),
    ("state", "states of the lanes"),
    ("word", "words, in the order of use"),
    ("raw_bits", "raw bits of the values"),
];

/// One element of a model as the trace reports it; the plane it belongs to is the number of `reuse` flags.
struct ModelElement {
    name: &'static str,
    bit: u64,
    bits: u64,
    value: i64,
    plane: usize,
}

impl ModelElement {
    /// The value, with the name of the source where it is one.
    fn shown(&self) -> Value {
        let source = match self.name {
            "source_a" | "source_b" => u8::try_from(self.value).ok(),
            _ => None,
        };
        source
            .and_then(|code| Some(Value::code(code.into(), Source::from_code(code)?.name())))
            .unwrap_or(Value::Number(Number::Signed(self.value)))
    }
}

/// The elements of a model section as they are read.
#[derive(Default)]
pub(super) struct Elements {
    list: Vec<ModelElement>,
    planes: usize,
}

impl ModelTrace for Elements {
    fn element(&mut self, name: &'static str, bit: u64, bits: u64, value: i64) {
        if name == "reuse" {
            self.planes = self.planes.wrapping_add(1);
        }
        self.list.push(ModelElement { name, bit, bits, value, plane: self.planes.wrapping_sub(1) });
    }
}

impl Inspector<'_> {
    /// The elements of the sections of a unit, which could be divided: `trace` is what was read of them, `sections`
    /// what it was. Without `refinement` the section is that of a frame header.
    pub(super) fn sections(
        &mut self,
        trace: &[Traced<'_>],
        sections: &[CodedSection<'_>],
        sh: &ShHeader,
        refinement: Option<u8>,
    ) {
        let mut models = self.coding.in_force.before(refinement.unwrap_or(0)).clone();
        let mut sections = sections.iter();
        let mut current = None;
        for traced in trace {
            if traced.element == "lanes_log2" {
                current = sections.next();
            }
            let Some(coded) = current else { continue };
            match (traced.element, traced.index) {
                ("lanes_log2", _) => {
                    self.traced(traced, Value::code(coded.lanes_log2.into(), coded.section.name()));
                }
                ("models", _) => self.models(traced, coded, sh, &mut models),
                ("blocks", Some(block)) => self.block(block, traced, coded.lanes_log2),
                _ => self.plain(traced),
            }
        }
        match refinement {
            Some(refinement) => self.coding.in_force.follow(refinement, models),
            None => self.coding.in_force.first = models,
        }
    }

    /// The elements of the models of a section; one element for all of them where they cannot be read.
    fn models(
        &mut self,
        traced: &Traced<'_>,
        coded: &CodedSection<'_>,
        sh: &ShHeader,
        models: &mut ModelsInForce,
    ) {
        let (dc_rank, sh_rank) = self.coding.frame_ranks;
        let layout = Layout::of_section(coded.section, dc_rank, ShCoding::of(sh, sh_rank));
        let mut elements = Elements::default();
        let reusable = models.reusable(coded.section, &layout);
        let read = read_models(coded.model, coded.model_at, &layout.alphabets(), &reusable, &mut elements);
        match read {
            Ok(_) if coded.model.is_empty() => self.traced(traced, Value::Bytes(0)),
            Ok(read) => {
                self.show_models(&elements.list, layout.planes(), coded.model, coded.model_at);
                models.replace(coded.section, SectionModels { layout, models: read });
            }
            Err(error) => {
                let words = format!("{} bytes, not readable: {}", coded.model.len(), error.kind);
                self.traced(traced, Value::Words(words));
            }
        }
    }

    fn show_models(&mut self, elements: &[ModelElement], planes: &[PlaneInfo], model: &[u8], at: u64) {
        let first_bit = at.saturating_mul(8);
        let mut end = 0;
        for element in elements {
            let plane = planes.get(element.plane);
            let meaning =
                plane.map_or(String::new(), |plane| format!("{} {}", plane.attribute.name(), plane.index));
            (self.visit)(Element {
                at_bit: first_bit.saturating_add(element.bit),
                bits: element.bits,
                record: "plane_model",
                name: element.name.into(),
                value: element.shown(),
                meaning: meaning.into(),
                clause: "5.12",
            });
            end = element.bit.saturating_add(element.bits);
        }
        let bits = after(0, model.len()).saturating_mul(8).saturating_sub(end);
        if bits > 0 {
            (self.visit)(Element {
                at_bit: first_bit.saturating_add(end),
                bits,
                record: "plane_model",
                name: "padding".into(),
                value: Value::Number(Number::Unsigned(0)),
                meaning: "up to the end of the byte".into(),
                clause: "5.12",
            });
        }
    }

    /// The parts of a block; one element for all of it where it cannot be divided.
    fn block(&mut self, index: usize, traced: &Traced<'_>, lanes_log2: u8) {
        let (block, at) = (traced.bytes, traced.at);
        let states = 4_usize.wrapping_shl(u32::from(lanes_log2));
        let divided = leb128(block, at, "word_count", "5.13").ok().and_then(|(word_count, rest)| {
            let words = usize::try_from(word_count).ok()?.checked_mul(2)?;
            let raw = rest.len().checked_sub(states)?.checked_sub(words)?;
            Some((word_count, block.len().saturating_sub(rest.len()), words, raw))
        });
        let Some((word_count, head, words, raw)) = divided else {
            return self.traced(traced, Value::Bytes(block.len()));
        };
        let parts = [
            (head, Value::Number(Number::Unsigned(word_count.into()))),
            (states, hexadecimal(block, head, states, 4)),
            (words, summary(block, head.saturating_add(states), words)),
            (raw, Value::Bytes(raw)),
        ];
        let mut offset = at;
        for ((name, meaning), (bytes, value)) in BLOCK_PARTS.into_iter().zip(parts) {
            if bytes > 0 {
                let name = format!("blocks[{index}].{name}");
                self.show(offset, bytes, name.into(), value, meaning, "5.13", "block");
            }
            offset = after(offset, bytes);
        }
    }
}

/// Numbers of `width` bytes, little-endian.
fn hexadecimal(bytes: &[u8], start: usize, length: usize, width: usize) -> Value {
    let section = bytes.get(start..start.saturating_add(length)).unwrap_or_default();
    let numbers = section.chunks(width).map(little_endian).collect();
    Value::Hexadecimals { numbers, bytes: width }
}

/// A few words in full, many by their number.
fn summary(bytes: &[u8], start: usize, length: usize) -> Value {
    const FEW: usize = 32;
    if length <= FEW { hexadecimal(bytes, start, length, 2) } else { Value::Bytes(length) }
}
