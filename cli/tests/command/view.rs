//! `view`: a stream as a web page.

use crate::common;
use crate::common::{directory, fail, fixture, json, run, succeed, text, write_damaged};
use std::fs;
use std::path::PathBuf;

#[test]
fn a_page_holds_the_stream_and_asks_nobody_for_anything() {
    let directory = directory();
    let page = directory.path().join("talk.html");
    let report = json(&["view", text(&fixture()), "-o", text(&page), "--title", "Talk & more"]);
    let html = fs::read_to_string(&page).unwrap();
    assert_eq!(report["bytes"], html.len() as u64);
    assert_eq!(report["bytes_in"], fs::metadata(fixture()).unwrap().len());
    assert!(report["url"].is_null());
    assert!(html.contains("<title>Talk &amp; more</title>") && html.contains("connect-src 'none'"));
    assert!(!html.contains("http://") && !html.contains("https://"));
}

#[test]
fn a_page_is_named_after_its_file_and_goes_to_standard_output() {
    let html = succeed(&["view", text(&fixture()), "-o", "-"]);
    let stem = fixture().file_stem().unwrap().to_string_lossy().into_owned();
    assert!(html.contains(&format!("<title>{stem}</title>")));
}

#[test]
fn what_cannot_be_viewed_is_refused() {
    let directory = directory();
    let [other, page] = ["scene.ply", "page.html"].map(|name| directory.path().join(name));
    fs::write(&other, "ply\nformat ascii 1.0\n").unwrap();
    fail(10, &["view", text(&other), "-o", text(&page)]);
    assert!(!page.exists());
    fail(2, &["view", text(&fixture()), "-o", text(&page), "--port", "1"]);
    fail(2, &["view", text(&fixture()), "-o", text(&fixture())]);
}

#[cfg(unix)]
#[test]
fn a_page_is_served_with_its_stream_until_a_signal_comes() {
    use std::io::{BufRead, BufReader, Read, Write};
    use std::net::TcpStream;
    use std::process::{Command, Stdio};

    let mut child = Command::new(env!("CARGO_BIN_EXE_splatstream"))
        .args(["view", text(&fixture()), "--json"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut line = String::new();
    BufReader::new(child.stderr.take().unwrap()).read_line(&mut line).unwrap();
    let address = line.split("://").nth(1).unwrap().trim_end().trim_end_matches('/').to_owned();
    let get = |target: &str| {
        let mut socket = TcpStream::connect(&address).unwrap();
        write!(socket, "GET {target} HTTP/1.1\r\nHost: a\r\nConnection: close\r\n\r\n").unwrap();
        let mut reply = Vec::new();
        socket.read_to_end(&mut reply).unwrap();
        reply
    };
    let page = String::from_utf8(get("/")).unwrap();
    assert!(page.starts_with("HTTP/1.1 200") && page.contains("data-url=\"stream.gss\""));
    assert!(get("/stream.gss").ends_with(&fs::read(fixture()).unwrap()));
    assert!(Command::new("kill").arg(child.id().to_string()).status().unwrap().success());
    assert!(child.wait().unwrap().success());
    let mut report = String::new();
    child.stdout.take().unwrap().read_to_string(&mut report).unwrap();
    let report: serde_json::Value = serde_json::from_str(&report).unwrap();
    assert_eq!(report["url"], format!("http://{address}/"));
    assert!(report["output"].is_null());
}

#[test]
fn frames_become_a_page_in_one_command() {
    let directory = directory();
    let scene = common::write_still(directory.path());
    let [stream, page] = ["a.gss", "a.html"].map(|name| directory.path().join(name));
    let encode = |out: &PathBuf| json(&["encode", text(&scene), "-o", text(out), "--title", "A & b"]);
    let [of_stream, of_page] = [&stream, &page].map(encode);
    assert!(of_stream["page_bytes"].is_null());
    assert_eq!(of_page["page_bytes"], fs::metadata(&page).unwrap().len());
    assert_eq!(of_page["bytes"], fs::metadata(&stream).unwrap().len());
    // The page is what `view` makes of the stream.
    assert_eq!(fs::read_to_string(&page).unwrap(), succeed(&["view", text(&stream), "-o", "-"]));
}

#[test]
fn a_damaged_stream_is_shown_with_a_warning() {
    let directory = directory();
    let (path, page) = (write_damaged(directory.path()), directory.path().join("damaged.html"));
    let output = run(&["view", text(&path), "-o", text(&page)]);
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(
        output.status.success() && said.starts_with("warning: ") && said.contains("payload_crc"),
        "{said}"
    );
}
