"""Clauses 7.13, 7.18 and 7.20: frames of profile 1, their references, levels, carried and shown lists."""

import constants as c
from conventions import clamp, tz
from homes import lists_digest


class Gop:
    """The GOP in progress in profile 1: gop_header and the frames whose frame_header was decoded, by place."""

    def __init__(self, header, first_frame):
        self.predicted = header.gop_structure == 1
        self.depth = header.temporal_depth
        self.first_frame = first_frame
        self.frames = {}

    def order(self, number):
        """7.13.1: (frame type, temporal layer, place of the reference frame or None)."""
        k = number - self.first_frame
        if not self.predicted or k == 0:
            return c.TYPE_I, 0, None
        z = min(tz(k), self.depth)
        layer = self.depth - z
        return c.TYPE_P if layer == 0 else c.TYPE_B, layer, k - 2 ** z


class Shown:
    """A shown frame (7.18.2): Gaussians in order, how many are exact, and compensation per Gaussian."""

    def __init__(self, exact=(), carried=(), compensation=(0, 0), compensated=lambda g: False):
        self.exact = len(exact)
        self.carried = len(carried)
        self.gaussians = []                         # q and o compensated
        for g in exact:
            self.gaussians.append(with_compensation(g, compensation) if compensated(g) else g)
        self.gaussians += carried


def with_compensation(g, compensation):
    """SS-CA-003"""
    log_scale, opacity = compensation
    q = tuple(clamp(x + log_scale, c.VALUE_MIN, c.VALUE_MAX) for x in g.q)
    return g._replace(q=q, o=clamp(g.o + opacity, c.VALUE_MIN, c.VALUE_MAX))


class DynamicFrame:
    """A frame of profile 1, in progress or output."""

    def __init__(self, number, header, gop, seq):
        self.number, self.header, self.seq = number, header, seq
        self.plane_count = 13 + seq.sh_planes
        self.gop = gop
        self.frame_type, self.layer, place = gop.order(number)
        self.intra = self.frame_type == c.TYPE_I
        self.reference = gop.frames.get(place)      # None if absent or not of the operating point
        self.anchor_frame = gop.frames.get(0)
        self.units_seen = 0                         # increments that stood, of whatever fate
        self.homes = {}                             # (s, h) -> Gaussians
        self.new = {}                               # r -> new Gaussians of unit r of a P or B frame
        self.cells = None
        self.carried_lists = []                     # carried(h) of 7.18.1
        self.decoded = []                           # pairs (s, r) in order
        self.increments = {}                        # (s, r) -> fixed part
        self.models = {}                            # (s, r) -> models after the unit
        self.dropping = False
        self.erroneous = False                      # an error of its own (SS-LO-005)

    # ---- 7.13.3 ----

    def passes_over(self, r):
        """Step 2"""
        if self.dropping:
            return True
        return not self.intra and self.reference_level() <= r < self.seq.refinement_count

    def expects(self, s, r):
        """Step 4"""
        if r >= self.seq.refinement_count:
            return False
        if not self.decoded:
            return (s, r) == (0 if self.intra else self.seq.top, 0)
        last_s, last_r = self.decoded[-1]
        following = (s, r) == (last_s, last_r + 1) or (self.intra and (s, r) == (last_s + 1, 0))
        return following and (not self.intra or s == 0 or (s - 1, r) in self.decoded)

    def models_in_force(self, s, r):
        """SS-PM-010"""
        if r > 0:
            return self.models[(s, r - 1)]
        if self.intra:
            return {} if s == 0 else self.models[(s - 1, 0)]
        return self.reference.models[(self.seq.top, 0)]

    def parents_before_displacement(self, s, r):
        """SS-PA-001"""
        if not self.intra:
            return self.reference.homes[(self.seq.top, r)]
        return self.homes[(s - 1, r)] if s > 0 else []

    def reference_set(self, s, r, cells, parents):
        """SS-PR-001; `parents` are those of the unit after moves and updates."""
        result = []
        if self.intra:
            for h in range(r):
                result += self.homes[(s, h)]
            return result + parents
        top = self.seq.top
        for h in range(r + 1):
            result += [cells.displaced(g) for g in self.reference.homes[(top, h)]]
        for h in range(r + 1, self.seq.refinement_count):
            result += self.anchor_frame.homes[(top, h)]
        for h in range(r):
            result += self.new[h]
        return result

    def refinement_digest(self, s, r, home):
        """SS-DG-005, `home` being home r."""
        lists = [self.homes[(s, h)] for h in range(r)] + [home]
        return lists_digest(lists, self.plane_count)

    def carried(self, cells):
        """SS-CA-001: the carried list of each home; `cells` are those of this frame."""
        if self.intra:
            return [self.homes[(self.seq.top, h)] for h in range(self.seq.refinement_count)]
        before = self.reference.carried(None) if self.reference.intra else self.reference.carried_lists
        return [cells.carried(gaussians) for gaussians in before]

    def carried_digest(self, r, carried_lists):
        """SS-DG-006"""
        if self.intra:
            return lists_digest([], self.plane_count)
        return lists_digest(carried_lists[r + 1:], self.plane_count)

    def accept(self, s, r, increment, carried_lists):
        """Step 6"""
        self.homes[(s, r)] = increment.home
        self.new[r] = increment.new
        self.models[(s, r)] = increment.models
        self.increments[(s, r)] = increment.header
        self.cells = increment.cells
        self.carried_lists = carried_lists
        self.decoded.append((s, r))

    # ---- 7.20 ----

    def count(self, s):
        return sum(1 for pair in self.decoded if pair[0] == s)

    def level(self):
        """SS-LO-002"""
        if not self.intra:
            return len(self.decoded)
        complete = self.seq.spatial_layer_count * self.seq.refinement_count
        return self.seq.refinement_count if len(self.decoded) == complete else 0

    def reference_level(self):
        return 0 if self.reference is None else self.reference.level()

    def without_reference(self):
        """SS-LO-005: the frame ends now and no error of its own was reported."""
        return self.gop.predicted and not self.intra and self.level() == 0 and not self.erroneous

    # ---- 7.18.2, 7.20.1 and 7.20.3 ----

    def shown_at(self):
        """(s, r) of the exact Gaussians that are shown, None for a frame of which there are none."""
        if self.intra:
            if self.count(0) == 0:
                return None
            s = max(s for s in range(self.seq.spatial_layer_count) if self.count(s) == self.count(0))
            return s, self.count(0) - 1
        return (self.seq.top, self.level() - 1) if self.level() > 0 else None

    @property
    def lost(self):
        return self.shown_at() is None

    def shown(self, subset=False):
        at = self.shown_at()
        if at is None:
            if self.intra or self.reference is None:
                return Shown()
            return self.reference.shown(subset)     # SS-LO-004
        s, r = at
        exact = [g for h in range(r + 1) for g in self.homes[(s, h)]]
        carried = []
        if not self.intra and not subset:
            carried = [g for gaussians in self.carried_lists[r + 1:] for g in gaussians]
        compensation, compensated = (0, 0), lambda g: False
        if r < self.seq.refinement_count - 1:
            u = self.increments[(s, r)]
            compensation = (u.compensation_log_scale, u.compensation_opacity)
            everything = self.intra or subset
            compensated = lambda g: everything or g.anchor == 0
        return Shown(exact, carried, compensation, compensated)

    def shown_digests(self):
        """Digests of the exact homes and of the carried lists of the shown frame; (None, None) if lost."""
        at = self.shown_at()
        if at is None:
            return None, None
        s, r = at
        return self.refinement_digest(s, r, self.homes[(s, r)]), self.carried_digest(r, self.carried_lists)
