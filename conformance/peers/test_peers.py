#!/usr/bin/env python3
"""python3 -m unittest discover conformance/peers; no network, nothing is installed"""

import importlib
import json
import os
import sys
import tempfile
import unittest

import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

import dither
import draco
import measure
import ply
import run
import spz
from measure import Coded, Missing, Package, Rate
from report import Report
from scene import Scene

RESULT = {"scene", "peer", "version", "options", "bytes", "gaussians", "frames", "encode_s", "decode_s", "timing",
          "decoded", "command"}


def gaussians(count=300, degree=1, seed=7):
    random = np.random.Generator(np.random.PCG64(seed))
    draw = lambda width: random.normal(size=(count, width)).astype("<f4")
    rotation = draw(4)
    return ply.Gaussians(draw(3), draw(3), draw(3 * ((degree + 1) ** 2 - 1)), draw(1), draw(3),
                         rotation / np.linalg.norm(rotation, axis=1, keepdims=True))


def same(left, right):
    return all(np.array_equal(a, b) for a, b in zip(vars(left).values(), vars(right).values()))


class Ply(unittest.TestCase):
    def test_what_is_written_is_read(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "a.ply")
            for degree in range(4):
                written = gaussians(degree=degree)
                ply.write(path, written)
                read = ply.read(path)
                self.assertTrue(ply.is_standard(path))
                self.assertEqual(read.degree, degree)
                np.testing.assert_allclose(read.rotation, written.rotation, atol=1e-7)
                read.rotation = written.rotation
                self.assertTrue(same(read, written))

    def test_a_certain_opacity_is_finite(self):
        certain = gaussians()
        certain.opacity[:2, 0] = np.inf, -np.inf
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "a.ply")
            ply.write(path, certain)
            np.testing.assert_array_equal(ply.read(path).opacity[:2, 0], [ply.CERTAIN, -ply.CERTAIN])

    def test_coefficients_keep_their_channels(self):
        before = gaussians(degree=2)
        np.testing.assert_array_equal(ply.from_coefficients(before.coefficients()), before.sh)
        np.testing.assert_array_equal(before.coefficients()[:, 0, 1], before.sh[:, 8])


class Dither(unittest.TestCase):
    def test_same_seed_same_scene(self):
        self.assertTrue(same(dither.dithered(gaussians(), 1), dither.dithered(gaussians(), 1)))
        self.assertFalse(same(dither.dithered(gaussians(), 1), dither.dithered(gaussians(), 2)))

    def test_a_value_stays_in_its_cell(self):
        random = np.random.Generator(np.random.PCG64(3))
        grid = np.sort(random.random(100)).repeat(50)
        below, above = dither.cells(grid)
        np.testing.assert_allclose(above[49], (grid[50] - grid[0]) / 2)
        np.testing.assert_allclose(below[50], (grid[50] - grid[0]) / 2)

    def test_a_fine_grid_is_found(self):
        random = np.random.Generator(np.random.PCG64(3))
        below, above = dither.cells(random.integers(0, 65536, 200000) / 65536)
        np.testing.assert_allclose(np.median(below + above), 1 / 65536, rtol=1e-3)

    def test_a_grid_for_every_block_is_found(self):
        random = np.random.Generator(np.random.PCG64(3))
        steps = random.random(400) + 0.5
        values = (random.integers(0, 2048, (400, 256)) * steps[:, None] / 2047 + random.random((400, 1))).ravel()
        below, above = dither.cells(values)
        self.assertLess(np.median(np.abs((below + above) / np.repeat(steps, 256) * 2047 - 1)), 0.01)

    def test_vectors_of_a_code_book_stay_nearest_to_it(self):
        random = np.random.Generator(np.random.PCG64(3))
        book = random.normal(size=(200, 24))
        label = random.integers(0, 200, 5000)
        moved = dither._vectors(book[label], random, None)
        nearest = ((moved[:, None] - book) ** 2).sum(2).argmin(1)
        self.assertGreater((nearest == label).mean(), 0.99)
        self.assertGreater(np.abs(moved - book[label]).mean(), 0.1)

    def test_what_was_never_quantised_stays(self):
        values = np.random.Generator(np.random.PCG64(3)).normal(size=20000)
        below, above = dither.cells(values)
        self.assertLess(np.median(below + above), 1e-3)


class Layouts(unittest.TestCase):
    def test_spz_takes_and_gives_the_same(self):
        before = gaussians(degree=2)
        self.assertTrue(same(spz._gaussians(spz._cloud(before), len(before)), before))

    def test_draco_attributes_come_back(self):
        before = gaussians(degree=1)
        before.sh = np.clip(before.sh, -1, 1)
        attributes, ranges = draco._attributes(before, 16)
        cloud = type("Cloud", (), {"points": before.position,
                                   "get_attribute_by_name": lambda self, name: {"data": attributes[name]}})()
        after = draco._gaussians(cloud, ranges)
        alike = np.abs((after.rotation * before.rotation).sum(1))
        np.testing.assert_allclose(alike, 1, atol=1e-4)
        for name in ("position", "scale", "colour", "sh"):
            np.testing.assert_allclose(getattr(after, name), getattr(before, name), atol=1e-3)
        np.testing.assert_allclose(after.opacity, before.opacity, atol=1e-3)


class Reports(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.report = Report(self.folder.name)
        self.scene = Scene("a", "../a.ply", [os.path.join(self.folder.name, "reference", "a.ply")], [10], 0, False)
        self.report.scene(self.scene)

    def saved(self):
        with open(self.report.path) as file:
            return json.load(file)

    def test_the_schema(self):
        peer = type("Peer", (), {"PACKAGES": [Package("pip", "thing", "1.0")]})
        peer.code = lambda *_: Coded(5, 10, 0.1, 0.2, "in-process", "thing()")
        for _ in range(2):
            run.record(peer, Rate("Thing", "best: 1/2"), self.scene, None, self.report)
        saved = self.saved()
        self.assertEqual(set(saved), {"version", "scenes", "results", "missing"})
        self.assertEqual(saved["scenes"], [{"scene": "a", "source": "../a.ply", "reference": "reference/a.ply",
                                            "gaussians": 10, "frames": 1}])
        self.assertEqual([set(result) for result in saved["results"]], [RESULT])
        self.assertEqual(saved["results"][0]["version"], "thing 1.0")
        self.assertEqual(saved["results"][0]["decoded"], "decoded/a.Thing.best__1_2.ply")

    def test_a_peer_that_fails_is_missing(self):
        def fails(*_):
            raise Missing("no such codec")

        run.record(type("Peer", (), {"PACKAGES": [], "code": fails}), Rate("Thing", "best"), self.scene, None,
                   self.report)
        self.assertEqual(self.saved()["missing"], [{"peer": "Thing", "scene": "a", "why": "best: no such codec"}])
        self.assertEqual(self.saved()["results"], [])
        peer = type("Peer", (), {"PACKAGES": [], "code": lambda *_: Coded(5, 10, 0.1, 0.2, "in-process", "thing()")})
        run.record(peer, Rate("Thing", "best"), self.scene, None, self.report)
        self.assertEqual(self.saved()["missing"], [])

    def test_a_peer_that_cannot_be_installed_is_missing(self):
        class Tools:
            def install(self, package):
                raise Missing("no registry")

        with self.assertRaises(Missing):
            run.ready("spz", Tools())
        with self.assertRaises(Missing):
            run.ready("nothing", Tools())

    def test_what_runs_for_too_long_is_missing(self):
        with self.assertRaisesRegex(Missing, "stopped after 1 s"):
            measure.run([sys.executable, "-c", "while True: pass"], limit=1)
        self.assertEqual(measure.run([sys.executable, "-c", "print(1)"], limit=1), "1\n")

    def test_every_peer_has_the_interface(self):
        for name in run.PEERS:
            peer = importlib.import_module(name)
            self.assertTrue(callable(peer.rates) and callable(peer.code))
            self.assertTrue(all(isinstance(package, Package) for package in peer.PACKAGES))
            points = [(rate.peer, rate.options) for rate in peer.rates(self.scene)]
            self.assertEqual(len(points), len(set(points)))


if __name__ == "__main__":
    unittest.main()
