"""Clauses 7.3, 7.8 and 7.9: GOPs and frames, their references, levels, carried and shown lists."""

from itertools import takewhile

from . import constants as c
from .conventions import clamp, tz
from .lists import lists_digest


class Gop:
    """The GOP in progress: gop_header, and the frames whose frame_header was decoded, by their index in it."""

    def __init__(self, header, first_frame):
        self.predicted = header.gop_structure == 1
        self.depth = header.temporal_depth
        self.first_frame = first_frame
        self.frames = {}

    def order(self, number):
        """7.3.1: (frame type, temporal layer, index in the GOP of the reference frame or None)."""
        index = number - self.first_frame
        if not self.predicted or index == 0:
            return c.TYPE_I, 0, None
        z = min(tz(index), self.depth)
        layer = self.depth - z
        return c.TYPE_P if layer == 0 else c.TYPE_B, layer, index - 2 ** z


class Shown:
    """A shown frame (7.8.2): Gaussians in order, compensated; how many are exact and how many carried."""

    def __init__(self, exact=(), carried=()):
        self.exact = len(exact)
        self.carried = len(carried)
        self.gaussians = list(exact) + list(carried)


def compensated(gaussians, u, only_new=False):
    """SS-CA-004 with the elements of an increment, for all Gaussians or those with anchor 0."""
    def one(g):
        if only_new and g.anchor == 1:
            return g
        q = tuple(clamp(x + u.compensation_log_scale, c.VALUE_MIN, c.VALUE_MAX) for x in g.q)
        return g._replace(q=q, o=clamp(g.o + u.compensation_opacity, c.VALUE_MIN, c.VALUE_MAX))
    return [one(g) for g in gaussians]


class Frame:
    """A frame in progress or output: I frames of every GOP, P and B frames."""

    def __init__(self, number, header, gop, seq):
        self.number, self.header, self.gop, self.seq = number, header, gop, seq
        self.plane_count = 13 + seq.sh_planes
        self.index_in_gop = number - gop.first_frame
        self.frame_type, self.layer, reference = gop.order(number)
        self.intra = self.frame_type == c.TYPE_I
        self.reference = gop.frames.get(reference)  # None if absent
        self.anchor = self if self.intra else gop.frames.get(0)
        self.cells = None                           # of a P or B frame of which carried(ref) is available
        self.cell_models = {}                       # models in force for cells after the frame_header
        self.lists = {}                             # (s, h) -> Gaussians
        self.new = {}                               # r -> new Gaussians of unit (top, r) of a P or B frame
        self.moved = {}                             # r -> moves.Parents of unit (top, r) of a P or B frame
        self.records = {}                           # (s, r) -> elements of the unit
        self.models = {}                            # (s, r) -> models after the unit
        self.counts = [0] * seq.spatial_layer_count  # count(s)
        self.limit = self.first_limit()
        self.seen = False                           # an increment of the frame came
        self.faulty = False                         # an error was reported since its frame_header
        self.carried_lists = None                   # those of carried(), once needed

    def first_limit(self):
        """7.3.3: lists that the reference frame lacks cannot be decoded."""
        if self.intra:
            return self.seq.refinement_count
        return 0 if self.reference is None else self.reference.level()

    # ---- 7.1.4, 7.4, 7.7.1: increments ----

    def expects(self, s, r):
        """SS-BS-004"""
        if not self.intra:
            return s == self.seq.top and r == self.counts[s]
        no_higher_layer = not any(self.counts[s + 1:])
        return no_higher_layer and r == self.counts[s] and (s == 0 or self.counts[s - 1] > r)

    def decoded_of(self, s):
        """Units that were decoded of layer s, in a P or B frame of its only layer."""
        return self.counts[s if self.intra else self.seq.top]

    def accept(self, increment):
        s, r = increment.s, increment.r
        self.lists[(s, r)] = increment.list
        self.new[r] = increment.new
        self.moved[r] = increment.parents
        self.models[(s, r)] = increment.models
        self.records[(s, r)] = increment.header
        self.counts[s] += 1

    def models_in_force(self, s, r):
        """SS-PM-001"""
        if r > 0:
            return self.models[(s, r - 1)]
        if self.intra:
            return {} if s == 0 else self.models[(s - 1, 0)]
        return self.reference.models[(self.seq.top, 0)]

    def origins(self, s, r):
        """The parents of a unit as they are before the cells displace them"""
        if self.intra:
            return self.lists[(s - 1, r)] if s > 0 else []
        return self.reference.lists[(self.seq.top, r)]

    def parents(self, s, r):
        """SS-PA-001"""
        origins = self.origins(s, r)
        return origins if self.intra else [self.cells.displaced(g) for g in origins]

    def span(self):
        """7.4.6, of a P or B frame"""
        return self.index_in_gop - self.reference.index_in_gop

    def gap(self):
        """SS-PA-008, of a P or B frame: 0 where the reference frame is an I frame, of which nothing is scaled"""
        return 0 if self.reference.intra else tz(self.reference.span() // self.span())

    def reference_set(self, s, r, parents):
        """SS-PR-001; `parents` are those of the unit after moves and updates."""
        result = []
        if self.intra:
            for h in range(r):
                result += self.lists[(s, h)]
            return result + parents
        top = self.seq.top
        for h in range(r + 1):
            result += [self.cells.displaced(g) for g in self.reference.lists[(top, h)]]
        if self.seq.whole_anchor:
            for h in range(r + 1, self.seq.refinement_count):
                result += self.anchor.lists[(top, h)]
        for h in range(r):
            result += self.new[h]
        return result

    def refinement_digest(self, s, r, gaussians):
        """SS-DG-004, `gaussians` being list r."""
        return lists_digest([self.lists[(s, h)] for h in range(r)] + [gaussians], self.plane_count)

    # ---- 7.3.3: levels ----

    def level(self):
        """SS-LO-004"""
        top, R = self.seq.top, self.seq.refinement_count
        if self.intra and self.seq.whole_anchor:
            return R if all(count == R for count in self.counts) else 0
        return self.counts[top]

    # ---- 7.8.1: carried lists ----

    def best(self, h):
        """best(h): the largest s with count(s) > h, of an I frame."""
        return max(s for s, count in enumerate(self.counts) if count > h)

    def path(self):
        """This frame, its reference frame, and so on; the last one has no reference frame."""
        frame = self
        while frame is not None:
            yield frame
            frame = frame.reference

    def has_carried_reference(self):
        return self.reference is not None and self.reference.has_carried()

    def has_carried(self):
        """SS-CA-002: whether the carried lists are available"""
        *_, last = self.path()
        return last.intra and last.counts[0] > 0

    def carried(self):
        """SS-CA-001: the lists carried(t, 0..C-1) of a frame that has ended and of which they are available."""
        missing = list(takewhile(lambda frame: frame.carried_lists is None, self.path()))
        for frame in reversed(missing):
            frame.carried_lists = frame.carried_from_reference()
        return self.carried_lists

    def carried_from_reference(self):
        if self.intra:
            return [self.lists[(self.best(h), h)] for h in range(self.counts[0])]
        without_stale = self.level() > 0
        return [self.cells.carried(gaussians, without_stale) for gaussians in self.reference.carried_lists]

    def carried_digest(self):
        return lists_digest(self.carried(), self.plane_count)

    def shows_carried(self):
        return not self.intra and self.has_carried() and self.level() < self.anchor.counts[0]

    def compares_carried(self):
        """SS-DG-005: whether carried_digest is to be compared"""
        *between, first = self.path()
        complete = first.level() == self.seq.refinement_count and all(frame.level() > 0 for frame in between)
        return self.header.carried_digest is not None and self.shows_carried() and complete and not self.faulty

    # ---- 7.8.2 and 7.8.3: what is shown ----

    @property
    def lost(self):
        """SS-CA-002"""
        return not self.has_carried()

    def shown(self, subset=False):
        """SS-CA-003, SS-CA-004; `subset`: exact lists only, in P and B frames with a level above 0."""
        if self.lost:
            return Shown()
        level, last = self.level(), self.seq.refinement_count - 1
        if self.intra:
            return Shown(self.compensated_as_anchor(self.carried()))
        exact = [g for h in range(level) for g in self.lists[(self.seq.top, h)]]
        hidden = subset and level > 0
        carried = [] if hidden else self.anchor.compensated_as_anchor(self.carried()[level:])
        if 0 < level <= last:
            only_new = self.shows_carried() and not hidden
            exact = compensated(exact, self.records[(self.seq.top, level - 1)], only_new)
        return Shown(exact, carried)

    def compensated_as_anchor(self, lists):
        """The Gaussians of lists, compensated as the I frame is."""
        gaussians = [g for one in lists for g in one]
        r = self.counts[0] - 1
        if r == self.seq.refinement_count - 1:
            return gaussians
        return compensated(gaussians, self.records[(self.best(r), r)])

    def exact_lists(self):
        """The exact lists that are shown."""
        if self.intra:
            return self.carried()
        return [self.lists[(self.seq.top, h)] for h in range(self.level())]
