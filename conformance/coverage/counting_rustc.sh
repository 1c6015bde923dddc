#!/usr/bin/env bash
# The compiler as .ci/reports has cargo call it for the crates of this repository: the two that are measured, and those that
# contain instances of their generic functions, count what runs. All others are compiled as usual.
set -euo pipefail
case " $* " in
*" --crate-name splatstream_format "* | *" --crate-name splatstream_decoder "* | \
    *" --crate-name splatstream_conformance "* | *" --crate-name cases "* | *" --crate-name streams "*)
    # Counting branches is an unstable option of the compiler.
    export RUSTC_BOOTSTRAP=1
    exec "$@" -Cinstrument-coverage -Zcoverage-options=branch
    ;;
esac
exec "$@"
