"""Clause 7.6: predictions, residuals and reconstruction of section updates and section new."""

from .constants import COLOUR_SHIFT, COMPONENT_MAX, FINE_BITS, OUTPUT_MAX, VALUE_MAX, VALUE_MIN
from .conventions import Round, clamp
from .errors import require
from .steps import ATTRIBUTES, LOG_SCALE, StepRule


class Values:
    """Values of one entry; attributes join in the order of 7.7.4. rotation_fine is in 64ths."""

    q = o = rotation_fine = dc = sh = None


class Residuals:
    """Reconstructs `count` entries.

    predict(attribute, i, values) gives the prediction of an attribute of entry i, whose attributes before it are in
    `values`. take(attribute, predictions, factors) gives the planes of the attribute; the factors, one for each entry, are
    those of 7.6.6, of log_scale that of its first plane. `parents`: the Gaussians that the entries update; none of new
    Gaussians.
    """

    def __init__(self, count, predict, take, increment, context, at, parents=None):
        self.count, self.predict, self.take, self.parents = count, predict, take, parents
        self.increment, self.context, self.at = increment, context, at
        self.rule = StepRule(context.seq, increment.attribute_step)
        self.values = [Values() for _ in range(count)]

    def check(self, condition, code):
        require(condition, code, "7.6", self.at)

    def check_planes(self, planes, low, high):
        for plane in planes:
            for value in plane:
                self.check(low <= value <= high, "OUT_OF_RANGE")

    def run(self):
        for number, attribute in enumerate(ATTRIBUTES):
            p = [self.predict(attribute, i, values) for i, values in enumerate(self.values)]
            factors = [self.rule.factor(number, shape.q, shape.o) if number else self.rule.first()
                       for shape in self.parents or self.values]                      # SS-AT-004
            getattr(self, attribute)(p, self.take(attribute, p, factors), factors)
        return self.values

    # ---- 7.6.2 ----

    def log_scale(self, p, v, factors):
        if self.parents is None:
            self.new_log_scale(p, v, factors)
        else:
            self.updated_log_scale(v, factors)

    def updated_log_scale(self, v, factors):
        others = [self.rule.factor(LOG_SCALE, parent.q) for parent in self.parents]
        x = [[value * factor for value, factor in zip(plane, of_plane)]
             for plane, of_plane in zip(v, (factors, others, others))]
        q = [[parent.q[k] + value for parent, value in zip(self.parents, x[k])] for k in range(3)]
        self.check_planes(x, VALUE_MIN, VALUE_MAX)                                    # SS-RC-001
        self.check_planes(q, VALUE_MIN, VALUE_MAX)
        for i, values in enumerate(self.values):
            values.q = (q[0][i], q[1][i], q[2][i])
            if self.context.seq.canonical_axes == 1:
                self.check(q[0][i] >= q[1][i] >= q[2][i], "CONSTRAINT")               # SS-RC-002

    def new_log_scale(self, p, v, factors):
        x = [[value * factor for value, factor in zip(v[0], factors)], [], []]
        q, steps = [[], [], []], []
        for i in range(self.count):
            q[0].append(p[i][0] + x[0][i])
            factor = self.rule.factor(LOG_SCALE, [q[0][i]])
            for k in (1, 2):
                x[k].append(v[k][i] * factor)
            d1 = p[i][0] - p[i][1] + x[1][i]
            d2 = p[i][1] - p[i][2] + x[2][i]
            q[1].append(q[0][i] - d1)
            q[2].append(q[1][i] - d2)
            steps += [d1, d2]
        self.check_planes(x, VALUE_MIN, VALUE_MAX)                                    # SS-RC-001
        self.check_planes(q, VALUE_MIN, VALUE_MAX)
        if self.context.seq.canonical_axes == 1:
            for d in steps:
                self.check(d >= 0, "CONSTRAINT")                                      # SS-RC-002
        for i, values in enumerate(self.values):
            values.q = (q[0][i], q[1][i], q[2][i])

    def opacity(self, p, v, factors):
        o = [prediction + value * factor for prediction, value, factor in zip(p, v[0], factors)]
        self.check_planes([o], VALUE_MIN, VALUE_MAX)                                  # SS-RC-001
        for values, value in zip(self.values, o):
            values.o = value

    # ---- 7.6.3 ----

    def rotation(self, p, v, factors):
        fine = []
        for k in range(3):
            self.check_planes([v[k]], VALUE_MIN, VALUE_MAX)                           # SS-RC-003
            plane = [p[i][k] + (v[k][i] * factors[i] << FINE_BITS) for i in range(self.count)]
            self.check_planes([plane], -32767 * 64, 32767 * 64)
            fine.append(plane)
        for i, values in enumerate(self.values):
            values.rotation_fine = (fine[0][i], fine[1][i], fine[2][i])

    # ---- 7.6.5 ----

    def components(self, planes, factors):
        """SS-RC-005: components after their steps"""
        result = [[value * factor for value, factor in zip(plane, factors)] for plane in planes]
        self.check_planes(result, -COMPONENT_MAX, COMPONENT_MAX)
        return result

    def dc(self, p, v, factors):
        component = self.components(v, factors)
        for values, out in zip(self.values, self.transformed(p, component, self.context.dc_transform)):
            values.dc = out

    def sh(self, p, v, factors):
        """SS-RC-004"""
        mode = self.increment.sh_mode
        if mode == 0:
            out = [tuple(one) for one in p]
        else:
            component = self.components(v if mode == 1 else self.looked_up(v), factors)
            out = self.transformed(p, component, self.context.sh_transform)
        for values, one in zip(self.values, out):
            values.sh = one

    def transformed(self, p, component, transform):
        """p plus the transformed components, entry by entry."""
        out = []
        for j in range(transform.dimension):
            column = [transform.basis[k * transform.dimension + j] for k in range(transform.rank)]
            plane = []
            for i in range(self.count):
                total = sum(weight * component[k][i] for k, weight in enumerate(column))
                plane.append(p[i][j] + Round(total, COLOUR_SHIFT))                    # SS-AT-002
            self.check_planes([plane], -OUTPUT_MAX, OUTPUT_MAX)                       # SS-RC-006
            out.append(plane)
        return list(zip(*out))

    def looked_up(self, v):
        """SS-SH-001 without the transform: sums of codebook entries, clamped."""
        books = [self.context.codebooks[identifier] for identifier in self.increment.codebook_ids]
        for book, plane in zip(books, v):
            self.check_planes([plane], 0, book.entry_count - 1)                       # SS-RC-005
        component = []
        for k in range(self.context.sh_transform.rank):
            totals = [sum(book.values[v[s][i] * book.component_count + k] for s, book in enumerate(books))
                      for i in range(self.count)]
            component.append([clamp(total, -COMPONENT_MAX, COMPONENT_MAX) for total in totals])
        return component
