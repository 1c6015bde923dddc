//! `serve`: a package over HTTP, until a signal comes.

use crate::common::{directory, fail, fixture, json, succeed, text};
use serde_json::Value;
use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, ChildStderr, Command, Stdio};

/// Starts a server on a free port; the process, its standard error after the address, and the address.
fn start(arguments: &[&str]) -> (Child, BufReader<ChildStderr>, String) {
    let mut child = Command::new(env!("CARGO_BIN_EXE_splatstream"))
        .args(["serve", "--port", "0"])
        .args(arguments)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stderr = BufReader::new(child.stderr.take().unwrap());
    let mut line = String::new();
    stderr.read_line(&mut line).unwrap();
    let address = line.split("://").nth(1).unwrap_or_else(|| panic!("{line}"));
    let address = address.trim_end().trim_end_matches('/').to_owned();
    (child, stderr, address)
}

fn get(address: &str, target: &str) -> Vec<u8> {
    let mut socket = TcpStream::connect(address).unwrap();
    write!(socket, "GET {target} HTTP/1.1\r\nHost: a\r\nRange: bytes=4-7\r\nConnection: close\r\n\r\n")
        .unwrap();
    let mut reply = Vec::new();
    socket.read_to_end(&mut reply).unwrap();
    reply
}

#[test]
fn the_player_of_a_package_is_at_its_address() {
    let directory = directory();
    let out = directory.path().join("talk");
    succeed(&["package", text(&fixture()), "-o", text(&out)]);
    let (mut child, _stderr, address) = start(&[text(&out), "--player"]);
    let page = String::from_utf8_lossy(&get(&address, "/")).into_owned();
    assert!(page.starts_with("HTTP/1.1 200") && page.contains("content-type: text/html"), "{:.200}", page);
    assert!(page.contains("<title>talk</title>") && page.contains("data-url=\"manifest.json\""));
    assert!(get(&address, "/manifest.json").starts_with(b"HTTP/1.1 206"));
    child.kill().unwrap();
    child.wait().unwrap();
    let refused = fail(1, &["serve", text(directory.path()), "--port", "0", "--player"]);
    assert!(refused.contains("there is no manifest.json"), "{refused}");
}

#[test]
fn a_package_is_served_until_a_signal_comes() {
    let directory = directory();
    let out = directory.path().join("talk");
    succeed(&["package", text(&fixture()), "-o", text(&out)]);
    let (mut child, mut stderr, address) = start(&[text(&out), "--json", "--log", "json", "--latency", "5"]);
    let reply = get(&address, "/s0.mp4");
    assert!(reply.starts_with(b"HTTP/1.1 206") && reply.ends_with(b"ftyp"));
    assert!(get(&address, "/../talk.gss").starts_with(b"HTTP/1.1 404"));
    let ended = Command::new("kill").arg(child.id().to_string()).status().unwrap();
    assert!(ended.success() && child.wait().unwrap().success());
    let mut report = String::new();
    child.stdout.take().unwrap().read_to_string(&mut report).unwrap();
    let report: Value = serde_json::from_str(&report).unwrap();
    assert_eq!(
        (&report["requests"], &report["successful"], &report["client_errors"]),
        (&2.into(), &1.into(), &1.into())
    );
    assert_eq!((&report["connections"], &report["incomplete"]), (&2.into(), &0.into()));
    assert_eq!(report["url"], format!("http://{address}/"));
    let shown = report.to_string().replace(&address, "ADDRESS").replace(text(directory.path()), "DIR");
    let mut shown: Value = serde_json::from_str(&shown).unwrap();
    // Whether the first connection had ended when the second began is a matter of time, too.
    ["seconds", "peak_connections"].into_iter().for_each(|key| shown[key] = "varies".into());
    insta::assert_json_snapshot!("serve", shown);
    let documented = include_str!("../../json.md");
    let documented = documented.split("\n## ").find(|part| part.starts_with("serve")).unwrap();
    let keys: Vec<&String> = report.as_object().unwrap().keys().collect();
    assert!(keys.iter().all(|key| documented.contains(&format!("`{key}`"))), "{keys:?}");
    let mut log = String::new();
    stderr.read_to_string(&mut log).unwrap();
    let first: Value = serde_json::from_str(log.lines().next().unwrap()).unwrap();
    assert_eq!(
        (&first["status"], &first["bytes"], &first["range"]),
        (&206.into(), &4.into(), &"bytes=4-7".into())
    );
    assert_eq!((&first["target"], &first["method"]), (&"/s0.mp4".into(), &"GET".into()));
    assert!(first["seconds"].as_f64().unwrap() >= 0.005, "{log}");
}

/// The two commands of README.md, on another port.
#[test]
fn the_built_in_scene_is_served_and_played() {
    let readme = include_str!("../../../README.md");
    let (mut child, _stderr, address) = start(&["--built-in"]);
    let url = format!("http://{address}/");
    let report = json(&["play", &url]);
    let ended = Command::new("kill").arg(child.id().to_string()).status().unwrap();
    assert!(ended.success() && child.wait().unwrap().success());
    assert_eq!((&report["totals"]["complete"], &report["quality_measured"]), (&true.into(), &true.into()));
    assert_eq!(report["losses"], Value::Array(vec![]));
    let gops = report["gops"].as_array().unwrap();
    assert_eq!(gops.len(), 6);
    assert!(gops.iter().all(|gop| gop["decoded"]["errors"] == Value::Array(vec![])));
    assert!(gops.iter().all(|gop| gop["decoded"]["lost"] == Value::Array(vec![])), "{report}");
    // The first GOP begins with its base; then there is time for more.
    assert!(gops[0]["op"] == "s0,i,r0" || gops[0]["decoded"]["frames"].as_u64().unwrap() > 1, "{report}");
    assert!(gops[5]["decoded"]["frames"].as_u64().unwrap() > 1, "{report}");
    for command in ["serve --built-in", "play http://127.0.0.1:8080/"] {
        assert!(
            readme.contains(&format!("cargo run --release -p splatstream-cli -- {command}")),
            "{command}"
        );
    }
}

#[test]
fn what_cannot_be_served_is_said() {
    let directory = directory();
    let at = text(directory.path());
    let trace = directory.path().join("trace.csv");
    let nothing = directory.path().join("nothing");
    fs::write(&trace, "t_s,mbps\n0,1\nx,2\n").unwrap();
    let said = fail(1, &["serve", at, "--port", "0", "--shape", text(&trace)]);
    assert!(said.contains("trace.csv: line 3"), "{said}");
    fs::write(&trace, "t_s,mbps\n0,0\n").unwrap();
    assert!(fail(1, &["serve", at, "--port", "0", "--shape", text(&trace)]).contains("bandwidth"));
    assert!(fail(1, &["serve", text(&nothing)]).contains("nothing"));
    assert!(fail(1, &["serve", text(&trace)]).contains("trace.csv"));
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port().to_string();
    assert!(fail(1, &["serve", at, "--port", &port]).contains(&port));
    fail(1, &["serve", at, "--port", "0", "--tls-cert", text(&trace), "--tls-key", text(&trace)]);
    for bad in [
        &["--drop", "2"][..],
        &["--fail", "x"],
        &["--tls-cert", "a.pem"],
        &["--bind", "here"],
        &["--grace", "-1"],
    ] {
        fail(2, &[&["serve", at], bad].concat());
    }
}
