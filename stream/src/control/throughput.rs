//! What the network is expected to carry, from what it carried.

use super::number::real;

/// A request that has ended, or that is running.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Transfer {
    /// When it was sent.
    pub sent_us: u64,
    /// When the first bytes arrived.
    pub first_us: u64,
    /// When the last bytes arrived.
    pub last_us: u64,
    /// Bytes that arrived.
    pub bytes: u64,
}

impl Transfer {
    /// From the request to the first bytes, in seconds.
    pub fn latency(&self) -> f64 {
        real(self.first_us.saturating_sub(self.sent_us)) / 1e6
    }

    /// From the first bytes to the last, in seconds, at least a microsecond.
    pub fn duration(&self) -> f64 {
        real(self.last_us.saturating_sub(self.first_us).max(1)) / 1e6
    }

    /// Throughput in bits per second while bytes arrived.
    pub fn throughput(&self) -> f64 {
        real(self.bytes) * 8.0 / self.duration()
    }
}

/// Transfers that count as the last.
const LAST: usize = 5;

/// Transfers that are remembered.
const REMEMBERED: usize = 64;

/// The transfers of a session, and predictions from them. Latency is kept apart from throughput.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Network {
    transfers: Vec<Transfer>,
    errors: Vec<f64>,
}

impl Network {
    /// Adds a transfer that has ended, or of which a part arrived before it was given up.
    pub fn add(&mut self, transfer: Transfer) {
        if transfer.bytes == 0 {
            return;
        }
        if let Some(predicted) = self.mean(RECENT_SECONDS) {
            let real = transfer.throughput();
            // What was short says little.
            let weight = (transfer.duration() / 0.5).min(1.0);
            self.errors.push((predicted - real) / real * weight);
        }
        self.transfers.push(transfer);
        if self.transfers.len() > REMEMBERED {
            self.transfers.remove(0);
            self.errors.remove(0);
        }
    }

    /// The last transfer.
    pub fn last(&self) -> Option<&Transfer> {
        self.transfers.last()
    }

    /// Harmonic mean of the throughput in bits per second, weighted by bytes, over the last transfers that took so many
    /// seconds together; none before the first transfer.
    pub fn mean(&self, seconds: f64) -> Option<f64> {
        let (mut bits, mut time) = (0.0, 0.0);
        for transfer in self.transfers.iter().rev() {
            bits += real(transfer.bytes) * 8.0;
            time += transfer.duration();
            if time >= seconds {
                break;
            }
        }
        (time > 0.0).then(|| bits / time)
    }

    /// What the network carries at least, in bits per second: the harmonic mean of the last seconds, divided by 1 + the
    /// largest recent error of such a prediction upwards (at most [`MOST_ERROR`]); none before the first transfer.
    pub fn robust(&self) -> Option<f64> {
        let errors = self.errors.iter().rev().take(LAST).copied();
        Some(self.mean(RECENT_SECONDS)? / (1.0 + errors.fold(0.0, f64::max).min(MOST_ERROR)))
    }

    /// How far such predictions have been off lately, as a share of the throughput; none before the second transfer.
    pub fn error(&self) -> Option<f64> {
        self.errors.iter().rev().take(LAST).map(|error| error.abs()).reduce(f64::max)
    }

    /// Mean latency of the last five requests in seconds; 0 before the first.
    pub fn latency(&self) -> f64 {
        let last: Vec<f64> = self.transfers.iter().rev().take(LAST).map(Transfer::latency).collect();
        last.iter().sum::<f64>() / real(super::number::size(last.len()).max(1))
    }
}

/// Seconds of transfers that a short prediction looks back on.
const RECENT_SECONDS: f64 = 5.0;

/// Largest error of a prediction that is believed to come again.
pub const MOST_ERROR: f64 = 1.0;

#[cfg(test)]
mod tests {
    use super::*;

    /// A second at so many bits per second.
    fn second(rate: u64) -> Transfer {
        Transfer { sent_us: 0, first_us: 50_000, last_us: 1_050_000, bytes: rate / 8 }
    }

    #[test]
    fn predictions_follow_the_harmonic_mean_and_the_largest_overestimate() {
        let mut network = Network::default();
        assert_eq!((network.mean(5.0), network.robust()), (None, None));
        network.add(second(8_000_000));
        assert_eq!(network.robust(), Some(8_000_000.0));
        // 8 Mbit/s were predicted where 5 came: 60 % too much.
        network.add(second(5_000_000));
        assert_eq!(network.mean(5.0), Some(6_500_000.0));
        assert_eq!(network.robust(), Some(6_500_000.0 / 1.6));
        // Less than came is no danger.
        network.add(second(20_000_000));
        assert_eq!(network.robust(), Some(11_000_000.0 / 1.6));
        assert_eq!(network.mean(1.0), Some(20_000_000.0));
        assert!((network.latency() - 0.05).abs() < 1e-12);
    }

    #[test]
    fn old_transfers_are_forgotten() {
        let mut network = Network::default();
        for _ in 0..200 {
            network.add(second(1_000_000));
        }
        assert_eq!((network.transfers.len(), network.mean(1e9)), (REMEMBERED, Some(1_000_000.0)));
    }
}
