//! Inside a refinement: the models bit by bit, the blocks section by section.

use super::{Element, Inspector, variable_row};
use crate::Result;
use crate::entropy::in_force::{ModelsInForce, ModelsOfFrame};
use crate::entropy::layout::{Layout, PlaneInfo, ShCoding};
use crate::entropy::model::{ModelTrace, PlaneModel, Source, read_models};
use crate::payload::{Refinement, leb128};
use crate::syntax::{FrameHeader, GopHeader, TransformHeader, TransformKind, after};

/// What the models of a unit depend on: the ranks of the transforms, and the models before.
#[derive(Default)]
pub(super) struct Coding {
    gop: Option<(GopHeader, u32)>,
    dc_ranks: [u8; 16],
    sh_ranks: [u8; 16],
    pub(super) frame_ranks: (u8, u8),
    before: Option<(Layout, Vec<PlaneModel>)>,
    /// Display index of the frame.
    frame: u32,
    /// The models in force for its next unit.
    pub(super) in_force: ModelsOfFrame,
    /// Earlier frames of the group, and the models for those that refer to them.
    earlier: Vec<(u32, ModelsInForce)>,
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
        self.before = None;
        let reference = self.gop.and_then(|(gop, first)| {
            let place = gop.place(number.checked_sub(first)?);
            first.checked_add(place.reference?)
        });
        self.earlier.push((self.frame, core::mem::take(&mut self.in_force.first)));
        self.frame = number;
        let mut frames = self.earlier.iter().rev();
        let found = frames.find(|(number, _)| reference == Some(*number));
        self.in_force.first = found.map(|(_, models)| models.clone()).unwrap_or_default();
    }
}

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
    fn text(&self) -> String {
        let source = match self.name {
            "source_a" | "source_b" => u8::try_from(self.value).ok().and_then(Source::from_code),
            _ => None,
        };
        source.map_or(self.value.to_string(), |source| format!("{} ({})", self.value, source.name()))
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
    /// The elements of the models of a refinement.
    pub(super) fn refinement_models(&mut self, refinement: &Result<Refinement<'_>>, model: &[u8], at: u64) {
        let mut elements = Elements::default();
        let read = match refinement {
            Ok(refinement) => self.read(refinement, model, at, &mut elements),
            Err(error) => Err(*error),
        };
        self.models("refinement", &elements, read.as_ref(), model, at);
    }

    /// The elements of a model section; one element for all of it where it cannot be read.
    pub(super) fn models(
        &mut self,
        record: &str,
        elements: &Elements,
        read: core::result::Result<&Layout, &crate::Error>,
        model: &[u8],
        at: u64,
    ) {
        match read {
            Ok(layout) if !model.is_empty() => self.show_models(&elements.list, layout.planes(), model, at),
            Ok(_) => self.variable(record, "models", at, 0, "0 bytes".into()),
            Err(error) => {
                let value = format!("{} bytes, not readable: {}", model.len(), error.kind);
                self.variable(record, "models", at, model.len(), value);
            }
        }
    }

    fn read(
        &mut self,
        refinement: &Refinement<'_>,
        model: &[u8],
        at: u64,
        trace: &mut Elements,
    ) -> Result<Layout> {
        let (dc, sh) = self.coding.frame_ranks;
        let layout = Layout::new(dc, ShCoding::of(&refinement.header.sh(), sh));
        if refinement.header.gaussian_count > 0 {
            let before = self.coding.before.as_ref().map(|(layout, models)| (layout, models.as_slice()));
            let reusable = layout.reusable(before);
            let models = read_models(model, at, &layout.alphabets(), &reusable, trace)?;
            self.coding.before = Some((layout.clone(), models));
        }
        Ok(layout)
    }

    fn show_models(&mut self, elements: &[ModelElement], planes: &[PlaneInfo], model: &[u8], at: u64) {
        let first_bit = at.saturating_mul(8);
        let mut end = 0;
        for element in elements {
            let plane = planes.get(element.plane);
            let meaning =
                plane.map_or(String::new(), |plane| format!("{} {}", plane.attribute.name(), plane.place));
            (self.visit)(Element {
                at_bit: first_bit.saturating_add(element.bit),
                bits: element.bits,
                record: "plane_model",
                name: element.name.into(),
                value: element.text(),
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
                value: "0".into(),
                meaning: "up to the end of the byte".into(),
                clause: "5.12",
            });
        }
    }

    /// The sections of a block; one element for all of it where it cannot be divided.
    pub(super) fn block(&mut self, record: &str, place: usize, block: &[u8], at: u64, lanes_log2: u8) {
        let states = 4_usize.wrapping_shl(u32::from(lanes_log2));
        let divided = leb128(block, at, "word_count", "5.13").ok().and_then(|(word_count, rest)| {
            let words = usize::try_from(word_count).ok()?.checked_mul(2)?;
            let raw = rest.len().checked_sub(states)?.checked_sub(words)?;
            Some((word_count, block.len().saturating_sub(rest.len()), words, raw))
        });
        let Some((word_count, head, words, raw)) = divided else {
            if let Some(row) = variable_row(record, "blocks") {
                let (name, value) = (format!("blocks[{place}]"), format!("{} bytes", block.len()));
                self.show(at, block.len(), name.into(), value, row.meaning, row.clause, row.record);
            }
            return;
        };
        let parts = [
            ("word_count", head, word_count.to_string(), "16-bit words of the block"),
            ("state", states, hexadecimal(block, head, states, 4), "states of the lanes"),
            ("word", words, summary(block, head.saturating_add(states), words), "words, in the order of use"),
            ("raw_bits", raw, format!("{raw} bytes"), "raw bits of the values"),
        ];
        let mut offset = at;
        for (name, bytes, value, meaning) in parts {
            if bytes > 0 {
                let name = format!("blocks[{place}].{name}");
                self.show(offset, bytes, name.into(), value, meaning, "5.13", "block");
            }
            offset = after(offset, bytes);
        }
    }
}

/// Numbers of `width` bytes, little-endian, in hexadecimal.
fn hexadecimal(bytes: &[u8], start: usize, length: usize, width: usize) -> String {
    let section = bytes.get(start..start.saturating_add(length)).unwrap_or_default();
    let digits = |number: &[u8]| number.iter().rev().map(|byte| format!("{byte:02x}")).collect::<String>();
    let numbers: Vec<String> = section.chunks(width).map(digits).collect();
    format!("[{}]", numbers.join(", "))
}

/// A few words in full, many by their number.
fn summary(bytes: &[u8], start: usize, length: usize) -> String {
    const FEW: usize = 32;
    if length <= FEW { hexadecimal(bytes, start, length, 2) } else { format!("{length} bytes") }
}
