"""Streams at the limit of A.2 on predictor 3 (SS-PR-004): hundreds of thousands of equal Gaussians in a few bytes."""

import struct

from oracle import constants as c, models as pm
from oracle.conventions import bl, ceil_div
from oracle.decoding import Decoder
from oracle.lists import Gaussian, lists_digest
from .elements import INCREMENT, Elements
from .encoding import Bits, file_header, section
from .learned import SMALL, LearnedSynth
from .units import stream_of, units_of

TOO_MANY = c.MAX_LEARNED[1] + 1
BLOCK_LOG2 = 16
ASKED = {**SMALL, "percent": [100], "most": 3, "degree": 0, "block_log2": BLOCK_LOG2, "complete": True}
RAW_TOKEN = 8                                       # with direct_log2 2 the values 4 and -5, told apart by a raw bit


def constant_section(planes, values, count):
    """A section all of whose entries are equal; values: that of each plane, 0 in one that is not signed.

    Opacities cost a raw bit each, because SS-IN-009 asks for a byte for 16 new Gaussians.
    """
    bits = Bits()
    for plane, value in zip(planes, values):
        raw = plane.attribute == "opacity"
        bits.u(0, 1)                                # reuse
        if plane.alphabet == "signed":
            bits.se(value - 4 if raw else value)    # bias
        bits.u(0, 3 + 4)                            # direct_log2_minus2, source_a
        bits.u(1 if raw else 0, 2)                  # table_kind
        if raw:
            bits.u(0, 1)                            # is_reference
            bits.u(RAW_TOKEN, bl(plane.largest_token(2)))
    sizes = [min(2 ** BLOCK_LOG2, count - start) for start in range(0, count, 2 ** BLOCK_LOG2)]
    raw_bits = any(plane.attribute == "opacity" for plane in planes)
    blocks = [b"\x00" + struct.pack("<I", c.STATE_LOW) + bytes(ceil_div(n, 8) * raw_bits) for n in sizes]
    return section(0, bits.bytes(), blocks)


def increment(parent_count, dc_rank, digest):
    """TOO_MANY new Gaussians with predictor 3 at the origin, parents as they are."""
    u = Elements(INCREMENT, refinement_digest=digest, parent_count=parent_count, new_count=TOO_MANY,
                 predictor_block_log2=BLOCK_LOG2)
    u.increment_flags = u.needed()
    u.rest = constant_section(pm.section_planes("predictors", dc_rank, 0, 0, 0), [3], ceil_div(TOO_MANY, 2 ** BLOCK_LOG2))
    planes = pm.section_planes("new", dc_rank, 0, 0, 0)
    u.rest += constant_section(planes, [0] * len(planes), TOO_MANY)
    return u.bytes()


def limit_stream(seed, gops, change):
    """The last frame_header and the last increment of a stream of level 1 replaced by those that change() gives."""
    data = LearnedSynth(seed, {**ASKED, "gops": gops}).stream()
    decoder = Decoder(data).decode()
    frame = decoder.frames[-1]
    _, units = units_of(data)
    units = [u for u in units if u.kind != c.UT_POINTS]
    last_frame = max(i for i, u in enumerate(units) if u.kind == c.UT_FRAME)
    last = max(i for i, u in enumerate(units) if u.kind == c.UT_INCREMENT)
    parents = 0 if frame.intra else units[last].get("parent_count")
    units[last_frame].set("gaussian_count", parents + TOO_MANY)
    units[last].payload = change(decoder, frame, parents)
    return stream_of(file_header(c.PROFILE_DYNAMIC, 1), units)


def over_limit(seed):
    """One new Gaussian too many; its digest would be found to be wrong later."""
    def change(decoder, frame, parents):
        return increment(parents, decoder.state.dc_transform[frame.header.dc_transform_id].rank, 0)
    return limit_stream(seed, [(1, 0, 2)], change)


def empty_reference_set(seed):
    """As many in an I frame: without a reference set none of them is decoded with predictor 3."""
    def change(decoder, frame, parents):
        transform = decoder.state.dc_transform[frame.header.dc_transform_id]
        g = Gaussian((0, 0, 0), (0, 0, 0), 0, (0, 0, 0), tuple(transform.mean), (), 1)
        return increment(parents, transform.rank, lists_digest([[g] * TOO_MANY], 13))
    return limit_stream(seed, [(0, 0, 1)], change)
