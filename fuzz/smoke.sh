#!/usr/bin/env bash
# Fuzzes one target on the stable toolchain, without cargo-fuzz.
# usage: fuzz/smoke.sh TARGET [SECONDS]        TARGET: units, payload, decode, scene
set -euo pipefail
cd "$(dirname "$0")"
target=$1
seconds=${2:-20}
build=${CARGO_TARGET_DIR:-../target}/fuzz
# What cargo-fuzz passes too: coverage counters, comparisons as hints, debug assertions.
export RUSTFLAGS="-Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4 \
-Cllvm-args=-sanitizer-coverage-inline-8bit-counters -Cllvm-args=-sanitizer-coverage-pc-table \
-Cllvm-args=-sanitizer-coverage-trace-compares -Ccodegen-units=1 --cfg fuzzing -Cdebug-assertions"
# An explicit target keeps the flags away from build scripts and procedural macros.
host=$(rustc -vV | sed -n 's/^host: //p')
cargo build --release --target "$host" --target-dir "$build" --bin "$target"
corpus=$build/corpus/$target
mkdir -p "$corpus" "$build/artifacts"
"$build/$host/release/$target" -max_total_time="$seconds" -rss_limit_mb=512 -malloc_limit_mb=64 -timeout=5 \
    -print_final_stats=1 -artifact_prefix="$build/artifacts/$target-" "$corpus" "seeds/$target"
