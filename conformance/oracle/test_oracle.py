#!/usr/bin/env python3
"""Unit checks from the examples in the text; python3 -m unittest test_oracle"""

import struct
import unittest

import models as pm
from conventions import BitReader, ByteReader, Round, crc32, unzigzag, xxh64
from decoding import Decoder
from errors import StreamError
from parsing import BlockDecoder
from reconstruction import prefix_count
from semantics import parse_file_header, parse_unit_header
from synth import Synth, Bits


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


if __name__ == "__main__":
    unittest.main()
