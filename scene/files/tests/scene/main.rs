//! Laws of the scene crate, and facts about real files.

#![expect(clippy::unwrap_used, reason = "a test that meets an error stops there")]

mod any_bytes;
mod bombs;
mod builtin;
mod gltf_files;
mod ksplat_files;
mod messages;
mod ply_variants;
mod real_files;
mod reductions;
mod round_trips;
mod samples;
mod sequences;
mod sog_variants;
mod spz_versions;
