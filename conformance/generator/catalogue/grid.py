"""Vectors of companded positions (6.4, 7.10.1): valid ones in both profiles, and invalid elements of the grid."""

import itertools

from oracle import constants as c
from ..faults import element, invalid, kind, together
from ..synth.cells import morton
from ..synth.directed import directed
from ..synth.given import GivenStream
from ..vector import Vector, seed_of
from .stream import one_frame

INTRA, PARAMETERS = "stream-several-gops", kind(c.UT_SEQUENCE)


def companded(bits, linear, segment):
    return {"position_bits": bits, "linear_log2": linear, "segment_log2": segment}


def codes_at(bits, *axes):
    """Morton codes of positions whose coordinates run through the given codes, in turn on each axis."""
    longest = max(map(len, axes))
    rows = zip(*(itertools.islice(itertools.cycle(axis), longest) for axis in axes))
    return sorted(morton(row, bits) for row in rows)


def ends_of_segments(bits, linear, segment):
    """The first and the last code of the linear part and of each segment, on both sides, and the ends of the grid."""
    middle, codes = 2 ** (bits - 1), {0, 2 ** bits - 1}
    first = [0, 2 ** linear] + list(range(2 ** linear + 2 ** segment, middle, 2 ** segment))
    for distance in first + [x - 1 for x in first] + [x + 1 for x in first]:
        codes |= {middle + distance, middle - distance}
    return sorted(x for x in codes if 0 <= x < 2 ** bits)


def ends(bits, linear, segment, **asked):
    """Gaussians at the ends of all segments, on each axis in another order."""
    codes = ends_of_segments(bits, linear, segment)
    third = len(codes) // 3
    axes = codes, codes[third:] + codes[:third], codes[::-1]
    return one_frame(len(codes), codes=codes_at(bits, *axes), **companded(bits, linear, segment), **asked)


def every_code(bits, linear, segment):
    codes = range(2 ** bits)
    return one_frame(2 ** bits, codes=codes_at(bits, codes, codes[::-1], [5 * x % 2 ** bits for x in codes]),
                     **companded(bits, linear, segment))


def shifted():
    """Positions coded coarsely: middles of coarse cells that lie across the borders of segments."""
    s = GivenStream(**companded(8, 4, 3))
    s.gop()
    s.transform()
    s.frame(32)
    s.unit(codes=codes_at(5, range(32), [31 - x for x in range(32)], [7 * x % 32 for x in range(32)]), position_shift=3)
    return s.close()


FAR = {"position_step": 0.001, "position_offset": [-524.288, 1.1, 3e7]}
GEOMETRY = [
    ("geometry-companded", "SS-OUT-005 SS-OUT-001 SS-SP-008", "Every code of the example of 7.10.1: six segments on each side",
     lambda: every_code(6, 3, 2)),
    ("geometry-companded-inside", "SS-OUT-005 SS-OUT-001",
     "A companded grid of which only the linear part has Gaussians, to both of its ends",
     lambda: one_frame(17, codes=codes_at(8, range(120, 137), range(136, 119, -1), [120, 136, 128]), **companded(8, 3, 3))),
    ("geometry-companded-outside", "SS-OUT-005 SS-OUT-001", "Gaussians on both sides outside the linear part, and none in it",
     lambda: one_frame(20, codes=codes_at(8, [*range(0, 20, 2), *range(236, 256, 2)], range(20), range(255, 235, -1)),
                       **companded(8, 4, 3))),
    ("geometry-companded-ends-of-segments", "SS-OUT-005 SS-SP-008", "The first and the last code of each of 14 segments",
     lambda: ends(8, 4, 3)),
    ("geometry-companded-24-segments", "SS-OUT-005 SS-SP-008", "24 segments of two codes on each side",
     lambda: ends(7, 4, 1)),
    ("geometry-companded-20-bits", "SS-OUT-005 SS-OUT-001 SS-SP-008",
     "24 segments of 2^14 codes on each side, whose expansions are beyond 2^38 and are rounded once",
     lambda: ends(20, 17, 14, **FAR)),
    ("geometry-companded-segments-of-1", "SS-OUT-005 SS-SP-008", "Segments of one code: the step doubles from code to code",
     lambda: every_code(5, 2, 0)),
    ("geometry-companded-least", "SS-OUT-005 SS-SP-008", "position_bits 2 and linear_log2 0: code 0 alone is companded",
     lambda: every_code(2, 0, 0)),
    ("geometry-companded-linear-of-1", "SS-OUT-005 SS-SP-008", "linear_log2 0 in a grid of five bits",
     lambda: every_code(5, 0, 0)),
    ("geometry-companded-bits-1", "SS-OUT-005 SS-SP-008", "position_bits 1 and linear_log2 0: both codes are linear",
     lambda: every_code(1, 0, 0)),
    ("geometry-linear-to-the-end", "SS-OUT-005 SS-SP-008",
     "linear_log2 is position_bits - 1: code 0 is at the end of the linear part, and segment_log2 has no meaning",
     lambda: every_code(5, 4, 0)),
    ("geometry-linear-with-segments", "SS-OUT-005 SS-SP-008", "linear_log2 and segment_log2 are 20 in a grid of 20 bits",
     lambda: one_frame(9, codes=codes_at(20, [0, 1, 2 ** 19 - 1, 2 ** 19, 2 ** 20 - 1], [5], range(9)),
                       **companded(20, 20, 20))),
    ("geometry-companded-shift", "SS-OUT-005 SS-PO-003", "position_shift 3 in a companded grid: middles are those of codes",
     shifted),
]


# ---- decoding takes place in codes: profile 1 ----

BORDER = companded(8, 4, 3)
AROUND = (96, 111, 112, 113, 119, 120, 128, 136, 143, 144, 145, 152, 160)   # codes around both borders of the linear part


def at_border(w, near, bits):
    """Positions around the borders, and at the ends of the grid."""
    rng = w.rng
    return [min(2 ** bits - 1, rng.choice([*AROUND, 0, 255, rng.randrange(256)]) >> 8 - bits) for _ in range(3)]


TEMPORAL = [
    ("survivors", "survivors-companded", "SS-PA-004 SS-OUT-005 SS-PA-005",
     "Moves across the borders of the linear part and to the ends of a companded grid",
     dict(BORDER, gops=[(1, 0, 3)], modes=(0, 1, 0, 0), position=at_border,
          move=lambda w, axis: w.rng.choice([-300, -17, -1, 1, 17, 300]), fixed={"position_shift": 0})),
    ("cells", "cells-companded", "SS-MO-001 SS-MO-004 SS-OUT-005",
     "Cells that turn and shift codes across the borders of the linear part",
     dict(BORDER, gops=[(1, 1, 3)], position=at_border, cell_log2=4,
          cells=lambda w, occupied: {X: ([136, -72, 40], [900, -300, 2000], 0) for X in occupied},
          fixed={"position_shift": 0, "move_block_log2": None})),
    ("prediction", "prediction-companded", "SS-PR-005 SS-PR-006 SS-PO-002 SS-OUT-005",
     "Neighbours, their order and their distances are those of codes on both sides of the linear part",
     dict(BORDER, gops=[(1, 0, 3)], percent=[50, 100], most=40, position=at_border, predictors=(0, 1, 1),
          sizes=lambda k, before: [n + 8 for n in before],
          fixed={"position_shift": 0, "predictor_block_log2": 0, "neighbour_count": 5, "bilateral_spatial": 40})),
    ("survivors", "survivors-companded-neighbours", "SS-PA-011 SS-PA-010 SS-OUT-005",
     "Move neighbours on both sides of the borders of the linear part",
     dict(BORDER, gops=[(1, 0, 4)], most=40, position=at_border, modes=(1, 2, 0, 0), move_predictors=(0, 0, 1, 1),
          sizes=lambda k, before: before, removed=lambda n: 0,
          fixed={"position_shift": 0, "move_block_log2": 0})),
]


def grid(bits, linear, segment):
    elements = companded(bits, linear, segment).items()
    return together(*[element(PARAMETERS, name, value) for name, value in elements])


INVALID = [
    ("stream-segments-28", INTRA, "CONSTRAINT", "SS-SP-008", "the companded part has 28 segments on each side", grid(10, 6, 4)),
    ("stream-segments-30", INTRA, "CONSTRAINT", "SS-SP-008", "30 segments on each side in a grid of 20 bits", grid(20, 15, 14)),
    ("stream-segments-31-of-1", INTRA, "CONSTRAINT", "SS-SP-008", "31 segments of one code on each side", grid(6, 0, 0)),
    ("stream-segments-half-a-million", INTRA, "CONSTRAINT", "SS-SP-008", "linear_log2 is 0 in a grid of 20 bits", grid(20, 0, 0)),
    ("stream-segment-above-linear", INTRA, "OUT_OF_RANGE", "SS-ER-001", "segment_log2 is one above linear_log2", grid(10, 8, 9)),
    ("stream-segment-above-linear-0", INTRA, "OUT_OF_RANGE", "SS-ER-001", "segment_log2 is 1 and linear_log2 is 0",
     grid(2, 0, 1)),
    ("stream-segment-above-linear-20", INTRA, "OUT_OF_RANGE", "SS-ER-001", "segment_log2 is 21", grid(10, 20, 21)),
    ("stream-linear-log2-21", INTRA, "OUT_OF_RANGE", "SS-ER-001", "linear_log2 is 21", grid(10, 21, 0)),
]


def rows():
    for name, requirements, purpose, build in GEOMETRY:
        yield Vector("valid", "geometry", name, purpose, requirements, build, "given", 1)
    for area, name, requirements, purpose, asked in TEMPORAL:
        seed = seed_of(name)
        yield Vector("valid", area, name, purpose, requirements,
                     lambda seed=seed, asked=asked: directed(seed, **asked), "directed", seed)
    yield from invalid("stream", "records", INVALID)
