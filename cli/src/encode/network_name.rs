//! Where the network of the transformer comes from, as `--network` says it.

use crate::failure::Failure;
use crate::whole_file::read_whole;
use splatstream_encoder::NetworkSource;
use splatstream_format::payload::Network;
use std::convert::Infallible;
use std::path::PathBuf;
use std::str::FromStr;

/// The most of a network that is read, bytes: those that streams can carry are far smaller.
const MAX_NETWORK: u64 = 16 << 20;

/// Where the network of the transformer comes from.
#[derive(Clone)]
pub(super) enum NetworkName {
    Registered,
    Trained,
    File(PathBuf),
}

impl FromStr for NetworkName {
    type Err = Infallible;

    fn from_str(text: &str) -> Result<Self, Infallible> {
        Ok(match text {
            "registered" => Self::Registered,
            "trained" => Self::Trained,
            path => Self::File(path.into()),
        })
    }
}

impl NetworkName {
    /// The network.
    pub(super) fn source(&self) -> Result<NetworkSource, Failure> {
        Ok(match self {
            Self::Registered => NetworkSource::Registered,
            Self::Trained => NetworkSource::Fitted,
            Self::File(path) => {
                let bytes = read_whole(path, MAX_NETWORK)?;
                let network = Network::parse(&bytes, 0)
                    .map_err(|error| Failure::other(format!("{}: {error}", path.display())))?;
                NetworkSource::Given(Box::new(network))
            }
        })
    }
}
