#!/usr/bin/env python3
"""Command line of the decoder: decode.py IN.gss [--op s0,t0,r2] [--out DIR] [--float] [--json]

Exit code: that of the class of the verdict (9.1), 0 if the stream is accepted, 2 wrong usage, 1 other.
"""

import argparse
import json
import re
import sys
import time

from decoding import Decoder
from errors import EXIT_CODE
from extraction import extract
from output import write_frame


def operating_point(text):
    """7.11"""
    match = re.fullmatch(r"s(\d+),t(\d+),r(\d+)", text)
    if match is None:
        raise argparse.ArgumentTypeError("an operating point is written like s0,t0,r2")
    return tuple(int(number) for number in match.groups())


def report(decoder):
    verdict = decoder.errors[0] if decoder.errors else None
    result = {"outcome": "reject" if verdict else "accept"}
    if verdict:
        result.update(verdict.as_dict())
    result["frames"] = [{"frame": f.number, "gaussians": f.gaussians, "refinements": f.refinements,
                         "digest": "%016x" % f.digest()} for f in decoder.frames]
    if len(decoder.errors) > 1:
        result["errors"] = [error.as_dict() for error in decoder.errors]
    return result


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("input")
    parser.add_argument("--op", type=operating_point, default=None, help="for example s0,t0,r2")
    parser.add_argument("--out", help="folder for the canonical planes")
    parser.add_argument("--float", action="store_true", help="with --out: also the f32 attributes")
    parser.add_argument("--json", action="store_true", help="print the result as JSON (always done)")
    parser.add_argument("--inside", action="store_true", help="the input starts at a later GOP (B.3)")
    parser.add_argument("--extract", metavar="FILE", help="write the extraction at --op (7.11)")
    parser.add_argument("--time", action="store_true", help="print the speed on stderr")
    options = parser.parse_args()
    with open(options.input, "rb") as f:
        data = f.read()
    op_r = options.op[2] if options.op else None
    begin = time.time()
    decoder = Decoder(data, op_r, options.inside).decode()
    seconds = time.time() - begin
    result = report(decoder)
    print(json.dumps(result))
    if options.time:
        count = sum(f.gaussians for f in decoder.frames)
        print("%.2f s, %.0f Gaussians/s" % (seconds, count / seconds), file=sys.stderr)
    if options.out:
        for frame in decoder.frames:
            write_frame(options.out, frame, decoder.sequence, options.float)
    if options.extract and not decoder.errors:
        with open(options.extract, "wb") as f:
            f.write(extract(data, op_r))
    return EXIT_CODE[result["class"]] if decoder.errors else 0


if __name__ == "__main__":
    sys.exit(main())
