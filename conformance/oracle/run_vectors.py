#!/usr/bin/env python3
"""Runs the oracle on all vectors below the folders given, and compares: run_vectors.py FOLDER... [--jobs N]

Everything of vector.json is compared that a decoder finds: verdicts, states, lost display indices, extractions, units
and their entropy states, but for what only helps people (clause and byte).
"""

import argparse
import glob
import json
import multiprocessing
import os
import sys
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))

from generator import expectation
from oracle.decode import operating_point
from oracle.decoding import Decoder
from oracle.extraction import extract


def is_acceptable(expected, found, acceptable):
    """Whether a verdict is the expected one, or another fault of the same unit."""
    verdicts = [expected] + [{**expected, **fault} for fault in acceptable]
    return any(all(verdict.get(key) == found.get(key) for key in ("outcome", "class", "code")) for verdict in verdicts)


def point_problems(data, decoder, record, row):
    """Problems of one operating point and mode."""
    expected, subset = row.get("expect", record["expect"]), row["mode"] == "subset"
    where = "%s %s: " % (row["op"], row["mode"])
    found = expectation.outcome(decoder, subset)
    if not is_acceptable(expected, found, record.get("acceptable", [])):
        yield where + "%s, not %s" % (found, expected)
    states = [expectation.state_of(frame, decoder.sequence, subset) for frame in decoder.frames]
    if states != [record["states"][index] for index in row["states"]]:
        yield where + "other states"
    if decoder.lost != row.get("lost", []):
        yield where + "lost %s, not %s" % (decoder.lost, row.get("lost", []))
    if "extraction" in row and expectation.sha256(extract(data, operating_point(row["op"]))) != row["extraction"]:
        yield where + "another extraction"


def stream_problems(data, record):
    """Problems of a stream at its operating points."""
    decoder = Decoder(data, None, record.get("inside")).decode()
    found = expectation.outcome(decoder)
    if not is_acceptable(record["expect"], found, record.get("acceptable", [])):
        yield "%s, not %s" % (found, record["expect"])
    if "units" in record:
        whole = decoder if "inside" not in record else Decoder(data).decode()
        if record["units"] != expectation.unit_rows(data, whole):
            yield "other units"
    at, part = None, None                           # the rows of a point stand together
    for row in record.get("points", []):
        if row["op"] != at:
            at, part = row["op"], Decoder(data, operating_point(row["op"]), record.get("inside")).decode()
        yield from point_problems(data, part, record, row)


def run(folder):
    """(folder, problems) of one vector."""
    with open(os.path.join(folder, "vector.json"), encoding="utf-8") as f:
        record = json.load(f)
    with open(os.path.join(folder, "in.gss"), "rb") as f:
        data = f.read()
    problems = []
    if expectation.sha256(data) != record["sha256"]:
        problems.append("in.gss is not the file of the record")
    if "sweep" in record:
        found = expectation.swept(data)
        problems += ["other %s" % key for key in found if found[key] != record[key]]
    else:
        problems += stream_problems(data, record)
    return folder, problems


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", nargs="+")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    options = parser.parse_args()
    begin, failed = time.time(), 0
    folders = sorted(os.path.dirname(path) for folder in options.folder
                     for path in glob.glob(os.path.join(folder, "**", "vector.json"), recursive=True))
    with multiprocessing.Pool(options.jobs) as pool:
        for folder, problems in pool.imap(run, folders):
            failed += bool(problems)
            for line in problems:
                print("FAIL", folder, line)
    print("%d passed, %d failed, %.1f s" % (len(folders) - failed, failed, time.time() - begin))
    return 1 if failed or not folders else 0


if __name__ == "__main__":
    sys.exit(main())
