"""Valid vectors of values in profile 0: positions, attributes, colours and codebooks."""

from oracle import constants as c
from ..synth.given import IDENTITY, GivenStream
from ..vector import Vector
from .stream import one_frame


def attribute(name, *planes):
    """The planes of an attribute by (name, index)."""
    return {(name, index): list(values) for index, values in enumerate(planes)}


def shifted(shift, bits=10, codes=None):
    s = GivenStream(position_bits=bits)
    s.gop()
    s.transform()
    s.frame(len(codes) if codes else 9)
    s.unit(codes=codes, position_shift=shift)
    return s.close()


def corners(bits):
    """The eight corners of the grid, and the middle."""
    last = 8 ** bits - 1
    return sorted(sum(((k >> a & 1) * (last // 7)) << a for a in range(3)) for k in range(8)) + [last // 2]


GEOMETRY = [
    ("geometry-bits-%d" % bits, "SS-PO-001 SS-PO-002 SS-DG-001", "A grid of %d bits" % bits,
     lambda bits=bits: one_frame(9, position_bits=bits)) for bits in (1, 8, 16, 20)
] + [
    ("geometry-corners-%d" % bits, "SS-PO-001 SS-PO-002",
     "The corners of a grid of %d bits: the largest codes and deltas" % bits,
     lambda bits=bits: one_frame(9, codes=corners(bits), position_bits=bits)) for bits in (1, 10, 20)
] + [
    ("geometry-shift-%d" % shift, "SS-PO-003",
     "position_shift %d of a grid of 10 bits: middles of coarse cells" % shift,
     lambda shift=shift: shifted(shift)) for shift in (1, 5, 9)
] + [
    ("geometry-shift-19", "SS-PO-003 SS-PO-001", "position_shift 19 of 20 bits: eight positions, all corners taken",
     lambda: shifted(19, 20, list(range(8)))),
    ("geometry-all-equal", "SS-PO-002",
     "70 Gaussians at one position in two blocks: all deltas but the first of a block are 0",
     lambda: one_frame(70, codes=[123456] * 70)),
    ("geometry-duplicates", "SS-PO-002 SS-DG-002", "Each position twice",
     lambda: one_frame(20, codes=[(k // 2) * 1000 for k in range(20)])),
    ("geometry-one-axis", "SS-PO-002", "All Gaussians on the y axis",
     lambda: one_frame(16, codes=[2 << 3 * k for k in range(8)] * 2)),
    ("geometry-block-of-64", "SS-PO-002", "64 Gaussians: exactly one block", lambda: one_frame(64)),
    ("geometry-block-of-65", "SS-PO-002 SS-EC-005", "65 Gaussians: the second block has one, and codes start again",
     lambda: one_frame(65)),
    ("geometry-blocks-descend", "SS-PO-002", "Every position of the second block is before those of the first",
     lambda: one_frame(128, codes=[10 ** 6 + k for k in range(64)] + [k for k in range(64)])),
    ("geometry-block-log2-16", "SS-PO-002", "Blocks of 65536: one block", lambda: one_frame(70, block_log2=16)),
]

ATTRIBUTE = [
    ("attribute-log-scale-ends", "SS-RC-001", "Log-scales at both ends of their range, with steps at both ends as well",
     lambda: one_frame(6, attribute("log_scale", [-32768, 32767, 0, -1, -1, 32767],
                                    [0, 32767, -32767, 32767, -32767, 0],
                                    [0, 32767, 32767, -32767, 32767, 32767]))),
    ("attribute-log-scales-equal", "SS-RC-002", "All axes of all Gaussians are equal, with canonical_axes",
     lambda: one_frame(6, attribute("log_scale", [7] * 6, [0] * 6, [0] * 6), sequence_flags=1)),
    ("attribute-log-scales-rise", "SS-RC-002", "Without canonical_axes log-scales may increase from axis to axis",
     lambda: one_frame(6, attribute("log_scale", range(6), [-1, -100, 5, 0, -7, 3], [-50, 2, -3, -4, 0, 9]))),
    ("attribute-opacity-ends", "SS-RC-001 SS-OUT-001",
     "Opacities at both ends of their range, far beyond any logit in use",
     lambda: one_frame(4, attribute("opacity", [-32768, 32767, 0, -1]))),
    ("attribute-rotation-ends", "SS-RC-003 SS-OUT-002 SS-OUT-003",
     "Rotations at both ends: their sum of squares is above 1 and w is 0",
     lambda: one_frame(5, attribute("rotation", [-32767, 32767, 0, 0, 1], [0, 32767, -32767, 0, 0],
                                    [0, -32767, 32767, 0, 0]),
                       rotation_step=1.0)),
    ("attribute-rotation-of-no-angle", "SS-OUT-002", "Rotations 0: w is 1",
     lambda: one_frame(3, attribute("rotation", [0] * 3, [0] * 3, [0] * 3))),
    ("attribute-rotation-near-unit", "SS-OUT-002",
     "x, y, z just below, at and above length 1, where w is a small root or 0",
     lambda: one_frame(5, attribute("rotation", [333, 333, 334, 0, 236], [0, 9, 0, 333, 236], [0, 25, 0, 8, 0]),
                       rotation_step=0.003)),
    ("attribute-rotation-steps-denormal", "SS-OUT-002", "Squares of components that are subnormal numbers",
     lambda: one_frame(4, attribute("rotation", [1, -1, 2, 3], [1, 1, 1, 1], [0, 0, 1, -1]), rotation_step=2.0 ** -40)),
]


def coloured(total=6, rank=None, mean=(), basis=None, components=None):
    s = GivenStream()
    s.gop()
    s.transform(0, 0, mean, basis, rank)
    s.frame(total)
    s.unit(attribute("dc", *components) if components else None)
    return s.close()


def with_sh(degree, rank=None, mode=1, transform=True, mean=(5,)):
    s = GivenStream(sh_degree=degree)
    s.gop()
    s.transform()
    if transform:
        s.transform(1, 3, mean, rank=rank)
    s.frame(5, sh=3 if transform else c.NONE_ID)
    s.unit(sh_mode=mode)
    return s.close()


def modes_mixed():
    """sh_mode changes from unit to unit of one frame."""
    s = GivenStream(sh_degree=1, percent=[20, 40, 60, 80, 100])
    s.gop()
    s.transform()
    s.transform(1, 0, rank=4, mean=range(9))
    s.codebook(2, 4, list(range(-20, 20)))
    s.frame(20, sh=0)
    for mode in (1, 2, 0, 2, 1):
        s.unit(sh_mode=mode, stages=(2,) if mode == 2 else ())
    return s.close()


COLOUR = [
    ("colour-rank-%d" % rank, "SS-RC-005 SS-AT-002", "A dc transform of rank %d" % rank,
     lambda rank=rank: coloured(rank=rank))
    for rank in (1, 2, 3)
] + [
    ("colour-components-ends", "SS-RC-005 SS-TF-004", "Components and coefficients at both ends: the largest sums",
     lambda: coloured(4, 3, [], [4096] * 3 + [-4096] * 3 + [4096, -4096, 0], [[8191, -8191, 8191, 0]] * 3)),
    ("colour-mean-ends", "SS-TF-004", "Means at both ends of their range, with the largest components that lead inwards",
     lambda: coloured(4, 3, [2 ** 30, -2 ** 30, 0], IDENTITY,
                      [[-8191, -1, 0, -8191], [8191, 1, 0, 8191], [8191, -8191, 1, 0]])),
    ("colour-rounding", "SS-AT-002",
     "Sums at and beside halves of both signs, which would be different if rounded term by term",
     lambda: coloured(6, 2, [], [32, 16, 31, 0, 16, 1], [[1, -1, 3, -3, 2, -2], [0, 0, 1, -1, 1, -1]])),
    ("colour-sh-degree-0", "SS-FR-003 SS-RC-004", "No sh planes", lambda: one_frame(5)),
] + [
    ("colour-sh-degree-%d" % degree, "SS-RC-004 SS-TF-002", "sh of degree %d with a transform of full rank" % degree,
     lambda degree=degree: with_sh(degree)) for degree in (1, 2, 3)
] + [
    ("colour-sh-rank-1", "SS-RC-004", "An sh transform of rank 1 for 45 outputs", lambda: with_sh(3, 1)),
    ("colour-sh-mode-0", "SS-RC-004", "sh_mode 0 with a transform: sh is 0, and the mean is not applied",
     lambda: with_sh(1, mode=0)),
    ("colour-sh-without-transform", "SS-RC-004 SS-IN-010", "sh_transform_id is 255 in a stream with sh: sh is 0",
     lambda: with_sh(2, mode=0, transform=False)),
    ("colour-sh-modes-mixed", "SS-IN-010 SS-RC-004 SS-RC-004 SS-SH-001",
     "sh_mode 0, 1 and 2 in the units of one frame", modes_mixed),
    ("colour-sh-components-ends", "SS-RC-004", "sh components at both ends of their range",
     lambda: one_frame(3, {("sh", k): [8191, -8191, 0] for k in range(9)}, sh={}, sh_degree=1)),
]


def vector_quantised(books, stages, rank=2, indices=None, total=6):
    """books: identifier -> (values, bytes of a value)."""
    s = GivenStream(sh_degree=1)
    s.gop()
    s.transform()
    s.transform(1, 0, rank=rank)
    for identifier, (values, size) in books.items():
        s.codebook(identifier, rank, values, size)
    s.frame(total, sh=0)
    s.unit(attribute("sh", *indices) if indices else None, sh_mode=2, stages=stages)
    return s.close()


SMALL_BOOK = list(range(-10, 10))
CODEBOOK = [
    ("codebook-one-entry", "SS-IN-010 SS-SH-001", "A codebook with one entry: every index is 0",
     lambda: vector_quantised({0: ([3, -4], 1)}, (0,))),
    ("codebook-value-ends", "SS-SH-001", "Values of one byte at both ends, in three stages",
     lambda: vector_quantised({0: ([127, -128, -128, 127, 0, 1], 1)}, (0, 0, 0))),
    ("codebook-first-last", "SS-SH-001", "The first and the last index",
     lambda: vector_quantised({7: (SMALL_BOOK, 1)}, (7,), indices=[[0, 9, 0, 9, 9, 0]])),
    ("codebook-65536-entries", "SS-CB-002 SS-SH-001", "The largest codebook, with indices up to 65535",
     lambda: vector_quantised({0: ([k % 251 - 125 for k in range(65536)], 1)}, (0,), 1,
                              [[0, 65535, 32768, 1, 255, 256]])),
    ("codebook-two-bytes", "SS-SH-001", "Values of two bytes at both ends; sums are clamped",
     lambda: vector_quantised({1: ([32767, -32768, -32768, 32767, 8191, -8191], 2)}, (1, 1))),
    ("codebook-two-stages", "SS-IN-010", "Two stages with codebooks of one and two bytes",
     lambda: vector_quantised({3: (SMALL_BOOK, 1), 12: ([1000 * k for k in SMALL_BOOK], 2)}, (12, 3))),
    ("codebook-same-in-four-stages", "SS-IN-010 SS-SH-001", "Four stages with the same codebook",
     lambda: vector_quantised({15: (SMALL_BOOK, 1)}, (15,) * 4)),
    ("codebook-sixteen", "SS-IN-010", "Sixteen codebooks, of which four are in use",
     lambda: vector_quantised({k: ([k, -k] * (k + 1), 1) for k in range(16)}, (15, 0, 8, 3))),
    ("codebook-clamped", "SS-SH-001", "Sums of four stages beyond 8191 to both sides",
     lambda: vector_quantised({0: ([8000, -8000, 300, -300], 2)}, (0,) * 4,
                              indices=[[0, 1, 0, 1, 0, 0]] * 3 + [[0, 1, 1, 0, 0, 0]])),
    ("codebook-45-components", "SS-IN-010 SS-SH-001", "Entries of 45 components",
     lambda: wide_book()),
    ("codebook-unused", "SS-CB-002", "Codebooks that no unit uses, one of another rank", lambda: unused_books()),
]


def wide_book():
    s = GivenStream(sh_degree=3)
    s.gop()
    s.transform()
    s.transform(1, 0)
    s.codebook(4, 45, [k % 127 for k in range(90)])
    s.frame(3, sh=0)
    s.unit(sh_mode=2, stages=(4,))
    return s.close()


def unused_books():
    s = GivenStream(sh_degree=1)
    s.gop()
    s.transform()
    s.codebook(0, 7, [1] * 14)
    s.codebook(9, 1, [1])
    s.frame(3)
    s.unit()
    return s.close()


def rows():
    for area, table in (("geometry", GEOMETRY), ("attribute", ATTRIBUTE), ("colour", COLOUR), ("codebook", CODEBOOK)):
        for name, requirements, purpose, build in table:
            yield Vector("valid", area, name, purpose, requirements, build, "given", 1)
