#!/usr/bin/env bash
# Changes format and decoder in small ways, one at a time, and asks the vectors whether they notice: mutants.sh [COUNT
# [SEED]]. Tries those that mutants.csv does not have yet, and adds them to it. A mutant takes half a minute.
set -euo pipefail
cd "$(dirname "$0")/../.."
count=${1:-120} seed=${2:-1}
if ! command -v cargo-mutants >/dev/null; then
    echo "mutants.sh: cargo-mutants is not there: run 'cargo install cargo-mutants --locked'" >&2
    exit 1
fi
# Many small files are written: in memory if that can be had.
if [ -w /dev/shm ]; then export TMPDIR=/dev/shm; fi
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
packages=(-p splatstream-format -p splatstream-decoder)
cargo mutants --list --json "${packages[@]}" >"$out/all.json"
python3 conformance/coverage/mutants.py sample "$out/all.json" "$count" "$seed" >"$out/chosen"
if [ ! -s "$out/chosen" ]; then
    python3 conformance/coverage/mutants.py check
    exit
fi
# What a killed run has found so far counts too.
trap 'python3 conformance/coverage/mutants.py record "$out/mutants.out/outcomes.json"; rm -rf "$out"' EXIT
export CARGO_INCREMENTAL=1
# cargo-mutants would run the tests of the crates themselves before it starts.
cargo test -q -p splatstream-vectors
cargo mutants "${packages[@]}" --re "$(cat "$out/chosen")" --baseline skip --timeout 120 --jobs 1 --no-times \
    --output "$out" || true
