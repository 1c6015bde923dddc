#!/usr/bin/env bash
# The modules for web pages are what the sources give; the packages and a page keep to their sizes; types fit; everything runs in
# Node and in Chromium, of which pictures stay in target/web. Says what it skips where a tool is not there.
set -euo pipefail
cd "$(dirname "$0")"
mkdir -p "${CARGO_TARGET_DIR:=../../target}/tools"
CARGO_TARGET_DIR=$(cd "$CARGO_TARGET_DIR" && pwd)
export CARGO_TARGET_DIR SPLATSTREAM=$CARGO_TARGET_DIR/release/splatstream WEB_TESTS=$CARGO_TARGET_DIR/web
tools=$CARGO_TARGET_DIR/tools/web
rm -rf "$WEB_TESTS" && mkdir "$WEB_TESTS"

# Bytes of a file, or of what is piped in, are at most so many.
at_most() {
    local bytes
    bytes=$(wc -c <"${3:-/dev/stdin}")
    [ "$bytes" -le "$2" ] || { echo "$1: $bytes bytes, $2 are allowed" >&2; exit 1; }
    echo "$1: $bytes bytes of $2"
}

wasm() {
    local status=0
    ./build.sh --check || status=$?
    [ $status -ne 3 ] || { echo "skipped: comparing the module with a fresh one"; return; }
    return $status
}

# The vectors of WebAssembly calculate as the portable ones do.
vectors() {
    local target=wasm32-wasip1
    if [ ! -d "$(rustc --print target-libdir --target $target)" ]; then
        echo "skipped: tests of vectors in WebAssembly, for which the Rust target is not there: rustup target add $target"
        return
    fi
    CARGO_ENCODED_RUSTFLAGS=-Ctarget-feature=+simd128 CARGO_TARGET_WASM32_WASIP1_RUNNER="node --no-warnings $PWD/tests/wasi.mjs" \
        cargo test --quiet -p splatstream-format --lib --target $target machine
}

sizes() {
    at_most 'the module' 920000 decoder/splatstream.wasm
    gzip -9c decoder/splatstream.wasm | at_most 'the module, compressed' 320000
    # A third more: reading manifests, boxes of files, and the control. Pages and streams do without it.
    at_most 'the module for packages' 1250000 decoder/splatstream-packages.wasm
    gzip -9c decoder/splatstream-packages.wasm | at_most 'the module for packages, compressed' 440000
    cat player/*.js | at_most 'the player' 100000
    "$SPLATSTREAM" demo --out "$WEB_TESTS/demo" >/dev/null
    at_most 'a page of the moving scene' 1000000 "$WEB_TESTS/demo/demo.html"
}

# npm packages of some names and versions, in $tools.
packages() {
    command -v npm >/dev/null && { [ -d "$tools/node_modules/playwright-core" ] ||
        npm install --silent --no-audit --no-fund --prefix "$tools" playwright-core@1.65.1 typescript@5.9.3; }
}

types() {
    "$tools/node_modules/.bin/tsc" --project tests
}

browser() {
    local chromium=${CHROMIUM:-}
    [ -n "$chromium" ] || chromium=$(command -v chromium || command -v chromium-browser || command -v google-chrome || true)
    if [ -z "$chromium" ]; then
        echo "skipped: Chromium is not there"
        return
    fi
    export CHROMIUM=$chromium PLAYWRIGHT=$tools/node_modules/playwright-core
    node --test tests/browser.test.mjs tests/packages.test.mjs
    node tests/first.mjs "$WEB_TESTS/long/demo.gss" "$WEB_TESTS/package"
}

wasm
cargo build --quiet --release -p splatstream-cli
if ! command -v node >/dev/null; then
    echo "skipped: the packages, for which Node is not there"
    exit
fi
vectors
node --test tests/node.test.mjs tests/package.test.mjs
sizes
node tests/speed.mjs "$WEB_TESTS/scene/demo.gss"
if ! packages; then
    echo "skipped: types and the browser, for which npm cannot install TypeScript and playwright-core"
    exit
fi
types
browser
