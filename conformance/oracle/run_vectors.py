#!/usr/bin/env python3
"""Runs the decoder on every NAME.gss with a NAME.expect.json below the folders given and compares."""

import glob
import json
import os
import sys
import time

from decode import operating_point, report
from decoding import Decoder
from extraction import extract
from make_vectors import sha256, subset_records, whole_record


def found(data, expect):
    """A record with the fields of `expect` (RECORDS.md)."""
    decoder, got = whole_record(data) if "subset" in expect else (None, report(Decoder(data).decode()))
    if "points" in expect:
        got["points"] = {}
        for name, entry in expect["points"].items():
            if isinstance(entry, str):
                entry = expect["points"][entry]
            point = operating_point(name)
            decoder = Decoder(data, point).decode()
            part = got["points"][name] = report(decoder)
            if "subset" in entry:
                part["subset"] = subset_records(decoder)
            if "extraction" in entry and not decoder.errors:
                part["extraction"] = sha256(extract(data, point))
            if part == entry and isinstance(expect["points"][name], str):
                got["points"][name] = expect["points"][name]
    return got


def main():
    passed = failed = gaussians = 0
    differences = []
    begin = time.time()
    for folder in sys.argv[1:]:
        for expect_path in sorted(glob.glob(os.path.join(folder, "*.expect.json"))):
            path = expect_path[:-len(".expect.json")] + ".gss"
            expect = json.load(open(expect_path))
            got = found(open(path, "rb").read(), expect)
            gaussians += sum(f["gaussians"] for f in got["frames"])
            keys = [k for k in expect if k in ("outcome", "class", "code", "frames", "subset", "points")]
            soft = [k for k in expect if k in ("clause", "byte")]
            if any(expect[k] != got.get(k) for k in keys):
                failed += 1
                print("FAIL", path, "\n  expected", expect, "\n  got     ", got)
            else:
                passed += 1
                for k in soft:
                    if expect[k] != got.get(k):
                        differences.append((os.path.basename(path), expect["code"], k, expect[k], got.get(k)))
    for row in differences:
        print("note", *row)
    seconds = time.time() - begin
    print("%d passed, %d failed, %.1f s, %.0f Gaussians/s" % (passed, failed, seconds, gaussians / seconds))
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
