"""Clause 7.2: what belongs to an operating point; 6.16: what operating points cost."""

from . import constants as c
from .errors import require

EVERYTHING = (c.MAX_LAYERS - 1, c.MAX_LAYERS - 1, c.MAX_REFINEMENTS - 1)     # s3,t3,r9
COUNTED = (c.UT_GOP, c.UT_FRAME, c.UT_TRANSFORM, c.UT_CODEBOOK, c.UT_INCREMENT, c.UT_WEIGHTS)


def belongs(unit, point, seq, gop):
    """SS-OP-002; `gop` is the GOP in which the unit stands, or None."""
    op_s, op_t, op_r = point
    if unit.spatial_layer > op_s or unit.temporal_layer > op_t:
        return False
    if unit.refinement <= op_r:
        return True
    return (gop is not None and gop.predicted and unit.unit_type == c.UT_INCREMENT
            and keeps_anchor(seq, op_s) and unit.frame == gop.first_frame)


def keeps_anchor(seq, op_s):
    """Whether all units of the first frame of a predicted GOP belong, whatever op_r is."""
    return seq.whole_anchor == 1 and op_s >= seq.top


class Ledger:
    """The units of a stream that SS-PL-002 counts."""

    def __init__(self):
        self.units = []                             # (unit, GOP or None)

    def add(self, unit, gop):
        if unit.unit_type in COUNTED:
            self.units.append((unit, gop))

    def frame_count(self, point, seq):
        return sum(1 for unit, gop in self.units
                   if unit.unit_type == c.UT_FRAME and belongs(unit, point, seq, gop))

    def byte_count(self, point, seq):
        return sum(unit.end - unit.start for unit, gop in self.units if belongs(unit, point, seq, gop))


def exact_gaussians(frame, seq, point):
    """Exact Gaussians that are output at an operating point of a frame that was decoded without error."""
    op_s, op_t, op_r = point
    if frame.layer > op_t:
        return 0                                    # its frame_header does not belong
    if not frame.intra:
        level = min(frame.level(), op_r + 1) if op_s >= seq.top else 0
        return sum(len(frame.lists[(seq.top, h)]) for h in range(level))
    whole = frame.gop.predicted and keeps_anchor(seq, op_s)
    most = seq.refinement_count if whole else op_r + 1
    counts = [min(count, most) for count in frame.counts[:op_s + 1]]
    return sum(len(frame.lists[(max(s for s, count in enumerate(counts) if count > h), h)]) for h in range(counts[0]))


def check_points(entries, ledger, frames, seq):
    """SS-PL-002, for a stream without errors so far."""
    for entry in entries:
        expected = (("frame_count", ledger.frame_count(entry.point, seq)),
                    ("gaussian_count", sum(exact_gaussians(frame, seq, entry.point) for frame in frames)),
                    ("byte_count", ledger.byte_count(entry.point, seq)))
        for element, value in expected:
            require(getattr(entry, element) == value, "MISMATCH", "6.16", entry.at(element))
