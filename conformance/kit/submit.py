#!/usr/bin/env python3
"""Makes a result for conformance/results from the report of a run: submit.py REPORT.json NAME.json

The result is the report without the cases that passed or were not claimed, so that a decoder that is right takes a few
kilobytes. The run has to be one of the whole suite. `splatstream conformance matrix` writes the page of all results.
"""

import json
import os
import re
import sys

SILENT = ("pass", "not-claimed")


def complaint(report):
    """Why a report is no result; None if it is one."""
    if "interrupted" in report:
        return "the run was interrupted"
    if report["settings"]["selection"]:
        return "a part of the suite was selected"
    if "changed" in report["suite"]:
        return "the suite is not that of its version: %s" % report["suite"]["changed"]
    return None


def kept(report):
    return {**report, "cases": [case for case in report["cases"] if case["outcome"] not in SILENT]}


def main():
    if len(sys.argv) != 3 or not re.fullmatch(r"[a-z0-9][a-z0-9.-]*\.json", os.path.basename(sys.argv[2])):
        sys.exit(__doc__)
    with open(sys.argv[1], encoding="utf-8") as f:
        report = json.load(f)
    refusal = complaint(report)
    if refusal:
        sys.exit("%s: %s; a result is a run of the whole suite" % (sys.argv[1], refusal))
    if os.path.exists(sys.argv[2]) and os.path.samefile(*sys.argv[1:]):
        sys.exit("%s: the result would replace the report: give it another name" % sys.argv[1])
    with open(sys.argv[2], "w", encoding="utf-8") as f:
        json.dump(kept(report), f, indent=1)
        f.write("\n")


if __name__ == "__main__":
    main()
