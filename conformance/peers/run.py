#!/usr/bin/env python3
"""Codes scenes with other people's codecs: sizes, times and decoded PLYs, in DIR/peers.json (README.md)."""

import argparse
import importlib
import os
import sys

import tools as installed
from measure import Missing, one_core
from report import Report

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
PEERS = ["spz", "spz_gsply", "sog", "compressed_ply", "draco", "zstd", "xz", "splats4d"]


def main():
    arguments = parse()
    installed.enter(os.path.abspath(arguments.cache))
    one_core()
    report = Report(arguments.out)
    try:
        measure(arguments, report)
    except Missing as why:
        sys.exit("no reference: %s" % why)
    report.print_table()
    return 0 if report.results else 1


def parse():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="+", metavar="SCENE", help="a file, a SOG folder or a folder of frames")
    parser.add_argument("-o", dest="out", required=True, metavar="DIR", help="results are added to those it holds")
    parser.add_argument("--peers", default=",".join(PEERS), help="default: %(default)s")
    parser.add_argument("--only", default="", metavar="TEXT", help="only points whose options contain this")
    parser.add_argument("--repeat", type=int, default=3, help="times are medians of so many runs")
    parser.add_argument("--limit", type=int, default=1800, metavar="SECONDS", help="CPU seconds of a peer on Node")
    parser.add_argument("--dither", action="store_true", help="also code NAME_d, off the grid it was stored on")
    parser.add_argument("--splatstream", metavar="PATH", help="check that our reader agrees with every reference")
    parser.add_argument("--cache", default=os.path.join(ROOT, "target", "peers"), help="what is installed, and scratch")
    return parser.parse_args()


def measure(arguments, report):
    tools = installed.Tools(arguments.cache, arguments.repeat, arguments.limit)
    scenes = prepare(arguments, tools, report)
    for name in arguments.peers.split(","):
        report.forget(name, None)
        try:
            peer = ready(name, tools)
        except Missing as why:
            report.miss(name, None, str(why))
            continue
        for scene in scenes:
            for rate in peer.rates(scene):
                if arguments.only in rate.options:
                    record(peer, rate, scene, tools, report)


def prepare(arguments, tools, report):
    import scene as reference  # needs numpy: only now are we where it is installed

    scenes = []
    for source in arguments.scenes:
        for dithered in (False, True) if arguments.dither else (False,):
            scene = reference.prepare(source, os.path.join(arguments.out, "reference"), tools, dithered)
            if arguments.splatstream and not dithered:
                reference.check(scene, arguments.splatstream)
            report.scene(scene)
            scenes.append(scene)
    return scenes


def ready(name, tools):
    if name not in PEERS:
        raise Missing("there is no such peer here")
    peer = importlib.import_module(name)
    for package in peer.PACKAGES:
        tools.install(package)
    return peer


def record(peer, rate, scene, tools, report):
    report.forget(rate.peer, scene.name, rate.options)
    place, decoded = report.places(rate, scene)
    try:
        coded = peer.code(rate, scene, decoded, tools)
    except Missing as why:
        report.miss(rate.peer, scene.name, "%s: %s" % (rate.options, why))
    else:
        version = " ".join("%s %s" % (package.name, package.version) for package in peer.PACKAGES)
        report.result(rate, scene, coded, version, place)


if __name__ == "__main__":
    sys.exit(main())
