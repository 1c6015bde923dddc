"""Random increments with correct counts and digests.

The values are chosen in the closed loop: the reconstruction of the decoder asks for the values of each attribute
after it has predicted it, and they are chosen within the ranges of clause 7.
"""

from oracle import models as pm
from oracle.constants import COMPONENT_MAX, OUTPUT_MAX
from oracle.conventions import Round, ceil_div
from oracle.increment import Increment
from oracle.lists import MOVE, MOVE_AND_UPDATE, REMOVE, SKIP, UPDATE, canonical, position_limit, survivors
from oracle.moves import moved
from oracle.steps import LOG_SCALE, StepRule
from .cells import morton
from .elements import INCREMENT, Elements
from .encoding import SectionEncoder, section

SECTIONS = ("modes", "move_predictors", "moves", "updates", "predictors", "new")
PREDICTORS = INCREMENT.bits["predictor_block_log2"]


class UnitOf:
    """The elements of a unit header that Increment needs."""

    def __init__(self, s, r, temporal_layer):
        self.spatial_layer, self.refinement, self.temporal_layer = s, r, temporal_layer


class IncrementWriter:
    """Writes unit (s, r) of the frame in progress of a decoder; `size` is that of the list after the unit."""

    predicting = True                               # whether predictors are among the tools

    def __init__(self, rng, frame, context, s, r, size, tamper=None):
        self.rng, self.frame, self.context = rng, frame, context
        self.seq = context.seq
        self.s, self.r, self.size = s, r, size
        self.tamper = tamper or (lambda stage, value, writer: value)
        self.v = dict.fromkeys(SECTIONS, ())        # section -> planes of values
        self.chosen = None                          # the section whose values are being chosen
        self.u = Elements(INCREMENT)

    def payload(self):
        u, frame = self.u, self.frame
        parents = frame.parents(self.s, self.r)
        self.size = self.tamper("size", self.size, self)
        u.parent_count = len(parents)
        self.choose_elements(len(parents))
        increment = Increment(UnitOf(self.s, self.r, frame.layer), frame, self.context)
        increment.header = u
        self.rule = StepRule(self.seq, u.attribute_step)
        modes = self.modes(parents)
        increment.find_parents(parents)
        parents = self.moves(increment, increment.extrapolated(parents), modes)
        self.v["updates"] = []
        parents = increment.updated(parents, modes, self.taker("updates"), 0) if u.update_count else parents
        parents = parents if frame.intra else increment.with_changes(parents, modes)
        kinds = self.predictors()
        self.v["new"] = []
        new = []
        if u.new_count:
            positions = self.positions(parents)
            new = self.reconstructed(increment, positions, kinds, parents)
        u.refinement_digest = frame.refinement_digest(self.s, self.r, survivors(parents, modes) + new)
        return self.bytes()

    def reconstructed(self, increment, positions, kinds, parents):
        return increment.new_gaussians(positions, kinds, parents, self.taker("new"), 0)

    # ---- 6.14 ----

    def choose_elements(self, parent_count):
        rng, u, seq = self.rng, self.u, self.seq
        u.position_shift = rng.choice([0, 0, 0, min(1, seq.position_bits - 1), rng.randint(0, seq.position_bits - 1)])
        u.attribute_step = rng.choice([[0] * 5, [rng.choice([0, 1, 2, 5, rng.randint(0, 24)]) for _ in range(5)]])
        u.compensation_log_scale = rng.choice([0, 0, 1, -3, 127, -128])
        u.compensation_opacity = rng.choice([0, 0, 2, -5, 127, -128])
        self.choose_sh_mode()
        removable = 0 if self.frame.intra else parent_count
        least = max(0, parent_count - self.size)    # removed at least; so many new ones more for each other one
        u.remove_count = rng.choice([least, least, rng.randint(least, max(least, removable // 3))])
        u.new_count = self.size - (parent_count - u.remove_count)
        self.choose_predictors()
        if self.predicting and not self.frame.intra:
            u.move_block_log2 = rng.choice([None, 0, 0, 1, 2, 3, 16])
            u.extrapolates_opacity = int(rng.random() < 0.5)

    def choose_sh_mode(self):
        rng, u = self.rng, self.u
        u.sh_mode, u.codebook_ids = 0, []
        if self.context.sh_transform is not None:
            u.sh_mode = rng.choice([0, 1, 1, 2, 2])
        if u.sh_mode == 2:
            books = [b for b, v in self.context.codebooks.items()
                     if v.component_count == self.context.sh_transform.rank and v.temporal_layer <= self.frame.layer]
            if books:
                u.codebook_ids = [rng.choice(books) for _ in range(rng.randint(1, 4))]
            else:
                u.sh_mode = 1
        u.vq_stage_count = len(u.codebook_ids)

    def choose_predictors(self):
        rng, u = self.rng, self.u
        if u.new_count and self.predicting:
            u.predictor_block_log2 = rng.choice([None, 0, 1, 2, 3, 4, 6, 16])
            u.neighbour_count = rng.randint(1, 16)
            u.bilateral_spatial = rng.choice([0, 1, 8, 40, 255])
            u.bilateral_feature = rng.choice([0, 1, 5, 64, 255])

    def choose_flags(self):
        """The parts that are needed, and some whose elements are what they would be if absent."""
        free = sum(1 << INCREMENT.bits[name] for name in ("position_shift", "attribute_step", "compensation_opacity")
                   if self.rng.random() < 0.1)
        self.u.increment_flags = self.u.needed() | free

    # ---- 7.14.3 ----

    def mode_weights(self):
        return self.rng.choice([(1, 0, 0, 0), (4, 1, 1, 1), (0, 1, 1, 1), (8, 0, 1, 0), (8, 1, 0, 0)])

    def modes(self, parents):
        rng, u, weights = self.rng, self.u, self.mode_weights()
        modes = rng.choices((SKIP, MOVE, UPDATE, MOVE_AND_UPDATE), weights, k=len(parents))
        for i in rng.sample(range(len(parents)), u.remove_count):
            modes[i] = REMOVE
        u.move_count = sum(m in (MOVE, MOVE_AND_UPDATE) for m in modes)
        u.update_count = sum(m in (UPDATE, MOVE_AND_UPDATE) for m in modes)
        self.v["modes"] = [modes] if u.move_count + u.update_count + u.remove_count else []
        if u.move_count == 0 or self.frame.intra:
            u.move_block_log2 = None
        u.extrapolates_opacity *= int(len(parents) > 0 and not self.frame.intra)
        return modes

    def moves(self, increment, parents, modes):
        """The parents after moves that are chosen one after the other, since each may predict those after it."""
        u, limit = self.u, position_limit(self.seq)
        step = u.position_shift + 6
        self.v["moves"], self.starts = [[], [], []], []
        planes = self.v["moves"]
        prediction = (increment.move_space(modes), self.move_predictors()) if u.predicts_moves else None

        def take(_, start):
            self.starts.append(start)               # where the moves start
            for a in range(3):
                low, high = -(start[a] >> step), (limit - start[a]) >> step
                planes[a].append(max(low, min(high, self.move(a))))
            return [plane[-1] for plane in planes]

        return moved(parents, modes, take, prediction, u, self.seq, 0)

    def move_predictors(self):
        count = ceil_div(self.u.move_count, 2 ** self.u.move_block_log2)
        values = self.rng.choices(range(4), self.move_predictor_weights(), k=count)
        self.v["move_predictors"] = [values]
        return values

    def move_predictor_weights(self):
        return self.rng.choice([(1, 1, 1, 1), (1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1)])

    def move(self, axis):
        reach = self.rng.choice([0, 1, 5, 300])
        return self.rng.randint(-reach, reach)

    # ---- 7.16 ----

    def taker(self, name):
        """A `take` of residuals.Residuals that chooses values and keeps them."""
        def take(attribute, predictions, factors):
            self.chosen = name
            rows = [self.choose(attribute, *one) for one in zip(predictions, factors)]
            planes = [list(plane) for plane in zip(*rows)] if rows and rows[0] else []
            self.v[name] = self.v[name] + planes
            return planes

        return take

    def choose(self, attribute, prediction, factor):
        """Values of one entry, which are multiplied by the factor (7.6.6)."""
        return getattr(self, "choose_" + attribute)(prediction, factor)

    def choose_log_scale(self, p, factor):
        if self.chosen == "updates":
            return self.choose_updated_log_scale(p, factor)
        rng = self.rng
        fresh = tuple(p) == (0, 0, 0)
        reach = min(rng.choice([0, 1, 4, 4, 40 if not fresh else 400]), 8000 // factor)
        v = [rng.randint(-reach, reach) for _ in range(3)]
        if rng.random() < 0.005:
            v = [rng.choice([30000, -30000, 9000]), rng.choice([0, 2000]), rng.choice([0, 2000])]
        q0 = p[0] + v[0] * factor
        factor = self.rule.factor(LOG_SCALE, [q0])
        d = [p[0] - p[1] + v[1] * factor, p[1] - p[2] + v[2] * factor]
        if self.seq.canonical_axes:                 # what would be negative becomes at least 0
            for k in (0, 1):
                more = ceil_div(max(0, -d[k]), factor)
                v[1 + k] += more
                d[k] += more * factor
        q = [q0, q0 - d[0], q0 - d[0] - d[1]]
        x = [q0 - p[0], v[1] * factor, v[2] * factor]
        return v if all(-32768 <= value <= 32767 for value in x + q) else [0, 0, 0]

    def choose_updated_log_scale(self, p, factor):
        """7.6.2, updates"""
        factors = [factor] + 2 * [self.rule.factor(LOG_SCALE, p)]
        reach = min(self.rng.choice([0, 1, 4, 4, 40]), 8000 // max(factors))
        v = [self.rng.randint(-reach, reach) for _ in range(3)]
        if self.rng.random() < 0.005:
            v[self.rng.randrange(3)] = self.rng.choice([30000, -30000, 9000])
        if self.seq.canonical_axes:                 # none becomes larger than the one before it
            for k in (1, 2):
                most = p[k - 1] + v[k - 1] * factors[k - 1] - p[k]
                v[k] = min(v[k], most // factors[k])
        x = [value * factor for value, factor in zip(v, factors)]
        q = [now + change for now, change in zip(p, x)]
        return v if all(-32768 <= value <= 32767 for value in x + q) else [0, 0, 0]

    def choose_opacity(self, p, factor):
        reach = min(self.rng.choice([0, 1, 6, 60]), max(1, 3000 // factor))
        v = self.rng.randint(-reach, reach)
        if self.rng.random() < 0.01:
            v = (self.rng.choice([-32767, 32767]) - p) // factor
        return [v if abs(p + v * factor) <= 32767 else 0]

    def choose_rotation(self, p, factor):
        result = []
        wild = self.rng.random() < 0.01
        for k in range(3):
            reach = 30000 if wild else self.rng.choice([0, 1, 3, 30])
            v = self.rng.randint(-reach, reach)
            result.append(v if abs(p[k] + (v * factor << 6)) <= 32767 * 64 else 0)
        return result

    def choose_components(self, rank, factor):
        reach = min(self.rng.choice([0, 1, 2, 2, 9, 200]), COMPONENT_MAX // factor)
        return [self.rng.randint(-reach, reach) for _ in range(rank)]

    def choose_dc(self, p, factor):
        transform = self.context.dc_transform
        v = self.choose_components(transform.rank, factor)
        for j in range(3):                          # SS-RC-006
            total = sum(transform.basis[k * 3 + j] * (v[k] * factor) for k in range(transform.rank))
            if abs(p[j] + Round(total, 6)) > OUTPUT_MAX:
                return [0] * transform.rank
        return v

    def choose_sh(self, p, factor):
        if self.u.sh_mode == 0:
            return []
        if self.u.sh_mode == 1:
            return self.choose_components(self.context.sh_transform.rank, factor)
        books = [self.context.codebooks[b] for b in self.u.codebook_ids]
        for _ in range(4):
            v = [self.rng.randrange(book.entry_count) for book in books]
            if all(abs(x) * factor <= COMPONENT_MAX for x in looked_up(books, v)):
                return v
        return [0] * len(books)                     # entries of zeros

    # ---- 7.17.2, 7.16.4 ----

    def predictors(self):
        u = self.u
        if u.predictor_block_log2 is None:
            self.v["predictors"] = []
            return []
        count = ceil_div(u.new_count, 2 ** u.predictor_block_log2)
        values = self.rng.choices((0, 1, 2), self.predictor_weights(), k=count)
        self.v["predictors"] = [values]
        return values

    def predictor_weights(self):
        return self.rng.choice([(1, 1, 1), (0, 1, 0), (0, 0, 1), (1, 3, 3)])

    def positions(self, parents):
        """Canonical positions in coded order; some of them near or at Gaussians of the reference set."""
        shift, bits = self.u.position_shift, self.seq.position_bits - self.u.position_shift
        near = [canonical(g.position_fine) for g in self.frame.reference_set(self.s, self.r, parents)]
        codes = [morton(self.position(near, bits, shift), bits) for _ in range(self.u.new_count)]
        return self.in_blocks(codes)

    def in_blocks(self, codes):
        """Keeps the deltas of codes, sorted inside each block; gives the canonical positions."""
        shift, bits = self.u.position_shift, self.seq.position_bits - self.u.position_shift
        deltas, positions, size = [], [], self.block_size()
        for start in range(0, len(codes), size):
            block = sorted(codes[start:start + size])
            deltas += [b - a for a, b in zip([0] + block, block)]
            for code in block:
                X = [sum(((code >> (3 * b + a)) & 1) << b for b in range(bits)) for a in range(3)]
                positions.append(tuple((x << shift) + ((1 << shift) >> 1) for x in X))
        self.v["new"] = [deltas]
        return positions

    def position(self, near, bits, shift):
        """Grid position of a new Gaussian, anywhere or near one of a list of positions."""
        rng = self.rng
        if near and rng.random() < 0.6:
            reach = rng.choice([0, 0, 1, 9])
            return [max(0, min(2 ** bits - 1, (x >> shift) + rng.randint(-reach, reach))) for x in rng.choice(near)]
        return [rng.randrange(2 ** bits) for _ in range(3)]

    # ---- 5.14, 5.15 ----

    def block_size(self):
        return 2 ** self.seq.block_log2

    def bytes(self):
        self.choose_flags()
        u = self.tamper("elements", self.u, self)
        in_force = self.frame.models_in_force(self.s, self.r)
        u.rest = b"".join(self.section(name, self.v[name], in_force.get(name))
                          for name in SECTIONS if self.v[name] and self.v[name][0])
        return self.tamper("payload", u.bytes(), self)

    def choose_lanes(self, count):
        return self.rng.choice([0, 0, 0, 0, 1, 2, 5 if count > 40 else 3])

    def planes(self, name):
        sh_rank = self.context.sh_transform.rank if self.context.sh_transform else 0
        return pm.section_planes(name, self.context.dc_transform.rank, self.u.sh_mode, sh_rank, self.u.vq_stage_count)

    def coder(self, planes, v, lanes_log2, in_force):
        available = self.tamper("available", pm.source_available, self)
        return SectionEncoder(self.rng, planes, v, self.block_size(), 2 ** lanes_log2, in_force, available, self.rule)

    def section(self, name, v, in_force):
        self.section_name = name
        v = self.tamper(name, v, self)
        in_force = self.tamper("in_force", in_force, self)
        lanes_log2 = self.choose_lanes(len(v[0]))
        coded = self.coder(self.planes(name), v, lanes_log2, in_force).run()
        models, blocks = self.tamper("coded", coded, self)
        return section(self.tamper("lanes", lanes_log2, self), models, blocks)


def looked_up(books, indices):
    """The sums of entries of codebooks (SS-SH-001), clamped."""
    columns = zip(*(book.values[index * book.component_count:(index + 1) * book.component_count]
                    for book, index in zip(books, indices)))
    return [max(-COMPONENT_MAX, min(COMPONENT_MAX, sum(column))) for column in columns]
