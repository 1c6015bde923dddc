#!/usr/bin/env bash
# The modules for engines without instructions of 128 bits are compiled, and run in Node as if it were one. Says what it skips
# where a tool is not there.
set -euo pipefail
cd "$(dirname "$0")"
. ./tools.sh

status=0
./build.sh --plain || status=$?
[ $status -ne 3 ] || { echo "skipped: the modules for engines without vectors"; exit; }
[ $status -eq 0 ] || exit $status
if ! command -v node >/dev/null || ! packages wabt@1.0.39; then
    echo "skipped: running the modules for engines without vectors, for which Node is not there or npm cannot install WABT"
    exit
fi
command_line
ENGINES=$tools node --test tests/plain.test.mjs
