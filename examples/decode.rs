//! The frames of a file: `cargo run --example decode IN.gss`.
#![expect(clippy::print_stdout, reason = "an example shows what it has")]

use splatstream::Decoder;

fn main() -> Result<(), splatstream::Error> {
    let path = std::env::args().nth(1).unwrap_or_else(|| "examples/talk.gss".to_owned());
    for frame in Decoder::open(path)? {
        let frame = frame?;
        println!("frame {}: {} Gaussians at {:?}", frame.index(), frame.len(), frame.time());
        for warning in frame.warnings() {
            println!("  {warning}");
        }
    }
    Ok(())
}
