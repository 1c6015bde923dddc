#!/usr/bin/env python3
"""Writes test suites for fluster from the vectors: make.py VECTORS ARCHIVE OUT [--url URL]

ARCHIVE is a zip file with the streams, the same bytes each time; OUT a folder for the suites, which name the archive by URL
(by default the file itself). A result is the SHA-256 of a text: the verdict, `accept` or a class of 9.1, and a line `sha256
name` for each file of planes that a decoder writes, in the order of the names. One suite has all streams at their highest operating
point, the other the valid ones at all their points.

Streams for which the text leaves more than one verdict right, decoders that start inside a stream, and streams that are cut at every
byte are left out: fluster has one result for a stream. The runners of this suite have them.
"""

import argparse
import hashlib
import json
import os
import sys
import zipfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "runner"))

from suite import Suite

CODEC = "SplatStream"
DAY = (2026, 1, 1, 0, 0, 0)                         # of every file in the archive


def fitting(case):
    """Whether fluster can judge a case: one verdict, and the frames known or none."""
    record = case.record
    classes = {verdict.get("class") for verdict in case.verdicts()}
    return "sweep" not in record and case.mode == "full" and len(classes) == 1


def result(case):
    """What the decoder class gives for a right answer."""
    states = case.states() or []
    files = {"f%04d.%s.i32" % (state["frame"], name): digest for state in states for name, digest in state["planes"].items()}
    lines = [case.verdicts()[0].get("class", "accept")] + ["%s %s" % (files[name], name) for name in sorted(files)]
    return hashlib.sha256("".join(line + "\n" for line in lines).encode()).hexdigest()


def inside_archive(case):
    return "%s/%s.gss" % (case.record["area"], case.record["name"])


def vector(case, name, source, checksum):
    row = {"name": name, "source": source, "source_checksum": checksum, "input_file": inside_archive(case),
           "output_format": "None", "optional_params": {"op": case.op}, "result": result(case)}
    if case.states() is None:
        # The record does not say which frames come out before the error.
        row["optional_params"]["verdict_only"] = True
    return row


def write_archive(path, cases):
    """A zip file of the streams, which depends on nothing but them."""
    streams = {inside_archive(case): case.vector for case in cases}
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for name in sorted(streams):
            entry = zipfile.ZipInfo(name, DAY)
            entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
            archive.writestr(entry, streams[name].stream())


def md5(path):
    with open(path, "rb") as f:
        return hashlib.md5(f.read()).hexdigest()


def suite(name, description, vectors):
    return {"name": name, "codec": CODEC, "description": description, "test_vectors": vectors, "test_method": "md5"}


def suites(version, cases, source, checksum):
    """Both suites."""
    tops = {}
    for case in cases:
        if case.is_extreme(True):
            tops.setdefault(case.record["name"], case)
    valid = [case for case in cases if case.record["kind"] == "valid"]
    return [
        suite("SPLATSTREAM-all", "SplatStream %s: every stream at its highest operating point" % version,
              [vector(case, name, source, checksum) for name, case in sorted(tops.items())]),
        suite("SPLATSTREAM-points", "SplatStream %s: valid streams at every operating point" % version,
              [vector(case, "%s-%s" % (case.record["name"], case.op.replace(",", "")), source, checksum) for case in valid]),
    ]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("vectors")
    parser.add_argument("archive")
    parser.add_argument("out")
    parser.add_argument("--url", help="where the archive will be")
    settings = parser.parse_args()
    found = Suite(settings.vectors)
    cases = [case for case in found.cases() if fitting(case)]
    write_archive(settings.archive, cases)
    source = settings.url or "file://" + os.path.abspath(settings.archive)
    os.makedirs(settings.out, exist_ok=True)
    for made in suites(found.version, cases, source, md5(settings.archive)):
        path = os.path.join(settings.out, made["name"] + ".json")
        with open(path, "w", encoding="utf-8") as f:
            json.dump(made, f, indent=4)
            f.write("\n")
        print("%s: %d test vectors" % (path, len(made["test_vectors"])))


if __name__ == "__main__":
    main()
