"""Vectors of limits (annex A), of counts that ask for much in few bytes, and of every unit of a stream lost in turn."""

import struct

from oracle import constants as c
from oracle.conventions import ByteReader, crc32
from ..expectation import UNIT_NAMES
from ..faults import changed, element, in_bytes, invalid, kept_end, kind, lost, payload, repeated, together
from ..synth.directed import directed
from ..synth.encoding import leb
from ..synth.given import GivenStream
from ..synth.learned import LearnedSynth
from ..synth.limit import ASKED, empty_reference_set, over_limit
from ..synth.units import offset_of, units_of
from ..vector import Vector, seed_of
from .records import rest
from .stream import one_frame
from .structure import STABILITY

SEED = 20000
INTRA, DYNAMIC, SMALL = "stream-several-gops", "temporal-depth-2", "stability-one-gaussian"
FRAME, INCREMENT, BOOK, TRANSFORM = kind(c.UT_FRAME), kind(c.UT_INCREMENT), kind(c.UT_CODEBOOK), kind(c.UT_TRANSFORM)
CELLS, REPLACED, RATE = "cells-whole-grid", "limit-codebook-replaced", "limit-gaussian-rate-reached"
LIMITS = {1: 2 ** 18, 2: 2 ** 20, 3: 2 ** 22, 4: 2 ** 24}


def unit_length(select, length):
    """payload_length with its header_check, and no other bytes than before."""
    def change(data):
        head, units = units_of(data)
        i = select(units)
        at = offset_of(head, units, i)
        header = data[at:at + 6] + data[at + 8:at + 12] + struct.pack("<I", length) + data[at + 16:at + 20]
        check = struct.pack("<H", crc32(header) & 0xFFFF)
        return data[:at + 6] + check + header[6:10] + header[10:] + data[at + 20:]
    return in_bytes(change)


LIMIT = [
    ("limit-gaussians-of-level-%d" % level, "stream-one-frame" if level == 1 else "stream-level-%d" % level,
     "OVER_LIMIT", "SS-FR-005 SS-LM-001",
     "gaussian_count is one above the limit of level %d" % level,
     element(FRAME, "gaussian_count", LIMITS[level] + 1)) for level in LIMITS
] + [
    ("limit-gaussians-4294967295", INTRA, "OVER_LIMIT", "SS-FR-005 SS-LM-001", "gaussian_count is 2^32 - 1",
     element(FRAME, "gaussian_count", 2 ** 32 - 1)),
    ("limit-payload-length", INTRA, "OVER_LIMIT", "SS-LM-001 SS-UH-003 SS-ER-006",
     "payload_length is 2^30 + 1", unit_length(INCREMENT, 2 ** 30 + 1)),
    ("limit-payload-length-of-skipped", "stream-skipped-checksum", "OVER_LIMIT", "SS-LM-001 SS-UH-004",
     "payload_length of a skipped unit is 2^32 - 1",
     unit_length(lambda units: 1, 2 ** 32 - 1)),
]
LIMIT += [
    ("limit-codebook-values", REPLACED, "OVER_LIMIT", "SS-CB-002 SS-LM-001",
     "two codebooks in force have 2228224 values at level 1", element(kind(c.UT_CODEBOOK, nth=1), "codebook_id", 1)),
    ("limit-gaussian-rate", RATE, "OVER_LIMIT", "SS-FR-006 SS-LM-001", "one Gaussian more than level 1 allows each second",
     element(FRAME, "gaussian_count", 2 ** 12 + 1)),
]
RESOURCE = [
    ("resource-payload-length", INTRA, "TRUNCATED", "SS-LM-001 SS-BS-011",
     "payload_length is 2^30 and a few bytes follow", unit_length(INCREMENT, 2 ** 30)),
    ("resource-new-count", "stream-level-4", ("OVER_LIMIT", "SHORT_SECTION"), "SS-IN-009 SS-LM-001",
     "2^24 new Gaussians in a few bytes",
     together(element(FRAME, "gaussian_count", 2 ** 24), element(INCREMENT, "new_count", 2 ** 24),
              rest(lambda data: b"\x00\x00"))),
    ("resource-blocks", "stream-level-4", "SHORT_SECTION", "SS-ER-003 SS-LM-001",
     "16000 Gaussians in 250 blocks of which almost none are there",
     together(element(FRAME, "gaussian_count", 16000), element(INCREMENT, "new_count", 16000),
              rest(lambda data: b"\x00\x00" + b"\x7f" * 1100))),
    ("resource-blocks-after-a-bad-length", "stream-level-4", "NUMBER", "SS-ER-003 SS-LM-001",
     "250 blocks of which the first block_length is not in its shortest form and the others are not there",
     together(element(FRAME, "gaussian_count", 16000), element(INCREMENT, "new_count", 16000),
              rest(lambda data: b"\x00\x00\x81\x00" + bytes([255]) * 1100))),
    ("resource-model-length", INTRA, "SHORT_SECTION", "SS-ER-003", "model_length is 2^32 - 1",
     rest(lambda data: data[:1] + leb(2 ** 32 - 1) + data[2:])),
    ("resource-block-length", "stream-one-block", "SHORT_SECTION", "SS-ER-003", "block_length is 2^32 - 1",
     rest(lambda data: lengthened(data))),
    ("resource-index-entries", INTRA, ("MISMATCH", "SHORT_SECTION"), "SS-IX-001", "entry_count of the index is 2^32 - 1",
     kept_end(element(kind(c.UT_INDEX), "entry_count", 2 ** 32 - 1))),
    ("resource-points", INTRA, "SHORT_SECTION", "SS-ER-003", "point_count is 65535",
     element(kind(c.UT_POINTS), "point_count", 65535)),
    ("resource-codebook", "codebook-two-stages", "SHORT_SECTION", "SS-ER-003",
     "a codebook of 65536 entries of 31 components of which 20 bytes are there",
     payload(BOOK, lambda data: data[:1] + b"\x1f\xff\xff\x02" + data[5:])),
    ("resource-transform", "colour-sh-degree-3", "SHORT_SECTION", "SS-ER-003",
     "a transform of 45 by 45 coefficients that ends after rank",
     payload(kind(c.UT_TRANSFORM, nth=1), lambda data: data[:4])),
    ("resource-network", "learned-small", "SHORT_SECTION", "SS-WT-004",
     "the largest network of which no parameter is there",
     payload(kind(c.UT_WEIGHTS), lambda data: b"\x00\x04\x06\x80\x20\x04\x10\x03\x10" + data[9:19])),
    ("resource-cells", CELLS, "SHORT_SECTION", "SS-FR-008 SS-FR-007",
     "cell_count is 2^16, the limit, and there are no such cells",
     together(element(kind(c.UT_FRAME, nth=-1), "cell_count", 2 ** 16),
              changed(kind(c.UT_FRAME, nth=-1), payload=lambda u: u.payload[:u.elements().length()] + b"\x00\x00"))),
    ("resource-gop-frames", INTRA, "MISMATCH", "SS-BS-006", "gop_frame_count is 2^32 - 1",
     element(kind(c.UT_GOP), "gop_frame_count", 2 ** 32 - 1)),
]


def lengthened(data):
    """block_length of the only block of a section."""
    reader = ByteReader(data, 1, len(data))
    models = reader.leb128("5.15")
    at = reader.pos + models
    end = at
    while data[end] > 127:
        end += 1
    return data[:at] + leb(2 ** 32 - 1) + data[end + 1:]


def many_skipped():
    s = GivenStream()
    for k in range(500):
        s.skipped(128 + k % 128, b"")
    return s.close()


def large_codebooks():
    """A codebook of more than half of the values that level 1 allows, defined twice."""
    s = GivenStream(sh_degree=3)
    s.gop()
    s.transform()
    for _ in range(2):
        s.codebook(0, 17, bytes(65536 * 17))
    s.frame(3)
    s.unit()
    return s.close()


def most_allowed(level):
    """A frame_header at the limit of its level in a frame that stops before the layer that has to have so many."""
    return directed(5, gops=[(0, 0, 1)], spatial_layer_count=2, units=lambda number: [2], most=lambda number: LIMITS[level],
                    layer_sizes=lambda share, s: 3, level=level)


def at_rate(gaussians):
    """A stream of level 1 with 2^24 Gaussians per second if its frame has 2^12 of them."""
    return directed(6, gops=[(0, 0, 1)], spatial_layer_count=2, units=lambda number: [2], most=lambda number: gaussians,
                    layer_sizes=lambda share, s: 3, ticks_per_second=2 ** 13, ticks_per_frame=2)


def in_turn():
    """Each unit of a small stream lost and repeated."""
    asked = next(row[3] for row in STABILITY if row[0] == SMALL)
    _, units = units_of(directed(seed_of(SMALL), **asked))
    for k, u in enumerate(units):
        what, this = "%02d-%s" % (k, UNIT_NAMES[u.kind].replace("_", "-")), lambda units, k=k: k
        if u.kind not in (c.UT_POINTS, c.UT_INDEX):     # the stream is as good without them
            yield ("order-each-lost-" + what, SMALL, None, "SS-BS-001 SS-ER-008",
                   "unit %d is lost; index and end unit do not count it" % k, lost(this))
        if u.kind != c.UT_SEQUENCE:                     # copies of it are allowed
            yield ("order-each-twice-" + what, SMALL, None, "SS-BS-001 SS-ER-008",
                   "unit %d stands twice; index and end unit count both" % k, repeated(this))


def rows():
    yield Vector("valid", "stream", "stream-one-block", "One block with short lengths; the parent of invalid vectors",
                 "SS-PA-006", lambda: one_frame(5), "given", 1)
    yield Vector("valid", "stream", "stream-many-skipped-units", "500 skipped units without payload", "SS-UH-004",
                 many_skipped, "given", 1)
    yield Vector("valid", "limit", REPLACED, "A codebook of 1114112 values is replaced by another one at level 1",
                 "SS-CB-002 SS-CB-001 SS-LM-001", large_codebooks, "limit", 0)
    yield Vector("valid", "limit", RATE, "As many Gaussians a second as level 1 allows", "SS-FR-006 SS-LM-001",
                 lambda: at_rate(2 ** 12), "limit", 6)
    yield Vector("valid", "learned", "learned-limit-parent", "A frame with three Gaussians, predicted by the network",
                 "SS-PR-004", lambda: LearnedSynth(SEED, {**ASKED, "gops": [(1, 0, 2)]}).stream(), "limit", SEED)
    yield Vector("valid", "learned", "learned-limit-without-references",
                 "131073 Gaussians with predictor 3 in a unit without references, where it counts for nothing",
                 "SS-PR-003 SS-PR-004 SS-LM-001 SS-IN-009", lambda: empty_reference_set(SEED), "limit", SEED)
    yield Vector("invalid", "limit", "limit-learned", None, "SS-PR-004 SS-LM-001",
                 lambda parent: over_limit(SEED), "limit", SEED, "learned-limit-parent",
                 "131073 new Gaussians are predicted by the network at level 1", "OVER_LIMIT")
    for level in (2, 3, 4):
        yield Vector("either", "limit", "limit-most-gaussians-of-level-%d" % level,
                     "gaussian_count is that of the limit of level %d, in a frame that stops at a few Gaussians; a decoder that "
                     "was made for a lower level, or told to use lower limits, rejects it" % level,
                     "SS-LM-003 SS-FR-005", lambda level=level: most_allowed(level), "limit", 5, acceptable=("OVER_LIMIT",))
    yield from invalid("limit", "limit", LIMIT)
    yield from invalid("resource", "limit", RESOURCE)
    yield from invalid("order", "in-turn", in_turn())
