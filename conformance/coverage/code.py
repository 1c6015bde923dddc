#!/usr/bin/env python3
"""What the vectors alone run of format and decoder: code.py LINES.info BRANCHES.json [--check]

Reads what llvm-cov exports and writes code.csv, a row a file, and code_missed.csv, a row for each line and each side of
a condition that no vector reaches, with the reason from code_waivers.csv. A miss without a reason is an error, and so
is a reason without a miss. With --check nothing is written, and it is an error too if code.csv claims more.
"""

import argparse
import collections
import csv
import json
import os
import sys

from rust_functions import Functions

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
SOURCES = ("format/src/", "decoder/src/")
ELSEWHERE = "not decoding"                          # the one category that is no part of decoding a stream
COLUMNS = ("lines", "lines missed", "branches", "branches missed")

Miss = collections.namedtuple("Miss", "file function side text")
"""side: `line`, or `true` or `false` of the condition `text`; `all` if nothing of the function runs."""


def read_lines(path):
    """file -> {line: how often it ran}"""
    result, lines = {}, None
    with open(path, encoding="utf-8") as f:
        for row in f:
            key, _, value = row.strip().partition(":")
            if key == "SF":
                lines = result.setdefault(os.path.relpath(value, ROOT), {})
            elif key == "DA":
                line, count = map(int, value.split(",")[:2])
                lines[line] = lines.get(line, 0) + count
    return result


def read_branches(path):
    """file -> {place: [how often true, how often false]}, instances of a generic function taken together"""
    result = {}
    with open(path, encoding="utf-8") as f:
        exported = json.load(f)["data"][0]
    for file in exported["files"]:
        branches = result.setdefault(os.path.relpath(file["filename"], ROOT), {})
        for row in file["branches"]:
            sides = branches.setdefault(tuple(row[:4]), [0, 0])
            sides[0] += row[4]
            sides[1] += row[5]
    return result


class File:
    """One source file: what ran and what did not."""

    def __init__(self, name, lines, branches):
        self.name, self.ran, self.branches = name, lines, branches
        with open(os.path.join(ROOT, name), encoding="utf-8") as f:
            self.source = Functions(f.read())
        ran = {self.source.at(line) for line, count in lines.items() if count}
        self.idle = {self.source.at(line) for line in lines} - ran - {""}

    def miss(self, line, side, text):
        function = self.source.at(line)
        return Miss(self.name, function, *(("all", "") if function in self.idle else (side, text)))

    def condition(self, place):
        """The text of a condition, on one line."""
        first, start, last, end = place
        lines = self.source.lines[first - 1:last]
        lines[-1] = lines[-1][:end - 1]
        lines[0] = lines[0][start - 1:]
        return " ".join(line.strip() for line in lines)

    def line_misses(self):
        for line, count in sorted(self.ran.items()):
            if not count:
                yield self.miss(line, "line", self.source.text(line))

    def branch_misses(self):
        """Conditions that are never reached come with their line."""
        for place, counts in sorted(self.branches.items()):
            for side, count in zip(("true", "false"), counts):
                if not count and any(counts):
                    yield self.miss(place[0], side, self.condition(place))
                elif not count:
                    yield self.miss(place[0], "line", self.source.text(place[0]))

    def numbers(self):
        return [len(self.ran), len(list(self.line_misses())), 2 * len(self.branches), len(list(self.branch_misses()))]


class Waivers:
    """Reasons by miss; a row without a text is about a function of which nothing runs, `*` about all of a file."""

    def __init__(self, path):
        with open(path, encoding="utf-8", newline="") as f:
            self.rows = list(csv.DictReader(f))
        self.used = set()

    def of(self, miss):
        for place, row in enumerate(self.rows):
            functions = row["function"] == "*" and miss.side == "all" or row["function"] == miss.function
            if row["file"] == miss.file and functions and (row["side"], row["text"]) == (miss.side, miss.text):
                self.used.add(place)
                return row
        return None

    def needless(self):
        return [row for place, row in enumerate(self.rows) if place not in self.used]


def measured(lines_path, branches_path, waivers):
    """(rows of code.csv, rows of code_missed.csv, problems)"""
    lines, branches = read_lines(lines_path), read_branches(branches_path)
    rows, missed, problems = [], [], []
    for name in sorted(name for name in lines if name.startswith(SOURCES)):
        file = File(name, lines[name], branches.get(name, {}))
        all_numbers, decoding = file.numbers(), file.numbers()
        by_lines, by_branches = collections.Counter(file.line_misses()), collections.Counter(file.branch_misses())
        for miss in dict.fromkeys([*by_lines, *by_branches]):
            waiver = waivers.of(miss)
            if waiver is None:
                problems.append("%s: %s: %s %s: no vector and no reason" % (
                    name, miss.function or "outside of functions", miss.side, miss.text))
                waiver = {"category": "", "reason": ""}
            missed.append([*miss, by_lines[miss], by_branches[miss], waiver["category"], waiver["reason"]])
            if waiver["category"] == ELSEWHERE:
                decoding = [number - by for number, by in zip(decoding, [by_lines[miss]] * 2 + [by_branches[miss]] * 2)]
        rows.append([name, *all_numbers, *decoding])
    problems += ["%(file)s: %(function)s: %(side)s %(text)s: explained and not missed" % row for row in
                 waivers.needless()]
    rows.append(["all", *(sum(column) for column in list(zip(*rows))[1:])])
    return rows, missed, problems


def percent(numbers):
    """Shares that ran, of lines and of branches, in percent."""
    lines, lines_missed, branches, branches_missed = map(int, numbers)
    return 100 - 100 * lines_missed / lines, 100 - 100 * branches_missed / branches


def told(row):
    return "all code: %.1f %% of lines, %.1f %% of branches; what decoding can reach: %.1f %% of lines, %.1f %% of " \
        "branches" % (percent(row[1:5]) + percent(row[5:9]))


def write(name, header, rows):
    with open(os.path.join(HERE, name), "w", encoding="utf-8", newline="") as f:
        out = csv.writer(f, lineterminator="\n")
        out.writerow(header)
        out.writerows(rows)


def claimed_too_much(row):
    """Shares that code.csv states and that are not reached any more, to a tenth of a percent."""
    with open(os.path.join(HERE, "code.csv"), encoding="utf-8", newline="") as f:
        stated = list(csv.reader(f))[-1]
    pairs = zip(percent(stated[1:5]) + percent(stated[5:9]), percent(row[1:5]) + percent(row[5:9]))
    return any(now < before - 0.1 for before, now in pairs), stated


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("lines")
    parser.add_argument("branches")
    parser.add_argument("--check", action="store_true")
    options = parser.parse_args()
    rows, missed, problems = measured(options.lines, options.branches, Waivers(os.path.join(HERE, "code_waivers.csv")))
    if options.check:
        fell, stated = claimed_too_much(rows[-1])
        problems += ["code.csv says: " + told(stated)] if fell else []
    else:
        write("code.csv", ["file", *COLUMNS, *("decoding: " + column for column in COLUMNS)], rows)
        write("code_missed.csv", [*Miss._fields, "lines", "branches", "category", "reason"], missed)
    print("\n".join(problems + [told(rows[-1]), "%d problems" % len(problems)]))
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
