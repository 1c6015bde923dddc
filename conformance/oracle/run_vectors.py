#!/usr/bin/env python3
"""Runs the oracle on all vectors below the folders given, and compares: run_vectors.py FOLDER... [--jobs N]

Everything of vector.json is compared that a decoder finds: verdicts, states, extractions,
units and their entropy states.
What only helps people (clause and byte) is printed as a note where it differs.
"""

import argparse
import glob
import json
import multiprocessing
import os
import sys
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "generator"))

import expectation
from decode import operating_point
from decoding import Decoder
from extraction import extract

HARD = ("outcome", "class", "code")


def same(expected, found, fields):
    return all(expected.get(field) == found.get(field) for field in fields)


def point_problems(data, decoder, record, row):
    """Problems of one operating point and mode."""
    expected, subset = row.get("expect", record["expect"]), row["mode"] == "subset"
    where = "%s %s: " % (row["op"], row["mode"])
    found = expectation.outcome(decoder, subset)
    if not same(expected, found, HARD):
        yield where + "%s, not %s" % (found, expected)
    states = [expectation.state_of(frame, decoder.sequence, subset) for frame in decoder.frames]
    if states != [record["states"][place] for place in row["states"]]:
        yield where + "other states"
    if "extraction" in row and expectation.sha256(extract(data, operating_point(row["op"]))) != row["extraction"]:
        yield where + "another extraction"


def run(folder):
    """(folder, problems, notes) of one vector."""
    with open(os.path.join(folder, "vector.json"), encoding="utf-8") as f:
        record = json.load(f)
    with open(os.path.join(folder, "in.gss"), "rb") as f:
        data = f.read()
    problems, notes = [], []
    if expectation.sha256(data) != record["sha256"]:
        problems.append("in.gss is not the file of the record")
    decoder = Decoder(data).decode()
    found = expectation.outcome(decoder)
    if not same(record["expect"], found, HARD):
        problems.append("%s, not %s" % (found, record["expect"]))
    elif not same(record["expect"], found, ("clause", "byte")):
        notes.append("%s, not %s" % (found, record["expect"]))
    if "units" in record and record["units"] != expectation.unit_rows(data, decoder):
        problems.append("other units")
    at, part = None, None                           # the rows of a point stand together
    for row in record.get("points", []):
        if row["op"] != at:
            at, part = row["op"], Decoder(data, operating_point(row["op"])).decode()
        problems += point_problems(data, part, record, row)
    return folder, problems, notes


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", nargs="+")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    options = parser.parse_args()
    begin, failed = time.time(), 0
    folders = sorted(os.path.dirname(path) for folder in options.folder
                     for path in glob.glob(os.path.join(folder, "**", "vector.json"), recursive=True))
    with multiprocessing.Pool(options.jobs) as pool:
        for folder, problems, notes in pool.imap(run, folders):
            failed += bool(problems)
            for kind, lines in (("FAIL", problems), ("note", notes)):
                for line in lines:
                    print(kind, folder, line)
    print("%d passed, %d failed, %.1f s" % (len(folders) - failed, failed, time.time() - begin))
    return 1 if failed or not folders else 0


if __name__ == "__main__":
    sys.exit(main())
