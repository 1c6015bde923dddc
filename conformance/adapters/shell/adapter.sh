#!/bin/sh
# Wraps a decoder that has a command line of its own: adapter.sh IN OP MODE OUT
#
# The decoder here is conformance/oracle/decode.py, which writes one file a plane (fNNNN.pNN.i32le) and exits with the
# codes of clause 9.1. For another decoder change the two parts that say so.
set -eu
in=$1 op=$2 mode=$3 out=$4
here=$(CDPATH='' cd -- "$(dirname -- "$0")" && pwd)
planes=$(mktemp -d)
trap 'rm -rf "$planes"' EXIT

# 1. Run the decoder. What it says on standard error goes on; its last line may be the diagnosis. In mode `inside` the units
#    after sequence_parameters, which ends at byte 36 + its payload_length, start with some gop_header (B.3).
options=''
[ "$mode" = subset ] && options=--subset
[ "$mode" = inside ] && options="--inside $((36 + $(od -An -tu4 -j28 -N4 "$in")))"
code=0
# shellcheck disable=SC2086 # two words or none
python3 "$here/../../oracle/decode.py" "$in" --op "$op" --out "$planes" $options >/dev/null || code=$?
# Where a decoder has exit codes of its own, translate them:
# 0 accept, 10 malformed, 11 invalid, 12 unsupported, 13 over a limit, 14 truncated; all else is a crash.
case $code in 0 | 10 | 11 | 12 | 13 | 14) ;; *) exit 1 ;; esac

# 2. Make the files of the protocol: the planes of an attribute one after the other, i32 little-endian.
put() { # attribute, then numbers of planes
    attribute=$1
    shift
    target=$out/$frame.$attribute.i32
    : >"$target"
    for plane in "$@"; do
        cat "$planes/$frame.p$plane.i32le" >>"$target"
    done
}
for first in "$planes"/f*.p00.i32le; do
    [ -e "$first" ] || continue
    frame=$(basename "$first" .p00.i32le)
    put position 00 01 02
    put log_scale 03 04 05
    put opacity 06
    put rotation 07 08 09
    put dc 10 11 12
    # Planes 13 and after: there if the sequence has spherical harmonics.
    if [ -e "$planes/$frame.p13.i32le" ]; then
        for plane in "$planes/$frame".p1[3-9].i32le "$planes/$frame".p[2-9][0-9].i32le; do
            [ -e "$plane" ] && cat "$plane" >>"$out/$frame.sh.i32"
        done
    fi
done
exit "$code"
