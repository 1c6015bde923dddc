#!/usr/bin/env bash
# Makes target/spec/splatstream-VERSION.pdf from the Markdown of this folder. Needs Python 3.10 or newer; Typst and a
# Markdown parser come from PyPI into target/tools/pdf. Ends with 3, and says why, if they cannot be had.
set -euo pipefail
cd "$(dirname "$0")/.."
tools=${CARGO_TARGET_DIR:-target}/tools/pdf

without() {
    echo "skipped: no PDF of the specification, $1" >&2
    exit 3
}

command -v python3 >/dev/null || without "python3 is not there"
python3 -c 'import sys; sys.exit(sys.version_info < (3, 10))' || without "python3 is older than 3.10"
if ! "$tools/bin/python" -c 'import markdown_it, typst' 2>/dev/null; then
    # No cache of pip's: the packages are in the folder of tools already.
    { python3 -m venv "$tools" && "$tools/bin/pip" install --quiet --no-cache-dir --disable-pip-version-check \
        typst==0.15.2 markdown-it-py==4.3.0; } || without "typst could not be installed into $tools"
fi
mkdir -p target/spec
"$tools/bin/python" spec/pdf/build.py target/spec
