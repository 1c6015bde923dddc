"""Clauses 7.11 and 7.19: what belongs to an operating point; 6.16: what operating points cost."""

import constants as c
from errors import require
from reconstruction import prefix_count

EVERYTHING = (c.MAX_LAYERS - 1, c.MAX_LAYERS - 1, c.MAX_REFINEMENTS - 1)     # s3,t3,r9


def belongs(unit, point, seq, gop):
    """SS-OP-001; SS-OP-006 if `gop` is a GOP of profile 1, that in which the unit stands."""
    op_s, op_t, op_r = point
    if unit.temporal_layer > op_t or unit.spatial_layer > op_s:
        return False
    if unit.refinement <= op_r:
        return True
    return (gop is not None and unit.unit_type == c.UT_INCREMENT and gop.predicted
            and unit.frame == gop.first_frame and op_s >= seq.top)


class Ledger:
    """The units of known type among 2 to 6, 9 and 10 of a stream, for SS-PL-002."""

    def __init__(self):
        self.units = []                             # (unit, GOP or None)

    def add(self, unit, gop):
        if unit.known and unit.unit_type in (2, 3, 4, 5, 6, 9, 10):
            self.units.append((unit, gop))

    def frame_count(self, point, seq):
        return sum(1 for unit, gop in self.units
                   if unit.unit_type == c.UT_FRAME and belongs(unit, point, seq, gop))

    def byte_count(self, point, seq):
        return sum(unit.end - unit.start for unit, gop in self.units if belongs(unit, point, seq, gop))


def intra_gaussians(frame, seq, point):
    """Gaussians of a frame of profile 0 at an operating point."""
    r = min(point[2], frame.refinements - 1)
    return prefix_count(seq, frame.header.gaussian_count, r)


def exact_gaussians(frame, seq, point):
    """Exact Gaussians of a frame of profile 1 that was decoded without error, at an operating point."""
    op_s, op_t, op_r = point
    if frame.layer > op_t or (not frame.intra and seq.top > op_s):
        return 0                                    # its frame_header does not belong
    if frame.intra:
        whole = frame.gop.predicted and op_s >= seq.top
        counts = [frame.count(s) if whole else min(frame.count(s), op_r + 1) for s in range(min(op_s, seq.top) + 1)]
        s = max(s for s, count in enumerate(counts) if count == counts[0])
        return sum(len(frame.homes[(s, h)]) for h in range(counts[0]))
    return sum(len(frame.homes[(seq.top, h)]) for h in range(level_at(frame, seq, op_r)))


def level_at(frame, seq, op_r):
    """Level of a frame of a predicted GOP at an operating point of all spatial layers."""
    if frame.intra:
        return frame.level()
    return min(frame.level(), op_r + 1)


def check_points(entries, ledger, frames, seq, profile):
    """SS-PL-002, for a stream without errors so far."""
    for entry in entries:
        gaussians = exact_gaussians if profile == c.PROFILE_DYNAMIC else intra_gaussians
        expected = (("frame_count", ledger.frame_count(entry.point, seq)),
                    ("gaussian_count", sum(gaussians(frame, seq, entry.point) for frame in frames)),
                    ("byte_count", ledger.byte_count(entry.point, seq)))
        for element, value in expected:
            require(getattr(entry, element) == value, "MISMATCH", "6.16", entry.at(element))
