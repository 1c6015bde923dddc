#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

mod matrix;
mod slopes;
mod training;

use super::lane::Whole;
use super::model::Model;
use super::parameters::Layout;
use super::{Architecture, Sample};
use splatstream_decoder::transformer::{Batch, LANES, LaneNetwork, Seen, scalar};
use splatstream_format::syntax::NetworkHeader;
use splatstream_gaussians::random::SplitMix64;

/// Nothing that can be left out.
const BARE: Architecture = Architecture {
    full_attention: false,
    gated: false,
    normalised: false,
    knn_base: false,
    width_log2: 3,
    feed_forward_width: 0,
    geometry_width: 0,
    fourier_count: 0,
    rank_count: 1,
    dc_count: 2,
    sh_count: 1,
    token_shift: 2,
    output_shift: 1,
};

/// Everything, in widths that are no multiples of others.
const ALL: Architecture = Architecture {
    gated: true,
    normalised: true,
    feed_forward_width: 13,
    geometry_width: 5,
    fourier_count: 3,
    rank_count: 3,
    ..BARE
};

/// Every part of a network alone, and all of them.
fn variants() -> Vec<(&'static str, Architecture)> {
    let full = |architecture: Architecture| Architecture { full_attention: true, ..architecture };
    vec![
        ("bare", BARE),
        ("gated", Architecture { gated: true, ..BARE }),
        ("normalised", Architecture { normalised: true, ..BARE }),
        ("feed-forward block", Architecture { feed_forward_width: 13, ..BARE }),
        ("geometry network", Architecture { geometry_width: 5, ..BARE }),
        ("relative-position bias", Architecture { fourier_count: 3, ..BARE }),
        ("ranks", Architecture { rank_count: 3, ..BARE }),
        ("all", ALL),
        ("wide", Architecture { width_log2: 4, ..ALL }),
        ("full attention", full(BARE)),
        ("full attention, all", full(ALL)),
    ]
}

/// From `-reach` to `reach`.
fn within(random: &mut SplitMix64, reach: i32) -> i32 {
    random.below(2 * reach as usize + 1) as i32 - reach
}

/// A batch of anything.
fn any_batch(header: &NetworkHeader, neighbours: usize, random: &mut SplitMix64) -> Batch {
    let mut batch = Batch::new(header, neighbours);
    for lane in 0..LANES {
        for neighbour in 0..neighbours {
            let components: Vec<i64> = (0..header.outputs())
                .map(|_| i64::from(within(random, 90)) << (12 + header.token_shift))
                .collect();
            let geometry = [(); 7].map(|()| within(random, 40));
            let (affinity, distance) = (4096 - random.below(2000) as i64, 10 * neighbour as u64 + 5);
            let seen = Seen { components: &components, geometry, affinity, distance, ..Seen::default() };
            batch.set_token(header, (lane, neighbour), &seen, 10 * neighbours as u64);
        }
        let offsets: Vec<[i32; 3]> =
            (0..neighbours).map(|_| [(); 3].map(|()| within(random, 1000))).collect();
        batch.set_near(lane, &offsets);
    }
    batch
}

/// Parameters of about the size that training gives them; `spread` times as much.
fn any_parameters(layout: &Layout, spread: f32, random: &mut SplitMix64) -> Vec<f32> {
    let mut parameters = layout.initial(random.bits());
    for (value, scale) in parameters.iter_mut().zip(layout.scales()) {
        *value = spread * (*value + 12.0 * scale * random.signed());
    }
    layout.confine(&mut parameters);
    parameters
}

#[test]
fn the_pass_forwards_is_the_network_of_the_decoder() {
    let mut random = SplitMix64::new(1);
    for (name, architecture) in variants() {
        let layout = Layout::new(architecture.header().unwrap());
        for (spread, neighbours) in [(1.0, 8), (4.0, 3), (1.0, 1), (0.5, 16)] {
            let parameters = any_parameters(&layout, spread, &mut random);
            let network = layout.network(&parameters).unwrap();
            assert_eq!(layout.of(&network).len(), layout.len());
            let batch = any_batch(&layout.header, neighbours, &mut random);
            let model = Model::new::<Whole>(&layout, &parameters);
            let outputs = model.outputs(&model.forward::<Whole>(&batch));
            let decoded = LaneNetwork::new(&network).outputs(&batch);
            assert_eq!(outputs, decoded[..outputs.len()], "{name}, {neighbours} neighbours");
            for lane in 0..LANES {
                let own: Vec<i32> = outputs.iter().map(|row| row[lane]).collect();
                assert_eq!(own, scalar::outputs(&network, &batch, lane), "{name}");
            }
        }
    }
}

#[test]
fn parameters_of_a_network_are_those_it_was_made_of() {
    for (name, architecture) in variants() {
        let layout = Layout::new(architecture.header().unwrap());
        let network = layout.network(&any_parameters(&layout, 2.0, &mut SplitMix64::new(3))).unwrap();
        assert_eq!(layout.network(&layout.of(&network)).unwrap(), network, "{name}");
        assert_eq!(Architecture::from(network.header), architecture);
    }
}
