//! How long a decoder of a stream goes on after it has been told to end, at random moments.
//!
//! `RAYON_NUM_THREADS=1 cargo run --release -p splatstream-decoder --example cancel -- FILE [TIMES]` decodes the file TIMES
//! times (200), interrupts each at a random moment, and prints the processor time from the request until the decoder has
//! returned, and until the memory that it held has been given back. With one thread this is the time that an idle machine
//! takes.

#![expect(clippy::print_stdout, reason = "it prints what it measures")]

use rustix::time::{ClockId, clock_gettime};
use splatstream_decoder::interrupt::Interrupt;
use splatstream_decoder::process::Options;
use splatstream_decoder::stream::{Step, StreamDecoder};
use splatstream_format::Limits;
use std::time::Duration;

type Result<T> = core::result::Result<T, Box<dyn std::error::Error>>;

fn main() -> Result<()> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let path = words.first().ok_or("which file?")?;
    let times = words.get(1).map_or(Ok(200), |word| word.parse::<u32>())?;
    let bytes = std::fs::read(path)?;
    let begin = processor_time();
    drop(decode(&bytes, &Interrupt::default()));
    let all = processor_time().saturating_sub(begin);
    println!("{path}: {} bytes, decoded in {:.0} ms of processor time", bytes.len(), milliseconds(all));

    let mut found = (0..times).map(|number| interrupted(&bytes, all, number)).collect::<Result<Vec<_>>>()?;
    println!("the longest: after ms, returned in ms, memory given back in ms");
    found.sort_by_key(|one| core::cmp::Reverse(one.returned));
    for one in found.iter().take(5) {
        let [at, returned, freed] = [one.at, one.returned, one.freed].map(milliseconds);
        println!("  {at:.1} {returned:.2} {freed:.2}");
    }
    print("returned", found.iter().map(|one| one.returned));
    print("memory given back", found.iter().map(|one| one.freed));
    Ok(())
}

/// Processor time of an interrupted decoder.
struct Interrupted {
    /// Up to the request.
    at: Duration,
    /// From the request until it had returned.
    returned: Duration,
    /// From the request until its memory had been given back.
    freed: Duration,
}

fn interrupted(bytes: &[u8], all: Duration, number: u32) -> Result<Interrupted> {
    // The fractions of multiples of the golden ratio: spread evenly, in no step with what a decoder does.
    let at = all.mul_f64((f64::from(number) * 0.618_033_988_749_895).fract());
    let interrupt = Interrupt::new();
    let begin = processor_time();
    let (requested, returned, freed) = std::thread::scope(|scope| {
        let decoding = scope.spawn(|| {
            let decoder = decode(bytes, &interrupt);
            let returned = processor_time();
            drop(decoder);
            (returned, processor_time())
        });
        while processor_time().saturating_sub(begin) < at && !decoding.is_finished() {
            std::thread::sleep(Duration::from_micros(200));
        }
        let requested = processor_time();
        interrupt.request();
        let (returned, freed) = decoding.join().unwrap_or_default();
        (requested, returned, freed)
    });
    let since = |time: Duration| time.saturating_sub(requested);
    Ok(Interrupted { at: requested.saturating_sub(begin), returned: since(returned), freed: since(freed) })
}

/// Decodes a stream as far as it is let.
fn decode(bytes: &[u8], interrupt: &Interrupt) -> StreamDecoder {
    let options = Options { limits: Limits::of_level(4), identities: true, ..Options::default() };
    let mut decoder = StreamDecoder::new(&options);
    decoder.set_interrupt(interrupt.clone());
    while !interrupt.is_requested() {
        let at = usize::try_from(decoder.position()).unwrap_or(usize::MAX);
        match decoder.next_step(bytes.get(at..).unwrap_or_default(), true) {
            Ok(Step::End) | Err(_) => break,
            Ok(_) => {}
        }
    }
    decoder
}

/// Median, 99 of 100, and the longest.
fn print(what: &str, times: impl Iterator<Item = Duration>) {
    let mut times: Vec<f64> = times.map(milliseconds).collect();
    times.sort_by(f64::total_cmp);
    let at = |percent: usize| times.get((times.len() * percent / 100).min(times.len() - 1));
    let [median, most, longest] = [at(50), at(99), times.last()].map(|one| one.copied().unwrap_or(0.0));
    println!("{what}: median {median:.2} ms, p99 {most:.2} ms, longest {longest:.2} ms");
}

fn milliseconds(time: Duration) -> f64 {
    time.as_secs_f64() * 1e3
}

/// Processor time of this process so far, of all threads.
fn processor_time() -> Duration {
    let now = clock_gettime(ClockId::ProcessCPUTime);
    Duration::new(now.tv_sec.unsigned_abs(), now.tv_nsec.unsigned_abs() as u32)
}
