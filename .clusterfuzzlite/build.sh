#!/usr/bin/env bash
# Puts into $OUT, for each target, its program, its seeds and its dictionary, under the names that ClusterFuzzLite and
# OSS-Fuzz look for. $SRC/splatstream is this repository. With cargo-fuzz the program has the sanitizer that they ask
# for; without it, it is built as fuzz/smoke.sh builds it, and has none.
set -euo pipefail
cd "$SRC/splatstream/fuzz"
. ./engine.sh
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
built=${CARGO_TARGET_DIR:-$work/target}/fuzz

if cargo fuzz --version >/dev/null 2>&1; then
    cargo fuzz build -O -a --fuzz-dir . --target-dir "$built"
    program=$(find "$built" -path '*/release/splatstream-fuzz' -type f)
else
    build "$built"
fi
vectors_into "$work/vectors"
for target in "${targets[@]}"; do
    # The independent decoder needs Python and conformance/, which are not there when targets run.
    [ "$target" != oracle ] || continue
    # The name of the program chooses the target.
    cp "$program" "$OUT/$target"
    starts_of "$target" "$work/vectors"
    mkdir "$work/seeds"
    for start in "${starts[@]}"; do
        case $start in
            -dict=*) cp "${start#-dict=}" "$OUT/$target.dict" ;;
            # Names of seeds differ between folders, those of vectors between theirs.
            *) mkdir -p "$work/seeds/${start##*/}" && cp -R "$start/." "$work/seeds/${start##*/}" ;;
        esac
    done
    (cd "$work/seeds" && python3 -m zipfile -c "$OUT/${target}_seed_corpus.zip" ./*)
    rm -rf "$work/seeds"
    printf '[libfuzzer]\nmax_len = 8192\n' >"$OUT/$target.options"
done
