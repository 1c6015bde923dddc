#!/usr/bin/env bash
# Compiles the decoder for web pages: decoder/splatstream.wasm, with instructions of 128 bits, is kept in the repository, so
# that the command `view` needs no target but its own; decoder/splatstream-plain.wasm, for engines without them, is made when
# the npm package is. The same sources and compiler give the same bytes on any machine: `build.sh --check` compares.
set -euo pipefail
cd "$(dirname "$0")"
target=wasm32-unknown-unknown
compiler=rustc-version.txt

if [ ! -d "$(rustc --print target-libdir --target "$target")" ]; then
    echo "the Rust target is not there: rustup target add $target" >&2
    exit 3
fi

# Compiles with some flags into a file. Paths of this machine do not get into it.
compile() {
    local file=$1 registry flags=("${@:2}") separator=$'\x1f'
    for registry in "${CARGO_HOME:-$HOME/.cargo}"/registry/src/*/; do
        flags+=("--remap-path-prefix=${registry%/}=/registry")
    done
    flags+=("--remap-path-prefix=$(rustc --print sysroot)/lib/rustlib/src/rust=/rust" "--remap-path-prefix=$(cd ../.. && pwd)=/splatstream")
    (
        unset RUSTFLAGS
        CARGO_ENCODED_RUSTFLAGS=$(printf "%s$separator" "${flags[@]}")
        export CARGO_ENCODED_RUSTFLAGS=${CARGO_ENCODED_RUSTFLAGS%"$separator"}
        unset CARGO_PROFILE_RELEASE_DEBUG
        cargo build --quiet --locked --profile web -p splatstream-wasm --target "$target"
    )
    install -m 644 "${CARGO_TARGET_DIR:-../../target}/$target/web/splatstream_wasm.wasm" "$file"
}

if [ "${1:-}" = --check ]; then
    if [ "$(rustc --version)" != "$(cat "$compiler")" ]; then
        echo "skipped: comparing decoder/splatstream.wasm, which $(cat "$compiler") has made; this is $(rustc --version)"
        exit
    fi
    fresh=$(mktemp)
    trap 'rm -f "$fresh"' EXIT
    compile "$fresh" -Ctarget-feature=+simd128
    cmp "$fresh" decoder/splatstream.wasm || {
        echo "decoder/splatstream.wasm is not what the sources give: run bindings/web/build.sh and commit it" >&2
        exit 1
    }
    exit
fi
compile decoder/splatstream.wasm -Ctarget-feature=+simd128
compile decoder/splatstream-plain.wasm
rustc --version >"$compiler"
