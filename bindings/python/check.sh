#!/usr/bin/env bash
# Builds the wheel, installs it in an environment that has nothing else of this tree, and there runs its tests, the examples
# and the types, the command, and the program of the README. Everything is made in target/python; with --release the wheel is the
# one to publish. Says what it skips where a tool cannot be had.
set -euo pipefail
cd "$(dirname "$0")"
mkdir -p "${CARGO_TARGET_DIR:=../../target}/python"
CARGO_TARGET_DIR=$(cd "$CARGO_TARGET_DIR" && pwd)
export CARGO_TARGET_DIR
built=$CARGO_TARGET_DIR/python
tools=$CARGO_TARGET_DIR/tools/python
python=${PYTHON:-python3}
profile=dev
[ "${1:-}" != --release ] || profile=release

# An environment in a folder with packages of a registry; fails where they cannot be had.
environment() {
    local folder=$1
    shift
    [ -x "$folder/bin/python" ] || "$python" -m venv "$folder"
    "$folder/bin/python" -m pip install --quiet --disable-pip-version-check "$@"
}

skipped() {
    echo "skipped: $*"
    exit 0
}

"$python" -c 'import sys, venv; sys.exit(sys.version_info < (3, 9))' 2>/dev/null ||
    skipped "the Python package, for which Python 3.9 or later with venv is not there"
environment "$tools" 'maturin>=1.9.4,<2' || skipped "the Python package, for which maturin cannot be had"
rm -rf "$built" && mkdir -p "$built"
"$tools/bin/maturin" build --quiet --locked --profile "$profile" --out "$built" --interpreter "$python"
wheel=("$built"/*.whl)
echo "${wheel[0]##*/}: $(stat -c %s "${wheel[0]}") bytes, profile $profile"

environment "$built/clean" "${wheel[0]}" 'pytest>=8,<10' || skipped "tests of the Python package, for which pytest and NumPy cannot be had"
installed=$built/clean/bin
# Not from the folder that has the sources beside it.
cp -r tests examples README.md ../../examples/talk.gss "$built"
cd "$built"
"$installed/splatstream" --version
"$installed/python" -m pytest --quiet -p no:cacheprovider tests

if environment "$built/clean" 'mypy>=1.18,<2' 'typing-extensions>=4.15' 'matplotlib>=3.9,<4'; then
    "$installed/mypy" --strict --no-incremental -p splatstream_codec
    "$installed/mypy" --strict --no-incremental tests/*.py examples/*.py
    "$installed/python" -m mypy.stubtest splatstream_codec._native
    MPLBACKEND=Agg "$installed/python" examples/show.py talk.gss pictures.png
    test -s pictures.png
else
    echo "skipped: types and the example with pictures, for which mypy and matplotlib cannot be had"
fi
