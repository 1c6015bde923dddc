//! Clauses 7.2 to 7.9 Gaussian by Gaussian, in the words of the specification.

use super::scene::{Gaussian, Tools, Unit};
use splatstream_format::payload::Transform;
use splatstream_format::syntax::SequenceParameters;
use xxhash_rust::xxh64::xxh64;

/// P(r) of 7.2.
pub(crate) fn prefix(sequence: &SequenceParameters, refinement: usize, gaussians: u64) -> u64 {
    let share = u64::from(sequence.refinement_percent[refinement]) * gaussians;
    share.div_ceil(100)
}

/// The canonical planes of a unit, 7.9; none if a rule of 7.3 to 7.8 is broken.
pub(crate) fn canonical_planes(
    sequence: &SequenceParameters,
    tools: &Tools<'_>,
    unit: &Unit,
) -> Option<Vec<Vec<i32>>> {
    let planes = 13 + usize::from(sequence.sh_dimension());
    let mut out = vec![Vec::with_capacity(unit.gaussians.len()); planes];
    for block in unit.gaussians.chunks(1 << sequence.block_log2) {
        let mut code = 0_u64;
        for gaussian in block {
            code = code.checked_add(gaussian.delta)?;
            let values = canonical(sequence, tools, unit, code, gaussian)?;
            for (plane, value) in out.iter_mut().zip(values) {
                plane.push(i32::try_from(value).ok()?);
            }
        }
    }
    Some(out)
}

fn within(value: i64, low: i64, high: i64) -> Option<i64> {
    (low..=high).contains(&value).then_some(value)
}

fn canonical(
    sequence: &SequenceParameters,
    tools: &Tools<'_>,
    unit: &Unit,
    code: u64,
    gaussian: &Gaussian,
) -> Option<Vec<i64>> {
    let mut out = Vec::new();
    let shift = unit.position_shift;
    let bits = sequence.position_bits - shift;
    if code >= 1 << (3 * bits) {
        return None;
    }
    for axis in 0..3 {
        let c: i64 = (0..bits).map(|b| ((code >> (3 * b + axis) & 1) as i64) << b).sum();
        out.push((c << shift) + ((1 << shift) >> 1));
    }
    let v = gaussian.log_scale;
    let mut q = [0; 3];
    for k in 0..3 {
        within(v[k], -32768, 32767)?;
        let value = if k == 0 { v[0] } else { q[k - 1] - v[k] };
        q[k] = within(value, -32768, 32767)?;
        if k > 0 && sequence.canonical_axes() && v[k] < 0 {
            return None;
        }
    }
    out.extend(q);
    out.push(within(gaussian.opacity, -32768, 32767)?);
    let d = q[0] - q[2];
    let coarser = |&&threshold: &&u8| threshold > 0 && d < i64::from(threshold);
    let c = sequence.rotation_threshold.iter().filter(coarser).count();
    for v in gaussian.rotation {
        out.push(within(within(v, -32768, 32767)? << c, -32767, 32767)?);
    }
    out.extend(transformed(tools.dc, &gaussian.dc)?);
    let planes = usize::from(sequence.sh_dimension());
    match (unit.sh_mode, tools.sh) {
        (1, Some(transform)) => out.extend(transformed(transform, &gaussian.sh)?),
        (2, Some(transform)) => {
            out.extend(transformed(transform, &looked_up(tools, unit, transform, gaussian)?)?);
        }
        _ => out.extend(vec![0; planes]),
    }
    Some(out)
}

/// 7.7.
fn transformed(transform: &Transform, components: &[i64]) -> Option<Vec<i64>> {
    let dimension = usize::from(transform.header.dimension);
    for &component in components {
        within(component, -8191, 8191)?;
    }
    let output = |j: usize| {
        let term = |(k, component): (usize, &i64)| i64::from(transform.basis[k * dimension + j]) * component;
        let sum: i64 = components.iter().enumerate().map(term).sum();
        i64::from(transform.mean[j]) + (sum + 32).div_euclid(64)
    };
    Some((0..dimension).map(output).collect())
}

/// 7.8, sh_mode 2.
fn looked_up(tools: &Tools<'_>, unit: &Unit, transform: &Transform, gaussian: &Gaussian) -> Option<Vec<i64>> {
    let rank = usize::from(transform.header.rank);
    let mut sums = vec![0_i64; rank];
    for (&id, &index) in unit.codebook_ids.iter().zip(&gaussian.sh) {
        let book = tools.codebooks.iter().find(|book| book.header.codebook_id == id)?;
        within(index, 0, i64::from(book.header.entry_count_minus1))?;
        for (k, sum) in sums.iter_mut().enumerate() {
            *sum += i64::from(book.entries[index as usize * rank + k]);
        }
    }
    Some(sums.into_iter().map(|sum| sum.clamp(-8191, 8191)).collect())
}

/// The digests of the planes of a unit, plane p with seed p.
pub(crate) fn plane_digests(planes: &[Vec<i32>]) -> Vec<u64> {
    let digest = |(p, plane): (usize, &Vec<i32>)| {
        let bytes: Vec<u8> = plane.iter().flat_map(|value| value.to_le_bytes()).collect();
        xxh64(&bytes, p as u64)
    };
    planes.iter().enumerate().map(digest).collect()
}

/// The digest of a frame from those of the planes of its units.
pub(crate) fn frame_digest(units: &[Vec<u64>]) -> u64 {
    let bytes: Vec<u8> = units.iter().flatten().flat_map(|digest| digest.to_le_bytes()).collect();
    xxh64(&bytes, 0)
}
