#!/usr/bin/env bash
# Runs the programs of this folder on talk.gss, each as its first line says, and looks at what they print and write.
# usage: examples/check.sh [FOLDER]
# FOLDER has the programs where they are compiled already, as the gate has them; otherwise they are compiled.
set -euo pipefail
programs=${1:+$(cd "$1" && pwd)}
cd "$(dirname "$0")"
if [ -z "$programs" ]; then
    cargo build --quiet --examples -p splatstream
    programs=${CARGO_TARGET_DIR:-../target}/debug/examples
fi
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT

wrong() {
    echo "examples/$1.rs: $2" >&2
    exit 1
}

# The numbers of the frames that a program printed, in a line.
frames() { sed -n 's/^frame \([0-9]*\):.*/\1/p' "$out/$1" | xargs; }

# The frames are those that are asked for.
has_frames() { [ "$(frames "$1")" = "$2" ] || wrong "$1" "frames $(frames "$1"), not $2"; }

declare -A ran
# Runs a program; what it prints goes to a file of its name.
run() {
    "$programs/$1" "${@:2}" >"$out/$1"
    ran[$1]=yes
}

run decode talk.gss
has_frames decode "$(seq -s ' ' 0 11)"
run push <talk.gss
has_frames push "$(seq -s ' ' 0 11)"
run seek talk.gss 5
has_frames seek '5 6 8 10'
run stable_slots talk.gss
has_frames stable_slots "$(seq -s ' ' 0 11)"
run encode "$out/talk.gss"
run extract "$out/talk.gss" s0,t0,r1 "$out/small.gss"
run decode "$out/small.gss"
has_frames decode '0 2 4 6 8 10'

for program in *.rs; do
    [ -n "${ran[${program%.rs}]:-}" ] || wrong "${program%.rs}" 'this script does not run it'
done
echo "${#ran[@]} examples"
