# What .ci/run and .ci/nightly have in common: how steps run, and the tools and folders that they have. Sourced in the root of
# the repository.
export CARGO_TERM_COLOR=never INSTA_UPDATE=no
# Blessed files are compared, never written.
unset BLESS
# Nothing is built twice here: what rebuilding would save only fills the disk.
export CARGO_INCREMENTAL=0
# Nor does anybody look at line numbers here but those of panics, which are there without.
export CARGO_PROFILE_DEV_DEBUG=false CARGO_PROFILE_RELEASE_DEBUG=false CARGO_PROFILE_FUZZ_DEBUG=false
mkdir -p "${CARGO_TARGET_DIR:=target}"
CARGO_TARGET_DIR=$(cd "$CARGO_TARGET_DIR" && pwd)
export CARGO_TARGET_DIR
tools=$CARGO_TARGET_DIR/tools PATH=$CARGO_TARGET_DIR/tools/bin:$PATH
trap 'printf -- "-- failed after %s s\n" "$SECONDS" >&2' ERR

# Tests make and remove files by the ten thousand, which costs some file systems more than decoding: temporary files are in
# memory where it has room for them.
in_memory=/dev/shm
if [ -z "${TMPDIR:-}" ] && [ -w "$in_memory" ] && [ "$(df --output=avail --block-size=1M "$in_memory" | tail -n 1)" -gt 4096 ]; then
    TMPDIR=$(mktemp -d "$in_memory/splatstream-XXXXXX")
    export TMPDIR
fi

# What runs beside the steps is ended with them, and what it left is removed.
clean_up() {
    local jobs
    jobs=$(jobs -p)
    [ -z "$jobs" ] || kill $jobs 2>/dev/null || true
    [[ ${TMPDIR:-} != "$in_memory"/splatstream-* ]] || rm -rf "$TMPDIR"
}
trap clean_up EXIT

# Runs a step and says what it took: on the clock, and of all processors. What runs beside steps counts where it ends.
step() {
    local TIMEFORMAT="-- $1: %0R s, %0U s of processors"
    printf '\n== %s\n' "$1"
    shift
    time "$@"
}

# Installs a tool of a version where it is not there, in a folder for compiling of its own: builds of the tree go on meanwhile.
tool() {
    command -v "$1" >/dev/null ||
        cargo install "$1" --version "$2" --locked --debug --no-default-features "${@:3}" --root "$tools" --target-dir "$tools/build"
}

# What later steps use and a machine may lack, where it can be had: targets of the compiler, a browser. Steps say what they
# skip without.
machine() {
    local targets=(wasm32-unknown-unknown wasm32-wasip1)
    if command -v rustup >/dev/null && ! rustup target add "${targets[@]}"; then
        echo "skipped: the targets ${targets[*]} cannot be had"
    fi
    if command -v chromium chromium-browser google-chrome >/dev/null || ! command -v apt-get >/dev/null || [ "$(id -u)" -ne 0 ]; then
        return
    fi
    if ! { apt-get install -qq -y chromium || { apt-get update -qq && apt-get install -qq -y chromium; }; } >/dev/null 2>&1; then
        echo "skipped: Chromium cannot be had"
    fi
}
