//! Real scenes, where they are: every one reads, with the count it is known to have.

#![expect(clippy::print_stderr, reason = "a test that is skipped must say so")]

use std::path::{Path, PathBuf};
use std::time::Instant;

use splatstream_files::{Note, ReadLimits, Sequence, SequenceOptions, read_scene};
use splatstream_gaussians::{GaussianFrame, importance};

/// The data directory, which lies beside the repository, or nothing and a line that says so.
fn data() -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    if !path.is_dir() {
        eprintln!("skipped: the real scenes are not here");
        return None;
    }
    Some(path)
}

fn read(path: &Path) -> GaussianFrame {
    let start = Instant::now();
    let frame = read_scene(path, &ReadLimits::default()).unwrap_or_else(|error| panic!("{error}"));
    eprintln!(
        "{:7.1} ms  {} Gaussians  {}",
        start.elapsed().as_secs_f64() * 1e3,
        frame.len(),
        path.display()
    );
    assert!(frame.rotation()[0].iter().all(|w| w.abs() <= 1.000_001));
    frame
}

#[test]
fn static_scenes_have_their_counts() {
    let Some(data) = data() else { return };
    let scenes = [
        ("playbot/0_0", 500_000, 2),
        ("playbot/1_0/meta.json", 250_000, 2),
        ("playbot/2_0", 125_000, 2),
        ("plant.splat", 113_648, 0),
        ("biker.compressed.ply", 152_746, 0),
        ("spot_100k.splat", 100_000, 0),
    ];
    for (name, count, degree) in scenes {
        let frame = read(&data.join("static").join(name));
        assert_eq!((frame.len(), frame.sh_degree()), (count, degree), "{name}");
        let order = importance::order(&importance::opacity_volume(&frame));
        assert_eq!(order.len(), count, "{name}");
    }
}

#[test]
fn dynamic_scenes_have_their_counts() {
    let Some(data) = data() else { return };
    for frame in 0..32 {
        assert_eq!(read(&data.join(format!("dynamic/lam_p2/frame_{frame:04}.ply"))).len(), 20_018);
    }
    for frame in 1..=50 {
        assert_eq!(read(&data.join(format!("dynamic/monkey/monkey_{frame:04}.sog"))).len(), 31_658);
    }
}

#[test]
fn scenes_in_continuous_time_have_their_counts() {
    let Some(data) = data() else { return };
    for (name, usable, unusable) in [("kitchen", 61_245, 1197), ("clip", 40_935, 20_902)] {
        let path = data.join(format!("dynamic/{name}/{name}.splatv"));
        let options = SequenceOptions { samples: 50 };
        let mut sequence = Sequence::open(&path, &ReadLimits::default(), &options).unwrap();
        assert_eq!(sequence.len(), 50);
        let mut alive = Vec::new();
        for number in [0, 25, 49] {
            let scene = sequence.frame(number).unwrap();
            assert_eq!(scene.frame.validate(), Ok(()));
            assert_eq!((scene.frame.len(), scene.notes), (usable, vec![Note::Unusable { count: unusable }]));
            // Opacities of less than 1/255 are not seen.
            alive.push(scene.frame.opacity_logit().iter().filter(|&&logit| logit >= -5.537).count());
        }
        assert!(alive.iter().all(|&count| count > usable * 8 / 10 && count < usable), "{name}: {alive:?}");
    }
}
