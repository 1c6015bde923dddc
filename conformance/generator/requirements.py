#!/usr/bin/env python3
"""Coverage of requirements: requirements.py

Writes conformance/coverage/requirements.csv: each requirement of the text with the vectors that accept and that
reject by it. Where there is none, waivers.csv says why; a row that says so needlessly is an error, and so is a gap
without a row.
"""

import csv
import glob
import json
import os
import sys

from oracle_path import CONFORMANCE, HERE
from text import clause_of_requirements

COVERAGE = os.path.join(CONFORMANCE, "coverage")


def vectors():
    for path in sorted(glob.glob(os.path.join(CONFORMANCE, "vectors", "*", "*", "*", "vector.json"))):
        with open(path, encoding="utf-8") as f:
            yield json.load(f)


def waivers():
    """(requirement, side) -> reason"""
    with open(os.path.join(HERE, "waivers.csv"), encoding="utf-8", newline="") as f:
        return {(row["requirement"], row["side"]): row["reason"] for row in csv.DictReader(f)}


def by_requirement(known):
    """Requirement -> {side: names}; one that is accepted here and rejected there is on both sides."""
    result = {requirement: {"accept": [], "reject": []} for requirement in known}
    for record in vectors():
        verdicts = [record["expect"]] + record.get("acceptable",
                                                   []) + [row.get("expect",
                                                                  record["expect"]) for row in record.get("points", [])]
        outcomes = {row["outcome"] for row in verdicts}
        for requirement in record["requirements"]:
            for side in outcomes:
                result[requirement][side].append(record["name"])
    return result


def main():
    clauses, reasons = clause_of_requirements(), waivers()
    table, problems = by_requirement(clauses), []
    os.makedirs(COVERAGE, exist_ok=True)
    with open(os.path.join(COVERAGE, "requirements.csv"), "w", encoding="utf-8", newline="") as f:
        out = csv.writer(f, lineterminator="\n")
        out.writerow(["requirement", "clause", "accepting", "rejecting", "accepting_vectors", "rejecting_vectors",
                      "waiver"])
        for requirement, sides in sorted(table.items()):
            notes = []
            for side, names in sides.items():
                reason = reasons.pop((requirement, side), None)
                if bool(names) == bool(reason):
                    problems.append("%s: %s" % (requirement,
                                                "waived but covered" if names else "no vector to %s by it" % side))
                notes += ["%s: %s" % (side, reason)] if reason else []
            out.writerow([requirement, clauses[requirement], len(sides["accept"]), len(sides["reject"]),
                          " ".join(sides["accept"]),
                          " ".join(sides["reject"]), "; ".join(notes)])
    problems += ["%s: waived but not in the text" % requirement for requirement, _ in reasons]
    counts = {side: sum(bool(sides[side]) for sides in table.values()) for side in ("accept", "reject")}
    print("\n".join(problems + ["%d requirements: %d with an accepting vector, %d with a rejecting one, %d problems" % (
        len(table), counts["accept"], counts["reject"], len(problems))]))
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
