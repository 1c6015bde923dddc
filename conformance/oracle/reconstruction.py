"""Clauses 7.2 to 7.9: from coded values to canonical planes and digests."""

import struct

from constants import COLOUR_SHIFT, COMPONENT_MAX, VALUE_MAX, VALUE_MIN
from conventions import Round, clamp, xxh64
from errors import require

FIRST_PLANE = {"position": 0, "log_scale": 3, "opacity": 6, "rotation": 7, "dc": 10, "sh": 13}   # 7.9


# ---- 7.2 ----


def prefix_count(seq, gaussian_count, r):
    """P(r)"""
    if r < 0:
        return 0
    return (seq.refinement_percent[r] * gaussian_count + 99) // 100


class BlockValues:
    """The second step of SS-EC-006 for one block: checks and reconstruction, plane by plane."""

    def __init__(self, e, planes, models, unit, seq, dc_transform, sh_transform, codebooks, at):
        self.e, self.planes, self.models = e, planes, models
        self.unit, self.seq = unit, seq
        self.dc_transform, self.sh_transform, self.codebooks = dc_transform, sh_transform, codebooks
        self.at = at                                # offset of the block, for errors
        self.n = len(e[0])

    def check(self, condition, code, clause):
        require(condition, code, clause, self.at)

    def planes_of(self, attribute):
        """v[p] of the planes of an attribute: e plus bias (index and position planes have bias 0)."""
        return [[value + self.models[plane.number].bias for value in self.e[plane.number]]
                for plane in self.planes if plane.attribute == attribute]

    def canonical(self):
        """The 13 + S canonical planes of the Gaussians of this block."""
        position = self.positions(self.planes_of("position")[0])
        q = self.log_scales(self.planes_of("log_scale"))
        o = self.opacity(self.planes_of("opacity")[0])
        rotation = self.rotations(self.planes_of("rotation"), q)
        dc = self.colour(self.planes_of("dc"), self.dc_transform)
        sh = self.sh(self.planes_of("sh"))
        return position + q + [o] + rotation + dc + sh

    # ---- 7.3 ----

    def positions(self, delta):
        shift = self.unit.position_shift
        bits = self.seq.position_bits - shift
        middle = (1 << shift) >> 1
        result = [[], [], []]
        code = 0
        for d in delta:
            code += d
            self.check(code < 2 ** (3 * bits), "CONSTRAINT", "7.3")
            for a in range(3):
                coordinate = 0
                for b in range(bits):
                    coordinate += ((code >> (3 * b + a)) & 1) << b
                result[a].append((coordinate << shift) + middle)
        return result

    # ---- 7.4 ----

    def log_scales(self, v):
        q = [[], [], []]
        for k in range(3):
            q[k] = [v[k][i] if k == 0 else q[k - 1][i] - v[k][i] for i in range(self.n)]
            # The order of 9.3: the ranges of v, then those of q, then SS-AT-002.
            for values in (v[k], q[k]):
                for value in values:
                    self.check(VALUE_MIN <= value <= VALUE_MAX, "OUT_OF_RANGE", "7.4")
            if self.seq.canonical_axes == 1 and k > 0:
                for value in v[k]:
                    self.check(value >= 0, "CONSTRAINT", "7.4")
        return q

    # ---- 7.5 ----

    def opacity(self, v):
        for value in v:
            self.check(VALUE_MIN <= value <= VALUE_MAX, "OUT_OF_RANGE", "7.5")
        return v

    # ---- 7.6 ----

    def rotations(self, v, q):
        coarser = []
        for i in range(self.n):
            d = q[0][i] - q[2][i]
            count = 0
            for threshold in self.seq.rotation_threshold:
                if threshold > 0 and d < threshold:
                    count += 1
            coarser.append(count)
        rotation = [[], [], []]
        for k in range(3):
            for i in range(self.n):
                self.check(VALUE_MIN <= v[k][i] <= VALUE_MAX, "OUT_OF_RANGE", "7.6")
                integer = v[k][i] << coarser[i]
                self.check(-32767 <= integer <= 32767, "OUT_OF_RANGE", "7.6")
                rotation[k].append(integer)
        return rotation

    # ---- 7.7 ----

    def colour(self, component, transform):
        for plane in component:
            for value in plane:
                self.check(-COMPONENT_MAX <= value <= COMPONENT_MAX, "OUT_OF_RANGE", "7.7")
        return self.apply_transform(component, transform)

    def apply_transform(self, component, transform):
        out = []
        for j in range(transform.dimension):
            column = [transform.basis[k * transform.dimension + j] for k in range(transform.rank)]
            plane = []
            for i in range(self.n):
                total = 0
                for k, weight in enumerate(column):
                    total += weight * component[k][i]
                plane.append(transform.mean[j] + Round(total, COLOUR_SHIFT))
            out.append(plane)
        return out

    # ---- 7.8 ----

    def sh(self, v):
        if self.unit.sh_mode == 0:
            return [[0] * self.n for _ in range(self.seq.sh_planes)]
        if self.unit.sh_mode == 1:
            return self.colour(v, self.sh_transform)
        books = [self.codebooks[self.unit.codebook_ids[s]] for s in range(self.unit.vq_stage_count)]
        for book, plane in zip(books, v):
            for index in plane:
                self.check(index < book.entry_count, "OUT_OF_RANGE", "7.8")
        component = []
        for k in range(self.sh_transform.rank):
            plane = []
            for i in range(self.n):
                total = 0
                for s, book in enumerate(books):
                    total += book.values[v[s][i] * book.component_count + k]
                plane.append(clamp(total, -COMPONENT_MAX, COMPONENT_MAX))
            component.append(plane)
        return self.apply_transform(component, self.sh_transform)


# ---- 7.9 ----


def i32le(values):
    return struct.pack("<%di" % len(values), *values)


def unit_digests(canonical_planes):
    """D[r][p] for the planes of one unit."""
    return [xxh64(p, i32le(plane)) for p, plane in enumerate(canonical_planes)]


def frame_digest(digests_of_units):
    """The digest of the frame; digests_of_units is D[0], D[1], ..., D[r]."""
    flat = [d for unit in digests_of_units for d in unit]
    return xxh64(0, struct.pack("<%dQ" % len(flat), *flat))
