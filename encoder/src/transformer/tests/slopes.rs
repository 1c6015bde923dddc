//! Slopes against differences of the network without rounding.

use super::super::gradient::Gradient;
use super::super::lane::{Lane, Real};
use super::*;
use splatstream_format::payload::Part;

/// Any slope of the outputs.
fn any_slope(layout: &Layout, random: &mut SplitMix64) -> Vec<Lane> {
    (0..layout.header.outputs()).map(|_| [(); LANES].map(|()| random.signed())).collect()
}

/// The sum of the outputs times `slope`.
fn value(layout: &Layout, parameters: &[f32], batch: &Batch, slope: &[Lane]) -> f64 {
    let trace_of = Model::new::<Real>(layout, parameters);
    let trace = trace_of.forward::<Real>(batch);
    let products = trace.out.iter().flatten().zip(slope.iter().flatten());
    products.map(|(out, slope)| f64::from(*out) * f64::from(*slope)).sum()
}

/// How far slopes are from differences, of their length; `None` if both are none.
fn error(pairs: &[(f64, f64)]) -> Option<f64> {
    let length = pairs.iter().map(|(_, b)| b * b).sum::<f64>().sqrt();
    let apart = pairs.iter().map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt();
    (length > 0.0).then(|| apart / length)
}

#[test]
fn slopes_are_those_of_every_part() {
    let mut random = SplitMix64::new(7);
    for (name, architecture) in variants() {
        let layout = Layout::new(architecture.header().unwrap());
        let parameters = any_parameters(&layout, 0.7, &mut random);
        let batch = any_batch(&layout.header, 5, &mut random);
        let slope = any_slope(&layout, &mut random);
        let model = Model::new::<Real>(&layout, &parameters);
        let mut gradient = Gradient::new(&layout);
        model.backward::<Real>(&model.forward::<Real>(&batch), slope.clone(), &mut gradient);
        let (slopes, scales) = (gradient.totals(), layout.scales());
        for part in Part::ALL {
            for range in [layout.weights(part), layout.bias(part)] {
                if range.is_empty() {
                    continue;
                }
                let difference = |_| {
                    let index = range.start + random.below(range.len());
                    let apart = 0.05 * scales[index];
                    let moved = |by: f32| {
                        let mut moved = parameters.clone();
                        moved[index] += by;
                        value(&layout, &moved, &batch, &slope)
                    };
                    let difference = (moved(apart) - moved(-apart)) / (2.0 * f64::from(apart));
                    (f64::from(slopes[index]), difference)
                };
                let pairs: Vec<(f64, f64)> = (0..24).map(difference).collect();
                let error = error(&pairs).unwrap_or_else(|| panic!("{name}: {part:?} does nothing"));
                assert!(error < 0.03, "{name}: {part:?} is off by {error}: {pairs:?}");
            }
        }
    }
}
