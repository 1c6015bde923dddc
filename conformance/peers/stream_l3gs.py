#!/usr/bin/env python3
"""The scheduler of L3GS, from its source tree, as a peer of stream/examples/qoe (README.md, Streaming):

    stream_l3gs.py FOLDER

L3GS fills a slot of time with layers of objects by a knapsack of their utilities. Here the objects are the next GOPs, the
layers are the operating points offered, their utility is the quality in dB above the least, and the slot is as long as
these GOPs. Its selector and its predictor of bandwidth are its own. Needs numpy.
"""

import importlib.util
import json
import os
import statistics
import sys
import types

AHEAD = 5  # GOPs of a slot
CAPACITY = 60  # units into which a slot is divided: its selector takes integers


def load(folder, name):
    spec = importlib.util.spec_from_file_location(name, os.path.join(folder, name + ".py"))
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


class Peer:
    def __init__(self, folder):
        if importlib.util.find_spec("scipy") is None:  # of which the predictor needs the harmonic mean alone
            stats = types.ModuleType("scipy.stats")
            stats.hmean = lambda values: statistics.harmonic_mean(values) if len(values) else float("nan")
            sys.modules.update({"scipy": types.ModuleType("scipy"), "scipy.stats": stats})
        self.selector = load(folder, "SplatSelector").SplatSelector
        self.predictor = load(folder, "BandwidthPredictor").BandwidthPredictor()
        self.samples = []

    def begin(self, question):
        self.bitrates, self.seconds = question["bitrates"], question["gop_seconds"]
        least = question["qualities"][0]
        self.utility = [1 + round(10 * (quality - least)) for quality in question["qualities"]]
        self.gops = question["gops"]
        return {}

    def pick(self, question):
        if "transfer" in question:
            transfer = question["transfer"]
            self.samples.append(8e-6 * transfer["bytes"] / transfer["duration"])
        return {"rung": self.rung(question) if self.samples else 0, "wait": 0}

    def rung(self, question):
        # The predictor compares its last prediction with the sample at the present, and averages those before.
        self.predictor.bwGroundTruth = self.samples + self.samples[-1:]
        rate = 1e6 * self.predictor.get_predicted_bandwidth(self.predictor.getUnitInMs() * len(self.samples))
        ahead = min(AHEAD, self.gops - question["gop"])
        budget = max(rate * self.seconds * ahead / 8, 1)
        mean = [rate * self.seconds / 8 for rate in self.bitrates]
        sizes = [question["bytes"]] + [mean] * (ahead - 1)
        unit = budget / CAPACITY
        sizes = [[max(1, -int(-size // unit)) for size in gop] for gop in sizes]
        chosen = self.selector([self.utility] * ahead, sizes, CAPACITY).solve_multiple_choice_knapsack()
        return max(sum(chosen[0]) - 1, 0)

    def watch(self, question):
        return {}


def main():
    answers = sys.stdout
    with open(os.devnull, "w") as nowhere:
        sys.stdout = nowhere  # its files print
        peer = Peer(sys.argv[1])
        ask = {"begin": peer.begin, "pick": peer.pick, "progress": peer.watch}
        for line in sys.stdin:
            question = json.loads(line)
            print(json.dumps(ask[question["ask"]](question)), file=answers, flush=True)


if __name__ == "__main__":
    main()
