"""Invalid vectors of lost units and frames: what an error costs, and how decoding goes on after it (7.13.3, 7.20, 9.3, 9.4)."""

import struct

from oracle import constants as c
from ..faults import (changed, copy_of, element, flipped, in_bytes, inserted, invalid, kind, lost, lost_all, moved, together)
from ..synth.directed import DirectedSynth
from ..synth.encoding import unit
from ..synth.learned import SMALL
from ..synth.network import NetworkWriter
from ..synth.units import offset_of, units_of
from ..vector import Vector, seed_of
from .order import BOOKS, DEEP, FALLING, LAYERS, SEVERAL, header_of, increment, whole_frame
from .tools import same


DIGESTS, RESYNC, NESTED = "refinement-digests", "resync-parent", "nested-layers"
WHOLE = "nested-whole-anchor"


def wrong_digest(frame, r):
    return element(increment(frame, r), "refinement_digest", lambda x: x ^ 1)


LOSSES = [
    ("order-loss-of-b-frame", DEEP, "UNDEFINED", "SS-LO-003 SS-CA-002 SS-BS-010",
     "frame 2 is absent, to which frame 3 refers: frame 3 has no Gaussians", whole_frame(2)),
    ("order-loss-of-p-frame", DEEP, "UNDEFINED", "SS-LO-003 SS-CA-002",
     "frame 4 is absent, and the four frames that refer to it have no Gaussians", whole_frame(4)),
    ("order-loss-of-frame-header", DEEP, "MISMATCH", "SS-BS-002 SS-LO-003", "the frame_header of a P frame is missing",
     lost(header_of(4))),
    ("order-loss-in-i-frame", DEEP, "CHECKSUM", "SS-LO-004 SS-LO-002 SS-CA-003",
     "the last increment of the I frame is damaged: list 1 is missing in all frames", flipped(increment(0, 1))),
    ("order-loss-in-whole-anchor", WHOLE, "CHECKSUM", "SS-LO-004 SS-LO-002 SS-CA-001",
     "the last increment of a whole anchor is damaged: P and B frames carry what there is, with stale cells",
     flipped(increment(0, 3))),
    ("order-loss-of-first-increment", DEEP, "CHECKSUM", "SS-LO-002 SS-CA-002",
     "the first increment of the I frame is damaged: no frame has Gaussians", flipped(increment(0, 0))),
    ("order-loss-in-p-frame", DIGESTS, "CHECKSUM", "SS-LO-004 SS-LO-001 SS-CA-003",
     "increment 2 of the P frame is damaged: the frames that refer to it have level 2", flipped(increment(4, 2))),
    ("order-loss-of-unit-0-of-p", DIGESTS, "CHECKSUM", "SS-CA-001 SS-BS-003 SS-OP-003",
     "unit 0 of a B frame is damaged: the frame and what refers to it show carried lists alone", flipped(increment(2, 0))),
    ("order-loss-of-last-unit", DIGESTS, "CHECKSUM", "SS-LO-004", "the last increment of the last frame is damaged",
     flipped(increment(4, 3))),
    ("order-loss-of-missing-unit", DIGESTS, "UNEXPECTED_UNIT", "SS-BS-004 SS-LO-004",
     "unit 1 of a B frame is missing, and 2 and 3 cannot be used", lost(increment(2, 1))),
    ("order-loss-of-spatial-layer", LAYERS, "CHECKSUM", "SS-LO-002 SS-CA-003 SS-OP-003",
     "increment (1, 0) of the I frame is damaged: layer 0 is shown", flipped(increment(0, 0, 1))),
    ("order-loss-of-codebook", BOOKS, "UNDEFINED", "SS-IN-010 SS-CB-001", "all codebooks are missing",
     lost_all(lambda u: u.kind == c.UT_CODEBOOK)),
    ("order-loss-in-refinements", FALLING, "CHECKSUM", "SS-LO-002 SS-OP-002",
     "increment 2 is damaged: the frame stays at refinement 1", flipped(increment(0, 2))),
    ("order-loss-of-two-refinements", FALLING, "CHECKSUM", "SS-LO-002",
     "increments 1 and 3 are damaged: the frame stays at refinement 0",
     together(flipped(increment(0, 1)), flipped(increment(0, 3)))),
    ("order-loss-then-frame-of-refinement", FALLING, "DIGEST", "SS-LO-002 SS-BS-002",
     "increment 1 has another digest, and frame of increment 2, which would be discarded, is wrong",
     together(wrong_digest(0, 1), changed(increment(0, 2), frame=1))),
    ("order-loss-then-frame-of-later-refinement", SEVERAL, "CHECKSUM", "SS-LO-002 SS-BS-002",
     "increment 1 is damaged, and increment 2, which would be discarded, is of the next frame",
     together(flipped(increment(1, 1)), changed(increment(1, 2), frame=2))),
    ("order-loss-of-two-increments", DIGESTS, "CHECKSUM", "SS-LO-004 SS-LO-002",
     "increments 1 and 3 of the P frame are damaged", together(flipped(increment(4, 1)), flipped(increment(4, 3)))),
    ("order-loss-beyond-reference", DIGESTS, "CHECKSUM", "SS-LO-004 SS-LO-001 SS-BS-003",
     "increment 2 of a B frame is damaged, and that of a frame that refers to it, where it is discarded",
     together(flipped(increment(2, 2)), flipped(increment(3, 2)))),
    ("order-loss-then-layer-of-increment", DEEP, "DIGEST", "SS-LO-002 SS-BS-009",
     "increment 0 of a P frame has another digest, and temporal_layer of increment 1, which is discarded, is wrong",
     together(wrong_digest(4, 0), changed(increment(4, 1), t=1))),
    ("order-loss-then-frame-of-increment", DEEP, "CHECKSUM", "SS-LO-002 SS-BS-002",
     "increment 0 of a P frame is damaged, and increment 1 is of the next frame",
     together(flipped(increment(4, 0)), changed(increment(4, 1), frame=5))),
    ("order-loss-of-refinement-0", FALLING, "CHECKSUM", "SS-LO-002 SS-CA-002", "increment 0 is damaged: the frame is lost",
     flipped(increment(0, 0))),
] + [
    ("loss-of-list-%d-of-layer-%d" % (h, s), NESTED, "CHECKSUM", "SS-LO-002 SS-LO-004 SS-CA-001 SS-CA-003",
     "unit (%d, %d) of the I frame of a GOP of three layers and four lists is damaged" % (s, h), flipped(increment(0, h, s)))
    for s in range(3) for h in range(4)
] + [
    ("loss-of-unit-%d-of-frame-%d" % (r, frame), NESTED, "CHECKSUM", "SS-LO-002 SS-LO-001 SS-CA-001",
     "unit %d of frame %d of a nested GOP is damaged" % (r, frame), flipped(increment(frame, r)))
    for frame, r in ((4, 0), (4, 3), (2, 0), (2, 1), (3, 0))
] + [
    ("loss-of-middle-layer", NESTED, "UNEXPECTED_UNIT", "SS-BS-004 SS-LO-002", "unit (1, 1) of the I frame is missing",
     lost(increment(0, 1, 1))),
    ("loss-of-frame-header-of-i", NESTED, "CHECKSUM", "SS-ER-008 SS-ER-004 SS-ER-005",
     "the frame_header of the I frame of the only GOP is damaged", flipped(header_of(0))),
    ("loss-of-last-frame-header", NESTED, "CHECKSUM", "SS-ER-008 SS-ER-005",
     "the frame_header of the last frame is damaged: it was never output", flipped(header_of(8))),
]


# ---- resynchronisation: a stream of four GOPs ----


class Resync(DirectedSynth):
    """GOPs with every type of unit in each."""

    def definitions(self):
        super().definitions()
        self.codebook(0, list(self.sh_ranks.values())[0], [1] * 4 * list(self.sh_ranks.values())[0])
        self.put(c.UT_WEIGHTS, b"\x00" + NetworkWriter(self.rng, SMALL).bytes(), frame=self.first)
        self.put(200, b"private", flags=0)


RESYNC_ASKED = dict(gops=[(1, 1, 3), (0, 0, 2), (1, 0, 2), (0, 0, 1)], sh_degree=1, most=4, copies=True, described=True,
                    temporal_layer_count=2, percent=[50, 100], sizes=same, frame_count=8)


def in_gop(number, *kinds):
    """Selector: the first unit of some types after the gop_header of a GOP."""
    def select(units):
        start = GOP_AT(number)(units)
        return next(i for i in range(start, len(units)) if units[i].kind in kinds)
    return select


def GOP_AT(number):
    return kind(c.UT_GOP, nth=number)


def other_header(select, at=6):
    """A bit of a unit_header flipped: its extent is not known."""
    return flipped(select, at, 1)


def inserted_bytes(select, function):
    """Bytes before a unit."""
    def change(data):
        head, units = units_of(data)
        i = select(units)
        at = offset_of(head, units, i)
        return data[:at] + function(units, i) + data[at:]
    return in_bytes(change)


def decoy(gop_index, frame):
    return unit(c.UT_GOP, struct.pack("<IIBBH", gop_index, 1, 0, 0, 0), frame=frame)


def private(data):
    """A skipped unit with some payload."""
    return unit(200, b"xx" + data + b"yy", flags=0)


def broken(data):
    """A unit whose header_check is wrong."""
    return data[:6] + bytes([data[6] ^ 1]) + data[7:]


def without_gop(*numbers):
    """GOPs left out, with the copies of sequence_parameters before them."""
    def change(head, units):
        starts = [i for i, u in enumerate(units) if u.kind == c.UT_GOP] + [next(
            i for i, u in enumerate(units) if u.kind in (c.UT_POINTS, c.UT_INDEX, c.UT_END))]
        kept = list(units)
        for n in sorted(numbers, reverse=True):
            del kept[starts[n]:starts[n + 1]]
        return head, kept
    return change


TYPES = (("sequence-parameters", c.UT_SEQUENCE), ("gop-header", c.UT_GOP), ("frame-header", c.UT_FRAME),
         ("transform", c.UT_TRANSFORM), ("codebook", c.UT_CODEBOOK), ("increment", c.UT_INCREMENT),
         ("weights", c.UT_WEIGHTS))
AT_END = (("operating-points", c.UT_POINTS), ("index", c.UT_INDEX), ("end", c.UT_END))
FIRST = (("scene-description", c.UT_SCENE),)
RESYNCHRONISED = [
    ("resync-%s-damaged" % name, RESYNC, "CHECKSUM", "SS-ER-008 SS-ER-004 SS-ER-005 SS-UH-009",
     "a unit of type %s of the second of four GOPs is damaged" % name.replace("-", "_"), flipped(in_gop(1, number)))
    for name, number in TYPES
] + [
    ("resync-%s-damaged" % name, RESYNC, "CHECKSUM", "SS-ER-008 SS-ER-004",
     "the unit of type %s is damaged" % name.replace("-", "_"), flipped(kind(number))) for name, number in AT_END + FIRST
] + [
    ("resync-%s-header-damaged" % name, RESYNC, "CHECKSUM", "SS-ER-008 SS-ER-004 SS-ER-005 SS-UH-001 SS-UH-003",
     "header_check of a unit of type %s of the second of four GOPs is wrong" % name.replace("-", "_"),
     other_header(in_gop(1, number))) for name, number in TYPES
] + [
    ("resync-%s-header-damaged" % name, RESYNC, "CHECKSUM", "SS-ER-008 SS-ER-004",
     "header_check of the unit of type %s is wrong" % name.replace("-", "_"), other_header(kind(number)))
    for name, number in AT_END + FIRST
] + [
    ("resync-skipped-header-damaged", RESYNC, "CHECKSUM", "SS-ER-004 SS-UH-003",
     "header_check of a skipped unit of the second GOP is wrong", other_header(in_gop(1, 200))),
    ("resync-payload-length-changed", RESYNC, "CHECKSUM", "SS-ER-004 SS-UH-003",
     "a bit of payload_length of a frame_header is flipped", other_header(in_gop(1, c.UT_FRAME), 12)),
    ("resync-unit-type-0", RESYNC, "NUMBER", "SS-ER-004 SS-UH-003", "unit_type of a transform of the second GOP is 0",
     changed(in_gop(1, c.UT_TRANSFORM), kind=0)),
    ("resync-reserved-zero", RESYNC, "RESERVED_BITS", "SS-ER-004 SS-UH-003",
     "reserved_zero of an increment of the second GOP is 1", changed(in_gop(1, c.UT_INCREMENT), reserved=1)),
    ("resync-critical", RESYNC, "RESERVED", "SS-ER-004 SS-UH-005", "a critical unit of unknown type in the second GOP",
     inserted(lambda units: units[in_gop(1, 200)(units)].copy(flags=1), in_gop(1, c.UT_FRAME))),
    ("resync-index-in-gop", RESYNC, "MISMATCH", "SS-BS-010 SS-ER-008 SS-BS-001",
     "the index stands in the third GOP, which it ends before its first frame", moved(kind(c.UT_INDEX), in_gop(2, c.UT_FRAME))),
    ("resync-frame-header-lost", RESYNC, "UNEXPECTED_UNIT", "SS-ER-008 SS-BS-001 SS-BS-008",
     "the first frame_header of the second GOP is missing",
     lost(in_gop(1, c.UT_FRAME))),
    ("resync-gop-header-lost", RESYNC, None, "SS-ER-008 SS-ER-004 SS-ER-005", "the third gop_header is missing",
     lost(GOP_AT(2))),
    ("resync-gop-lost", RESYNC, "MISMATCH", "SS-BS-007 SS-GH-001 SS-ER-005", "the second GOP is missing", without_gop(1)),
    ("resync-two-gops-lost", RESYNC, "MISMATCH", "SS-BS-007 SS-GH-001 SS-ER-005", "the second and third GOP are missing",
     without_gop(1, 2)),
    ("resync-first-gop-lost", RESYNC, "MISMATCH", "SS-BS-007 SS-GH-001 SS-ER-005", "the first GOP is missing", without_gop(0)),
    ("resync-gop-twice", RESYNC, "MISMATCH", "SS-BS-007 SS-GH-001 SS-ER-008",
     "the first gop_header comes again before the third GOP",
     inserted(copy_of(GOP_AT(0)), GOP_AT(2))),
    ("resync-two-damages", RESYNC, "CHECKSUM", "SS-ER-010 SS-ER-004 SS-ER-005",
     "a transform of the first GOP and the gop_header of the second are damaged",
     together(flipped(in_gop(0, c.UT_TRANSFORM)), flipped(GOP_AT(1)))),
    ("resync-header-while-lost", RESYNC, "CHECKSUM", "SS-ER-004",
     "a transform is damaged, and the header of a later unit of that GOP, from which on bytes are searched",
     together(flipped(in_gop(0, c.UT_TRANSFORM)), other_header(in_gop(0, c.UT_INCREMENT)))),
    ("resync-increments-of-lost-gop", RESYNC, "CHECKSUM", "SS-ER-004",
     "a transform is damaged, and all increments of that GOP as well, which nobody looks at",
     together(flipped(in_gop(0, c.UT_TRANSFORM)), flipped(in_gop(0, c.UT_INCREMENT)))),
    ("resync-frame-gap", RESYNC, "MISMATCH", "SS-BS-008 SS-BS-002 SS-ER-005",
     "the first frame of an all-intra GOP is missing", whole_frame(3)),
    ("resync-frame-back", RESYNC, "MISMATCH", "SS-BS-008 SS-ER-008",
     "the second frame of an all-intra GOP has the display index of the first", changed(header_of(4), frame=3)),
    ("resync-decoy-in-known-extent", RESYNC, "CHECKSUM", "SS-ER-004",
     "a transform is damaged, and the payload of a skipped unit after it contains a gop_header, which is no unit",
     inserted_bytes(in_gop(1, c.UT_CODEBOOK), lambda units, i: broken_payload(units[i - 1]) + private(decoy(2, 5)))),
    ("resync-decoy-found", RESYNC, "CHECKSUM", "SS-ER-004 SS-BS-007",
     "a header is damaged, and the payload of a skipped unit after it contains a gop_header, which is found",
     inserted_bytes(in_gop(1, c.UT_CODEBOOK), lambda units, i: broken(units[i - 1].bytes()) + private(decoy(2, 5)))),
    ("resync-decoy-of-the-past", RESYNC, "CHECKSUM", "SS-ER-004",
     "a header is damaged, and the payload of a skipped unit after it contains the gop_header of an earlier GOP",
     inserted_bytes(in_gop(1, c.UT_CODEBOOK), lambda units, i: broken(units[i - 1].bytes()) + private(decoy(0, 0)))),
    ("resync-decoy-damaged", RESYNC, "CHECKSUM", "SS-ER-004",
     "a header is damaged, and the payload of a skipped unit after it contains a gop_header with a wrong payload_crc",
     inserted_bytes(in_gop(1, c.UT_CODEBOOK), lambda units, i: broken(units[i - 1].bytes())
                    + private(decoy(2, 5)[:-1] + b"\x01"))),
    ("resync-garbage", RESYNC, "CHECKSUM", "SS-ER-004 SS-UH-003", "77 bytes of no unit stand in the second GOP",
     inserted_bytes(in_gop(1, c.UT_FRAME), lambda units, i: bytes(7 * k % 256 for k in range(77)))),
    ("resync-first-parameters-damaged", RESYNC, "CHECKSUM", "SS-ER-004 SS-ER-005 SS-SP-005",
     "the first sequence_parameters unit is damaged, and a copy stands before the second GOP", flipped(kind(c.UT_SEQUENCE))),
    ("resync-first-parameters-header-damaged", RESYNC, "CHECKSUM", "SS-ER-004 SS-ER-005",
     "the header of the first sequence_parameters unit is damaged, and a copy stands before the second GOP",
     other_header(kind(c.UT_SEQUENCE))),
    ("resync-first-parameters-lost", RESYNC, "UNEXPECTED_UNIT", "SS-ER-004 SS-BS-001",
     "the first sequence_parameters unit is missing, and a copy stands before the second GOP", lost(kind(c.UT_SEQUENCE))),
    ("resync-all-parameters-damaged", RESYNC, "CHECKSUM", "SS-ER-008 SS-ER-004",
     "every sequence_parameters unit is damaged: nothing can be decoded",
     lambda head, units: (head, [u.copy(raw=((-1, 1),)) if u.kind == c.UT_SEQUENCE else u for u in units])),
    ("resync-cut-while-lost", RESYNC, "CHECKSUM", "SS-ER-004 SS-BS-011",
     "a transform of the last GOP is damaged, and the data end before the next unit",
     in_bytes(lambda data: cut_after_damage(data))),
]


def broken_payload(u):
    return u.copy(raw=((-1, 1),)).bytes()


def cut_after_damage(data):
    head, units = units_of(data)
    i = in_gop(3, c.UT_TRANSFORM)(units)
    return data[:offset_of(head, units, i)] + broken_payload(units[i])


def rows():
    seed = seed_of(RESYNC)
    yield Vector("valid", "loss", RESYNC, "Four GOPs with units of every type; the parent of invalid vectors",
                 "SS-SP-005 SS-SD-001 SS-BS-012", lambda: Resync(seed, **RESYNC_ASKED).stream(), "directed", seed)
    yield from invalid("order", "losses", [row for row in LOSSES if row[0].startswith("order")])
    yield from invalid("loss", "losses", [row for row in LOSSES if row[0].startswith("loss")] + RESYNCHRONISED)
