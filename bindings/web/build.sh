#!/usr/bin/env bash
# Compiles the decoder for web pages: decoder/splatstream.wasm and, with the client for packages, splatstream-packages.wasm. Both
# have instructions of 128 bits and are kept in the repository, so that the commands `view` and `serve` need no target but their
# own; those with -plain, for engines without them, are made when the npm package is. The same sources and compiler give the same
# bytes on any machine: `build.sh --check` compares. `build.sh --plain` makes only those with -plain.
set -euo pipefail
cd "$(dirname "$0")"
target=wasm32-unknown-unknown
compiler=rustc-version.txt

if [ ! -d "$(rustc --print target-libdir --target "$target")" ]; then
    echo "the Rust target is not there: rustup target add $target" >&2
    exit 3
fi

# Compiles with or without packages, and with some flags, into a file. Paths of this machine do not get into it.
compile() {
    local file=$1 features=$2 registry flags=("${@:3}") separator=$'\x1f'
    for registry in "${CARGO_HOME:-$HOME/.cargo}"/registry/src/*/; do
        flags+=("--remap-path-prefix=${registry%/}=/registry")
    done
    flags+=("--remap-path-prefix=$(rustc --print sysroot)/lib/rustlib/src/rust=/rust" "--remap-path-prefix=$(cd ../.. && pwd)=/splatstream")
    (
        unset RUSTFLAGS
        CARGO_ENCODED_RUSTFLAGS=$(printf "%s$separator" "${flags[@]}")
        export CARGO_ENCODED_RUSTFLAGS=${CARGO_ENCODED_RUSTFLAGS%"$separator"}
        unset CARGO_PROFILE_RELEASE_DEBUG
        cargo build --quiet --locked --profile web -p splatstream-wasm --no-default-features --features "$features" --target "$target"
    )
    install -m 644 "${CARGO_TARGET_DIR:-../../target}/$target/web/splatstream_wasm.wasm" "$file"
}

if [ "${1:-}" = --check ]; then
    if [ "$(rustc --version)" != "$(cat "$compiler")" ]; then
        echo "skipped: comparing the modules, which $(cat "$compiler") has made; this is $(rustc --version)"
        exit
    fi
    fresh=$(mktemp)
    trap 'rm -f "$fresh"' EXIT
    for features in '' packages; do
        module=decoder/splatstream${features:+-$features}.wasm
        compile "$fresh" "$features" -Ctarget-feature=+simd128
        cmp "$fresh" "$module" || {
            echo "$module is not what the sources give: run bindings/web/build.sh and commit it" >&2
            exit 1
        }
    done
    exit
fi
for features in '' packages; do
    module=decoder/splatstream${features:+-$features}
    [ "${1:-}" = --plain ] || compile "$module.wasm" "$features" -Ctarget-feature=+simd128
    compile "$module-plain.wasm" "$features"
done
[ "${1:-}" = --plain ] || rustc --version >"$compiler"
