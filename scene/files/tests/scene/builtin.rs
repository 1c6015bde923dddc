//! Built-in scenes are what they say: repeatable, whole, moving in part.

use splatstream_files::builtin::{BuiltinScene, Tracking};
use splatstream_files::ply;

/// FNV-1a, so that the test needs no crate for it.
fn hash(bytes: &[u8]) -> u64 {
    bytes
        .iter()
        .fold(0xcbf2_9ce4_8422_2325, |hash, &byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

#[test]
fn the_same_scene_is_the_same_bytes_everywhere() {
    let tracked = BuiltinScene { gaussians: 1000, ..BuiltinScene::default() };
    let untracked = BuiltinScene { tracking: Tracking::Untracked, ..tracked };
    let hashes = [tracked, untracked].map(|scene| hash(&ply::write(&scene.frame(5))));
    assert_eq!(hashes, [11_741_172_830_558_534_288, 1_791_838_628_450_121_439]);
}

#[test]
fn any_count_from_100_and_any_degree_makes_whole_frames() {
    for (gaussians, sh_degree) in [(100, 0), (101, 1), (137, 2), (1003, 3)] {
        let scene = BuiltinScene { gaussians, sh_degree, ..BuiltinScene::default() };
        for t in [0, 7, 1000] {
            let frame = scene.frame(t);
            assert_eq!((frame.len() as u32, frame.sh_degree()), (gaussians, sh_degree));
            frame.validate().unwrap();
        }
    }
}

#[test]
fn a_tracked_third_moves_a_little_and_the_rest_stays() {
    let scene = BuiltinScene { gaussians: 3000, ..BuiltinScene::default() };
    let (now, next) = (scene.frame(3), scene.frame(4));
    let step = |row: usize| {
        let parts =
            now.position().iter().zip(next.position()).map(|(a, b)| f64::from(b[row]) - f64::from(a[row]));
        parts.map(|part| part * part).sum::<f64>().sqrt()
    };
    let steps: Vec<f64> = (0..now.len()).map(step).collect();
    let moving = steps.iter().filter(|&&step| step > 0.0).count();
    assert!((900..=1000).contains(&moving), "{moving} of 3000 move");
    assert!(steps.iter().all(|&step| step < 0.1), "nothing jumps");
    let turns = (0..now.len()).map(|row| {
        now.rotation()
            .iter()
            .zip(next.rotation())
            .map(|(a, b)| f64::from(a[row]) * f64::from(b[row]))
            .sum::<f64>()
    });
    assert!(turns.into_iter().all(|cosine| cosine > 0.9), "no quaternion changes its sign");
}

#[test]
fn quaternions_keep_their_sign_through_whole_turns() {
    let scene = BuiltinScene { gaussians: 300, sh_degree: 0, ..BuiltinScene::default() };
    let mut last = scene.frame(0);
    for t in 1..300 {
        let next = scene.frame(t);
        for row in 0..next.len() {
            let pairs = last.rotation().iter().zip(next.rotation());
            let cosine: f64 = pairs.map(|(a, b)| f64::from(a[row]) * f64::from(b[row])).sum();
            assert!(cosine > 0.9, "frame {t} row {row}: {cosine}");
        }
        last = next;
    }
}

#[test]
fn untracked_frames_lose_and_split_a_few_per_cent_and_have_their_own_order() {
    let scene = BuiltinScene { gaussians: 5000, tracking: Tracking::Untracked, ..BuiltinScene::default() };
    let (now, next) = (scene.frame(0), scene.frame(1));
    for frame in [&now, &next] {
        frame.validate().unwrap();
        assert!((4800..=5200).contains(&frame.len()), "{}", frame.len());
    }
    let same =
        now.position()[0].iter().zip(&next.position()[0]).filter(|(a, b)| (*a - *b).abs() < 0.05).count();
    assert!(same < 1000, "{same} rows stay in place");
}

#[test]
fn values_are_spread_as_in_trained_scenes() {
    let frame = BuiltinScene::default().frame(0);
    let count = frame.len() as f64;
    let opaque = frame.opacity_logit().iter().filter(|&&logit| logit > 2.944).count() as f64 / count;
    let faint = frame.opacity_logit().iter().filter(|&&logit| logit < 0.0).count() as f64 / count;
    assert!((0.45..0.8).contains(&opaque) && (0.08..0.35).contains(&faint), "{opaque} {faint}");
    let energy = |from: usize, to: usize| {
        let values =
            frame.sh()[from * 3..to * 3].iter().flatten().map(|&value| f64::from(value) * f64::from(value));
        (values.sum::<f64>() / (count * 3.0 * (to - from) as f64)).sqrt()
    };
    let bands = [energy(0, 3), energy(3, 8), energy(8, 15)];
    assert!(bands[0] > bands[1] && bands[1] > bands[2] && bands[0] < 0.3, "{bands:?}");
    let [a, b, c] = frame.log_scale();
    let flat = (0..frame.len()).filter(|&row| {
        let mut scales = [a[row], b[row], c[row]];
        scales.sort_by(f32::total_cmp);
        scales[1] - scales[0] > 1.0
    });
    assert_eq!(flat.count(), frame.len(), "all are thin along the normal");
}
