//! Runs the command as its users do. One program, since every one more is linked with all of the command's libraries.
#![allow(clippy::unwrap_used, clippy::print_stdout, missing_docs, reason = "a panic is a failed test")]

mod chart;
mod common;
mod conformance;
#[cfg(target_os = "linux")]
mod cycles;
mod demo;
mod dynamic;
mod errors;
mod exit_codes;
mod file_formats;
mod finetune_state;
mod fit;
mod inspect;
mod json_reports;
mod kept_inputs;
#[cfg(unix)]
mod live;
mod manual;
mod messages;
mod missing_units;
mod outputs;
mod packages;
mod parts;
mod pictures;
mod play;
#[cfg(unix)]
mod readme;
mod registered_network;
mod replaced;
mod round_trip;
#[cfg(unix)]
mod serve;
mod shards;
mod targets;
mod track;
mod unknown_length;
mod view;
