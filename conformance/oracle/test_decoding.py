#!/usr/bin/env python3
"""Checks of clause 7.1 with streams of frames without Gaussians; python3 -m unittest oracle.test_decoding"""

import os
import struct
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))

from generator.synth.encoding import file_header, unit
from generator.synth.stream import sequence_payload
from oracle import constants as c
from oracle.decoding import Decoder
from oracle.lists import lists_digest

PLANES = 13
LAYERS, REFINEMENTS = 2, 5


class Stream:
    """Units of a stream by name, in order; close() joins them."""

    def __init__(self):
        self.names, self.units = [], []
        self.parameters = sequence_payload({"spatial_layer_count": LAYERS, "temporal_layer_count": 2,
                                            "percent": [10, 20, 30, 50, 100]})
        self.gops = 0

    def put(self, name, kind, payload, **header):
        self.names.append(name)
        self.units.append(unit(kind, payload, **header))

    def gop(self, first, count, predicted=True):
        self.put("sequence %d" % self.gops, c.UT_SEQUENCE, self.parameters)
        self.first = first
        self.put("gop %d" % self.gops, c.UT_GOP, struct.pack("<IIBBH", self.gops, count, predicted, 0, 0), frame=first)
        identity = struct.pack("<4B3i9h", 0, 0, 3, 3, 0, 0, 0, 4096, 0, 0, 0, 4096, 0, 0, 0, 4096)
        self.put("transform %d" % self.gops, c.UT_TRANSFORM, identity, frame=first)
        self.gops += 1
        for number in range(first, first + count):
            self.frame(number, number > first and predicted)

    def frame(self, number, is_p):
        self.put("frame %d" % number, c.UT_FRAME, struct.pack("<4BI", is_p, 0, 255, 0, 0), frame=number)
        for s in range(LAYERS - 1 if is_p else 0, LAYERS):
            for r in range(REFINEMENTS):
                digest = lists_digest([[]] * (r + 1), PLANES)
                self.put("unit %d %d %d" % (number, s, r), c.UT_INCREMENT, struct.pack("<HQ", 0, digest), frame=number,
                         spatial=s, refinement=r)

    def damaged(self, name, byte=-1):
        """Flips a bit of a unit."""
        content = bytearray(self.units[self.names.index(name)])
        content[byte] ^= 1
        self.units[self.names.index(name)] = bytes(content)
        return self

    def without(self, *names):
        for name in names:
            del self.units[self.names.index(name)], self.names[self.names.index(name)]
        return self

    def close(self):
        """Without a compared index; the end unit is that of the whole stream."""
        frames = sum(name.startswith("frame") for name in self.names)
        end = unit(c.UT_END, struct.pack("<IIQ", frames, len(self.units), 0))
        return file_header(c.PROFILE_DYNAMIC, 1) + b"".join(self.units) + end

    def decode(self):
        return Decoder(self.close()).decode()


def two_gops(predicted=True):
    stream = Stream()
    stream.gop(0, 3, predicted)
    stream.gop(3, 2, predicted)
    return stream


def codes(decoder):
    return [error.code for error in decoder.errors]


def numbers(decoder):
    return [frame.number for frame in decoder.frames]


class Decoding(unittest.TestCase):
    def test_whole(self):
        for predicted in (False, True):
            decoder = two_gops(predicted).decode()
            self.assertEqual((codes(decoder), numbers(decoder), decoder.lost), ([], [0, 1, 2, 3, 4], []))

    def test_damaged_increment(self):
        """The example of 7.1.4: list 4 of all layers and frames, and nothing else"""
        decoder = two_gops().damaged("unit 0 0 4").decode()
        self.assertEqual((codes(decoder), numbers(decoder), decoder.lost), (["CHECKSUM"], [0, 1, 2, 3, 4], []))
        self.assertEqual([frame.counts for frame in decoder.frames], [[4, 4], [0, 4], [0, 4], [5, 5], [0, 5]])

    def test_missing_increments(self):
        decoder = two_gops().without("unit 0 0 4").decode()
        self.assertEqual((codes(decoder), decoder.frames[0].counts), (["UNEXPECTED_UNIT"], [4, 4]))
        decoder = two_gops().without(*["unit 1 1 %d" % r for r in range(5)]).decode()
        self.assertEqual([frame.level() for frame in decoder.frames[:3]], [5, 0, 0])
        self.assertFalse(decoder.frames[1].lost)

    def test_frame_without_increments(self):
        names = ["unit 0 %d %d" % (s, r) for s in range(LAYERS) for r in range(REFINEMENTS)]
        decoder = two_gops().without(*names).decode()
        self.assertEqual((codes(decoder), [frame.lost for frame in decoder.frames]),
                         (["CONSTRAINT"], [True, True, True, False, False]))

    def test_fatal_error(self):
        """The rest of the GOP is lost; the next GOP is decoded."""
        decoder = two_gops().damaged("frame 1").decode()
        self.assertEqual((codes(decoder), numbers(decoder), decoder.lost), (["CHECKSUM"], [0, 3, 4], [[1, 2]]))
        for byte in (6, 12):                        # header_check and payload_length
            decoder = two_gops().damaged("unit 1 1 0", byte).decode()
            self.assertEqual((codes(decoder), numbers(decoder), decoder.lost), (["CHECKSUM"], [0, 1, 3, 4], [[2, 2]]))

    def test_damaged_gop_header(self):
        decoder = two_gops().damaged("gop 0").decode()
        self.assertEqual((codes(decoder), numbers(decoder), decoder.lost), (["CHECKSUM"], [3, 4], [[0, 2]]))
        decoder = two_gops().damaged("gop 1").decode()
        self.assertEqual((codes(decoder), numbers(decoder), decoder.lost), (["CHECKSUM"], [0, 1, 2], []))

    def test_damaged_sequence_parameters(self):
        for byte in (-1, 6):
            decoder = two_gops().damaged("sequence 0", byte).decode()
            self.assertEqual((codes(decoder), numbers(decoder), decoder.lost), (["CHECKSUM"], [3, 4], [[0, 2]]))

    def test_gap_between_gops(self):
        stream = two_gops()
        stream.gop(5, 1)
        middle = [name for name in stream.names[stream.names.index("gop 1"):stream.names.index("sequence 2")]]
        decoder = stream.without(*middle).decode()
        self.assertEqual((codes(decoder), numbers(decoder), decoder.lost), (["MISMATCH"], [0, 1, 2, 5], [[3, 4]]))
        stream = two_gops()
        stream.units += stream.units[:3]            # a GOP that goes back, and is not acceptable later either
        decoder = stream.decode()
        self.assertEqual((codes(decoder), numbers(decoder)), (["MISMATCH"], [0, 1, 2, 3, 4]))

    def test_missing_frames(self):
        def frame(number):
            return [name for name in two_gops(False).names if name.split()[1] == str(number)
                    and name.split()[0] in ("frame", "unit")]
        decoder = two_gops(False).without(*frame(1)).decode()
        self.assertEqual((codes(decoder), numbers(decoder), decoder.lost), (["MISMATCH"], [0, 2, 3, 4], [[1, 1]]))
        decoder = two_gops(False).without(*frame(2)).decode()
        self.assertEqual((codes(decoder), numbers(decoder), decoder.lost), (["MISMATCH"], [0, 1, 3, 4], [[2, 2]]))

    def test_absent_reference(self):
        """SS-LO-003: the frames after a frame without reference have one, but nothing to show."""
        names = [name for name in two_gops().names if name == "frame 0" or name.startswith("unit 0 ")]
        decoder = two_gops().without(*names).decode()
        self.assertEqual((codes(decoder), numbers(decoder)), (["UNDEFINED"], [1, 2, 3, 4]))
        self.assertEqual([frame.lost for frame in decoder.frames], [True, True, False, False])

    def test_every_cut(self):
        """SS-ER-011"""
        data = two_gops().close()
        for size in range(len(data)):
            decoder = Decoder(data[:size]).decode()
            self.assertEqual(codes(decoder), ["TRUNCATED"], size)
            self.assertEqual(numbers(decoder), list(range(len(decoder.frames))))

    def test_inside(self):
        """B.3"""
        data = two_gops().close()
        at = data.index(two_gops().units[two_gops().names.index("gop 1")])
        decoder = Decoder(data, inside=at).decode()
        self.assertEqual((codes(decoder), numbers(decoder), decoder.lost), ([], [3, 4], []))


if __name__ == "__main__":
    unittest.main()
