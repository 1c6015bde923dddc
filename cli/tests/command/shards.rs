//! Sequences in parts: `encode --write-plan`, `encode --shard`, `concat`.

use crate::common::{directory, fail, json, succeed, text};
use splatstream_files::builtin::BuiltinScene;
use splatstream_files::ply;
use std::path::{Path, PathBuf};

/// What all runs have in common.
const OPTIONS: [&str; 6] = ["--preset", "fast", "--gop", "2", "--psnr", "40"];

/// Writes frames of a small scene.
fn write_frames(directory: &Path, count: u32) -> PathBuf {
    let frames = directory.join("frames");
    std::fs::create_dir(&frames).expect("a directory");
    let scene = BuiltinScene { gaussians: 400, frames: count, sh_degree: 0, ..BuiltinScene::default() };
    for number in 0..count {
        let path = frames.join(format!("f{number}.ply"));
        std::fs::write(path, ply::write(&scene.frame(number))).expect("a file");
    }
    frames
}

/// Encodes shard `number` with more arguments; gives its file.
fn shard(directory: &Path, number: &str, more: &[&str]) -> PathBuf {
    let (frames, out) =
        (directory.join("frames"), directory.join(format!("{}.gss", number.replace('/', "of"))));
    let how = ["encode", text(&frames), "--shard", number, "-o", text(&out)];
    let report = json(&[&how[..], &OPTIONS, more].concat());
    assert_eq!(report["shard"]["number"].as_u64(), number[..1].parse().ok());
    out
}

#[test]
fn shards_of_several_machines_give_the_bytes_of_a_single_run() {
    let directory = directory();
    let directory = directory.path();
    let frames = write_frames(directory, 7);
    let [whole, plan, joined] = ["whole.gss", "plan.json", "joined.gss"].map(|name| directory.join(name));
    let report = json(&[&["encode", text(&frames), "-o", text(&whole)][..], &OPTIONS].concat());
    assert!(report["shard"].is_null());
    let planned =
        json(&[&["encode", text(&frames), "--write-plan", "-o", text(&plan)][..], &OPTIONS].concat());
    assert_eq!((planned["frames"].as_u64(), planned["most_shards"].as_u64()), (Some(7), Some(4)));
    let with_plan = ["--plan", text(&plan)];
    // One of them finds the plan again, another has another number of threads.
    let shards = [
        shard(directory, "3/3", &[]),
        shard(directory, "1/3", &with_plan),
        shard(directory, "2/3", &[&with_plan[..], &["--threads", "1"]].concat()),
    ];
    let inputs = shards.each_ref().map(|path| text(path));
    let report = json(&[&["concat"], &inputs[..], &["-o", text(&joined)]].concat());
    assert!(std::fs::read(&joined).expect("a stream") == std::fs::read(&whole).expect("a stream"));
    let firsts: Vec<u64> = report["parts"]
        .as_array()
        .expect("parts")
        .iter()
        .filter_map(|part| part["first_frame"].as_u64())
        .collect();
    assert_eq!(
        (firsts, report["frames"].as_u64(), report["gops"].as_u64()),
        (vec![0, 2, 4], Some(7), Some(4))
    );
    assert_eq!(report["parts"][0]["file"].as_str(), Some(inputs[1]));
    // A shard alone is a stream.
    succeed(&["validate", inputs[0]]);
    assert!(
        succeed(&["concat", inputs[0], inputs[1], inputs[2], "-o", text(&joined)]).contains("of 3 shards")
    );
}

#[test]
fn what_does_not_belong_together_is_refused_by_name() {
    let directory = directory();
    let directory = directory.path();
    let frames = write_frames(directory, 6);
    let shards = ["1/3", "2/3", "3/3"].map(|number| shard(directory, number, &[]));
    let [a, b, c] = shards.each_ref().map(|path| text(path));
    let (out, other) = (directory.join("out.gss"), directory.join("other.gss"));
    let out = text(&out);
    let said = fail(1, &["concat", a, c, "-o", out]);
    assert!(said.contains("frames 2..=3 of 6 are in none of the shards"), "{said}");
    let said = fail(1, &["concat", a, "-", "-o", out]);
    assert!(said.contains("cannot read that from standard input; give a file or a directory"), "{said}");
    let said = fail(1, &["concat", a, b, b, c, "-o", out]);
    assert!(said.contains("2of3.gss: is given twice") && said.contains("every shard once"), "{said}");
    let more = ["--tolerance", "0.4", "--shard", "3/3"];
    succeed(&[&["encode", text(&frames), "-o", text(&other)][..], &OPTIONS, &more].concat());
    let said = fail(1, &["concat", a, b, text(&other), "-o", out]);
    assert!(said.contains("other.gss: is a shard of another plan than"), "{said}");
    succeed(&[&["encode", text(&frames), "-o", text(&other), "--fps", "25"][..], &OPTIONS].concat());
    let said = fail(1, &["concat", a, text(&other), "-o", out]);
    assert!(said.contains("1of3.gss: is a shard, and") && said.contains("other.gss is none"), "{said}");
    let stream = directory.join("stream.gss");
    succeed(&[&["encode", text(&frames), "-o", text(&stream)][..], &OPTIONS].concat());
    let said = fail(1, &["concat", text(&stream), text(&other), "-o", out]);
    assert!(said.contains("other.gss: ticks_per_second is 25, and 30 in"), "{said}");
    assert!(!Path::new(out).exists());
    fail(2, &["concat", text(&stream), "-o", text(&stream)]);
    fail(1, &["concat", "nowhere.gss", "-o", out]);
}

#[test]
fn a_damaged_shard_is_named_with_the_byte() {
    let directory = directory();
    let directory = directory.path();
    write_frames(directory, 4);
    let shards = ["1/2", "2/2"].map(|number| shard(directory, number, &[]));
    let (first, out) = (text(&shards[0]), directory.join("out.gss"));
    let whole = std::fs::read(&shards[1]).expect("a stream");
    let refused = |code, bytes: &[u8]| {
        std::fs::write(&shards[1], bytes).expect("a file");
        fail(code, &["concat", first, text(&shards[1]), "-o", text(&out)])
    };
    let mut damaged = whole.clone();
    damaged[whole.len() / 2] ^= 1;
    let said = refused(10, &damaged);
    assert!(said.contains("2of2.gss: byte 0x"), "{said}");
    let said = refused(14, &whole[..whole.len() / 2]);
    assert!(said.contains("2of2.gss: byte 0x"), "{said}");
    refused(10, b"ply\n");
    assert!(!out.exists());
}

#[test]
fn a_plan_is_refused_with_other_options_or_other_frames() {
    let directory = directory();
    let directory = directory.path();
    let frames = write_frames(directory, 6);
    let (plan, out) = (directory.join("plan.json"), directory.join("out.gss"));
    let (plan, out) = (text(&plan), text(&out));
    succeed(&[&["encode", text(&frames), "--write-plan", "-o", plan][..], &OPTIONS].concat());
    let shard = ["encode", text(&frames), "--plan", plan, "--shard", "1/3", "-o", out];
    let said = fail(1, &[&shard[..], &OPTIONS[..2], &["--gop", "3", "--psnr", "40"]].concat());
    assert!(said.contains("plan.json: gop is 3, and was 2 when the sequence was planned"), "{said}");
    let said = fail(1, &[&shard[..], &OPTIONS[..4], &["--psnr", "41"]].concat());
    assert!(said.contains("psnr is 41 dB, and was 40 dB"), "{said}");
    let many = ["encode", text(&frames), "--plan", plan, "--shard", "1/4", "-o", out];
    let said = fail(2, &[&many[..], &OPTIONS].concat());
    assert!(
        said.contains(
            "4 shards are asked for, more than the sequence has GOPs; the most that there can be: 3"
        ),
        "{said}"
    );
    std::fs::remove_file(frames.join("f5.ply")).expect("a file");
    let said = fail(1, &[&shard[..], &OPTIONS].concat());
    assert!(said.contains("the number of frames is 5, and was 6 when the sequence was planned"), "{said}");
    std::fs::write(plan, "{}").expect("a file");
    let said = fail(1, &[&shard[..], &OPTIONS].concat());
    assert!(said.contains("plan.json: is no plan"), "{said}");
    for wrong in ["0/3", "4/3", "1", "a/b"] {
        fail(2, &["encode", text(&frames), "--shard", wrong, "-o", out]);
    }
    fail(2, &["encode", text(&frames), "--plan", plan, "-o", out]);
    fail(2, &["encode", text(&frames), "--write-plan", "-o", out]);
}
