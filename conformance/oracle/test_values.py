#!/usr/bin/env python3
"""Checks of positions, steps, lanes, motion and the network with the examples of the text; python3 -m unittest oracle.test_values"""

import os
import random
import re
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))

from oracle import moves, tables
from oracle.conventions import ByteReader, Round
from oracle.errors import StreamError
from oracle.frame import Frame, Gop
from oracle.lists import MOVE, MOVE_AND_UPDATE, REMOVE, SKIP, UPDATE, Gaussian
from oracle.network import DATA, REGISTERED, REGISTRY, parse_network
from oracle.output import expand
from oracle.parsing import BlockDecoder
from oracle.prediction import Reference, mean
from oracle.semantics import check_segments
from oracle.steps import DC, LOG_SCALE, OPACITY, ROTATION, SH, StepRule
from oracle.transformer import Transformer, act, product


class Sequence:
    """Elements by name."""

    def __init__(self, **elements):
        self.__dict__.update(elements)

    def at(self, _):
        return 0


def grid(bits, linear, segment):
    return Sequence(position_bits=bits, linear_log2=linear, segment_log2=segment)


class Companding(unittest.TestCase):
    def test_example(self):
        """The table of 7.10.1"""
        codes = (39, 40, 41, 43, 44, 45, 63, 24, 23, 1, 0)
        self.assertEqual([expand(code, grid(6, 3, 2)) for code in codes], [39, 40, 42, 46, 48, 52, 480, 24, 22, -416, -480])

    def test_steps_double(self):
        """Distances between codes are 1, then 2, 4, ... for a segment each, on both sides; all codes of all small grids."""
        for bits, linear in ((bits, linear) for bits in range(1, 9) for linear in range(10)):
            for segment in range(linear + 1):
                seq = grid(bits, linear, segment)
                try:
                    check_segments(seq)
                except StreamError:
                    continue
                middle = 2 ** (bits - 1)
                step = lambda distance: 2 ** max(0,
                     (distance - 2 ** linear) // 2 ** segment + 1) if distance >= 2 ** linear else 1
                up = [middle + sum(map(step, range(distance))) for distance in range(middle)]
                down = [2 * middle - x for x in up + [up[-1] + step(middle - 1)]]
                self.assertEqual([expand(code, seq) for code in range(2 * middle)], down[:0:-1] + up)

    def test_bound(self):
        """Below 2^40, with the largest number of segments"""
        largest = 0
        for bits, linear in ((bits, linear) for bits in range(1, 21) for linear in range(20)):
            for segment in range(linear + 1):
                seq = grid(bits, linear, segment)
                try:
                    check_segments(seq)
                except StreamError as error:
                    self.assertEqual(error.code, "CONSTRAINT")
                    continue
                largest = max(largest, *(abs(expand(code, seq)) for code in (0, 2 ** bits - 1)))
        self.assertLess(largest, 2 ** 40)
        self.assertGreater(largest, 2 ** 38)


class Steps(unittest.TestCase):
    def test_table(self):
        self.assertEqual(tables.STEP, [1] + [(2 + (k + 1) % 2) << ((k - 1) // 2) for k in range(1, 25)])
        self.assertEqual([tables.STEP[k + 3] for k in range(1, 22, 2)], [3 * tables.STEP[k] for k in range(1, 22, 2)])

    def rule(self, attribute_step, **elements):
        return StepRule(Sequence(**{"size_weight": [0] * 5, "opacity_weight": [0] * 3, "anisotropy_weight": 0,
             "size_reference": 0,
                                    "opacity_reference": 0, "anisotropy_reference": 0, **elements}), attribute_step)

    def test_example(self):
        """The example of 7.6.6"""
        rule = self.rule([0, 2, 4, 0, 0], size_weight=[0, 0, 2048, 0, 0], size_reference=40, opacity_weight=[1024, 0, 0],
                         opacity_reference=16, anisotropy_weight=512, anisotropy_reference=20)
        self.assertEqual((rule.exponent(ROTATION, (12, 8, 3), 4), rule.factor(ROTATION, (12, 8, 3), 4)), (8, 24))
        self.assertEqual(rule.exponent(ROTATION, (3, 8, 12), 4), 8)
        self.assertEqual([rule.exponent(attribute, (12, 8, 3), 4) for attribute in (LOG_SCALE, OPACITY, DC, SH)], [0, 2, 0, 0])

    def test_clamped(self):
        rule = self.rule([3] * 5, size_weight=[8191] * 5, size_reference=100)
        self.assertEqual([rule.exponent(LOG_SCALE, [q]) for q in (50, 49, 29, 28, -5, 52, 53, 99)], [3, 4, 24, 24, 24, 1, 0, 0])
        self.assertEqual([rule.exponent(OPACITY, (q, 2, 2)) for q in (98, 96, 102, 104)], [3, 4, 1, 0])

    def test_halves(self):
        rule = self.rule([5] * 5, size_weight=[0, 4096, 0, 0, 0])
        self.assertEqual([rule.exponent(OPACITY, (-size, 0, 0)) for size in (-2, 0, 2, -3, 3)], [5, 5, 5, 4, 5])


class Lanes(unittest.TestCase):
    def order(self, n, lanes):
        block = BlockDecoder.__new__(BlockDecoder)
        block.n, block.lanes = n, lanes
        return block.order()

    def test_examples(self):
        """Those of 8.4"""
        self.assertEqual([i for _, i in self.order(10, 4)], [0, 3, 6, 9, 1, 4, 7, 2, 5, 8])
        self.assertEqual([i for _, i in self.order(5, 4)], [0, 2, 4, 1, 3])
        self.assertEqual({lane for lane, _ in self.order(5, 4)}, {0, 1, 2})

    def test_every_entry_once(self):
        for n in range(1, 40):
            for lanes_log2 in range(6):
                order = self.order(n, 2 ** lanes_log2)
                self.assertEqual(sorted(i for _, i in order), list(range(n)))
                strip = -(-n // 2 ** lanes_log2)
                self.assertTrue(all(lane == i // strip for lane, i in order))

    def test_contexts(self):
        """Sources 1 and 2 do not see the strip before."""
        block = BlockDecoder.__new__(BlockDecoder)
        block.n, block.lanes, block.e = 7, 2, [[1, 2, -3, 4, 5, -6, 7]]
        plane = type("Plane", (), {"number": 0, "alphabet": "signed"})
        self.assertEqual([block.source(1, plane)(i) for i in range(7)], [0, 1, 3, 0, 0, 5, -1])
        self.assertEqual([block.source(2, plane)(i) for i in range(7)], [0, 1, 3, 6, 0, 5, 11])
        plane.alphabet = "position"
        block.e = [[1, 2, 4, 8, 16, 32, 64]]
        self.assertEqual([block.source(1, plane)(i) for i in range(7)], [0, 2, 5, 8, 0, 10, 17])


def gaussian(position, motion=(0, 0, 0), o=0, fade=0):
    return Gaussian(tuple(position), (0, 0, 0), o, (0, 0, 0), (0, 0, 0), (), 1, tuple(motion), fade)


class Moves(unittest.TestCase):
    def test_example(self):
        """The example of 7.4.7, on the first axis"""
        rows = [((6400, 0, 0), 64, (100, 0, 0)), ((6500, 0, 0), 64, (80, 0, 0)), ((6600, 0, 0), 0, (41, 0, 0))]
        origins = [gaussian(position, motion) for position, _, motion in rows]
        displaced = [gaussian((position[0] + cell, 0, 0)) for position, cell, _ in rows]
        parents = moves.parents_of(0, origins, displaced, 0)
        space = moves.MovePrediction([parents], [MOVE, MOVE, MOVE])
        for parent, motion in zip(parents[1:], (90, 51)):
            parent.motion = (motion, 0, 0)
        self.assertEqual([space.predicted(0, k)[0] for k in range(4)], [64, 100, 103, 106])

    def test_span(self):
        """The tables of 7.4.6"""
        rows = {0: ([1] * 8, [None] + [0] * 7), 1: ([1, 2] * 4, [None, None, 1, 0, 1, 0, 1, 0]),
                2: ([1, 2, 1, 4] * 2, [None, None, 1, None, 2, 1, 1, 0]), 3: ([1, 2, 1, 4, 1, 2, 1, 8], [None, None, 1, None, 2,
                     1, 1, None])}
        for depth, (spans, gaps) in rows.items():
            gop = Gop(type("Header", (), {"gop_structure": 1, "temporal_depth": depth}), 0)
            seq = Sequence(sh_planes=0, spatial_layer_count=1, refinement_count=1, top=0, whole_anchor=0)
            gop.frames[0] = Frame(0, None, gop, seq)
            for number in range(1, 9):
                gop.frames[number] = frame = Frame(number, None, gop, seq)
                frame.counts = [1]
                self.assertEqual(frame.span(), spans[number - 1])
                self.assertEqual(None if frame.reference.intra else frame.gap(), gaps[number - 1])

    def test_neighbours(self):
        """SS-PA-011 by another way: each candidate is looked for among all."""
        rng = random.Random(5)
        for size in (1, 3, 20, 60):
            increments = [moves.parents_of(h, *[[gaussian([rng.randrange(6) * 64 for _ in "xyz"]) for _ in range(size)]] * 2, 0)
                          for h in range(2)]
            modes = [rng.choice([SKIP, MOVE, UPDATE, MOVE_AND_UPDATE, REMOVE]) for _ in range(size)]
            for parent in increments[0]:
                parent.motion = rng.choice([None, (1, 2, 3)])
            space = moves.MovePrediction(increments, modes)
            for i in (i for i, mode in enumerate(modes) if mode in (MOVE, MOVE_AND_UPDATE)):
                own = increments[1][i]
                found = []
                for other in increments[0] + increments[1]:
                    key = lambda x: (x.code, x.rank)
                    low, high = sorted([own, other], key=key)
                    between = sum(key(low) < key(x) < key(high) for x in increments[0] + increments[1])
                    if other is not own and between < 16 and other.motion is not None:
                        found.append((sum((a - b) ** 2 for a, b in zip(own.position, other.position)), other.rank))
                self.assertEqual([x.rank for x in space.neighbours(own)], [rank for _, rank in sorted(found)[:4]])
                own.motion = (0, 0, 0)

    def test_average(self):
        self.assertEqual([moves.average(x) for x in ([], [3], [1, 2], [-1, -2], [0, 0, 1], [0, 0, -2])], [0, 3, 2, -1, 0, -1])

    def test_extrapolated(self):
        """The example of 7.4.8, and both ends"""
        self.assertEqual(moves.extrapolated(gaussian((0, 0, 0), o=40, fade=-6), 1).o, 37)
        self.assertEqual([moves.extrapolated(gaussian((0, 0, 0), o=o, fade=fade), 0).o
                          for o, fade in ((32000, 900), (-32000, -900))], [32767, -32768])
        after = moves.changed_by_frame(gaussian((5, 6, 7), o=39), gaussian((1, 8, 7), (9, 9, 9), 40, -6))
        self.assertEqual((after.motion, after.fade), ((4, -2, 0), -1))

    def test_round(self):
        self.assertEqual([Round(x, s) for x, s in ((7, 0), (-7, 0), (7, 1), (-7, 1))], [7, -7, 4, -3])


class Learned(unittest.TestCase):
    """The example of 7.7.6, read from the text"""

    OWN = ((100, 200, 300), (10, 8, 5), 6, (1, -2, 3))
    NEIGHBOURS = [Reference((103, 198, 300), (12, 8, 4), 9, (0, -4, 6), (900, 300, -200), ()),
                  Reference((90, 205, 304), (9, 9, 6), 2, (5, 0, 0), (-700, 1400, 300), ())]
    IDENTITY = (4096, 0, 0, 0, 4096, 0, 0, 0, 4096)

    @classmethod
    def setUpClass(cls):
        with open(os.path.join(os.path.dirname(DATA), "07-decoding.md"), encoding="utf-8") as f:
            lines = f.read().partition("Example with the registered network")[2].partition("### 7.7.7")[0].splitlines()
        rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines if line.startswith("| ")]
        cls.rows = {row[0]: [[numbers(part) for part in cell.split(";")] for cell in row[1:]] for row in rows}

    def test_example(self):
        model = REGISTRY[bytes.fromhex(REGISTERED[0][0])]
        network = parse_network(ByteReader(model, 0, len(model)))
        transform = Sequence(rank=3, dimension=3, basis=self.IDENTITY)
        t = Transformer(network, transform, None)
        distances = [sum((a - b) ** 2 for a, b in zip(x.position, self.OWN[0])) for x in self.NEIGHBOURS]
        weight = [2 ** 16 * (distances[0] + 1) // (d + 1) for d in distances]
        self.found("`D2`; `weight` of 7.7.3", *[[[d], [w]] for d, w in zip(distances, weight)])
        base = {"dc": [mean(weight, column) for column in zip(*(x.dc for x in self.NEIGHBOURS))], "sh": ()}
        neighbours = list(zip(self.NEIGHBOURS, distances))
        token, near = t.tokens(self.OWN, neighbours, [0, 0], base), t.near(self.OWN[0], neighbours)
        h = [t.embedded(j, *both) for j, both in enumerate(zip(token, near))]
        (row,), (origin,) = t.rows(h, near)
        u = [act(product(weights, row), network.layer_shift[2]) for weights in network.attention]
        sums = [(product(u, h_j), product(u, h_j) + t.fourier(near_j, origin)) for h_j, near_j in zip(h, near)]
        logit = [Round(total, network.layer_shift[3]) for _, total in sums]
        power = [tables.EXP[min(255, max(logit) - x)] for x in logit]
        share = [Round(x * (2 ** 26 // sum(power)), 18) for x in power]
        hidden = [[max(0, act(product(w, near_j) + bias, network.layer_shift[0]))
                   for w, bias in zip(network.geometry, network.geometry_bias[0])] for near_j in near]
        for name, values in (("`token`", token), ("`near`", near), ("`hidden`", hidden), ("`h`", h)):
            self.found(name, *[[value] for value in values])
        self.found("sum of `u[i] * h[j][i]`; sum with `fourier`", *[[[a], [b]] for a, b in sums])
        self.found("`logit`; `power`; `share`", *[[[a], [b], [c]] for a, b, c in zip(logit, power, share)])
        x = t.attended(row, origin, h, near)
        fed = t.fed_forward(x)
        out = t.outputs([fed])
        for name, value in (("`base.dc`", base["dc"]), ("`row[0]`", row), ("`u`", u),
                            ("`z`", [act(product(share, column), 8) for column in zip(*h)]), ("`x[0]` after attention", x),
                            ("`x[0]` after the feed-forward block", fed), ("`out`", out),
                            ("`pred.dc`", t.predict(self.OWN, neighbours, [0, 0], base)["dc"])):
            self.found(name, [value])
        wide = [max(0, act(product(w, x) + bias, network.layer_shift[5]))
                for w, bias in zip(network.widening, network.widening_bias[0])]
        self.found("`wide[i]` that are not 0", [[value for value in wide if value] + [i for i, value in enumerate(wide) if value]])

    def test_given(self):
        """The values that the example starts from"""
        self.found("`position`", *[[x.position] for x in self.NEIGHBOURS])
        self.found("`q`; `o`; `rotation`", *[[x.q, [x.o], x.rotation] for x in self.NEIGHBOURS])
        self.found("`dc`", *[[x.dc] for x in self.NEIGHBOURS])

    def found(self, name, *cells):
        self.assertEqual(self.rows[name], [[list(part) for part in cell] for cell in cells], name)


def numbers(text):
    """The integers of a cell of a table."""
    return [int(number) for number in re.findall(r"-?\d+", text)]


if __name__ == "__main__":
    unittest.main()
