#!/usr/bin/env bash
# The modules for web pages are what the sources give; the packages and a page keep to their sizes; types fit; everything runs in
# Node and in Chromium, of which pictures stay in target/web. Says what it skips where a tool is not there.
set -euo pipefail
cd "$(dirname "$0")"
. ./tools.sh
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
        cargo test --quiet -p splatstream-format -p splatstream-decoder --lib --target $target -- entropy::machine motion:: moves::
}

sizes() {
    at_most 'the module' 750000 decoder/splatstream.wasm
    gzip -9c decoder/splatstream.wasm | at_most 'the module, compressed' 284500
    # A third more: reading manifests, boxes of files, and the control. Pages and streams do without it.
    at_most 'the module for packages' 1120000 decoder/splatstream-packages.wasm
    gzip -9c decoder/splatstream-packages.wasm | at_most 'the module for packages, compressed' 420000
    find player -name '*.js' ! -name spark.js ! -name playcanvas.js -exec cat {} + | at_most 'the player' 104000
    cat player/{playable,playcanvas,spark,texels}.js | at_most 'the adapters for engines' 24000
    "$SPLATSTREAM" demo --out "$WEB_TESTS/demo" >/dev/null
    at_most 'a page of the moving scene' 1000000 "$WEB_TESTS/demo/demo.html"
}

# What npm publishes has the text of the licences.
licences() {
    local package
    if ! command -v npm >/dev/null; then
        echo "skipped: what npm publishes, for which npm is not there"
        return
    fi
    for package in decoder player; do
        (cd "$package" && npm pack --silent --dry-run --json) |
            node -e 'const [{ files }] = JSON.parse(require("fs").readFileSync(0));
                process.exitCode = files.filter(({ path }) => path.startsWith("LICENSE-")).length === 2 ? 0 : 1' ||
            { echo "$package: npm would publish it without LICENSE-APACHE and LICENSE-MIT" >&2; exit 1; }
    done
}

# Programs that use the packages as npm installs them compile.
types() {
    local installed=$tools/node_modules/@splatstream programs=$tools/programs
    rm -rf "$installed" "$programs" && mkdir -p "$installed"
    cp -r decoder player "$installed"
    cp -r tests "$programs"
    "$tools/node_modules/.bin/tsc" --project "$programs"
}

wasm
command_line
if ! command -v node >/dev/null; then
    echo "skipped: the packages, for which Node is not there"
    exit
fi
vectors
node --test tests/node.test.mjs tests/package.test.mjs
sizes
licences
node tests/speed.mjs "$WEB_TESTS/scene/demo.gss"
if ! packages typescript@5.9.3 three@0.187.0 @types/three@0.187.0 @sparkjsdev/spark@2.2.0 playcanvas@2.23.3; then
    echo "skipped: types and the browser, for which npm cannot install TypeScript, Spark and PlayCanvas"
    exit
fi
types
if browser; then
    node --test --test-concurrency=1 tests/browser.test.mjs tests/packages.test.mjs tests/engines.test.mjs tests/readme.test.mjs
    node tests/first.mjs "$WEB_TESTS/long/demo.gss" "$WEB_TESTS/package"
fi
