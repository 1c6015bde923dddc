#!/usr/bin/env bash
# Whether fuzzing reaches: plants an unchecked bound in each reader of scene files and in the decoder, and says how soon
# each is found, in processor time of one core, starting from the seeds of that reader alone.
# usage: fuzz/planted.sh [-k] [-s SECONDS] [-n TIMES] [FAULT...]
#   -k  keep the program that the last call has built
#   -s  processor time after which a fault counts as not found, seconds (120)
#   -n  how often each is sought, each time with other random numbers (1)
# Faults are the patches in planted/: each makes a panic of an error of input, where PLANTED names it. They are applied to a
# copy of the tree, in CARGO_TARGET_DIR/planted.
set -euo pipefail
seconds=120 times=1 keep=
while getopts ks:n: option; do
    case $option in
        k) keep=yes ;;
        s) seconds=$OPTARG ;;
        n) times=$OPTARG ;;
        *) sed -n '2,9s/^# //p' "$0" >&2; exit 2 ;;
    esac
done
shift $((OPTIND - 1))
mkdir -p "${CARGO_TARGET_DIR:=$(dirname "$0")/../target}/planted"
built=$(cd "$CARGO_TARGET_DIR/planted" && pwd)
cd "$(dirname "$0")"
. ./engine.sh
faults=()
for patch in planted/*.patch; do
    patch=${patch#planted/}
    faults+=("${patch%.patch}")
done
chosen=("${faults[@]}")
[ $# -eq 0 ] || chosen=("$@")

# A copy of the tree with all faults, and the program made of it. Files that are as in the last copy keep its times, so that
# they are not compiled again.
plant() {
    local fault file new=$built/tree.new old=$built/tree
    rm -rf "$new"
    mkdir -p "$new"
    (cd .. && git ls-files -z --cached --others --exclude-standard | tar -c --null --files-from - --ignore-failed-read) |
        tar -x -C "$new"
    for fault in "${faults[@]}"; do
        # It is not in the repository around it.
        (cd "$new" && GIT_CEILING_DIRECTORIES=$built git apply "fuzz/planted/$fault.patch")
    done
    (cd "$new" && find . -type f -print0) | while IFS= read -r -d '' file; do
        if cmp -s "$old/$file" "$new/$file"; then touch -r "$old/$file" "$new/$file"; else touch "$new/$file"; fi
    done
    rm -rf "$old"
    mv "$new" "$old"
    cd "$old/fuzz"
    build "$built/target"
    cd - >/dev/null
    echo "$program" >"$built/program"
}

# Seeks a fault; prints what it took.
seek() {
    local fault=$1 random=$2 target=scene folder=$built/$1 log=$built/$1-$2.log spent executions
    if [ "$fault" = decode ]; then target=decode; fi
    rm -rf "$folder"
    mkdir -p "$folder/corpus"
    starts_of "$target"
    if [ "$target" = scene ]; then
        # Of this reader only: its target shares its time among all of them.
        mkdir "$folder/seeds"
        for seed in seeds/scene/{,packed-}"${fault%%-[gz]*}"{,-*}.bin; do
            if [ -e "$seed" ]; then cp "$seed" "$folder/seeds"; fi
        done
        starts=(-dict=dictionaries/scene.dict "$folder/seeds")
    fi
    # The limit is of time on the clock: more than enough where other work takes most of the processor.
    TIMEFORMAT='%U %S'
    { time PLANTED=$fault FUZZ_TARGET=$target "$program" "${options[@]}" -timeout=60 -seed="$random" \
        -max_total_time=$((seconds * 5)) -artifact_prefix="$folder/" "$folder/corpus" "${starts[@]}" \
        >"$log" 2>&1 || true; } 2>"$folder/time"
    spent=$(awk '{ printf "%.1f", $1 + $2 }' "$folder/time")
    executions=$(sed -n 's/^stat::number_of_executed_units: *//p' "$log")
    if grep -aq "planted: $fault" "$log" && awk "BEGIN { exit !($spent <= $seconds) }"; then
        echo "| $fault | $random | $spent | $executions |"
    else
        echo "| $fault | $random | not found in $spent | $executions |"
        return 1
    fi
}

if [ -n "$keep" ]; then program=$(<"$built/program"); else plant; fi
echo '| Fault | Random numbers | CPU s | Executions |'
echo '|---|--:|--:|--:|'
failed=0
for fault in "${chosen[@]}"; do
    for random in $(seq "$times"); do
        seek "$fault" "$random" || failed=1
    done
done
exit "$failed"
