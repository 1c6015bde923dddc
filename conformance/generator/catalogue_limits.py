"""Vectors of limits (annex A), of counts that ask for much in few bytes, and of every unit of a stream lost in turn."""

import struct

import oracle_path  # noqa: F401
import constants as c
from catalogue_dynamic import STABILITY
from catalogue_order import increment
from catalogue_stream import one_frame
from conventions import crc32
from encoding import leb
from expectation import UNIT_NAMES
from faults import element, in_bytes, invalid, kept_end, kind, lost, payload, repeated, together
from intra_writer import IntraStream
from synth_directed import directed
from synth_learned import LearnedSynth
from synth_limit import ASKED, empty_reference_set, over_limit
from units import units_of
from vector import Vector, seed_of

SEED = 20000
INTRA, DYNAMIC, SMALL = "stream-several-gops", "temporal-depth-2", "stability-one-gaussian"
FRAME, REFINED, BOOK, TRANSFORM = kind(c.UT_FRAME), kind(c.UT_REFINEMENT), kind(c.UT_CODEBOOK), kind(c.UT_TRANSFORM)
LIMITS = {1: 2 ** 18, 2: 2 ** 20, 3: 2 ** 22, 4: 2 ** 24}


def unit_length(select, length):
    """payload_length with its header_check, and no other bytes than before."""
    def change(data):
        head, units = units_of(data)
        i = select(units)
        at = len(head) + sum(len(u.bytes()) for u in units[:i])
        header = data[at:at + 6] + data[at + 8:at + 12] + struct.pack("<I", length) + data[at + 16:at + 20]
        check = struct.pack("<H", crc32(header) & 0xFFFF)
        return data[:at + 6] + check + header[6:10] + header[10:] + data[at + 20:]
    return in_bytes(change)


LIMIT = [
    ("limit-gaussians-of-level-%d" % level, "stream-one-frame" if level == 1 else "stream-level-%d" % level,
     "OVER_LIMIT", "SS-FR-003 SS-LM-001",
     "gaussian_count is one above the limit of level %d" % level,
     element(FRAME, "gaussian_count", LIMITS[level] + 1)) for level in LIMITS
] + [
    ("limit-gaussians-4294967295", INTRA, "OVER_LIMIT", "SS-FR-003 SS-LM-001", "gaussian_count is 2^32 - 1",
     element(FRAME, "gaussian_count", 2 ** 32 - 1)),
    ("limit-payload-length", INTRA, "OVER_LIMIT", "SS-LM-001 SS-ER-008 SS-ER-004 SS-ER-005",
     "payload_length is 2^30 + 1", unit_length(REFINED, 2 ** 30 + 1)),
    ("limit-payload-length-of-skipped", "stream-skipped-check-sum", "OVER_LIMIT", "SS-LM-001 SS-UH-004",
     "payload_length of a skipped unit is 2^32 - 1",
     unit_length(lambda units: 1, 2 ** 32 - 1)),
]
RESOURCE = [
    ("resource-payload-length", INTRA, "TRUNCATED", "SS-LM-001 SS-BS-007",
     "payload_length is 2^30 and a few bytes follow", unit_length(REFINED, 2 ** 30)),
    ("resource-blocks", "stream-level-4", "SHORT_SECTION", "SS-ER-003 SS-LM-001",
     "2^24 Gaussians in 2^18 blocks of which almost none are there",
     together(element(FRAME, "gaussian_count", 2 ** 24), element(REFINED, "gaussian_count", 2 ** 24),
             payload(REFINED, lambda data: data[:20] + b"\x00"))),
    ("resource-blocks-after-a-bad-length", "stream-level-4", "NUMBER", "SS-ER-003 SS-LM-001",
     "2^24 Gaussians in 2^18 blocks of which the first block_length is not in its shortest form and the others are not there",
     together(element(FRAME, "gaussian_count", 2 ** 24), element(REFINED, "gaussian_count", 2 ** 24),
             payload(REFINED, lambda data: data[:20] + b"\x00\x81\x00"))),
    ("resource-model-length", INTRA, "SHORT_SECTION", "SS-ER-003", "model_length is 2^32 - 1",
     payload(REFINED, lambda data: data[:20] + leb(2 ** 32 - 1) + data[21:])),
    ("resource-block-length", "stream-one-block", "SHORT_SECTION", "SS-ER-003", "block_length is 2^32 - 1",
     payload(REFINED, lambda data: lengthened(data))),
    ("resource-index-entries", INTRA, "MISMATCH", "SS-IX-001", "entry_count of the index is 2^32 - 1",
     kept_end(element(kind(c.UT_INDEX), "entry_count", 2 ** 32 - 1))),
    ("resource-points", INTRA, "SHORT_SECTION", "SS-ER-003", "point_count is 65535",
     element(kind(c.UT_POINTS), "point_count", 65535)),
    ("resource-codebook", "codebook-two-stages", "SHORT_SECTION", "SS-ER-003",
     "a codebook of 65536 entries of 45 components of which 20 bytes are there",
     payload(BOOK, lambda data: data[:1] + b"\x2d\xff\xff\x02" + data[5:])),
    ("resource-transform", "colour-sh-degree-3", "SHORT_SECTION", "SS-ER-003",
     "a transform of 45 by 45 coefficients that ends after rank",
     payload(kind(c.UT_TRANSFORM, nth=1), lambda data: data[:4])),
    ("resource-network", "learned-small", "SHORT_SECTION", "SS-WT-004",
     "the largest network of which no parameter is there",
     payload(kind(c.UT_WEIGHTS), lambda data: b"\x00\x04\x06\x80\x20\x04\x10\x03\x10" + data[9:19])),
    ("resource-cells", DYNAMIC, "SHORT_SECTION", "SS-IN-007 SS-IN-002",
     "cell_count is 2^20 and there are no such cells",
     together(element(increment(4), "cell_count", 2 ** 20),
             payload(increment(4), lambda data: data[:59] + b"\x00\x00"))),
    ("resource-new-gaussians", DYNAMIC, "SHORT_SECTION", "SS-IN-007 SS-IN-004",
     "new_count is 2^18, the limit, and there are no such Gaussians",
     together(element(FRAME, "gaussian_count", 2 ** 18), element(increment(0), "new_count", 2 ** 18),
             payload(increment(0), lambda data: data[:59] + b"\x00\x00"))),
    ("resource-gop-frames", INTRA, "MISMATCH", "SS-BS-003", "gop_frame_count is 2^32 - 1",
     element(kind(c.UT_GOP), "gop_frame_count", 2 ** 32 - 1)),
]


def lengthened(data):
    """block_length of the only block."""
    reader_at, shift, models = 20, 0, 0
    while True:
        models |= (data[reader_at] & 127) << shift
        shift += 7
        reader_at += 1
        if data[reader_at - 1] < 128:
            break
    at = reader_at + models
    end = at
    while data[end] > 127:
        end += 1
    return data[:at] + leb(2 ** 32 - 1) + data[end + 1:]


def many_skipped():
    s = IntraStream()
    for k in range(500):
        s.skipped(128 + k % 128, b"")
    return s.close()


def most_allowed(level):
    """A frame_header at the limit of its level in a frame that stops before the layer that has to have so many."""
    return directed(5, gops=[(0, 0, 1)], spatial_layer_count=2, units=lambda number: [2],
                    most=lambda number: LIMITS[level],
                    layer_sizes=lambda share, s: 3, level=level)


def limited(level):
    data = most_allowed(level)
    head, units = units_of(data)
    i = FRAME(units)
    byte = len(head) + sum(len(u.bytes()) for u in units[:i]) + 20 + units[i].element("gaussian_count")[0]
    return [{"outcome": "reject", "class": "over-limit", "code": "OVER_LIMIT", "clause": "6.6", "byte": byte,
             "why": "a decoder that was made for a lower level, or told to use lower limits (SS-LM-003)"}]


def in_turn():
    """Each unit of a small stream lost and repeated, and the stream cut before each unit."""
    asked = next(row[3] for row in STABILITY if row[0] == SMALL)
    _, units = units_of(directed(seed_of(SMALL), **asked))
    order_rows, cut_rows = [], []
    for k, u in enumerate(units):
        what, this = "%02d-%s" % (k, UNIT_NAMES[u.kind].replace("_", "-")), lambda units, k=k: k
        if u.kind not in (c.UT_POINTS, c.UT_INDEX):     # the stream is as good without them
            order_rows.append(("order-each-lost-" + what, SMALL, None, "SS-BS-001 SS-ER-008",
                               "unit %d is lost; index and end unit do not count it" % k, lost(this)))
        if u.kind != c.UT_SEQUENCE:                     # copies of it are allowed
            order_rows.append(("order-each-twice-" + what, SMALL, None, "SS-BS-001 SS-ER-008",
                               "unit %d stands twice; index and end unit count both" % k, repeated(this)))
        size = sum(len(v.bytes()) for v in units[:k]) + c.FILE_HEADER_BYTES
        cut_rows.append(("bytes-cut-before-" + what, SMALL, "TRUNCATED", "SS-BS-007 SS-BS-006",
                         "the stream ends before unit %d" % k, in_bytes(lambda data, size=size: data[:size])))
    return order_rows, cut_rows


def rows():
    yield Vector("valid", "stream", "stream-one-block",
                 "One block with short lengths; the parent of invalid vectors", "SS-RU-001", lambda: one_frame(5),
                 "intra", 1)
    yield Vector("valid", "stream", "stream-many-skipped-units", "500 skipped units without payload", "SS-UH-004",
                 many_skipped, "intra", 1)
    yield Vector("valid", "learned", "learned-limit-parent", "A frame with three Gaussians, predicted by the network",
                 "SS-PR-008",
                 lambda: LearnedSynth(SEED, {**ASKED, "gops": [(1, 0, 2)]}).stream(), "limit", SEED)
    yield Vector("valid", "learned", "learned-limit-without-references",
                 "131073 Gaussians with predictor 3 in a unit without references, where it counts for nothing",
                 "SS-PR-003 SS-PR-008 SS-LM-001", lambda: empty_reference_set(SEED), "limit", SEED)
    yield Vector("invalid", "limit", "limit-learned", None, "SS-PR-008 SS-LM-001",
                 lambda parent: over_limit(SEED), "limit", SEED, "learned-limit-parent",
                 "131073 new Gaussians are predicted by the network at level 1",
                 "OVER_LIMIT")
    for level in (2, 3, 4):
        yield Vector("either", "limit", "limit-most-gaussians-of-level-%d" % level,
                     "gaussian_count is that of the limit of level %d, in a frame that stops at a few Gaussians" % level,
                     "SS-LM-003 SS-FR-003",
                     lambda level=level: most_allowed(level), "limit", 5, acceptable=limited(level))
    yield from invalid("limit", "limit", LIMIT)
    yield from invalid("resource", "limit", RESOURCE)
    order_rows, cut_rows = in_turn()
    yield from invalid("order", "in-turn", order_rows)
    yield from invalid("bytes", "in-turn", cut_rows)
