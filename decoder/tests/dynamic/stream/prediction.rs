//! Clause 7.17: neighbours by looking at all, and means, in the words of the specification.

use super::gaussian::{Splat, round};
use splatstream_format::entropy::layout::Attribute;
use splatstream_format::syntax::IncrementHeader;
use std::sync::LazyLock;

/// The table of 7.17.5, read from the text.
pub(crate) static EXP: LazyLock<Vec<i64>> = LazyLock::new(|| table("### 7.17.5", "**[SS-PR-007]**"));

/// A table of clause 7 in rows of 16 behind their places, under a heading and before a requirement.
pub(crate) fn table(heading: &str, requirement: &str) -> Vec<i64> {
    let text = include_str!("../../../../spec/07-decoding.md");
    let (_, table) = text.split_once(heading).unwrap();
    let row = |line: &str| -> Option<Vec<i64>> {
        let cells = line.strip_prefix('|')?.strip_suffix('|')?.split('|').map(str::trim);
        // The last row may be short.
        cells.take_while(|cell| !cell.is_empty()).map(|cell| cell.parse().ok()).collect()
    };
    let (table, _) = table.split_once(requirement).unwrap();
    let rows: Vec<Vec<i64>> = table.lines().filter_map(row).collect();
    assert!(rows.iter().zip((0..).step_by(16)).all(|(row, first)| row[0] == first));
    rows.into_iter().flat_map(|row| row.into_iter().skip(1)).collect()
}

/// A Gaussian of the reference set near a new one.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Neighbour<'a> {
    pub(super) d2: i64,
    pub(super) splat: &'a Splat,
}

fn sq(a: i64) -> i64 {
    a * a
}

fn squares(a: &[i64], b: &[i64]) -> i64 {
    a.iter().zip(b).map(|(a, b)| sq(a - b)).sum()
}

/// SS-PR-004.
pub(crate) fn neighbours<'a>(set: &'a [Splat], to: &Splat, count: u8) -> Vec<Neighbour<'a>> {
    let d2 = |splat: &Splat| squares(&to.position(), &splat.position());
    let mut all: Vec<Neighbour<'a>> = set.iter().map(|splat| Neighbour { d2: d2(splat), splat }).collect();
    // A stable sort: of equal distances the smaller index stays first.
    all.sort_by_key(|neighbour| neighbour.d2);
    all.truncate(count.into());
    all
}

/// `mean(weight, x)` for each value of an attribute.
pub(super) fn mean(weights: &[i64], near: &[Neighbour<'_>], attribute: Attribute) -> Vec<i64> {
    let total: i64 = weights.iter().sum();
    let values: Vec<Vec<i64>> = near.iter().map(|neighbour| neighbour.splat.value(attribute)).collect();
    (0..values[0].len())
        .map(|place| {
            let sum: i64 = weights.iter().zip(&values).map(|(weight, value)| weight * value[place]).sum();
            (2 * sum + total).div_euclid(2 * total)
        })
        .collect()
}

/// As p.rotation_fine follows from p.rotation (7.16.1).
fn fine(attribute: Attribute, values: Vec<i64>) -> Vec<i64> {
    let shift = if attribute == Attribute::Rotation { 6 } else { 0 };
    values.into_iter().map(|value| value << shift).collect()
}

/// 7.17.3.
pub(crate) fn knn(near: &[Neighbour<'_>], attribute: Attribute) -> Vec<i64> {
    let values = if near[0].d2 == 0 {
        near[0].splat.value(attribute)
    } else {
        let weight = |neighbour: &Neighbour<'_>| ((1 << 16) * (near[0].d2 + 1) / (neighbour.d2 + 1)).max(1);
        mean(&near.iter().map(weight).collect::<Vec<_>>(), near, attribute)
    };
    fine(attribute, values)
}

/// 7.17.4; `own` is the new Gaussian as far as it is reconstructed.
pub(crate) fn bilateral(
    near: &[Neighbour<'_>],
    header: &IncrementHeader,
    attribute: Attribute,
    own: &Splat,
) -> Vec<i64> {
    fine(attribute, mean(&bilateral_weights(near, header, attribute, own), near, attribute))
}

/// `weight` of 7.17.4 of each neighbour.
pub(super) fn bilateral_weights(
    near: &[Neighbour<'_>],
    header: &IncrementHeader,
    attribute: Attribute,
    own: &Splat,
) -> Vec<i64> {
    let last = near[near.len() - 1].d2;
    let weight = |neighbour: &Neighbour<'_>| {
        let theirs = neighbour.splat;
        let mut f = 0;
        if attribute > Attribute::LogScale {
            f += squares(&own.q, &theirs.q);
        }
        if attribute > Attribute::Opacity {
            f += sq(own.o - theirs.o);
        }
        if attribute > Attribute::Rotation {
            f += squares(&own.rotation(), &theirs.rotation());
        }
        if attribute > Attribute::Dc {
            f += squares(&own.dc.map(|dc| round(dc, 6)), &theirs.dc.map(|dc| round(dc, 6)));
        }
        let xs = neighbour.d2 * i64::from(header.bilateral_spatial) / (last + 1);
        let xf = ((f * i64::from(header.bilateral_feature)) >> 6).min(255);
        EXP[(xs + xf).min(255) as usize]
    };
    near.iter().map(weight).collect()
}
