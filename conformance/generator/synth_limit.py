"""Streams at the limit of A.2 on predictor 3 (SS-PR-008): hundreds of thousands of equal Gaussians in a few bytes."""

import struct

import constants as c
import models as pm
from conventions import ceil_div, xxh64
from decoding import Decoder
from encoding import Bits, file_header, leb
from homes import Gaussian, lists_digest
from synth_learned import SMALL, LearnedSynth
from units import stream_of, units_of

TOO_MANY = c.MAX_LEARNED[1] + 1
BLOCK_LOG2 = 16
ASKED = {**SMALL, "percent": [100], "most": 3, "degree": 0, "block_log2": BLOCK_LOG2}


def constant_section(planes, values, count):
    """A section all of whose entries are equal; values: that of each plane, 0 in one that is not signed."""
    bits = Bits()
    for plane, value in zip(planes, values):
        bits.u(0, 1)                                # reuse
        if plane.alphabet == "signed":
            bits.se(value)                          # bias
        bits.u(0, 3 + 4 + 2)                        # direct_log2_minus2, source_a, table_kind
    block = leb(0) + struct.pack("<I", c.STATE_LOW)
    blocks = ceil_div(count, 2 ** BLOCK_LOG2)
    return b"\x00" + leb(len(bits.bytes())) + bits.bytes() + leb(len(block)) * blocks + block * blocks


def increment(parent_count, dc_rank, digest):
    """TOO_MANY new Gaussians with predictor 3 at the origin, parents as they are."""
    out = struct.pack("<QQ6IB5BBBBBBBB4Bbb", digest, xxh64(0, b""), parent_count, 0, 0, 0, 0, TOO_MANY, 0, *[0] * 5,
                      0, BLOCK_LOG2, 1, 0, 0, 0, 0, *[c.NONE_ID] * 4, 0, 0)
    if parent_count:
        out += constant_section(pm.section_planes("modes", dc_rank, 0, 0, 0), [0], parent_count)
    out += constant_section(pm.section_planes("predictors", dc_rank, 0, 0, 0), [3], ceil_div(TOO_MANY, 2 ** BLOCK_LOG2))
    planes = pm.section_planes("new", dc_rank, 0, 0, 0)
    return out + constant_section(planes, [0] * len(planes), TOO_MANY)


def limit_stream(seed, gops, change):
    """The last frame_header and the last increment of a stream of level 1 replaced by those that change() gives."""
    data = LearnedSynth(seed, {**ASKED, "gops": gops}).stream()
    decoder = Decoder(data).decode()
    frame = decoder.frames[-1]
    _, units = units_of(data)
    units = [u for u in units if u.kind != c.UT_POINTS]
    last_frame = max(i for i, u in enumerate(units) if u.kind == c.UT_FRAME)
    last = max(i for i, u in enumerate(units) if u.kind == c.UT_INCREMENT)
    parents = 0 if frame.intra else frame.increments[(0, 0)].parent_count
    units[last_frame].set("gaussian_count", parents + TOO_MANY)
    units[last].payload = change(decoder, frame, parents)
    return stream_of(file_header(c.PROFILE_DYNAMIC, 1), units)


def over_limit(seed):
    """One new Gaussian too many; its digest would be found to be wrong later."""
    def change(decoder, frame, parents):
        return increment(parents, decoder.dc_transform[frame.header.dc_transform_id].rank, 0)
    return limit_stream(seed, [(1, 0, 2)], change)


def empty_reference_set(seed):
    """As many in an I frame: without a reference set none of them is decoded with predictor 3."""
    def change(decoder, frame, parents):
        transform = decoder.dc_transform[frame.header.dc_transform_id]
        g = Gaussian((0, 0, 0), (0, 0, 0), 0, (0, 0, 0), tuple(transform.mean), (), 1)
        return increment(parents, transform.rank, lists_digest([[g] * TOO_MANY], 13))
    return limit_stream(seed, [(0, 0, 1)], change)
