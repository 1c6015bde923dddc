//! Files and their ranges.

use super::client::{Client, ask, get};
use super::{Running, bytes, folder};
use std::fs::{self, File};
use std::time::{Duration, SystemTime};

#[test]
fn a_file_comes_whole_and_in_parts() {
    let folder = folder();
    let server = Running::start(folder.path(), |_| ());
    let whole = bytes(1_000_000);
    let reply = get(server.address, "/talk/s0.mp4", &[]);
    assert_eq!((reply.status, reply.header("accept-ranges")), (200, "bytes"));
    assert!(reply.body == whole);
    // One connection serves all the others.
    let mut client = Client::connect(server.address);
    let parts = [
        ("0-99", 0..100),
        ("999990-", 999_990..1_000_000),
        ("-7", 999_993..1_000_000),
        ("5-9999999", 5..1_000_000),
    ];
    for (range, part) in parts {
        let reply = client.ask("GET", "/talk/s0.mp4", &[&format!("Range: bytes={range}")]).unwrap();
        let expected = format!("bytes {}-{}/1000000", part.start, part.end - 1);
        assert_eq!((reply.status, reply.header("content-range")), (206, expected.as_str()));
        assert!(reply.body == whole[part], "{range}");
    }
    for range in ["1000000-", "2000000-3000000", "-0"] {
        let reply = client.ask("GET", "/talk/s0.mp4", &[&format!("Range: bytes={range}")]).unwrap();
        assert_eq!((reply.status, reply.header("content-range")), (416, "bytes */1000000"), "{range}");
    }
    let reply = client.ask("GET", "/talk/s0.mp4", &["Range: bytes=0-1,5-6"]).unwrap();
    assert!(reply.status == 200 && reply.body == whole, "several ranges are ignored");
    let reply = client.ask("GET", "/player.wasm", &[]).unwrap();
    assert_eq!((reply.status, reply.header("content-length")), (200, "0"));
    let (statistics, entries) = server.stop();
    assert_eq!((statistics.requests, statistics.connections, statistics.client_errors), (10, 2, 3));
    assert_eq!(statistics.bytes, entries.iter().map(|entry| entry.bytes).sum::<u64>());
    assert!(entries.iter().all(|entry| entry.complete && entry.protocol == "HTTP/1.1"));
    assert_eq!((entries[1].status, entries[1].bytes), (206, 100));
    assert_eq!(entries[1].range.as_deref(), Some("bytes=0-99"));
}

#[test]
fn a_range_counts_only_for_the_version_that_a_client_has() {
    let folder = folder();
    let server = Running::start(folder.path(), |_| ());
    let path = folder.path().join("talk/s0-1.m4s");
    let reply = get(server.address, "/talk/s0-1.m4s", &[]);
    let etag = reply.header("etag").to_owned();
    let modified = reply.header("last-modified").to_owned();
    assert!(etag.starts_with('"') && etag.ends_with('"'), "a strong one: {etag}");
    let status =
        |header: &str, target: &str| get(server.address, target, &["Range: bytes=0-1", header]).status;
    for header in [format!("If-Range: {etag}"), format!("If-Range: {modified}")] {
        assert_eq!(status(&header, "/talk/s0-1.m4s"), 206, "{header}");
    }
    for header in ["If-Range: \"other\"", "If-Range: Sun, 09 Sep 2001 01:46:39 GMT", "If-Range: nonsense"] {
        assert_eq!(status(header, "/talk/s0-1.m4s"), 200, "{header}");
    }
    let known = |header: &str| get(server.address, "/talk/s0-1.m4s", &[header]);
    for header in [format!("If-None-Match: {etag}"), format!("If-Modified-Since: {modified}")] {
        let reply = known(&header);
        assert_eq!((reply.status, reply.header("etag")), (304, etag.as_str()), "{header}");
    }
    assert_eq!(known("If-Match: \"other\"").status, 412);
    // The same length, another time.
    let earlier = SystemTime::now() - Duration::from_secs(100);
    File::options().write(true).open(&path).unwrap().set_modified(earlier).unwrap();
    assert_eq!(status(&format!("If-Range: {etag}"), "/talk/s0-1.m4s"), 200);
    assert_eq!(known(&format!("If-None-Match: {etag}")).status, 200);
}

#[test]
fn head_says_what_get_would() {
    let folder = folder();
    let server = Running::start(folder.path(), |_| ());
    let names = [
        "etag",
        "last-modified",
        "content-type",
        "content-length",
        "cache-control",
        "accept-ranges",
        "content-range",
    ];
    for headers in [&[][..], &["Range: bytes=5-9"], &["Range: bytes=5000-"]] {
        let mut client = Client::connect(server.address);
        let head = client.ask("HEAD", "/talk.gss", headers).unwrap();
        let get = client.ask("GET", "/talk.gss", headers).unwrap();
        assert_eq!(head.status, get.status);
        for name in names {
            // A length of no body says nothing of refusals.
            if name != "content-length" || get.status < 400 {
                assert_eq!(head.header(name), get.header(name), "{name}");
            }
        }
    }
}

#[test]
fn types_and_times_in_caches_are_right() {
    let folder = folder();
    let old = SystemTime::now() - Duration::from_secs(1000);
    fs::write(folder.path().join("old.json"), "{}").unwrap();
    for file in ["player.js", "old.json"] {
        File::options().write(true).open(folder.path().join(file)).unwrap().set_modified(old).unwrap();
    }
    let server = Running::start(folder.path(), |_| ());
    let immutable = "public, max-age=31536000, immutable";
    let expected = [
        ("/talk/s0.mp4", "application/mp4", immutable),
        ("/talk/s0-1.m4s", "application/mp4", immutable),
        ("/talk/s0-2.m4s", "application/mp4", "no-cache"),
        ("/talk/manifest.mpd", "application/dash+xml", "no-cache"),
        ("/talk/manifest.json", "application/json", "no-cache"),
        ("/old.json", "application/json", "public, max-age=1"),
        ("/talk.gss", "application/octet-stream", "no-store"),
        ("/player.js", "text/javascript; charset=utf-8", "no-cache"),
        ("/player.wasm", "application/wasm", "no-store"),
        ("/", "text/html; charset=utf-8", "no-store"),
    ];
    for (target, kind, cache) in expected {
        let reply = get(server.address, target, &[]);
        assert_eq!((reply.status, reply.header("content-type")), (200, kind), "{target}");
        assert_eq!(reply.header("cache-control"), cache, "{target}");
    }
    let missing = get(server.address, "/talk/s1.mp4", &[]);
    assert_eq!((missing.status, missing.header("cache-control")), (404, "no-store"));
    assert_eq!(ask(server.address, "DELETE", "/talk.gss", &[]).status, 405);
    assert_eq!(ask(server.address, "POST", "/talk.gss", &["Content-Length: 0"]).status, 405);
    assert!(folder.path().join("talk.gss").exists());
}

#[test]
fn pages_of_other_origins_read_files() {
    let folder = folder();
    let server = Running::start(folder.path(), |_| ());
    for status in [200, 404] {
        let target = if status == 200 { "/talk/s0.mp4" } else { "/none" };
        let reply = get(server.address, target, &["Origin: https://example.org"]);
        assert_eq!((reply.status, reply.header("access-control-allow-origin")), (status, "*"));
        let exposed = reply.header("access-control-expose-headers");
        for name in ["content-range", "content-length", "etag", "accept-ranges"] {
            assert!(exposed.contains(name), "{exposed}");
        }
    }
    let preflight = [
        "Origin: https://example.org",
        "Access-Control-Request-Method: GET",
        "Access-Control-Request-Headers: range",
    ];
    let reply = ask(server.address, "OPTIONS", "/talk/s0.mp4", &preflight);
    assert_eq!((reply.status, reply.header("access-control-allow-headers")), (200, "range,if-range"));
    assert!(reply.header("access-control-allow-methods").contains("GET"));
    let origin = "https://example.org".to_owned();
    let server = Running::start(folder.path(), |settings| settings.origins = vec![origin.clone()]);
    let allowed = |origin: &str| {
        let reply = get(server.address, "/talk.gss", &[&format!("Origin: {origin}")]);
        reply.header("access-control-allow-origin").to_owned()
    };
    assert_eq!((allowed(&origin), allowed("https://example.com")), (origin.clone(), String::new()));
}

#[test]
fn a_file_that_becomes_shorter_ends_the_connection() {
    let folder = folder();
    let path = folder.path().join("long.mp4");
    fs::write(&path, bytes(64 << 20)).unwrap();
    let server = Running::start(folder.path(), |_| ());
    let mut client = Client::connect(server.address);
    client.send("GET", "/long.mp4", &[]).unwrap();
    let (_, length) = client.head().unwrap();
    File::options().write(true).open(&path).unwrap().set_len(1000).unwrap();
    assert!(client.rest().len() < length);
    assert_eq!(server.stop().0.incomplete, 1);
}
