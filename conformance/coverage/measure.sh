#!/usr/bin/env bash
# The numbers of coverage: measure.sh [--check] [PART...]. Parts are requirements, syntax, code, matrix and mutants; all of
# them if none is named. Writes the tables and the page of this folder; with --check demands that they are what would be
# written, or for code no more than is reached. SPLATSTREAM may name a program that is built already.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
cd "$here/../.."
check=
if [ "${1-}" = --check ]; then
    check=--check
    shift
fi
# Many small files are written: in memory if that can be had.
if [ -w /dev/shm ]; then export TMPDIR=/dev/shm; fi
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT

# A table that a script of the generator writes.
table() {
    cp "$here/$1.csv" "$out/$1.csv"
    python3 "conformance/generator/$2.py"
    if [ -n "$check" ] && ! cmp "$out/$1.csv" "$here/$1.csv"; then
        echo "$1.csv was out of date and has been written anew: commit it" >&2
        return 1
    fi
}

requirements() { table requirements requirements; }
syntax() { table syntax syntax_coverage; }
mutants() { python3 "$here/mutants.py" check; }

# A tool of LLVM, by its name or with the version of a distribution behind it.
llvm() {
    compgen -c "$1" | grep -E "^$1(-[0-9]+)?$" | sort -Vr | head -n 1
}

code() {
    local profdata cov test
    profdata=$(llvm llvm-profdata) cov=$(llvm llvm-cov)
    if [ -z "$profdata" ] || [ -z "$cov" ]; then
        echo "measure.sh: llvm-profdata and llvm-cov are not there: install llvm" >&2
        return 1
    fi
    test=$(RUSTC_WORKSPACE_WRAPPER=$here/counting_rustc.sh CARGO_INCREMENTAL=0 cargo test --no-run --message-format json \
        -p splatstream-vectors | sed -n 's/.*"executable":"\([^"]*\)".*/\1/p')
    LLVM_PROFILE_FILE=$out/%p.profraw "$test"
    "$profdata" merge -sparse "$out"/*.profraw -o "$out/all.profdata"
    export_as() {
        "$cov" export -format="$1" -skip-functions -instr-profile "$out/all.profdata" "$test" format/src decoder/src
    }
    export_as lcov >"$out/lines.info"
    export_as text >"$out/branches.json"
    # shellcheck disable=SC2086 # one option or none
    python3 "$here/code.py" "$out/lines.info" "$out/branches.json" $check
}

splatstream() {
    if [ -n "${SPLATSTREAM-}" ]; then "$SPLATSTREAM" "$@"; else cargo run -q --release -p splatstream-cli -- "$@"; fi
}

# The features, and what the first decoder does with them; not the day.
first_decoder() { grep -v '^| day ' "$1" | grep '^|' | cut -d '|' -f 2,3; }

matrix() {
    local python=conformance/adapters/python
    splatstream conformance run --report "$out/reference.json" >"$out/told"
    if [ -n "$check" ]; then
        splatstream conformance matrix "$out/reference.json" -o "$out/matrix.md" >>"$out/told"
        if ! diff <(first_decoder "$out/matrix.md") <(first_decoder "$here/matrix.md"); then
            echo "matrix.md is not what the vectors say: run measure.sh matrix and commit it" >&2
            return 1
        fi
        return
    fi
    splatstream conformance run --stdio "python3 $python/adapter.py --stdio" --capabilities "$python/capabilities.json" \
        --time 60 --report "$out/independent.json" >"$out/told"
    splatstream conformance matrix "$out/reference.json" "$out/independent.json" -o "$here/matrix.md"
}

if [ $# -eq 0 ]; then set -- requirements syntax code matrix mutants; fi
for part; do
    case $part in
    requirements | syntax | code | mutants | matrix) ;;
    *)
        echo "measure.sh: there is no part $part; parts are requirements, syntax, code, matrix, mutants" >&2
        exit 2
        ;;
    esac
    printf -- '-- %s\n' "$part"
    "$part"
done
