//! Which parts a network has.

use splatstream_format::Result;
use splatstream_format::syntax::NetworkHeader;

/// Which parts a network has, and how wide they are: 6.17.1 without the shifts of the layers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Architecture {
    /// Every neighbour attends to every other, as in the paper. Otherwise the new Gaussian alone does, in a fraction of
    /// the time.
    pub full_attention: bool,
    /// Tokens are multiplied by their affinity.
    pub gated: bool,
    /// What attention gives is normalised.
    pub normalised: bool,
    /// The outputs add to the knn prediction, not to the bilateral one.
    pub knn_base: bool,
    /// log2 of the width of an embedding, 3 to 6.
    pub width_log2: u8,
    /// Width of the feed-forward block, 0 to 128.
    pub feed_forward_width: u8,
    /// Width of the geometry network, 0 to 32.
    pub geometry_width: u8,
    /// Frequencies of the relative-position bias, 0 to 4.
    pub fourier_count: u8,
    /// Rows of the rank embedding, 1 to 16.
    pub rank_count: u8,
    /// Components of dc predicted, 0 to 3.
    pub dc_count: u8,
    /// Components of sh predicted, 0 to 16.
    pub sh_count: u8,
    /// log2 of the unit of an input, in step/64.
    pub token_shift: u8,
    /// log2 of the unit of an output, in step/64.
    pub output_shift: u8,
}

impl Default for Architecture {
    fn default() -> Self {
        Self::EARNING
    }
}

impl Architecture {
    /// What the paper names as far as it earns its bits and its time on the built-in scene: a single query, no gate, which
    /// costs 5 % of dc as affinities fall so fast that gated tokens are mostly 0, one rank and no normalisation.
    const EARNING: Self = Self {
        full_attention: false,
        gated: false,
        normalised: false,
        knn_base: true,
        width_log2: 4,
        feed_forward_width: 32,
        geometry_width: 8,
        fourier_count: 2,
        rank_count: 1,
        dc_count: 3,
        sh_count: 8,
        token_shift: 4,
        output_shift: 2,
    };

    /// The default one on each base: scenes differ in which is nearer.
    pub const BASES: [Self; 2] = [Self::EARNING, Self { knn_base: false, ..Self::EARNING }];

    /// The fixed part of a network of this architecture, as batches are made for it.
    ///
    /// A layer drops 6 bits: a single weight passes at most twice its input on, in steps of 1/64, and a layer of
    /// weights that keeps the size of its input uses a quarter of their range, see `Layout::initial`. The logits drop as
    /// many more as it takes to divide by the root of the width: for activations of 32, a quarter of their range, a
    /// logit of random rows is then 32, a factor of e in their shares.
    ///
    /// # Errors
    /// What 6.17.1 does not allow.
    #[expect(clippy::arithmetic_side_effects, reason = "constants of a few bits")]
    pub fn header(&self) -> Result<NetworkHeader> {
        let logit = 5 + self.width_log2.min(6) / 2;
        let header = NetworkHeader {
            network_flags: NetworkHeader::flags(
                self.full_attention,
                self.gated,
                self.normalised,
                self.knn_base,
            ),
            width_log2: self.width_log2,
            feed_forward_width: self.feed_forward_width,
            geometry_width: self.geometry_width,
            fourier_count: self.fourier_count,
            rank_count: self.rank_count,
            dc_count: self.dc_count,
            sh_count: self.sh_count,
            token_shift: self.token_shift,
            output_shift: self.output_shift,
            layer_shift: [6, 6, 6, logit, 6, 6, 6, 6],
        };
        header.validate(0)?;
        Ok(header)
    }
}

impl From<NetworkHeader> for Architecture {
    /// The architecture of a network, for example of one to start from.
    fn from(header: NetworkHeader) -> Self {
        Self {
            full_attention: header.full_attention(),
            gated: header.gated(),
            normalised: header.normalised(),
            knn_base: header.knn_base(),
            width_log2: header.width_log2,
            feed_forward_width: header.feed_forward_width,
            geometry_width: header.geometry_width,
            fourier_count: header.fourier_count,
            rank_count: header.rank_count,
            dc_count: header.dc_count,
            sh_count: header.sh_count,
            token_shift: header.token_shift,
            output_shift: header.output_shift,
        }
    }
}
