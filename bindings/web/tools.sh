# What check.sh, picture.sh and site.sh have in common: folders, npm packages and Chromium. It is sourced.
web=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
mkdir -p "${CARGO_TARGET_DIR:=$web/../../target}/tools"
CARGO_TARGET_DIR=$(cd "$CARGO_TARGET_DIR" && pwd)
export CARGO_TARGET_DIR WEB_TESTS=$CARGO_TARGET_DIR/web
tools=$CARGO_TARGET_DIR/tools/web

# The command that SPLATSTREAM names, or a release build.
command_line() {
    [ -z "${SPLATSTREAM:-}" ] || return 0
    cargo build --quiet --release -p splatstream-cli
    export SPLATSTREAM=$CARGO_TARGET_DIR/release/splatstream
}

# npm packages of some names and versions, in $tools; fails where npm cannot install them.
packages() {
    local package missing=()
    for package in "$@"; do
        [ -d "$tools/node_modules/${package%@*}" ] || missing+=("$package")
    done
    [ ${#missing[@]} -eq 0 ] || { command -v npm >/dev/null && npm install --silent --no-audit --no-fund --prefix "$tools" "${missing[@]}"; }
}

# Finds Chromium and installs what drives it; fails, and says why, where one of them cannot be had.
browser() {
    local found=${CHROMIUM:-}
    [ -n "$found" ] || found=$(type -P chromium || type -P chromium-browser || type -P google-chrome || true)
    [ -n "$found" ] || { echo "skipped: Chromium is not there" && return 1; }
    packages playwright-core@1.65.1 || { echo "skipped: npm cannot install playwright-core" && return 1; }
    export CHROMIUM=$found PLAYWRIGHT=$tools/node_modules/playwright-core ENGINES=$tools
}
