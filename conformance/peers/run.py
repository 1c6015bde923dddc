#!/usr/bin/env python3
"""Codes scenes with other people's codecs: sizes, times and decoded PLYs, in DIR/peers.json (README.md)."""

import argparse
import importlib
import json
import os
import sys

import tools as installed
from measure import Missing, one_core

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
PEERS = ["spz", "sog"]


def main():
    arguments = parse()
    installed.enter(os.path.abspath(arguments.cache))
    one_core()
    report = measure(arguments)
    print_table(report)
    return 1 if not report["results"] else 0


def parse():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="+", metavar="SCENE", help="a file, a SOG folder or a folder of frames")
    parser.add_argument("-o", dest="out", required=True, metavar="DIR")
    parser.add_argument("--peers", default=",".join(PEERS), help="default: %(default)s")
    parser.add_argument("--repeat", type=int, default=3, help="times are medians of so many runs")
    parser.add_argument("--dither", action="store_true", help="also code NAME_d, off the grid it was stored on")
    parser.add_argument("--cache", default=os.path.join(ROOT, "target", "peers"), help="what is installed, and scratch")
    return parser.parse_args()


def measure(arguments):
    tools = installed.Tools(arguments.cache, arguments.repeat)
    report = {"version": 1, "scenes": [], "results": [], "missing": []}
    scenes = prepare(arguments, tools, report)
    for name in arguments.peers.split(","):
        try:
            peer = ready(name, tools)
        except Missing as why:
            report["missing"].append({"peer": name, "scene": None, "why": str(why)})
            continue
        for scene in scenes:
            for rate in peer.rates(scene):
                record(peer, rate, scene, arguments, tools, report)
    save(report, arguments.out)
    return report


def prepare(arguments, tools, report):
    from scene import prepare as reference
    import transform

    tools.install(transform.TRANSFORM)
    scenes = []
    for source in arguments.scenes:
        for dithered in (False, True) if arguments.dither else (False,):
            scene = reference(source, os.path.join(arguments.out, "reference"), tools, dithered)
            path = os.path.dirname(scene.paths[0]) if scene.sequence else scene.paths[0]
            report["scenes"].append({"scene": scene.name, "source": source, "gaussians": scene.gaussians,
                                     "reference": os.path.relpath(path, arguments.out), "frames": len(scene.paths)})
            scenes.append(scene)
    return scenes


def ready(name, tools):
    if name not in PEERS:
        raise Missing("there is no such peer here")
    peer = importlib.import_module(name)
    for package in peer.PACKAGES:
        tools.install(package)
    return peer


def record(peer, rate, scene, arguments, tools, report):
    label = "%s.%s.%s" % (scene.name, rate.peer, rate.options)
    label = "".join(c if c.isalnum() or c in "._-" else "_" for c in label)
    place = os.path.join("decoded", label if scene.sequence else label + ".ply")
    folder = os.path.join(arguments.out, place) if scene.sequence else os.path.join(arguments.out, "decoded")
    os.makedirs(folder, exist_ok=True)
    decoded = [os.path.join(folder, os.path.basename(path) if scene.sequence else os.path.basename(place))
               for path in scene.paths]
    try:
        coded = peer.code(rate, scene, decoded, tools)
    except Missing as why:
        report["missing"].append({"peer": rate.peer, "scene": scene.name, "why": "%s: %s" % (rate.options, why)})
    else:
        report["results"].append({
            "scene": scene.name, "peer": rate.peer, "options": rate.options, "bytes": coded.bytes,
            "version": " ".join("%s %s" % (package.name, package.version) for package in peer.PACKAGES),
            "gaussians": coded.gaussians, "frames": len(scene.paths), "encode_s": round(coded.encode_s, 4),
            "decode_s": round(coded.decode_s, 4), "timing": coded.timing, "decoded": place, "command": coded.command})
    save(report, arguments.out)


def save(report, folder):
    with open(os.path.join(folder, "peers.json"), "w") as file:
        json.dump(report, file, indent=1)
        file.write("\n")


def print_table(report):
    gaussians = {scene["scene"]: scene["gaussians"] for scene in report["scenes"]}
    row = "%-22s %-34s %-14s %10s %8s %9s %9s"
    print(row % ("peer", "options", "scene", "bytes", "BPG", "encode s", "decode s"))
    for r in report["results"]:
        bits = 8 * r["bytes"] / gaussians[r["scene"]]
        print(row % (r["peer"], r["options"], r["scene"], r["bytes"], "%.1f" % bits, r["encode_s"], r["decode_s"]))
    for missing in report["missing"]:
        print("missing: %(peer)s, scene %(scene)s: %(why)s" % missing)


if __name__ == "__main__":
    sys.exit(main())
