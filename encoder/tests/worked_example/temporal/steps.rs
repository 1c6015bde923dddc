//! One displacement and one residual, line by line; what comes out is what the decoder has.

use super::walk::{Common, Step, Walked};
use super::{list, of};
use splatstream_decoder::displacement::{Cell, isqrt, rotation_unit};
use splatstream_decoder::increment::residual::Stage;
use splatstream_decoder::layout::Section;
use splatstream_decoder::steps::{StepRule, step as size_of_step};
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
    let d = three(|a| fine[a] - centre[a]);
    let m = cross(v, d);
    let u = cross(v, m);
    lines.three("centre", centre);
    lines.three("d = position_fine - centre", d);
    lines.three("m = cross(v, d)", m);
    lines.three("u = cross(v, m)", u);
    lines.three("w * m + u", three(|a| w * m[a] + u[a]));
    let turned = three(|a| round(w * m[a] + u[a], 27));
    lines.three("Round(w * m + u, 27)", turned);
    let shift = cell.translation.map(|translation| i64::from(translation) * 8);
    lines.three("translation * 8", shift);
    let p = three(|a| centre[a] + d[a] + turned[a] + shift[a]);
    lines.three("p", p);
    let last = ((1 << common.sequence.position_bits) - 1) * 64;
    let placed = p.map(|p| p.clamp(0, last));
    lines.three(&format!("position_fine = clamp(p, 0, {last})"), placed);
    placed
}

fn rotation_of(lines: &mut Lines<'_>, common: &Common, cell: &Cell, r: Three) -> Three {
    let v = cell.rotation.map(i64::from);
    let w = root((1 << 28) - dot(v, v));
    let unit = rotation_unit(common.sequence.rotation_step);
    let one = 64 * unit;
    let big = root((one * one - dot(r, r)).max(0));
    let c = cross(v, r);
    let sums = three(|k| w * r[k] + v[k] * big + c[k]);
    let real = w * big - dot(v, r);
    lines.three("r = rotation_fine", r);
    lines.one("U", unit);
    lines.one(&format!("W = isqrt(({one} * {one}) - {})", dot(r, r)), big);
    lines.three("c = cross(v, r)", c);
    lines.three("w * r + v * W + c", sums);
    lines.one("w * W - dot(v, r)", real);
    let n = sums.map(|sum| if real < 0 { -round(sum, 14) } else { round(sum, 14) });
    lines.three("n", n);
    let turned = n.map(|n| n.clamp(-32767 * 64, 32767 * 64));
    lines.three("rotation_fine = clamp(n, ...)", turned);
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
    let q = log_scales(&mut lines, of(&planes.log_scale, row).map(i64::from), &v, &rule);
    let o = i64::from(planes.opacity[row]);
    lines.one("pred.o", o);
    let shape = q.map(|q| q as i32);
    let mut step_of = |stage, opacity: i64, name: &str| {
        let exponent = rule.of(stage, shape, opacity as i32);
        lines.one(&format!("exponent({name})"), exponent.into());
        i64::from(size_of_step(exponent))
    };
    let of_opacity = step_of(Stage::Opacity, 0, "opacity");
    let o = o + v[3] * of_opacity;
    let [of_rotation, of_dc] =
        [(Stage::Rotation, "rotation"), (Stage::Dc, "dc")].map(|(stage, name)| step_of(stage, o, name));
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
    let exponent = rule.of_log_scale((p[0] + v[0] * of_largest) as i32);
    let of_others = i64::from(size_of_step(exponent));
    let steps = [of_largest, of_others, of_others];
    let x = three(|k| v[k] * steps[k]);
    lines.three("pred.q", p);
    lines.three("v_log_scale", three(|k| v[k]));
    lines.three(&format!("x = v_log_scale * {}", list(steps)), x);
    let (d1, d2) = (p[0] - p[1] + x[1], p[1] - p[2] + x[2]);
    lines.one("d1 = pred.q[0] - pred.q[1] + x[1]", d1);
    lines.one("d2 = pred.q[1] - pred.q[2] + x[2]", d2);
    let q = [p[0] + x[0], p[0] + x[0] - d1, p[0] + x[0] - d1 - d2];
    lines.three("q", q);
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
