# What smoke.sh and campaign.sh share: how the program is built on the stable toolchain, without cargo-fuzz, and how
# libFuzzer is run with it. Sourced with the working directory in fuzz/.

# As in src/targets.rs.
targets=(units records entropy packages scene decode cost synthetic encode oracle)

# Options of every run. The limit on single allocations is in src/ceiling.rs: -malloc_limit_mb needs a sanitizer,
# which stable lacks.
options=(-max_len=8192 -rss_limit_mb=512 -print_final_stats=1)

# Builds into a folder, and sets `program` to the program that holds all targets.
build() {
    local flags host
    # What cargo-fuzz passes too: coverage counters, comparisons as hints, debug assertions.
    flags="-Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4 \
-Cllvm-args=-sanitizer-coverage-inline-8bit-counters -Cllvm-args=-sanitizer-coverage-pc-table \
-Cllvm-args=-sanitizer-coverage-trace-compares -Ccodegen-units=1 --cfg fuzzing -Cdebug-assertions"
    # An explicit target keeps the flags away from build scripts and procedural macros.
    host=$(rustc -vV | sed -n 's/^host: //p')
    RUSTFLAGS=$flags cargo build --profile fuzz -p splatstream-fuzz --locked --target "$host" --target-dir "$1"
    program=$1/$host/fuzz/splatstream-fuzz
}

# Puts the streams of the conformance vectors into a folder, an absolute path: those that are no longer than the longest input.
vectors_into() {
    rm -rf "$1"
    mkdir -p "$1"
    (cd ../conformance/vectors && find . -name in.gss -size -17b -print0 | xargs -0 cp --parents -t "$1" --)
}

# Whether a request of 1 MiB is granted, and one of 64 MiB and a byte ends the program: without that the limit of
# src/ceiling.rs would find nothing. The file given is written; the count in it is what is asked for.
heap_ends() {
    local planted=(env FUZZ_TARGET=planted "$program" "$1")
    printf '\x00\x00\x10\x00' >"$1"
    "${planted[@]}" >/dev/null 2>&1
    printf '\x01\x00\x00\x04' >"$1"
    if "${planted[@]}" >/dev/null 2>&1; then
        echo "a request for more than 64 MiB is granted: see src/ceiling.rs" >&2
        return 1
    fi
}

# Runs a command on each of the arguments that follow, so many at a time; fails if one of them does.
side_by_side() {
    local most=$1 command=$2 running=0 failed=0 argument
    shift 2
    for argument; do
        "$command" "$argument" &
        running=$((running + 1))
        if [ "$running" -ge "$most" ]; then
            wait -n || failed=1
            running=$((running - 1))
        fi
    done
    while [ "$running" -gt 0 ]; do
        wait -n || failed=1
        running=$((running - 1))
    done
    return "$failed"
}

# Sets `starts` to what a target begins with: its dictionary, and folders; the second argument is that of the vectors,
# if any.
starts_of() {
    local folder
    case $1 in
        units | records | decode | cost | oracle) starts=(-dict=dictionaries/stream.dict) ;;
        scene) starts=(-dict=dictionaries/scene.dict) ;;
        *) starts=() ;;
    esac
    for folder in "seeds/$1" "regressions/$1"; do
        if [ -d "$folder" ]; then starts+=("$folder"); fi
    done
    # A stream is an input of these targets as it is.
    case $1 in units | decode | oracle) starts+=(seeds/units ${2:+"$2"}) ;; esac
}
