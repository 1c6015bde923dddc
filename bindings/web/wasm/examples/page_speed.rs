//! How fast this machine decodes, packs and sorts, with the code that pages run: `page_speed IN.gss` prints nanoseconds of processor
//! time per Gaussian of decoding, and of all. `tests/speed.mjs` compares.
#![allow(clippy::print_stdout, reason = "a program")]

use splatstream_wasm::session::{Session, Status};
use std::time::Duration;

/// Rounds, of which the fastest counts.
const ROUNDS: u32 = 5;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).ok_or("usage: page_speed IN.gss")?;
    let stream = std::fs::read(path)?;
    let mut session = Session::default();
    session.push(&stream).then_some(()).ok_or("there is no memory")?;
    session.end();
    let rounds: Vec<[f64; 2]> = (0..ROUNDS).filter_map(|_| round(&mut session)).collect();
    let best =
        rounds.into_iter().min_by(|one, other| one[1].total_cmp(&other[1])).ok_or("it cannot be decoded")?;
    println!("{} {}", best[0], best[1]);
    Ok(())
}

/// Nanoseconds per Gaussian of decoding, and of all.
fn round(session: &mut Session) -> Option<[f64; 2]> {
    session.seek(0);
    let (mut decoding, mut rest, mut gaussians) = (Duration::ZERO, Duration::ZERO, 0.0);
    loop {
        let start = processor();
        if session.decode() != Status::Done {
            let each = |time: Duration| time.as_nanos() as f64 / gaussians;
            return (gaussians > 0.0).then(|| [each(decoding), each(decoding + rest)]);
        }
        let decoded = processor();
        gaussians += session.numbers.get(2)?;
        session.show();
        session.sort([0.0, 0.0, -5.0], [0.0, 0.0, 1.0]);
        decoding += decoded - start;
        rest += processor() - decoded;
    }
}

/// Processor time of this process.
#[cfg(unix)]
fn processor() -> Duration {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    Duration::new(time.tv_sec as u64, time.tv_nsec as u32)
}

/// Wall time: there is no other.
#[cfg(not(unix))]
fn processor() -> Duration {
    static START: std::sync::OnceLock<std::time::Instant> = std::sync::OnceLock::new();
    START.get_or_init(std::time::Instant::now).elapsed()
}
