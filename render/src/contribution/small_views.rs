//! What each Gaussian is to a set of views, from small pictures of them.
//!
//! In a small picture most Gaussians show in one or two pixels, so that time goes into each Gaussian and not into its
//! pixels: tiles, whose lines of sixteen pixels pay in large pictures, are left out. Gaussians are sorted by depth,
//! projected side by side, and blended into the whole picture, which a core's cache holds. What each adds to a pixel is
//! kept until all light is known, and gone through again from behind.

mod ellipses;
mod order;
mod picture;
mod rows;
mod trace;

use super::{Share, Worth};
use crate::camera::Camera;
use crate::rasterise::near;
use order::Order;
use pulp::{Simd, WithSimd};
use rayon::prelude::*;
use rows::Rows;
use splatstream_gaussians::GaussianFrame;
use std::collections::BTreeMap;
use std::sync::{Mutex, MutexGuard, PoisonError};
use trace::{Scene, Trace};

/// A frame as cameras see it in pictures smaller than theirs, which cost less and show nearly the same of each Gaussian.
///
/// A Gaussian smaller than a pixel covers as much of it as it would cover in the large picture, whatever the filter of
/// the renderer makes of it. Colours are those of degree 0, the same from everywhere. What is measured is meant to be
/// compared among Gaussians: [`worth`](super::worth) says what a picture shows exactly.
///
/// ```
/// use splatstream_gaussians::{GaussianFrame, Planes};
/// use splatstream_render::camera::{Up, ring};
/// use splatstream_render::contribution::SmallViews;
///
/// // Two Gaussians at one place, of which the second is fainter.
/// let frame = GaussianFrame::from_planes(0, Planes {
///     position: [vec![0.0; 2], vec![0.0; 2], vec![0.0; 2]],
///     log_scale: [vec![-2.0; 2], vec![-2.0; 2], vec![-2.0; 2]],
///     rotation: [vec![1.0; 2], vec![0.0; 2], vec![0.0; 2], vec![0.0; 2]],
///     opacity_logit: vec![1.0, -3.0],
///     dc: [vec![1.0; 2], vec![1.0; 2], vec![1.0; 2]],
///     sh: Vec::new(),
/// })?;
/// let cameras = ring(&frame, Up::default(), 4, 540);
/// let worth = SmallViews::new(&frame, &cameras, 144).worth();
/// assert!(worth[0].contribution > worth[1].contribution);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct SmallViews {
    /// The Gaussians that are left.
    left: Rows,
    views: Vec<SmallView>,
}

/// One of the small pictures.
struct SmallView {
    camera: Camera,
    /// The side of a pixel of the large picture in pixels of this one.
    fine: f32,
    /// The least depth that is drawn, scene units.
    near: f32,
}

/// Gaussians of all views that may wait for each other, at most: each takes 12 bytes meanwhile, and 16 more in those that are
/// looked at.
const AT_ONCE: usize = 1 << 23;

impl SmallViews {
    /// Pictures of at most so many lines.
    #[must_use]
    pub fn new(frame: &GaussianFrame, cameras: &[Camera], lines: u32) -> Self {
        let small = |camera: &Camera| {
            let (small, fine) = match camera.height > lines {
                true => (camera.scaled_to_height(lines), lines as f32 / camera.height as f32),
                false => (camera.clone(), 1.0),
            };
            SmallView { camera: small, fine, near: near(frame, camera) }
        };
        let views = cameras.iter().map(small).collect();
        Self { left: Rows::of(frame), views }
    }

    /// Takes all Gaussians away but those of some rows of the frame, which rise. What was taken away before stays away.
    pub fn leave(&mut self, rows: &[u32]) {
        self.left.leave(rows);
    }

    /// What each of the Gaussians that are left is to the pictures if there are no others, by rising row. Equal on every
    /// machine and for any number of threads.
    #[must_use]
    pub fn worth(&self) -> Vec<Worth> {
        let count = self.left.len();
        let room = AT_ONCE.checked_div(count).unwrap_or(1).max(1);
        let mut sums = vec![Worth::default(); count];
        for views in self.views.chunks(room) {
            self.add_views(views, &mut sums);
        }
        sums
    }

    /// Adds what some views show, each core one after the other. Sums are those of one core: what a view shows waits for the
    /// views before it.
    fn add_views(&self, views: &[SmallView], sums: &mut [Worth]) {
        let queue = Mutex::new(Queue::new(sums));
        let of_core = |_| {
            let arch = pulp::Arch::new();
            let mut desk = Desk::default();
            loop {
                let (number, mut shares) = locked(&queue).next();
                let Some(view) = views.get(number) else { break };
                let (desk, shown) = (&mut desk, &mut shares);
                arch.dispatch(Look { left: &self.left, view, most: trace::MOST, desk, shares: shown });
                locked(&queue).take(number, shares);
            }
        };
        let cores = rayon::current_num_threads().min(views.len());
        (0..cores).into_par_iter().with_max_len(1).for_each(of_core);
    }
}

/// Which view is next, and the sums of what those before have shown.
struct Queue<'a> {
    sums: &'a mut [Worth],
    /// Views that are looked at or have been.
    begun: usize,
    /// Views that have been added.
    added: usize,
    /// What views have shown that are not next.
    waiting: BTreeMap<usize, Vec<Share>>,
    /// Memory of what has been added: fresh memory takes time.
    spare: Vec<Vec<Share>>,
}

impl<'a> Queue<'a> {
    fn new(sums: &'a mut [Worth]) -> Self {
        Self { sums, begun: 0, added: 0, waiting: BTreeMap::new(), spare: Vec::new() }
    }

    /// The number of the next view, and memory for what it shows.
    fn next(&mut self) -> (usize, Vec<Share>) {
        let number = self.begun;
        self.begun = number.saturating_add(1);
        (number, self.spare.pop().unwrap_or_default())
    }

    /// Takes what a view shows, and adds what has waited for no other.
    fn take(&mut self, number: usize, shares: Vec<Share>) {
        self.waiting.insert(number, shares);
        while let Some(shares) = self.waiting.remove(&self.added) {
            self.sums.iter_mut().zip(&shares).for_each(|(sum, share)| share.add_to(sum));
            self.added = self.added.saturating_add(1);
            self.spare.push(shares);
        }
    }
}

/// The queue, whatever has become of other cores.
fn locked<'m, 'a>(queue: &'m Mutex<Queue<'a>>) -> MutexGuard<'m, Queue<'a>> {
    queue.lock().unwrap_or_else(PoisonError::into_inner)
}

/// What looking from one camera takes: kept from view to view, since fresh memory takes time.
#[derive(Default)]
struct Desk {
    order: Order,
    trace: Trace,
}

/// Looks at all Gaussians that are left from one camera.
struct Look<'a> {
    left: &'a Rows,
    view: &'a SmallView,
    /// What is kept of pixels, at most.
    most: usize,
    desk: &'a mut Desk,
    /// What the view shows of each of them.
    shares: &'a mut Vec<Share>,
}

impl WithSimd for Look<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { left, view, most, desk, shares } = self;
        let Desk { order, trace } = desk;
        order.find(left, &view.camera, view.near);
        shares.clear();
        shares.resize(left.len(), Share::default());
        trace.start(view, most);
        trace.blend(&Scene { left, order, view }, shares);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Up, ring};
    use splatstream_files::builtin::BuiltinScene;

    fn scene() -> GaussianFrame {
        BuiltinScene { gaussians: 4_000, ..BuiltinScene::default() }.frame(0)
    }

    /// What the first view shows of each Gaussian.
    fn looked(views: &SmallViews, arch: pulp::Arch, most: usize) -> Vec<Share> {
        let mut shares = Vec::new();
        let (desk, view) = (&mut Desk::default(), &views.views[0]);
        arch.dispatch(Look { left: &views.left, view, most, desk, shares: &mut shares });
        shares
    }

    #[test]
    fn small_pictures_show_of_gaussians_what_large_ones_show() {
        let frame = scene();
        let cameras = ring(&frame, Up::default(), 3, 180);
        let exact = super::super::worth(&frame, &cameras);
        let small = SmallViews::new(&frame, &cameras, 180).worth();
        let sum = |worth: &[Worth], of: fn(&Worth) -> f64| worth.iter().map(of).sum::<f64>();
        for of in [|w: &Worth| w.contribution, |w: &Worth| w.loss, |w: &Worth| w.energy] {
            let [exact, small] = [&exact, &small].map(|worth| sum(worth, of));
            assert!((small / exact - 1.0).abs() < 0.1, "{small} {exact}");
        }
        // The half that is worth most is nearly the same.
        let half = |worth: &[Worth]| {
            let mut rows: Vec<usize> = (0..frame.len()).collect();
            rows.sort_by(|&a, &b| worth[b].loss.total_cmp(&worth[a].loss));
            rows.truncate(frame.len() / 2);
            rows.into_iter().collect::<std::collections::BTreeSet<usize>>()
        };
        let [exact, small] = [half(&exact), half(&small)];
        assert!(exact.intersection(&small).count() * 100 > 95 * exact.len());
    }

    #[test]
    fn those_that_are_left_are_worth_what_they_are_alone() {
        let frame = scene();
        let cameras = ring(&frame, Up::default(), 2, 300);
        let rows: Vec<u32> = (0..frame.len() as u32).filter(|row| row % 3 != 1).collect();
        let mut views = SmallViews::new(&frame, &cameras, 100);
        assert_eq!(views.worth().len(), frame.len());
        views.leave(&rows);
        // The near plane is that of the whole frame.
        let alone = frame.select(&rows);
        let mut of_alone = SmallViews::new(&alone, &cameras, 100);
        of_alone.views.iter_mut().zip(&views.views).for_each(|(of_alone, view)| of_alone.near = view.near);
        assert_eq!(views.worth(), of_alone.worth());
    }

    #[test]
    fn pixels_that_are_not_kept_are_blended_again() {
        let frame = scene();
        let cameras = ring(&frame, Up::default(), 1, 100);
        let views = SmallViews::new(&frame, &cameras, 100);
        let [all, few] = [trace::MOST, 1000].map(|most| looked(&views, pulp::Arch::new(), most));
        assert_eq!(all, few);
    }

    #[test]
    fn neither_threads_nor_vectors_change_a_bit() {
        let frame = scene();
        let cameras = ring(&frame, Up::default(), 3, 200);
        let views = SmallViews::new(&frame, &cameras, 90);
        let sums = [1, 2, 3].map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| views.worth())
        });
        assert!(sums[0] == sums[1] && sums[0] == sums[2]);
        let [plain, vectors] =
            [pulp::Arch::Scalar, pulp::Arch::new()].map(|arch| looked(&views, arch, trace::MOST));
        assert_eq!(plain, vectors);
    }

    #[test]
    fn what_cannot_be_seen_is_worth_nothing() {
        let frame = scene();
        let camera = ring(&frame, Up::default(), 1, 100).remove(0);
        // From the same place, looking away.
        let away = Camera { rotation: camera.rotation.map(|axis| axis.map(|part| -part)), ..camera };
        let worth = SmallViews::new(&frame, &[away], 50).worth();
        assert!(worth.iter().all(|worth| *worth == Worth::default()));
        assert_eq!(SmallViews::new(&frame, &[], 50).worth(), vec![Worth::default(); frame.len()]);
        assert!(SmallViews::new(&GaussianFrame::default(), &[], 50).worth().is_empty());
    }
}
