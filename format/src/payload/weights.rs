//! 5.17 weights: a network, or the name of one.

use super::{after_fixed_part, only};
use crate::syntax::{NetworkHeader, WeightsHeader, after, encode};
use crate::{Error, ErrorKind, Result};

/// The parts of a network in the order of 6.17.2, each an array of `i8` and one of `i16` after it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// Relative positions to the hidden layer of the geometry network.
    Geometry,
    /// That layer to the embedding.
    GeometryEmbedding,
    /// Tokens to the embedding; the rows of `rank` take the part of a bias.
    Embedding,
    /// Added to the mean of the neighbours to make the row of the new Gaussian.
    Query,
    /// The product of the query and key matrices.
    Attention,
    /// Fourier features of relative positions to the logit.
    Fourier,
    /// The value matrix.
    Value,
    /// Of the normalisation.
    Gain,
    /// The first layer of the feed-forward block.
    Widening,
    /// The second.
    Narrowing,
    /// The outputs.
    Head,
}

impl Part {
    /// Every part, in order.
    pub const ALL: [Self; 11] = [
        Self::Geometry,
        Self::GeometryEmbedding,
        Self::Embedding,
        Self::Query,
        Self::Attention,
        Self::Fourier,
        Self::Value,
        Self::Gain,
        Self::Widening,
        Self::Narrowing,
        Self::Head,
    ];

    /// Values of the two arrays of the part: of `i8`, of `i16`.
    pub fn lengths(self, header: &NetworkHeader) -> (usize, usize) {
        let (d, g) = (header.width(), usize::from(header.geometry_width));
        let (e, n) = (usize::from(header.feed_forward_width), header.outputs());
        let square = d.saturating_mul(d);
        let present = |holds: bool, length: usize| if holds { length } else { 0 };
        match self {
            Self::Geometry => (g.saturating_mul(3), g),
            Self::GeometryEmbedding => (d.saturating_mul(g), 0),
            Self::Embedding => {
                (d.saturating_mul(header.inputs()), d.saturating_mul(header.rank_count.into()))
            }
            Self::Query => (present(!header.full_attention(), d), 0),
            Self::Attention => (square, 0),
            Self::Fourier => (usize::from(header.fourier_count).saturating_mul(6), 0),
            Self::Value => (square, d),
            Self::Gain => (present(header.normalised(), d), present(header.normalised(), d)),
            Self::Widening => (e.saturating_mul(d), e),
            Self::Narrowing => (d.saturating_mul(e), present(e > 0, d)),
            Self::Head => (n.saturating_mul(d), n),
        }
    }
}

/// The parameters of a part.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Layer {
    /// Row by row, one row an output.
    pub weights: Vec<i8>,
    /// One an output; of [`Part::Embedding`] one row of them a rank.
    pub bias: Vec<i16>,
}

/// The learned predictor of 7.17.6.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Network {
    /// The fixed part.
    pub header: NetworkHeader,
    layers: [Layer; 11],
}

impl Network {
    /// A network of parameters made elsewhere, part by part.
    ///
    /// # Errors
    /// A header or lengths that [`Self::parse`] would refuse.
    pub fn new(header: NetworkHeader, layers: [Layer; 11]) -> Result<Self> {
        header.validate(0)?;
        let fits =
            |(part, layer): (&Part, &Layer)| (layer.weights.len(), layer.bias.len()) == part.lengths(&header);
        if !Part::ALL.iter().zip(&layers).all(fits) {
            let rule = "parameters are as many as the header says";
            return Err(Error::new(0, "6.17.2", ErrorKind::Constraint { rule }));
        }
        Ok(Self { header, layers })
    }

    /// Reads and checks a network that stands at offset `at` and ends with `bytes`.
    ///
    /// # Errors
    /// Malformed: bytes are missing or left over. Unsupported: reserved flags. Invalid: a value that clause
    /// 6.17.1 forbids.
    pub fn parse(bytes: &[u8], at: u64) -> Result<Self> {
        let (header, rest) = NetworkHeader::parse(bytes, at)?;
        let lengths = Part::ALL.map(|part| part.lengths(&header));
        let bytes = |(weights, biases): (usize, usize)| weights.saturating_add(biases.saturating_mul(2));
        // At most 32,606 bytes.
        let size = lengths.into_iter().map(bytes).fold(0, usize::saturating_add);
        let mut parameters = only(&NetworkHeader::TABLE, rest, at, "parameters", size)?;
        let layers = lengths.map(|(weights, biases)| {
            let mut take = |length: usize| {
                let (taken, rest) = parameters.split_at_checked(length).unwrap_or_default();
                parameters = rest;
                taken
            };
            let weights = take(weights).iter().map(|weight| weight.cast_signed()).collect();
            let bias = take(biases.saturating_mul(2));
            Layer {
                weights,
                bias: bias.as_chunks().0.iter().map(|value| i16::from_le_bytes(*value)).collect(),
            }
        });
        Ok(Self { header, layers })
    }

    /// The bytes of the network.
    ///
    /// # Errors
    /// Unsupported or invalid: the header, as for [`Self::parse`].
    pub fn to_bytes(&self) -> Result<Vec<u8>> {
        self.header.validate(0)?;
        let mut bytes = encode(&self.header);
        for layer in &self.layers {
            bytes.extend(layer.weights.iter().flat_map(|weight| weight.to_le_bytes()));
            bytes.extend(layer.bias.iter().flat_map(|bias| bias.to_le_bytes()));
        }
        Ok(bytes)
    }

    /// The parameters of a part.
    pub fn layer(&self, part: Part) -> &Layer {
        const ABSENT: &Layer = &Layer { weights: Vec::new(), bias: Vec::new() };
        let layer = Part::ALL.iter().zip(&self.layers).find(|(other, _)| **other == part);
        layer.map_or(ABSENT, |(_, layer)| layer)
    }
}

/// The payload of a weights unit.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Weights {
    /// A network of its own.
    Carried(Box<Network>),
    /// The SHA-256 of a registered network.
    Registered([u8; 32]),
}

impl Weights {
    /// Reads and checks a payload that stands at offset `at`.
    ///
    /// # Errors
    /// Malformed: bytes are missing or left over. Unsupported: a reserved source. Those of [`Network::parse`]
    /// for a network that is carried.
    pub fn parse(payload: &[u8], at: u64) -> Result<Self> {
        let (header, rest) = WeightsHeader::parse(payload, at)?;
        Self::parse_rest(header, rest, at)
    }

    /// Reads `rest`, the bytes after a header that has been accepted. `at` is the offset of the payload, that
    /// is of the header.
    ///
    /// # Errors
    /// Malformed: bytes are missing or left over. Those of [`Network::parse`] for a network that is carried.
    pub fn parse_rest(header: WeightsHeader, rest: &[u8], at: u64) -> Result<Self> {
        if header == WeightsHeader::CARRIED {
            return Network::parse(rest, after(at, WeightsHeader::SIZE)).map(Box::new).map(Self::Carried);
        }
        let mut reader = after_fixed_part(&WeightsHeader::TABLE, rest, at);
        let digest = reader.array("model")?;
        reader.end()?;
        Ok(Self::Registered(digest))
    }

    /// The bytes of the payload.
    ///
    /// # Errors
    /// Those of [`Network::to_bytes`] for a network that is carried.
    pub fn to_bytes(&self) -> Result<Vec<u8>> {
        let (header, model) = match self {
            Self::Carried(network) => (WeightsHeader::CARRIED, network.to_bytes()?),
            Self::Registered(digest) => (WeightsHeader::REGISTERED, digest.to_vec()),
        };
        let mut bytes = header.to_bytes()?;
        bytes.extend(model);
        Ok(bytes)
    }

    /// The network; `at` is the offset of the payload.
    ///
    /// # Errors
    /// Reserved (unsupported) if no registered network has the digest.
    pub fn network(self, at: u64) -> Result<Network> {
        match self {
            Self::Carried(network) => Ok(*network),
            Self::Registered(digest) => registered(&digest, after(at, WeightsHeader::SIZE)),
        }
    }
}

/// Registered networks: SHA-256 and bytes, the table of 6.17.
pub const REGISTRY: [([u8; 32], &[u8]); 1] = [(
    [
        0xeb, 0x23, 0xe7, 0x65, 0xa0, 0x5b, 0xf3, 0xf9, 0x74, 0xb0, 0x59, 0xae, 0xe3, 0xd3, 0xc3, 0x71, 0x87,
        0x1c, 0x85, 0x5c, 0x69, 0xc5, 0x5d, 0xd2, 0xb9, 0x34, 0xfc, 0x70, 0x6e, 0x5c, 0x0b, 0x79,
    ],
    include_bytes!("default-network.bin"),
)];

fn registered(digest: &[u8; 32], at: u64) -> Result<Network> {
    let known = REGISTRY.iter().find(|(name, _)| name == digest);
    // The digest is no number: its first byte stands for it.
    let value = digest.first().copied().unwrap_or(0).into();
    let unknown = Error::new(at, "6.17", ErrorKind::Reserved { element: "model", value });
    known.ok_or(unknown).and_then(|(_, bytes)| Network::parse(bytes, at))
}
