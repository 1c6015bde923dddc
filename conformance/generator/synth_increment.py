"""Random increments of profile 1 with correct counts and digests, for synth_dynamic.py.

The values are chosen in the closed loop: the reconstruction of the decoder (increment.py, residuals.py) asks
for the values of each attribute after it has predicted it, and they are chosen within the ranges of clause 7.
"""

import struct

import models as pm
from cells import Cell, Cells
from constants import NONE_ID, OUTPUT_MAX, TURN_MAX
from conventions import Round, ceil_div
from encoding import SectionEncoder, leb
from homes import (MOVE, MOVE_AND_UPDATE, REMOVE, SKIP, UPDATE, canonical, moved, position_limit, survivors)
from increment import Increment
from semantics_dynamic import SECTIONS


class Fixed:
    """The elements of 5.14 before `sections`."""


class Place:
    """The elements of a unit header that Increment needs."""

    def __init__(self, s, r, temporal_layer):
        self.spatial_layer, self.refinement, self.temporal_layer = s, r, temporal_layer


def morton(coordinates, bits):
    return sum(((x >> b) & 1) << (3 * b + a) for a, x in enumerate(coordinates) for b in range(bits))


class IncrementWriter:
    """Writes unit (s, r) of the frame in progress of a decoder; `size` is that of the home after the unit."""

    def __init__(self, rng, frame, context, s, r, size, tamper=None):
        self.rng, self.frame, self.context = rng, frame, context
        self.seq = context.seq
        self.s, self.r, self.size = s, r, size
        self.tamper = tamper or (lambda stage, value, writer: value)
        self.v = {}                                 # section -> planes of values
        self.u = Fixed()

    def payload(self):
        u, frame = self.u, self.frame
        parents = frame.parents_before_displacement(self.s, self.r)
        self.choose_fixed(len(parents))
        increment = Increment(Place(self.s, self.r, frame.layer), frame, self.context)
        increment.header = u
        if not frame.intra and self.r == 0:
            increment.cells = self.cells()
        if not frame.intra:
            parents = [increment.cells.displaced(g) for g in parents]
        modes = self.modes(parents)
        parents = self.moves(parents, modes)
        self.v["updates"] = []
        parents = increment.updated(parents, modes, self.taker("updates"), 0) if u.update_count else parents
        kinds = self.predictors()
        self.v["new"] = []
        new = []
        if u.new_count:
            positions = self.positions(parents, increment.cells)
            new = increment.new_gaussians(positions, kinds, parents, self.taker("new"), 0)
        increment.home = survivors(parents, modes) + new
        u.refinement_digest = frame.refinement_digest(self.s, self.r, increment.home)
        lists = frame.carried_lists
        if self.r == 0 and not frame.intra:
            lists = frame.carried(increment.cells)
        u.carried_digest = frame.carried_digest(self.r, lists)
        return self.bytes()

    # ---- 6.14 ----

    def choose_fixed(self, parent_count):
        rng, u, seq = self.rng, self.u, self.seq
        self.size = self.tamper("size", self.size, self)
        u.parent_count = parent_count
        u.position_shift = rng.choice([0, 0, 0, min(1, seq.position_bits - 1), rng.randint(0, seq.position_bits - 1)])
        u.attribute_shift = [rng.choice([0, 0, 1, 2, rng.randint(0, 7)]) for _ in range(5)]
        u.cell_log2 = rng.randint(0, seq.position_bits)
        u.predictor_block_log2 = rng.choice([NONE_ID, 0, 1, 2, 3, 4, 6, 16])
        u.neighbour_count = rng.randint(1, 16)
        u.bilateral_spatial = rng.choice([0, 1, 8, 40, 255])
        u.bilateral_feature = rng.choice([0, 1, 5, 64, 255])
        u.compensation_log_scale = rng.choice([0, 1, -3, 127, -128])
        u.compensation_opacity = rng.choice([0, 2, -5, 127, -128])
        u.sh_mode, u.vq_stage_count, u.codebook_ids = 0, 0, []
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
        largest = sum(self.context.codebooks[b].largest for b in u.codebook_ids)
        while u.sh_mode == 2 and u.attribute_shift[4] and min(largest, 8191) << u.attribute_shift[4] > 8191:
            u.attribute_shift[4] -= 1
        u.codebook_ids = u.codebook_ids + [NONE_ID] * (4 - u.vq_stage_count)
        u.cell_count = u.move_count = u.update_count = 0
        removable = 0 if self.frame.intra else parent_count
        least = max(0, parent_count - self.size)    # removed at least; so many new ones more for each other one
        u.remove_count = rng.choice([least, least, rng.randint(least, max(least, removable // 3))])
        u.new_count = self.size - (parent_count - u.remove_count)

    # ---- 7.15.1 ----

    def cells(self):
        u, seq = self.u, self.seq
        cells = Cells(u.cell_log2, seq)
        bits = max(seq.position_bits - u.cell_log2, 1)
        codes = sorted(morton(X, bits) for X in self.cell_places(bits))
        u.cell_count = len(codes)
        planes = [[] for _ in range(8)]
        self.wild = self.rng.random() < 0.2
        for i, code in enumerate(codes):
            if i % self.block_size() == 0:
                before, translation, turn = 0, [0] * 3, [0] * 3
            new_translation, new_turn, stale = self.cell_values(i)
            # a value has 17 bits (8.1): what is farther takes several cells
            new_translation = [b + clamped(a - b, 32000) for a, b in zip(new_translation, translation)]
            row = [code - before, stale] + [a - b for a, b in zip(new_translation, translation)]
            row += [a - b for a, b in zip(new_turn, turn)]
            for plane, value in zip(planes, row):
                plane.append(value)
            before, translation, turn = code, new_translation, new_turn
            X = tuple(sum(((code >> (3 * b + a)) & 1) << b for b in range(bits)) for a in range(3))
            cells.by_place[X] = Cell(translation, turn, stale)
        self.v["cells"] = planes
        return cells

    def occupied(self):
        """Places of cells in which the reference frame or its carried lists have Gaussians."""
        reference, seq = self.frame.reference, self.seq
        lists = [reference.homes[(seq.top, h)] for h in range(reference.level())]
        lists += reference.carried(None) if reference.intra else reference.carried_lists
        return sorted({tuple(x >> self.u.cell_log2 for x in canonical(g.position_fine)) for l in lists for g in l})

    def cell_places(self, bits):
        """Some occupied cells, and sometimes two anywhere."""
        rng, occupied = self.rng, self.occupied()
        most = rng.choice([0, 1, 3, 8, 8, 20, 70])
        places = set(rng.sample(occupied, min(most, len(occupied))))
        for _ in range(rng.choice([0, 0, 2])):
            places.add(tuple(rng.randrange(2 ** bits) for _ in range(3)))
        return places

    def cell_values(self, i):
        """(translation, turn, stale) of cell i."""
        rng = self.rng
        reach, bend = rng.choice([0, 3, 40, 8 << self.u.cell_log2]), rng.choice([0, 0, 100, 2000])
        translation = [clamped(rng.randint(-reach, reach), 2 ** 20) for _ in range(3)]
        turn = [rng.randint(-bend, bend) for _ in range(3)]
        if self.wild and rng.random() < 0.3:
            translation = [rng.choice([-2 ** 20, 0, 2 ** 20, rng.randint(-2 ** 20, 2 ** 20)]) for _ in range(3)]
            turn = [rng.choice([-TURN_MAX, TURN_MAX, 0, 5792]) for _ in range(3)]
        return translation, turn, int(rng.random() < 0.3)

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
        self.v["modes"] = [modes]
        return modes

    def moves(self, parents, modes):
        u, limit = self.u, position_limit(self.seq)
        step = u.position_shift + 6
        planes = [[], [], []]
        for g, mode in zip(parents, modes):
            if mode in (MOVE, MOVE_AND_UPDATE):
                for a in range(3):
                    low, high = -(g.position_fine[a] >> step), (limit - g.position_fine[a]) >> step
                    planes[a].append(max(low, min(high, self.move(a))))
        self.v["moves"] = planes
        return moved(parents, modes, planes, u.position_shift, self.seq, 0) if u.move_count else parents

    def move(self, axis):
        reach = self.rng.choice([0, 1, 5, 300])
        return self.rng.randint(-reach, reach)

    # ---- 7.16 ----

    def taker(self, section):
        """A `take` of residuals.Residuals that chooses values and keeps them."""
        self.shifts = dict(zip(("log_scale", "opacity", "rotation", "dc", "sh"), self.u.attribute_shift))

        def take(attribute, p):
            rows = [self.choose(attribute, one, self.shifts[attribute]) for one in p]
            planes = [list(plane) for plane in zip(*rows)] if rows and rows[0] else []
            self.v[section] = self.v[section] + planes
            return planes

        return take

    def choose(self, attribute, prediction, shift):
        """Values of one entry."""
        return getattr(self, "choose_" + attribute)(prediction, shift)

    def choose_log_scale(self, p, shift):
        rng = self.rng
        fresh = p == (0, 0, 0)
        reach = rng.choice([0, 1, 4, 4, 40 if not fresh else 400])
        v = [rng.randint(-reach, reach) for _ in range(3)]
        if rng.random() < 0.005:
            v = [rng.choice([30000, -30000, 9000]), rng.choice([0, 2000]), rng.choice([0, 2000])]
        x = [value << shift for value in v]
        d1, d2 = p[0] - p[1] + x[1], p[1] - p[2] + x[2]
        if self.seq.canonical_axes:                 # what would be negative becomes at least 0
            v[1] += ceil_div(max(0, -d1), 1 << shift)
            v[2] += ceil_div(max(0, -d2), 1 << shift)
        x = [value << shift for value in v]
        q0 = p[0] + x[0]
        q1 = q0 - (p[0] - p[1] + x[1])
        q2 = q1 - (p[1] - p[2] + x[2])
        good = all(-32768 <= value <= 32767 for value in x + [q0, q1, q2])
        return v if good else [0, 0, 0]

    def choose_opacity(self, p, shift):
        reach = self.rng.choice([0, 1, 6, 60])
        v = self.rng.randint(-reach, reach)
        if self.rng.random() < 0.01:
            v = (self.rng.choice([-32767, 32767]) - p) >> shift
        return [v if abs(p + (v << shift)) <= 32767 else 0]

    def choose_rotation(self, p, shift):
        result = []
        wild = self.rng.random() < 0.01
        for k in range(3):
            reach = 30000 if wild else self.rng.choice([0, 1, 3, 30])
            v = self.rng.randint(-reach, reach)     # at most three coarser by 7.6
            result.append(v if abs(p[k] + (v << (3 + shift + 6))) <= 32767 * 64 else 0)
        return result

    def choose_components(self, rank, shift):
        reach = min(self.rng.choice([0, 1, 2, 2, 9, 200]), 8191 >> shift)
        return [self.rng.randint(-reach, reach) for _ in range(rank)]

    def choose_dc(self, p, shift):
        transform = self.context.dc_transform
        v = self.choose_components(transform.rank, shift)
        for j in range(3):                          # SS-RC-005
            total = sum(transform.basis[k * 3 + j] * (v[k] << shift) for k in range(transform.rank))
            if abs(p[j] + Round(total, 6)) > OUTPUT_MAX:
                return [0] * transform.rank
        return v

    def choose_sh(self, p, shift):
        if self.u.sh_mode == 0:
            return []
        if self.u.sh_mode == 1:
            return self.choose_components(self.context.sh_transform.rank, shift)
        return [self.rng.randrange(self.context.codebooks[b].entry_count)
                for b in self.u.codebook_ids[:self.u.vq_stage_count]]

    # ---- 7.17.2, 7.16.4 ----

    def predictors(self):
        u = self.u
        if u.predictor_block_log2 == NONE_ID or u.new_count == 0:
            self.v["predictors"] = [[]]
            return []
        count = ceil_div(u.new_count, 2 ** u.predictor_block_log2)
        values = self.rng.choices((0, 1, 2), self.predictor_weights(), k=count)
        self.v["predictors"] = [values]
        return values

    def predictor_weights(self):
        return self.rng.choice([(1, 1, 1), (0, 1, 0), (0, 0, 1), (1, 3, 3)])

    def positions(self, parents, cells):
        """Canonical positions in coded order; some of them near or at Gaussians of the reference set."""
        u = self.u
        shift, bits = u.position_shift, self.seq.position_bits - u.position_shift
        near = [canonical(g.position_fine) for g in self.frame.reference_set(self.s, self.r, cells, parents)]
        deltas, positions = [], []
        for start in range(0, u.new_count, self.block_size()):
            codes = []
            for _ in range(min(self.block_size(), u.new_count - start)):
                codes.append(morton(self.place(near, bits, shift), bits))
            codes.sort()
            deltas += [b - a for a, b in zip([0] + codes, codes)]
            for code in codes:
                X = [sum(((code >> (3 * b + a)) & 1) << b for b in range(bits)) for a in range(3)]
                positions.append(tuple((x << shift) + ((1 << shift) >> 1) for x in X))
        self.v["new"] = [deltas]
        return positions

    def place(self, near, bits, shift):
        """Lattice place of a new Gaussian, anywhere or near one of a list of positions."""
        rng = self.rng
        if near and rng.random() < 0.6:
            reach = rng.choice([0, 0, 1, 9])
            return [max(0, min(2 ** bits - 1, (x >> shift) + rng.randint(-reach, reach))) for x in rng.choice(near)]
        return [rng.randrange(2 ** bits) for _ in range(3)]

    # ---- 5.14, 5.15 ----

    def block_size(self):
        return 2 ** self.seq.block_log2

    def bytes(self):
        u = self.tamper("fixed", self.u, self)
        in_force = self.frame.models_in_force(self.s, self.r)
        out = struct.pack("<QQ6IB5BBBBBBBB4Bbb", u.refinement_digest, u.carried_digest, u.parent_count, u.cell_count,
                          u.move_count, u.update_count, u.remove_count, u.new_count, u.position_shift,
                          *u.attribute_shift, u.cell_log2, u.predictor_block_log2, u.neighbour_count,
                          u.bilateral_spatial, u.bilateral_feature, u.sh_mode, u.vq_stage_count, *u.codebook_ids,
                          u.compensation_log_scale, u.compensation_opacity)
        for name in SECTIONS:
            v = self.v.get(name) or [[]]
            if v[0]:
                out += self.section(name, v, in_force.get(name))
        return self.tamper("payload", out, self)

    def choose_lanes(self, count):
        return self.rng.choice([0, 0, 0, 0, 1, 2, 5 if count > 40 else 3])

    def section(self, name, v, in_force):
        v = self.tamper(name, v, self)
        sh_rank = self.context.sh_transform.rank if self.context.sh_transform else 0
        planes = pm.section_planes(name, self.context.dc_transform.rank, self.u.sh_mode, sh_rank, self.u.vq_stage_count)
        self.section_name = name
        available = pm.source_available if name == "new" else pm.source_available_in_section
        available = self.tamper("available", available, self)
        in_force = self.tamper("in_force", in_force, self)
        lanes_log2 = self.choose_lanes(len(v[0]))
        encoder = SectionEncoder(self.rng, planes, v, self.block_size(), 2 ** lanes_log2, in_force, available)
        models, blocks = encoder.run()
        models, blocks = self.tamper("coded", (models, blocks), self)
        lanes_log2 = self.tamper("lanes", lanes_log2, self)
        return (bytes([lanes_log2]) + leb(len(models)) + models
                + b"".join(leb(len(block)) for block in blocks) + b"".join(blocks))


def clamped(x, most):
    return max(-most, min(most, x))
