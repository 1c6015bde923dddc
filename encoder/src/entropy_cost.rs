//! What symbols cost: histograms in bits.

use std::sync::LazyLock;

/// c * log2(c) for small c.
static SELF_INFORMATION: LazyLock<Vec<f64>> = LazyLock::new(|| (0..1 << 14).map(exact).collect());

fn exact(count: u32) -> f64 {
    let count = f64::from(count);
    if count > 0.0 { count * libm::log2(count) } else { 0.0 }
}

fn self_information(count: u32) -> f64 {
    SELF_INFORMATION.get(count as usize).copied().unwrap_or_else(|| exact(count))
}

/// How often each token occurs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Histogram {
    counts: Vec<u32>,
}

impl Default for Histogram {
    fn default() -> Self {
        Self::of_tokens(256)
    }
}

impl Histogram {
    /// Of tokens that are below a number.
    pub(crate) fn of_tokens(count: usize) -> Self {
        Self { counts: vec![0; count] }
    }

    /// Counts one token.
    #[inline]
    #[expect(clippy::indexing_slicing, reason = "a token is below the number of counts")]
    #[expect(clippy::arithmetic_side_effects, reason = "counts of values that are in memory")]
    pub(crate) fn add(&mut self, token: u8) {
        self.counts[usize::from(token)] += 1;
    }

    /// Both together, of as many tokens.
    #[expect(clippy::arithmetic_side_effects, reason = "counts of values that are in memory")]
    pub(crate) fn merged(&self, other: &Self) -> Self {
        Self { counts: self.counts.iter().zip(&other.counts).map(|(a, b)| a + b).collect() }
    }

    /// Counts as the table builder wants them.
    pub(crate) fn counts(&self) -> Vec<u64> {
        self.counts.iter().map(|&count| u64::from(count)).collect()
    }

    /// Bits of the symbols with an ideal static table.
    pub(crate) fn entropy_bits(&self) -> f64 {
        let total = self.counts.iter().sum();
        self_information(total) - self.counts.iter().map(|&count| self_information(count)).sum::<f64>()
    }

    /// Bits that carrying the table takes, nearly (clause 5.12), with what its symbols take beyond their entropy.
    pub(crate) fn table_bits(&self) -> f64 {
        let last = self.counts.iter().rposition(|&count| count > 0).unwrap_or(0);
        let used = self.counts.iter().filter(|&&count| count > 0).count();
        match (used, last) {
            (0 | 1, 0) => 2.0,
            (0 | 1, _) => 11.0,
            _ => {
                // A token more of the same length is one bit; one that occurs changes it and has a mantissa.
                let explicit = 14.0 + last as f64 + 4.0 * used as f64;
                // A distribution is never quite that of the symbols.
                let total: u32 = self.counts.iter().sum();
                let parametric = 32.0 + 2.0 * used as f64 + 0.1 * f64::from(total);
                explicit.min(parametric)
            }
        }
    }

    /// Symbols and table.
    pub(crate) fn total_bits(&self) -> f64 {
        self.entropy_bits() + self.table_bits()
    }
}

/// Entropy of values in bits, all of them together.
pub(crate) fn entropy_of(values: &[i32]) -> f64 {
    let (Some(&least), Some(&most)) = (values.iter().min(), values.iter().max()) else { return 0.0 };
    // Counting is faster than sorting where there are more values than places.
    let places = (most.abs_diff(least) as usize).saturating_add(1);
    if places / 4 <= values.len() {
        let mut counts = vec![0_u32; places];
        for &value in values {
            if let Some(count) = counts.get_mut(value.abs_diff(least) as usize) {
                *count = count.saturating_add(1);
            }
        }
        let parts = counts.into_iter().filter(|&count| count > 0).map(self_information);
        return self_information(values.len() as u32) - parts.sum::<f64>();
    }
    let mut sorted = values.to_vec();
    sorted.sort_unstable();
    let runs = sorted.chunk_by(|a, b| a == b).map(|run| self_information(run.len() as u32));
    self_information(values.len() as u32) - runs.sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn four_equally_frequent_tokens_cost_two_bits_each() {
        let mut histogram = Histogram::default();
        (0..400_u32).for_each(|i| histogram.add((i % 4) as u8));
        assert!((histogram.entropy_bits() - 800.0).abs() < 1e-6);
        let values: Vec<i32> = (0..400).map(|i| i % 4 - 2).collect();
        assert!((entropy_of(&values) - 800.0).abs() < 1e-6);
    }
}
