//! Servers whose answers never end.

use super::server::Answer;
use super::{is_range, mixed, named, play_from};
use std::time::{Duration, Instant};

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
