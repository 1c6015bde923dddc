//! Servers whose answers never end, and that send clients elsewhere.

use super::server::{Answer, Server};
use super::{is_range, mixed, named, options, play_from, served};
use splatstream_stream::client::{Client, Options};
use splatstream_stream::package::Layout;
use std::time::{Duration, Instant};

/// Why a manifest cannot be had that is answered so, after one attempt.
fn refusal(answer: Answer) -> String {
    let server = Server::start(served(&mixed(), Layout::Gop), move |_| answer.clone());
    let begun = Instant::now();
    let options = Options { base_attempts: 1, read_timeout: Duration::from_secs(10), ..options() };
    let refused = Client::open(&server.url, options).unwrap_err().to_string();
    assert!(begun.elapsed() < Duration::from_secs(5), "{:?}: {refused}", begun.elapsed());
    refused
}

#[test]
fn what_is_no_body_comes_to_an_end() {
    let chunked = "HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n";
    let trailers: &str = Box::leak(format!("{chunked}0\r\n").into_boxed_str());
    let redirect = "HTTP/1.1 302 Found\r\nLocation: /a\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n";
    for head in [trailers, redirect] {
        let refused = refusal(Answer::Endless(head, "A: b\r\n"));
        assert!(refused.contains("without a byte of a body"), "{refused}");
    }
}

#[test]
fn bodies_end_with_what_the_manifest_says() {
    for head in ["HTTP/1.1 200 OK\r\n\r\n", "HTTP/1.1 200 OK\r\nContent-Length: 9999999999999\r\n\r\n"] {
        let begun = Instant::now();
        let (outcome, _server) = play_from(&mixed(), move |request| match is_range(request, "t1.mp4") {
            true => Answer::Endless(head, "\0"),
            false => Answer::Well,
        });
        assert!(outcome.report.complete && !outcome.losses.is_empty());
        let larger = |loss: &String| loss.contains("t1") && loss.contains("larger than the manifest says");
        assert!(named(&outcome).iter().all(larger), "{:?}", named(&outcome));
        assert!(begun.elapsed() < Duration::from_secs(20), "{:?}", begun.elapsed());
    }
}

#[test]
fn redirects_lead_to_the_web() {
    for elsewhere in ["file:///etc/passwd", "ftp://localhost/manifest.json"] {
        let refused = refusal(Answer::Elsewhere(elsewhere));
        assert!(refused.contains("neither http nor https"), "{elsewhere}: {refused}");
    }
    let refused = refusal(Answer::Elsewhere("/package/manifest.json"));
    assert!(refused.contains("too many redirects"), "{refused}");
}
