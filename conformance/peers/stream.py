#!/usr/bin/env python3
"""What playback is worth under our rule of adaptation, well-known rules and those of other players, over a folder of network
traces: runs stream/examples/qoe with the peers whose sources are given (README.md, Streaming)."""

import argparse
import os
import shlex
import subprocess
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
DASHJS = ["dynamic", "bola", "throughput", "l2a", "lolp"]
SABRE = ["bola", "bolae", "dynamic", "dynamicdash", "throughput"]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("traces", metavar="TRACES", help="a folder of CSV files: a line of titles, then seconds,Mbit/s")
    parser.add_argument("--dashjs-source", metavar="FOLDER", help="the source tree of dash.js 5; needs Node 20.6")
    parser.add_argument("--sabre-source", metavar="FOLDER", help="the source tree of sabre")
    parser.add_argument("--l3gs-source", metavar="FOLDER", help="the source tree of L3GS; needs numpy")
    parser.add_argument("--gops", type=int, default=240, metavar="N", help="seconds that are played of each presentation")
    parser.add_argument("--buffer", type=float, default=25, metavar="SECONDS", help="that are buffered at most")
    parser.add_argument("--latency", type=float, default=0.05, metavar="SECONDS", help="from a request to its first byte")
    parser.add_argument("--live", type=float, metavar="SECONDS", help="live, with this time from capture to display")
    parser.add_argument("--package", action="append", default=[], metavar="NAME=MANIFEST",
                        help="play this package, which has measured qualities (splatstream package --quality)")
    parser.add_argument("--csv", metavar="FILE", help="a line for each playback")
    arguments = parser.parse_args()
    command = ["cargo", "run", "--quiet", "--release", "-p", "splatstream-stream", "--example", "qoe", "--",
               os.path.abspath(arguments.traces), "--gops", str(arguments.gops), "--buffer", str(arguments.buffer),
               "--latency", str(arguments.latency)]
    if arguments.live:
        command += ["--live", str(arguments.live)]
    for package in arguments.package:
        name, _, manifest = package.partition("=")
        command += ["--package", f"{name}={os.path.abspath(manifest)}"]
    if arguments.csv:
        command += ["--csv", os.path.abspath(arguments.csv)]
    return subprocess.call(command + peers(arguments), cwd=HERE)


def peers(arguments):
    """The options that name the peers."""
    options = []
    if arguments.dashjs_source:
        for rule in DASHJS:
            options += peer("--peer", "dashjs_" + rule, "node", "stream_dashjs.mjs", arguments.dashjs_source, rule)
    if arguments.sabre_source:
        for rule in SABRE:
            options += peer("--peer", "sabre_" + rule, sys.executable, "stream_sabre.py", arguments.sabre_source, rule)
    if arguments.l3gs_source:
        options += peer("--partial-peer", "l3gs", sys.executable, "stream_l3gs.py", arguments.l3gs_source)
    return options


def peer(option, name, interpreter, script, source, *rest):
    words = [interpreter, os.path.join(HERE, script), os.path.abspath(source), *rest]
    if any(" " in word for word in words):
        sys.exit("a path with a space: %s" % shlex.join(words))
    return [option, "%s=%s" % (name, " ".join(words))]


if __name__ == "__main__":
    sys.exit(main())
