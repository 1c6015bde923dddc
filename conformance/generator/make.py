#!/usr/bin/env python3
"""Writes all vectors and their MANIFEST: make.py FOLDER [--check] [--jobs N] [--only TEXT]

With --check nothing is written: what is there is compared with what would be, and differences end with exit code 1.
"""

import argparse
import multiprocessing
import os
import shutil
import sys

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))

from generator import manifest, patches, vector
from generator.catalogue import VECTORS
from generator.text import clause_of_requirements

CLAUSES = clause_of_requirements()
MADE = {}                                           # name -> (bytes, record) of what is not invalid


def make(name):
    """(name, bytes, record) of one vector; a text instead of the record if it cannot be made."""
    row = VECTORS[name]
    try:
        if row.parent is None:
            data = row.build()
            return name, data, row.record(data, CLAUSES)
        parent, parent_record = MADE[row.parent]
        data = row.build(parent)
        return name, data, row.record(data, CLAUSES, parent, parent_record)
    except Exception as error:
        return name, b"", "%s: %s" % (type(error).__name__, error)


def made(names, jobs):
    """Results in the order of the catalogue, so that nothing depends on which job is first."""
    if jobs == 1:
        yield from map(make, names)
    else:
        with multiprocessing.get_context("fork").Pool(jobs) as pool:
            yield from pool.imap(make, names)


def everything(jobs, only):
    wanted = [name for name in VECTORS if only in name]
    parents = {VECTORS[name].parent for name in wanted} - {None}
    first = [name for name in VECTORS if VECTORS[name].parent is None and (name in wanted or name in parents)]
    for result in made(first, jobs):
        MADE[result[0]] = result[1:]
        if result[0] in wanted:
            yield result
    yield from made([name for name in wanted if VECTORS[name].parent is not None], jobs)


def compare(root, row, data, text):
    """What differs from the files of a vector, as lines."""
    result = []
    for file, expected in (("in.gss", data), ("vector.json", text.encode())):
        path = os.path.join(root, row.folder, file)
        if not os.path.exists(path):
            result.append("missing: " + path)
        elif open(path, "rb").read() != expected:
            result.append("differs: " + path)
    return result


def strangers(root):
    """Folders of vectors that are not in the catalogue."""
    known = {row.folder for row in VECTORS.values()}
    return [folder for folder, _, files in os.walk(root)
            if "vector.json" in files and os.path.relpath(folder, root) not in known]


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder")
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--only", default="", help="vectors with this in their names")
    options = parser.parse_args()
    problems, count, size = [], 0, 0
    for name, data, record in everything(options.jobs, options.only):
        row = VECTORS[name]
        if isinstance(record, str):
            problems.append("%s: %s" % (name, record))
            continue
        text = vector.text_of(record)
        if record.get("patch") and patches.apply(MADE[row.parent][0], record["patch"]) != data:
            problems.append("%s: parent and patch do not give the stream" % name)
        if options.check:
            problems += compare(options.folder, row, data, text)
        else:
            vector.write(options.folder, row, data, text)
        count, size = count + 1, size + len(data) + len(text)
    for folder in strangers(options.folder) if options.only == "" else []:
        if options.check:
            problems.append("not in the catalogue: " + folder)
        else:
            shutil.rmtree(folder)
    if options.check:
        problems += manifest.problems(options.folder)
    else:
        manifest.write(options.folder)
    print("\n".join(problems + ["%d vectors, %d bytes, %d problems" % (count, size, len(problems))]))
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
