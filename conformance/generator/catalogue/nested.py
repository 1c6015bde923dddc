"""Valid vectors of nested and whole anchors, of carried lists, and of starting inside a stream (7.13.3, 7.18, 7.20, B.3)."""

from oracle import constants as c
from oracle.decoding import Decoder
from ..faults import apply, element, entry, kept_end, kind, payload, together
from ..synth.directed import directed
from ..synth.given import GivenStream
from ..vector import Vector, seed_of
from .losses import RESYNC, RESYNC_ASKED, Resync
from .structure import QUARTERS, grown
from .tools import alternating, every, same

NO_ROTATION = [0, 0, 0]
MOVING = every(([24, -16, 8], [60, -40, 20], 0))
PARTLY_STALE = alternating(([24, -16, 8], NO_ROTATION, 1), ([-8, 8, 16], [100, 0, -50], 0))
DEEP = dict(percent=QUARTERS, gops=[(1, 2, 9)], temporal_layer_count=3, sizes=same, cell_log2=7, most=16)
NESTED = [
    ("nested-layers", "SS-OP-002 SS-LO-004 SS-CA-001 SS-CA-003 SS-PR-001",
     "Three spatial layers, four lists and three temporal layers: clients below the top play every frame with cells",
     dict(DEEP, spatial_layer_count=3, cells=PARTLY_STALE)),
    ("nested-frames-of-fewer-units", "SS-DG-005 SS-CA-001 SS-CA-003 SS-LO-001",
     "P and B frames with fewer increments than lists show carried lists, whose digests are compared",
     dict(percent=QUARTERS, gops=[(1, 2, 5)], temporal_layer_count=3, sizes=same, cell_log2=7, most=16, cells=PARTLY_STALE,
          units=lambda k: [None, 2, 3, 1, 2][k])),
    ("nested-i-frame-of-fewer-lists", "SS-BS-004 SS-LO-004 SS-CA-004",
     "The I frame of a predicted GOP stops at the second of four lists, and so do the others",
     dict(DEEP, units=lambda k: [2] if k == 0 else 2, cells=MOVING)),
    ("nested-i-frame-of-fewer-layers", "SS-BS-004 SS-LO-004 SS-CA-001",
     "The I frame has the lowest of two spatial layers alone: P and B frames carry it and have no increments",
     dict(DEEP, spatial_layer_count=2, units=lambda k: [4] if k == 0 else 0, cells=PARTLY_STALE)),
    ("nested-layers-fall", "SS-BS-004 SS-LO-004 SS-CA-001 SS-CA-003",
     "Layers of the I frame stop at lists 4, 3 and 1: what is carried comes from all of them",
     dict(DEEP, spatial_layer_count=3, units=lambda k: [4, 3, 1] if k == 0 else 1, cells=PARTLY_STALE)),
    ("nested-stale-at-level-0", "SS-CA-001 SS-CA-003", "P frames without increments: Gaussians of stale cells stay",
     dict(gops=[(1, 0, 4)], sizes=same, units=lambda k: [None, 0, 2, 0][k], cell_log2=7,
          cells=every(([16, 0, 0], NO_ROTATION, 1)))),
    ("nested-frames-without-increments", "SS-BS-005 SS-CA-001 SS-FR-008",
     "A P frame and B frames of a frame_header alone, with and without cells",
     dict(gops=[(1, 1, 5)], sizes=same, units=lambda k: None if k == 0 else 0, cell_log2=7, cells=MOVING)),
    ("nested-without-cells-or-increments", "SS-CA-001 SS-FR-008", "P and B frames that repeat their reference frame",
     dict(gops=[(1, 1, 5)], sizes=same, units=lambda k: None if k == 0 else 0, cells=lambda w, occupied: {})),
    ("nested-compensation", "SS-CA-004",
     "Compensation of exact Gaussians with anchor 0 beside carried ones, which are compensated as the I frame",
     dict(DEEP, sizes=grown(2), cells=MOVING, units=lambda k: None if k == 0 else 1 + k % 4,
          fixed={"compensation_log_scale": -9, "compensation_opacity": 13})),
    ("nested-without-digests", "SS-DG-005", "Frames with cells and without carried_digest",
     dict(DEEP, cells=PARTLY_STALE, digests=False)),
    ("nested-cell-models-passed-on", "SS-PM-001 SS-FR-008",
     "Frames without cells between frames with cells, which may reuse the models of the cells",
     dict(gops=[(1, 0, 7)], sizes=same, cell_log2=6, most=40,
          cells=lambda w, occupied: MOVING(w, occupied) if w.reference.number % 2 else {})),
    ("nested-whole-anchor", "SS-SP-004 SS-OP-002 SS-LO-004 SS-PR-001 SS-DG-005",
     "A whole anchor: all its units belong at every refinement, and P and B frames refer to its higher lists",
     dict(DEEP, whole=True, cells=PARTLY_STALE, predictors=(0, 1, 1))),
    ("nested-whole-anchor-layers", "SS-OP-002 SS-LO-004 SS-CA-001",
     "A whole anchor of three spatial layers: below the highest one it does not belong as a whole",
     dict(DEEP, whole=True, spatial_layer_count=3, cells=PARTLY_STALE)),
    ("nested-whole-of-fewer-units", "SS-DG-005 SS-CA-001",
     "P and B frames with fewer units after a whole anchor: carried lists are shown and compared",
     dict(DEEP, whole=True, cells=PARTLY_STALE, units=lambda k: None if k == 0 else 1 + k % 4)),
    ("nested-whole-incomplete", "SS-LO-004 SS-CA-001", "A whole anchor that lacks a unit: its level is 0",
     dict(DEEP, whole=True, units=lambda k: [3] if k == 0 else 0, cells=PARTLY_STALE)),
]


def codebooks_of_profile_0():
    """Codebooks are defined, and defined again, between frames."""
    s = GivenStream(sh_degree=1)
    s.gop(3)
    s.transform()
    s.transform(1, 0, rank=2)
    for k in range(3):
        s.codebook(k % 2, 2, [10 * k + j for j in range(20)])
        s.frame(6, sh=0)
        s.unit(sh_mode=2, stages=(k % 2,))
    return s.close()


def gop_at(number):
    """The offset of a gop_header, as `inside` of a Vector."""
    def find(data):
        return Decoder(data).decode().gops[number][1]
    return find


POINTS, INDEX, END = kind(c.UT_POINTS), kind(c.UT_INDEX), kind(c.UT_END)
INSIDE = [("inside-%s" % name, "Decoding starts at the gop_header of " + what, number)
          for name, what, number in (("second-gop", "an all-intra GOP", 1), ("third-gop", "a predicted GOP", 2),
                                     ("last-gop", "the last GOP", 3), ("first-gop", "the first GOP", 0))]
OTHER_VALUES = kept_end(together(
    payload(INDEX, entry(12, "Q", lambda x: x + 1)), element(END, "frame_count", 999), element(END, "unit_count", 1),
    element(END, "index_offset", 5), payload(POINTS, entry(8, "I", 77)), payload(POINTS, entry(20, "Q", 1))))
INSIDE_FAULTS = [
    ("inside-index-reserved", "RESERVED_BITS", "SS-ER-002", "reserved_zero of an entry of the index is not 0",
     kept_end(payload(INDEX, entry(8, "I", 1)))),
    ("inside-index-order", "MISMATCH", "SS-IX-002", "entries of the index are exchanged",
     kept_end(payload(INDEX, lambda data: data[:4] + data[20:36] + data[4:20] + data[36:]))),
    ("inside-index-short", "SHORT_SECTION", "SS-ER-003", "the index lacks its last byte",
     kept_end(payload(INDEX, lambda data: data[:-1]))),
    ("inside-points-range", "OUT_OF_RANGE", "SS-ER-001", "spatial_layer of an operating point is 4",
     payload(POINTS, entry(4, "B", 4))),
    ("inside-points-order", "CONSTRAINT", "SS-PL-001", "two operating points are exchanged",
     payload(POINTS, lambda data: data[:4] + data[28:52] + data[4:28] + data[52:])),
    ("inside-end-long", "TRAILING_BYTES", "SS-ER-003", "the end unit has a byte too many",
     kept_end(payload(END, lambda data: data + b"\x00"))),
]


def rows():
    for name, requirements, purpose, asked in NESTED:
        seed = seed_of(name)
        yield Vector("valid", "temporal", name, purpose, requirements,
                     lambda seed=seed, asked=asked: directed(seed, **asked), "directed", seed)
    yield Vector("valid", "codebook", "codebook-between-frames-in-profile-0",
                 "Codebooks of profile 0 are defined, and defined again, between frames", "SS-CB-001 SS-BS-001",
                 codebooks_of_profile_0, "given", 0)
    seed = seed_of(RESYNC)
    whole = lambda: Resync(seed, **RESYNC_ASKED).stream()
    for name, purpose, number in INSIDE:
        yield Vector("valid", "stream", name, purpose, "SS-BS-012", whole, "directed", seed, inside=gop_at(number))
    yield Vector("valid", "stream", "inside-values-not-compared",
                 "Decoding starts inside a stream whose index, end and operating_points do not fit it, which is not compared",
                 "SS-BS-012 SS-IX-003 SS-PL-003", lambda: apply(OTHER_VALUES, whole()), "directed", seed, inside=gop_at(2))
    for name, code, requirements, fault, change in INSIDE_FAULTS:
        yield Vector("invalid", "stream", name, None, "SS-BS-012 " + requirements,
                     lambda data, change=change: apply(change, data), "losses", 0, RESYNC,
                     fault + ", and decoding starts at the third gop_header", code, inside=gop_at(2))
