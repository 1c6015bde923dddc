//! Networks learn, and the same each time.

use super::super::{Loss, Progress, Schedule, TrainingReport, train};
use super::*;
use crate::Error;
use splatstream_format::payload::Network;
use std::ops::ControlFlow;

const NEIGHBOURS: usize = 4;

/// Gaussians that have the colour of the one neighbour that is as opaque as they are.
fn problem(header: &NetworkHeader, samples: usize, seed: u64) -> Vec<Sample> {
    let mut random = SplitMix64::new(seed);
    let mut sample = |_| {
        let mut batch = any_batch(header, NEIGHBOURS, &mut random);
        let mut wanted = vec![[0; LANES]; header.outputs()];
        for lane in 0..LANES {
            let alike = random.below(NEIGHBOURS);
            for neighbour in 0..NEIGHBOURS {
                let shift = header.token_shift;
                let colour: Vec<i32> =
                    (0..header.outputs()).map(|_| within(&mut random, 90) << shift).collect();
                let components: Vec<i64> = colour.iter().map(|&value| i64::from(value) << 12).collect();
                let opacity = if neighbour == alike { 0 } else { 60 };
                let geometry = [within(&mut random, 9), 0, 0, opacity, 0, within(&mut random, 9), 0];
                let seen = Seen {
                    components: &components,
                    geometry,
                    affinity: 4096,
                    distance: 7,
                    ..Seen::default()
                };
                batch.set_token(header, (lane, neighbour), &seen, 99);
                if neighbour == alike {
                    wanted.iter_mut().zip(colour).for_each(|(row, value)| row[lane] = value);
                }
            }
        }
        Sample { batch, wanted, used: LANES - random.below(3) }
    };
    (0..samples).map(&mut sample).collect()
}

const SCHEDULE: Schedule<'static> =
    Schedule { seed: 5, epochs: 8, batch: 2, learning_rate: 1.5, patience: 8, weights: None, start: None };

fn trained(
    architecture: &Architecture,
    schedule: &Schedule<'_>,
    threads: usize,
) -> (Network, TrainingReport) {
    let header = architecture.header().unwrap();
    let (training, validation) = (problem(&header, 48, 1), problem(&header, 16, 2));
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let mut go_on = |_: &Progress| ControlFlow::Continue(());
    pool.install(|| train(architecture, &training, &validation, schedule, &mut go_on)).unwrap()
}

#[test]
fn every_architecture_learns_and_the_same_with_any_number_of_threads() {
    for (name, architecture) in variants() {
        let (network, report) = trained(&architecture, &SCHEDULE, 1);
        let ones = [1.0; 3];
        let (base, best) = (report.base.weighted(&ones), report.best.weighted(&ones));
        assert!(best < 0.6 * base, "{name}: {base} becomes {best}");
        assert_eq!(report.start, report.base, "{name}");
        assert_eq!(report.best, Loss::of(&network, &problem(&network.header, 16, 2)), "{name}");
        let again = trained(&architecture, &SCHEDULE, 2);
        assert_eq!(network.to_bytes().unwrap(), again.0.to_bytes().unwrap(), "{name}");
        assert_eq!(report, again.1, "{name}");
    }
}

#[test]
fn a_network_to_start_from_is_never_made_worse() {
    let (network, report) = trained(&ALL, &SCHEDULE, 2);
    // Steps that are too short to turn a weight to the next integer.
    let idle = Schedule { learning_rate: 1e-6, patience: 2, start: Some(&network), ..SCHEDULE };
    let (same, idled) = trained(&ALL, &idle, 2);
    assert_eq!(same, network);
    assert_eq!([&idled.start, &idled.best], [&report.best; 2]);
    assert_eq!((idled.best_epoch, idled.epochs.len()), (0, 2), "training ends when nothing is learnt");
    let further = Schedule { epochs: 3, learning_rate: 0.2, seed: 6, ..idle };
    let (_, report) = trained(&ALL, &further, 2);
    assert!(report.best.weighted(&[1.0; 3]) <= report.start.weighted(&[1.0; 3]));
}

#[test]
fn outputs_that_count_nothing_stay_those_of_the_base() {
    let schedule = Schedule { weights: Some(&[0.0, 1.0, 0.0]), ..SCHEDULE };
    let (_, TrainingReport { base, best, .. }) = trained(&BARE, &schedule, 2);
    assert_eq!([best.sums[0], best.sums[2]], [base.sums[0], base.sums[2]]);
    assert!(best.sums[1] < base.sums[1] / 2);
}

#[test]
fn training_ends_when_it_is_told_to() {
    let samples = problem(&BARE.header().unwrap(), 8, 1);
    let mut seen = Vec::new();
    let mut twice = |progress: &Progress| {
        seen.push(*progress);
        if seen.len() < 2 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    };
    let (network, report) = train(&BARE, &samples, &[], &SCHEDULE, &mut twice).unwrap();
    assert_eq!(seen.iter().map(|progress| progress.epoch).collect::<Vec<_>>(), [1, 2]);
    assert_eq!(report.epochs, seen);
    assert_eq!(report.best, Loss::of(&network, &samples), "the samples are their own validation");
}

#[test]
fn what_does_not_fit_together_is_refused() {
    let header = BARE.header().unwrap();
    let samples = problem(&header, 2, 1);
    let refused = |architecture: &Architecture, samples: &[Sample], schedule: &Schedule<'_>| match train(
        architecture,
        samples,
        &[],
        schedule,
        &mut |_| ControlFlow::Continue(()),
    ) {
        Err(Error::Setting { name, .. }) => name,
        Err(Error::Syntax(_)) => "syntax",
        other => panic!("{other:?}"),
    };
    let changed = |change: &dyn Fn(&mut Sample)| {
        let mut samples = samples.clone();
        change(&mut samples[1]);
        refused(&BARE, &samples, &SCHEDULE)
    };
    assert_eq!(changed(&|sample| sample.used = 0), "sample");
    assert_eq!(changed(&|sample| sample.used = LANES + 1), "sample");
    assert_eq!(changed(&|sample| sample.wanted.truncate(2)), "sample");
    assert_eq!(changed(&|sample| sample.batch = Batch::new(&header, 0)), "sample");
    let other = Architecture { sh_count: 2, ..BARE };
    assert_eq!(changed(&|sample| sample.batch = Batch::new(&other.header().unwrap(), 4)), "sample");
    let layout = Layout::new(other.header().unwrap());
    let network = layout.network(&layout.initial(1)).unwrap();
    let schedules = [
        ("start", Schedule { start: Some(&network), ..SCHEDULE }),
        ("weights", Schedule { weights: Some(&[1.0; 4]), ..SCHEDULE }),
        ("weights", Schedule { weights: Some(&[1.0, f32::NAN, 1.0]), ..SCHEDULE }),
        ("batch", Schedule { batch: 0, ..SCHEDULE }),
        ("learning rate", Schedule { learning_rate: 0.0, ..SCHEDULE }),
    ];
    for (name, schedule) in schedules {
        assert_eq!(refused(&BARE, &samples, &schedule), name);
    }
    assert_eq!(refused(&Architecture { width_log2: 7, ..BARE }, &samples, &SCHEDULE), "syntax");
}
