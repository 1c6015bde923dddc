//! The `splatstream` command as a program.

use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments: Vec<_> = std::env::args_os().collect();
    ExitCode::from(splatstream_cli::main(&arguments))
}
