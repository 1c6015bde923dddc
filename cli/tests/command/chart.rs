//! `splatstream chart` leaves a page that needs nothing else, and the numbers behind it.

use crate::common::{directory, json, run, run_with, succeed, text, write_frames};
use splatstream_files::builtin::BuiltinScene;
use splatstream_files::ply;
use splatstream_gaussians::GaussianFrame;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// What a quick chart of the built-in scene leaves: it is made once for all tests.
pub(crate) struct Quick {
    pub(crate) report: serde_json::Value,
    out: PathBuf,
    said: String,
}

pub(crate) fn quick() -> &'static Quick {
    static QUICK: OnceLock<Quick> = OnceLock::new();
    QUICK.get_or_init(|| {
        let out = Path::new(env!("CARGO_TARGET_TMPDIR")).join("chart");
        let _none_before = std::fs::remove_dir_all(&out);
        let output = run(&["chart", "--builtin", "--quick", "-o", text(&out), "--json"]);
        assert!(output.status.success(), "{output:?}");
        let report = serde_json::from_slice(&output.stdout).expect("JSON");
        Quick { report, out, said: String::from_utf8(output.stderr).expect("text") }
    })
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).expect("a text file")
}

/// The values of an attribute in a page.
fn values<'a>(page: &'a str, attribute: &str) -> Vec<&'a str> {
    let start = format!(" {attribute}=\"");
    page.split(&start).skip(1).filter_map(|rest| rest.split('"').next()).collect()
}

#[test]
fn a_quick_chart_is_one_page_without_anything_from_outside() {
    let Quick { report, out, said } = quick();
    // Where nobody sees a bar, lines say that it works.
    assert!(said.contains("0 of ") && said.contains(" done: "), "{said}");
    let page = read(&out.join("index.html"));
    for word in ["http://", "https://", "<link", "<script", "@import", "url("] {
        assert!(!page.contains(word), "{word}");
    }
    assert!(values(&page, "src").iter().all(|source| source.starts_with("data:image/png;base64,")));
    for address in values(&page, "href").into_iter().filter(|address| !address.starts_with('#')) {
        assert!(out.join(address).is_file(), "{address}");
    }
    for word in
        ["How to read:", "<span>--builtin</span> <span>--quick</span>", "not measured: no weights given"]
    {
        assert!(page.contains(word), "{word}");
    }
    let scene = &report["scenes"][0];
    assert_eq!((scene["scene"].as_str(), scene["frames"].as_u64()), (Some("builtin"), Some(2)));
    assert!(scene["psnr_db"].as_f64().unwrap() > 25.0, "{scene}");
    assert_eq!(scene["variants"][0]["variant"], "without contexts");
    assert!(scene["variants"][0]["bd_rate_percent"].as_f64().unwrap() > 0.0, "{scene}");
}

#[test]
fn a_scene_comes_from_standard_input() {
    let directory = directory();
    let out = directory.path().join("report");
    let scene = BuiltinScene { gaussians: 60, sh_degree: 0, ..BuiltinScene::default() }.frame(0);
    let output = run_with(&["chart", "-", "--quick", "--json", "-o", text(&out)], &ply::write(&scene));
    assert!(output.status.success(), "{output:?}");
    assert!(out.join("index.html").is_file());
}

#[test]
fn figures_are_well_formed_and_say_what_they_show() {
    let Quick { report, out, .. } = quick();
    let files = report["files"].as_array().unwrap().iter().filter_map(|file| file.as_str());
    let figures: Vec<&str> = files.filter(|file| file.ends_with(".svg")).collect();
    // Two points are no figure of speeds; where the bits go is always drawn.
    assert!(figures.iter().any(|figure| figure.ends_with("-cost-units.svg")), "{figures:?}");
    assert!(!figures.iter().any(|figure| figure.contains("speed")), "{figures:?}");
    for figure in figures {
        let drawing = read(&out.join(figure));
        let document = roxmltree::Document::parse(&drawing).expect(figure);
        let text_of = |name: &str| {
            let mut children = document.root_element().children();
            children
                .find(|child| child.has_tag_name(("http://www.w3.org/2000/svg", name)))
                .and_then(|c| c.text())
        };
        assert!(text_of("title").is_some_and(|title| title.starts_with("builtin: ")), "{figure}");
        assert!(text_of("desc").is_some_and(|description| description.len() > 20), "{figure}");
        assert!(!drawing.contains("NaN") && !drawing.contains("inf"), "{figure}");
    }
}

#[test]
fn the_numbers_of_a_sequence_and_of_a_peer_are_beside_the_page() {
    let directory = directory();
    let frames = write_frames(directory.path());
    let peers = directory.path().join("peers.json");
    let results = r#"{"version": 1,
        "scenes": [{"scene": "small", "source": "frames", "reference": "frames", "gaussians": 1800, "frames": 3}],
        "results": [{"scene": "small", "peer": "Copy", "version": "1", "options": "", "bytes": 300000,
            "gaussians": 1800, "frames": 3, "encode_s": 0.5, "decode_s": 0.25, "timing": "process",
            "decoded": "frames", "command": "cp"}],
        "missing": [{"peer": "Nobody", "scene": null, "why": "does not exist"}]}"#;
    std::fs::write(&peers, results).unwrap();
    let out = directory.path().join("report");
    let arguments = ["--quick", "--frames", "2", "--peers", text(&peers), "-o", text(&out)];
    let report = json(&[&["chart", text(&frames)], &arguments[..]].concat());
    let scene = &report["scenes"][0];
    assert_eq!(scene["peers"][0], "Copy");
    assert_eq!(scene["peers_missing"][0], "Nobody: does not exist");
    let points = read(&out.join("points.csv"));
    let mut lines = points.lines();
    assert_eq!(
        lines.next(),
        Some(
            "scene,group,variant,quality,op,percent,frames,bytes,gaussians_source,gaussians_shown,bpg_source,\
             bpg_shown,mbit_s,psnr_db,psnr_masked_db,yuv_psnr_db,ssim,ssim_masked,st_lpips"
        )
    );
    // Two qualities: of the baseline two levels each, without contexts one each.
    assert_eq!(lines.count(), 2 * 2 + 2);
    let peer = read(&out.join("peers.csv"));
    assert!(peer.contains("frames,Copy,1,300000,3,2,") && peer.contains(",100.000000,"), "{peer}");
    assert_eq!(read(&out.join("bandwidth.csv")).lines().count(), 1 + 4);
}

/// What another codec decoded is read beside the sources and our streams, and none beside another.
#[test]
fn frames_of_peers_are_bounded_with_all_that_is_held() {
    let directory = directory();
    let at = |name: &str| directory.path().join(name);
    let write = |name: &str, times: usize| {
        let scene = BuiltinScene { gaussians: 200, sh_degree: 0, frames: 1, ..BuiltinScene::default() };
        let mut planes = scene.frame(0).into_planes();
        planes.iter_mut().for_each(|plane| *plane = plane.repeat(times));
        std::fs::write(at(name), ply::write(&GaussianFrame::from_planes(0, planes).unwrap())).unwrap();
    };
    write("small.ply", 1);
    write("large.ply", 2500);
    let of = |peer: &str, decoded: &str| {
        format!(
            r#"{{"scene": "small", "peer": "{peer}", "bytes": 9, "gaussians": 200, "frames": 1, "decoded": "{decoded}"}}"#
        )
    };
    let results = [of("Small", "small.ply"), of("Large", "large.ply"), of("Again", "large.ply")].join(",");
    let peers = format!(
        r#"{{"version": 1, "scenes": [{{"scene": "small", "source": "small.ply"}}], "results": [{results}]}}"#
    );
    std::fs::write(at("peers.json"), peers).unwrap();
    let (scene, out, peers) = (at("small.ply"), at("report"), at("peers.json"));
    let chart = |more: &[&str]| {
        let line =
            ["chart", text(&scene), "-o", text(&out), "--quick", "--height", "20", "--cameras", "ring:1"];
        run(&[&line[..], &["--qualities", "low", "--peers", text(&peers), "--json"], more].concat())
    };
    // What is asked for at least, from what is said where there is nothing.
    let refused = chart(&["--max-memory", "1M"]);
    assert_eq!(refused.status.code(), Some(13), "{refused:?}");
    let said = String::from_utf8(refused.stderr).unwrap();
    let asked: u64 = said.split(" takes up to ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    let scene = |memory: u64| {
        let charted = chart(&["--max-memory", &memory.to_string()]);
        assert!(charted.status.success(), "{charted:?}");
        let report: serde_json::Value = serde_json::from_slice(&charted.stdout).unwrap();
        report["scenes"][0].clone()
    };
    // The file has 34 MB and the frame 28: twice that is needed beside what is held, and encoding 200 Gaussians takes less.
    let little = scene(asked);
    assert_eq!(little["peers"], serde_json::json!(["Small"]), "{asked}: {little}");
    for missing in ["Large", "Again"] {
        let missing = little["peers_missing"]
            .as_array()
            .unwrap()
            .iter()
            .find(|said| said.as_str().unwrap().starts_with(missing));
        assert!(missing.unwrap().as_str().unwrap().contains("reading takes"), "{little}");
    }
    let enough = scene(asked + (80 << 20));
    assert_eq!(enough["peers"], serde_json::json!(["Small", "Large", "Again"]), "{enough}");
}

/// The lines of a CSV file, each as its cells by name.
fn rows(path: &Path) -> Vec<BTreeMap<String, String>> {
    let mut reader = csv::Reader::from_path(path).expect("a file");
    reader.deserialize().map(|row| row.expect("cells under headings")).collect()
}

/// A whole number in a cell.
fn count(row: &BTreeMap<String, String>, name: &str) -> u64 {
    row[name].parse().unwrap_or_else(|_| panic!("{name} is '{}' in {row:?}", row[name]))
}

#[test]
fn the_operating_points_of_a_sequence_add_up() {
    let directory = directory();
    let frames = write_frames(directory.path());
    let out = directory.path().join("report");
    let options =
        ["--quick", "--height", "60", "--cameras", "ring:1", "--qualities", "high", "-o", text(&out)];
    let report = succeed(&[&["chart", text(&frames)], &options[..]].concat());
    let modes = rows(&out.join("operating_points.csv"));
    let names: Vec<&str> = modes.iter().map(|mode| mode["mode"].rsplit(' ').next().unwrap()).collect();
    assert_eq!(names, ["Startup", "quality", "anchor", "temporal", "%", "%"]);
    let shown: Vec<&str> = modes.iter().map(|mode| mode["frames"].as_str()).collect();
    assert_eq!(shown, ["0", "0", "0", "0 2", "0 1 2", "0 1 2"]);
    assert_eq!(modes[1]["units"], "I0 s0 + I0 s1");
    assert_eq!(modes[3]["units"], "I0 s0-s2 + P2 r0-r1");
    let intra: Vec<u64> = modes.iter().take(3).map(|mode| count(mode, "gop_bytes")).collect();
    assert!(intra.is_sorted_by(|a, b| a < b), "{intra:?}");
    let refinements = rows(&out.join("refinements.csv"));
    let levels: Vec<_> = refinements.iter().filter(|row| row["frames_coded"] == "predicted").collect();
    assert_eq!(levels.len(), 2);
    for (level, mode) in levels.iter().zip(&modes[4..]) {
        assert_eq!(level["units"], "P2 B1");
        let units: u64 = level["unit_bytes"].split(' ').map(|bytes| bytes.parse::<u64>().unwrap()).sum();
        assert_eq!(count(level, "added_bytes"), units);
        assert_eq!(count(level, "total_bytes"), intra[2] + units);
        assert_eq!(count(level, "total_bytes"), count(mode, "gop_bytes"));
        assert_eq!(count(level, "gaussians"), count(mode, "gaussians"));
        assert!(!level["inter_psnr_db"].is_empty() && !level["subset_psnr_db"].is_empty());
    }
    assert!(count(levels[1], "gaussians") > count(levels[1], "subset_gaussians"));
    let tools = rows(&out.join("tools.csv"));
    assert_eq!(tools.len(), 5);
    let everything = levels[1]["added_bytes"].parse::<u64>().unwrap();
    assert_eq!(count(&tools[0], "inter_bytes"), everything);
    assert!(["Low-frame-rate temporal", "without survivors"].iter().all(|words| report.contains(words)));
}

/// What a quick look at stability leaves: it is made once for all tests. Its directory, and the report.
pub(crate) fn stability() -> &'static (PathBuf, serde_json::Value) {
    static STABILITY: OnceLock<(PathBuf, serde_json::Value)> = OnceLock::new();
    STABILITY.get_or_init(|| {
        let out = Path::new(env!("CARGO_TARGET_TMPDIR")).join("stability");
        let _none_before = std::fs::remove_dir_all(&out);
        let report = json(&["chart", "--stability", "--quick", "--height", "60", "-o", text(&out)]);
        (out, report)
    })
}

#[test]
fn a_look_at_stability_has_every_case_and_says_what_is_silent() {
    let (out, report) = stability();
    let table = rows(&out.join("stability.csv"));
    let cases: BTreeSet<&str> = table.iter().map(|row| row["case"].as_str()).collect();
    let tools: BTreeSet<&str> = table.iter().map(|row| row["tool"].as_str()).collect();
    assert_eq!(cases.len(), 21, "{cases:?}");
    assert_eq!(tools.into_iter().collect::<Vec<_>>(), [".splat", "SOG", "SPZ", "SplatStream", "all intra"]);
    // Ten scenes for four tools, eleven sequences for two, one strength each.
    assert_eq!(table.len(), 10 * 4 + 11 * 2);
    let silent = table.iter().filter(|row| row["verdict"] == "silent failure");
    let ours = silent.filter(|row| ["SplatStream", "all intra"].contains(&row["tool"].as_str()));
    assert_eq!(report["silent_failures"].as_u64(), Some(ours.count() as u64));
    let one = |case: &str, tool: &str| {
        table.iter().find(|row| row["case"] == case && row["tool"] == tool).expect("a row")
    };
    assert_eq!(one("floater-visible", "SPZ")["verdict"], "warned");
    assert!(one("loss", "SplatStream")["detected"].starts_with("decoder: "));
    assert!(one("transparent", "SplatStream")["fallback"].contains("invisible"));
    let page = read(&out.join("index.html"));
    for file in report["files"].as_array().unwrap().iter().filter_map(|file| file.as_str()) {
        assert!(out.join(file).is_file() && page.contains(file), "{file}");
    }
    assert!(!page.contains("NaN") && !page.contains("http://") && !page.contains("https://"));
}
