"""Clause 7.14: Gaussians of profile 1, homes, parents, modes and moves; lists of them as canonical planes."""

from collections import namedtuple

from constants import FINE_BITS
from conventions import Round, xxh64
from errors import require
from reconstruction import frame_digest, unit_digests

# 7.14.1; dc and sh are the integers of 7.7 and 7.8
Gaussian = namedtuple("Gaussian", "position_fine q o rotation_fine dc sh anchor")

# 7.14.3
SKIP, MOVE, UPDATE, MOVE_AND_UPDATE, REMOVE = range(5)


def canonical(fine):
    """Canonical position or rotation of a fine one (7.14.1)."""
    return tuple(Round(x, FINE_BITS) for x in fine)


def position_limit(seq):
    """Largest position_fine."""
    return (2 ** seq.position_bits - 1) << FINE_BITS


# ---- 7.9 and 7.18.4 ----


def canonical_planes(gaussians, plane_count):
    """The canonical planes of a list of Gaussians."""
    rows = [canonical(g.position_fine) + tuple(g.q) + (g.o,) + canonical(g.rotation_fine)
            + tuple(g.dc) + tuple(g.sh) for g in gaussians]
    if not rows:
        return [[] for _ in range(plane_count)]
    return [list(plane) for plane in zip(*rows)]


def lists_digest(lists, plane_count):
    """SS-DG-004; of no lists: xxh64 of no bytes with seed 0 (SS-DG-006)."""
    if not lists:
        return xxh64(0, b"")
    return frame_digest([unit_digests(canonical_planes(l, plane_count)) for l in lists])


# ---- 7.14.3 ----


def check_modes(modes, increment, intra_frame, at):
    """SS-PA-002 and SS-PA-003, in the order of 8.7."""
    for mode in modes:
        require(0 <= mode <= 4, "OUT_OF_RANGE", "7.14", at)
    if intra_frame:
        for mode in modes:
            require(mode != REMOVE, "CONSTRAINT", "7.14", at)
    for element, of_it in (("move_count", (MOVE, MOVE_AND_UPDATE)),
                           ("update_count", (UPDATE, MOVE_AND_UPDATE)), ("remove_count", (REMOVE,))):
        count = sum(mode in of_it for mode in modes)
        require(getattr(increment, element) == count, "MISMATCH", "7.14", increment.at(element))


def moved(parents, modes, v_move, position_shift, seq, at):
    """SS-PA-004 and SS-PA-005: the parents after their moves; v_move are three planes."""
    movers = [i for i, mode in enumerate(modes) if mode in (MOVE, MOVE_AND_UPDATE)]
    result = list(parents)
    limit = position_limit(seq)
    fine = [list(parents[i].position_fine) for i in movers]
    for a in range(3):
        for j in range(len(movers)):
            fine[j][a] += v_move[a][j] << (position_shift + FINE_BITS)
            require(0 <= fine[j][a] <= limit, "CONSTRAINT", "7.14", at)
    for j, i in enumerate(movers):
        result[i] = parents[i]._replace(position_fine=tuple(fine[j]))
    return result


def survivors(parents, modes):
    """7.14.4: the parents that are not removed."""
    return [g for g, mode in zip(parents, modes) if mode != REMOVE]
