#!/usr/bin/env python3
"""Unit checks from the examples in the text; python3 -m unittest test_oracle"""

import math
import random
import struct
import unittest

import models as pm
import points
import prediction
from cells import Cell, Cells, unity
from conventions import BitReader, ByteReader, Round, crc32, tz, unzigzag, xxh64
from decode import report
from decoding import Decoder
from dynamic import Gop
from encoding import Bits
from errors import StreamError
from extraction import extract
from homes import Gaussian
from parsing import BlockDecoder
from reconstruction import prefix_count
from semantics import parse_file_header, parse_unit_header
from synth import Synth
from synth_dynamic import DynamicSynth, valid_stream
from synth_faults import FAULTS, faulty_stream
from synth_mutations import MUTATIONS, mutated, stream_of, units_of


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
        data = bytes.fromhex("89475353 0d0a1a0a 01000002 00aa0ee1 020100000000 e4a2 00000000 0c000000 f1c67fb7"
                             "0000000001000000 00000000")
        self.assertEqual(parse_file_header(data).level, 2)
        unit = parse_unit_header(data, 16, 0)
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

    def test_explicit_lengths(self):
        """Lengths 1, 2, 3, 4, 5 and 12 with the largest mantissa: 1, 3, 7, 15, 30, 3840"""
        for length, freq in ((1, 1), (2, 3), (3, 7), (4, 15), (5, 30), (12, 3840)):
            bits = Bits()
            bits.u(1, 8)
            bits.u(0, 8)
            bits.se(length)
            bits.u(2 ** min(length - 1, 3) - 1, min(length - 1, 3))
            data = bits.bytes()
            table = pm.explicit_table(BitReader(data, 0, len(data), "8.3"), 100)
            self.assertEqual((table.tokens, table.freq), ([0, 1], [4096 - freq, freq]))


class Streams(unittest.TestCase):
    def test_synthetic_streams(self):
        for seed in range(5):
            self.assertEqual(Decoder(Synth(seed).stream()).decode().errors, [])


class Sequence:
    """The elements on which cells depend."""

    position_bits, rotation_step = 10, 0.02


class Dynamic(unittest.TestCase):
    """Clauses 7.13 to 7.17, part by part."""

    def test_order_of_frames(self):
        """The table of 7.13.1"""
        rows = {0: ("I0 P0 P0 P0 P0 P0 P0 P0 P0", [0, 1, 2, 3, 4, 5, 6, 7]),
                1: ("I0 B1 P0 B1 P0 B1 P0 B1 P0", [0, 0, 2, 2, 4, 4, 6, 6]),
                2: ("I0 B2 B1 B2 P0 B2 B1 B2 P0", [0, 0, 2, 0, 4, 4, 6, 4]),
                3: ("I0 B3 B2 B3 B1 B3 B2 B3 P0", [0, 0, 2, 0, 4, 4, 6, 0])}
        for depth, (names, references) in rows.items():
            gop = Gop(type("Header", (), {"gop_structure": 1, "temporal_depth": depth}), 100)
            order = [gop.order(100 + k) for k in range(9)]
            self.assertEqual(" ".join("IPB"[kind] + str(layer) for kind, layer, _ in order), names)
            self.assertEqual([place for _, _, place in order[1:]], references)

    def test_tz(self):
        self.assertEqual([tz(1), tz(12)], [0, 2])

    def test_unity(self):
        """SS-MO-003"""
        self.assertEqual([unity(x) for x in (1.0, 0.5, 0.02, 0.7, 2.0 ** -40)], [1, 2, 50, 1, 32767])

    def displaced(self, fine, rotation, cell, cell_log2=9):
        cells = Cells(cell_log2, Sequence)
        place = tuple(Round(x, 6) >> cell_log2 for x in fine)
        cells.by_place[place] = cell
        moved = cells.displaced(Gaussian(fine, (0, 0, 0), 0, rotation, (0, 0, 0), (), 1))
        return moved.position_fine, moved.rotation_fine

    def test_displacement_without_turn(self):
        fine, rotation = self.displaced((640, 1000, 33), (100, -7, 3200), Cell([8, -16, -80000], [0, 0, 0], 0))
        self.assertEqual((fine, rotation), ((704, 872, 0), (100, -7, 3200)))

    def test_turn(self):
        """60 degrees about z: the turn is the sine of 30 degrees, 8192 in Q14; the root for w is rounded down."""
        centre = 256 << 6
        fine, rotation = self.displaced((centre + 6400, centre, centre), (0, 0, 0), Cell([0] * 3, [0, 0, 8192], 0))
        self.assertEqual(fine, (centre + 3200, centre + math.floor(6400 * math.sin(math.pi / 3)), centre))
        self.assertEqual(rotation, (0, 0, 1600))    # sine of 30 degrees in 64ths of 1 / 0.02

    def test_table_exp(self):
        self.assertEqual(prediction.EXP, [round(4096 * math.exp(-x / 32)) for x in range(256)])

    def test_neighbours(self):
        """SS-PR-004 against a sort of all Gaussians, with many equal distances."""
        rng = random.Random(7)
        for size in (1, 2, 9, 100, 400):
            references = [prediction.Reference(tuple(rng.randrange(12) for _ in range(3)), 0, 0, 0, 0, 0)
                          for _ in range(size)]
            tree = prediction.Neighbours(references)
            for _ in range(30):
                position = tuple(rng.randrange(-1, 14) for _ in range(3))
                every = sorted((sum((a - b) ** 2 for a, b in zip(position, g.position)), index)
                               for index, g in enumerate(references))
                count = rng.randint(1, 16)
                self.assertEqual(tree.find(position, count), every[:count])

    def test_mean(self):
        """SS-PR-005: halves towards positive infinity"""
        self.assertEqual([prediction.mean([1, 1], x) for x in ([0, 1], [-1, 0], [-3, 0], [-2, 0])], [1, 0, -1, -1])

    def test_sources_of_sections(self):
        """SS-EC-007"""
        planes = pm.section_planes("cells", 3, 0, 0, 0)
        available = [[s for s in range(11) if pm.source_available_in_section(s, plane)] for plane in planes]
        self.assertEqual(available, [[0, 1], [0, 1, 2]] + [[0, 1, 2, 3], [0, 1, 2, 3, 4], [0, 1, 2, 3, 4]] * 2)


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

    def test_faults(self):
        for k, fault in enumerate(FAULTS):
            if fault[0] == "dc-output":             # rare; in make_vectors.py
                continue
            data, _ = faulty_stream(fault, 20 * k, most=12)
            self.assertEqual(Decoder(data).decode().errors[0].code, fault[1], fault[0])

    def test_mutations(self):
        streams = [valid_stream(seed, most=12) for seed in (3, 14, 22)]
        for mutation in MUTATIONS:
            for seed, data in enumerate(streams):
                changed = mutated(mutation, data, seed)
                if changed is not None and mutation[1] is not None:
                    self.assertEqual(Decoder(changed).decode().errors[0].code, mutation[1], mutation[0])

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
            lost.damaged = True
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
