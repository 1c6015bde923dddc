#!/usr/bin/env bash
# Compiles the programs in C against the static library, with AddressSanitizer where the compiler has it, and runs them.
set -euo pipefail
cd "$(dirname "$0")/../.."
mkdir -p "${CARGO_TARGET_DIR:=target}/c"
built=$(cd "$CARGO_TARGET_DIR" && pwd)
compiler=${CC:-cc}
if ! command -v "$compiler" >/dev/null; then
    echo "skipped: there is no C compiler"
    exit
fi
cargo build --release -p splatstream-c
flags=(-std=c99 -pedantic -Wall -Wextra -Werror -g -I bindings/c/include)
sanitizer=(-fsanitize=address,undefined -fno-sanitize-recover=all)
if ! "$compiler" "${sanitizer[@]}" -x c -o "$built/c/empty" - <<<'int main(void) { return 0; }' 2>/dev/null ||
    ! "$built/c/empty"; then
    echo "skipped: AddressSanitizer, which $compiler does not have; the programs run without"
    sanitizer=()
fi

compile() {
    # What the standard library of Rust needs: rustc --print native-static-libs.
    "$compiler" "${flags[@]}" "${sanitizer[@]}" "$1" "$built/release/libsplatstream_c.a" -lpthread -ldl -lm -o "$2"
}

if command -v "${CXX:-c++}" >/dev/null; then
    "${CXX:-c++}" -x c++ -fsyntax-only -Wall -Wextra -Werror bindings/c/include/splatstream.h
else
    echo "skipped: the header in C++, for which there is no compiler"
fi
compile bindings/c/examples/decode.c "$built/c/decode"
compile bindings/c/tests/interface.c "$built/c/interface"
"$built/c/decode" examples/talk.gss | tee "$built/c/frames"
"$built/c/interface" examples/talk.gss
