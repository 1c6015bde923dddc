"""Mutations of whole streams of profile 1: units lost, damaged, misplaced, or with one wrong element.

A mutation is a row of MUTATIONS: name, code of the first error (None: whatever the decoder finds), and a function of
the units and a random generator, which returns new units or None where it cannot be made. Check sums, index and
end unit are made right again, so that the fault itself is what is found.
"""

import random
import struct

import constants as c
from dynamic import Gop
from encoding import file_header, unit
from semantics import parse_file_header, parse_unit_header


class Unit:
    """A unit that can be changed; `damaged` flips a bit of the payload after the check sum was made."""

    def __init__(self, header, payload):
        self.kind, self.flags = header.unit_type, header.unit_flags
        self.s, self.t, self.r = header.spatial_layer, header.temporal_layer, header.refinement
        self.frame, self.payload = header.frame, payload
        self.damaged = False

    def copy(self):
        other = Unit.__new__(Unit)
        other.__dict__.update(self.__dict__)
        return other

    def bytes(self):
        data = unit(self.kind, self.payload, self.frame, self.r, self.flags, self.s, self.t)
        if self.damaged:
            data = data[:-1] + bytes([data[-1] ^ 0x10])
        return data

    def patch(self, at, fmt, value):
        """Sets an element of the payload."""
        payload = bytearray(self.payload)
        struct.pack_into("<" + fmt, payload, at, value)
        self.payload = bytes(payload)


def units_of(data):
    profile = parse_file_header(data).profile
    pos, units = 16, []
    while pos < len(data):
        header = parse_unit_header(data, pos, 0, profile)
        units.append(Unit(header, bytes(data[header.payload_start:header.end])))
        pos = header.end
    return data[:16], units


def stream_of(head, units, keep_end=False):
    """The bytes, with entries of the index and the elements of the end unit made right."""
    out, gops, index_offset = bytearray(head), [], 0
    for count, u in enumerate(units):
        if u.kind == c.UT_GOP:
            gops.append((u.frame, len(out)))
        if u.kind == c.UT_INDEX and not keep_end:
            index_offset = len(out)
            u = u.copy()
            u.payload = struct.pack("<I", len(gops)) + b"".join(struct.pack("<IIQ", f, 0, at) for f, at in gops)
        if u.kind == c.UT_END and not keep_end:
            u = u.copy()
            frames = sum(v.kind == c.UT_FRAME for v in units[:count])
            u.payload = struct.pack("<IIQ", frames, count, index_offset)
        out += u.bytes()
    return bytes(out)


# ---- building blocks ----


def pick(units, rng, test):
    places = [i for i, u in enumerate(units) if test(u)]
    return rng.choice(places) if places else None


def is_increment(u):
    return u.kind == c.UT_INCREMENT


def of_kind(kind):
    return lambda u: u.kind == kind


def changed(test, change):
    """A mutation that changes one unit for which test holds."""
    def mutate(units, rng):
        i = pick(units, rng, test)
        if i is None:
            return None
        u = units[i].copy()
        if change(u, rng) is False:
            return None
        return units[:i] + [u] + units[i + 1:]
    return mutate


def header_set(**values):
    def change(u, rng):
        u.__dict__.update(values)
    return change


def patched(at, fmt, value):
    def change(u, rng):
        u.patch(at, fmt, value)
    return change


def damage(u, rng):
    u.damaged = True
    return len(u.payload) > 0


def lose(test):
    def mutate(units, rng):
        i = pick(units, rng, test)
        return None if i is None else units[:i] + units[i + 1:]
    return mutate


def repeat(test):
    def mutate(units, rng):
        i = pick(units, rng, test)
        return None if i is None else units[:i] + [units[i]] + units[i:]
    return mutate


def exchange(units, rng):
    """Two increments that follow each other in one frame."""
    places = [i for i in range(len(units) - 1) if is_increment(units[i]) and is_increment(units[i + 1])
              and units[i].frame == units[i + 1].frame]
    if not places:
        return None
    i = rng.choice(places)
    return units[:i] + [units[i + 1], units[i]] + units[i + 2:]


def order_in(units, i):
    """(first frame of the GOP in which unit i stands, order of 7.13.1 as a function of the frame number)."""
    u = next(u for u in reversed(units[:i]) if u.kind == c.UT_GOP)
    header = type("Header", (), {"gop_structure": u.payload[8], "temporal_depth": u.payload[9]})
    return u.frame, Gop(header, u.frame).order


def lose_reference(units, rng):
    """The frame_header and all increments of a predicted frame to which another one refers."""
    numbers = set()
    for i, u in enumerate(units):
        if u.kind == c.UT_FRAME:
            first, order = order_in(units, i)
            place = order(u.frame)[2]
            if place:                               # neither None nor the first frame
                numbers.add(first + place)
    if not numbers:
        return None
    number = rng.choice(sorted(numbers))
    return [u for u in units if not (u.kind in (c.UT_FRAME, c.UT_INCREMENT) and u.frame == number)]


def lose_first_frame(units, rng):
    i = pick(units, rng, lambda u: u.kind == c.UT_GOP and u.payload[8] == 1)
    if i is None:
        return None
    end = next(k for k in range(i + 1, len(units)) if units[k].kind in (c.UT_GOP, c.UT_POINTS, c.UT_INDEX, c.UT_END))
    return units[:i + 1] + [u for u in units[i + 1:end] if u.kind not in (c.UT_FRAME, c.UT_INCREMENT, c.UT_CODEBOOK)] \
        + units[end:]


def lose_units_of_frame(units, rng):
    i = pick(units, rng, of_kind(c.UT_FRAME))
    return None if i is None else [u for u in units if not (is_increment(u) and u.frame == units[i].frame)]


def several_losses(units, rng):
    """Three increments damaged or gone."""
    for _ in range(3):
        i = pick(units, rng, lambda u: is_increment(u) and not u.damaged)
        if i is None:
            return None
        u = units[i].copy()
        u.damaged = True
        units = units[:i] + ([u] if rng.random() < 0.7 else []) + units[i + 1:]
    return units


def inserted(make, before):
    """Puts a unit before one for which `before` holds."""
    def mutate(units, rng):
        i = pick(units, rng, before)
        if i is None:
            return None
        new = make(units, i)
        return None if new is None else units[:i] + [new] + units[i:]
    return mutate


def a_copy(kind, **values):
    def make(units, i):
        known = [u for u in units if u.kind == kind]
        if not known:
            return None
        u = known[0].copy()
        u.__dict__.update(values)
        return u
    return make


def refinement_unit(units, i):
    u = units[i].copy()
    u.kind, u.s, u.t = c.UT_REFINEMENT, 0, 0
    return u


def book_in_other_layer(units, rng):
    """A codebook defined again with another temporal_layer."""
    if units_parameters(units)[2] < 2:
        return None
    i = pick(units, rng, of_kind(c.UT_CODEBOOK))
    if i is None:
        return None
    u = units[i].copy()
    u.t = 1 - min(u.t, 1)
    return units[:i + 1] + [u] + units[i + 1:]


def units_parameters(units):
    return next(u for u in units if u.kind == c.UT_SEQUENCE).payload


def layer_out(element, place):
    """A layer that is in 0..3 and not below the count of the sequence."""
    def mutate(units, rng):
        count = units_parameters(units)[place]
        if count == 4:
            return None
        return changed(is_increment, header_set(**{element: count}))(units, rng)
    return mutate


def other_layer(element):
    """A layer of an increment of a predicted frame that 7.13.1 does not give."""
    def mutate(units, rng):
        parameters = units_parameters(units)
        count = parameters[1 if element == "s" else 2]
        frames = {u.frame for u in units if u.kind == c.UT_FRAME and u.payload[0] != c.TYPE_I}
        if count == 1:
            return None

        def change(u, rng):
            setattr(u, element, (getattr(u, element) + 1) % count)
        return changed(lambda u: is_increment(u) and u.frame in frames, change)(units, rng)
    return mutate


def points_entry(at, fmt, value):
    def change(u, rng):
        if len(u.payload) < 28:
            return False
        u.patch(at, fmt, value(struct.unpack_from("<" + fmt, u.payload, at)[0]))
    return changed(of_kind(c.UT_POINTS), change)


def points_swapped(u, rng):
    if len(u.payload) < 52:
        return False
    u.payload = u.payload[:4] + u.payload[28:52] + u.payload[4:28] + u.payload[52:]


def noise(units, rng):
    """A few bits of a payload of an increment, with the check sum of the changed bytes."""
    i = pick(units, rng, lambda u: is_increment(u) and len(u.payload) > 60)
    if i is None:
        return None
    u = units[i].copy()
    payload = bytearray(u.payload)
    for _ in range(rng.randint(1, 3)):
        payload[rng.randrange(16, len(payload))] ^= 1 << rng.randrange(8)
    u.payload = bytes(payload)
    return units[:i] + [u] + units[i + 1:]


def predicted_gop(u):
    return u.kind == c.UT_GOP and u.payload[8] == 1


def intra_gop(u):
    return u.kind == c.UT_GOP and u.payload[8] == 0


def predicted_frame(u):
    return u.kind == c.UT_FRAME and u.payload[0] != c.TYPE_I


MUTATIONS = [
    ("increment-damaged", "CHECK_SUM", changed(is_increment, damage)),
    ("increment-damaged-in-p", "CHECK_SUM", changed(lambda u: is_increment(u) and len(u.payload) > 59, damage)),
    ("increment-lost", None, lose(is_increment)),
    ("increment-lost-2", None, lose(lambda u: is_increment(u) and u.r > 0)),
    ("several-losses", None, several_losses),
    ("several-losses-2", None, several_losses),
    ("increment-twice", "UNEXPECTED_UNIT", repeat(lambda u: is_increment(u) and len(u.payload) > 40)),
    ("increments-exchanged", "UNEXPECTED_UNIT", exchange),
    ("reference-lost", "UNDEFINED", lose_reference),
    ("first-frame-lost", "MISMATCH", lose_first_frame),
    ("frame-without-units", "CONSTRAINT", lose_units_of_frame),
    ("frame-header-lost", None, lose(predicted_frame)),
    ("frame-header-twice", None, repeat(of_kind(c.UT_FRAME))),
    ("frame-type", "MISMATCH", changed(predicted_frame, lambda u, rng: u.patch(0, "B", 3 - u.payload[0]))),
    ("frame-type-reserved", "RESERVED", changed(of_kind(c.UT_FRAME), patched(0, "B", 3))),
    ("frame-number", "MISMATCH", changed(is_increment, lambda u, rng: setattr(u, "frame", u.frame + 5))),
    ("frame-header-number", "MISMATCH", changed(of_kind(c.UT_FRAME), lambda u, rng: setattr(u, "frame", u.frame + 1100))),
    ("spatial-layer-4", "OUT_OF_RANGE", changed(is_increment, header_set(s=4))),
    ("temporal-layer-4", "OUT_OF_RANGE", changed(is_increment, header_set(t=4))),
    ("refinement-10", "OUT_OF_RANGE", changed(is_increment, header_set(r=10))),
    ("spatial-layer-count", "OUT_OF_RANGE", layer_out("s", 1)),
    ("temporal-layer-count", "OUT_OF_RANGE", layer_out("t", 2)),
    ("other-spatial-layer", "MISMATCH", other_layer("s")),
    ("other-temporal-layer", "MISMATCH", other_layer("t")),
    ("gop-structure", "RESERVED", changed(of_kind(c.UT_GOP), patched(8, "B", 2))),
    ("gop-depth-in-all-intra", "OUT_OF_RANGE", changed(intra_gop, patched(9, "B", 1))),
    ("gop-depth-4", "OUT_OF_RANGE", changed(predicted_gop, patched(9, "B", 4))),
    ("gop-reserved", "RESERVED_BITS", changed(of_kind(c.UT_GOP), patched(10, "B", 1))),
    ("gop-1025-frames", "OUT_OF_RANGE", changed(predicted_gop, patched(4, "I", 1025))),
    ("gop-frames-fewer", None, changed(of_kind(c.UT_GOP), patched(4, "I", 1))),
    ("transform-between-frames", "UNEXPECTED_UNIT", inserted(a_copy(c.UT_TRANSFORM), is_increment)),
    ("codebook-in-other-layer", "CONSTRAINT", book_in_other_layer),
    ("codebook-frame", "MISMATCH", changed(of_kind(c.UT_CODEBOOK), lambda u, rng: setattr(u, "frame", u.frame + 1))),
    ("codebook-within-frame", None, inserted(a_copy(c.UT_CODEBOOK), lambda u: is_increment(u) and u.r > 0)),
    ("refinement-unit", "UNEXPECTED_UNIT", inserted(refinement_unit, is_increment)),
    ("increment-in-phase-gop", "UNEXPECTED_UNIT", inserted(a_copy(c.UT_INCREMENT), of_kind(c.UT_TRANSFORM))),
    ("points-frames", "MISMATCH", points_entry(8, "I", lambda x: x + 1)),
    ("points-gaussians", "MISMATCH", points_entry(12, "Q", lambda x: x + 1)),
    ("points-bytes", "MISMATCH", points_entry(20, "Q", lambda x: x + 20)),
    ("points-reserved", "RESERVED_BITS", points_entry(7, "B", lambda x: 1)),
    ("points-layer-4", "OUT_OF_RANGE", points_entry(4, "B", lambda x: 4)),
    ("points-order", "CONSTRAINT", changed(of_kind(c.UT_POINTS), points_swapped)),
    ("points-count", "SHORT_SECTION", changed(of_kind(c.UT_POINTS),
                                              lambda u, rng: u.patch(0, "H", len(u.payload) // 24 + 1))),
    ("points-twice", "UNEXPECTED_UNIT", repeat(of_kind(c.UT_POINTS))),
    ("layers-5", "OUT_OF_RANGE", changed(of_kind(c.UT_SEQUENCE), patched(1, "B", 5))),
    ("noise-1", None, noise), ("noise-2", None, noise), ("noise-3", None, noise), ("noise-4", None, noise),
]


def mutated(mutation, data, seed):
    """The mutated stream, or None if the mutation cannot be made in it."""
    head, units = units_of(data)
    units = mutation[2](units, random.Random(seed))
    return None if units is None else stream_of(head, units)


def profile_2(data):
    """RESERVED at `profile`, in a header that is otherwise right."""
    return file_header(2, data[11]) + data[16:]
