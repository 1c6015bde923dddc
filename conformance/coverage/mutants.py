#!/usr/bin/env python3
"""Mutants of the crates format and decoder: mutants.py OUTCOMES.json, which cargo-mutants wrote. Writes mutants.csv."""

import csv
import json
import os
import re
import sys

TABLE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "mutants.csv")
NAMES = {"CaughtMutant": "noticed", "Timeout": "noticed", "MissedMutant": "missed", "Unviable": "does not compile"}


def main():
    with open(sys.argv[1], encoding="utf-8") as f:
        outcomes = json.load(f)["outcomes"]
    # The positions go: they change with every line above.
    rows = sorted((re.sub(r":\d+:\d+:", ":", outcome["scenario"]["Mutant"]["name"]), NAMES[outcome["summary"]])
                  for outcome in outcomes if isinstance(outcome["scenario"], dict) and outcome["summary"] in NAMES)
    with open(TABLE, "w", encoding="utf-8", newline="") as f:
        out = csv.writer(f, lineterminator="\n")
        out.writerow(("mutant", "outcome"))
        out.writerows(rows)
    noticed, missed = (sum(outcome == word for _, outcome in rows) for word in ("noticed", "missed"))
    print("the vectors notice %d of %d mutants, %.1f %%" % (noticed, noticed + missed,
                                                          100 * noticed / max(noticed + missed, 1)))


if __name__ == "__main__":
    main()
