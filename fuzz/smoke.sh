#!/usr/bin/env bash
# Fuzzes one target on the stable toolchain, without cargo-fuzz.
# usage: fuzz/smoke.sh TARGET [SECONDS]        TARGET: units, payload, decode, increments, scene
set -euo pipefail
target=$1
seconds=${2:-20}
mkdir -p "${CARGO_TARGET_DIR:=$(dirname "$0")/../target}/fuzz"
build=$(cd "$CARGO_TARGET_DIR/fuzz" && pwd)
cd "$(dirname "$0")"
# What cargo-fuzz passes too: coverage counters, comparisons as hints, debug assertions.
export RUSTFLAGS="-Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4 \
-Cllvm-args=-sanitizer-coverage-inline-8bit-counters -Cllvm-args=-sanitizer-coverage-pc-table \
-Cllvm-args=-sanitizer-coverage-trace-compares -Ccodegen-units=1 --cfg fuzzing -Cdebug-assertions"
# An explicit target keeps the flags away from build scripts and procedural macros.
host=$(rustc -vV | sed -n 's/^host: //p')
cargo build --release --locked --target "$host" --target-dir "$build" --bin "$target"

corpus=$build/corpus/$target
log=$build/$target.log
mkdir -p "$corpus" "$build/artifacts" "regressions/$target"
starts=("$corpus" "seeds/$target" "regressions/$target")
# A stream is an input of this target too.
[ "$target" != decode ] || starts+=(seeds/units)
# The limit on single allocations is in src/ceiling.rs: -malloc_limit_mb needs a sanitizer, which stable lacks.
"$build/$host/release/$target" -max_total_time="$seconds" -max_len=8192 -rss_limit_mb=512 -timeout=10 \
    -print_final_stats=1 -artifact_prefix="$build/artifacts/$target-" "${starts[@]}" >"$log" 2>&1 ||
    { tail -n 60 "$log" >&2; exit 1; }
grep -oE 'cov: [0-9]+ ft: [0-9]+ corp: [0-9]+' "$log" | tail -n 1
grep -E 'number_of_executed_units|average_exec_per_sec|peak_rss_mb' "$log"
