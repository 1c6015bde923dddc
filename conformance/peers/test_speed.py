#!/usr/bin/env python3
"""python3 -m unittest discover conformance/peers; no network, nothing is installed or compiled"""

import json
import os
import sys
import tempfile
import types
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

import contenders
import speed
import speed_table
import spz_native
from contenders import Case
from measure import Missing
from scene import Scene
from server import Server

def row(codec, work="decode", cpu_s=(1.0,), wall_s=(1.0,), **others):
    return dict({"scene": "a", "codec": codec, "work": work, "options": "", "threads": 1, "bytes": None,
                 "cpu_s": list(cpu_s), "wall_s": list(wall_s)}, **others)


class Servers(unittest.TestCase):
    def server(self, script):
        server = Server([sys.executable, "-c", script])
        self.addCleanup(server.close)
        return server

    def test_every_request_has_an_answer(self):
        server = self.server(
            "import sys\nfor line in sys.stdin: print('asked\\n{\"said\": \"%s\"}' % line.strip(), flush=True)")
        self.assertEqual(server.ask("one"), {"said": "one"})
        self.assertEqual(server.ask("two"), {"said": "two"})

    def test_what_has_been_asked_is_not_required_again(self):
        server = self.server("input(); print('{}', flush=True); input()")
        server.require("work")
        server.require("work")
        self.assertEqual(server.answers, {"work": {}})

    def test_a_program_that_ends_is_missing(self):
        with self.assertRaisesRegex(Missing, "exit 1: no scene"):
            self.server("import sys; sys.exit('no scene')").ask("work")
        with self.assertRaisesRegex(Missing, "not on this machine"):
            Server(["no-such-program-of-ours"]).ask("work")


class Tables(unittest.TestCase):
    def test_a_ratio_compares_what_was_measured_in_the_same_round(self):
        own, theirs = row("a", cpu_s=[1.0, 4.0, 2.0]), row("b", cpu_s=[2.0, 8.0, 2.0, 9.0])
        self.assertEqual(speed_table.ratio(own, theirs, "cpu_s"), 2.0)
        self.assertIsNone(speed_table.ratio(row("a", cpu_s=[0.0]), theirs, "cpu_s"))
        self.assertIsNone(speed_table.ratio(row("a", cpu_s=[]), theirs, "cpu_s"))

    def test_the_baseline_is_the_first_that_was_measured(self):
        rows = [row("ours"), row("second"), row("second", "encode")]
        name, found = speed_table.baseline_of(rows, ["first", "second"])
        self.assertEqual((name, set(found)), ("second", {"decode", "encode"}))
        self.assertEqual(speed_table.baseline_of(rows, ["first"]), (None, {}))

    def test_a_row_of_the_table(self):
        scene = {"scene": "a", "gaussians": 2_000_000, "frames": 1, "sh_degree": 2}
        rows = [row("SPZ", cpu_s=[2.0, 4.0, 3.0], wall_s=[4.0, 4.0, 4.0]),
                row("ours", cpu_s=[1.0, 1.0, 0.5], wall_s=[2.0, 2.0, 2.0], bytes=1_000_000, options="fast")]
        lines = speed_table.markdown(scene, rows, ["SPZ"]).splitlines()
        self.assertEqual(lines[0],
                         "**a**: 2,000,000 Gaussians, SH degree 2. Ratios are times as fast as SPZ.")
        self.assertEqual(len({line.count("|") for line in lines[2:]}), 1)
        self.assertEqual(lines[-1], "| decode | ours, fast | 1,000,000 | 4.0 | 2 | 4 | 1 | 1 | 4 | 4 | 2 |")

    def test_without_a_baseline_there_are_no_ratios(self):
        scene = {"scene": "a", "gaussians": 1_000_000, "frames": 3, "sh_degree": 0}
        lines = speed_table.markdown(scene, [row("ours")], ["SPZ"]).splitlines()
        self.assertIn("3 frames", lines[0])
        self.assertEqual(lines[-1], "| decode | ours |  |  | 1 | 1 | 1 | 1 |  |  |  |")


class Runs(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.run = speed.Run.__new__(speed.Run)
        self.run.arguments = types.SimpleNamespace(repeat=3, only="", codecs=None, out=folder.name, spz_source=None)
        self.run.contenders = contenders
        self.run.scenes, self.run.results, self.run.missing = [], [], []
        self.scene = Scene("a", "a.ply", ["a.ply"], [10], 0, False)
        self.order = []

    def case(self, codec, seconds=0.1, fails=False):
        def measure():
            self.order.append(codec)
            if fails:
                raise Missing("it fails")
            return {"cpu_s": seconds, "wall_s": seconds, "bytes": 5}

        return Case(codec, "decode", "", 1, measure)

    def test_codecs_take_turns(self):
        self.run.rounds(self.scene, [[self.case("a"), self.case("b")]])
        self.assertEqual(self.order, ["a", "a", "b", "b"] * 3)
        self.assertEqual([len(row["cpu_s"]) for row in self.run.results], [3, 3])

    def test_what_is_decoded_counts_the_second_time(self):
        seconds = iter([9.0, 1.0, 8.0, 2.0, 7.0, 3.0])
        case = Case("a", "decode", "", 1, lambda: {"cpu_s": 1.0, "wall_s": next(seconds), "bytes": 5})
        self.run.rounds(self.scene, [[case]])
        self.assertEqual(self.run.results[0]["wall_s"], [1.0, 2.0, 3.0])

    def test_what_is_fast_counts_after_some_time(self):
        seconds = iter([0.0625] * 3 + [0.03125] + [0.25, 0.5])
        case = Case("a", "decode", "", 1, lambda: {"cpu_s": 1.0, "wall_s": next(seconds), "bytes": 5})
        self.assertEqual(speed.measured(case)["wall_s"], 0.03125)
        self.assertEqual(speed.measured(case)["wall_s"], 0.5)

    def test_what_is_slow_is_done_once(self):
        self.run.rounds(self.scene, [[self.case("slow", seconds=100), self.case("b")]])
        self.assertEqual(self.order, ["slow"] + ["b"] * 6)

    def test_what_fails_is_missing_and_the_others_go_on(self):
        self.run.rounds(self.scene, [[self.case("bad", fails=True), self.case("b")]])
        self.run.scenes.append({"scene": "a", "source": "a.ply", "gaussians": 10, "frames": 1, "sh_degree": 0})
        self.run.save()
        self.assertEqual(self.order, ["bad"] + ["b"] * 6)
        with open(os.path.join(self.run.arguments.out, "speed.json")) as file:
            report = json.load(file)
        self.assertEqual([row["codec"] for row in report["results"]], ["b"])
        self.assertEqual(report["missing"], [{"what": "bad, decode", "scene": "a", "why": "it fails"}])
        with open(os.path.join(self.run.arguments.out, "speed.md")) as file:
            self.assertIn("- missing: bad, decode, because it fails", file.read())

    def test_a_codec_that_cannot_be_had_is_missing(self):
        self.run.arguments.codecs = "nothing,splats4d"
        setup = contenders.Setup(None, None, {}, [])
        self.assertEqual(self.run.cases(self.scene, setup), [[], []])
        self.assertEqual([missing["why"] for missing in self.run.missing],
                         ["there is no such codec here", "it takes sequences only"])


class Ours(unittest.TestCase):
    def test_every_build_is_measured_with_the_same_requests(self):
        setup = contenders.Setup(None, None, {"before": "/a", "after": "/b"}, [])
        cases = contenders.ours(Scene("a", "a.ply", ["a.ply"], [10], 0, False), setup)
        names = {codec: [case.name.split(", ", 1)[1] for case in cases if case.codec == codec]
                 for codec in ("before", "after")}
        self.assertEqual(names["before"], names["after"])
        self.assertEqual(len(names["before"]), len(set(names["before"])))
        self.assertEqual([server.command for server in setup.servers], [["/a", "a.ply"], ["/b", "a.ply"]])

    def test_a_program_is_started_once_for_a_scene(self):
        setup = contenders.Setup(None, None, {"ours": "/a"}, [])
        scene = Scene("a", "a.ply", ["a.ply"], [10], 0, False)
        self.assertIs(setup.timer("ours", scene), setup.timer("ours", scene))
        self.assertIsNot(setup.timer("ours", scene), setup.server(["/a"]))


class SpzSources(unittest.TestCase):
    def test_a_folder_without_the_sources_is_missing(self):
        with tempfile.TemporaryDirectory() as folder:
            with self.assertRaisesRegex(Missing, "load-spz.cc is not among the sources"):
                spz_native.timer(folder, folder)

    def test_the_version_says_where_the_sources_are_from(self):
        self.assertIn(spz_native.COMMIT[:9], spz_native.version())
        with tempfile.TemporaryDirectory() as folder:
            self.assertEqual(spz_native.version(folder), "spz from a folder")


if __name__ == "__main__":
    unittest.main()
