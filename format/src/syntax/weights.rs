//! 5.17 weights: which network predicts new Gaussians, and what it is made of.

use super::{decode, record_io, table};
use crate::Result;

/// Bits of `network_flags`.
const FULL_ATTENTION: u8 = 1;
const GATED: u8 = 2;
const NORMALISED: u8 = 4;
const KNN_BASE: u8 = 8;

table! {
    /// 5.17 — the fixed part of a weights unit; the network, or its SHA-256, follows.
    "5.17" "6.17" weights WeightsHeader {
        /// 0 is a network, 1 the SHA-256 of a registered one
        model_source: u8,
    }
}

record_io!(WeightsHeader);

impl WeightsHeader {
    /// A network that the unit carries.
    pub const CARRIED: Self = Self { model_source: 0 };
    /// A network that the specification holds.
    pub const REGISTERED: Self = Self { model_source: 1 };

    /// 6.17.
    ///
    /// # Errors
    /// Unsupported: a reserved source.
    pub fn validate(&self, at: u64) -> Result<()> {
        Self::TABLE.check(at).known(self.model_source <= 1, "model_source", self.model_source)
    }
}

table! {
    /// 5.17.1 — the fixed part of a network; the parameters follow.
    "5.17.1" "6.17.1" network NetworkHeader {
        /// bit 0 full attention, bit 1 gated, bit 2 normalised, bit 3 knn base
        network_flags: u8,
        /// log2 of the width of an embedding, 3 to 6
        width_log2: u8,
        /// width of the feed-forward block, 0 to 128
        feed_forward_width: u8,
        /// width of the geometry network, 0 to 32
        geometry_width: u8,
        /// frequencies of the relative-position bias, 0 to 4
        fourier_count: u8,
        /// rows of the rank embedding, 1 to 16
        rank_count: u8,
        /// components of dc predicted, 0 to 3
        dc_count: u8,
        /// components of sh predicted, 0 to 16
        sh_count: u8,
        /// log2 of the unit of an input, in step/64
        token_shift: u8,
        /// log2 of the unit of an output, in step/64
        output_shift: u8,
        /// bits that each layer drops, 1 to 15
        layer_shift: u8[8],
    }
}

impl NetworkHeader {
    /// Reads and checks the fixed part of a network that stands at offset `at`; gives the bytes after it.
    ///
    /// # Errors
    /// Malformed: bytes are missing. Those of [`Self::validate`].
    pub fn parse(bytes: &[u8], at: u64) -> Result<(Self, &[u8])> {
        let (header, rest): (Self, _) = decode(&Self::TABLE, bytes, at)?;
        header.validate(at)?;
        Ok((header, rest))
    }

    /// `network_flags` of their meanings.
    pub fn flags(full_attention: bool, gated: bool, normalised: bool, knn_base: bool) -> u8 {
        let meanings = [
            (full_attention, FULL_ATTENTION),
            (gated, GATED),
            (normalised, NORMALISED),
            (knn_base, KNN_BASE),
        ];
        meanings.into_iter().filter(|(set, _)| *set).fold(0, |flags, (_, flag)| flags | flag)
    }

    /// Every neighbour attends to every other, not the new Gaussian alone to its neighbours.
    pub const fn full_attention(&self) -> bool {
        self.network_flags & FULL_ATTENTION != 0
    }

    /// Tokens are multiplied by their affinity.
    pub const fn gated(&self) -> bool {
        self.network_flags & GATED != 0
    }

    /// What attention gives is normalised.
    pub const fn normalised(&self) -> bool {
        self.network_flags & NORMALISED != 0
    }

    /// What the outputs add to, and what predicts the other attributes, is the knn prediction, not the bilateral one.
    pub const fn knn_base(&self) -> bool {
        self.network_flags & KNN_BASE != 0
    }

    /// Width of an embedding, 8 to 64.
    pub fn width(&self) -> usize {
        1_usize.wrapping_shl(self.width_log2.into())
    }

    /// Components predicted, at most 19.
    pub fn outputs(&self) -> usize {
        usize::from(self.dc_count).saturating_add(self.sh_count.into())
    }

    /// Inputs of a token, at most 27.
    pub fn inputs(&self) -> usize {
        self.outputs().saturating_add(8)
    }

    /// 6.17.1.
    ///
    /// # Errors
    /// Unsupported: reserved flags. Invalid: a value outside its range, or a network without outputs.
    pub fn validate(&self, at: u64) -> Result<()> {
        let check = Self::TABLE.check(at);
        check.reserved_bits(
            "network_flags",
            0,
            self.network_flags & !(FULL_ATTENTION | GATED | NORMALISED | KNN_BASE),
        )?;
        check.range("width_log2", self.width_log2, 3, 6)?;
        check.range("feed_forward_width", self.feed_forward_width, 0, 128)?;
        check.range("geometry_width", self.geometry_width, 0, 32)?;
        check.range("fourier_count", self.fourier_count, 0, 4)?;
        check.range("rank_count", self.rank_count, 1, 16)?;
        check.range("dc_count", self.dc_count, 0, 3)?;
        check.range("sh_count", self.sh_count, 0, 16)?;
        check.range("token_shift", self.token_shift, 0, 8)?;
        check.range("output_shift", self.output_shift, 0, 4)?;
        for (index, shift) in self.layer_shift.into_iter().enumerate() {
            check.range_in("layer_shift", index, shift, 1, 15)?;
        }
        // A network without outputs: dc_count is 0 here.
        check.range("sh_count", self.sh_count, u8::from(self.dc_count == 0), 16)
    }
}
