#!/usr/bin/env bash
# Makes the folder of the kit, as the README beside this has it, and the streams of the suites for fluster.
# usage: conformance/kit/assemble.sh FOLDER COMMAND ARCHIVE.zip URL
# COMMAND is the program `splatstream`; URL is where people will get ARCHIVE.zip, which is written.
set -euo pipefail
if [ $# -ne 4 ]; then
    sed -n '2,4s/^# //p' "$0" >&2
    exit 2
fi
mkdir -p "$1"
folder=$(cd "$1" && pwd) command=$(realpath "$2") archive=$(realpath -m "$3") url=$4
cd "$(dirname "$0")/../.."

for part in vectors packages schema adapters oracle VERSION MANIFEST LICENSE; do cp -r "conformance/$part" "$folder"; done
cp -r conformance/kit/runner conformance/kit/fluster conformance/kit/submit.py LICENSE-APACHE LICENSE-MIT "$folder"
cp "$command" "$folder/splatstream"
# Links of the repository, as seen from the folders of the kit.
pages=https://github.com/splatstream/splatstream/blob/main/conformance
cp conformance/README.md "$folder/SUITE.md"
sed -e 's#(\.\./adapters/#(adapters/#' -e "s#(\.\./results/#($pages/results/#" conformance/kit/README.md >"$folder/README.md"
sed -e 's#(\.\./README\.md#(../SUITE.md#' conformance/adapters/README.md >"$folder/adapters/README.md"
mkdir -p "$folder/spec"
cp -r spec/*.md spec/data spec/figures "$folder/spec"
sed -e 's#\[for print\]([^)]*)#for print, on the web site#' spec/index.md >"$folder/spec/index.md"
python3 conformance/kit/fluster/make.py conformance/vectors "$archive" "$folder/fluster/suites" --url "$url"
# Of no use without the repository.
rm -f "$folder"/oracle/test_*.py
find "$folder" -name __pycache__ -prune -exec rm -rf {} +
