//! How long a decoder goes on after it has been interrupted, wherever it is.

use crate::{Result, processor_time};
use splatstream_decoder::interrupt::Interrupt;
use splatstream_decoder::process::Options;
use splatstream_decoder::stream::{Step, StreamDecoder};
use splatstream_format::Limits;
use std::sync::mpsc;
use std::time::{Duration, Instant};

/// Places of a stream at which it is interrupted.
const PLACES: u32 = 40;

/// Interrupts a decoder of a file at many places, and gives the milliseconds of processor time that it goes on, in order.
pub(crate) fn milliseconds(path: &str, level: u8) -> Result<Vec<f64>> {
    let bytes = std::fs::read(path)?;
    let start = Instant::now();
    decode(&bytes, level, &Interrupt::default());
    let all = start.elapsed();
    let mut found =
        (0..PLACES).map(|place| after(&bytes, level, all * place / PLACES)).collect::<Result<Vec<_>>>()?;
    found.sort_by(f64::total_cmp);
    Ok(found)
}

/// Interrupts a decoder so long after it has begun.
fn after(bytes: &[u8], level: u8, pause: Duration) -> Result<f64> {
    let interrupt = Interrupt::new();
    let (sender, receiver) = mpsc::channel();
    std::thread::scope(|scope| {
        scope.spawn(|| {
            let decoder = decode(bytes, level, &interrupt);
            sender.send(processor_time()).ok();
            // What it holds is given back later.
            drop(decoder);
        });
        std::thread::sleep(pause);
        let before = processor_time();
        interrupt.request();
        Ok(receiver.recv()?.saturating_sub(before).as_secs_f64() * 1e3)
    })
}

fn decode(bytes: &[u8], level: u8, interrupt: &Interrupt) -> StreamDecoder {
    let mut decoder = StreamDecoder::new(&Options { limits: Limits::of_level(level), ..Options::default() });
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
