"""Tests of the runner in Python and of the suites for fluster: python3 -m unittest discover conformance/kit"""

import contextlib
import hashlib
import importlib.util
import io
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import unittest
import unittest.mock
import zipfile

HERE = os.path.dirname(os.path.abspath(__file__))
VECTORS = os.path.join(HERE, "..", "vectors")
ADAPTER = os.path.join(HERE, "..", "adapters", "python", "adapter.py")
sys.path[:0] = [os.path.join(HERE, "runner"), os.path.join(HERE, "fluster"), HERE]


import make
import submit
from suite import Suite

spec = importlib.util.spec_from_file_location("runner_program", os.path.join(HERE, "runner", "__main__.py"))
runner = importlib.util.module_from_spec(spec)
spec.loader.exec_module(runner)

# A decoder that is right, and then does something else: `after` has the folder as `out`, and may end the program.
PLANTED = """
import os, subprocess, sys, time
path, op, mode, out = sys.argv[1:]
ended = subprocess.run([sys.executable, %r, "--in", path, "--op", op, "--mode", mode, "--out", out])
%s
sys.exit(ended.returncode)
"""


def run(words):
    """Exit code, text, and report of the runner."""
    with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(io.StringIO()) as said:
        report = os.path.join(folder, "report.json")
        code = runner.main([*words, "--report", report])
        with open(report, encoding="utf-8") as f:
            return code, said.getvalue(), json.load(f)


class Runner(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp()
        self.addCleanup(shutil.rmtree, self.folder)

    def decoder(self, after):
        path = os.path.join(self.folder, "decoder.py")
        with open(path, "w", encoding="utf-8") as f:
            f.write(PLANTED % (ADAPTER, after))
        return "%s %s {in} {op} {mode} {out}" % (sys.executable, path)

    def labels(self, after, case="codebook-two-bytes", *words):
        _, _, report = run(["--decoder", self.decoder(after), "--filter", case, "--jobs", "1", *words])
        return {row.get("reason", row["outcome"]) for row in report["cases"]}

    def test_a_right_decoder_passes_valid_broken_cut_and_inner_streams(self):
        words = ["--stdio", "%s %s --stdio" % (sys.executable, ADAPTER), "--strict", "--time", "60", "--jobs", "2"]
        code, said, report = run(words + ["--filter", "inside-*", "--filter", "codebook-two-*", "--filter", "bytes-every-prefix"])
        self.assertEqual(code, 0, said)
        self.assertEqual({row["outcome"] for row in report["cases"]}, {"pass"})
        self.assertEqual(len(report["cases"]), report["all"]["pass"])

    def test_a_wrong_decoder_fails_for_what_is_wrong(self):
        change = "name = os.path.join(out, 'f0000.%s.i32')\nopen(name, '%s')%s"
        wrong = {
            change % ("dc", "ab", ".write(b'0000')"): "wrong-planes",
            "os.remove(os.path.join(out, 'f0000.dc.i32'))": "missing-files",
            change % ("new", "wb", ".close()"): "extra-files",
            "open(os.path.join(out, 'u0004.entropy'), 'w').write('0' * 16)": "wrong-entropy",
            "open(os.path.join(out, 'f0000.f32'), 'ab').write(b'0')": "wrong-output",
            "sys.exit(11)": "wrong-outcome",
            "sys.exit(12)": "unsupported",
            "sys.exit(7)": "crash",
            "os.kill(os.getpid(), 9)": "crash",
        }
        for after, label in wrong.items():
            self.assertEqual(self.labels(after), {label}, after)

    def test_a_decoder_that_does_not_end_is_killed(self):
        self.assertEqual(self.labels("time.sleep(600)", "codebook-two-bytes", "--time", "2"), {"timeout"})

    def test_a_process_that_does_not_answer_fails_case_by_case(self):
        for process in ("true", "cat", "%s -c 'input()'" % sys.executable):
            code, said, report = run(["--stdio", process, "--filter", "codebook-two-*", "--jobs", "1"])
            self.assertEqual(said.count("FAIL"), 1, said)
            self.assertGreater(len(report["cases"]), 1)
            labels = {row.get("reason", row["outcome"]) for row in report["cases"]}
            self.assertEqual((code, labels), (3, {"crash"}), process)

    def test_a_code_counts_if_that_is_asked(self):
        broken = next(v for v in Suite(VECTORS).vectors if v.record["kind"] == "invalid" and v.record.get("points"))
        name, after = broken.record["name"], "print('{\"code\": \"NONE\"}', file=sys.stderr)"
        self.assertEqual(self.labels(after, name), {"pass"})
        self.assertEqual(self.labels(after, name, "--strict"), {"wrong-code"})

    def test_what_is_not_claimed_is_not_asked(self):
        claim = os.path.join(self.folder, "claim.json")
        with open(claim, "w", encoding="utf-8") as f:
            json.dump({"schema": "splatstream-capabilities/1", "name": "small", "features": [], "points": "full"}, f)
        words = ["--decoder", self.decoder("sys.exit(7)"), "--filter", "codebook-*", "--capabilities", claim]
        code, _, report = run(words)
        self.assertEqual({row["outcome"] for row in report["cases"]}, {"not-claimed"})
        self.assertEqual((code, report["all"]["run"]), (3, 0))

    def test_a_changed_suite_is_noticed(self):
        part = os.path.join(self.folder, "vectors")
        shutil.copytree(os.path.join(VECTORS, "valid", "codebook"), os.path.join(part, "valid", "codebook"))
        for name in ("VERSION", "MANIFEST"):
            shutil.copy(os.path.join(VECTORS, "..", name), self.folder)
        self.assertIn("not the", Suite(part).changed)
        self.assertIsNone(Suite(VECTORS).changed)


class Submission(unittest.TestCase):
    def report(self, **other):
        row = {"vector": "a", "area": "a", "kind": "valid", "op": "s0,t0,r0", "mode": "full", "expected": "accept"}
        cases = [{**row, "outcome": outcome} for outcome in ("pass", "fail", "not-claimed", "crash")]
        return {"suite": {"version": "1"}, "settings": {"selection": {}}, "decoder": {"name": "mine"}, "cases": cases, **other}

    def test_cases_that_say_nothing_are_left_out(self):
        kept = submit.kept(self.report())
        self.assertEqual([row["outcome"] for row in kept["cases"]], ["fail", "crash"])

    def test_a_part_of_a_run_or_of_a_suite_is_refused(self):
        for other in ({"interrupted": 3}, {"settings": {"selection": {"area": "a"}}}, {"suite": {"changed": "less"}}):
            self.assertTrue(submit.complaint(self.report(**other)), other)
        self.assertIsNone(submit.complaint(self.report()))

    def test_a_result_is_written_where_it_is_asked_for_and_replaces_no_report(self):
        with tempfile.TemporaryDirectory() as folder:
            report, result = (os.path.join(folder, name) for name in ("report.json", "mydec.json"))
            with open(report, "w", encoding="utf-8") as f:
                json.dump(self.report(), f)
            for wrong in (report, os.path.join(folder, "mydec"), os.path.join(folder, "My Decoder.json")):
                with unittest.mock.patch.object(sys, "argv", ["submit.py", report, wrong]), self.assertRaises(SystemExit):
                    submit.main()
            with unittest.mock.patch.object(sys, "argv", ["submit.py", report, result]):
                submit.main()
            self.assertEqual(sorted(os.listdir(folder)), ["mydec.json", "report.json"])
            with open(result, encoding="utf-8") as f:
                self.assertEqual(len(json.load(f)["cases"]), 2)


class Fluster(unittest.TestCase):
    def test_a_result_is_what_a_right_decoder_gives(self):
        cases = [case for case in Suite(VECTORS).cases() if make.fitting(case)]
        named = {case.record["name"]: case for case in cases if case.is_extreme(True)}
        for name in ("codebook-two-bytes", "extraction-result-t0", "weights-twice"):
            self.assertEqual(make.result(named[name]), self.given(named[name]), name)

    def given(self, case):
        """The result of the independent decoder, as the decoder class of fluster computes it."""
        classes = {0: "accept", 10: "malformed", 11: "invalid", 12: "unsupported", 13: "over-limit", 14: "truncated"}
        path = os.path.join(case.vector.folder, "in.gss")
        with tempfile.TemporaryDirectory() as out:
            words = [sys.executable, ADAPTER, "--in", path, "--op", case.op, "--mode", "full", "--out", out]
            code = subprocess.run(words, stderr=subprocess.DEVNULL, check=False).returncode
            lines = [classes[code]]
            for name in sorted(os.listdir(out)):
                if name.endswith(".i32"):
                    with open(os.path.join(out, name), "rb") as f:
                        lines.append("%s %s" % (hashlib.sha256(f.read()).hexdigest(), name))
        return hashlib.sha256("".join(line + "\n" for line in lines).encode()).hexdigest()

    def test_an_archive_is_the_same_each_time_and_has_every_stream(self):
        cases = [case for case in Suite(VECTORS).cases() if make.fitting(case) and case.record["area"] == "codebook"]
        with tempfile.TemporaryDirectory() as folder:
            paths = [os.path.join(folder, name) for name in ("a.zip", "b.zip")]
            for path in paths:
                make.write_archive(path, reversed(cases))
            self.assertEqual(make.md5(paths[0]), make.md5(paths[1]))
            with zipfile.ZipFile(paths[0]) as archive:
                for made in make.suites("1", cases, "file:///x.zip", "0"):
                    for vector in made["test_vectors"]:
                        self.assertIn(vector["input_file"], archive.namelist())


class Folder(unittest.TestCase):
    """What people unpack, beside nothing else of the repository."""

    @classmethod
    def setUpClass(cls):
        cls.around = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.around.cleanup)
        cls.folder = os.path.join(cls.around.name, "kit")
        archive = os.path.join(cls.around.name, "streams.zip")
        # Which program the kit has does not matter here: releases try it.
        words = [os.path.join(HERE, "assemble.sh"), cls.folder, os.path.join(HERE, "submit.py"), archive, "https://example.com/x.zip"]
        subprocess.run(words, check=True, stdout=subprocess.DEVNULL)

    def test_all_links_lead_somewhere(self):
        lost, count = [], 0
        for folder, _, files in os.walk(self.folder):
            for name in files:
                if not name.endswith(".md"):
                    continue
                with open(os.path.join(folder, name), encoding="utf-8") as f:
                    targets = re.findall(r"\]\(([^)\s#]+)", f.read())
                for target in (target for target in targets if "://" not in target):
                    count += 1
                    if not os.path.exists(os.path.join(folder, target)):
                        lost.append((os.path.relpath(os.path.join(folder, name), self.folder), target))
        self.assertEqual(lost, [])
        self.assertGreater(count, 20)

    def test_files_of_the_table_are_those_that_are_there(self):
        with open(os.path.join(self.folder, "README.md"), encoding="utf-8") as f:
            rows = [line.split("|")[1] for line in f if line.startswith("| `")]
        named = {name.rstrip("/") for row in rows for name in re.findall("`([^`]+)`", row)}
        self.assertEqual(named | {"README.md"}, set(os.listdir(self.folder)))

    def test_the_independent_decoder_runs_as_it_is_written(self):
        with open(os.path.join(self.folder, "README.md"), encoding="utf-8") as f:
            [line] = [line for line in f if line.startswith("    python3 runner") and "adapter.py" in line]
        protocols = (shlex.split(line, comments=True)[2:4], ["--decoder", "adapters/shell/adapter.sh {in} {op} {mode} {out}"])
        for protocol in protocols:
            words = [sys.executable, "runner", *protocol, "--strict", "--time", "60", "--filter", "codebook-two-*"]
            ended = subprocess.run(words, cwd=self.folder, stdout=subprocess.PIPE, text=True, check=False)
            self.assertEqual(ended.returncode, 0, ended.stdout)
            self.assertIn(" 0 failed, 0 not claimed", ended.stdout)


if __name__ == "__main__":
    unittest.main()
