"""Invalid vectors of weights units (6.17) and of networks that are not there (7.17.2)."""

import hashlib

from oracle import constants as c
from oracle.network import REGISTRY
from ..faults import changed, copy_of, element, flipped, inserted, invalid, kind, lost, payload, repeated, where
from ..synth.learned import SMALL, learned_stream, predicted_by_network
from ..synth.units import units_of
from ..vector import Vector

BASE = {**SMALL, "gops": [(1, 0, 1), (1, 0, 2)], "percent": [40, 100], "most": 8, "degree": 0}
PARENTS = (
    ("learned-small", 30000, BASE, "The smallest network in two short GOPs"),
    ("learned-small-normalised", 30100, {**BASE, "network_flags": 6, "width_log2": 4, "feed_forward_width": 3,
                                         "geometry_width": 2}, "A gated and normalised network in two short GOPs"),
    ("learned-small-layers", 30200, {**BASE, "gops": [(1, 1, 3)], "spatial": 2},
     "The smallest network with two spatial and two temporal layers"),
)
SMALLEST, NORMALISED, LAYERS = (row[0] for row in PARENTS)

weights = kind(c.UT_WEIGHTS)
last_weights = kind(c.UT_WEIGHTS, nth=-1)


def second(change):
    """A second weights unit with a changed payload after the first one."""
    def mutate(head, units):
        i = weights(units)
        return head, units[:i + 1] + [units[i].copy(payload=change(units[i].payload))] + units[i + 1:]
    return mutate


def digest(size):
    return lambda data: b"\x01" + (hashlib.sha256(b"not registered").digest() + b"\x00")[:size]


def of_profile_0(units):
    """A weights unit in the first GOP of a stream without one."""
    return units[kind(c.UT_TRANSFORM)(units)].copy(kind=c.UT_WEIGHTS, payload=b"\x01" + sorted(REGISTRY)[0])


def points_without_weights(head, units):
    size = sum(20 + len(u.payload) for u in units if u.kind == c.UT_WEIGHTS)
    return element(kind(c.UT_POINTS), "byte_count", lambda x: x - size)(head, units)


RANGES = [("width-2", "width_log2", 2, 0), ("width-7", "width_log2", 7, 0),
          ("feed-forward-129", "feed_forward_width", 129, 0), ("geometry-33", "geometry_width", 33, 0),
          ("fourier-5", "fourier_count", 5, 0), ("rank-count-0", "rank_count", 0, 0),
          ("rank-count-17", "rank_count", 17, 0), ("dc-count-4", "dc_count", 4, 0), ("sh-count-17", "sh_count", 17, 0),
          ("token-shift-9", "token_shift", 9, 0), ("output-shift-5", "output_shift", 5, 0),
          ("layer-shift-0", "layer_shift", 0, 0), ("layer-shift-16", "layer_shift", 16, 7)]

FAULTS = [("weights-" + name, SMALLEST, "OUT_OF_RANGE", "SS-WT-003 SS-ER-001", "%s of a network is %d" % (what, value),
           element(weights, what, value, index)) for name, what, value, index in RANGES]
FAULTS += [
    ("weights-source-2", SMALLEST, "RESERVED", "SS-WT-001", "model_source is 2", element(weights, "model_source", 2)),
    ("weights-source-255-alone", SMALLEST, "RESERVED", "SS-WT-001",
     "model_source is 255 and nothing follows", payload(weights, lambda data: b"\xff")),
    ("weights-empty", SMALLEST, "SHORT_SECTION", "SS-ER-003", "the payload is empty",
     payload(weights, lambda data: b"")),
    ("weights-digest-unknown", SMALLEST, "RESERVED", "SS-WT-001",
     "the digest is of no registered network", payload(weights, digest(32))),
    ("weights-digest-short", SMALLEST, "SHORT_SECTION", "SS-WT-001", "the digest has 31 bytes",
     payload(weights, digest(31))),
    ("weights-digest-long", SMALLEST, "TRAILING_BYTES", "SS-WT-001", "the digest has 33 bytes",
     payload(weights, digest(33))),
    ("weights-twice", SMALLEST, "CONSTRAINT", "SS-WT-002", "a GOP has two equal weights units", repeated(weights)),
    ("weights-twice-broken", SMALLEST, ("CONSTRAINT", "RESERVED_BITS", "SHORT_SECTION"), "SS-WT-002 SS-ER-009",
     "a second weights unit, which would not parse either", second(lambda data: b"\x00\xff")),
    ("weights-twice-reserved", SMALLEST, ("CONSTRAINT", "RESERVED"), "SS-WT-001 SS-ER-009",
     "model_source of a second weights unit is 2", second(lambda data: b"\x02" + data[1:])),
    ("weights-network-cut", SMALLEST, ("SHORT_SECTION", "RESERVED_BITS"), "SS-WT-001 SS-ER-009",
     "the fixed part of the network is cut, and reserved bits of its flags are set",
     payload(weights, lambda data: b"\x00\xff" + data[2:18])),
    ("weights-in-profile-0", "stream-several-gops", "RESERVED", "SS-UH-006 SS-LM-003",
     "a weights unit in profile 0", inserted(of_profile_0, kind(c.UT_FRAME))),
    ("weights-flags-16", SMALLEST, "RESERVED_BITS", "SS-WT-003 SS-ER-002", "bit 4 of network_flags is set",
     element(weights, "network_flags", 16)),
    ("weights-outputs-none", SMALLEST, "OUT_OF_RANGE", "SS-WT-003", "dc_count and sh_count are 0",
     payload(weights, lambda data: data[:7] + b"\x00\x00" + data[9:19])),
    ("weights-parameters-none", SMALLEST, "SHORT_SECTION", "SS-WT-004", "parameters is absent",
     payload(weights, lambda data: data[:19])),
    ("weights-parameters-short", NORMALISED, "SHORT_SECTION", "SS-WT-004", "the last byte of parameters is missing",
     payload(weights, lambda data: data[:-1])),
    ("weights-parameters-long", NORMALISED, "TRAILING_BYTES", "SS-WT-004 SS-ER-003", "a byte stands after parameters",
     payload(weights, lambda data: data + b"\x00")),
    ("weights-query-left-over", SMALLEST, "TRAILING_BYTES", "SS-WT-004",
     "full_attention is set, so that there is no array query, but its bytes are there",
     element(weights, "network_flags", 1)),
    ("weights-gain-missing", SMALLEST, "SHORT_SECTION", "SS-WT-004",
     "normalised is set but the arrays gain and gain_bias are missing", element(weights, "network_flags", 4)),
    ("weights-other", NORMALISED, "DIGEST",
     "SS-TR-001 SS-TR-002 SS-TR-003 SS-TR-004 SS-TR-005 SS-TR-006 SS-TR-007 SS-TR-008 SS-TR-009 SS-TR-010 SS-IN-012",
     "the parameters are others than those with which the digests were made",
     payload(last_weights, lambda data: data[:19] + bytes(255 - x for x in data[19:]))),
    ("weights-damaged", SMALLEST, "CHECKSUM", "SS-UH-009", "a bit of a weights unit is flipped",
     flipped(weights)),
    ("weights-lost", SMALLEST, "UNDEFINED", "SS-PR-002", "predictor 3 in a GOP without weights unit", lost(weights)),
    ("weights-of-gop-before", NORMALISED, "UNDEFINED", "SS-PR-002 SS-GH-004",
     "the second GOP has no weights unit; that of the first is undefined by its gop_header", lost(last_weights)),
    ("weights-before-gop", SMALLEST, "UNEXPECTED_UNIT", "SS-BS-001", "a weights unit before the first gop_header",
     inserted(copy_of(weights), kind(c.UT_GOP))),
    ("weights-within-frame", SMALLEST, "UNEXPECTED_UNIT", "SS-BS-001", "a weights unit after a frame_header",
     inserted(copy_of(weights), kind(c.UT_INCREMENT))),
    ("weights-between-frames", SMALLEST, "UNEXPECTED_UNIT", "SS-BS-001", "a weights unit between two frames",
     inserted(copy_of(last_weights), kind(c.UT_FRAME, nth=-1))),
    ("weights-at-end", SMALLEST, "UNEXPECTED_UNIT", "SS-BS-001", "a weights unit before the end unit",
     inserted(copy_of(last_weights), kind(c.UT_END))),
    ("weights-frame", SMALLEST, "MISMATCH", "SS-BS-002", "frame of a weights unit is not that of its GOP",
     changed(weights, frame=lambda u: u.frame + 1)),
    ("weights-spatial-layer", LAYERS, "OUT_OF_RANGE", "SS-UH-007", "spatial_layer of a weights unit is 1",
     changed(weights, s=1)),
    ("weights-temporal-layer", LAYERS, "OUT_OF_RANGE", "SS-UH-007", "temporal_layer of a weights unit is 1",
     changed(weights, t=1)),
    ("weights-refinement", LAYERS, "OUT_OF_RANGE", "SS-UH-007", "refinement of a weights unit is 1",
     changed(weights, r=1)),
    ("weights-not-in-points", SMALLEST, "MISMATCH", "SS-PL-002", "byte_count leaves the weights units out",
     points_without_weights),
]


def with_points(seed, asked):
    """A learned stream in which the network is in use and operating_points has entries."""
    for attempt in range(seed, seed + 100):
        data, synth = learned_stream(attempt, asked)
        if predicted_by_network(synth) >= 6 and where(lambda u: u.kind == c.UT_POINTS and len(u.payload) > 4,
                                                      nth=slice(None))(units_of(data)[1]):
            return data
    raise ValueError("no operating_points unit from seed %d on" % seed)


def rows():
    for name, seed, asked, purpose in PARENTS:
        yield Vector("valid", "learned", name, purpose, "SS-WT-001 SS-WT-004 SS-PR-002",
                     lambda seed=seed, asked=asked: with_points(seed, asked), "learned", seed)
    yield from invalid("weights", "weights", FAULTS)
