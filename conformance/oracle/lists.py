"""Clause 7.4: Gaussians, lists of them, parents, modes and moves; digests of lists."""

import struct
from collections import namedtuple

from .constants import FINE_BITS
from .conventions import Round, xxh64
from .errors import require
from .reconstruction import i32le

# 7.4.1; dc and sh are the integers of 7.7 and 7.8, anchor is 1 if the Gaussian was in the I frame of its GOP;
# motion and fade are 0 in I frames and of new Gaussians (SS-PA-007)
Gaussian = namedtuple("Gaussian", "position_fine q o rotation_fine dc sh anchor motion fade", defaults=((0, 0, 0), 0))

# 7.4.3
SKIP, MOVE, UPDATE, MOVE_AND_UPDATE, REMOVE = range(5)


def canonical(fine):
    """Canonical position or rotation of a fine one (7.4.1)."""
    return tuple(Round(x, FINE_BITS) for x in fine)


def position_limit(seq):
    """Largest position_fine."""
    return (2 ** seq.position_bits - 1) << FINE_BITS


# ---- 7.9 ----


def canonical_planes(gaussians, plane_count):
    """SS-DG-001: the canonical planes of a list of Gaussians."""
    rows = [canonical(g.position_fine) + tuple(g.q) + (g.o,) + canonical(g.rotation_fine)
            + tuple(g.dc) + tuple(g.sh) for g in gaussians]
    if not rows:
        return [[] for _ in range(plane_count)]
    return [list(plane) for plane in zip(*rows)]


def lists_digest(lists, plane_count):
    """SS-DG-003"""
    digests = [xxh64(p, i32le(plane)) for gaussians in lists
               for p, plane in enumerate(canonical_planes(gaussians, plane_count))]
    return xxh64(0, struct.pack("<%dQ" % len(digests), *digests))


# ---- 7.4.3 ----


def check_modes(modes, increment, intra_frame, at):
    for mode in modes:                                                                # SS-PA-002
        require(SKIP <= mode <= REMOVE, "OUT_OF_RANGE", "7.4.3", at)
        require(mode != REMOVE or not intra_frame, "CONSTRAINT", "7.4.3", at)
    for element, of_it in (("move_count", (MOVE, MOVE_AND_UPDATE)),
                           ("update_count", (UPDATE, MOVE_AND_UPDATE)), ("remove_count", (REMOVE,))):
        count = sum(mode in of_it for mode in modes)                                  # SS-PA-003
        element_at = increment.at(element if increment.has(element) else "increment_flags")
        require(getattr(increment, element) == count, "MISMATCH", "7.4.3", element_at)


def survivors(parents, modes):
    """7.4.4: the parents that are not removed."""
    return [g for g, mode in zip(parents, modes) if mode != REMOVE]
