//! Damaged scene files.

use crate::{damaged, so_many};
use splatstream_files::builtin::BuiltinScene;
use splatstream_files::{ReadLimits, ply, splat, spz};
use splatstream_fuzz::measured::measured;
use splatstream_fuzz::scene::{FORMS, Form, allowance};
use splatstream_gaussians::GaussianFrame;
use splatstream_gaussians::random::SplitMix64;
use std::borrow::Cow;
use std::path::Path;

const LIMITS: ReadLimits = ReadLimits { max_memory: 16 << 20 };

/// A whole file, and who reads it.
struct File {
    form: Form,
    bytes: Vec<u8>,
    frame: GaussianFrame,
}

impl File {
    fn new(form: Form, bytes: Vec<u8>) -> Self {
        let frame = (form.read)(&bytes, &LIMITS).expect("a file without damage reads");
        Self { form, bytes, frame }
    }

    /// Whether a checksum covers all that means something. Names of frames in a ZIP archive, which order them, have none.
    fn is_checked(&self) -> bool {
        self.bytes.starts_with(b"\x1f\x8b") || self.form.name != "archive" && self.bytes.starts_with(b"PK")
    }
}

/// The seeds of the target `scene`, and larger files.
fn files() -> Vec<File> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("seeds/scene");
    let mut paths: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    let seeds = paths.iter().map(|path| std::fs::read(path).unwrap()).map(|seed| {
        let form = FORMS[usize::from(seed[0])];
        File::new(form, form.file(&seed[1..]).into_owned())
    });
    let frame = BuiltinScene { gaussians: 2000, sh_degree: 2, ..BuiltinScene::default() }.frame(0);
    let written = [ply::write(&frame), spz::write(&frame).unwrap(), splat::write(&frame).unwrap()];
    let large = FORMS.into_iter().zip(written).map(|(form, bytes)| File::new(form, bytes));
    seeds.chain(large).collect()
}

#[test]
fn readers_refuse_damaged_files_or_read_what_is_there() {
    let (files, count) = (files(), so_many(2000));
    let mut random = SplitMix64::new(16);
    let (mut refused, mut same, mut different, mut peak) = (0, 0, 0, 0);
    for number in 0..count {
        let file = &files[number % files.len()];
        let bytes = damaged(&file.bytes, &mut random);
        let (read, taken) = measured(|| (file.form.read)(&bytes, &LIMITS));
        let allowed = allowance(bytes.len(), &LIMITS);
        assert!(taken.peak <= allowed.peak, "{} number {number} holds {}", file.form.name, taken.peak);
        peak = peak.max(taken.peak);
        match read {
            Err(_) => refused += 1,
            Ok(frame) if is_same(&frame, &file.frame) => same += 1,
            Ok(frame) => {
                assert_eq!(frame.validate(), Ok(()));
                assert!(!file.is_checked(), "{} number {number} reads as another scene", file.form.name);
                different += 1;
            }
        }
    }
    println!(
        "damaged scene files: {count}; refused {refused}, read as they were {same}, read as other values of formats \
         without checksums {different}; no panic; peak memory of a read {:.1} MB",
        peak as f64 / 1e6
    );
}

fn is_same(one: &GaussianFrame, other: &GaussianFrame) -> bool {
    let [one, other] = [one, other].map(|frame| Cow::<[u8]>::Owned(ply::write(frame)));
    one == other
}
