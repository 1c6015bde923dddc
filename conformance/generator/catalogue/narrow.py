"""Vectors that one check alone can notice: without it, or with it a little off, the stream passes or costs the same."""

from oracle import constants as c
from ..faults import (apply, changed, element, flipped, in_bytes, invalid, kept_end, kind, lost, lost_all, moved, payload,
                      repeated, together)
from ..synth.directed import directed
from ..synth.stream import Made
from ..synth.units import offset_of, units_of
from ..vector import Vector, seed_of
from .increments import predicted, remade
from .losses import GOP_AT, RESYNC, RESYNC_ASKED, Resync, in_gop
from .nested import NESTED
from .order import BOOKS, DEEP, LAYERS, header_of, increment
from .stream import one_frame
from .tools import ALL_TOOLS

INTRA, CELLS, SCENES = "stream-several-gops", "cells-whole-grid", "scene-all-parts"
INDEX, SCENE, FRAME = kind(c.UT_INDEX), kind(c.UT_SCENE), kind(c.UT_FRAME)


# ---- start inside a stream ----


def at_gop(number):
    """`inside` of a Vector: the offset of a gop_header, also of a damaged one whose extent is usable."""
    def find(data):
        head, units = units_of(data)
        return offset_of(head, units, GOP_AT(number)(units))
    return find


def at_place_of(number, parent):
    """`inside` of a Vector whose units have the places of its parent."""
    return lambda data: at_gop(number)(parent())


INSIDE = [
    ("inside-first-gop-damaged", 1, "CHECKSUM", "SS-ER-004",
     "the gop_header at which decoding starts is damaged: the next one gives next_gop and next_frame, and nothing is lost",
     flipped(GOP_AT(1))),
    ("inside-first-gop-header-damaged", 1, "CHECKSUM", "SS-ER-004",
     "header_check of the gop_header at which decoding starts is wrong: the next one is searched", flipped(GOP_AT(1), 6, 1)),
    ("inside-first-gop-structure-2", 1, "RESERVED", "SS-ER-004 SS-GH-002",
     "gop_structure of the gop_header at which decoding starts is 2: the next one gives next_gop and next_frame",
     element(GOP_AT(1), "gop_structure", 2)),
    ("inside-first-gop-long", 0, "TRAILING_BYTES", "SS-ER-004",
     "the gop_header at which decoding starts, the first one, has a byte too many: nothing is lost",
     payload(GOP_AT(0), lambda data: data + b"\x00")),
    ("inside-two-gops-damaged", 1, "CHECKSUM", "SS-ER-004",
     "the gop_header at which decoding starts and the next one are damaged", together(flipped(GOP_AT(1)), flipped(GOP_AT(2)))),
    ("inside-last-gop-damaged", 3, "CHECKSUM", "SS-ER-004",
     "the last gop_header, at which decoding starts, is damaged: no frame is output, and none is lost", flipped(GOP_AT(3))),
    ("inside-second-gop-damaged", 1, "CHECKSUM", "SS-ER-004 SS-ER-005",
     "the gop_header after the one at which decoding starts is damaged: its frames are lost", flipped(GOP_AT(2))),
    ("inside-index-frame-again", 2, "MISMATCH", "SS-IX-002", "frame of the second entry of the index is that of the first",
     kept_end(payload(INDEX, lambda data: data[:20] + data[4:8] + data[24:]))),
    ("inside-index-offset-again", 2, "MISMATCH", "SS-IX-002", "offset of the second entry of the index is that of the first",
     kept_end(payload(INDEX, lambda data: data[:28] + data[12:20] + data[36:]))),
]


# ---- bytes, parameters, order ----


def shifted_frames(number):
    """Every unit from a GOP on has a display index more."""
    def change(head, units):
        start = GOP_AT(number)(units)
        own = (c.UT_GOP, c.UT_TRANSFORM, c.UT_CODEBOOK, c.UT_WEIGHTS, c.UT_FRAME, c.UT_INCREMENT)
        return head, units[:start] + [u.copy(frame=u.frame + 1) if u.kind in own else u for u in units[start:]]
    return change


def spoilt_cells(select):
    """The last block of the cells of a frame_header has other bytes."""
    return payload(select, lambda data: data[:-4] + bytes(x ^ 0x5a for x in data[-4:]))


ROWS = [
    ("bytes", "bytes-version-changed", INTRA, "CHECKSUM", "SS-FH-002 SS-FH-005",
     "version_major is 7 and header_crc was not made again", in_bytes(lambda data: data[:8] + b"\x07" + data[9:])),
    ("bytes", "bytes-profile-changed", INTRA, "CHECKSUM", "SS-FH-002 SS-FH-005",
     "profile is 7 and header_crc was not made again", in_bytes(lambda data: data[:10] + b"\x07" + data[11:])),
    ("bytes", "bytes-signature-last-byte", INTRA, "SIGNATURE", "SS-FH-001", "the last byte of the signature is another one",
     in_bytes(lambda data: data[:7] + bytes([data[7] ^ 1]) + data[8:])),
    ("bytes", "bytes-signature-wrong-at-its-end-and-cut", INTRA, "SIGNATURE", "SS-FH-001",
     "eight bytes, of which the last is not that of the signature", in_bytes(lambda data: data[:7] + bytes([data[7] ^ 1]))),
    ("order", "order-gop-index-ahead", INTRA, "MISMATCH", "SS-BS-007 SS-GH-001 SS-ER-005",
     "gop_index of the second and third GOP is one more: both are decoded",
     together(*[element(GOP_AT(k), "gop_index", k + 1) for k in (1, 2)])),
    ("order", "order-gop-index-back", INTRA, "MISMATCH", "SS-BS-007 SS-GH-001 SS-ER-004",
     "gop_index of the third GOP is that of the second", element(GOP_AT(2), "gop_index", 1)),
    ("order", "order-gop-frame-ahead", INTRA, "MISMATCH", "SS-BS-007 SS-GH-001 SS-ER-005",
     "display indices from the second GOP on are one more: one is lost", shifted_frames(1)),
    ("order", "order-frame-back-in-predicted-gop", DEEP, "MISMATCH", "SS-BS-010",
     "frame of a frame_header of a predicted GOP is that of an earlier frame of its layer", changed(header_of(6), frame=2)),
    ("order", "order-frame-beyond-gop-in-its-layer", DEEP, "MISMATCH", "SS-BS-010",
     "frame of a frame_header is beyond its predicted GOP, in the temporal layer that it would have there",
     changed(header_of(7), frame=9)),
    ("order", "order-lower-layer-after-higher", LAYERS, "UNEXPECTED_UNIT", "SS-BS-004",
     "increment (0, 1) of an I frame comes after increment (1, 0)", moved(increment(0, 1, 0), increment(0, 1, 1))),
    ("order", "order-frame-without-units-then-damage", INTRA, "CONSTRAINT", "SS-BS-005 SS-ER-009",
     "an I frame has no increments, and the frame_header that ends it is damaged",
     together(lost(kind(c.UT_INCREMENT, nth=2)), flipped(kind(c.UT_FRAME, nth=3)))),
    ("order", "order-frame-without-units-then-codebook", BOOKS, "CONSTRAINT", "SS-BS-005 SS-CB-001",
     "an I frame has no increments, and the codebook that ends it is damaged",
     together(lost_all(lambda u: u.kind == c.UT_INCREMENT and u.frame == 0),
              flipped(lambda units: next(i for i, u in enumerate(units) if u.kind == c.UT_CODEBOOK and i > FRAME(units))))),
    ("order", "order-cells-without-reference", CELLS, "CHECKSUM", "SS-FR-008 SS-CA-002",
     "the first increment is damaged, and so are the cells of the P frame after it, which nobody decodes",
     together(flipped(increment(0, 0)), spoilt_cells(kind(c.UT_FRAME, nth=1)))),
    ("constraint", "constraint-increment-sum-below", DEEP, "MISMATCH", "SS-PA-006",
     "the lists of a P frame have one Gaussian less than gaussian_count",
     element(header_of(8), "gaussian_count", lambda x: x + 1)),
    ("stream", "stream-index-entry-left-out", INTRA, "MISMATCH", "SS-IX-001", "the index lacks its last entry",
     kept_end(together(element(INDEX, "entry_count", lambda x: x - 1), payload(INDEX, lambda data: data[:-16])))),
    ("stream", "stream-index-without-entries", INTRA, "MISMATCH", "SS-IX-001", "the index of three GOPs has no entries",
     kept_end(payload(INDEX, lambda data: bytes(4)))),
    ("stream", "scene-first-in-gop", SCENES, "UNEXPECTED_UNIT", "SS-SD-007 SS-BS-001",
     "the only scene_description stands after the gop_header", moved(SCENE, kind(c.UT_TRANSFORM))),
    ("stream", "scene-first-after-frame", SCENES, "UNEXPECTED_UNIT", "SS-SD-007 SS-BS-001",
     "the only scene_description stands before the end unit", moved(SCENE, kind(c.UT_END))),
    ("stream", "scene-damaged-then-good", SCENES, "CHECKSUM", "SS-SD-007 SS-ER-008",
     "a damaged scene_description and a good one, which comes too late: every frame is output",
     together(repeated(SCENE), flipped(SCENE))),
    ("stream", "scene-frame-then-good", SCENES, "OUT_OF_RANGE", "SS-SD-007 SS-UH-007 SS-ER-008",
     "a scene_description with frame 1 and a good one, which comes too late: every frame is output",
     together(repeated(SCENE), changed(SCENE, frame=1))),
    ("loss", "resync-gop-header-short-while-lost", RESYNC, "CHECKSUM", "SS-ER-004",
     "a transform is damaged, and the next gop_header has two bytes with a right checksum, so that it is not intact",
     together(flipped(in_gop(1, c.UT_TRANSFORM)), payload(GOP_AT(2), lambda data: data[:2]))),
    ("loss", "resync-gop-header-empty-while-lost", RESYNC, "CHECKSUM", "SS-ER-004",
     "a transform is damaged, and the next gop_header has no payload",
     together(flipped(in_gop(1, c.UT_TRANSFORM)), payload(GOP_AT(2), lambda data: b""))),
]


# ---- increments written again ----


def fewer_updates(u, w):
    u.update_count -= 1
    w.v["updates"] = [plane[:-1] for plane in w.v["updates"]]
    return u


def same_predictors(u):
    """Whether one more new Gaussian needs as many predictors."""
    return not u.predictors or u.new_count % 2 ** u.predictor_block_log2 > 0


def more_removed(u, w):
    """remove_count and new_count are one more, so that the size of the list is right."""
    u.set("remove_count", u.remove_count + 1)
    u.new_count += 1
    w.v["new"] = [plane + plane[-1:] for plane in w.v["new"]]
    return u


def little_below(v, w):
    """The first move ends less than 1000 below 0."""
    v[0][0] = -(w.starts[0][0] >> (w.u.position_shift + 6)) - 1
    return v


AGAIN = [
    ("prediction-increment-update-count", "MISMATCH", "SS-PA-003",
     "update_count and section updates are one less than the modes give",
     "elements", lambda u, w: u.update_count > 1, fewer_updates),
    ("prediction-increment-remove-count-of-right-size", "MISMATCH", "SS-PA-003",
     "remove_count is one more than the modes give, and so is new_count, so that the list has the right size",
     "elements", lambda u, w: predicted(u, w) and 0 < u.new_count and u.remove_count < u.parent_count and w.v["modes"]
      and same_predictors(u), more_removed),
    ("prediction-increment-move-little-below", "CONSTRAINT", "SS-PA-005", "a move ends less than 16 positions below 0",
     "moves", lambda v, w: bool(w.starts) and w.u.position_shift < 4, little_below),
]


# ---- carried_digest that is not compared ----

WRONG = lambda x: x ^ 1
CARRIED = [
    ("digest-carried-of-exact-frame", "nested-layers", 4,
     "carried_digest of a frame all of whose lists are exact is wrong, and not compared"),
    ("digest-carried-of-exact-frame-after-whole-anchor", "nested-whole-anchor", 4,
     "carried_digest of a frame is wrong, and compared at lower refinements alone, where the frame shows carried lists"),
    ("digest-carried-over-layers-that-fall", "nested-layers-fall", 4,
     "carried_digest over an I frame whose top layer stops early, and whose lowest does not, is wrong and not compared"),
    ("digest-carried-over-fewer-layers", "nested-i-frame-of-fewer-layers", 3,
     "carried_digest over an I frame without its top layer is wrong, and not compared"),
    ("digest-carried-at-level-0", "nested-frames-without-increments", 2,
     "carried_digest of a frame without increments is wrong, and not compared"),
]


def with_wrong_digest(name, frame):
    asked = next(row[3] for row in NESTED if row[0] == name)
    return apply(element(header_of(frame), "carried_digest", WRONG), directed(seed_of(name), **asked))


# ---- many Gaussians in few bytes ----

PADDED = "limit-new-count-in-more-lanes"
COUNTS = (("log_scale", 3), ("opacity", 1), ("rotation", 3), ("dc", 3))
PLANES = [(attribute, k) for attribute, count in COUNTS for k in range(count)]


def alike(total, lanes_log2, tamper=None):
    """A frame of Gaussians that are all the same, in one block: 35 bytes in one lane, 39 in two."""
    return one_frame(total, {plane: [0] * total for plane in PLANES}, codes=[0] * total, lanes_log2=lanes_log2,
                     block_log2=10, tamper=tamper)


def over_limit(parent):
    """The increment of 561 Gaussians in 35 bytes, which no decoder accepts."""
    try:
        alike(561, 0, ("payload", lambda data: data))
    except Made as made:
        return made.spliced(parent)
    raise ValueError("no increment")


def rows():
    limit = "SS-IN-009 SS-LM-001"
    yield Vector("valid", "limit", "limit-new-count-for-bytes-reached", "560 new Gaussians in an increment of 35 bytes", limit,
                 lambda: alike(560, 0), "given", 1)
    yield Vector("valid", "limit", PADDED, "561 new Gaussians in an increment of 39 bytes; the parent of an invalid vector",
                 limit, lambda: alike(561, 1), "given", 1)
    yield Vector("invalid", "limit", "limit-new-count-for-bytes-exceeded", None, limit, over_limit, "narrow", 1, PADDED,
                 "561 new Gaussians in an increment of 35 bytes, without another fault", "OVER_LIMIT")
    yield from (row for area, *one in ROWS for row in invalid(area, "narrow", [one]))
    parent, make = ALL_TOOLS[0][:2]
    for name, code, requirements, fault, *change in AGAIN:
        yield Vector("invalid", "prediction", name, None, requirements,
                     lambda data, code=code, change=change: remade(data, make, (code,), *change), "increments", 0, parent, fault,
                     code)
    for name, of, frame, purpose in CARRIED:
        yield Vector("valid", "temporal", name, purpose, "SS-DG-005", lambda of=of, frame=frame: with_wrong_digest(of, frame),
                     "directed", seed_of(of))
    whole = lambda: Resync(seed_of(RESYNC), **RESYNC_ASKED).stream()
    for name, number, code, requirements, fault, change in INSIDE:
        yield Vector("invalid", "stream", name, None, "SS-BS-012 " + requirements,
                     lambda data, change=change: apply(change, data), "losses", 0, RESYNC,
                     fault + ", and decoding starts at gop_header %d of 0 to 3" % number, code,
                     inside=at_place_of(number, whole))
