#!/usr/bin/env python3
"""What the vectors run of the crates format and decoder: code.py EXPORT.json, which llvm-cov wrote. Writes code.csv, a row a file."""

import csv
import json
import os
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
MEASURES = ("lines", "branches")


def rows_of(export):
    """(file, lines, lines that ran, branches, branches that ran) of each file, and of all."""
    data = export["data"][0]
    for file in sorted(data["files"], key=lambda file: file["filename"]):
        yield [os.path.relpath(file["filename"], ROOT), *counts(file["summary"])]
    yield ["all", *counts(data["totals"])]


def counts(summary):
    return [summary[measure][key] for measure in MEASURES for key in ("count", "covered")]


def main():
    with open(sys.argv[1], encoding="utf-8") as f:
        rows = list(rows_of(json.load(f)))
    with open(os.path.join(HERE, "code.csv"), "w", encoding="utf-8", newline="") as f:
        out = csv.writer(f, lineterminator="\n")
        out.writerow(("file", "lines", "lines run", "branches", "branches run"))
        out.writerows(rows)
    _, lines, lines_run, branches, branches_run = rows[-1]
    print("the vectors run %.1f %% of the lines and %.1f %% of the branches" % (
        100 * lines_run / lines, 100 * branches_run / branches))


if __name__ == "__main__":
    main()
