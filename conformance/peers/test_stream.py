#!/usr/bin/env python3
"""Peers of streaming, against stand-ins for the sources that they load."""

import json
import os
import subprocess
import sys
import tempfile
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))

SABRE = '''
from collections import namedtuple
ManifestInfo = namedtuple("ManifestInfo", "segment_time bitrates utilities segments")
DownloadProgress = namedtuple("DownloadProgress", "index quality size downloaded time time_to_first_bit abandon_to_quality")
class SessionInfo: pass
class Ewma:
    def __init__(self, config): self.seen = []
    def push(self, time, throughput, latency): self.seen.append((time, throughput, latency))
class Rule:
    def __init__(self, config): self.delays = 0
    def get_first_quality(self): return 0
    def get_quality_delay(self, segment):
        print("sabre prints")
        return (1, 1500 + self.delays) if get_buffer_level() > 4000 else (0, 0)
    def report_delay(self, delay): self.delays += delay
    def report_download(self, metrics, replaced): self.last = metrics
    def check_abandon(self, progress, level): return 0 if progress.downloaded < progress.size / 4 else None
abr_list = {"rule": Rule}
'''

SELECTOR = '''
print("example")
class SplatSelector:
    def __init__(self, utility, size, budget): self.size, self.budget = size, budget
    def solve_multiple_choice_knapsack(self):
        share = self.budget // len(self.size)
        return [[int(layer <= share) for layer in layers] for layers in self.size]
'''

PREDICTOR = '''
class BandwidthPredictor:
    bwGroundTruth = []
    def getUnitInMs(self): return 50
    def get_predicted_bandwidth(self, time): return self.bwGroundTruth[time // 50]
'''

BEGIN = {"ask": "begin", "gop_seconds": 1, "gops": 9, "full_seconds": 25, "bitrates": [1e6, 2e6, 4e6],
         "qualities": [20, 25, 30]}


def pick(gop, buffer, now=0.0, transfer=None):
    question = {"ask": "pick", "gop": gop, "buffer": buffer, "now": now, "last": 0, "bytes": [125000, 250000, 500000]}
    return dict(question, transfer=transfer) if transfer else question


def transfer(duration, megabits):
    return {"sent": 0.0, "latency": 0.1, "duration": duration, "bytes": int(megabits * 125000)}


class Peers(unittest.TestCase):
    def talk(self, script, files, arguments, questions):
        with tempfile.TemporaryDirectory() as folder:
            for name, text in files.items():
                path = os.path.join(folder, name)
                os.makedirs(os.path.dirname(path), exist_ok=True)
                with open(path, "w") as file:
                    file.write(text)
            lines = "".join(json.dumps(question) + "\n" for question in questions)
            done = subprocess.run([sys.executable, os.path.join(HERE, script), folder, *arguments], input=lines, text=True,
                                  capture_output=True, timeout=60)
        self.assertEqual(done.returncode, 0, done.stderr)
        return [json.loads(line) for line in done.stdout.splitlines()]

    def test_sabre_is_asked_in_its_units(self):
        slow = {"ask": "progress", "gop": 2, "buffer": 6, "now": 3.0, "last": 1, "bytes": [1, 2, 3],
                "request": {"sent": 2.0, "first": 2.1, "received": 10, "bytes": 1000}}
        first = dict(slow, gop=0)
        answers = self.talk("stream_sabre.py", {"src/sabre.py": SABRE}, ["rule"], [
            BEGIN, pick(0, 0), first, pick(1, 3, 0.6, transfer(0.5, 1)), pick(2, 6, 2.6, transfer(0.5, 1)), slow])
        # The last pick waits 1.5 s and what the player idled before, 2 s.
        self.assertEqual(answers, [{}, {"rung": 0, "wait": 0}, {}, {"rung": 0, "wait": 0}, {"rung": 1, "wait": 3.5},
                                   {"rung": 1}])

    def test_the_slot_of_l3gs_is_what_the_network_carries(self):
        files = {"SplatSelector.py": SELECTOR, "BandwidthPredictor.py": PREDICTOR}
        answers = self.talk("stream_l3gs.py", files, [], [
            BEGIN, pick(0, 0), pick(1, 3, 0.6, transfer(1.0, 2.2)), pick(2, 3, 0.6, transfer(0.5, 4))])
        self.assertEqual([answer.get("rung") for answer in answers], [None, 0, 1, 2])


if __name__ == "__main__":
    unittest.main()
