#!/usr/bin/env python3
"""Rules of sabre, from its source tree, as a peer of stream/examples/qoe (README.md, Streaming):

    stream_sabre.py FOLDER bola|bolae|dynamic|dynamicdash|throughput

Its rules and its average of throughput are its own, with the defaults of its command line; its simulator is not used.
"""

import importlib.util
import json
import math
import os
import sys


def load(folder):
    path = os.path.join(folder, "src", "sabre.py")
    spec = importlib.util.spec_from_file_location("sabre", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


class Peer:
    """sabre counts in bits, milliseconds and kbit/s."""

    def __init__(self, folder, rule):
        self.sabre, self.name = load(folder), rule
        self.buffer = 0
        self.sabre.get_buffer_level = lambda: self.buffer
        self.last = None  # what was picked

    def begin(self, question):
        bitrates = [rate / 1000 for rate in question["bitrates"]]
        utilities = [math.log(rate / bitrates[0]) for rate in bitrates]
        segment = 1000 * question["gop_seconds"]
        self.sabre.manifest = self.sabre.ManifestInfo(segment_time=segment, bitrates=bitrates, utilities=utilities,
                                                      segments=[None] * question["gops"])
        self.sabre.SessionInfo.manifest = self.sabre.manifest
        self.sabre.verbose, self.sabre.buffer_contents, self.sabre.buffer_fcc = False, [], 0
        full = 1000 * question["full_seconds"]
        self.sabre.max_buffer_size = full
        config = {"buffer_size": full, "gp": 5, "abr_osc": False, "abr_basic": False, "no_ibr": False}
        kind = self.sabre.abr_list[self.name]
        kind.use_abr_o, kind.use_abr_u = False, True
        self.rule = kind(config)
        self.average = self.sabre.Ewma({"half_life": [3, 8]})
        return {}

    def pick(self, question):
        if "transfer" in question:
            self.loaded(question)
        if question["gop"] == 0:
            rung, delay = self.rule.get_first_quality(), 0
        else:
            rung, delay = self.rule.get_quality_delay(question["gop"])
        self.last = rung
        return {"rung": rung, "wait": delay / 1000}

    def loaded(self, question):
        transfer = question["transfer"]
        latency, duration = 1000 * transfer["latency"], 1000 * transfer["duration"]
        bits = 8 * transfer["bytes"]
        self.average.push(duration, bits / duration, latency)
        # The rule is told when the transfer ended, and then how long the player waited for room.
        now = self.buffer
        idle = 1000 * (question["now"] - transfer["sent"]) - latency - duration
        self.buffer = now + max(idle, 0)
        self.rule.report_download(self.progress(self.last, bits, bits, latency + duration, latency), False)
        self.buffer = now
        if idle > 1:
            self.rule.report_delay(idle)

    def progress(self, rung, size, downloaded, time, latency, abandon=None):
        return self.sabre.DownloadProgress(index=0, quality=rung, size=size, downloaded=downloaded, time=time,
                                           time_to_first_bit=latency, abandon_to_quality=abandon)

    def watch(self, question):
        request = question["request"]
        time, latency = 1000 * (question["now"] - request["sent"]), 1000 * (request["first"] - request["sent"])
        # sabre never gives up the first segment: nothing has been measured.
        if question["gop"] == 0 or request["received"] == 0 or time <= latency:
            return {}
        size, downloaded = 8 * request["bytes"], 8 * request["received"]
        metrics = self.progress(self.last, size, downloaded, time, latency)
        to = self.rule.check_abandon(metrics, self.buffer)
        if to is None:
            return {}
        self.rule.report_download(self.progress(self.last, size, downloaded, time, latency, to), False)
        # As written, sabre does not go on with that quality: it asks the rule again.
        self.last, _ = self.rule.get_quality_delay(question["gop"])
        return {"rung": self.last}


def main():
    folder, rule = sys.argv[1:]
    answers = sys.stdout
    with open(os.devnull, "w") as nowhere:
        sys.stdout = nowhere  # sabre prints
        peer = Peer(folder, rule)
        ask = {"begin": peer.begin, "pick": peer.pick, "progress": peer.watch}
        for line in sys.stdin:
            question = json.loads(line)
            peer.buffer = 1000 * question.get("buffer", 0)
            print(json.dumps(ask[question["ask"]](question)), file=answers, flush=True)


if __name__ == "__main__":
    main()
