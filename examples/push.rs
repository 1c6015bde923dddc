//! Frames of bytes as they arrive: `cat IN.gss | cargo run --example push`.
#![expect(clippy::print_stdout, reason = "an example shows what it has")]

use splatstream::{Decoder, Frame};
use std::io::Read;

fn show(frame: &Frame) {
    println!("frame {}: {} Gaussians", frame.index(), frame.gaussians().len());
}

fn main() -> Result<(), splatstream::Error> {
    let mut decoder = Decoder::new();
    let mut chunk = [0; 4096];
    loop {
        match std::io::stdin().read(&mut chunk)? {
            0 => decoder.end(),
            read => decoder.push(&chunk[..read])?,
        }
        while let Some(frame) = decoder.next_frame()? {
            show(&frame);
        }
        if decoder.is_finished() {
            return Ok(());
        }
    }
}
