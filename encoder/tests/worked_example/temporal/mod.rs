//! Annex E: a small stream of profile 1, its increments step by step.

mod frames;
mod predicting;
mod scene;
mod steps;
mod walk;
mod writing;

use crate::elements;
use core::fmt::Display;
use scene::sequence;
use splatstream_decoder::displacement::Cell;
use splatstream_decoder::layout::{Layout, Section, ShCoding};
use splatstream_decoder::list::GaussianList;
use splatstream_decoder::position::collect;
use splatstream_format::syntax::SequenceParameters;
use std::fmt::Write as _;
use walk::{Common, Step, Walked};
pub(crate) use writing::written;

/// The text of the annex for the stream.
pub(crate) fn annex(bytes: &[u8], common: &Common, frames: &[Walked]) -> String {
    let mut text = String::from(
        "# Annex E Worked temporal example\n\n\
         Informative. A stream of an I, a B and a P frame with two spatial layers, two temporal layers and two \
         refinements: the elements and values of its increments, and the arithmetic of one step of each kind. The \
         stream is `data/worked-temporal-example.gss`; it was put together by hand, and its models and blocks follow \
         the syntax of annex D, with one context and one table per plane. This annex is written by a test from what \
         the reference decoder computes; the test fails when stream and annex differ. Where a table here and clauses 2 \
         to 9 disagree, the clauses are right.\n\n",
    );
    overview(&mut text, common, frames);
    let SequenceParameters {
        size_weight,
        anisotropy_weight,
        size_reference,
        opacity_reference,
        anisotropy_reference,
        ..
    } = sequence();
    let [a, b, c, d, e] = size_weight;
    let _ = write!(
        text,
        "\n## E.2 Elements\n\nThe payloads of frame_headers and increments up to their models and blocks. The other \
         units are like those of annex D, except that sequence_parameters has\n`size_weight` {a}, {b}, {c}, {d}, {e}, \
         `anisotropy_weight` {anisotropy_weight}, `size_reference` {size_reference}, `opacity_reference` \
         {opacity_reference} and `anisotropy_reference` {anisotropy_reference}.\n",
    );
    elements(
        &mut text,
        bytes,
        |unit_type| matches!(unit_type, 3 | 6),
        |record| record.starts_with("frame_header") || record.starts_with("increment"),
    );
    text.push_str(
        "\n## E.3 The increments\n\nThe values `v` of 8.1 of each section, entry by entry; then the list after the \
         unit (7.4.4). Letters name Gaussians in the order in which units add them.\n",
    );
    let names = names(frames);
    for step in frames.iter().flat_map(|frame| &frame.steps) {
        unit(&mut text, step, &names);
    }
    cells(&mut text, &frames[1]);
    steps::displacement(&mut text, common, &frames[1], 1);
    steps::residual(&mut text, common, frames[2].step(1, 1), 1);
    predicting::prediction(&mut text, common, frames[1].step(1, 1), "E.7 New Gaussian predicted by KNN");
    predicting::prediction(&mut text, common, frames[1].step(1, 0), "E.8 New Gaussian predicted bilaterally");
    frames::carried(&mut text, bytes, common, frames, &names);
    frames::shown(&mut text, bytes);
    text
}

fn overview(text: &mut String, common: &Common, frames: &[Walked]) {
    text.push_str(
        "## E.1 The frames\n\nThe layers and references are those of 7.3.1 with `temporal_depth` 1. Each unit (s, r) \
         is listed with its parents, what becomes of them, and how many Gaussians it adds.\n\n\
         | Frame | Kind | Temporal layer | Refers to | Unit | position_shift | attribute_step | Parents | Moves | \
         Updates | Removed | New |\n|---|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for frame in frames {
        let role = common.gop.role(frame.index);
        let kind = ["I", "P", "B"][usize::from(role.frame_type.code())];
        let reference = role.reference.map_or("none".to_owned(), |at| at.to_string());
        for Step { id, header, .. } in &frame.steps {
            writeln!(
                text,
                "| {} | {kind} | {} | {reference} | ({}, {}) | {} | {} | {} | {} | {} | {} | {} |",
                frame.index,
                role.temporal_layer,
                id.spatial_layer,
                id.refinement,
                header.position_shift,
                list(header.attribute_step),
                header.parent_count,
                header.move_count,
                header.update_count,
                header.remove_count,
                header.new_count
            )
            .unwrap();
        }
    }
}

/// Values with commas between them.
fn list<T: Display>(values: impl IntoIterator<Item = T>) -> String {
    values.into_iter().map(|value| value.to_string()).collect::<Vec<_>>().join(", ")
}

/// One Gaussian of a plane each.
fn of<T: Copy>(planes: &[Vec<T>; 3], i: usize) -> [T; 3] {
    planes.each_ref().map(|plane| plane[i])
}

/// The names of the Gaussians of each list after each unit, in stream order.
type Names = Vec<((u32, u8, u8), Vec<String>)>;

/// Letters for Gaussians in the order in which units add them.
fn names(frames: &[Walked]) -> Names {
    let mut letters = ('A'..='Z').map(String::from);
    let mut names: Names = Vec::new();
    for step in frames.iter().flat_map(|frame| &frame.steps) {
        let modes = step.values.plane(Section::Modes, 0);
        let parents = parent_names(step, &names);
        let kept = parents.into_iter().zip(modes).filter(|(_, mode)| **mode != 4).map(|(name, _)| name);
        let all = kept.chain(letters.by_ref().take(step.added.len())).collect();
        names.push(((step.id.frame, step.id.spatial_layer, step.id.refinement), all));
    }
    names
}

fn parent_names(step: &Step, names: &Names) -> Vec<String> {
    let id = &step.id;
    // Both predicted frames refer to frame 0.
    let at = match (id.frame, id.spatial_layer) {
        (0, 0) => return Vec::new(),
        (0, layer) => (0, layer - 1, id.refinement),
        (_, layer) => (0, layer, id.refinement),
    };
    name_list(names, at).to_vec()
}

fn name_list(names: &Names, at: (u32, u8, u8)) -> &[String] {
    names.iter().find(|(unit, _)| *unit == at).map(|(_, names)| names.as_slice()).unwrap()
}

fn unit(text: &mut String, step: &Step, names: &Names) {
    let id = &step.id;
    write!(text, "\n### Unit {}\n", step.name()).unwrap();
    let parents = parent_names(step, names);
    if parents.is_empty() {
        text.push_str("\nIt has no parents.\n");
    } else {
        write!(text, "\nIts parents, in order: {}.\n", parents.join(", ")).unwrap();
    }
    for section in Section::OF_INCREMENT.into_iter().filter(|&section| step.header.count(section) > 0) {
        section_table(text, step, section);
    }
    write!(text, "\nList {} after the unit:\n", id.refinement).unwrap();
    let names = name_list(names, (id.frame, id.spatial_layer, id.refinement));
    gaussians(text, &step.list, names);
}

fn section_table(text: &mut String, step: &Step, section: Section) {
    let layout = Layout::of_section(section, 3, ShCoding::None);
    let values = step.values.section(section);
    let heads: Vec<String> = layout
        .planes()
        .iter()
        .map(|plane| match plane.is_position() {
            true => "delta".to_owned(),
            false => format!("{}[{}]", plane.attribute.name(), plane.index),
        })
        .collect();
    write!(text, "\n| {} | {} |\n|{}\n", section.name(), heads.join(" | "), "---|".repeat(heads.len() + 1))
        .unwrap();
    for entry in 0..step.header.count(section) as usize {
        let delta = values.deltas.get(entry).map(|delta| delta.to_string());
        let others = values.planes.iter().map(|plane| plane[entry].to_string());
        let cells: Vec<String> = delta.into_iter().chain(others).collect();
        writeln!(text, "| {entry} | {} |", cells.join(" | ")).unwrap();
    }
}

/// A list as a table.
fn gaussians(text: &mut String, of_list: &GaussianList, names: &[String]) {
    assert_eq!(of_list.len(), names.len());
    text.push_str(
        "\n| Gaussian | position_fine | position | q | o | rotation_fine | rotation | dc | anchor |\n\
         |---|---|---|---|---|---|---|---|---|\n",
    );
    for (i, name) in names.iter().enumerate() {
        let planes = &of_list.planes;
        let cells = [
            list(of(&of_list.position_fine, i)),
            list(of(&planes.position, i)),
            list(of(&planes.log_scale, i)),
            planes.opacity[i].to_string(),
            list(of(&of_list.rotation_fine, i)),
            list(of(&planes.rotation, i)),
            list(of(&planes.dc, i)),
            u8::from(of_list.anchor[i]).to_string(),
        ];
        writeln!(text, "| {name} | {} |", cells.join(" | ")).unwrap();
    }
}

/// The cells of a frame, sums taken.
fn cells(text: &mut String, frame: &Walked) {
    let cell_log2 = frame.plan.cell_log2;
    write!(
        text,
        "\n## E.4 The cells of frame {}\n\n`cell_log2` is {cell_log2}. Codes, translations and rotations are sums over the \
         entries of section cells (7.5.1).\n\n| Cell | delta | code | X | stale | translation | cell_rotation |\n\
         |---|---|---|---|---|---|---|\n",
        frame.index
    )
    .unwrap();
    let mut code = 0;
    for (i, delta) in frame.plan.cells.deltas.iter().enumerate() {
        code += delta;
        let x = [collect(code), collect(code >> 1), collect(code >> 2)];
        let corner = x.map(|x| (x << (cell_log2 + 6)) as i32);
        let &Cell { coordinates, stale, translation, rotation } = frame.field.find(corner).unwrap();
        assert_eq!(coordinates, x);
        let (translation, rotation) = (list(translation), list(rotation));
        writeln!(
            text,
            "| {i} | {delta} | {code} | {} | {} | {translation} | {rotation} |",
            list(x),
            u8::from(stale)
        )
        .unwrap();
    }
}
