//! Vector quantisation of SH components: k-means++ seeding, Lloyd iterations, empty cells seeded again.
#![expect(
    clippy::arithmetic_side_effects,
    reason = "products of entries and rank of what is in memory; a rank is 1 or more"
)]
#![expect(clippy::indexing_slicing, reason = "entries have `rank` values, and owners are entries")]

use rayon::prelude::*;
use splatstream_format::payload::Codebook;
use splatstream_format::syntax::CodebookHeader;
use splatstream_gaussians::random::SplitMix64;

/// Vectors used for training, for each entry.
pub(crate) const TRAINING_PER_ENTRY: usize = 16;
/// Lloyd iterations.
const ITERATIONS: usize = 8;
/// Vectors that seeds are drawn from.
const SEEDING: usize = 1 << 12;
/// Entries tried by the automatic choice, and the most that a forced choice takes.
const TRIAL_ENTRIES: usize = 256;
const MAX_ENTRIES: usize = 4096;

/// Entries worth carrying for a GOP: about one for 64 Gaussians.
pub(crate) fn entry_count(gaussians: usize, forced: bool) -> usize {
    let most = if forced { MAX_ENTRIES } else { TRIAL_ENTRIES };
    (gaussians / 64).clamp(1, most)
}

/// The codebook indices of every row, one plane per stage: the nearest entry of the first codebook, then of each other
/// that of what is left.
pub(crate) fn stages(mut rows: Vec<f32>, rank: usize, codebooks: &[&Codebook]) -> Vec<Vec<i32>> {
    let mut stage = |book: &&Codebook| {
        let (indices, _) = assign(book, &rows, rank);
        for (row, &index) in rows.chunks_exact_mut(rank.max(1)).zip(&indices) {
            let entry = &book.entries[index as usize * rank..];
            row.iter_mut().zip(entry).for_each(|(part, &value)| *part -= f32::from(value));
        }
        indices
    };
    codebooks.iter().map(&mut stage).collect()
}

/// Rows of even and of odd index.
pub(crate) fn halves(rows: &[f32], rank: usize) -> (Vec<f32>, Vec<f32>) {
    let half = |odd: usize| rows.chunks(rank).skip(odd).step_by(2).flatten().copied().collect();
    (half(0), half(1))
}

/// Bits of the codebook unit's entries.
pub(crate) fn bits_of(codebook: &Codebook, rank: usize) -> f64 {
    let entries = usize::from(codebook.header.entry_count_minus1) + 1;
    (entries * rank * usize::from(codebook.header.value_bytes) * 8) as f64
}

/// The nearest entry of every row, ties to the first, and the sum of squared errors.
pub(crate) fn assign(codebook: &Codebook, rows: &[f32], rank: usize) -> (Vec<i32>, f64) {
    let entries: Vec<f32> = codebook.entries.iter().map(|&value| f32::from(value)).collect();
    let found = nearest(&entries, rows, rank);
    let error = found.iter().map(|&(_, error)| f64::from(error)).sum();
    (found.into_iter().map(|(index, _)| index as i32).collect(), error)
}

/// The nearest entry of one row, ties to the first.
pub(crate) fn nearest_entry(codebook: &Codebook, row: &[f32]) -> i32 {
    let square = |entry: &[i16]| -> f32 {
        entry
            .iter()
            .zip(row)
            .map(|(&value, part)| (f32::from(value) - part) * (f32::from(value) - part))
            .sum()
    };
    let entries = codebook.entries.chunks_exact(row.len().max(1)).map(square).enumerate();
    entries.min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(index, _)| index as i32)
}

/// Entries compared at a time: their distances stay in registers.
const LANES: usize = 16;

/// The nearest entry of each row and its squared distance; ties go to the first.
fn nearest(entries: &[f32], rows: &[f32], rank: usize) -> Vec<(u32, f32)> {
    let groups = side_by_side(entries, rank);
    let search = |row: &[f32]| {
        let mut best = (0_u32, f32::INFINITY);
        for (group, coordinates) in (0..).zip(groups.chunks_exact(rank)) {
            let mut distances = [0.0_f32; LANES];
            for (&value, entries) in row.iter().zip(coordinates) {
                for (distance, &entry) in distances.iter_mut().zip(entries) {
                    *distance += (value - entry) * (value - entry);
                }
            }
            for (lane, &distance) in (0..).zip(&distances) {
                if distance < best.1 {
                    best = (group * LANES as u32 + lane, distance);
                }
            }
        }
        best
    };
    rows.par_chunks_exact(rank).with_min_len(64).map(search).collect()
}

/// The entries in groups of [`LANES`]: for each group and coordinate, that coordinate of its entries. Missing
/// entries are infinitely far.
fn side_by_side(entries: &[f32], rank: usize) -> Vec<[f32; LANES]> {
    let group = |group: &[f32]| {
        let lane = |coordinate: usize, lane: usize| group.get(lane * rank + coordinate).copied();
        let of =
            move |coordinate| core::array::from_fn(|index| lane(coordinate, index).unwrap_or(f32::INFINITY));
        (0..rank).map(of).collect::<Vec<[f32; LANES]>>()
    };
    entries.chunks(rank * LANES).flat_map(group).collect()
}

/// In eight partial sums, added in order.
fn squared_distance(a: &[f32], b: &[f32]) -> f32 {
    let mut sums = [0.0_f32; 8];
    for (a, b) in a.chunks(8).zip(b.chunks(8)) {
        for (sum, (&a, &b)) in sums.iter_mut().zip(a.iter().zip(b)) {
            *sum += (a - b) * (a - b);
        }
    }
    sums.iter().sum()
}

/// A codebook of `entries` entries for the rows; the frequent entries first.
pub(crate) fn train(rows: &[f32], rank: usize, entries: usize) -> Codebook {
    let mut centres = seeds(rows, rank, entries.max(1));
    let mut owners = nearest(&centres, rows, rank);
    for _ in 0..ITERATIONS {
        centres = moved(&centres, rows, rank, &owners);
        owners = nearest(&centres, rows, rank);
    }
    let mut uses = vec![0_u32; centres.len() / rank];
    owners.iter().for_each(|&(index, _)| uses[index as usize] += 1);
    let mut order: Vec<usize> = (0..uses.len()).filter(|&index| uses[index] > 0).collect();
    order.sort_by_key(|&index| (core::cmp::Reverse(uses[index]), index));
    let sorted = order.iter().flat_map(|&index| &centres[index * rank..(index + 1) * rank]);
    let entries: Vec<i16> = sorted.map(|&value| libm::rintf(value).clamp(-8191.0, 8191.0) as i16).collect();
    let small = entries.iter().all(|&value| i8::try_from(value).is_ok());
    let header = CodebookHeader {
        codebook_id: 0,
        component_count: rank as u8,
        entry_count_minus1: (order.len().max(1) - 1) as u16,
        value_bytes: if small { 1 } else { 2 },
    };
    Codebook { header, entries }
}

/// k-means++: each seed is drawn with a weight of its squared distance to the seeds before.
fn seeds(rows: &[f32], rank: usize, entries: usize) -> Vec<f32> {
    let count = rows.len() / rank;
    let pool: Vec<&[f32]> =
        rows.chunks_exact(rank).step_by(count.div_ceil(SEEDING.max(entries * 2)).max(1)).collect();
    let mut random = SplitMix64::new(0x5EED);
    let mut centres = pool[0].to_vec();
    let mut distances = vec![f32::INFINITY; pool.len()];
    for _ in 1..entries.min(pool.len()) {
        let newest = centres[centres.len() - rank..].to_vec();
        for (distance, row) in distances.iter_mut().zip(&pool) {
            *distance = distance.min(squared_distance(row, &newest));
        }
        let total: f64 = distances.iter().map(|&distance| f64::from(distance)).sum();
        if total <= 0.0 {
            break;
        }
        let mut left = random.unit() * total;
        let drawn = distances.iter().position(|&distance| {
            left -= f64::from(distance);
            left < 0.0
        });
        centres.extend_from_slice(pool[drawn.unwrap_or(pool.len() - 1)]);
    }
    centres
}

/// Centres at the means of their cells; an empty cell goes to the row that is worst off.
fn moved(centres: &[f32], rows: &[f32], rank: usize, owners: &[(u32, f32)]) -> Vec<f32> {
    let cells = centres.len() / rank;
    let mut sums = vec![0.0_f64; centres.len()];
    let mut counts = vec![0_u32; cells];
    for (row, &(owner, _)) in rows.chunks_exact(rank).zip(owners) {
        let owner = owner as usize;
        counts[owner] += 1;
        for (sum, &value) in sums[owner * rank..].iter_mut().zip(row) {
            *sum += f64::from(value);
        }
    }
    let mut worst: Vec<usize> = (0..owners.len()).collect();
    let empty = counts.iter().filter(|&&count| count == 0).count();
    if empty > 0 {
        worst.sort_by(|&a, &b| owners[b].1.total_cmp(&owners[a].1).then(a.cmp(&b)));
    }
    let mut worst = worst.into_iter();
    let mut centres = Vec::with_capacity(sums.len());
    for (sums, &count) in sums.chunks_exact(rank).zip(&counts) {
        let reseed = if count == 0 { worst.next() } else { None };
        match reseed {
            Some(row) => centres.extend_from_slice(&rows[row * rank..(row + 1) * rank]),
            None => centres.extend(sums.iter().map(|&sum| (sum / f64::from(count.max(1))) as f32)),
        }
    }
    centres
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clusters_far_apart_get_an_entry_each() {
        let rows: Vec<f32> =
            (0..400).flat_map(|i| [(i % 4) as f32 * 20.0, ((i / 4) % 3) as f32 * 0.1 - 0.1]).collect();
        let codebook = train(&rows, 2, 4);
        let mut first: Vec<i16> = codebook.entries.chunks(2).map(|entry| entry[0]).collect();
        first.sort_unstable();
        assert_eq!(first, [0, 20, 40, 60]);
        let (indices, error) = assign(&codebook, &rows, 2);
        assert!(error < 400.0 * 0.02 && indices.iter().all(|&index| (0..4).contains(&index)));
    }

    #[test]
    fn more_entries_than_distinct_rows_are_not_carried() {
        let rows = vec![3.0_f32; 64];
        let codebook = train(&rows, 2, 16);
        assert_eq!(codebook.entries, [3, 3]);
    }
}
