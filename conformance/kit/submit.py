#!/usr/bin/env python3
"""Makes a result for conformance/results from the report of a run: submit.py REPORT.json NAME

Writes conformance/results/NAME.json: the report without the cases that passed or were not claimed, so that a decoder that is right
takes a few kilobytes. The run has to be one of the whole suite. Then `.ci/reports matrix` writes the page.
"""

import json
import os
import re
import sys

RESULTS = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "results")
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
    if len(sys.argv) != 3 or not re.fullmatch(r"[a-z0-9][a-z0-9.-]*", sys.argv[2]):
        sys.exit(__doc__)
    with open(sys.argv[1], encoding="utf-8") as f:
        report = json.load(f)
    refusal = complaint(report)
    if refusal:
        sys.exit("%s: %s; a result is a run of the whole suite" % (sys.argv[1], refusal))
    with open(os.path.join(RESULTS, sys.argv[2] + ".json"), "w", encoding="utf-8") as f:
        json.dump(kept(report), f, indent=1)
        f.write("\n")


if __name__ == "__main__":
    main()
