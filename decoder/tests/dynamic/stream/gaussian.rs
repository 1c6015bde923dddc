//! Clauses 7.14 and 7.16: one Gaussian and its residuals, in the words of the specification.

use super::network::Network;
use crate::crafted::scene::{Gaussian, Tools};
use splatstream_format::entropy::layout::Attribute;
use splatstream_format::payload::Transform;
use splatstream_format::syntax::{IncrementHeader, SequenceParameters};

/// A Gaussian of 7.14.1.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Splat {
    pub(crate) position_fine: [i64; 3],
    pub(crate) q: [i64; 3],
    pub(crate) o: i64,
    pub(crate) rotation_fine: [i64; 3],
    pub(crate) dc: [i64; 3],
    pub(crate) sh: Vec<i64>,
    pub(crate) anchor: bool,
}

/// What the clauses call by name where they reconstruct a Gaussian of a unit.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rules<'a> {
    pub(crate) sequence: &'a SequenceParameters,
    pub(crate) tools: Tools<'a>,
    pub(crate) network: Option<&'a Network>,
    pub(crate) header: &'a IncrementHeader,
}

/// `Round(x, s)` of 4.2.
pub(crate) const fn round(x: i64, s: u32) -> i64 {
    (x + (1 << (s - 1))) >> s
}

pub(crate) fn within(value: i64, low: i64, high: i64) -> Option<i64> {
    (low..=high).contains(&value).then_some(value)
}

fn sixteen_bits(value: i64) -> Option<i64> {
    within(value, -32768, 32767)
}

impl Splat {
    pub(crate) fn position(&self) -> [i64; 3] {
        self.position_fine.map(|fine| round(fine, 6))
    }

    pub(crate) fn rotation(&self) -> [i64; 3] {
        self.rotation_fine.map(|fine| round(fine, 6))
    }

    /// The canonical planes of 7.9, in order.
    fn canonical(&self) -> Vec<i64> {
        let others = self.rotation().into_iter().chain(self.dc).chain(self.sh.iter().copied());
        self.position().into_iter().chain(self.q).chain([self.o]).chain(others).collect()
    }

    /// The value of an attribute, canonical, as 7.17 takes it of a neighbour.
    pub(crate) fn value(&self, attribute: Attribute) -> Vec<i64> {
        match attribute {
            Attribute::LogScale => self.q.to_vec(),
            Attribute::Opacity => vec![self.o],
            Attribute::Rotation => self.rotation().to_vec(),
            Attribute::Dc => self.dc.to_vec(),
            _ => self.sh.clone(),
        }
    }

    /// The same as the prediction that a parent is of its own update: the rotation is fine.
    pub(crate) fn of_itself(&self, attribute: Attribute) -> Vec<i64> {
        match attribute {
            Attribute::Rotation => self.rotation_fine.to_vec(),
            _ => self.value(attribute),
        }
    }
}

/// The canonical planes of a list, 7.9, for `sh` planes of SH.
pub(crate) fn planes(list: &[Splat], sh: u8) -> Vec<Vec<i32>> {
    let mut planes = vec![Vec::new(); 13 + usize::from(sh)];
    for splat in list {
        let values = splat.canonical();
        assert_eq!(values.len(), planes.len());
        planes.iter_mut().zip(values).for_each(|(plane, value)| plane.push(i32::try_from(value).unwrap()));
    }
    planes
}

/// Predictor `none` of 7.16.1.
pub(crate) fn unpredicted(rules: &Rules<'_>, attribute: Attribute) -> Vec<i64> {
    let mean = |transform: &Transform| transform.mean.iter().map(|&mean| mean.into()).collect();
    match (attribute, rules.tools.sh) {
        (Attribute::Opacity, _) => vec![0],
        (Attribute::Dc, _) => mean(rules.tools.dc),
        (Attribute::Sh, Some(transform)) if rules.header.sh_mode > 0 => mean(transform),
        (Attribute::Sh, _) => vec![0; rules.sequence.sh_dimension().into()],
        _ => vec![0; 3],
    }
}

/// 7.3 with the code of 7.16.4: the position of a new Gaussian.
pub(crate) fn placed(rules: &Rules<'_>, code: u64) -> Option<[i64; 3]> {
    let shift = rules.header.position_shift;
    let bits = rules.sequence.position_bits - shift;
    (code < 1 << (3 * bits)).then(|| {
        [0, 1, 2].map(|axis| {
            let c: i64 = (0..bits).map(|b| ((code >> (3 * b + axis) & 1) as i64) << b).sum();
            ((c << shift) + ((1 << shift) >> 1)) << 6
        })
    })
}

/// 7.14.3: the position after a move.
pub(crate) fn moved(rules: &Rules<'_>, fine: [i64; 3], by: [i64; 3]) -> Option<[i64; 3]> {
    let mut out = fine;
    for (slot, by) in out.iter_mut().zip(by) {
        let sum = *slot + (by << (rules.header.position_shift + 6));
        *slot = within(sum, 0, ((1 << rules.sequence.position_bits) - 1) * 64)?;
    }
    Some(out)
}

/// 7.16: residuals on top of what `predict` says of an attribute when those before it are known.
pub(crate) fn reconstructed(
    rules: &Rules<'_>,
    v: &Gaussian,
    start: Splat,
    predict: impl Fn(Attribute, &Splat) -> Vec<i64>,
) -> Option<Splat> {
    let mut splat = start;
    let shift = rules.header.attribute_shift;
    log_scales(rules, v, &predict(Attribute::LogScale, &splat), &mut splat)?;
    splat.o = sixteen_bits(predict(Attribute::Opacity, &splat)[0] + (v.opacity << shift[1]))?;
    let d = splat.q[0] - splat.q[2];
    let coarser = |&&threshold: &&u8| threshold > 0 && d < i64::from(threshold);
    let c = rules.sequence.rotation_threshold.iter().filter(coarser).count();
    let predicted = predict(Attribute::Rotation, &splat);
    for (k, predicted) in predicted.into_iter().enumerate() {
        let value = sixteen_bits(v.rotation[k])?;
        let sum = predicted + (value << (c + usize::from(shift[2]) + 6));
        splat.rotation_fine[k] = within(sum, -2_097_088, 2_097_088)?;
    }
    let dc: Vec<i64> = v.dc.iter().map(|value| value << shift[3]).collect();
    let dc = coloured(rules.tools.dc, &dc, &predict(Attribute::Dc, &splat))?;
    splat.dc = [dc[0], dc[1], dc[2]];
    let predicted = predict(Attribute::Sh, &splat);
    splat.sh = match (rules.header.sh_mode, rules.tools.sh) {
        (1, Some(transform)) => {
            let components: Vec<i64> = v.sh.iter().map(|value| value << shift[4]).collect();
            coloured(transform, &components, &predicted)?
        }
        (2, Some(transform)) => coloured(transform, &looked_up(rules, transform, &v.sh)?, &predicted)?,
        _ => predicted,
    };
    Some(splat)
}

/// 7.16.2.
fn log_scales(rules: &Rules<'_>, v: &Gaussian, p: &[i64], splat: &mut Splat) -> Option<()> {
    let mut x = [0; 3];
    for (x, v) in x.iter_mut().zip(v.log_scale) {
        *x = sixteen_bits(v << rules.header.attribute_shift[0])?;
    }
    let d = [p[0] - p[1] + x[1], p[1] - p[2] + x[2]];
    let first = p[0] + x[0];
    for (q, value) in splat.q.iter_mut().zip([first, first - d[0], first - d[0] - d[1]]) {
        *q = sixteen_bits(value)?;
    }
    let is_sorted = d.iter().all(|&d| d >= 0);
    (is_sorted || !rules.sequence.canonical_axes()).then_some(())
}

/// 7.16.5.
fn coloured(transform: &Transform, components: &[i64], predicted: &[i64]) -> Option<Vec<i64>> {
    let dimension = usize::from(transform.header.dimension);
    let components: Vec<i64> =
        components.iter().map(|&component| within(component, -8191, 8191)).collect::<Option<_>>()?;
    let output = |j: usize| {
        let term = |(k, component): (usize, &i64)| i64::from(transform.basis[k * dimension + j]) * component;
        let sum: i64 = components.iter().enumerate().map(term).sum();
        within(predicted[j] + round(sum, 6), -(1 << 30), 1 << 30)
    };
    (0..dimension).map(output).collect()
}

/// SS-SH-003, then the shift of 7.16.5.
fn looked_up(rules: &Rules<'_>, transform: &Transform, indices: &[i64]) -> Option<Vec<i64>> {
    let rank = usize::from(transform.header.rank);
    let mut sums = vec![0_i64; rank];
    for (id, &index) in rules.header.codebook_ids.into_iter().zip(indices) {
        let book = rules.tools.codebooks.iter().find(|book| book.header.codebook_id == id)?;
        within(index, 0, i64::from(book.header.entry_count_minus1))?;
        for (k, sum) in sums.iter_mut().enumerate() {
            *sum += i64::from(book.entries[index as usize * rank + k]);
        }
    }
    Some(sums.into_iter().map(|sum| sum.clamp(-8191, 8191) << rules.header.attribute_shift[4]).collect())
}
