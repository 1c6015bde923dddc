//! From a frame on, and with a lower operating point after it: `cargo run --example seek IN.gss FRAME`.
#![expect(clippy::print_stdout, reason = "an example shows what it has")]

use splatstream::{Decoder, Position};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let path = arguments.next().unwrap_or_else(|| "examples/talk.gss".to_owned());
    let first = arguments.next().map_or(Ok(5), |number| number.parse())?;
    let mut decoder = Decoder::open(path)?;
    decoder.seek(Position::Frame(first))?;
    while let Some(frame) = decoder.next_frame()? {
        println!("frame {}: {} Gaussians, {}", frame.index(), frame.len(), frame.operating_point());
        // What a client does whose network becomes slow.
        decoder.set_operating_point("s0,t0,r0".parse()?);
    }
    Ok(())
}
