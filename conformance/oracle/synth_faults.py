"""Faults in increments: random streams of profile 1 in which one increment breaks one rule.

A fault is a row of FAULTS: name, code of the first error, stage at which IncrementWriter asks, whether it can be
made there, and the change. All check sums are right, and what follows the fault is consistent with its loss.
"""

import copy
import random

from decoding import Decoder
from homes import REMOVE
from synth_dynamic import DynamicSynth


class Tamper:
    """Makes one fault at the place number `skip` at which it can be made."""

    def __init__(self, fault, skip):
        self.name, self.code, self.stage, self.applicable, self.change = fault
        self.skip = skip
        self.done = False

    def __call__(self, stage, value, writer):
        if self.done or stage != self.stage or not self.applicable(value, writer):
            return value
        if self.skip > 0:
            self.skip -= 1
            return value
        self.done = True
        return self.change(copy.deepcopy(value) if stage != "fixed" else copy.copy(value), writer)


def always(value, writer):
    return True


def element(name, value):
    """A change of one element of the fixed part; `value` may be a function of the record and the writer."""
    def change(u, w):
        setattr(u, name, value(u, w) if callable(value) else value)
        return u
    return change


def place_of(name, place, value):
    """A change of one place of an array of the fixed part."""
    def change(u, w):
        places = list(getattr(u, name))
        places[place] = value(u, w) if callable(value) else value
        setattr(u, name, places)
        return u
    return change


def entry(plane, value, which=0):
    """A change of one value of a section; `value` may be a function of the old one."""
    def change(v, w):
        v[plane][which] = value(v[plane][which]) if callable(value) else value
        return v
    return change


def fewer_moves(u, w):
    u.move_count -= 1
    w.v["moves"] = [plane[:-1] for plane in w.v["moves"]]
    return u


def first_move_out(v, w):
    """Below 0 from every position, if the lattice is smaller than 2^14."""
    v[0][0] = -20000
    return v


def log_scales_rise(v, w):
    """d1 becomes -1 or less (SS-RC-002) while all ranges hold."""
    v[2][0] -= 30000 >> w.u.attribute_shift[0]
    return v


def other_book(test):
    """An identifier of a codebook for which test(book, writer) holds, None if there is none."""
    def find(u, w):
        for identifier, book in w.context.codebooks.items():
            if test(book, w):
                return identifier
        return None
    return find


higher = other_book(lambda b, w: b.temporal_layer > w.frame.layer)
wider = other_book(lambda b, w: b.temporal_layer <= w.frame.layer
                   and b.component_count != w.context.sh_transform.rank)


def undefined(u, w):
    return next((i for i in range(16) if i not in w.context.codebooks), None)


def vq(u, w):
    return u.sh_mode == 2


def predicted(u, w):
    return not w.frame.intra


def block_changed(change):
    def changed(coded, w):
        models, blocks = coded
        return models, [change(blocks[0])] + blocks[1:]
    return changed


def state_out(block):
    """The first state below 65536."""
    head = 1
    while block[head - 1] > 127:
        head += 1
    return block[:head] + b"\xff\xff\x00\x00" + block[head + 4:]


def small_lattice(v, w):
    return w.seq.position_bits <= 14


def full_dc(v, w):
    """Component 0 as large as it may be, the others 0."""
    for k in range(w.context.dc_transform.rank):
        v[8 + k][0] = 8191 >> w.u.attribute_shift[3] if k == 0 else 0
    return v


def dc_at_limit(v, w):
    """dc[0] of the first new Gaussian is 2^30 without its component, and cannot have more (SS-RC-005)."""
    t = w.context.dc_transform
    none = w.u.predictor_block_log2 == 255 or w.v["predictors"][0][0] == 0
    return none and t.mean[0] == 2 ** 30 and t.basis[0] > 100


FAULTS = [
    ("parent-count", "MISMATCH", "fixed", always, element("parent_count", lambda u, w: u.parent_count + 1)),
    ("parent-count-limit", "OVER_LIMIT", "fixed", always, element("parent_count", 2 ** 24 + 1)),
    ("cells-in-later-unit", "MISMATCH", "fixed", lambda u, w: w.r > 0, element("cell_count", 1)),
    ("cells-in-i-frame", "MISMATCH", "fixed", lambda u, w: w.frame.intra, element("cell_count", 1)),
    ("cell-count-limit", "OVER_LIMIT", "fixed", always, element("cell_count", 2 ** 20 + 1)),
    ("move-count-large", "MISMATCH", "fixed", always, element("move_count", lambda u, w: u.parent_count + 1)),
    ("move-count", "MISMATCH", "fixed", lambda u, w: u.move_count > 1, fewer_moves),
    ("remove-count", "MISMATCH", "fixed", lambda u, w: predicted(u, w) and u.remove_count < u.parent_count,
     element("remove_count", lambda u, w: u.remove_count + 1)),
    ("new-count", "MISMATCH", "fixed", always, element("new_count", lambda u, w: w.frame.header.gaussian_count + 1)),
    ("new-count-limit", "OVER_LIMIT", "fixed", always, element("new_count", 2 ** 24 + 1)),
    ("position-shift", "OUT_OF_RANGE", "fixed", always, element("position_shift", lambda u, w: w.seq.position_bits)),
    ("attribute-shift", "OUT_OF_RANGE", "fixed", always, place_of("attribute_shift", 4, 8)),
    ("cell-log2", "OUT_OF_RANGE", "fixed", always, element("cell_log2", lambda u, w: w.seq.position_bits + 1)),
    ("predictor-block", "OUT_OF_RANGE", "fixed", always, element("predictor_block_log2", 17)),
    ("neighbours-none", "OUT_OF_RANGE", "fixed", always, element("neighbour_count", 0)),
    ("neighbours-many", "OUT_OF_RANGE", "fixed", always, element("neighbour_count", 17)),
    ("sh-mode-reserved", "RESERVED", "fixed", always, element("sh_mode", 3)),
    ("sh-mode-without-transform", "OUT_OF_RANGE", "fixed", lambda u, w: w.context.sh_transform is None,
     element("sh_mode", 1)),
    ("stages-none", "OUT_OF_RANGE", "fixed", vq, element("vq_stage_count", 0)),
    ("stages-without-vq", "OUT_OF_RANGE", "fixed", lambda u, w: u.sh_mode != 2, element("vq_stage_count", 1)),
    ("book-16", "OUT_OF_RANGE", "fixed", vq, place_of("codebook_ids", 0, 16)),
    ("book-too-many", "OUT_OF_RANGE", "fixed", lambda u, w: u.vq_stage_count < 4, place_of("codebook_ids", 3, 0)),
    ("book-undefined", "UNDEFINED", "fixed", lambda u, w: vq(u, w) and undefined(u, w) is not None,
     place_of("codebook_ids", 0, undefined)),
    ("book-of-higher-layer", "CONSTRAINT", "fixed", lambda u, w: vq(u, w) and higher(u, w) is not None,
     place_of("codebook_ids", 0, higher)),
    ("book-of-other-rank", "MISMATCH", "fixed", lambda u, w: vq(u, w) and wider(u, w) is not None,
     place_of("codebook_ids", 0, wider)),
    ("digest", "DIGEST", "fixed", always, element("refinement_digest", lambda u, w: u.refinement_digest ^ 1)),
    # SS-DG-007: the unit at which the frame is shown.
    ("carried-digest", "DIGEST", "fixed", lambda u, w: not w.frame.intra and w.r == w.seq.refinement_count - 1,
     element("carried_digest", lambda u, w: u.carried_digest ^ 2 ** 63)),
    ("home-too-large", "MISMATCH", "size", lambda size, w: not w.frame.intra and w.r == w.seq.refinement_count - 1,
     lambda size, w: size + 1),
    ("share", "MISMATCH", "size", lambda size, w: w.frame.intra and w.s == w.seq.top
     and size > (len(w.frame.homes[(w.s - 1, w.r)]) if w.s else 0), lambda size, w: size - 1),
    ("mode-5", "OUT_OF_RANGE", "modes", always, entry(0, 5)),
    ("mode-negative", "OUT_OF_RANGE", "modes", always, entry(0, -1, -1)),
    ("mode-remove-in-i-frame", "CONSTRAINT", "modes", lambda v, w: w.frame.intra, entry(0, REMOVE)),
    ("move-out", "CONSTRAINT", "moves", small_lattice, first_move_out),
    ("cell-twice", "CONSTRAINT", "cells", lambda v, w: len(v[0]) in range(2, 65), entry(0, 0, 1)),
    ("cell-out", "CONSTRAINT", "cells", lambda v, w: w.seq.position_bits < 20, entry(0, 2 ** 59, -1)),
    ("cell-stale-2", "OUT_OF_RANGE", "cells", always, entry(1, 2)),
    ("cell-turn", "OUT_OF_RANGE", "cells", always, entry(6, lambda x: x + (20000 if x >= 0 else -20000))),
    ("predictor-without-network", "UNDEFINED", "predictors", always, entry(0, 3, -1)),
    ("predictor-4", "OUT_OF_RANGE", "predictors", always, entry(0, 4)),
    ("predictor-negative", "OUT_OF_RANGE", "predictors", always, entry(0, -1, -1)),
    ("position-out", "CONSTRAINT", "new", lambda v, w: w.seq.position_bits < 20, entry(0, 2 ** 59 + 5, -1)),
    ("log-scale-out", "OUT_OF_RANGE", "new", always, entry(1, 40000)),
    ("log-scale-rises", "CONSTRAINT", "updates", lambda v, w: w.seq.canonical_axes == 1, log_scales_rise),
    ("opacity-out", "OUT_OF_RANGE", "updates", always, entry(3, -40000)),
    ("rotation-out", "OUT_OF_RANGE", "new", always, entry(6, -33000)),
    ("dc-component", "OUT_OF_RANGE", "new", always, entry(8, 8192)),
    ("dc-output", "OUT_OF_RANGE", "new", dc_at_limit, full_dc),
    ("dc-component-shifted", "OUT_OF_RANGE", "updates", lambda v, w: w.u.attribute_shift[3] > 0,
     lambda v, w: entry(7, -(8191 >> w.u.attribute_shift[3]) - 2)(v, w)),
    ("sh-index", "OUT_OF_RANGE", "new", lambda v, w: w.u.sh_mode == 2, entry(-1, 60000, -1)),
    ("models-long", "TRAILING_BYTES", "coded", always, lambda coded, w: (coded[0] + b"\x00", coded[1])),
    ("models-short", "SHORT_SECTION", "coded", lambda coded, w: len(coded[0]) > 0,
     lambda coded, w: (b"", coded[1])),
    ("block-long", "TRAILING_BYTES", "coded", always, block_changed(lambda block: block + b"\x00")),
    ("block-short", "SHORT_SECTION", "coded", always, block_changed(lambda block: block[:4])),
    ("block-state", "ENTROPY_FINAL_STATE", "coded", always, block_changed(state_out)),
    ("lanes-6", "OUT_OF_RANGE", "lanes", always, lambda lanes_log2, w: 6),
    ("payload-long", "TRAILING_BYTES", "payload", always, lambda payload, w: payload + b"\x00"),
    ("payload-short", "SHORT_SECTION", "payload", lambda payload, w: w.v["new"], lambda payload, w: payload[:-1]),
    ("payload-cut", "SHORT_SECTION", "payload", always, lambda payload, w: payload[:40]),
]


def faulty_stream(fault, seed, tries=200, most=None):
    """(stream, seed used): the fault in a stream with a seed from `seed` on that has room for it."""
    for attempt in range(tries):
        rng = random.Random(seed + attempt)
        tamper = Tamper(fault, rng.choice([0, 0, 1, 3, 6]))
        data = DynamicSynth(seed + attempt, tamper, most).stream()
        if tamper.done:
            return data, seed + attempt
    raise ValueError("no room for " + fault[0])


def first_error(data):
    errors = Decoder(data).decode().errors
    return errors[0].code if errors else None
