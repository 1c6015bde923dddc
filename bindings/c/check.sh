#!/usr/bin/env bash
# Compiles the programs in C against the static library, with AddressSanitizer where the compiler has it, and runs them;
# then decodes with the library for WebAssembly in Node.
# usage: bindings/c/check.sh [LIBRARY]
# LIBRARY is the static library where it is compiled already, as the gate has it; otherwise it is compiled for release.
set -euo pipefail
library=${1:+$(cd "$(dirname "$1")" && pwd)/$(basename "$1")}
cd "$(dirname "$0")/../.."
mkdir -p "${CARGO_TARGET_DIR:=target}/c"
built=$(cd "$CARGO_TARGET_DIR" && pwd)
compiler=${CC:-cc}
flags=(-std=c99 -pedantic -Wall -Wextra -Werror -g -I bindings/c/include)
sanitizer=(-fsanitize=address,undefined -fno-sanitize-recover=all)
stream=examples/talk.gss

has_sanitizer() {
    "$compiler" "${sanitizer[@]}" -x c -o "$built/c/empty" - <<<'int main(void) { return 0; }' 2>/dev/null &&
        "$built/c/empty"
}

compile() {
    # What the standard library of Rust needs: rustc --print native-static-libs.
    "$compiler" "${flags[@]}" "${sanitizer[@]}" "$1" "$library" -lpthread -ldl -lm -o "$2"
}

native() {
    if ! command -v "$compiler" >/dev/null; then
        echo "skipped: the programs in C, for which there is no compiler"
        return
    fi
    if ! has_sanitizer; then
        echo "skipped: AddressSanitizer, which $compiler does not have; the programs run without"
        sanitizer=()
    fi
    if [ -z "$library" ]; then
        cargo build --release -p splatstream-c
        library=$built/release/libsplatstream_c.a
    fi
    compile bindings/c/examples/decode.c "$built/c/decode"
    compile bindings/c/tests/interface.c "$built/c/interface"
    "$built/c/decode" "$stream" | tee "$built/c/frames"
    "$built/c/interface" "$stream"
}

header_in_cpp() {
    if ! command -v "${CXX:-c++}" >/dev/null; then
        echo "skipped: the header in C++, for which there is no compiler"
        return
    fi
    "${CXX:-c++}" -x c++ -fsyntax-only -Wall -Wextra -Werror bindings/c/include/splatstream.h
}

wasm() {
    local target=wasm32-unknown-unknown
    if ! command -v node >/dev/null; then
        echo "skipped: WebAssembly, for which Node is not there"
        return
    fi
    if [ ! -d "$(rustc --print target-libdir --target "$target")" ]; then
        echo "skipped: WebAssembly, for which the Rust target $target is not there"
        return
    fi
    cargo build --release -p splatstream-c --target "$target"
    # Players in pages read manifests.
    cargo check --release -p splatstream-stream --target "$target"
    node bindings/c/tests/wasm.mjs "$built/$target/release/splatstream_c.wasm" "$stream" >"$built/c/wasm-frames"
    # The same frames as from the native library, if that has run.
    [ ! -e "$built/c/frames" ] || diff <(cut -d, -f1 "$built/c/frames") "$built/c/wasm-frames"
}

rm -f "$built/c/frames"
native
header_in_cpp
wasm
