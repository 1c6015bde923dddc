"""Valid vectors of the structure of profile 1: layers, refinements, operating points, absent frames."""

from oracle import constants as c
from oracle.decoding import Decoder
from oracle.extraction import extract
from ..synth.directed import directed
from ..synth.units import stream_of, units_of
from ..vector import Vector, seed_of

QUARTERS = [25, 50, 75, 100]
TENTHS = list(range(10, 101, 10))


def same(number, before):
    return before


def grown(by):
    return lambda number, before: [n + by for n in before]


ABOVE_REFERENCE = dict(gops=[(1, 0, 3)], percent=QUARTERS, units=lambda k: [None, 2, 4][k], sizes=same)
SPATIAL = [
    ("spatial-layers-%d" % n, "SS-PA-001 SS-BS-004 SS-LO-002 SS-OP-002", "An all-intra GOP with %d spatial layers" % n,
     dict(gops=[(0, 0, 1)], spatial_layer_count=n, most=16)) for n in (1, 2, 3, 4)
] + [
    ("spatial-layer-adds-nothing", "SS-PA-001 SS-IN-011", "Every unit of layer 1 keeps its parents and adds none",
     dict(gops=[(0, 0, 1)], spatial_layer_count=2, layer_sizes=lambda share, s: share, modes=(1, 0, 0, 0))),
    ("spatial-base-is-empty", "SS-PA-001 SS-BS-004", "Layers 0 and 1 have no Gaussians, layer 2 has all",
     dict(gops=[(0, 0, 1)], spatial_layer_count=3, layer_sizes=lambda share, s: 0)),
    ("spatial-frame-stops-at-layer-0", "SS-BS-004 SS-LO-002", "I frames with fewer layers than the sequence has",
     dict(gops=[(0, 0, 3)], spatial_layer_count=3, units=lambda k: [[2], [2, 2], [2, 2, 2]][k])),
    ("spatial-refinements-fall", "SS-BS-004 SS-LO-002",
     "Higher layers of I frames stop at lower refinements, so that a lower layer is shown",
     dict(gops=[(0, 0, 3)], spatial_layer_count=3, percent=QUARTERS,
          units=lambda k: [[4, 3, 1], [3, 3, 2], [2, 2, 2]][k])),
    ("spatial-updates-between-layers", "SS-PA-004 SS-RC-001 SS-RC-003",
     "Every parent from the layer below moves and is updated",
     dict(gops=[(0, 0, 1)], spatial_layer_count=2, modes=(0, 0, 0, 1), layer_sizes=lambda share, s: share // 2,
          sh_degree=1)),
    ("spatial-with-predicted-frames", "SS-PA-001 SS-PA-006 SS-OP-002 SS-UH-008",
     "P and B frames at the highest of three layers",
     dict(gops=[(1, 1, 4)], spatial_layer_count=3, most=16)),
]
TEMPORAL = [
    ("temporal-depth-%d" % d, "SS-BS-009 SS-FR-002 SS-PR-001 SS-CA-001 SS-CA-003",
     "Types, layers and references of depth %d over nine frames" % d,
     dict(gops=[(1, d, 9)], most=8, temporal_layer_count=max(d + 1, 1))) for d in range(4)
] + [
    ("temporal-intra-gops", "SS-BS-006 SS-BS-009", "All-intra GOPs of profile 1", dict(gops=[(0, 0, 2), (0, 0, 1)])),
    ("temporal-gops-mixed", "SS-GH-004 SS-GH-006", "Predicted GOPs of several depths and an all-intra one",
     dict(gops=[(1, 2, 5), (0, 0, 2), (1, 0, 2), (1, 1, 2)], temporal_layer_count=3, most=7)),
    ("temporal-depth-below-layers", "SS-GH-006", "temporal_depth 0 in a sequence of four temporal layers",
     dict(gops=[(1, 0, 3)], temporal_layer_count=4)),
    ("temporal-i-frame-alone", "SS-BS-010", "A predicted GOP of one frame", dict(gops=[(1, 0, 1), (1, 0, 1)])),
    ("temporal-b-frames-absent", "SS-BS-010 SS-LO-004", "B frames of the two highest layers are absent",
     dict(gops=[(1, 2, 9)], present=lambda k: k % 4 == 0, temporal_layer_count=3)),
    ("temporal-end-of-gop-absent", "SS-BS-010 SS-GH-001",
     "The last frames of a GOP are absent, and the next GOP counts on",
     dict(gops=[(1, 1, 8), (1, 0, 2)], present=lambda k: k < 4)),
    ("temporal-gop-of-1024", "SS-GH-005 SS-BS-010", "gop_frame_count is 1024 and six frames are present",
     dict(gops=[(1, 3, 1024), (1, 0, 1)], present=lambda k: k in (0, 4, 6, 7, 8), most=6)),
    ("temporal-b-from-part-of-p", "SS-LO-004 SS-LO-001 SS-PR-001",
     "P frames have fewer refinements than their reference, and B frames use what they have",
     dict(gops=[(1, 1, 6)], percent=QUARTERS, units=lambda k: [None, 2, 3, 3, 1, 1][k], sizes=same)),
    ("temporal-units-above-reference", "SS-LO-001 SS-BS-004",
     "Units above the level of the reference frame are discarded, whatever they hold",
     ABOVE_REFERENCE),
    ("temporal-units-above-reference-in-layers", "SS-LO-001 SS-BS-004 SS-BS-009",
     "Units of a B frame and of a P frame above the level of their reference frame, at the higher of two spatial layers",
     dict(gops=[(1, 1, 5)], percent=QUARTERS, units=lambda k: [None, 4, 2, 4, 4][k], sizes=same, spatial_layer_count=2)),
    ("temporal-count-grows", "SS-PA-006", "The number of Gaussians grows a hundredfold from one P frame to the next",
     dict(gops=[(1, 0, 3)], most=2, sizes=lambda k, before: [100 * n for n in before] if k == 1 else before)),
    ("temporal-count-shrinks", "SS-PA-006 SS-PA-003", "From 200 Gaussians to two",
     dict(gops=[(1, 0, 3)], most=200, sizes=lambda k, before: [1 for _ in before])),
    ("temporal-frame-becomes-empty", "SS-PA-006 SS-PR-003",
     "A P frame without Gaussians, and one that starts again from it",
     dict(gops=[(1, 0, 4)], sizes=lambda k, before: [0, 0] if k == 1 else [4, 6])),
    ("temporal-scene-cut", "SS-PA-003 SS-PA-004", "Every parent is removed and others come",
     dict(gops=[(1, 0, 3)], sizes=same, removed=lambda n: n)),
    ("temporal-nothing-shared", "SS-PR-003",
     "A frame that shares nothing with its reference: all removed, all new without predictor",
     dict(gops=[(1, 1, 3)], sizes=grown(1), removed=lambda n: n, fixed={"predictor_block_log2": None})),
    ("temporal-nothing-changes", "SS-PA-004 SS-CA-003", "All parents are kept as they are in every frame",
     dict(gops=[(1, 2, 6)], sizes=same, modes=(1, 0, 0, 0), removed=lambda n: 0, cells=lambda w, occupied: {},
          temporal_layer_count=3)),
]
REFINEMENT = [
    ("refinement-position-shift-19", "SS-PO-003", "position_shift 19 of a grid of 20 bits in increments",
     dict(position_bits=20, fixed={"position_shift": 19}, modes=(1, 0, 1, 0))),
    ("refinement-attribute-steps", "SS-RC-001 SS-RC-003 SS-RC-005", "attribute_step 13 of every attribute",
     dict(fixed={"attribute_step": [13] * 5, "sh_mode": lambda w: int(w.context.sh_transform is not None)},
          sh_degree=1, values={"log_scale": lambda w, p, factor: [3, 0, 0], "opacity": lambda w, p, factor: [1]})),
    ("refinement-position-shift", "SS-PO-003 SS-PA-005", "Moves and new positions with position_shift 3",
     dict(fixed={"position_shift": 3}, modes=(0, 1, 0, 0))),
    ("refinement-compensation", "SS-CA-004 SS-OP-003",
     "Log-scales and opacities are compensated at lower refinements, to the ends of their ranges",
     dict(fixed={"compensation_log_scale": 127, "compensation_opacity": -128}, percent=QUARTERS,
          values={"log_scale": lambda w, p, factor: [(32760 - p[0]) // factor, 0, 0] if p == (0, 0, 0) else [0, 0, 0]})),
    ("refinement-compensation-down", "SS-CA-004", "Compensation downwards in I, P and B frames of two spatial layers",
     dict(fixed={"compensation_log_scale": -128, "compensation_opacity": 127}, percent=QUARTERS, spatial_layer_count=2,
          gops=[(1, 1, 3), (0, 0, 1)])),
    ("refinement-ten-of-p", "SS-OP-002 SS-BS-004", "P frames of ten refinements",
     dict(percent=TENTHS, gops=[(1, 0, 2)], most=20)),
    ("refinement-one", "SS-SP-001 SS-CA-004", "A single refinement: nothing is carried or compensated",
     dict(percent=[100], gops=[(1, 1, 3)])),
    ("refinement-sh-mode-changes", "SS-PM-001 SS-IN-010",
     "sh_mode changes from unit to unit, so that models of sh come and go",
     dict(sh_degree=1, percent=QUARTERS, gops=[(1, 0, 2)],
          fixed={"sh_mode": lambda w: 0 if w.context.sh_transform is None else w.r % 2})),
    ("refinement-digests", "SS-DG-003 SS-DG-004 SS-DG-005 SS-DG-005 SS-IN-012",
     "Digests of exact lists and of carried lists in I, P and B frames",
     dict(percent=QUARTERS, gops=[(1, 2, 5)], temporal_layer_count=3)),
]
EXTRACTION = [
    ("extraction-all-points",
     "SS-OP-002 SS-OP-003 SS-OP-007 SS-OP-008 SS-PL-001 SS-PL-002 SS-BS-003 SS-OP-006 SS-OP-001",
     "Four spatial layers, four temporal layers and ten refinements",
     dict(spatial_layer_count=4, temporal_layer_count=4, percent=TENTHS,
                                                                          gops=[(1, 3, 9)], most=12)),
    ("extraction-skipped-units", "SS-OP-005 SS-UH-004", "Skipped units belong to operating points by their headers too",
     dict(disturbed=True, spatial_layer_count=2, gops=[(1, 1, 5), (0, 0, 2)], percent=QUARTERS)),
    ("extraction-without-lists", "SS-OP-005 SS-PL-003", "No operating_points and no index",
     dict(listed=False, indexed=False)),
    ("extraction-index-alone", "SS-OP-005 SS-IX-001",
     "The index is written again, and there is no operating_points unit",
     dict(listed=False, gops=[(1, 0, 2), (1, 1, 3)])),
]
ENTROPY = [
    ("entropy-sections-of-%d-lanes" % 2 ** k, "SS-SE-001 SS-EC-003 SS-EC-005",
     "Sections of increments with %d lanes" % 2 ** k,
     dict(lanes=k, most=30, gops=[(1, 0, 2)])) for k in (0, 3, 4, 5)
]
STABILITY = [
    ("stability-chain-of-300", "SS-DG-004 SS-MO-003 SS-GH-005",
     "A chain of 300 P frames, displaced in each: no drift, each with its digest",
     dict(gops=[(1, 0, 300)], most=2, percent=[100], sizes=same, removed=lambda n: 0, modes=(1, 0, 0, 0),
          position_bits=16, listed=False,
          cell_log2=15, cells=lambda w, occupied: {X: ([3, -2, 1], [40, -30, 90], 0) for X in occupied})),
    ("stability-one-gaussian", "SS-PR-005 SS-PA-001", "One Gaussian in every frame",
     dict(most=1, gops=[(1, 1, 3)], sizes=same, percent=[50, 100])),
    ("stability-empty-frames", "SS-PA-006 SS-PR-003 SS-DG-003", "Frames of profile 1 without Gaussians",
     dict(most=lambda number: 0, gops=[(1, 1, 3), (0, 0, 1)], sizes=same)),
    ("stability-sh-degree-3", "SS-RC-004", "sh of degree 3 in I, P and B frames",
     dict(sh_degree=3, ranks=(3, 12), most=6)),
    ("stability-grid-of-8", "SS-PR-005", "A grid of eight points: ties and duplicates everywhere",
     dict(position_bits=1, most=30)),
    ("stability-blocks", "SS-SE-001 SS-MO-001 SS-EC-005", "Sections of several blocks",
     dict(most=150, gops=[(1, 0, 2)])),
    ("stability-block-log2-16", "SS-SE-001", "Blocks of 65536 entries", dict(block_log2=16, most=80, gops=[(1, 0, 2)])),
    ("stability-canonical-axes", "SS-RC-002 SS-RC-002", "canonical_axes in predicted frames",
     dict(sequence_flags=1, modes=(0, 0, 1, 0))),
]


def extracted(seed, point, **asked):
    data = extract(directed(seed, **asked), point)
    assert not Decoder(data).decode().errors
    return data


def damaged_above_reference(seed):
    """Units 2 and 3 of frame 2, which are discarded: with wrong checksums, and with wrong layers."""
    head, units = units_of(directed(seed, **ABOVE_REFERENCE, listed=False))
    for u in units:
        if u.kind == c.UT_INCREMENT and u.frame == 2 and u.r == 2:
            u.raw = ((-1, 0x10),)
        if u.kind == c.UT_INCREMENT and u.frame == 2 and u.r == 3:
            u.t, u.s = 3, 3
    return stream_of(head, units)


EXTRACTED = [
    ("extraction-result-s0", (0, 3, 9),
     "An extraction of spatial layer 0: I frames alone, of a sequence with P frames"),
    ("extraction-result-t0", (3, 0, 9), "An extraction of temporal layer 0"),
    ("extraction-result-r0", (3, 3, 0), "An extraction of refinement 0, which keeps the I frame complete"),
    ("extraction-result-middle", (1, 1, 1), "An extraction in the middle of all three axes"),
]
TABLES = (("spatial", SPATIAL), ("temporal", TEMPORAL), ("refinement", REFINEMENT), ("entropy", ENTROPY),
          ("extraction", EXTRACTION), ("stability", STABILITY))


def rows():
    for area, table in TABLES:
        for name, requirements, purpose, asked in table:
            seed = seed_of(name)
            yield Vector("valid", area, name, purpose, requirements,
                         lambda seed=seed, asked=asked: directed(seed, **asked), "directed", seed)
    name = "temporal-units-above-reference-unchecked"
    seed = seed_of(name)
    yield Vector("valid", "temporal", name,
                 "payload_crc and layers of units above the level of the reference frame are wrong and not looked at",
                 "SS-LO-001 SS-BS-009", lambda seed=seed: damaged_above_reference(seed), "directed", seed)
    asked = dict(spatial_layer_count=2, gops=[(1, 2, 5), (0, 0, 1)], temporal_layer_count=3, percent=QUARTERS)
    for name, point, purpose in EXTRACTED:
        yield Vector("valid", "extraction", name, purpose, "SS-OP-005 SS-OP-002 SS-OP-007 SS-OP-008",
                     lambda point=point: extracted(11, point, **asked), "directed", 11)
