//! Arguments that make a bad network.

use crate::failure::Failure;
use crate::numbers::parse_share;
use crate::whole_file::read_text;
use clap::Args;
use splatstream_stream::server::Network;
use splatstream_stream::simulation::Trace;
use std::path::PathBuf;
use std::time::Duration;

/// What happens to answers on their way.
#[derive(Args)]
#[command(next_help_heading = "Networks for tests")]
pub(super) struct NetworkArgs {
    /// Bandwidth of all connections together over time: CSV with the columns t_s and mbps, seconds and Mbit/s. It starts
    /// with the first answer and repeats.
    #[arg(long, value_name = "TRACE.csv")]
    shape: Option<PathBuf>,
    /// Milliseconds before each answer.
    #[arg(long, value_name = "MS", default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..=60_000))]
    latency: u32,
    /// Share of answers whose connection is closed in the middle of their body, 0 to 1.
    #[arg(long, value_name = "P", default_value_t = 0.0, value_parser = parse_share)]
    drop: f64,
    /// Share of requests that are answered with 503, 0 to 1.
    #[arg(long, value_name = "P", default_value_t = 0.0, value_parser = parse_share)]
    fail: f64,
    /// Decides, with the number of each request, which ones --drop and --fail take.
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
}

impl NetworkArgs {
    /// The network, with its trace read.
    pub(super) fn network(&self) -> Result<Network, Failure> {
        let bandwidth = self.shape.as_ref().map(|path| {
            let csv = read_text(path)?;
            Trace::parse(&csv).map_err(|error| Failure::other(format!("{}: {error}", path.display())))
        });
        Ok(Network {
            bandwidth: bandwidth.transpose()?,
            latency: Duration::from_millis(self.latency.into()),
            drop_share: self.drop,
            fail_share: self.fail,
            seed: self.seed,
        })
    }
}
