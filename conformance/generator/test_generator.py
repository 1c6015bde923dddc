"""Checks of the generator and, with its streams, of the oracle: python3 -m unittest generator.test_generator, in conformance"""

import unittest

from oracle import models as pm, points
from oracle.decode import report
from oracle.decoding import Decoder
from oracle.extraction import extract
from . import patches
from .catalogue import VECTORS
from .expectation import swept
from .synth.elements import FRAME, INCREMENT, Elements
from .synth.given import GivenStream
from .synth.mixed import mixed_stream
from .synth.scripts import Script
from .synth.units import LAYOUTS, stream_of, units_of
from .text import clause_of_requirements


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
        parent = GivenStream().close()
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


class Writers(unittest.TestCase):
    def test_script(self):
        """A table of every kind has the tables that the oracle reads."""
        plane = next(plane for plane in pm.section_planes("new", 3) if plane.attribute == "opacity")
        script = Script(plane, bias=-5, direct_log2=3, a=(1, [-2, 0, 9]))
        script.explicit({0: 8, 3: 480}, 1)
        script.single(7)
        script.index(0)
        script.before()
        script.parametric(2, shape=3, scale=0)
        self.assertEqual([table.tokens for table in script.model.tables],
                         [[0, 1, 3], [7], [0, 1, 3], [0, 1, 3], [0, 1, 2]])
        self.assertEqual(script.model.tables[0].freq, [8, 3608, 480])

    def test_elements(self):
        """What is written is read again, in every combination of parts."""
        values = {"new_count": 300, "attribute_step": [1, 2, 3, 4, 5], "predictor_block_log2": 4, "sh_mode": 2,
                  "vq_stage_count": 2, "codebook_ids": [3, 9], "compensation_opacity": -7}
        for flags in range(1 << 12):
            u = Elements(INCREMENT, increment_flags=flags, **values)
            u.predictor_block_log2, u.move_block_log2 = 4, 3
            again = Elements.parse(INCREMENT, u.bytes() + b"rest")
            self.assertEqual((again.bytes(), again.rest), (u.bytes() + b"rest", b"rest"))
        self.assertEqual(Elements(INCREMENT, **values).needed(), 0b1111010000)
        self.assertEqual(Elements(FRAME, gaussian_count=5).bytes().hex(), "0000000005000000")

    def test_elements_of_streams(self):
        for u in (u for seed in range(4) for u in units_of(mixed_stream(seed))[1] if u.kind in LAYOUTS):
            if len(u.payload) > 5:                  # not one that every decoder discards
                self.assertEqual(u.elements().bytes(), u.payload)


class Streams(unittest.TestCase):
    """Streams of the generator: operating points, extraction, faults."""

    def test_random_streams_of_profile_0(self):
        for seed in range(5):
            self.assertEqual(Decoder(mixed_stream(seed, profile=0)).decode().errors, [])

    def test_digests_and_operating_points(self):
        for seed in range(6):
            data = mixed_stream(seed)
            full = Decoder(data).decode()
            seq = full.sequence
            last = (seq.top, seq.temporal_layer_count - 1, seq.refinement_count - 1)
            for point in {(0, 0, 0), last, (seq.top, 0, 0), (0,) + last[1:], (last[0], last[1] // 2, last[2] // 2)}:
                part = Decoder(data, point).decode()
                self.assertEqual(part.errors, [])
                exact = sum(frame.shown().exact for frame in part.frames)
                self.assertEqual(exact, sum(points.exact_gaussians(frame, seq, point) for frame in full.frames))
                extracted = extract(data, point)
                again = Decoder(extracted).decode()                               # SS-OP-007
                self.assertEqual((again.errors, report(again)["frames"]), ([], report(part)["frames"]))
                self.assertEqual(extract(extracted, point), extracted)

    def test_subset(self):
        """7.8.2: exact Gaussians alone where there are some"""
        for frame in Decoder(mixed_stream(4)).decode().frames:
            subset = frame.shown(True)
            if frame.level() > 0 and not frame.intra:
                self.assertEqual((len(subset.gaussians), subset.carried), (frame.shown().exact, 0))

    def test_start_inside(self):
        """SS-BS-012"""
        data = next(data for data in map(mixed_stream, range(100)) if len(Decoder(data).decode().gops) > 1)
        whole = Decoder(data).decode()
        first, at = whole.gops[1]
        inside = Decoder(data, None, at).decode()
        expected = [record for record in report(whole)["frames"] if record["frame"] >= first]
        self.assertEqual((inside.errors, report(inside)["frames"]), ([], expected))

    def test_losses(self):
        """SS-LO-002: unit 1 of a P frame is damaged, and the frames that refer to it have no more of it."""
        seen = 0
        for seed in range(40):
            head, units = units_of(mixed_stream(seed, most=12))
            frames = {f.number: f for f in Decoder(stream_of(head, units)).decode().frames}
            lost = next((u for u in units if u.kind == 6 and u.r == 1 and not frames[u.frame].intra
                         and frames[u.frame].level() > 1), None)
            if lost is None:
                continue
            lost.raw = ((-1, 16),)
            decoder = Decoder(stream_of(head, units)).decode()
            self.assertEqual([error.code for error in decoder.errors], ["CHECKSUM"])
            for frame in decoder.frames:
                if frame.number == lost.frame or (frame.reference and frame.reference.number == lost.frame):
                    self.assertEqual(frame.level(), min(1, frames[frame.number].level()))
                    seen += 1
        self.assertGreater(seen, 2)

    def test_sweep(self):
        """A cut at any byte shows what the steps of a sweep say."""
        data = VECTORS["stream-one-gaussian"].build()
        steps = swept(data)["sweep"]["steps"]
        for size in range(len(data)):
            step = max((step for step in steps if step["bytes"] <= size), key=lambda step: step["bytes"])
            self.assertEqual(len(Decoder(data[:size]).decode().frames), len(step["states"]), size)


if __name__ == "__main__":
    unittest.main()
