//! One decision of the encoder, in words.

use serde::Serialize;
use splatstream_encoder::Basis;

/// One decision of the encoder.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Choice {
    tool: &'static str,
    choice: String,
    why: String,
    /// Bits per Gaussian that it takes less than the other choice, below 0 more; none if that is not known.
    saved_bpg: Option<f64>,
    /// How that is known.
    basis: Option<&'static str>,
}

impl Choice {
    pub(super) fn new(tool: &'static str, choice: impl Into<String>, why: impl Into<String>) -> Self {
        Self { tool, choice: choice.into(), why: why.into(), saved_bpg: None, basis: None }
    }

    /// With what it saves, if that is known.
    pub(super) fn saving(self, saving: Option<(f64, Basis)>) -> Self {
        let basis = saving.map(|(_, basis)| match basis {
            Basis::Measured => "measured",
            Basis::Estimated => "estimated",
        });
        Self { saved_bpg: saving.map(|(bits, _)| bits), basis, ..self }
    }

    /// A line for people.
    pub(crate) fn text(&self) -> String {
        let saved = self.saved_bpg.zip(self.basis).map(|(bits, basis)| {
            let verb = if bits < 0.0 { "costs" } else { "saves" };
            format!("; {verb} {:.2} bits per Gaussian, {basis}", bits.abs())
        });
        format!("  {:<18} {}: {}{}\n", self.tool, self.choice, self.why, saved.unwrap_or_default())
    }
}
