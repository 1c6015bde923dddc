//! What a codec costs as scenes grow: nanoseconds of processor time per Gaussian, and peak memory, of encoding and
//! decoding, against the number of Gaussians and of frames; where that is not linear; and what decoding frames of each kind
//! costs.
//!
//! `cargo run --release -p splatstream-encoder --example scale -- [GAUSSIANS] [FRAMES]` goes up to 4,000,000 Gaussians in
//! one frame and 1,000 frames, or to what is said; 0 leaves a table out.
#![expect(clippy::print_stdout, reason = "the report goes to standard output")]

#[path = "../measured/mod.rs"]
mod measured;
mod scenes;
mod table;

use measured::{Result, Seconds, decoded, measured};
use peak_alloc::PeakAlloc;
use scenes::Source;
use splatstream_decoder::frame_memory::FrameMemory;
use splatstream_encoder::{Preset, Settings, Structure, encode};
use std::fs::File;
use std::io::{BufWriter, Write};
use table::{Cost, Growth, Row};

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// Gaussians of single frames, of SH degree 2.
const GAUSSIANS: [u32; 6] = [10_000, 30_000, 100_000, 300_000, 1_000_000, 4_000_000];
/// Frames of sequences.
const FRAMES: [u32; 4] = [1, 10, 100, 1_000];
/// Gaussians of each frame of a sequence, of SH degree 1.
const GAUSSIANS_OF_FRAME: u32 = 3_000;
/// Gaussians of frames of each kind.
const GAUSSIANS_OF_KIND: u32 = 100_000;
/// P frames after an I frame.
const LATER_FRAMES: u32 = 8;
/// Times that something is done; the shortest counts.
const REPEAT: u32 = 3;
/// Seconds from which on nothing is done again.
const SLOW: f64 = 10.0;

fn main() -> Result<()> {
    let mut words = std::env::args().skip(1);
    let mut limit = |default: u32| words.next().map_or(Ok(default), |word| word.parse::<u32>());
    let (most_gaussians, most_frames) = (limit(u32::MAX)?, limit(u32::MAX)?);
    let sizes: Vec<u32> = GAUSSIANS.into_iter().filter(|&count| count <= most_gaussians).collect();
    if !sizes.is_empty() {
        println!("One frame of SH degree 2, whose size and extent grow alike:\n");
        print_table(&Growth::GAUSSIANS, &sizes, Source::single)?;
    }
    let lengths: Vec<u32> = FRAMES.into_iter().filter(|&count| count <= most_frames).collect();
    if !lengths.is_empty() {
        println!("Tracked frames of {GAUSSIANS_OF_FRAME} Gaussians, SH degree 1, GOPs of 16:\n");
        let source = |frames| Source::sequence(GAUSSIANS_OF_FRAME, frames);
        print_table(&Growth::FRAMES, &lengths, source)?;
        print_kinds()?;
    }
    Ok(())
}

/// Prints what decoding takes by the kind of frame: what P frames take is what their I frame alone does not.
fn print_kinds() -> Result<()> {
    let predicted = Structure::Predicted { layers: 1 };
    let decode_ns = |structure: Structure, source: Source| -> Result<f64> {
        let settings = Settings { preset: Preset::Fast, structure, ..Settings::default() };
        let (stream, _) = encoded(&source, &settings)?;
        Ok(decoded_cost(&stream)?.processor * 1e9 / f64::from(GAUSSIANS_OF_KIND))
    };
    let of = |frames: u32| Source::sequence(GAUSSIANS_OF_KIND, frames);
    let alone = decode_ns(Structure::Intra, of(1))?;
    let first = decode_ns(predicted, of(1))?;
    let later = |whole: f64| (whole - first) / f64::from(LATER_FRAMES);
    let moving = later(decode_ns(predicted, of(1 + LATER_FRAMES))?);
    let still = later(decode_ns(predicted, of(1 + LATER_FRAMES).still())?);
    println!("Decoding frames of {GAUSSIANS_OF_KIND} Gaussians, SH degree 1, fast preset, one layer:\n");
    println!("| frame | ns per Gaussian | times as fast as the first row |\n|---|--:|--:|");
    let rows = [
        ("I, in a stream of I frames", alone),
        ("I, before P frames", first),
        ("P, a third of the scene moves", moving),
        ("P, nothing moves", still),
    ];
    rows.iter().for_each(|(name, cost)| println!("| {name} | {cost:.0} | {:.2} |", alone / cost));
    println!();
    Ok(())
}

/// Measures scenes of growing size, and prints each as soon as it is measured.
fn print_table(growth: &Growth, sizes: &[u32], source: impl Fn(u32) -> Source) -> Result<()> {
    table::print_head(growth);
    let mut rows = Vec::new();
    for &size in sizes {
        let row = row(size, &source(size))?;
        row.print();
        rows.push(row);
    }
    table::print_excesses(growth, &rows);
    Ok(())
}

/// Measures one scene.
fn row(size: u32, source: &Source) -> Result<Row> {
    let (structure, spatial_layers) = match source.is_sequence() {
        false => (Structure::Intra, 1),
        true => (Structure::Predicted { layers: 2 }, 3),
    };
    let settings = Settings { structure, spatial_layers, ..Settings::default() };
    let (_, fast) = encoded(source, &Settings { preset: Preset::Fast, ..settings.clone() })?;
    let (stream, balanced) = encoded(source, &Settings { preset: Preset::Balanced, ..settings })?;
    Ok(Row { size, bytes: stream.len(), fast, balanced, decode: decoded_cost(&stream)? })
}

/// What decoding costs, digests compared.
fn decoded_cost(stream: &[u8]) -> Result<Cost> {
    repeated(|| {
        let (gaussians, seconds) = measured(|| decoded(stream, true, &FrameMemory::default()));
        Ok((gaussians?, seconds))
    })
}

/// The stream of a scene, and what it costs without what the scene itself takes.
fn encoded(source: &Source, settings: &Settings) -> Result<(Vec<u8>, Cost)> {
    // Not in memory, which is measured.
    let path = std::env::temp_dir().join(format!("scale-{}.gss", std::process::id()));
    let cost = repeated(|| {
        let mut source = source.clone();
        let mut out = BufWriter::new(File::create(&path)?);
        let (report, seconds) = measured(|| encode(&mut source, settings, &mut out, &mut |_, _| {}));
        out.flush()?;
        let processor = seconds.processor - source.processor_seconds();
        Ok((report?.gaussians, Seconds { processor, ..seconds }))
    });
    let stream = std::fs::read(&path);
    std::fs::remove_file(&path)?;
    Ok((stream?, cost?))
}

/// The least that some work takes, which says how many Gaussians it has worked on.
fn repeated(mut work: impl FnMut() -> Result<(u64, Seconds)>) -> Result<Cost> {
    let mut least: Option<Cost> = None;
    for _ in 0..REPEAT {
        let before = MEMORY.current_usage();
        MEMORY.reset_peak_usage();
        let (gaussians, Seconds { processor, wall }) = work()?;
        let peak = MEMORY.peak_usage().saturating_sub(before);
        least = match least {
            Some(cost) if cost.processor < processor => Some(cost),
            _ => Some(Cost { gaussians, processor, peak }),
        };
        if wall > SLOW {
            break;
        }
    }
    least.ok_or_else(|| "nothing was measured".into())
}
