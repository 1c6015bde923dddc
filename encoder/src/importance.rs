//! Which Gaussians come first.

mod footprint;
mod thinning;

pub(crate) use footprint::unhidden;

use crate::settings::{Importance, Preset, Settings};
use footprint::footprint;
use rayon::prelude::*;
use splatstream_format::syntax::prefix_length;
use splatstream_gaussians::{GaussianFrame, importance};
use splatstream_render::Camera;
use splatstream_render::camera::{Up, spiral};
use splatstream_render::contribution::{SmallViews, Worth};
use thinning::Thinning;

/// The Gaussians of a frame, most important first, and what pictures show of them.
#[derive(Debug, Clone, Default)]
pub(crate) struct Ranked {
    pub(crate) order: Vec<u32>,
    /// By Gaussian; empty where no views were needed.
    pub(crate) shown: Vec<Worth>,
}

/// Orders the frames of a sequence, most important Gaussian first.
#[derive(Clone)]
pub(crate) struct Ranking {
    importance: Importance,
    /// Percentage of the Gaussians in the first refinement.
    first: u8,
    /// The views of the GOP.
    cameras: Vec<Camera>,
    /// Whether the settings say which these are.
    are_given: bool,
    /// Those that were made for the first frame of the sequence.
    of_sequence: Vec<Camera>,
    preset: Preset,
    /// What points up in the views that are made.
    up: Up,
    /// The order of the first frame, if it was needed early.
    known_order: Option<Vec<u32>>,
}

impl Ranking {
    /// What the settings ask for. With one refinement there is nothing to rank.
    pub(crate) fn new(settings: &Settings) -> Self {
        let by_preset = match settings.preset {
            Preset::Fast => Importance::Footprint,
            Preset::Balanced | Preset::Small => Importance::Removal,
        };
        let importance = match settings.refinements.len() {
            1 => Importance::Volume,
            _ => settings.importance.unwrap_or(by_preset),
        };
        Self {
            importance,
            first: settings.refinements.first().copied().unwrap_or(100),
            cameras: settings.cameras.clone(),
            are_given: !settings.cameras.is_empty(),
            of_sequence: Vec::new(),
            preset: settings.preset,
            up: settings.up(),
            known_order: None,
        }
    }

    /// What it goes by.
    pub(crate) fn importance(&self) -> Importance {
        self.importance
    }

    /// Whether the first frame of the sequence is to be [looked at](Ranking::look_at) still.
    pub(crate) fn is_blind(&self) -> bool {
        !self.are_given && self.of_sequence.is_empty()
    }

    /// Makes the views of the sequence, for its first frame.
    pub(crate) fn look_at(&mut self, first: &GaussianFrame) {
        if self.is_blind() {
            self.of_sequence = self.made_for(first);
            self.cameras.clone_from(&self.of_sequence);
        }
    }

    /// The same for GOPs after the first.
    pub(crate) fn for_later(&self) -> Self {
        Self {
            known_order: None,
            cameras: self.cameras.clone(),
            of_sequence: self.of_sequence.clone(),
            ..*self
        }
    }

    /// The first frame, whose order [`Ranking::order`] will not find again.
    pub(crate) fn rank_first(&mut self, frame: &GaussianFrame) -> Ranked {
        self.look_at(frame);
        let mut ranked = self.ranked(frame);
        if ranked.shown.is_empty() {
            self.cameras(frame);
            ranked.shown = match self.preset {
                Preset::Fast => self.footprint(frame),
                Preset::Balanced | Preset::Small => self.views(frame).worth(),
            };
        }
        self.known_order = Some(ranked.order.clone());
        ranked
    }

    /// The Gaussians of a frame, most important first.
    pub(crate) fn order(&mut self, frame: &GaussianFrame) -> Vec<u32> {
        match self.known_order.take() {
            Some(order) => order,
            None => self.ranked(frame).order,
        }
    }

    fn ranked(&mut self, frame: &GaussianFrame) -> Ranked {
        if self.importance == Importance::Volume {
            return Ranked {
                order: importance::order(&importance::opacity_volume(frame)),
                ..Ranked::default()
            };
        }
        self.cameras(frame);
        if self.importance == Importance::Footprint {
            let shown = self.footprint(frame);
            return Ranked { order: Thinning::new(frame).leave(&shown, 0), shown };
        }
        let views = self.views(frame);
        let shown = views.worth();
        let order = match self.importance {
            Importance::Removal => self.eliminate(views, frame, &shown),
            _ => ranked(&shown.iter().map(|worth| worth.contribution).collect::<Vec<_>>(), frame),
        };
        Ranked { order, shown }
    }

    /// A frame follows that is coded by itself. Its views are those of the sequence, so that orders do not change from I frame
    /// to I frame, unless there is something else to see, or from elsewhere: then they are made for the frame. Neither
    /// depends on other frames. Views for which an order is known already stay.
    pub(crate) fn turn_to(&mut self, number: u32, frame: &GaussianFrame) {
        if self.are_given || self.known_order.is_some() {
            return;
        }
        // Those of the sequence are those of its first frame.
        let own = (number > 0).then(|| self.made_for(frame));
        let other = own.filter(|own| !are_alike(&self.of_sequence, own));
        self.cameras = other.unwrap_or_else(|| self.of_sequence.clone());
    }

    /// The cameras in use: those of the settings, or made for the first frame of the GOP.
    pub(crate) fn cameras(&mut self, frame: &GaussianFrame) -> &[Camera] {
        if self.cameras.is_empty() {
            self.cameras = self.made_for(frame);
        }
        &self.cameras
    }

    fn made_for(&self, frame: &GaussianFrame) -> Vec<Camera> {
        let (count, height) = match self.preset {
            Preset::Fast => (6, 180),
            Preset::Balanced | Preset::Small => (10, 270),
        };
        spiral(frame, self.up, count, height)
    }

    /// What orders go by: some of the cameras, in small pictures.
    fn views(&self, frame: &GaussianFrame) -> SmallViews {
        let (cameras, lines) = self.small();
        SmallViews::new(frame, &cameras, lines)
    }

    /// What these pictures would show, estimated.
    fn footprint(&self, frame: &GaussianFrame) -> Vec<Worth> {
        footprint(frame, &self.pictures())
    }

    /// The cameras of these pictures. None has more lines than it had: one of a line and many columns would have too many pixels.
    fn pictures(&self) -> Vec<Camera> {
        let (cameras, lines) = self.small();
        cameras.iter().map(|camera| camera.scaled_to_height(lines.min(camera.height))).collect()
    }

    /// These cameras, and the lines of the pictures.
    fn small(&self) -> (Vec<Camera>, u32) {
        let (most, lines) = match self.preset {
            Preset::Fast => (6, 96),
            Preset::Balanced | Preset::Small => (10, 144),
        };
        let stride = self.cameras.len().div_ceil(most).max(1);
        (self.cameras.iter().step_by(stride).cloned().collect(), lines)
    }

    /// From the last to the first: what pictures [miss least](Thinning) goes, the rest is weighed again without it, until the
    /// first refinement is left.
    #[expect(clippy::indexing_slicing, reason = "rows are those of the frame")]
    fn eliminate(&self, mut views: SmallViews, frame: &GaussianFrame, whole: &[Worth]) -> Vec<u32> {
        let mut left = Thinning::new(frame);
        let mut shown = whole.to_vec();
        let rounds = self.rounds(frame.len() as u32);
        let mut order = left.leave(&shown, rounds.first().map_or(0, |&kept| kept as usize));
        for number in 1..=rounds.len() {
            let rows = left.rows();
            views.leave(&rows);
            rows.iter().zip(views.worth()).for_each(|(&row, worth)| shown[row as usize] = worth);
            let mut gone = left.leave(&shown, rounds.get(number).map_or(0, |&kept| kept as usize));
            gone.append(&mut order);
            order = gone;
        }
        order
    }

    /// How many of `count` Gaussians are left when they are weighed again, falling: no more than about half of them go
    /// at once, and no more than a quarter where time is no matter. The first refinement is not weighed again.
    fn rounds(&self, count: u32) -> Vec<u32> {
        let sixteenths = match self.preset {
            Preset::Fast | Preset::Balanced => 9,
            Preset::Small => 12,
        };
        let fewer = |&kept: &u32| Some((u64::from(kept).saturating_mul(sixteenths) / 16) as u32);
        let first = prefix_length(self.first, count);
        core::iter::successors(Some(count), fewer).skip(1).take_while(|&kept| kept > first).collect()
    }
}

/// Views all around stand apart by less than this part of their distance to what they show, if they show the same.
const MOVED: f32 = 0.25;
/// And one is no farther away than so many times the other.
const NEARER: f32 = 1.25;

/// Whether two sets of views all around show the same scene.
fn are_alike(a: &[Camera], b: &[Camera]) -> bool {
    let ([middle_a, middle_b], count) = ([a, b].map(middle), a.len());
    let apart = |a: [f32; 3], b: [f32; 3]| {
        let [x, y, z] = [0, 1, 2].map(|axis: usize| a.get(axis).zip(b.get(axis)).map_or(0.0, |(a, b)| a - b));
        (x * x + y * y + z * z).sqrt()
    };
    let distance = |cameras: &[Camera], middle| {
        cameras.iter().map(|camera| apart(camera.position, middle)).sum::<f32>() / count as f32
    };
    let (far_a, far_b) = (distance(a, middle_a), distance(b, middle_b));
    let [near, far] = [far_a.min(far_b), far_a.max(far_b)];
    count == b.len() && apart(middle_a, middle_b) <= MOVED * near && far <= NEARER * near
}

/// The mean position of cameras.
fn middle(cameras: &[Camera]) -> [f32; 3] {
    let sum = cameras.iter().fold([0.0; 3], |[x, y, z], camera| {
        let [a, b, c] = camera.position;
        [x + a, y + b, z + c]
    });
    sum.map(|axis: f32| axis / cameras.len().max(1) as f32)
}

/// Gaussians that are looked at together.
const AT_ONCE: usize = 1 << 10;

/// The Gaussians of a frame by falling score; those that no view tells apart by opacity times volume.
fn ranked(scores: &[f64], frame: &GaussianFrame) -> Vec<u32> {
    let mut rows: Vec<(f64, u32)> = scores.iter().copied().zip(0..).collect();
    let falling = |a: &(f64, u32), b: &(f64, u32)| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1));
    rows.par_sort_unstable_by(falling);
    // Volumes take long to calculate, and most Gaussians need none.
    let ties = rows.par_chunk_by_mut(|a, b| a.0.total_cmp(&b.0).is_eq());
    ties.filter(|tied| tied.len() > 1).for_each(|tied| {
        tied.par_iter_mut().with_min_len(AT_ONCE).for_each(|(score, row)| *score = volume(frame, *row));
        tied.par_sort_unstable_by(falling);
    });
    rows.into_iter().map(|(_, gaussian)| gaussian).collect()
}

/// Opacity times volume of a row of a frame.
#[expect(clippy::indexing_slicing, reason = "rows are those of the frame")]
fn volume(frame: &GaussianFrame, row: u32) -> f64 {
    let log_scale = frame.log_scale().each_ref().map(|plane| plane[row as usize]);
    importance::opacity_volume_of(log_scale, frame.opacity_logit()[row as usize])
}

#[cfg(test)]
mod tests {
    use super::*;
    use splatstream_files::builtin::BuiltinScene;

    #[test]
    fn rounds_fall_to_the_first_refinement() {
        let rounds = |first: u8, preset: Preset| {
            let refinements = vec![first, 50, 100];
            Ranking::new(&Settings { refinements, preset, ..Settings::default() }).rounds(1000)
        };
        assert_eq!(rounds(10, Preset::Balanced), [562, 316, 177]);
        assert_eq!(rounds(20, Preset::Small), [750, 562, 421, 315, 236]);
        assert!(rounds(60, Preset::Balanced).is_empty());
    }

    #[test]
    fn a_gop_has_the_views_of_the_sequence_unless_its_scene_is_elsewhere() {
        let scene = BuiltinScene { gaussians: 500, frames: 9, ..BuiltinScene::default() };
        let mut ranking = Ranking::new(&Settings::default());
        ranking.look_at(&scene.frame(0));
        let of_sequence = ranking.cameras.clone();
        ranking.turn_to(8, &scene.frame(8));
        assert_eq!(ranking.cameras, of_sequence);
        let mut far = scene.frame(8);
        far.planes_mut().position[0].iter_mut().for_each(|x| *x += 100.0);
        ranking.turn_to(8, &far);
        assert_eq!(ranking.cameras, ranking.made_for(&far));
        ranking.turn_to(4, &scene.frame(4));
        assert_eq!(ranking.cameras, of_sequence, "whatever was there in between");
        let mut large = scene.frame(8);
        large.planes_mut().position.into_iter().flatten().for_each(|axis| *axis *= 2.0);
        ranking.turn_to(8, &large);
        assert_ne!(ranking.cameras, of_sequence);
    }

    #[test]
    fn pictures_are_not_larger_than_what_cameras_have() {
        let scene = BuiltinScene { gaussians: 100, ..BuiltinScene::default() }.frame(0);
        let [low, high] = spiral(&scene, Up::default(), 2, 540).try_into().unwrap();
        let low = Camera { height: 2, width: 50_000, ..low };
        let cameras = vec![low.clone(), high];
        let ranking = Ranking::new(&Settings { cameras, preset: Preset::Fast, ..Settings::default() });
        let [first, second] = ranking.pictures().try_into().unwrap();
        assert_eq!(first, low);
        assert_eq!(second.height, 96);
    }

    #[test]
    fn ties_go_by_volume_and_then_by_place() {
        let scene = BuiltinScene { gaussians: 100, ..BuiltinScene::default() };
        let mut frame = scene.frame(0).select(&[0, 1, 2, 3]);
        let splatstream_gaussians::PlanesMut { log_scale, opacity_logit, .. } = frame.planes_mut();
        opacity_logit.fill(0.0);
        log_scale.into_iter().for_each(|plane| plane.copy_from_slice(&[0.0, -3.0, 1.0, 0.0]));
        assert_eq!(ranked(&[0.0, 2.0, 0.0, 0.0], &frame), [1, 2, 0, 3]);
    }
}
