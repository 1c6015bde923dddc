//! Choices that decoders feel: what a tool, a codebook, refinements or a predictor cost them, and what they save.

use crate::sweep::{Group, Variant};
use splatstream_decoder::predictor::Predictor;
use splatstream_encoder::{Predictors, Settings, ShChoice, Structure, Tools};

/// The baseline with one choice made otherwise, for single frames or for a GOP with predicted frames.
pub(super) fn choices(baseline: &Settings, is_gop: bool, sh_degree: u8) -> Vec<Variant> {
    let without = |name: &str, tools: Tools| Variant {
        name: format!("without {name}"),
        group: Group::Without,
        reorders: false,
        settings: Settings { tools, ..baseline.clone() },
    };
    let tools = baseline.tools;
    let mut variants = vec![
        without("contexts", Tools { contexts: false, ..tools }),
        without("table-reuse", Tools { table_reuse: false, ..tools }),
        chosen("one refinement", Settings { refinements: vec![100], ..baseline.clone() }),
    ];
    if sh_degree > 0 {
        let sh = |sh: ShChoice| Settings { sh, ..baseline.clone() };
        variants.extend([
            without("sh-transform", Tools { sh_transform: false, ..tools }),
            chosen("SH as coefficients", sh(ShChoice::Coefficients)),
            chosen("SH in a codebook", sh(ShChoice::VectorQuantised)),
        ]);
    }
    if is_gop {
        variants.push(without("cell-motion", Tools { cell_motion: false, ..tools }));
        variants.extend(of_gop(baseline));
    } else {
        // Axes of Gaussians that others are predicted from are not sorted.
        variants.push(without("axis-sort", Tools { axis_sort: false, ..tools }));
    }
    variants
}

/// Predictors and layers.
fn of_gop(baseline: &Settings) -> Vec<Variant> {
    let by = |predictors: Predictors| Settings { predictors, ..baseline.clone() };
    let only = |predictor: Predictor| by(Predictors::one(predictor));
    let alone = Settings { structure: Structure::Intra, ..baseline.clone() };
    vec![
        chosen("predictor none", by(Predictors::NONE)),
        chosen("predictor knn", only(Predictor::Knn)),
        chosen("predictor bilateral", only(Predictor::Bilateral)),
        chosen("predictor transformer", only(Predictor::Transformer)),
        chosen("one spatial layer", Settings { spatial_layers: 1, ..baseline.clone() }),
        chosen("every frame by itself", Settings { spatial_layers: 1, ..alone }),
    ]
}

fn chosen(name: &str, settings: Settings) -> Variant {
    Variant { name: name.to_owned(), group: Group::Chosen, reorders: false, settings }
}
