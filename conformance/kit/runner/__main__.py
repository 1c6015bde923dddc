#!/usr/bin/env python3
"""Runs a decoder on the conformance vectors of SplatStream, with nothing but Python 3.9 or newer.

  python3 runner --decoder './mydec {in} {op} {mode} {out}'
  python3 runner --stdio './mydec --stdio' --jobs 4 --filter 'temporal-*' --report mydec.json

The protocol, the claim of a decoder and the report are those of `splatstream conformance run` (adapters/README.md), which
also says where wrong values come from. Exit codes: 0 every case passed that the decoder claims, 1 files or settings, 2 usage, 3 a
case failed.
"""

import argparse
import concurrent.futures
import fnmatch
import json
import os
import queue
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

import claim as claims
from decoder import Session
from judge import judge, not_claimed
from report import FAILURES, report
from suite import Suite, SuiteError

NAMED = 6  # cases that fail likewise, of each kind of failure


def size(text):
    """A number of bytes as people write it: 512M, 2G."""
    shift = {"K": 10, "M": 20, "G": 30}.get(text[-1:], 0)
    return int(text[:-1] if shift else text) << shift


def default_suite():
    """The vectors beside this folder, in a kit, or above it, in the repository."""
    here = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
    places = [os.path.join(here, "vectors"), os.path.join(os.path.dirname(here), "vectors")]
    return next((place for place in places if os.path.isdir(place)), places[0])


def options(words):
    parser = argparse.ArgumentParser(prog="runner", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    command = parser.add_mutually_exclusive_group(required=True)
    command.add_argument("--decoder", metavar="CMD", help="command for each case, with {in} {op} {mode} {out}")
    command.add_argument("--stdio", metavar="CMD", help="command of a process that answers line by line")
    parser.add_argument("--suite", default=default_suite(), metavar="DIR", help="the folder of the vectors")
    parser.add_argument("--capabilities", metavar="FILE", help="what the decoder claims; default is everything")
    parser.add_argument("--filter", action="append", default=[], metavar="PATTERN", help="vectors, or vector@op/mode; * and ?")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, metavar="N", help="cases at a time")
    parser.add_argument("--time", type=float, default=10, metavar="SECONDS", help="that a case may take")
    parser.add_argument("--memory", type=size, default=2 << 30, metavar="SIZE", help="that a case may take; 0 is any")
    parser.add_argument("--output", type=size, default=256 << 20, metavar="SIZE", help="of a file that it may write; 0 is any")
    parser.add_argument("--strict", action="store_true", help="demand the right code of each error")
    parser.add_argument("--report", metavar="FILE", help="write the report as JSON")
    settings = parser.parse_args(words)
    if settings.decoder and not all(word in settings.decoder for word in ("{in}", "{out}")):
        parser.error("the command has no {in} or no {out}; write --decoder 'CMD {in} {op} {mode} {out}'")
    return settings


def selected(cases, patterns):
    """The cases that a pattern names: all without patterns.

    Raises SuiteError for a pattern that names none."""
    takes = lambda case, pattern: any(
        fnmatch.fnmatchcase(name, pattern) for name in (case.record["name"], case.name, case.name.rsplit("/", 1)[0]))
    for pattern in patterns:
        if not any(takes(case, pattern) for case in cases):
            raise SuiteError("no case is called %s" % pattern)
    return [case for case in cases if not patterns or any(takes(case, pattern) for pattern in patterns)]


def run_case(case, sessions, settings, claim):
    """The result of a case; that of the first prefix that fails for a stream with `sweep`."""
    lacking = claims.missing(claim, case)
    if lacking:
        return not_claimed(case, lacking)
    session = sessions.get()
    try:
        for part in case.prefixes() or [case]:
            row = judge(part, session.ask(part), session.out, settings, claim)
            if row["outcome"] != "pass":
                if part.cut is not None:
                    row["detail"] = "cut after %d bytes: %s" % (part.cut, row.get("detail", row["outcome"]))
                break
        return row
    finally:
        sessions.put(session)


def run(cases, settings, claim):
    """The results of cases, in their order."""
    sessions = queue.Queue()
    for _ in range(settings.jobs):
        sessions.put(Session(settings))
    try:
        with concurrent.futures.ThreadPoolExecutor(settings.jobs) as pool:
            return list(pool.map(lambda case: run_case(case, sessions, settings, claim), cases))
    finally:
        while not sessions.empty():
            sessions.get().close()


def kind(row):
    """What failures of one kind have in common: the verdict, the classes that are right and the answer, without codes and texts."""
    classes = {word for word in row["expected"].split() if word.islower() and word != "or"}
    is_verdict = row["outcome"] not in ("crash", "timeout")
    return row.get("reason", row["outcome"]), tuple(sorted(classes)) if is_verdict else (), row.get("answer")


def show(rows):
    """Says the first failure of a kind, and which cases fail likewise; the report has the texts of all."""
    name = lambda row: "%(vector)s@%(op)s/%(mode)s" % row
    first, others = rows[0], [name(row) for row in rows[1:]]
    print("FAIL %s:" % name(first), first.get("reason", first["outcome"]))
    for key in ("expected", "answer", "detail"):
        if key in first:
            print("  %s: %s" % (key, first[key]))
    if others:
        more = " and %d more" % (len(others) - NAMED) if len(others) > NAMED else ""
        print("  likewise %d: %s%s" % (len(others), ", ".join(others[:NAMED]), more))


def main(words=None):
    settings = options(words)
    try:
        suite = Suite(settings.suite)
        claim = claims.read(settings.capabilities) if settings.capabilities else claims.everything("decoder")
        cases = selected(suite.cases(), settings.filter)
        rows = run(cases, settings, claim)
    except (SuiteError, claims.ClaimError, OSError, ValueError) as error:
        print("error: %s" % error, file=sys.stderr)
        return 1
    if suite.changed:
        print("warning: this is not suite %s: %s" % (suite.version or "of a known version", suite.changed), file=sys.stderr)
    claimed = {case.name for case in suite.cases() if claims.missing(claim, case) is None}
    found = report(suite, settings, claim, claimed, rows)
    if settings.report:
        with open(settings.report, "w", encoding="utf-8") as f:
            json.dump(found, f, indent=1)
            f.write("\n")
    failed = [row for row in rows if row["outcome"] in FAILURES]
    kinds = {}
    for row in failed:
        kinds.setdefault(kind(row), []).append(row)
    for rows in kinds.values():
        show(rows)
    passed, idle = found["summary"]["pass"], found["summary"]["not-claimed"]
    print("%d passed, %d failed, %d not claimed, of %d cases" % (passed, len(failed), idle, len(rows)))
    return 3 if failed or not passed else 0


if __name__ == "__main__":
    sys.exit(main())
