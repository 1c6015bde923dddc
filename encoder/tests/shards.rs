//! GOPs that are coded at the same time, on threads and on machines, give the bytes that one thread gives.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, missing_docs, reason = "a panic is a failed test")]

mod common;

use common::{decoded, encoded, strict};
use splatstream_encoder::{
    ConcatError, Encoder, Error, Finetune, NetworkSource, PartError, Plan, PlanRecord, Preset, Settings,
    StreamPart, Structure, concat, plan,
};
use splatstream_files::builtin::BuiltinScene;
use splatstream_format::{ErrorKind, Limits};
use splatstream_gaussians::GaussianFrame;
use std::io::Cursor;

fn settings() -> Settings {
    let structure = Structure::Predicted { layers: 2 };
    Settings { preset: Preset::Fast, gop: 4, structure, spatial_layers: 2, ..Settings::default() }
}

/// Frames with a cut: those from the seventh on are of another scene.
fn frames(count: u32) -> Vec<GaussianFrame> {
    let scene = BuiltinScene { gaussians: 600, frames: count, sh_degree: 1, ..BuiltinScene::default() };
    let other = BuiltinScene { seed: 77, ..scene };
    (0..count).map(|number| if number < 6 { scene.frame(number) } else { other.frame(number) }).collect()
}

/// What is done with a number of threads.
fn with_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(work)
}

fn shard(plan: &Plan, frames: &[GaussianFrame], number: (u32, u32)) -> Vec<u8> {
    let mut bytes = Vec::new();
    plan.encode_shard(&mut frames.to_vec(), number, &mut bytes, &mut |_, _| ()).unwrap();
    bytes
}

fn joined(shards: &[Vec<u8>]) -> Result<Vec<u8>, ConcatError> {
    let limits = Limits::default();
    let scan = |shard: &Vec<u8>| StreamPart::scan(&mut shard.as_slice(), &limits).unwrap();
    let parts: Vec<StreamPart> = shards.iter().map(scan).collect();
    let mut bytes = Vec::new();
    let report = concat(&parts, &mut |part| Ok(Box::new(Cursor::new(&shards[part]))), &mut bytes, &limits)?;
    assert_eq!(report.bytes, bytes.len() as u64);
    Ok(bytes)
}

#[test]
fn any_number_of_threads_and_any_memory_give_the_same_stream_and_report() {
    let frames = frames(15);
    let asked = Settings { psnr: Some(40.0), ..settings() };
    let alone = with_threads(1, || encoded(frames.clone(), &asked));
    assert!(alone.1.gops.len() > 4, "a cut ends a GOP: {:?}", alone.1.gops);
    for threads in [2, 3, 8] {
        assert!(with_threads(threads, || encoded(frames.clone(), &asked)) == alone, "{threads} threads");
    }
    let narrow = Settings { gop_memory: 1, ..asked };
    assert!(with_threads(3, || encoded(frames.clone(), &narrow)) == alone);
    // A thread that is none of the pool waits for those that are.
    assert!(encoded(frames, &narrow) == alone);
}

#[test]
fn every_frame_by_itself_is_the_same_too() {
    let asked = Settings { structure: Structure::Intra, spatial_layers: 1, gop: 3, ..settings() };
    let alone = with_threads(1, || encoded(frames(8), &asked));
    assert!(with_threads(4, || encoded(frames(8), &asked)) == alone);
}

#[test]
fn pushed_gops_that_are_coded_at_once_are_those_that_are_coded_one_by_one() {
    let pushed = |gops: u32| {
        let mut bytes = Vec::new();
        let mut encoder = Encoder::new(&mut bytes, settings()).with_gops_at_once(gops);
        frames(15).into_iter().for_each(|frame| encoder.push(frame).unwrap());
        let report = encoder.finish().unwrap();
        (bytes, report)
    };
    let one = pushed(1);
    assert!([2, 3, 9].into_iter().all(|gops| pushed(gops) == one));
    assert_eq!(decoded(&one.0, &strict()).0.len(), 15);
}

#[test]
fn shards_of_any_number_in_any_order_join_to_the_stream_of_a_single_run() {
    let frames = frames(15);
    for asked in [settings(), Settings { psnr: Some(40.0), ..settings() }] {
        let (whole, _) = encoded(frames.clone(), &asked);
        let plan = plan(&mut frames.clone(), &asked).unwrap();
        assert_eq!(plan.shards(), 4);
        for count in 1..=4 {
            let mut shards: Vec<_> =
                (1..=count).map(|number| shard(&plan, &frames, (number, count))).collect();
            shards.reverse();
            assert!(joined(&shards).unwrap() == whole, "{count} shards");
        }
        // One machine may take more than another.
        let shards = [(1, 2), (3, 4), (4, 4)].map(|number| shard(&plan, &frames, number));
        assert!(joined(&shards).unwrap() == whole);
    }
}

#[test]
fn a_shard_is_a_stream_that_anybody_can_decode() {
    let frames = frames(15);
    let (_, report) = encoded(frames.clone(), &settings());
    let plan = plan(&mut frames.clone(), &settings()).unwrap();
    let mut bytes = Vec::new();
    let of_shard = plan.encode_shard(&mut frames.clone(), (2, 2), &mut bytes, &mut |_, _| ()).unwrap();
    let (decoded, summary) = decoded(&bytes, &strict());
    assert_eq!(summary.verdict(), None);
    assert_eq!(decoded.iter().map(|frame| frame.index).collect::<Vec<_>>(), (0..7).collect::<Vec<_>>());
    let digests: Vec<u64> = decoded.iter().map(|frame| frame.digest.unwrap()).collect();
    assert_eq!(digests, report.digests[8..]);
    assert_eq!(
        (of_shard.frames, of_shard.gops[0].first, &of_shard.digests[..]),
        (7, 8, &report.digests[8..])
    );
}

#[test]
fn a_plan_that_was_written_and_read_gives_the_same_bytes() {
    let frames = frames(9);
    let asked = Settings { psnr: Some(41.0), network: Some(NetworkSource::Registered), ..settings() };
    let made = plan(&mut frames.clone(), &asked).unwrap();
    let record = made.record().unwrap();
    let text = serde_json::to_string(&record).unwrap();
    let read: PlanRecord = serde_json::from_str(&text).unwrap();
    assert_eq!((&read, read.digest()), (&record, record.digest()));
    let plan = Plan::from_record(&read, &asked).unwrap();
    for number in 1..=3 {
        assert!(shard(&plan, &frames, (number, 3)) == shard(&made, &frames, (number, 3)), "shard {number}");
    }
}

#[test]
fn a_plan_is_for_its_settings_and_its_frames_alone() {
    let frames = frames(9);
    let record = plan(&mut frames.clone(), &settings()).unwrap().record().unwrap();
    let refused = |asked: Settings| Plan::from_record(&record, &asked).err().unwrap().to_string();
    assert!(refused(Settings { gop: 3, ..settings() }).starts_with("gop is 3, and was 4"));
    assert!(
        refused(Settings { preset: Preset::Small, ..settings() })
            .starts_with("preset is Small, and was Fast")
    );
    let finetune = Some(Finetune { iterations: 3, ..Finetune::default() });
    assert!(refused(Settings { finetune, ..settings() }).contains(", and was none when"));
    let psnr = Some(45.0);
    assert!(refused(Settings { psnr, ..settings() }).starts_with("psnr is 45 dB, and was none"));
    let plan = Plan::from_record(&record, &settings()).unwrap();
    let refused = |frames: &mut Vec<GaussianFrame>, number| {
        plan.encode_shard(frames, number, &mut Vec::new(), &mut |_, _| ()).unwrap_err()
    };
    assert!(matches!(
        refused(&mut frames[..8].to_vec(), (1, 2)),
        Error::OtherFrames { found: 8, planned: 9 }
    ));
    let mut other = frames.clone();
    other[5] = BuiltinScene { gaussians: 601, sh_degree: 1, ..BuiltinScene::default() }.frame(0);
    assert!(matches!(refused(&mut other, (2, 2)), Error::OtherFrame { frame: 5, found: 601, planned: 600 }));
    let mut changed = frames.clone();
    changed[5].planes_mut().dc[0][7] += 1e-6;
    assert!(matches!(refused(&mut changed, (2, 2)), Error::ChangedFrame { frame: 5 }));
    let of_changed = crate::plan(&mut changed, &settings()).unwrap().record().unwrap();
    assert_ne!(of_changed.digest(), record.digest());
    assert!(matches!(refused(&mut frames.clone(), (1, 4)), Error::Shards { count: 4, most: 3 }));
    assert!(matches!(refused(&mut frames.clone(), (0, 2)), Error::Setting { name: "shard", .. }));
    assert!(matches!(refused(&mut frames.clone(), (3, 2)), Error::Setting { name: "shard", .. }));
    let damaged = PlanRecord { sequence_parameters: vec![9; 106], ..record.clone() };
    assert!(matches!(Plan::from_record(&damaged, &settings()), Err(Error::Plan(_))));
    let damaged = PlanRecord { gaussians: vec![600; 8], ..record };
    assert!(matches!(Plan::from_record(&damaged, &settings()), Err(Error::Plan(_))));
}

#[test]
fn shards_that_do_not_belong_together_are_refused() {
    let frames = frames(15);
    let plan_of = |asked: &Settings| plan(&mut frames.clone(), asked).unwrap();
    let plan = plan_of(&settings());
    let [a, b, c] = [1, 2, 3].map(|number| shard(&plan, &frames, (number, 3)));
    let refused =
        |shards: &[&Vec<u8>]| joined(&shards.iter().copied().cloned().collect::<Vec<_>>()).unwrap_err();
    assert!(matches!(refused(&[]), ConcatError::NoParts));
    assert!(
        matches!(refused(&[&a, &c]), ConcatError::Missing { frames, sequence_frames: 15 } if frames == (4..8))
    );
    assert!(matches!(refused(&[&c, &b]), ConcatError::Missing { frames, .. } if frames == (0..4)));
    assert!(matches!(refused(&[&a, &b]), ConcatError::Missing { frames, .. } if frames == (8..15)));
    let overlap = refused(&[&a, &b, &c, &b]);
    assert!(
        matches!(overlap, ConcatError::Overlap { part: 3, other: 1, ref frames } if *frames == (4..8)),
        "{overlap}"
    );
    let half = shard(&plan, &frames, (1, 2));
    assert!(matches!(refused(&[&half, &b, &c]), ConcatError::Overlap { frames, .. } if frames == (4..8)));
    let other = shard(&plan_of(&Settings { tolerance: 0.5, ..settings() }), &frames, (3, 3));
    assert!(matches!(refused(&[&a, &b, &other]), ConcatError::OtherPlan { part: 2, other: 0 }));
    let (whole, _) = encoded(frames.clone(), &settings());
    assert!(matches!(refused(&[&a, &whole]), ConcatError::NoShard { part: 0, other: 1 }));
}

#[test]
fn streams_of_the_same_parameters_are_joined_in_the_order_in_which_they_are_given() {
    let frames = frames(6);
    let (stream, report) = encoded(frames, &settings());
    let twice = joined(&[stream.clone(), stream.clone()]).unwrap();
    let (decoded, summary) = decoded(&twice, &strict());
    assert_eq!(summary.verdict(), None);
    let digests: Vec<u64> = decoded.iter().map(|frame| frame.digest.unwrap()).collect();
    assert_eq!(digests, [&report.digests[..], &report.digests[..]].concat());
    assert_eq!(joined(std::slice::from_ref(&stream)).unwrap(), stream);
}

#[test]
fn streams_of_other_parameters_are_refused_by_name() {
    let frames = frames(6);
    let (stream, _) = encoded(frames.clone(), &settings());
    let refused = |asked: Settings| {
        let (other, _) = encoded(frames.clone(), &asked);
        match joined(&[stream.clone(), other]).unwrap_err() {
            ConcatError::Differs { part: 1, other: 0, name, value, expected } => (name, value, expected),
            error => panic!("{error}"),
        }
    };
    assert_eq!(
        refused(Settings { spatial_layers: 1, structure: Structure::Intra, ..settings() }).0,
        "profile"
    );
    let (name, value, expected) = refused(Settings { ticks: (25, 1), ..settings() });
    assert_eq!((name, value.as_str(), expected.as_str()), ("ticks_per_second", "25", "30"));
    let mut asked = settings();
    asked.steps.dc *= 2.0;
    assert_eq!(refused(asked).0, "dc_step");
    let mut asked = settings();
    asked.description.background = Some([1.0, 0.0, 0.0]);
    assert_eq!(refused(asked).0, "background");
}

#[test]
fn a_damaged_shard_is_refused_where_it_is_damaged() {
    let frames = frames(8);
    let shard = shard(&plan(&mut frames.clone(), &settings()).unwrap(), &frames, (2, 2));
    let fault = |bytes: &[u8]| match StreamPart::scan(&mut &bytes[..], &Limits::default()).unwrap_err() {
        PartError::Stream(error) => error,
        error => panic!("{error}"),
    };
    // Its private data are not covered by a checksum that anybody reads; every other byte is.
    for at in (200..shard.len()).step_by(shard.len() / 50) {
        let mut bytes = shard.clone();
        bytes[at] ^= 0x10;
        let error = fault(&bytes);
        assert!(error.at < at as u64 + 20, "no later than in the header that is damaged: {error}");
        assert!(matches!(error.kind, ErrorKind::Checksum { .. }), "{at}: {error}");
    }
    for length in [0, 10, 16, 300, shard.len() - 1] {
        assert!(matches!(fault(&shard[..length]).kind, ErrorKind::Truncated { .. }), "{length}");
    }
    assert!(matches!(fault(&[&shard[..], &[0]].concat()).kind, ErrorKind::TrailingBytes { .. }));
    assert!(matches!(fault(b"ply\nformat binary").kind, ErrorKind::Signature));
}
