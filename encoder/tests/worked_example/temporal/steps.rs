//! One displacement and one residual, line by line; what comes out is what the decoder has.

use super::walk::{Common, Step, Walked};
use super::{list, of};
use splatstream_decoder::displacement::{Cell, isqrt, rotation_unit};
use splatstream_decoder::layout::Section;
use splatstream_decoder::steps::{Stage, StepRule, step as size_of_step};
use std::fmt::Write as _;

type Three = [i64; 3];

fn three(each: impl Fn(usize) -> i64) -> Three {
    [each(0), each(1), each(2)]
}

fn cross(a: Three, b: Three) -> Three {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn dot(a: Three, b: Three) -> i64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn root(value: i64) -> i64 {
    isqrt(value as u64) as i64
}

/// Round(x, s) of 4.2.
fn round(x: i64, s: u32) -> i64 {
    (x + (1 << (s - 1))) >> s
}

/// Lines of what is computed and what comes out.
struct Lines<'t>(&'t mut String);

impl Lines<'_> {
    fn three(&mut self, what: &str, values: Three) {
        writeln!(self.0, "{what:<42} = {}", list(values)).unwrap();
    }

    fn one(&mut self, what: &str, value: i64) {
        writeln!(self.0, "{what:<42} = {value}").unwrap();
    }
}

/// Clause 7.5.2 for a parent of unit 0 of a frame.
pub(crate) fn displacement(text: &mut String, common: &Common, frame: &Walked, row: usize) {
    let step = &frame.steps[0];
    let (fine, rotation) = (of(&step.parents.position_fine, row), of(&step.parents.rotation_fine, row));
    let cell = frame.field.find(fine).unwrap();
    write!(
        text,
        "\n## E.5 One displacement\n\nParent {row} of unit {}, by 7.5.2. It has mode {}.\n\n```text\n",
        step.name(),
        step.values.plane(Section::Modes, 0)[row]
    )
    .unwrap();
    let mut lines = Lines(text);
    let fine = fine.map(i64::from);
    let placed = position(&mut lines, common, cell, frame.plan.cell_log2, fine);
    let turned = rotation_of(&mut lines, common, cell, rotation.map(i64::from));
    text.push_str("```\n");
    assert_eq!(placed, of(&step.displaced.position_fine, row).map(i64::from));
    assert_eq!(turned, of(&step.displaced.rotation_fine, row).map(i64::from));
}

fn position(lines: &mut Lines<'_>, common: &Common, cell: &Cell, cell_log2: u8, fine: Three) -> Three {
    let v = cell.rotation.map(i64::from);
    let w = root((1 << 28) - dot(v, v));
    lines.three("position_fine", fine);
    lines.three("Round(position_fine, 6)", fine.map(|fine| round(fine, 6)));
    let x = cell.coordinates.map(i64::from);
    lines.three(&format!("X = Round(position_fine, 6) >> {cell_log2}"), x);
    lines.three("v = cell_rotation", v);
    lines.one(&format!("w = isqrt(2^28 - {})", dot(v, v)), w);
    let centre = x.map(|x| (x << (cell_log2 + 6)) + (1 << (cell_log2 + 5)));
    let arm = three(|a| fine[a] - centre[a]);
    let first = cross(v, arm);
    let second = cross(v, first);
    lines.three("centre", centre);
    lines.three("arm = position_fine - centre", arm);
    lines.three("first = cross(v, arm)", first);
    lines.three("second = cross(v, first)", second);
    lines.three("w * first + second", three(|a| w * first[a] + second[a]));
    let turned = three(|a| round(w * first[a] + second[a], 27));
    lines.three("Round(w * first + second, 27)", turned);
    let shift = cell.translation.map(|translation| i64::from(translation) * 8);
    lines.three("translation * 8", shift);
    let moved = three(|a| centre[a] + arm[a] + turned[a] + shift[a]);
    lines.three("moved", moved);
    let last = ((1 << common.sequence.position_bits) - 1) * 64;
    let placed = moved.map(|moved| moved.clamp(0, last));
    lines.three(&format!("position_fine = clamp(moved, 0, {last})"), placed);
    placed
}

fn rotation_of(lines: &mut Lines<'_>, common: &Common, cell: &Cell, fine: Three) -> Three {
    let v = cell.rotation.map(i64::from);
    let w = root((1 << 28) - dot(v, v));
    let unit = rotation_unit(common.sequence.rotation_step);
    let one = 64 * unit;
    let scalar = root((one * one - dot(fine, fine)).max(0));
    let third = cross(v, fine);
    let sums = three(|k| w * fine[k] + v[k] * scalar + third[k]);
    let real = w * scalar - dot(v, fine);
    lines.three("rotation_fine", fine);
    lines.one("U", unit);
    lines.one(&format!("scalar = isqrt(({one} * {one}) - {})", dot(fine, fine)), scalar);
    lines.three("third = cross(v, rotation_fine)", third);
    lines.three("w * rotation_fine + v * scalar + third", sums);
    lines.one("w * scalar - dot(v, rotation_fine)", real);
    let rotated = sums.map(|sum| if real < 0 { -round(sum, 14) } else { round(sum, 14) });
    lines.three("rotated", rotated);
    let turned = rotated.map(|rotated| rotated.clamp(-32767 * 64, 32767 * 64));
    lines.three("rotation_fine = clamp(rotated, ...)", turned);
    turned
}

/// Clause 7.6 for the update of a parent that stays.
pub(crate) fn residual(text: &mut String, common: &Common, step: &Step, row: usize) {
    let modes = step.values.plane(Section::Modes, 0);
    let entry = modes[..row].iter().filter(|mode| **mode & 2 != 0).count();
    let kept = modes[..row].iter().filter(|mode| **mode != 4).count();
    let v: Vec<i64> =
        step.values.section(Section::Updates).planes.iter().map(|plane| plane[entry].into()).collect();
    write!(
        text,
        "\n## E.6 One residual\n\nEntry {entry} of section updates of unit {}, about its parent {row}, by 7.6. \
         `attribute_step` is {}.\n\n```text\n",
        step.name(),
        list(step.header.attribute_step)
    )
    .unwrap();
    let mut lines = Lines(text);
    let rule = StepRule::new(&common.sequence, step.header.attribute_step);
    let planes = &step.displaced.planes;
    let shape = of(&planes.log_scale, row);
    let q = log_scales(&mut lines, shape.map(i64::from), &v, &rule);
    let opacity = planes.opacity[row];
    lines.one("pred.o", opacity.into());
    let mut step_of = |stage, attribute: u8| {
        let exponent = rule.of(stage, shape, opacity);
        lines.one(&format!("exponent({attribute}, pred.q, pred.o)"), exponent.into());
        i64::from(size_of_step(exponent))
    };
    let [of_opacity, of_rotation, of_dc] = [(Stage::Opacity, 1), (Stage::Rotation, 2), (Stage::Dc, 3)]
        .map(|(stage, number)| step_of(stage, number));
    let o = i64::from(opacity) + v[3] * of_opacity;
    lines.one(&format!("o = pred.o + {} * {of_opacity}", v[3]), o);
    let before = of(&step.displaced.rotation_fine, row).map(i64::from);
    lines.three("pred.rotation_fine", before);
    let rotation = three(|k| before[k] + ((v[4 + k] * of_rotation) << 6));
    lines.three(&format!("rotation_fine = pred.rotation_fine + ((v * {of_rotation}) << 6)"), rotation);
    let dc = colour(&mut lines, common, of(&planes.dc, row).map(i64::from), &v[7..], of_dc);
    text.push_str("```\n");
    let planes = &step.list.planes;
    assert_eq!(q, of(&planes.log_scale, kept).map(i64::from));
    assert_eq!(o, i64::from(planes.opacity[kept]));
    assert_eq!(rotation, of(&step.list.rotation_fine, kept).map(i64::from));
    assert_eq!(dc, of(&planes.dc, kept).map(i64::from));
}

fn log_scales(lines: &mut Lines<'_>, p: Three, v: &[i64], rule: &StepRule) -> Three {
    let of_largest = i64::from(size_of_step(rule.of_largest()));
    let exponent = rule.of_log_scale(p[0] as i32);
    let of_others = i64::from(size_of_step(exponent));
    let steps = [of_largest, of_others, of_others];
    let x = three(|k| v[k] * steps[k]);
    lines.three("pred.q", p);
    lines.three("v_log_scale", three(|k| v[k]));
    lines.three(&format!("x = v_log_scale * {}", list(steps)), x);
    let q = three(|k| p[k] + x[k]);
    lines.three("q = pred.q + x", q);
    lines.one("first = q[0] - q[1]", q[0] - q[1]);
    lines.one("second = q[1] - q[2]", q[1] - q[2]);
    q
}

fn colour(lines: &mut Lines<'_>, common: &Common, p: Three, v: &[i64], step: i64) -> Three {
    let component = three(|k| v[k] * step);
    let basis = &common.transform.basis;
    let sum = three(|j| (0..3).map(|k| i64::from(basis[k * 3 + j]) * component[k]).sum());
    lines.three("pred.dc", p);
    lines.three(&format!("component = v_dc * {step}"), component);
    lines.three("sum", sum);
    lines.three("Round(sum, 6)", sum.map(|sum| round(sum, 6)));
    let dc = three(|j| p[j] + round(sum[j], 6));
    lines.three("dc", dc);
    dc
}
