#!/usr/bin/env python3
"""How fast this codec and others are on the same scenes, memory to memory, all in one run: in each round each of them codes
the scene, so that what else the machine does hits all alike. Writes DIR/speed.json and DIR/speed.md (README.md)."""

import argparse
import json
import os
import platform
import sys

import tools as installed
from measure import SLOW, Missing
from speed_table import markdown

AWAKE = 0.2  # seconds of decoding before a sample counts

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")


def main():
    arguments = parse()
    installed.enter(os.path.abspath(arguments.cache))
    run = Run(arguments)
    try:
        run.measure()
    except Missing as why:
        sys.exit("nothing can be measured: %s" % why)
    return 0 if run.results else 1


def parse():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="+", metavar="SCENE", help="a file, a SOG folder or a folder of frames")
    parser.add_argument("-o", dest="out", default=os.path.join(ROOT, "target", "speed"), metavar="DIR",
                        help="default: target/speed")
    parser.add_argument("--repeat", type=int, default=7, metavar="N", help="rounds; what takes a minute is done once")
    parser.add_argument("--codecs", metavar="NAMES", help="of ours, spz, spz_wasm, ours_wasm, sog, splats4d; default: all")
    parser.add_argument("--only", default="", metavar="TEXT", help="only what has this in its name, such as decode")
    parser.add_argument("--spz-source", metavar="FOLDER", help="the repository of SPZ; otherwise it is fetched")
    parser.add_argument("--ours", action="append", default=[], metavar="NAME=TIMER",
                        help="a build of the example `speed`, as often as there are builds to compare; default: this tree")
    parser.add_argument("--cache", default=os.path.join(ROOT, "target", "peers"), help="what is installed, and scratch")
    return parser.parse_args()


class Run:
    def __init__(self, arguments):
        import contenders  # needs numpy: only now are we where it is installed

        self.arguments = arguments
        self.contenders = contenders
        self.tools = installed.Tools(arguments.cache, 1, None)
        self.scenes, self.results, self.missing = [], [], []

    def measure(self):
        import scene as reference

        timers = dict(pair.split("=", 1) for pair in self.arguments.ours)
        timers = timers or {"ours": self.contenders.built_timer()}
        for source in self.arguments.scenes:
            scene = reference.prepare(source, os.path.join(self.arguments.out, "reference"), self.tools, False)
            self.scenes.append({"scene": scene.name, "source": source, "gaussians": scene.gaussians,
                                "frames": len(scene.paths), "sh_degree": scene.degree})
            setup = self.contenders.Setup(self.tools, self.arguments.spz_source, timers, [])
            try:
                self.rounds(scene, self.cases(scene, setup))
            finally:
                for server in setup.servers:
                    server.close()
            self.save()
            print(self.table(self.scenes[-1]), flush=True)

    def cases(self, scene, setup):
        """What is measured of a scene. Encoding comes first, then decoding."""
        names = (self.arguments.codecs or ",".join(self.contenders.CONTENDERS)).split(",")
        cases = []
        for name in names:
            try:
                if name not in self.contenders.CONTENDERS:
                    raise Missing("there is no such codec here")
                cases += self.contenders.CONTENDERS[name](scene, setup)
            except Missing as why:
                self.miss(name, scene, why)
        cases = [case for case in cases if self.arguments.only in case.name]
        return [[case for case in cases if case.work == work] for work in ("encode", "decode")]

    def rounds(self, scene, groups):
        for cases in groups:
            rows = {case: self.row(scene, case) for case in cases}
            for _ in range(self.arguments.repeat):
                for case, row in list(rows.items()):
                    try:
                        if not add(row, measured(case)):
                            del rows[case]
                    except Missing as why:
                        self.miss(case.name, scene, why)
                        del rows[case]

    def row(self, scene, case):
        row = {"scene": scene.name, "codec": case.codec, "work": case.work, "options": case.options,
               "threads": case.threads, "bytes": None, "cpu_s": [], "wall_s": []}
        self.results.append(row)
        return row

    def miss(self, what, scene, why):
        self.missing.append({"what": what, "scene": scene.name, "why": str(why)})

    def table(self, scene):
        rows = [row for row in self.results if row["scene"] == scene["scene"] and row["cpu_s"]]
        lines = [markdown(scene, rows, [self.contenders.SPZ_NATIVE, self.contenders.SPZ_WASM]), ""]
        lines += ["- missing: %(what)s, because %(why)s" % missing for missing in self.missing
                  if missing["scene"] == scene["scene"]]
        return "\n".join(lines) + "\n"

    def save(self):
        self.results = [row for row in self.results if row["cpu_s"]]
        report = {"version": 1, "machine": machine(), "spz": self.contenders.spz_native.version(self.arguments.spz_source),
                  "scenes": self.scenes, "results": self.results, "missing": self.missing}
        with open(os.path.join(self.arguments.out, "speed.json"), "w") as file:
            json.dump(report, file, indent=1)
            file.write("\n")
        with open(os.path.join(self.arguments.out, "speed.md"), "w") as file:
            file.write("\n".join(self.table(scene) for scene in self.scenes))


def measured(case):
    """A sample of a case. What is decoded is decoded again for AWAKE seconds, twice at least, and the last time counts: whoever decodes
    frame after frame has memory at hand and threads on processors of their own, and programs that take turns have not. What is
    slow needs neither."""
    sample = case.measure()
    if case.work != "decode" or sample["wall_s"] >= SLOW:
        return sample
    spent = sample["wall_s"]
    while True:
        sample = case.measure()
        spent += sample["wall_s"]
        if spent >= AWAKE:
            return sample


def add(row, sample):
    """Notes a sample; says whether there is time for another one."""
    row["bytes"] = sample.get("bytes", row["bytes"])
    row["cpu_s"].append(sample["cpu_s"])
    row["wall_s"].append(sample["wall_s"])
    return max(sample["cpu_s"], sample["wall_s"]) <= SLOW


def machine():
    """What the figures were measured on."""
    processor = platform.processor()
    if os.path.exists("/proc/cpuinfo"):
        with open("/proc/cpuinfo") as file:
            names = [line.split(":", 1)[1].strip() for line in file if line.startswith("model name")]
        processor = names[0] if names else processor
    return {"processor": processor, "cores": os.cpu_count(), "system": platform.platform()}


if __name__ == "__main__":
    sys.exit(main())
