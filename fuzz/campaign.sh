#!/usr/bin/env bash
# Fuzzes targets for so many seconds of processor time each, and adds up what all campaigns of a folder did.
# usage: fuzz/campaign.sh [-r] [-s SECONDS] [-j JOBS] [-d FOLDER] [TARGET...]
#   -s  processor time a target gets, seconds (600)      -j  targets at a time (1)
#   -d  where programs, corpora, findings and results are kept (target/campaign)
#   -r  only show what was done so far
# Without a target: all. Results are in FOLDER/results.json and, as a table, on standard output.
# Time is what the fuzzing process and its children used: a busy machine makes a campaign longer, not its figures better.
set -euo pipefail
seconds=600 jobs=1 folder= only_report=
while getopts rs:j:d: option; do
    case $option in
        r) only_report=yes ;;
        s) seconds=$OPTARG ;;
        j) jobs=$OPTARG ;;
        d) folder=$OPTARG ;;
        *) sed -n '2,8s/^# //p' "$0" >&2; exit 2 ;;
    esac
done
shift $((OPTIND - 1))
mkdir -p "${CARGO_TARGET_DIR:=$(dirname "$0")/../target}/fuzz" "${folder:=$CARGO_TARGET_DIR/campaign}"
built=$(cd "$CARGO_TARGET_DIR/fuzz" && pwd)
folder=$(cd "$folder" && pwd)
cd "$(dirname "$0")"
. ./engine.sh
[ $# -eq 0 ] || targets=("$@")

# A target that fails at once is not run for ever.
most_findings=20
# Seconds by the clock, and so many more than an input takes: other work may come first.
timeout=-timeout=300
ticks=$(getconf CLK_TCK)

# Processor time of a process and its children so far, in hundredths of a second; nothing once it has ended.
hundredths_of() {
    local children=
    { read -r children <"/proc/$1/task/$1/children"; } 2>/dev/null || true
    # Behind the name, which is in brackets, the 12th and 13th fields are user and system time.
    for process in "$1" $children; do sed 's/.*) //' "/proc/$process/stat" 2>/dev/null || true; done |
        awk -v ticks="$ticks" '{ sum += $12 + $13 } END { if (NR) printf "%d", sum * 100 / ticks }'
}

final() { sed -n "s/^stat::$2: *//p" "$1"; }

# Runs a target until its time is used up or something is found; adds to executions, used and peak of the caller.
once() {
    local target=$1 left=$2 log=$3 pid now spent=0 status=0 count rss
    "$folder/programs/$target" "${options[@]}" "$timeout" -artifact_prefix="$folder/findings/$target-" \
        "$folder/corpus/$target" "${starts[@]}" >"$log" 2>&1 &
    pid=$!
    while now=$(hundredths_of "$pid"); [ -n "$now" ]; do
        spent=$now
        if [ "$spent" -ge "$left" ]; then
            # Statistics are printed, then it exits.
            kill -INT "$pid" 2>/dev/null || true
            break
        fi
        sleep 1
        if ! kill -0 "$pid" 2>/dev/null; then break; fi
    done
    wait "$pid" || status=$?
    count=$(final "$log" number_of_executed_units) rss=$(final "$log" peak_rss_mb)
    executions=$((executions + ${count:-0}))
    used=$((used + spent))
    if [ "${rss:-0}" -gt "$peak" ]; then peak=$rss; fi
    # 72 is how libFuzzer ends when interrupted.
    [ "$status" -eq 72 ]
}

# Keeps of a corpus what adds to its coverage; prints edges and features.
minimise() {
    local target=$1 corpus=$folder/corpus/$1 log=$folder/logs/$1-merge.log
    rm -rf "$corpus.least"
    mkdir "$corpus.least"
    "$folder/programs/$target" "${options[@]}" "$timeout" -merge=1 "$corpus.least" "$corpus" "${starts[@]}" >"$log" 2>&1
    rm -rf "$corpus"
    mv "$corpus.least" "$corpus"
    sed -n 's/.*MERGE-OUTER: [0-9]* new files with \([0-9]*\) new features added; \([0-9]*\) new coverage edges.*/\2 \1/p' "$log"
}

fuzz() {
    local target=$1 executions=0 used=0 peak=0 found=0 wanted=$((seconds * 100)) covered files bytes
    starts_of "$target" "$folder/vectors"
    mkdir -p "$folder/corpus/$target"
    while [ "$used" -lt "$wanted" ] && [ "$found" -lt "$most_findings" ]; do
        if ! once "$target" $((wanted - used)) "$folder/logs/$target-$found.log"; then
            found=$((found + 1))
            printf '%s: %s\n' "$target" "$(grep -aE 'panicked|ERROR: libFuzzer|Test unit written' "$folder/logs/$target-$((found - 1)).log" | tail -n 3 | tr '\n' ' ')" >&2
        fi
    done
    covered=$(minimise "$target")
    files=$(find "$folder/corpus/$target" -type f | wc -l)
    bytes=$(find "$folder/corpus/$target" -type f -printf '%s\n' | awk '{ sum += $1 } END { print sum + 0 }')
    # One line, so that campaigns running side by side do not mix.
    printf '%s\n' "$target $executions $used ${covered:-0 0} $files $bytes $peak $found" >>"$folder/runs.txt"
}

# Sums of executions, time and findings; the greatest memory; of coverage and corpus what the last run left.
sums() {
    awk '
        !($1 in runs) { order[++count] = $1 }
        {
            runs[$1]++; executions[$1] += $2; used[$1] += $3 / 100; found[$1] += $9
            edges[$1] = $4; features[$1] = $5; files[$1] = $6; bytes[$1] = $7
            if ($8 > peak[$1]) peak[$1] = $8
        }
        END {
            for (i = 1; i <= count; i++) {
                t = order[i]
                printf "%s %d %d %.1f %.1f %d %d %d %d %d %d\n", t, runs[t], executions[t], used[t], \
                    (used[t] ? executions[t] / used[t] : 0), edges[t], features[t], files[t], bytes[t], peak[t], found[t]
            }
        }' "$folder/runs.txt"
}

report() {
    sums | awk '
        BEGIN { print "{\"targets\": [" }
        {
            printf "%s  {\"target\": \"%s\", \"runs\": %s, \"executions\": %s, ", (NR > 1 ? ",\n" : ""), $1, $2, $3
            printf "\"cpu_seconds\": %s, \"executions_per_second\": %s, ", $4, $5
            printf "\"edges\": %s, \"features\": %s, \"corpus_files\": %s, \"corpus_bytes\": %s, ", $6, $7, $8, $9
            printf "\"peak_rss_mb\": %s, \"findings\": %s}", $10, $11
            executions += $3; used += $4; found += $11
        }
        END { printf "\n], \"executions\": %d, \"cpu_hours\": %.2f, \"findings\": %d}\n", executions, used / 3600, found }
    ' >"$folder/results.json.new"
    mv "$folder/results.json.new" "$folder/results.json"
    sums | awk '
        BEGIN {
            print "| Target | Executions | CPU s | Exec/s | Edges | Features | Corpus files | Corpus bytes | Peak RSS, MB | Findings |"
            print "|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|"
        }
        {
            printf "| %s | %d | %.0f | %.0f | %d | %d | %d | %d | %d | %d |\n", $1, $3, $4, $5, $6, $7, $8, $9, $10, $11
            executions += $3; used += $4; found += $11
        }
        END { printf "\n%d executions in %.2f CPU-hours, %d findings\n", executions, used / 3600, found }'
}

if [ -n "$only_report" ]; then
    report
    exit
fi
build "$built"
mkdir -p "$folder"/{programs,corpus,findings,logs}
# Copies: another build does not change what is running.
for target in "${targets[@]}"; do
    cp "$program" "$folder/programs/$target.new"
    mv "$folder/programs/$target.new" "$folder/programs/$target"
done
heap_ends "$folder/planted"
vectors_into "$folder/vectors"
side_by_side "$jobs" fuzz "${targets[@]}"
report
