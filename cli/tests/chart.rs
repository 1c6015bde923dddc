//! `splatstream chart` leaves a page that needs nothing else, and the numbers behind it.

mod common;

use common::{directory, json, text, write_frames};
use std::path::Path;

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap()
}

/// The values of an attribute in a page.
fn values<'a>(page: &'a str, attribute: &str) -> Vec<&'a str> {
    let start = format!(" {attribute}=\"");
    page.split(&start).skip(1).filter_map(|rest| rest.split('"').next()).collect()
}

#[test]
fn a_quick_chart_is_one_page_without_anything_from_outside() {
    let directory = directory();
    let out = directory.path().join("report");
    let report = json(&["chart", "--builtin", "--quick", "-o", text(&out)]);
    let page = read(&out.join("index.html"));
    for word in ["http://", "https://", "<link", "<script", "@import", "url("] {
        assert!(!page.contains(word), "{word}");
    }
    assert!(values(&page, "src").iter().all(|source| source.starts_with("data:image/png;base64,")));
    for address in values(&page, "href").into_iter().filter(|address| !address.starts_with('#')) {
        assert!(out.join(address).is_file(), "{address}");
    }
    for word in ["How to read:", "splatstream chart --builtin --quick", "not measured: no weights given"] {
        assert!(page.contains(word), "{word}");
    }
    let scene = &report["scenes"][0];
    assert_eq!((scene["scene"].as_str(), scene["frames"].as_u64()), (Some("builtin"), Some(2)));
    assert!(scene["psnr_db"].as_f64().unwrap() > 25.0, "{scene}");
    assert_eq!(scene["variants"][0]["variant"], "without contexts");
    assert!(scene["variants"][0]["bd_rate_percent"].as_f64().unwrap() > 0.0, "{scene}");
}

#[test]
fn figures_are_well_formed_and_say_what_they_show() {
    let directory = directory();
    let out = directory.path().join("report");
    let report = json(&["chart", "--builtin", "--quick", "-o", text(&out)]);
    let files = report["files"].as_array().unwrap().iter().filter_map(|file| file.as_str());
    let figures: Vec<&str> = files.filter(|file| file.ends_with(".svg")).collect();
    assert_eq!(figures.len(), 8, "{figures:?}");
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
