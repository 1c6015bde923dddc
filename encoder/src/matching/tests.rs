#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

use super::*;
use crate::settings::Quality;
use splatstream_gaussians::random::SplitMix64;

/// A frame for tests: 1,000 grid steps wide, sizes of 4 steps and more, one grid step to the scene unit.
#[derive(Clone, Default)]
pub(crate) struct Scene {
    pub(crate) position: [Vec<f32>; 3],
    pub(crate) log_scale: [Vec<f32>; 3],
    pub(crate) opacity: Vec<f32>,
    pub(crate) dc: [Vec<f32>; 3],
    pub(crate) row: Vec<u32>,
}

impl Scene {
    pub(crate) fn random(count: usize, seed: u64) -> Self {
        let mut random = SplitMix64::new(seed);
        let mut scene = Self::default();
        for _ in 0..count {
            scene.position.iter_mut().for_each(|plane| plane.push(1000.0 + 1000.0 * random.unit() as f32));
            scene.log_scale.iter_mut().for_each(|plane| plane.push(1.5 + 1.5 * random.unit() as f32));
            scene.opacity.push(4.0 * random.signed());
            scene.dc.iter_mut().for_each(|plane| plane.push(random.signed()));
        }
        scene
    }

    pub(crate) fn cloud(&self) -> Cloud<'_> {
        Cloud {
            position: self.position.each_ref().map(Vec::as_slice),
            log_scale: self.log_scale.each_ref().map(Vec::as_slice),
            opacity: &self.opacity,
            dc: self.dc.each_ref().map(Vec::as_slice),
            row: &self.row,
            row_count: self.opacity.len() as u32,
        }
    }

    fn planes(&mut self) -> [&mut Vec<f32>; 10] {
        let Self { position: [x, y, z], log_scale: [a, b, c], opacity, dc: [red, green, blue], .. } = self;
        [x, y, z, a, b, c, opacity, red, green, blue]
    }

    /// The Gaussians `rows`, in that order.
    pub(crate) fn select(&self, rows: &[usize]) -> Self {
        let mut selected = self.clone();
        for plane in selected.planes() {
            *plane = rows.iter().map(|&row| plane[row]).collect();
        }
        selected
    }

    /// Everything a little different, from a row on.
    pub(crate) fn noisy(mut self, first: usize, seed: u64) -> Self {
        let mut random = SplitMix64::new(seed);
        let noise = [0.2, 0.2, 0.2, 0.05, 0.05, 0.05, 0.08, 0.04, 0.04, 0.04];
        for (plane, noise) in self.planes().into_iter().zip(noise) {
            plane[first..].iter_mut().for_each(|value| *value += noise * random.signed());
        }
        self
    }

    pub(crate) fn moved(mut self, shift: [f32; 3]) -> Self {
        for (plane, shift) in self.position.iter_mut().zip(shift) {
            plane.iter_mut().for_each(|value| *value += shift);
        }
        self
    }
}

pub(crate) fn measure() -> Measure {
    Measure { position_step: 1.0, steps: Quality::High.steps(), same: 1.5 }
}

/// 0 to `count` in an order that has nothing to do with it; the prefix keeps its place.
pub(crate) fn shuffled(prefix: usize, count: usize, seed: u64) -> Vec<usize> {
    let mut random = SplitMix64::new(seed);
    let mut keyed: Vec<(u64, usize)> = (prefix..count).map(|row| (random.bits(), row)).collect();
    keyed.sort_unstable();
    (0..prefix).chain(keyed.into_iter().map(|(_, row)| row)).collect()
}

const REACH: Reach = Reach { scales: 3.0, least: 4.0 };

fn matched(reference: &Scene, target: &Scene) -> Matching {
    let mut matching = by_index(&reference.cloud(), &target.cloud(), &measure());
    matching.add_nearest(&reference.cloud(), &target.cloud(), &measure(), REACH, LIMIT);
    matching
}

/// How many pairs are the same row of the scene that both are made of.
fn right(matching: &Matching, rows: &[usize]) -> usize {
    let same = |&(from, to): &(usize, &Option<u32>)| to.is_some_and(|to| rows[to as usize] == from);
    matching.target_of.iter().enumerate().filter(same).count()
}

#[test]
fn rows_that_keep_their_meaning_match_however_far_they_move() {
    let reference = Scene::random(2000, 1);
    let mut target = reference.clone().moved([500.0, -300.0, 80.0]);
    // A few change so much that nothing but their row tells what they are.
    target.dc[0][..60].fill(3.0);
    let matching = matched(&reference, &target);
    assert_eq!((matching.kind, matching.by_index), (Kind::Tracked, 1.0));
    assert_eq!(right(&matching, &(0..2000).collect::<Vec<_>>()), 2000);
}

#[test]
fn rows_are_those_of_the_file_whatever_was_left_out() {
    let scene = Scene::random(1000, 2);
    let part = |kept: fn(&usize) -> bool| {
        let rows: Vec<usize> = (0..1000).filter(kept).collect();
        Scene { row: rows.iter().map(|&row| row as u32).collect(), ..scene.select(&rows) }
    };
    let (reference, target) = (part(|row| row % 50 != 7), part(|row| row % 40 != 9).moved([300.0; 3]));
    let matching = by_index(
        &Cloud { row_count: 1000, ..reference.cloud() },
        &Cloud { row_count: 1000, ..target.cloud() },
        &measure(),
    );
    assert_eq!(matching.kind, Kind::Tracked);
    for (from, to) in matching.target_of.iter().enumerate() {
        let row = reference.row[from];
        assert_eq!(to.map(|to| target.row[to as usize]), (row % 40 != 9).then_some(row));
    }
}

#[test]
fn a_shuffled_frame_matches_by_place_and_attributes() {
    let reference = Scene::random(3000, 3);
    let rows = shuffled(0, 3000, 4);
    let target = reference.select(&rows).noisy(0, 5);
    let matching = matched(&reference, &target);
    assert_eq!((matching.kind, matching.by_index), (Kind::Untracked, 0.0));
    assert_eq!(right(&matching, &rows), 3000);
    assert!(!shares_little(&matching));
}

#[test]
fn a_prefix_that_stays_matches_by_row_and_the_rest_by_place() {
    let reference = Scene::random(4000, 6);
    let mut rows = shuffled(2400, 4000, 7);
    // 3 % are gone, and as many are there twice.
    rows.truncate(3880);
    let last: Vec<usize> = rows[3760..].to_vec();
    rows.extend(&last);
    let target = reference.select(&rows).noisy(2400, 8);
    let matching = matched(&reference, &target);
    assert_eq!(matching.kind, Kind::Partly);
    assert!(matching.by_index > 0.58, "{}", matching.by_index);
    assert!(right(&matching, &rows) >= 3870, "{}", right(&matching, &rows));
    let mut targets: Vec<u32> = matching.target_of.iter().copied().flatten().collect();
    targets.sort_unstable();
    assert!(targets.windows(2).all(|pair| pair[0] < pair[1]), "a target is taken twice");
}

#[test]
fn rows_that_look_alike_but_move_apart_are_not_trusted() {
    let mut reference = Scene::random(2000, 9);
    reference.opacity.fill(1.0);
    reference.dc.iter_mut().for_each(|plane| plane.fill(0.5));
    reference.log_scale.iter_mut().for_each(|plane| plane.fill(2.0));
    let other = Scene { position: Scene::random(2000, 10).position, ..reference.clone() };
    assert_eq!(by_index(&reference.cloud(), &other.cloud(), &measure()).kind, Kind::Untracked);
    let same = by_index(&reference.cloud(), &reference.clone().moved([40.0; 3]).cloud(), &measure());
    assert_eq!(same.kind, Kind::Tracked);
}

#[test]
fn another_scene_shares_little() {
    let matching = matched(&Scene::random(3000, 11), &Scene::random(3500, 12));
    assert_eq!(matching.kind, Kind::Untracked);
    assert!(shares_little(&matching) && !shares_much(&matching), "{matching:?}");
}

#[test]
fn nothing_and_everything_at_one_point_are_no_trouble() {
    let none = Scene::default();
    let some = Scene::random(5, 13);
    assert_eq!(matched(&none, &some).target_of, []);
    assert_eq!(matched(&some, &none).target_of, [None; 5]);
    let mut heap = Scene::random(20_000, 14);
    heap.position.iter_mut().for_each(|plane| plane.fill(7.0));
    let matching = matched(&heap, &heap.select(&shuffled(0, 20_000, 15)));
    assert_eq!(matching.kind, Kind::Untracked);
}

#[test]
fn threads_change_nothing() {
    let reference = Scene::random(3000, 16);
    let target = reference.select(&shuffled(0, 3000, 17)).noisy(0, 18);
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| matched(&reference, &target))
    };
    assert_eq!(with(1), with(3));
}

/// A frame without some of the rows, and another without others, in which a fifth of the Gaussians fade in: as captures are
/// written that leave out what cannot be seen.
fn thinned(scene: &Scene) -> (Scene, Scene, Vec<usize>, Vec<usize>) {
    let count = scene.opacity.len();
    let without = |every: usize| -> Vec<usize> { (0..count).filter(|row| row % every != 3).collect() };
    let (before, after) = (without(37), without(23));
    let mut faded = scene.clone().noisy(0, 5);
    faded.opacity.iter_mut().step_by(5).for_each(|opacity| *opacity += 5.0);
    (scene.select(&before), faded.select(&after), before, after)
}

#[test]
fn rows_that_shift_but_keep_their_order_match() {
    let (reference, target, before, after) = thinned(&Scene::random(2000, 4));
    let mut matching = matched(&reference, &target);
    let found = |matching: &Matching| {
        let same =
            |&(from, to): &(usize, &Option<u32>)| to.is_some_and(|to| after[to as usize] == before[from]);
        matching.target_of.iter().enumerate().filter(same).count()
    };
    let by_place = found(&matching);
    matching.add_ordered(&reference.cloud(), &target.cloud(), &measure());
    let both = before.iter().filter(|row| after.contains(row)).count();
    assert!(by_place * 100 < both * 90, "{by_place} of {both}");
    assert!(found(&matching) * 100 >= both * 99, "{} of {both}", found(&matching));
    assert_eq!(matching.kind, Kind::Partly);
}

#[test]
fn rows_in_another_order_are_left_alone() {
    let scene = Scene::random(2000, 4);
    let target = scene.clone().noisy(0, 5).select(&shuffled(0, 2000, 6));
    let mut matching = matched(&scene, &target);
    let before = matching.clone();
    matching.add_ordered(&scene.cloud(), &target.cloud(), &measure());
    assert_eq!(matching, before);
}

#[test]
fn what_is_unlike_does_not_depend_on_how_finely_it_is_coded() {
    let fine = Measure::steps_beside(&Quality::VisuallyLossless.steps());
    let finer = Steps { log_scale: 1e-4, opacity: 1e-4, dc: 1e-4, ..fine };
    let coarse = Steps { opacity: 2.0, ..finer };
    assert_eq!(Measure::steps_beside(&finer).log_scale, UNLIKE.log_scale);
    assert_eq!(Measure::steps_beside(&coarse).opacity, 2.0);
}
