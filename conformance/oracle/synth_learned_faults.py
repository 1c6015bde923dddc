"""Faults in weights units and in the use of predictor 3: the rows of LEARNED_FAULTS.

A row is: name, code of the first error, what is asked of the stream (synth_learned.py), and a mutation as in
synth_mutations.py or a Tamper fault as in synth_faults.py.
"""

import hashlib
import random

import constants as c
from synth import Synth
from synth_faults import Tamper, always, entry
from synth_learned import SMALL, LearnedSynth
from synth_mutations import (a_copy, changed, damage, header_set, inserted, is_increment, lose, of_kind, patched,
                             points_entry, repeat, stream_of, units_of)

BASE = {**SMALL, "gops": [(1, 0, 1), (1, 0, 2)], "percent": [40, 100], "most": 8, "degree": 0}
OTHER = {**BASE, "network_flags": 6, "width_log2": 4, "feed_forward_width": 3, "geometry_width": 2}
LAYERS = {**BASE, "gops": [(1, 1, 3)], "spatial": 2}

weights = of_kind(c.UT_WEIGHTS)


def element(place, value):
    """One byte of a weights unit changed."""
    return changed(weights, patched(place, "B", value))


def payload(change):
    def changed_payload(u, rng):
        u.payload = change(u.payload)
    return changed(weights, changed_payload)


def second(change):
    """A second weights unit with a changed payload after the first one."""
    def mutate(units, rng):
        i = rng.choice([i for i, u in enumerate(units) if weights(u)])
        u = units[i].copy()
        u.payload = change(u.payload)
        return units[:i + 1] + [u] + units[i + 1:]
    return mutate


def lose_last(units, rng):
    i = max(i for i, u in enumerate(units) if weights(u))
    return units[:i] + units[i + 1:]


def later_frame(u):
    return u.kind == c.UT_FRAME and u.payload[0] != c.TYPE_I


def points_without_weights(units, rng):
    size = sum(20 + len(u.payload) for u in units if weights(u))
    return points_entry(20, "Q", lambda x: x - size)(units, rng)


def no_parameters(data):
    return data[:19]


def no_outputs(data):
    return data[:7] + b"\x00\x00" + data[9:19]


def two_errors(data):
    """Reserved bits before a width out of range."""
    return data[:1] + b"\x10\x09" + data[3:]


def digest(size):
    return lambda data: b"\x01" + (hashlib.sha256(b"not registered").digest() + b"\x00")[:size]


LEARNED_FAULTS = [
    ("source-2", "RESERVED", BASE, element(0, 2)),
    ("source-255-alone", "RESERVED", BASE, payload(lambda data: b"\xff")),
    ("weights-empty", "SHORT_SECTION", BASE, payload(lambda data: b"")),
    ("digest-unknown", "RESERVED", BASE, payload(digest(32))),
    ("digest-short", "SHORT_SECTION", BASE, payload(digest(31))),
    ("digest-long", "TRAILING_BYTES", BASE, payload(digest(33))),
    ("weights-twice", "CONSTRAINT", BASE, repeat(weights)),
    ("weights-twice-broken", "CONSTRAINT", BASE, second(lambda data: b"\x00\xff")),
    ("weights-twice-unknown", "CONSTRAINT", BASE, second(digest(31))),
    ("weights-twice-reserved", "RESERVED", BASE, second(lambda data: b"\x02" + data[1:])),
    ("network-cut", "SHORT_SECTION", BASE, payload(lambda data: b"\x00\xff" + data[2:18])),
    ("flags-8", "RESERVED_BITS", BASE, element(1, 8)),
    ("flags-before-width", "RESERVED_BITS", BASE, payload(two_errors)),
    ("width-2", "OUT_OF_RANGE", BASE, element(2, 2)),
    ("width-7", "OUT_OF_RANGE", BASE, element(2, 7)),
    ("feed-forward-129", "OUT_OF_RANGE", BASE, element(3, 129)),
    ("geometry-33", "OUT_OF_RANGE", BASE, element(4, 33)),
    ("fourier-5", "OUT_OF_RANGE", BASE, element(5, 5)),
    ("rank-count-0", "OUT_OF_RANGE", BASE, element(6, 0)),
    ("rank-count-17", "OUT_OF_RANGE", BASE, element(6, 17)),
    ("dc-count-4", "OUT_OF_RANGE", BASE, element(7, 4)),
    ("sh-count-17", "OUT_OF_RANGE", BASE, element(8, 17)),
    ("token-shift-9", "OUT_OF_RANGE", BASE, element(9, 9)),
    ("output-shift-5", "OUT_OF_RANGE", BASE, element(10, 5)),
    ("layer-shift-0", "OUT_OF_RANGE", BASE, element(11, 0)),
    ("layer-shift-16", "OUT_OF_RANGE", BASE, element(18, 16)),
    ("outputs-none", "OUT_OF_RANGE", BASE, payload(no_outputs)),
    ("parameters-none", "SHORT_SECTION", BASE, payload(no_parameters)),
    ("parameters-short", "SHORT_SECTION", OTHER, payload(lambda data: data[:-1])),
    ("parameters-long", "TRAILING_BYTES", OTHER, payload(lambda data: data + b"\x00")),
    ("query-left-over", "TRAILING_BYTES", BASE, element(1, 1)),
    ("gain-missing", "SHORT_SECTION", BASE, element(1, 4)),
    ("weights-other", "DIGEST", OTHER, payload(lambda data: data[:19] + bytes(255 - x for x in data[19:]))),
    ("weights-damaged", "CHECK_SUM", BASE, changed(weights, damage)),
    ("weights-lost", "UNDEFINED", BASE, lose(weights)),
    ("weights-of-gop-before", "UNDEFINED", OTHER, lose_last),
    ("weights-before-gop", "UNEXPECTED_UNIT", BASE, inserted(a_copy(c.UT_WEIGHTS), of_kind(c.UT_GOP))),
    ("weights-within-frame", "UNEXPECTED_UNIT", BASE, inserted(a_copy(c.UT_WEIGHTS), is_increment)),
    ("weights-between-frames", "UNEXPECTED_UNIT", BASE, inserted(a_copy(c.UT_WEIGHTS), later_frame)),
    ("weights-at-end", "UNEXPECTED_UNIT", BASE, inserted(a_copy(c.UT_WEIGHTS), of_kind(c.UT_END))),
    ("weights-frame", "MISMATCH", BASE, changed(weights, lambda u, rng: setattr(u, "frame", u.frame + 1))),
    ("weights-spatial-layer", "OUT_OF_RANGE", LAYERS, changed(weights, header_set(s=1))),
    ("weights-temporal-layer", "OUT_OF_RANGE", LAYERS, changed(weights, header_set(t=1))),
    ("weights-refinement", "OUT_OF_RANGE", BASE, changed(weights, header_set(r=1))),
    ("points-without-weights", "MISMATCH", BASE, points_without_weights),
    ("predictor-4", "OUT_OF_RANGE", OTHER, ("predictors", entry(0, 4, -1))),
    ("predictor-negative", "OUT_OF_RANGE", OTHER, ("predictors", entry(0, -1))),
    ("weights-in-profile-0", "RESERVED", None, None),
]


def faulty_learned(row, seed):
    """The bytes of a stream with the fault of a row, None if this seed has no room for it."""
    name, code, asked, change = row
    rng = random.Random(seed)
    if asked is None:
        return weights_in_profile_0(seed)
    if isinstance(change, tuple):
        tamper = Tamper((name, code, change[0], always, change[1]), rng.choice([0, 1]))
        data = LearnedSynth(seed, asked, tamper).stream()
        return data if tamper.done else None
    head, units = units_of(LearnedSynth(seed, asked).stream())
    units = change(units, rng)
    return None if units is None else stream_of(head, units)


def weights_in_profile_0(seed):
    """A weights unit that is right in itself, with its critical bit."""
    u = next(u for u in units_of(LearnedSynth(seed, BASE).stream())[1] if weights(u))
    head, units = units_of(Synth(seed).stream())
    i = next(i for i, other in enumerate(units) if other.kind == c.UT_TRANSFORM)
    return stream_of(head, units[:i] + [u] + units[i:])
