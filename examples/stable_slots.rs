//! What a renderer uploads, frame by frame: `cargo run --example stable_slots IN.gss`.
#![expect(clippy::print_stdout, reason = "an example shows what it has")]

use splatstream::{Decoder, Slots};

fn main() -> Result<(), splatstream::Error> {
    let path = std::env::args().nth(1).unwrap_or_else(|| "examples/talk.gss".to_owned());
    let mut slots = Slots::new(1 << 20);
    for frame in Decoder::open(path)? {
        let frame = frame?;
        let update = slots.update(&frame)?;
        let changed: usize = update.dirty.iter().map(ExactSizeIterator::len).sum();
        println!(
            "frame {}: {} kept, {} new, {} gone; {changed} slots to upload in {} pieces",
            frame.index(),
            update.kept,
            update.appeared,
            update.disappeared,
            update.dirty.len()
        );
    }
    Ok(())
}
