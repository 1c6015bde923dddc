//! The steps of quantisers that are asked for.

/// Quantiser steps. Attributes in PLY's domain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Steps {
    /// The position step is the side of the box that most of the scene is in divided by 2 to this, 1 to 20.
    pub position_bits: f32,
    /// Step of the natural log of the semi-axes.
    pub log_scale: f32,
    /// Step of a quaternion component.
    pub rotation: f32,
    /// Step of the opacity logit.
    pub opacity: f32,
    /// Step of a dc component.
    pub dc: f32,
    /// Step of an SH component.
    pub sh: f32,
}

impl Steps {
    /// Steps that give about a PSNR on an average scene.
    pub(crate) fn about(decibels: f32) -> Self {
        // At 50 dB, between those that fit real scenes best.
        let times = libm::exp2f((50.0 - decibels) / 6.02);
        Self {
            position_bits: (12.0 - libm::log2f(times)).clamp(1.0, 20.0),
            log_scale: 0.2 * times,
            rotation: 0.033 * times,
            opacity: 0.26 * times,
            dc: 0.13 * times,
            sh: 0.125 * times,
        }
    }
}
