//! The first GOP of a sequence, with predicted frames: the two tables of the paper, and what tools are worth.

use super::elements::how_to_read;
use crate::columns;
use crate::gop::Gop;
use crate::levels::COLUMNS;
use maud::{Markup, html};

/// All tables of a GOP.
pub(super) fn part(gop: &Gop) -> Markup {
    html! {
        h3 { "Operating points of the first GOP" }
        (how_to_read(
            "each row is a way to play the stream: a client starts with the first spatial layer of the intra frame (I0), \
             completes that frame, then adds predicted frames (P, B), first at half the frame rate, then all of them \
             at ever more refinements; Mbit/s are 8 × the size over the duration of the GOP."
        ))
        (columns::html(&gop.modes))
        h3 { "Refinement levels of predicted frames" }
        (how_to_read(
            "each row adds Gaussians to the row above: sizes are of all units up to the level; bits are per Gaussian \
             received. Carried: Gaussians that have not come are taken from the intra frame, as our decoder shows \
             them. Subset: each of these frames by itself, its largest and most opaque Gaussians and nothing else, \
             as the paper shows them."
        ))
        (columns::html(&gop.levels))
        @if gop.frames > COLUMNS + 1 { p.note { "Frames after these are in refinements.csv." } }
        h3 { "What the tools of predicted frames are worth" }
        (how_to_read(
            "each row codes the same GOP with one tool left out or another choice of predictors; sizes and metrics \
             are of predicted frames, everything decoded."
        ))
        (columns::html(&gop.tools))
        @if !gop.ablation.is_empty() {
            h3 { "What predictors of new Gaussians are worth" }
            (how_to_read(
                "each row codes the same GOP with another choice of predictors: one for every new Gaussian, or what \
                 saves bits (auto); below, the network with one of its parts changed or left out, trained again. Bits of \
                 dc and sh are per new Gaussian, the intra frame included; the network itself is counted apart."
            ))
            (columns::html(&gop.ablation))
        }
    }
}
