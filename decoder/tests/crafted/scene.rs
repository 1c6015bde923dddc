//! Values of sequence, tools, frames and Gaussians, and the units that carry them.

use super::coding::{Coding, Row};
use super::reference::{canonical_planes, frame_digest, plane_digests, prefix};
use super::{Part, Script};
use splatstream_format::entropy::frequencies::Frequencies;
use splatstream_format::entropy::layout::{Layout, PlaneInfo, ShCoding};
use splatstream_format::entropy::model::{ContextAxis, PlaneModel, write_models};
use splatstream_format::payload::{Codebook, Transform, write_leb128};
use splatstream_format::syntax::{
    CodebookHeader, FrameHeader, GopHeader, NO_TRANSFORM, Profile, SequenceParameters, TransformHeader,
    UnitId, UnitType,
};
use std::collections::BTreeMap;

/// The values `v` of 8.1 of one Gaussian.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Gaussian {
    pub(crate) delta: u64,
    pub(crate) log_scale: [i64; 3],
    pub(crate) opacity: i64,
    pub(crate) rotation: [i64; 3],
    pub(crate) dc: Vec<i64>,
    pub(crate) sh: Vec<i64>,
}

/// What a test wants of the model of a plane; tables follow from the values unless they are given.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Shape {
    pub(crate) bias: i32,
    pub(crate) direct_log2: u8,
    pub(crate) axes: [ContextAxis; 2],
    pub(crate) tables: Option<(Vec<Frequencies>, Vec<u8>)>,
}

impl Default for Shape {
    fn default() -> Self {
        Self { bias: 0, direct_log2: 3, axes: [ContextAxis::NONE, ContextAxis::NONE], tables: None }
    }
}

#[derive(Debug, Clone, Default)]
pub(crate) struct Unit {
    pub(crate) gaussians: Vec<Gaussian>,
    pub(crate) position_shift: u8,
    pub(crate) lanes_log2: u8,
    pub(crate) sh_mode: u8,
    pub(crate) codebook_ids: Vec<u8>,
    /// By plane; the default for planes that are not named.
    pub(crate) shapes: BTreeMap<usize, Shape>,
    /// Models of the unit before, where they can code the values of the plane.
    pub(crate) reuse: bool,
    /// In place of what follows from the values.
    pub(crate) digest: Option<u64>,
    pub(crate) count: Option<u32>,
    pub(crate) section: Option<Vec<u8>>,
    pub(crate) blocks: Option<Vec<Vec<u8>>>,
}

#[derive(Debug, Clone)]
pub(crate) struct Frame {
    pub(crate) dc_transform: u8,
    pub(crate) sh_transform: u8,
    /// In place of the Gaussians there are.
    pub(crate) count: Option<u32>,
    pub(crate) units: Vec<Unit>,
}

#[derive(Debug, Clone, Default)]
pub(crate) struct Gop {
    pub(crate) transforms: Vec<Transform>,
    pub(crate) codebooks: Vec<Codebook>,
    pub(crate) frames: Vec<Frame>,
}

#[derive(Debug, Clone)]
pub(crate) struct Scene {
    pub(crate) level: u8,
    pub(crate) sequence: SequenceParameters,
    pub(crate) gops: Vec<Gop>,
    pub(crate) index: bool,
}

/// What the units of a frame refer to.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Tools<'a> {
    pub(crate) dc: &'a Transform,
    pub(crate) sh: Option<&'a Transform>,
    pub(crate) codebooks: &'a [Codebook],
}

impl Gop {
    pub(crate) fn tools(&self, frame: &Frame) -> Option<Tools<'_>> {
        let find = |kind: u8, id: u8| {
            let mut transforms = self.transforms.iter();
            transforms.find(|it| (it.header.transform_kind, it.header.transform_id) == (kind, id))
        };
        Some(Tools {
            dc: find(0, frame.dc_transform)?,
            sh: find(1, frame.sh_transform),
            codebooks: &self.codebooks,
        })
    }
}

/// A transform whose basis is the unit matrix as far as it goes, times `weight`.
pub(crate) fn diagonal(id: u8, kind: u8, dimension: u8, rank: u8, weight: i16, mean: i32) -> Transform {
    let header = TransformHeader { transform_id: id, transform_kind: kind, dimension, rank };
    let mut basis = vec![0; usize::from(rank) * usize::from(dimension)];
    for k in 0..usize::from(rank) {
        basis[k * usize::from(dimension) + k] = weight;
    }
    Transform { header, mean: vec![mean; dimension.into()], basis }
}

pub(crate) fn codebook(id: u8, components: u8, value_bytes: u8, entries: Vec<i16>) -> Codebook {
    let count = entries.len() / usize::from(components);
    let header = CodebookHeader {
        codebook_id: id,
        component_count: components,
        entry_count_minus1: (count - 1) as u16,
        value_bytes,
    };
    Codebook { header, entries }
}

impl Unit {
    pub(crate) fn sh_coding(&self, tools: &Tools<'_>) -> ShCoding {
        match self.sh_mode {
            1 => ShCoding::Coefficients { rank: tools.sh.map_or(0, |transform| transform.header.rank) },
            2 => ShCoding::VectorQuantised { stages: self.codebook_ids.len() as u8 },
            _ => ShCoding::None,
        }
    }

    pub(crate) fn layout(&self, tools: &Tools<'_>) -> Layout {
        Layout::new(tools.dc.header.rank, self.sh_coding(tools))
    }

    /// The values of the Gaussians, entry by entry.
    pub(crate) fn rows(&self) -> Vec<Row> {
        self.gaussians.iter().map(Gaussian::row).collect()
    }

    fn coding<'c>(&'c self, planes: &'c [PlaneInfo], rows: &'c [Row], block_log2: u8) -> Coding<'c> {
        Coding { planes, rows, shapes: &self.shapes, lanes_log2: self.lanes_log2, block_log2 }
    }

    /// A model for each plane whose tables fit the values.
    pub(crate) fn models(&self, planes: &[PlaneInfo], block_log2: u8) -> Vec<PlaneModel> {
        self.coding(planes, &self.rows(), block_log2).models()
    }

    /// The blocks coded with models.
    pub(crate) fn coded_blocks(
        &self,
        planes: &[PlaneInfo],
        models: &[PlaneModel],
        block_log2: u8,
    ) -> Vec<Vec<u8>> {
        self.coding(planes, &self.rows(), block_log2).blocks(models)
    }

    /// The payload, and models for a unit after this one to reuse.
    fn payload(
        &self,
        sequence: &SequenceParameters,
        tools: &Tools<'_>,
        before: &mut Option<(Layout, Vec<PlaneModel>)>,
        digest: u64,
    ) -> Vec<u8> {
        let layout = self.layout(tools);
        let planes = layout.planes();
        let mut models =
            if self.gaussians.is_empty() { Vec::new() } else { self.models(planes, sequence.block_log2) };
        let earlier = before.as_ref().map(|(layout, models)| (layout, models.as_slice()));
        let same_planes = layout.reusable(earlier);
        let reused: Vec<PlaneModel> = models
            .iter()
            .zip(&same_planes)
            .map(|(own, earlier)| earlier.filter(|_| self.reuse).unwrap_or(own).clone())
            .collect();
        models = reused;
        let previous: Option<Vec<PlaneModel>> = same_planes.iter().map(|model| model.cloned()).collect();
        let section = self.section.clone().unwrap_or_else(|| {
            if models.is_empty() {
                return Vec::new();
            }
            write_models(&models, &layout.alphabets(), previous.as_deref().filter(|_| self.reuse))
        });
        let blocks = self.blocks.clone();
        let blocks = blocks.unwrap_or_else(|| self.coded_blocks(planes, &models, sequence.block_log2));
        if !models.is_empty() {
            *before = Some((layout.clone(), models));
        }
        let mut bytes = self.digest.unwrap_or(digest).to_le_bytes().to_vec();
        bytes.extend(self.count.unwrap_or(self.gaussians.len() as u32).to_le_bytes());
        bytes.extend([self.position_shift, self.lanes_log2, self.sh_mode, self.codebook_ids.len() as u8]);
        let ids = self.codebook_ids.iter().copied().chain([255; 4]).take(4);
        bytes.extend(ids);
        write_leb128(section.len() as u32, &mut bytes);
        bytes.extend(section);
        blocks.iter().for_each(|block| write_leb128(block.len() as u32, &mut bytes));
        bytes.extend(blocks.concat());
        bytes
    }
}

impl Gaussian {
    /// The values in plane order.
    pub(crate) fn row(&self) -> Row {
        let (dc, sh) = (self.dc.iter().copied(), self.sh.iter().copied());
        let signed = self.log_scale.into_iter().chain([self.opacity]).chain(self.rotation);
        Row { delta: Some(self.delta), signed: signed.chain(dc).chain(sh).collect() }
    }
}

impl Frame {
    pub(crate) fn gaussians(&self) -> u32 {
        self.count.unwrap_or(self.units.iter().map(|unit| unit.gaussians.len() as u32).sum())
    }

    fn parts(&self, number: u32, sequence: &SequenceParameters, gop: &Gop, parts: &mut Vec<Part>) {
        let mut header = FrameHeader::intra(self.dc_transform, Some(self.sh_transform), self.gaussians())
            .to_bytes()
            .unwrap();
        header[2] = self.sh_transform;
        parts.push(Part::unit(UnitType::FrameHeader, number, header));
        let Some(tools) = gop.tools(self) else { return };
        let mut before = None;
        let mut digests = Vec::new();
        for (r, unit) in self.units.iter().enumerate() {
            let planes = canonical_planes(sequence, &tools, unit);
            digests.push(planes.as_deref().map_or(Vec::new(), plane_digests));
            let payload = unit.payload(sequence, &tools, &mut before, frame_digest(&digests));
            parts.push(Part::Unit(UnitId::of_refinement(number, r as u8), payload));
        }
    }
}

impl Scene {
    /// The units of the scene.
    pub(crate) fn script(&self) -> Script {
        let sequence = &self.sequence;
        let mut parts = vec![Part::unit(UnitType::SequenceParameters, 0, sequence.to_bytes().unwrap())];
        let mut number = 0;
        for (place, gop) in (0..).zip(&self.gops) {
            let header = GopHeader::intra(place, gop.frames.len() as u32);
            parts.push(Part::unit(UnitType::GopHeader, number, header.to_bytes().unwrap()));
            for transform in &gop.transforms {
                let payload = transform.to_bytes(sequence).unwrap();
                parts.push(Part::unit(UnitType::Transform, number, payload));
            }
            for codebook in &gop.codebooks {
                parts.push(Part::unit(UnitType::Codebook, number, codebook.to_bytes().unwrap()));
            }
            for frame in &gop.frames {
                frame.parts(number, sequence, gop, &mut parts);
                number += 1;
            }
        }
        parts.extend(self.index.then_some(Part::Index));
        parts.push(Part::End);
        Script { profile: Profile::Intra, level: self.level, parts }
    }

    pub(crate) fn bytes(&self) -> Vec<u8> {
        self.script().bytes()
    }

    /// The unit of refinement r of the first frame.
    pub(crate) fn unit(&mut self, r: usize) -> &mut Unit {
        &mut self.gops[0].frames[0].units[r]
    }

    /// The first Gaussian of the frame.
    pub(crate) fn first(&mut self) -> &mut Gaussian {
        &mut self.unit(0).gaussians[0]
    }

    /// The canonical planes of a frame at refinement r, by the reference.
    pub(crate) fn planes(&self, gop: usize, frame: usize, r: usize) -> Vec<Vec<i32>> {
        let gop = &self.gops[gop];
        let frame = &gop.frames[frame];
        let tools = gop.tools(frame).unwrap();
        let mut planes = vec![Vec::new(); 13 + usize::from(self.sequence.sh_dimension())];
        for unit in &frame.units[..=r] {
            let of_unit = canonical_planes(&self.sequence, &tools, unit).unwrap();
            planes.iter_mut().zip(of_unit).for_each(|(plane, more)| plane.extend(more));
        }
        planes
    }

    /// Divides Gaussians in the units of one frame, all like `like`.
    pub(crate) fn divided(&self, gaussians: &[Gaussian], like: &Unit) -> Frame {
        let total = gaussians.len() as u64;
        let mut start = 0;
        let mut units = Vec::new();
        for r in 0..usize::from(self.sequence.refinement_count) {
            let end = prefix(&self.sequence, r, total) as usize;
            units.push(Unit { gaussians: gaussians[start..end].to_vec(), ..like.clone() });
            start = end;
        }
        Frame { dc_transform: 3, sh_transform: NO_TRANSFORM, count: None, units }
    }
}
