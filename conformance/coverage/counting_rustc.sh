#!/usr/bin/env bash
# The compiler as measure.sh has cargo call it for the crates of this repository: the two that are measured, and those in
# which generic functions of them end up, count what runs. All else is compiled as ever, so that it is there already.
set -euo pipefail
case " $* " in
*" --crate-name splatstream_format "* | *" --crate-name splatstream_decoder "* | \
    *" --crate-name splatstream_conformance "* | *" --crate-name vectors "*)
    # Branches are counted behind an option that a stable compiler has to be told to take.
    export RUSTC_BOOTSTRAP=1
    exec "$@" -Cinstrument-coverage -Zcoverage-options=branch
    ;;
esac
exec "$@"
