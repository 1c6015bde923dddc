# What smoke.sh and campaign.sh share: how the program is built on the stable toolchain, without cargo-fuzz, and how
# libFuzzer is run with it. Sourced with the working directory in fuzz/.

# As in src/targets.rs.
targets=(units headers payload entropy scene decode chunks extraction increments encode oracle)

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
    RUSTFLAGS=$flags cargo build --release --locked --target "$host" --target-dir "$1"
    program=$1/$host/release/splatstream-fuzz
}

# Puts the streams of the conformance vectors into a folder, an absolute path: those that are no longer than the longest input.
vectors_into() {
    rm -rf "$1"
    mkdir -p "$1"
    (cd ../conformance/vectors && find . -name in.gss -size -17b -print0 | xargs -0 cp --parents -t "$1" --)
}

# Sets `starts` to the folders that a target begins with; the second argument is that of the vectors, if any.
starts_of() {
    local folder
    starts=()
    for folder in "seeds/$1" "regressions/$1"; do
        if [ -d "$folder" ]; then starts+=("$folder"); fi
    done
    # A stream is an input of these targets as it is.
    case $1 in units | decode | chunks | extraction | oracle) starts+=(seeds/units ${2:+"$2"}) ;; esac
}
