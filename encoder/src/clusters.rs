//! Contexts that are not worth a table of their own share one.

use crate::entropy_cost::Histogram;
use splatstream_format::entropy::model::ContextAxis;

/// Contexts gathered into tables.
pub(crate) struct Clustering {
    /// For each context, `first * width + second`, its table; numbered by first use.
    table_of_context: Vec<u8>,
    /// Contexts of the second axis.
    width: usize,
    /// Bits of symbols and tables.
    pub(crate) bits: f64,
}

/// Merges neighbouring contexts while that saves bits. Context `c` has `c + 1` (same row) and `c + width` as
/// neighbours.
#[expect(
    clippy::indexing_slicing,
    reason = "contexts, tables and rows are numbers below the lengths that they come from"
)]
#[expect(clippy::arithmetic_side_effects, reason = "numbers of contexts and tables, which are below 256")]
pub(crate) fn cluster(histograms: Vec<Histogram>, width: usize) -> Clustering {
    let contexts = histograms.len();
    let mut owner: Vec<usize> = (0..contexts).collect();
    let mut bits: Vec<f64> = histograms.iter().map(Histogram::total_bits).collect();
    let mut tables: Vec<Option<Histogram>> = histograms.into_iter().map(Some).collect();
    let neighbours = |c: usize| {
        let right = (c % width + 1 < width).then_some((c, c + 1));
        let below = (c + width < contexts).then_some((c, c + width));
        [right, below].into_iter().flatten()
    };
    let mut pairs: Vec<(usize, usize)> = (0..contexts).flat_map(neighbours).collect();
    let saving =
        |tables: &[Option<Histogram>], bits: &[f64], (a, b): (usize, usize)| match (&tables[a], &tables[b]) {
            (Some(first), Some(second)) => bits[a] + bits[b] - first.merged(second).total_bits(),
            _ => f64::NEG_INFINITY,
        };
    let mut savings: Vec<f64> = pairs.iter().map(|&pair| saving(&tables, &bits, pair)).collect();
    loop {
        let best = (0..pairs.len()).max_by(|&a, &b| savings[a].total_cmp(&savings[b]).then(b.cmp(&a)));
        let Some(best) = best.filter(|&best| savings[best] >= 0.0) else { break };
        let (kept, gone) = pairs[best];
        let absorbed = tables[gone].take();
        if let (Some(first), Some(second)) = (&tables[kept], &absorbed) {
            let merged = first.merged(second);
            bits[kept] = merged.total_bits();
            bits[gone] = 0.0;
            tables[kept] = Some(merged);
        }
        owner.iter_mut().filter(|owner| **owner == gone).for_each(|owner| *owner = kept);
        for (pair, saved) in pairs.iter_mut().zip(&mut savings) {
            let touched = [pair.0, pair.1].iter().any(|&index| index == gone || index == kept);
            if touched {
                *pair = (owner[pair.0].min(owner[pair.1]), owner[pair.0].max(owner[pair.1]));
                *saved = if pair.0 == pair.1 { f64::NEG_INFINITY } else { saving(&tables, &bits, *pair) };
            }
        }
    }
    Clustering { table_of_context: renumbered(&owner), width, bits: bits.iter().sum() }
}

/// Numbers owners in the order in which contexts first use them.
#[expect(clippy::arithmetic_side_effects, reason = "numbers of contexts and tables, which are below 256")]
fn renumbered<T: PartialEq + Copy>(owner: &[T]) -> Vec<u8> {
    let mut seen: Vec<T> = Vec::new();
    owner
        .iter()
        .map(|&owner| {
            let index = seen.iter().position(|&known| known == owner).unwrap_or_else(|| {
                seen.push(owner);
                seen.len() - 1
            });
            index as u8
        })
        .collect()
}

impl Clustering {
    /// Drops the thresholds between contexts that share their tables everywhere.
    #[expect(
        clippy::indexing_slicing,
        reason = "contexts, tables and rows are numbers below the lengths that they come from"
    )]
    #[expect(clippy::arithmetic_side_effects, reason = "numbers of contexts and tables, which are below 256")]
    pub(crate) fn simplified(self, axes: [ContextAxis; 2]) -> ([ContextAxis; 2], Vec<u8>) {
        let [first, second] = axes;
        let rows: Vec<&[u8]> = self.table_of_context.chunks(self.width).collect();
        let kept_rows: Vec<usize> =
            (0..rows.len()).filter(|&row| row == 0 || rows[row] != rows[row - 1]).collect();
        let column = |index: usize| rows.iter().map(|row| row[index]).collect::<Vec<u8>>();
        let kept_columns: Vec<usize> =
            (0..self.width).filter(|&index| index == 0 || column(index) != column(index - 1)).collect();
        let table_of_context: Vec<u8> = kept_rows
            .iter()
            .flat_map(|&row| kept_columns.iter().map(move |&index| (row, index)))
            .map(|(row, index)| rows[row][index])
            .collect();
        let first = keep_thresholds(first, &kept_rows);
        let second = keep_thresholds(second, &kept_columns);
        let axes = if first.thresholds.is_empty() { [second, ContextAxis::NONE] } else { [first, second] };
        (axes, renumbered(&table_of_context))
    }
}

/// Context k begins at threshold k - 1.
fn keep_thresholds(axis: ContextAxis, kept: &[usize]) -> ContextAxis {
    let thresholds: Vec<i32> =
        kept.iter().filter_map(|&context| axis.thresholds.get(context.checked_sub(1)?).copied()).collect();
    if thresholds.is_empty() { ContextAxis::NONE } else { ContextAxis { source: axis.source, thresholds } }
}

#[cfg(test)]
mod tests {
    use super::*;
    use splatstream_format::entropy::model::Source;

    fn histogram(tokens: &[u8]) -> Histogram {
        let mut histogram = Histogram::default();
        for _ in 0..500 {
            tokens.iter().for_each(|&token| histogram.add(token));
        }
        histogram
    }

    #[test]
    fn alike_contexts_share_a_table_and_lose_their_threshold() {
        let axis = ContextAxis { source: Source::Opacity, thresholds: vec![10, 20] };
        let clustering = cluster(vec![histogram(&[0, 1]), histogram(&[0, 1]), histogram(&[7, 8, 9])], 1);
        let (axes, tables) = clustering.simplified([axis, ContextAxis::NONE]);
        assert_eq!(axes[0].thresholds, [20]);
        assert_eq!(tables, [0, 1]);
    }

    #[test]
    fn an_axis_that_parts_nothing_goes() {
        let axis = |source| ContextAxis { source, thresholds: vec![5] };
        let (a, b) = (histogram(&[0, 1]), histogram(&[8, 9]));
        let clustering = cluster(vec![a.clone(), b.clone(), a, b], 2);
        let (axes, tables) = clustering.simplified([axis(Source::Opacity), axis(Source::LogVolume)]);
        assert_eq!(axes[0].source, Source::LogVolume);
        assert_eq!((axes[1].source, tables), (Source::None, vec![0, 1]));
    }
}
