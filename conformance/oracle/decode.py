#!/usr/bin/env python3
"""Command line of the decoder: decode.py IN.gss [--op s0,t0,r2] [--out DIR] [--float] [--json]

Exit code: that of the class of the verdict (9.1), 0 if the stream is accepted, 2 wrong usage, 1 other.
"""

import argparse
import hashlib
import json
import os
import re
import sys
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))

from oracle.decoding import Decoder
from oracle.errors import EXIT_CODE
from oracle.extraction import extract
from oracle.lists import canonical_planes, lists_digest
from oracle.output import write_frame
from oracle.points import EVERYTHING
from oracle.reconstruction import i32le


def operating_point(text):
    """7.11"""
    match = re.fullmatch(r"s(\d+),t(\d+),r(\d+)", text)
    if match is None:
        raise argparse.ArgumentTypeError("an operating point is written like s0,t0,r2")
    return tuple(int(number) for number in match.groups())


def report(decoder, subset=False):
    errors = decoder.found(subset)
    verdict = errors[0] if errors else None
    result = {"outcome": "reject" if verdict else "accept"}
    if verdict:
        result.update(verdict.as_dict())
    result["frames"] = [frame_record(f, subset) for f in decoder.frames]
    if decoder.lost:
        result["lost"] = decoder.lost
    if len(errors) > 1:
        result["errors"] = [error.as_dict() for error in errors]
    return result


def hexadecimal(digest):
    return "%016x" % digest


def frame_record(frame, subset):
    shown = frame.shown(subset)
    exact = frame.exact_lists()
    planes = canonical_planes(shown.gaussians, frame.plane_count)
    carried = frame.carried_digest() if frame.has_carried() else None
    return {"frame": frame.number, "type": "IPB"[frame.frame_type], "lost": frame.lost, "refinements": len(exact),
            "gaussians": len(shown.gaussians), "exact": shown.exact, "carried": shown.carried,
            "digest": hexadecimal(lists_digest(exact, frame.plane_count)),
            "carried_digest": None if carried is None else hexadecimal(carried), "shown": sha256_of_planes(planes)}


def sha256_of_planes(planes):
    """SHA-256 of the planes as they are written by --out, one after the other."""
    return hashlib.sha256(b"".join(i32le(plane) for plane in planes)).hexdigest()


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("input")
    parser.add_argument("--op", type=operating_point, default=None, help="for example s0,t0,r2")
    parser.add_argument("--out", help="folder for the canonical planes")
    parser.add_argument("--float", action="store_true", help="with --out: also the f32 attributes")
    parser.add_argument("--json", action="store_true", help="print the result as JSON (always done)")
    parser.add_argument("--inside", type=int, metavar="OFFSET", help="start at the gop_header at this offset (B.3)")
    parser.add_argument("--extract", metavar="FILE", help="write the extraction at --op (7.11)")
    parser.add_argument("--subset", action="store_true", help="show exact Gaussians only (7.8.2)")
    parser.add_argument("--time", action="store_true", help="print the speed on stderr")
    options = parser.parse_args()
    with open(options.input, "rb") as f:
        data = f.read()
    begin = time.time()
    decoder = Decoder(data, options.op, options.inside).decode()
    seconds = time.time() - begin
    result = report(decoder, options.subset)
    print(json.dumps(result))
    if options.time:
        count = sum(f["gaussians"] for f in result["frames"])
        print("%.2f s, %.0f Gaussians/s" % (seconds, count / seconds), file=sys.stderr)
    if options.out:
        for frame in decoder.frames:
            planes = canonical_planes(frame.shown(options.subset).gaussians, frame.plane_count)
            write_frame(options.out, frame.number, planes, decoder.sequence, options.float)
    if options.extract and not decoder.errors:
        with open(options.extract, "wb") as f:
            f.write(extract(data, options.op or EVERYTHING))
    return EXIT_CODE[result["class"]] if "class" in result else 0


if __name__ == "__main__":
    sys.exit(main())
