#!/usr/bin/env bash
# Fuzzes every target for a while from seeds, regressions and vectors, as many at a time as there are processors.
# usage: fuzz/smoke.sh [SECONDS] [TARGET...]        10 seconds, all targets
set -euo pipefail
seconds=${1:-10}
shift $(($# > 0 ? 1 : 0))
mkdir -p "${CARGO_TARGET_DIR:=$(dirname "$0")/../target}/fuzz"
built=$(cd "$CARGO_TARGET_DIR/fuzz" && pwd)
cd "$(dirname "$0")"
. ./engine.sh
[ $# -eq 0 ] || targets=("$@")

fuzz() {
    local target=$1 corpus=$built/corpus/$1 log=$built/$1.log vectors=$built/vectors
    if [ "$target" = oracle ]; then
        if ! command -v python3 >/dev/null; then
            echo "oracle: skipped, python3 is not there"
            return
        fi
        # All vectors take the independent decoder longer than this; it is given them elsewhere.
        vectors=
    fi
    mkdir -p "$corpus"
    starts_of "$target" "$vectors"
    FUZZ_TARGET=$target "$program" "${options[@]}" -timeout=10 -max_total_time="$seconds" \
        -artifact_prefix="$built/artifacts/$target-" "$corpus" "${starts[@]}" >"$log" 2>&1 ||
        { tail -n 60 "$log" >&2; return 1; }
    printf '%s: %s, %s executions\n' "$target" "$(grep -oE 'cov: [0-9]+ ft: [0-9]+ corp: [0-9]+' "$log" | tail -n 1)" \
        "$(sed -n 's/^stat::number_of_executed_units: *//p' "$log")"
}

build "$built"
mkdir -p "$built/artifacts"
heap_ends "$built/planted"
vectors_into "$built/vectors"
side_by_side "$(nproc)" fuzz "${targets[@]}"
