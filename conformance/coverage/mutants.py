#!/usr/bin/env python3
"""Mutants of format and decoder: mutants.py sample ALL.json COUNT SEED, record OUTCOMES.json, or check

`sample` draws so many mutants of all in functions that the vectors run, and prints an expression that matches those that
are not in mutants.csv yet; what the vectors do not run is in code_missed.csv with its reason. `record` adds outcomes to
mutants.csv; `check` demands of it that mutants that no vector noticed are explained, and the goal.
"""

import csv
import hashlib
import json
import os
import re
import sys

from rust_functions import Functions

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
TABLE = os.path.join(HERE, "mutants.csv")
GOAL, FEWEST = 85, 120                              # percent of mutants that count, and mutants
COLUMNS = ("file", "function", "change", "text", "outcome", "explanation")
NAMES = {"CaughtMutant": "caught", "Timeout": "timeout", "MissedMutant": "missed", "Unviable": "unviable"}
EQUIVALENT = "equivalent: "                         # how the explanation of one starts that changes nothing


def table(name):
    with open(os.path.join(HERE, name), encoding="utf-8", newline="") as f:
        return list(csv.DictReader(f))


def source(file):
    with open(os.path.join(ROOT, file), encoding="utf-8") as f:
        return Functions(f.read())


def key(row):
    return tuple(row[name] for name in COLUMNS[:4])


def standing():
    """The rows of mutants.csv whose line is still there."""
    rows = table("mutants.csv") if os.path.exists(TABLE) else []
    files = {row["file"] for row in rows if os.path.exists(os.path.join(ROOT, row["file"]))}
    lines = {file: {line.strip() for line in source(file).lines} for file in files}
    return [row for row in rows if row["text"] in lines.get(row["file"], ())]


def running(mutants):
    """Those in functions that some vector runs."""
    idle = {(row["file"], row["function"]) for row in table("code_missed.csv") if row["side"] == "all"}
    files = {mutant["file"]: source(mutant["file"]) for mutant in mutants}
    return [mutant for mutant in mutants
            if (mutant["file"], files[mutant["file"]].at(mutant["span"]["start"]["line"])) not in idle]


def sample(path, count, seed):
    """One regular expression of mutants' names. Drawn by a hash of what is changed and not of where, so that a change of
    the code elsewhere draws the same."""
    with open(path, encoding="utf-8") as f:
        mutants = running(json.load(f))

    def rank(mutant):
        drawn = "\0".join((str(seed),) + key(row_of(mutant, "")))
        return hashlib.sha256(drawn.encode()).digest(), mutant["name"]

    known = {key(row) for row in standing()}
    new = [mutant["name"] for mutant in sorted(mutants, key=rank)[:count] if key(row_of(mutant, "")) not in known]
    return "^(%s)$" % "|".join(map(re.escape, new)) if new else ""


def row_of(mutant, outcome):
    """A row that does not change with the lines above it."""
    functions, line = source(mutant["file"]), mutant["span"]["start"]["line"]
    change = re.sub(r"^[^ ]+:\d+:\d+: ", "", mutant["name"])
    return {"file": mutant["file"], "function": functions.at(line), "change": change, "text": functions.text(line),
            "outcome": outcome, "explanation": ""}


def record(path):
    with open(path, encoding="utf-8") as f:
        outcomes = json.load(f)["outcomes"]
    tried = [{**outcome["scenario"]["Mutant"], "outcome": NAMES[outcome["summary"]]} for outcome in outcomes
             if isinstance(outcome["scenario"], dict) and outcome["summary"] in NAMES]
    # cargo-mutants does not ask whether deleted fields are among the mutants chosen.
    rows = [row_of(mutant, mutant["outcome"]) for mutant in running(tried)]
    before = standing()
    known = {key(row): row for row in before}
    for row in rows:
        if row["outcome"] == "missed" and key(row) in known:
            row["explanation"] = known[key(row)]["explanation"]
    anew = {key(row) for row in rows}
    rows += [row for row in before if key(row) not in anew]
    rows.sort(key=lambda row: [row[name] for name in COLUMNS])
    with open(TABLE, "w", encoding="utf-8", newline="") as f:
        out = csv.DictWriter(f, COLUMNS, lineterminator="\n")
        out.writeheader()
        out.writerows(rows)


def check():
    """What mutants.csv lacks, and what it says. A mutant of a line that has changed since counts for nothing."""
    rows, problems = standing(), []
    for row in rows:
        if (row["outcome"] == "missed") != bool(row["explanation"]):
            problems.append("%(file)s: %(function)s: %(change)s: " % row + (
                "nobody noticed and nobody says why" if row["outcome"] == "missed" else "explained and noticed"))
    counting = [row for row in rows if row["outcome"] != "unviable"]
    noticed = sum(row["outcome"] in ("caught", "timeout") for row in counting)
    same = sum(row["explanation"].startswith(EQUIVALENT) for row in counting)
    score = 100 * noticed / max(len(counting), 1)
    if len(rows) < FEWEST or score < GOAL:
        problems.append("the goal is %d %% of %d mutants: run mutants.sh" % (GOAL, FEWEST))
    told = "%d mutants, of which %d do not compile: the vectors notice %d of %d, %.1f %%; %d of the others change nothing" % (
        len(rows), len(rows) - len(counting), noticed, len(counting), score, same)
    gone = len(table("mutants.csv")) - len(rows)
    if gone:
        told += "; %d more are of code that has changed since" % gone
    return problems, told


def main(arguments):
    if arguments[:1] == ["sample"] and len(arguments) == 4:
        sys.stdout.write(sample(arguments[1], int(arguments[2]), int(arguments[3])))
        return 0
    if arguments[:1] == ["record"] and len(arguments) == 2:
        record(arguments[1])
    elif arguments != ["check"]:
        print(__doc__, file=sys.stderr)
        return 2
    problems, told = check()
    print("\n".join(problems + [told, "%d problems" % len(problems)]))
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
