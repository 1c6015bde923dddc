#!/usr/bin/env python3
"""The conformance protocol in Python, around the independent decoder of conformance/oracle.

  adapter.py --in IN.gss --op s0,t0,r2 --mode full --out DIR      one stream; the exit code is the verdict
  adapter.py --stdio                                              many, a line each

For a decoder of your own, replace decode() below; the rest is the protocol.
"""

import argparse
import json
import os
import struct
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", ".."))

from oracle import constants as c
from oracle.decode import operating_point
from oracle.decoding import Decoder
from oracle.entropy_state import entropy_state
from oracle.errors import EXIT_CODE, StreamError
from oracle.lists import canonical_planes
from oracle.output import float_planes
from oracle.semantics import parse_unit_header

# Canonical planes (7.9) of each attribute: first, and first of the next
ATTRIBUTES = (("position", 0, 3), ("log_scale", 3, 6), ("opacity", 6, 7), ("rotation", 7, 10), ("dc", 10, 13),
              ("sh", 13, None))


class Result:
    """What a decoder makes of a stream."""

    def __init__(self):
        self.exit_code = 0
        self.diagnosis = None                       # dict: class, code, clause, byte, lost
        self.frames = {}                            # display index -> canonical planes, compensated
        self.floats = {}                            # display index -> output of 7.10, plane after plane; optional
        self.entropy = {}                           # index of a unit -> XXH64 of its entropy decoding; optional


def decode(data, point, mode):
    """A Result: the stream `data` at an operating point (s, t, r); mode: `full`, `subset` (7.8.2) or `inside` (B.3)."""
    inside = parse_unit_header(data, c.FILE_HEADER_BYTES).end if mode == "inside" else None
    decoder = Decoder(data, point, inside).decode()
    result = Result()
    errors = decoder.found(mode == "subset")
    if errors:
        result.diagnosis = {**errors[0].as_dict(), "lost": decoder.lost}
        result.exit_code = EXIT_CODE[errors[0].error_class]
    for frame in decoder.frames:
        planes = canonical_planes(frame.shown(mode == "subset").gaussians, frame.plane_count)
        result.frames[frame.number] = planes
        result.floats[frame.number] = float_planes(decoder.sequence, planes).values()
    result.entropy = dict(entropy_states(data, decoder))
    return result


def entropy_states(data, decoder):
    """The units of a stream that have one, as far as the stream can be followed."""
    at, index = c.FILE_HEADER_BYTES, 0
    while decoder.file_header is not None and at < len(data):
        if decoder.coded.get(at):
            yield index, entropy_state(decoder.coded[at])
        try:
            at = parse_unit_header(data, at).end
        except StreamError:
            return
        index += 1


# ---- the protocol ----


def pack(kind, planes):
    return b"".join(struct.pack("<%d%s" % (len(plane), kind), *plane) for plane in planes)


def write(folder, name, content):
    with open(os.path.join(folder, name), "wb") as f:
        f.write(content)


def answer(path, op, mode, out):
    """Decodes a file, writes what is shown, gives exit code and diagnosis."""
    with open(path, "rb") as f:
        result = decode(f.read(), operating_point(op), mode)
    for number, planes in result.frames.items():
        for name, first, end in ATTRIBUTES:
            if name != "sh" or len(planes) > first:
                write(out, "f%04d.%s.i32" % (number, name), pack("i", planes[first:end]))
    for number, planes in result.floats.items():
        write(out, "f%04d.f32" % number, pack("f", planes))
    for unit, state in result.entropy.items():
        write(out, "u%04d.entropy" % unit, b"%016x" % state)
    return result.exit_code, result.diagnosis


def serve():
    """Answers `in TAB op TAB mode TAB out` with `exit-code [TAB JSON]`, line by line."""
    for line in sys.stdin:
        code, diagnosis = answer(*line.rstrip("\n").split("\t"))
        print(code if diagnosis is None else "%d\t%s" % (code, json.dumps(diagnosis)), flush=True)
    return 0


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--in", dest="path")
    parser.add_argument("--op", default="s3,t3,r9")
    parser.add_argument("--mode", default="full", choices=("full", "subset", "inside"))
    parser.add_argument("--out")
    parser.add_argument("--stdio", action="store_true")
    options = parser.parse_args()
    if options.stdio:
        return serve()
    if not options.path or not options.out:
        parser.error("give --in and --out, or --stdio")
    code, diagnosis = answer(options.path, options.op, options.mode, options.out)
    if diagnosis is not None:
        print(json.dumps(diagnosis), file=sys.stderr)
    return code


if __name__ == "__main__":
    sys.exit(main())
