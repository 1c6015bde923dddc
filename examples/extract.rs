//! A smaller stream: `cargo run --example extract IN.gss s0,t0,r1 OUT.gss`.
#![expect(clippy::print_stdout, reason = "an example shows what it has")]

use splatstream::{Limits, extract};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [input, point, output] = arguments.as_slice() else {
        return Err(
            "give a stream, an operating point such as s0,t0,r1, and where the smaller stream goes".into()
        );
    };
    let bytes = std::fs::read(input)?;
    let small = extract(&bytes, point.parse()?, &Limits::default())?;
    std::fs::write(output, &small)?;
    println!("{} of {} bytes", small.len(), bytes.len());
    Ok(())
}
