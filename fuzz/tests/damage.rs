//! Damage of files and streams, drawn at random and the same every time. What is damaged is refused, or what is left of it is
//! right and the loss is said; nothing panics, and memory keeps to its bounds.
//!
//! `SPLATSTREAM_DAMAGE=full` makes a campaign of what is a sample otherwise: `.ci/reports damage`.

#[path = "damage/chains.rs"]
mod chains;
#[path = "damage/intact.rs"]
mod intact;
#[path = "damage/readers.rs"]
mod readers;
#[path = "damage/streams.rs"]
mod streams;

use splatstream_gaussians::random::SplitMix64;

/// How many inputs of a campaign there are: all, or a tenth of them.
fn so_many(all: usize) -> usize {
    let is_full = std::env::var("SPLATSTREAM_DAMAGE").is_ok_and(|word| word == "full");
    if is_full { all } else { all / 10 }
}

/// Bytes as a bad disk or a bad line leaves them: up to four damages, each of one kind.
fn damaged(bytes: &[u8], random: &mut SplitMix64) -> Vec<u8> {
    let mut out = bytes.to_vec();
    for _ in 0..=random.below(4) {
        if out.is_empty() {
            break;
        }
        let start = random.below(out.len());
        let end = (start + 1 + random.below(64)).min(out.len());
        match random.below(7) {
            0 => out[start] ^= 1 << random.below(8),
            1 => out[start] = random.bits() as u8,
            2 => out[start..end].fill(0),
            3 => out[start..end].iter_mut().for_each(|byte| *byte = random.bits() as u8),
            4 => drop(out.drain(start..end)),
            5 => drop(out.splice(start..start, out[start..end].to_vec())),
            _ => out.truncate(start),
        }
    }
    out
}

/// The largest memory that this process has had in use, in MB; 0 where it is not known.
fn peak_of_process() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    line.and_then(|line| line.trim().trim_end_matches(" kB").parse::<f64>().ok()).unwrap_or(0.0) / 1e3
}
