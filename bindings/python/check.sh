#!/usr/bin/env bash
# Builds the wheel, installs it in an environment that has nothing else of this tree, and there runs its tests, the examples
# and the types, the command, and the program of the README. Everything is made in target/python. Says what it skips where a
# tool cannot be had.
# usage: bindings/python/check.sh [--release | --module FILE]
#   --release   the wheel is the one to publish
#   --module    FILE is the compiled module, which is put beside the sources; no wheel is built. The gate has compiled the module
#               with everything else, and a wheel would compile all libraries again
set -euo pipefail
cd "$(dirname "$0")"
mkdir -p "${CARGO_TARGET_DIR:=../../target}/python"
CARGO_TARGET_DIR=$(cd "$CARGO_TARGET_DIR" && pwd)
export CARGO_TARGET_DIR
built=$CARGO_TARGET_DIR/python
tools=$CARGO_TARGET_DIR/tools/python
python=${PYTHON:-python3}
profile=dev module=
case ${1:-} in
    '') ;;
    --release) profile=release ;;
    --module) module=$(cd "$(dirname "$2")" && pwd)/$(basename "$2") ;;
    *) sed -n '5,9s/^# //p' "$0" >&2; exit 2 ;;
esac

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
rm -rf "$built" && mkdir -p "$built"

# Sets `package` to the wheel.
build_wheel() {
    environment "$tools" 'maturin>=1.9.4,<2' || skipped "the Python package, for which maturin cannot be had"
    "$tools/bin/maturin" build --quiet --locked --profile "$profile" --out "$built" --interpreter "$python"
    local wheels=("$built"/*.whl)
    package=${wheels[0]}
    echo "${package##*/}: $(stat -c %s "$package") bytes, profile $profile"
}

# Installs the sources with the module in an environment that has what the wheel asks for.
install_module() {
    local packages
    packages=$("$built/clean/bin/python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')
    cp -r python/splatstream_codec "$packages"
    cp "$module" "$packages/splatstream_codec/_native.abi3.so"
    printf '#!/bin/sh\nexec "%s/python" -m splatstream_codec "$@"\n' "$built/clean/bin" >"$built/clean/bin/splatstream"
    chmod +x "$built/clean/bin/splatstream"
}

package='numpy>=1.22'
[ -n "$module" ] || build_wheel
environment "$built/clean" "$package" 'pytest>=8,<10' || skipped "tests of the Python package, for which pytest and NumPy cannot be had"
[ -z "$module" ] || install_module
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
