#!/usr/bin/env python3
"""Unit checks from the examples in the text; python3 -m unittest oracle.test_oracle"""

import hashlib
import math
import os
import random
import struct
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))

from generator.synth.encoding import Bits
from generator.synth.network import NetworkWriter
from oracle import models as pm, prediction, tables, transformer
from oracle.cells import Cell, Cells, unity
from oracle.conventions import BitReader, ByteReader, Round, crc32, tz, unzigzag, xxh64
from oracle.entropy_state import entropy_state
from oracle.errors import StreamError
from oracle.frame import Gop
from oracle.lists import Gaussian
from oracle.network import REGISTRY, arrays, parse_network, parse_weights
from oracle.parsing import BlockDecoder
from oracle.reconstruction import prefix_count
from oracle.scene_description import parse_scene_description
from oracle.semantics import parse_file_header, parse_unit_header


class Conventions(unittest.TestCase):
    def test_round(self):
        self.assertEqual([Round(32, 6), Round(-32, 6), Round(-33, 6)], [1, 0, -1])

    def test_leb128(self):
        self.assertEqual(ByteReader(b"\xac\x02", 0, 2).leb128("4.3"), 300)
        self.assertEqual(ByteReader(b"\xff\xff\xff\xff\x0f", 0, 5).leb128("4.3"), 2 ** 32 - 1)
        for data, code in ((b"\x80\x00", "NUMBER"), (b"\xff\xff\xff\xff\x10", "NUMBER"), (b"\x80", "SHORT_SECTION")):
            with self.assertRaises(StreamError) as caught:
                ByteReader(data, 0, len(data)).leb128("4.3")
            self.assertEqual(caught.exception.code, code)

    def test_ue_se(self):
        for text, ue, se in (("1", 0, 0), ("010", 1, 1), ("011", 2, -1), ("00100", 3, 2), ("00110", 4, -2)):
            data = bytes([int(text[::-1], 2)])
            self.assertEqual(BitReader(data, 0, 1, "4.4").ue(), ue)
            self.assertEqual(BitReader(data, 0, 1, "4.4").se(), se)

    def test_bit_errors(self):
        for data, bits, code in ((b"\x00\x00", 3, "TRAILING_BYTES"), (b"\x80", 3, "PADDING"), (b"\x00", 9, "SHORT_SECTION")):
            reader = BitReader(data, 0, len(data), "4.4")
            with self.assertRaises(StreamError) as caught:
                reader.u(bits)
                reader.check_end()
            self.assertEqual(caught.exception.code, code)
        with self.assertRaises(StreamError) as caught:
            BitReader(bytes(5), 0, 5, "4.4").ue()
        self.assertEqual(caught.exception.code, "NUMBER")

    def test_zigzag(self):
        self.assertEqual([unzigzag(u) for u in range(5)], [0, -1, 1, -2, 2])

    def test_crc32(self):
        self.assertEqual([crc32(b) for b in (b"", b"123456789", bytes(4))], [0, 0xCBF43926, 0x2144DF1C])

    def test_xxh64(self):
        rows = [(b"", 0, 0xEF46DB3751D8E999), (b"", 7, 0x95F0626F6F0A4409), (b"a", 0, 0xD24EC4F1A98C6E5B),
                (b"abc", 0, 0x44BC2CF5AD770999), (b"123456789", 0, 0x8CB841DB40E6AE83),
                (b"123456789", 1, 0x1A4CC2C9E8079790), (bytes(range(14)), 0, 0x5CDA8B69BBFC1D45),
                (bytes(range(32)), 0, 0xCBF59C5116FF32B4), (bytes(range(101)), 0, 0xE99038495F85381E),
                (bytes(range(101)), 2, 0xAB9E69F335C3A2B7), (struct.pack("<3i", -1, 0, 1), 13, 0xF950AAF652253B04)]
        for data, seed, value in rows:
            self.assertEqual(xxh64(seed, data), value)


class Parsing(unittest.TestCase):
    def test_headers_of_annex_b(self):
        data = bytes.fromhex("89475353 0d0a1a0a 82030002 8c0da41c 020100000000 e4a2 00000000 0c000000 f1c67fb7"
                             "0000000001000000 00000000")
        self.assertEqual(parse_file_header(data).level, 2)
        unit = parse_unit_header(data, 16)
        self.assertEqual((unit.unit_type, crc32(data[36:48])), (2, unit.payload_crc))

    def test_prefix(self):
        seq = type("Seq", (), {"refinement_percent": [10, 20, 30, 50, 100]})
        self.assertEqual([prefix_count(seq, 101, r) for r in range(-1, 5)], [0, 11, 21, 31, 51, 101])

    def test_tokens(self):
        for token, raw, value in ((3, 0, 3), (7, 0, 7), (8, 0, 8), (8, 1, 9), (15, 0, 28), (15, 3, 31)):
            block = BlockDecoder.__new__(BlockDecoder)
            block.raw = BitReader(bytes([raw]), 0, 1, "8.2")
            self.assertEqual(block.value(token, 2), value)
        position = pm.Plane(0, "position", 0, "position")
        self.assertEqual(max(position.largest_token(k) for k in (2, 3, 4, 5)), 251)

    def test_rans_example(self):
        block = BlockDecoder.__new__(BlockDecoder)
        block.x, block.words, block.word_count, block.next_word = [0x10000004], [0x0208], 1, 0
        table = pm.Table({0: 8, 1: 2040, 2: 2048})
        states = [(block.symbol(0, table), block.x[0]) for _ in range(4)]
        self.assertEqual(states, [(0, 0x80004), (0, 0x4040208), (1, 0x2000000), (0, 0x10000)])

    def test_entropy_state(self):
        """conformance/README.md: states and bytes block by block, then values, 64 bits for positions"""
        planes = [pm.Plane(0, "position", 0, "position"), pm.Plane(1, "opacity", 0, "signed")]
        models = [type("Model", (), {"bias": bias})() for bias in (0, -7)]
        blocks = [type("Block", (), {"lanes": 2, "x": [65536, 65536], "size": size, "e": e})()
                  for size, e in ((9, [[1, 2 ** 40], [3, 4]]), (11, [[5], [-6]]))]
        data = struct.pack("<6I3Q3i", 65536, 65536, 9, 65536, 65536, 11, 1, 2 ** 40, 5, -4, -3, -13)
        self.assertEqual(entropy_state([(planes, models, blocks)]), xxh64(0, data))

    def test_explicit_lengths(self):
        """Lengths 1, 2, 3, 4, 5 and 12 with the largest mantissa: 1, 3, 7, 15, 30, 3840"""
        for length, freq in ((1, 1), (2, 3), (3, 7), (4, 15), (5, 30), (12, 3840)):
            bits = Bits()
            bits.u(0, 1)                            # mode; last is 1
            bits.se(length)
            bits.u(2 ** min(length - 1, 3) - 1, min(length - 1, 3))
            data = bits.bytes()
            table = pm.explicit_table(BitReader(data, 0, len(data), "8.3"), 1)
            self.assertEqual((table.tokens, table.freq), ([0, 1], [4096 - freq, freq]))

    def test_parametric_tables(self):
        """The examples of 8.3"""
        freq = pm.parametric_table(True, 2, 9, 2, 0, 3, 0).freq
        self.assertEqual(freq, [2952, 520, 520, 44, 43, 6, 6, 2, 1, 2])
        freq = pm.parametric_table(True, 3, 12, 1, 6, 5, -2).freq
        self.assertEqual(freq, [307, 1120, 111, 820, 49, 1120, 24, 307, 123, 56, 28, 15, 16])
        freq = pm.parametric_table(False, 2, 20, 0, 0, 9, 0).freq
        self.assertEqual(freq, [602, 902, 542, 361, 259, 194, 151, 122, 181, 130, 97, 76, 111, 76, 57, 43, 62, 42, 31, 24, 33])


class Sequence:
    """The elements on which cells depend."""

    position_bits, rotation_step = 10, 0.02


class Frames(unittest.TestCase):
    """Clauses 7.3 to 7.7, part by part."""

    def test_order_of_frames(self):
        """The table of 7.3.1"""
        rows = {0: ("I0 P0 P0 P0 P0 P0 P0 P0 P0", [0, 1, 2, 3, 4, 5, 6, 7]),
                1: ("I0 B1 P0 B1 P0 B1 P0 B1 P0", [0, 0, 2, 2, 4, 4, 6, 6]),
                2: ("I0 B2 B1 B2 P0 B2 B1 B2 P0", [0, 0, 2, 0, 4, 4, 6, 4]),
                3: ("I0 B3 B2 B3 B1 B3 B2 B3 P0", [0, 0, 2, 0, 4, 4, 6, 0])}
        for depth, (names, references) in rows.items():
            gop = Gop(type("Header", (), {"gop_structure": 1, "temporal_depth": depth}), 100)
            order = [gop.order(100 + k) for k in range(9)]
            self.assertEqual(" ".join("IPB"[kind] + str(layer) for kind, layer, _ in order), names)
            self.assertEqual([index for _, _, index in order[1:]], references)

    def test_tz(self):
        self.assertEqual([tz(1), tz(12)], [0, 2])

    def test_unity(self):
        """SS-MO-003"""
        self.assertEqual([unity(x) for x in (1.0, 0.5, 0.02, 0.7, 2.0 ** -40)], [1, 2, 50, 1, 32767])

    def displaced(self, fine, rotation, cell, cell_log2=9):
        cells = Cells(cell_log2, Sequence)
        X = tuple(Round(x, 6) >> cell_log2 for x in fine)
        cells.by_coordinates[X] = cell
        moved = cells.displaced(Gaussian(fine, (0, 0, 0), 0, rotation, (0, 0, 0), (), 1))
        return moved.position_fine, moved.rotation_fine

    def test_displacement_without_rotation(self):
        fine, rotation = self.displaced((640, 1000, 33), (100, -7, 3200), Cell([8, -16, -80000], [0, 0, 0], 0))
        self.assertEqual((fine, rotation), ((704, 872, 0), (100, -7, 3200)))

    def test_rotation_of_a_cell(self):
        """60 degrees about z: the rotation is the sine of 30 degrees, 8192 in Q14; the root for w is rounded down."""
        centre = 256 << 6
        fine, rotation = self.displaced((centre + 6400, centre, centre), (0, 0, 0), Cell([0] * 3, [0, 0, 8192], 0))
        self.assertEqual(fine, (centre + 3200, centre + math.floor(6400 * math.sin(math.pi / 3)), centre))
        self.assertEqual(rotation, (0, 0, 1600))    # sine of 30 degrees in 64ths of 1 / 0.02

    def test_table_exp(self):
        self.assertEqual(tables.EXP, [round(4096 * math.exp(-x / 32)) for x in range(256)])

    def test_neighbours(self):
        """SS-PR-005, with equal codes and distances: among 16 or fewer the nearest, else of those around the code."""
        rng = random.Random(7)
        for size in (1, 2, 9, 16, 100, 400):
            references = [prediction.Reference(tuple(rng.randrange(12) for _ in range(3)), 0, 0, 0, 0, 0)
                          for _ in range(size)]
            search = prediction.Neighbours(references)
            for _ in range(30):
                position = tuple(rng.randrange(14) for _ in range(3))
                around = sorted((prediction.morton(g.position), index) for index, g in enumerate(references))
                below = [index for code, index in around if code < prediction.morton(position)]
                others = [index for code, index in around if code >= prediction.morton(position)]
                every = sorted((sum((a - b) ** 2 for a, b in zip(position, references[index].position)), index)
                               for index in below[-16:] + others[:16])
                count = rng.randint(1, 16)
                self.assertEqual(search.find(position, count), every[:count])

    def test_morton(self):
        self.assertEqual([prediction.morton(x) for x in ((1, 0, 0), (0, 1, 0), (0, 0, 1), (3, 0, 2))], [1, 2, 4, 41])

    def test_mean(self):
        """SS-PR-006: halves towards positive infinity"""
        self.assertEqual([prediction.mean([1, 1], x) for x in ([0, 1], [-1, 0], [-3, 0], [-2, 0])], [1, 0, -1, -1])

    def test_sources(self):
        """The second table of 8.5"""
        def sources(section, *shape):
            return [[s for s in range(12) if pm.source_available(s, plane)]
                    for plane in pm.section_planes(section, *shape)]
        up_to = [list(range(k + 1)) for k in range(12)]
        self.assertEqual(sources("cells"), [up_to[1], up_to[2]] + [up_to[3], up_to[4], up_to[4]] * 2)
        self.assertEqual(sources("modes") + sources("move_predictors") + sources("predictors"), [up_to[2]] * 3)
        self.assertEqual(sources("moves"), [up_to[2], up_to[4], up_to[4]])
        expected = [up_to[2], up_to[4], up_to[4], up_to[3], up_to[3], up_to[4], up_to[4], up_to[3], up_to[4]]
        self.assertEqual(sources("updates", 2, 1, 2), expected + [up_to[3], up_to[4]])
        self.assertEqual(sources("updates", 2, 2, 2, 2), expected + [[0], [0, 3, 4]])
        first = up_to[3] + [5, 6, 7, 8, 9, 10, 11]
        expected = [up_to[1], up_to[2] + [10], up_to[5] + [10], up_to[6] + [10], up_to[3] + [5, 6, 7, 8, 10, 11],
                    first, up_to[11], up_to[11], first, up_to[11]]
        self.assertEqual(sources("new", 2, 1, 2), expected + [first, up_to[11]])
        self.assertEqual(sources("new", 2, 2, 2, 2), expected + [[0, 5, 6, 7, 8, 9, 10, 11], [0] + up_to[11][3:]])


def small_network(**asked):
    """A network of zeros with d = 8 and one dc component; layer shifts are 6 but for logit 5 and head 1."""
    asked = {"network_flags": 0, "width_log2": 3, "feed_forward_width": 0, "geometry_width": 0, "fourier_count": 0,
             "rank_count": 1, "dc_count": 1, "sh_count": 0, "token_shift": 0, "output_shift": 1, "fill": "zero",
             "layer_shift": [6, 6, 6, 5, 6, 6, 6, 1], **asked}
    data = NetworkWriter(random.Random(1), asked).bytes()
    return parse_network(ByteReader(data, 0, len(data)))


class Transform:
    """A transform with one component."""

    def __init__(self, dimension, basis):
        self.dimension, self.rank, self.basis = dimension, 1, basis


def neighbour(position, dc):
    return prediction.Reference(position, (0, 0, 0), 0, (0, 0, 0), dc, ())


class Learned(unittest.TestCase):
    """Clauses 6.17 and 7.7.6, with values worked out by hand or in floats."""

    def test_sine(self):
        self.assertEqual(tables.SINE, [round(127 * math.sin(math.pi * x / 256)) for x in range(129)])
        for x in range(-4100, 4100):
            self.assertEqual(transformer.sine(x), round(127 * math.sin(2 * math.pi * x / 512)))

    def test_act(self):
        self.assertEqual([transformer.act(x, 1) for x in (1, -1, -3, 300, -300)], [1, 0, -1, 127, -127])
        self.assertEqual([transformer.rounded_mean(x) for x in ([1, 2], [-1, -2], [0, 0, 2], [0, 0, -2])], [2, -1, 1, -1])

    def test_near(self):
        """The farthest coordinate becomes 127; halves towards positive infinity, so not -127.5 but -127"""
        t = transformer.Transformer(small_network(), None, None)
        near = t.near((10, 10, 10), [(neighbour((30, 10, 9), ()), 0), (neighbour((-10, 13, 10), ()), 0)])
        self.assertEqual(near, [[127, 0, -6], [-127, 19, 0]])                     # -6.35, 19.05
        self.assertEqual(t.near((5, 5, 5), [(neighbour((5, 5, 5), ()), 0)]), [[0, 0, 0]])

    def by_hand(self, net):
        """Two neighbours with equal weights whose dc[0] is 50 below and 50 above the base 150."""
        net.embedding[0][0], net.query[0][0], net.value[0][0] = 64, 30, 64       # h is the token; 30; value 1
        net.head[0][0], net.head_bias[0][0] = 2, 7
        t = transformer.Transformer(net, Transform(3, [4096, 0, -2048]), None)
        around = [(neighbour((1, 0, 0), (100, 5, 0)), 1), (neighbour((0, 2, 0), (200, 5, 0)), 4)]
        return t.predict(((0, 0, 0), (0, 0, 0), 0, (0, 0, 0)), around, [4096, 4096],
                         {"dc": (150, 5, 0), "sh": ()})

    def test_flat_by_hand(self):
        """Shares are 128 and 128, z is 0, x[0] is 30 + 10, the output Round(87, 1) << 1 = 88."""
        net = small_network()
        net.value_bias[0][0] = 640
        self.assertEqual(self.by_hand(net), {"dc": (238, 5, -44), "sh": ()})

    def test_attention_by_hand(self):
        """Logits -47 and 47, e 217 and 4096, r 15559, shares 13 and 243, z 45, x[0] 75, Round(157, 1) << 1 = 158"""
        net = small_network()
        net.attention[0][0] = 64
        self.assertEqual(self.by_hand(net), {"dc": (308, 5, -79), "sh": ()})

    def test_feed_forward_by_hand(self):
        """As test_flat_by_hand; wide is (40, 0), x[0] becomes 40 - 25, the output Round(37, 1) << 1 = 38."""
        net = small_network(feed_forward_width=2)
        net.value_bias[0][0] = 640
        net.widening[0][0], net.widening[1][0] = 64, -64
        net.narrowing[0][0], net.narrowing_bias[0][0] = -64, 15 * 64
        self.assertEqual(self.by_hand(net), {"dc": (188, 5, -19), "sh": ()})

    def test_geometry_and_fourier_by_hand(self):
        """At 127 the angle is 89.3 degrees; hidden is max(0, 127), and 0 for the second neighbour."""
        net = small_network(geometry_width=1, fourier_count=2)
        net.geometry[0][0], net.geometry_embedding[3][0] = 64, 32
        net.fourier[0][:] = [1, 2, 0, 0, 0, 0, 3, 4, 0, 0, 0, 0]
        t = transformer.Transformer(net, None, None)
        self.assertEqual([t.embedded(0, [0] * 9, [x, 9, 9])[3] for x in (127, -127)], [64, 0])
        # 1 * sin(127) + 2 * sin(255) + 3 * sin(254) + 4 * sin(382), in parts of 512
        self.assertEqual(t.fourier([127, 0, 0], [0, 0, 0]), 127 + 2 * 2 + 3 * 3 - 4 * 127)
        self.assertEqual(t.fourier([0, 0, 0], [0, 0, 0]), 2 * 127 + 4 * 127)

    def test_normalisation(self):
        """8 * gain * (x - mean) / |x - mean|"""
        net = small_network(network_flags=4)
        t, rng = transformer.Transformer(net, None, None), random.Random(3)
        for _ in range(50):
            x = [rng.randint(-127, 127) for _ in range(8)]
            net.gain[0][:] = [rng.randint(-20, 20) for _ in range(8)]
            mean = sum(x) / 8
            size = math.sqrt(sum((value - mean) ** 2 for value in x))
            for got, value, gain in zip(t.normalised(x), x, net.gain[0]):
                self.assertAlmostEqual(got, 8 * gain * (value - mean) / size, delta=1 + 0.07 * abs(gain))
        net.gain_bias[0][2] = -100
        self.assertEqual(t.normalised([9] * 8), [0, 0, -3, 0, 0, 0, 0, 0])        # Round(-100, 5)

    def test_against_floats(self):
        """Whole networks of all flags: the error of rounding is small beside what the network does."""
        for seed in range(24):
            rng = random.Random(seed)
            asked = {"network_flags": seed % 8, "dc_count": 3, "sh_count": 0, "token_shift": 0, "output_shift": 0}
            data = NetworkWriter(rng, asked).bytes()
            net = parse_network(ByteReader(data, 0, len(data)))
            t = transformer.Transformer(net, None, None)
            count = rng.randint(2, 16)
            tokens = [[rng.randint(-60, 60) for _ in range(net.f)] for _ in range(count)]
            near = [[rng.randint(-127, 127) for _ in range(3)] for _ in range(count)]
            h = [t.embedded(j, token, near_j) for j, (token, near_j) in enumerate(zip(tokens, near))]
            x = [t.fed_forward(t.normalised(t.attended(*pair, h, near))) for pair in zip(*t.rows(h, near))]
            expected = FloatNetwork(net).outputs(tokens, near)
            errors = [abs(a - b) for a, b in zip(t.outputs(x), expected)]
            self.assertLess(sum(errors), 6 + 0.03 * sum(map(abs, expected)), seed)

    def test_bytes_of_networks(self):
        """A.3; and the table of 6.17.2 for every combination of flags"""
        widest = small_network(width_log2=6, feed_forward_width=128, geometry_width=32, fourier_count=4, rank_count=16,
                               dc_count=3, sh_count=16, network_flags=4)
        size = sum({"i8": 1, "i16": 2}[kind] * rows * columns for _, kind, rows, columns in arrays(widest))
        self.assertEqual(size, 32606)
        sizes = [8 * 9 + 16 + 8 * 8 * 2 + 16 + 8 + 2 + (0 if k & 1 else 8) + (24 if k & 4 else 0) for k in range(8)]
        for k in range(8):
            data = NetworkWriter(random.Random(k), {"network_flags": k, "width_log2": 3, "feed_forward_width": 0,
                                                    "geometry_width": 0, "fourier_count": 0, "rank_count": 1,
                                                    "dc_count": 1, "sh_count": 0}).bytes()
            self.assertEqual(len(data), 18 + sizes[k])
            self.assertEqual(parse_network(ByteReader(data, 0, len(data))).gated, k >> 1 & 1)

    def test_registry(self):
        """A digest instead of a network gives the registered one."""
        data = NetworkWriter(random.Random(5), {}).bytes()
        digest = hashlib.sha256(data).digest()
        with self.assertRaises(StreamError) as caught:
            parse_weights(ByteReader(b"\x01" + digest, 0, 33), False)
        self.assertEqual((caught.exception.code, caught.exception.byte), ("RESERVED", 1))
        REGISTRY[digest] = data
        try:
            net = parse_weights(ByteReader(b"\x01" + digest, 0, 33), False)
        finally:
            del REGISTRY[digest]
        self.assertEqual(net.head, parse_network(ByteReader(data, 0, len(data))).head)


class FloatNetwork:
    """SS-TR-003 to SS-TR-008 up to the outputs, without rounding and without the tables."""

    def __init__(self, net):
        self.net = net

    def layer(self, weights, x, bias, layer):
        shift = 2.0 ** self.net.layer_shift[layer]
        sums = [sum(w * v for w, v in zip(row, x)) + b for row, b in zip(weights, bias)]
        return [max(-127.0, min(127.0, total / shift)) for total in sums]

    def outputs(self, tokens, near):
        net = self.net
        h = []
        for j, (token, near_j) in enumerate(zip(tokens, near)):
            hidden = [max(0.0, v) for v in self.layer(net.geometry, near_j, net.geometry_bias[0], 0)]
            weights = [a + b for a, b in zip(net.embedding, net.geometry_embedding)]
            h.append(self.layer(weights, token + hidden, net.rank[min(j, net.rank_count - 1)], 1))
        rows, origins = h, near
        if not net.network_flags & 1:
            mean = [sum(column) / len(h) for column in zip(*h)]
            rows, origins = [[max(-127, min(127, m + q)) for m, q in zip(mean, net.query[0])]], [[0, 0, 0]]
        x = [self.row(row, origin, h, near) for row, origin in zip(rows, origins)]
        pool = [sum(column) / len(x) for column in zip(*x)]
        shift = 2.0 ** net.layer_shift[7]
        return [max(-1023, min(1023, (sum(w * v for w, v in zip(row, pool)) + b) / shift))
                for row, b in zip(net.head, net.head_bias[0])]

    def row(self, row, origin, h, near):
        net = self.net
        u = self.layer(net.attention, row, [0] * net.d, 2)
        logit = [(sum(a * b for a, b in zip(u, h_j)) + self.fourier(near_j, origin)) / 2.0 ** net.layer_shift[3]
                 for h_j, near_j in zip(h, near)]
        e = [math.exp(x / 32 - max(logit) / 32) for x in logit]
        z = [sum(a * b for a, b in zip(e, column)) / sum(e) for column in zip(*h)]
        x = self.added(row, self.layer(net.value, z, net.value_bias[0], 4))
        if net.network_flags & 4:
            mean = sum(x) / net.d
            size = max(1.0, math.sqrt(sum((value - mean) ** 2 for value in x)))
            x = [max(-127, min(127, (gain * 256 * (value - mean) / size + b) / 32))
                 for value, gain, b in zip(x, net.gain[0], net.gain_bias[0])]
        if net.e:
            wide = [max(0.0, v) for v in self.layer(net.widening, x, net.widening_bias[0], 5)]
            x = self.added(x, self.layer(net.narrowing, wide, net.narrowing_bias[0], 6))
        return x

    def added(self, x, y):
        return [max(-127, min(127, a + b)) for a, b in zip(x, y)]

    def fourier(self, near_j, origin):
        total = 0
        for i, weight in enumerate(self.net.fourier[0]):
            angle = 2 * math.pi * (near_j[i % 6 // 2] - origin[i % 6 // 2]) * 2 ** (i // 6) / 512
            total += weight * 127 * (math.cos(angle) if i % 2 else math.sin(angle))
        return total


if __name__ == "__main__":
    unittest.main()
