#!/usr/bin/env python3
"""Checks of the generator and, with its streams, of the oracle: python3 -m unittest test_generator"""

import json
import unittest

import oracle_path  # noqa: F401
import patches
import points
import schema_check
from catalogue import VECTORS
from decode import report
from decoding import Decoder
from extraction import extract
from intra_writer import IntraStream
from model_script import Script
from synth import Synth
from synth_dynamic import valid_stream
from text import clause_of_requirements
from units import stream_of, units_of
import models as pm


class Catalogue(unittest.TestCase):
    def test_requirements_exist(self):
        known = clause_of_requirements()
        for name, row in VECTORS.items():
            self.assertEqual([r for r in row.requirements if r not in known], [], name)

    def test_parents_are_not_invalid(self):
        for name, row in VECTORS.items():
            if row.kind == "invalid":
                self.assertNotEqual(VECTORS[row.parent].kind, "invalid", name)
                self.assertTrue(row.fault, name)
            else:
                self.assertIsNone(row.parent, name)

    def test_same_bytes_again(self):
        for name in ("stream-skipped-units", "cells-stale", "learned-flags-3", "stability-mixed-random-4"):
            self.assertEqual(VECTORS[name].build(), VECTORS[name].build(), name)


class Patches(unittest.TestCase):
    def test_difference(self):
        parent = IntraStream().close()
        children = [parent + b"\x00", parent[:-1], parent[:5], b"", parent[:20] + b"\xff" + parent[21:],
                    parent[:30] + b"abc" + parent[30:]]
        for child in children:
            patch = patches.difference(parent, child)
            self.assertEqual(patches.apply(parent, patch), child)
            self.assertEqual(patch, sorted(patch, key=lambda edit: edit["at"]))

    def test_parts_that_are_equal_are_not_in_it(self):
        parent = bytes(range(200))
        patch = patches.difference(parent, parent[:100] + b"\x00" + parent[101:])
        self.assertEqual(patch, [{"at": 100, "remove": 1, "insert": "00"}])


class Schema(unittest.TestCase):
    RULES = {"type": "object", "required": ["a"], "additionalProperties": False,
             "properties": {"a": {"type": "integer", "minimum": 1, "maximum": 3}, "b": {"enum": ["x", "y"]},
                            "c": {"type": "array", "minItems": 1, "uniqueItems": True,
                                  "items": {"$ref": "#/$defs/word"}}},
             "if": {"properties": {"a": {"const": 3}}}, "then": {"required": ["b"]},
             "else": {"not": {"required": ["b"]}},
             "$defs": {"word": {"type": "string", "pattern": "^[a-z]+$", "minLength": 2}}}

    def problems(self, value):
        return len(list(schema_check.check(self.RULES, self.RULES, value, "$")))

    def test_right(self):
        for value in ({"a": 1}, {"a": 3, "b": "x"}, {"a": 2, "c": ["ab", "cd"]}):
            self.assertEqual(self.problems(value), 0, value)

    def test_wrong(self):
        for value in ([], {}, {"a": 0}, {"a": 4}, {"a": True}, {"a": "1"}, {"a": 3}, {"a": 3, "b": "z"},
                      {"a": 1, "b": "x"},
                      {"a": 1, "c": []}, {"a": 1, "c": ["ab", "ab"]}, {"a": 1, "c": ["A1"]}, {"a": 1, "c": ["a"]},
                      {"a": 1, "d": 0}):
            self.assertGreater(self.problems(value), 0, value)

    def test_unknown_rule(self):
        with self.assertRaises(ValueError):
            list(schema_check.check({}, {"oneOf": []}, 1, "$"))

    def test_rules_of_kinds(self):
        """An invalid vector needs its parent and patch, a valid one must not have them."""
        record = json.loads(json.dumps({"kind": "invalid", "expect": {"outcome": "accept"}}))
        found = " ".join(schema_check.problems("vector", record))
        for word in ("parent", "patch", "fault", "not 'reject'"):
            self.assertIn(word, found)


class Writers(unittest.TestCase):
    def test_script(self):
        """A table of every kind has the tables that the oracle reads."""
        plane = pm.Plane(4, "opacity", 0, "signed")
        script = Script(plane, bias=-5, direct_log2=3, a=(1, [-2, 0, 9]))
        script.explicit({0: 8, 3: 480}, 1)
        script.single(7)
        script.place(0)
        script.before()
        self.assertEqual([table.tokens for table in script.model.tables], [[0, 1, 3], [7], [0, 1, 3], [0, 1, 3]])
        self.assertEqual(script.model.tables[0].freq, [8, 3608, 480])

    def test_random_streams_of_profile_0(self):
        for seed in range(5):
            self.assertEqual(Decoder(Synth(seed).stream()).decode().errors, [])


class DynamicStreams(unittest.TestCase):
    """Streams of the generator: operating points, extraction, faults."""

    def test_digests_and_operating_points(self):
        for seed in range(6):
            data = valid_stream(seed)
            full = Decoder(data).decode()
            seq = full.sequence
            last = (seq.top, seq.temporal_layer_count - 1, seq.refinement_count - 1)
            for point in {(0, 0, 0), last, (seq.top, 0, 0), (0,) + last[1:], (last[0], last[1] // 2, last[2] // 2)}:
                part = Decoder(data, point).decode()
                self.assertEqual(part.errors, [])
                exact = sum(frame.shown().exact for frame in part.frames)
                self.assertEqual(exact, sum(points.exact_gaussians(frame, seq, point) for frame in full.frames))
                extracted = extract(data, point)
                again = Decoder(extracted).decode()                               # SS-OP-008
                self.assertEqual((again.errors, report(again)["frames"]), ([], report(part)["frames"]))
                self.assertEqual(extract(extracted, point), extracted)

    def test_subset(self):
        """7.18.2: the exact Gaussians alone"""
        decoder = Decoder(valid_stream(4)).decode()
        for frame in decoder.frames:
            subset = frame.shown(True)
            self.assertEqual((len(subset.gaussians), subset.carried), (frame.shown().exact, 0))

    def test_start_inside(self):
        """SS-BS-008"""
        data = next(data for data in map(valid_stream, range(100)) if len(Decoder(data).decode().gops) > 1)
        whole = Decoder(data).decode()
        head, units = units_of(data)
        parameters = next(u for u in units if u.kind == 1).bytes()
        first, at = whole.gops[1]
        inside = Decoder(head + parameters + data[at:], None, True).decode()
        expected = [record for record in report(whole)["frames"] if record["frame"] >= first]
        self.assertEqual((inside.errors, report(inside)["frames"]), ([], expected))

    def test_losses(self):
        """The example of 7.20.2: unit 1 of a P frame is damaged, and later frames have no more of it."""
        seen = 0
        for seed in range(60):
            data = valid_stream(seed, most=12)
            head, units = units_of(data)
            places = [i for i, u in enumerate(units) if u.kind == 10 and u.r == 1 and u.t == 0 and len(u.payload) > 59]
            whole = Decoder(data).decode()
            predicted = {f.number for f in whole.frames if not f.intra}
            places = [i for i in places if units[i].frame in predicted]
            if not places:
                continue
            lost = units[places[0]]
            lost.raw = ((-1, 16),)
            decoder = Decoder(stream_of(head, units)).decode()
            self.assertEqual([error.code for error in decoder.errors], ["CHECK_SUM"])
            for frame in decoder.frames:
                if frame.number == lost.frame or (frame.reference and frame.reference.number == lost.frame):
                    self.assertEqual(frame.level(), 1)
                    self.assertFalse(frame.lost)
                    seen += 1
        self.assertGreater(seen, 2)


if __name__ == "__main__":
    unittest.main()
