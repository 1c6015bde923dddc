"""Clause 7.7: reference sets, neighbours, and the predictors of new Gaussians."""

from bisect import bisect_left
from collections import namedtuple

from .constants import NEIGHBOUR_WINDOW
from .conventions import Round
from .errors import require
from .lists import canonical
from .tables import EXP
from .transformer import Transformer

NONE, KNN, BILATERAL, TRANSFORMER = range(4)

# Values of a Gaussian of a reference set (SS-PR-005): position and rotation are canonical
Reference = namedtuple("Reference", "position q o rotation dc sh")


def reference(gaussian):
    return Reference(canonical(gaussian.position_fine), gaussian.q, gaussian.o,
                     canonical(gaussian.rotation_fine), gaussian.dc, gaussian.sh)


# ---- 7.7.2 ----


class Neighbours:
    """SS-PR-005: neighbours among the references around a position in the order of Morton codes."""

    def __init__(self, references):
        self.references = references
        self.sorted = sorted((morton(g.position), index) for index, g in enumerate(references))

    def find(self, position, neighbour_count):
        """[(D2, index)] of the neighbours in order."""
        first = bisect_left(self.sorted, (morton(position), 0))
        candidates = self.sorted[max(0, first - NEIGHBOUR_WINDOW):first + NEIGHBOUR_WINDOW]
        by_distance = sorted((self.squared_distance(position, index), index) for _, index in candidates)
        return by_distance[:neighbour_count]

    def squared_distance(self, position, index):
        return sum((a - b) * (a - b) for a, b in zip(position, self.references[index].position))


def morton(position):
    """Bit b of position[k] is bit 3b + k of the code."""
    code = 0
    for k, x in enumerate(position):
        for b in range(x.bit_length()):
            code |= (x >> b & 1) << (3 * b + k)
    return code


def check_predictors(section, network):
    """SS-PR-002"""
    for i, value in enumerate(section.values("predictor")[0]):
        require(NONE <= value <= TRANSFORMER, "OUT_OF_RANGE", "7.7.2", section.at(i))
        require(value != TRANSFORMER or network is not None, "UNDEFINED", "7.7.2", section.at(i))


def predictor_of_entries(count, increment, values, references):
    """The predictor of each new Gaussian; `values` are those of section predictors."""
    if not increment.predictors or not references:                                    # SS-PR-003
        return [NONE] * count
    return [values[i >> increment.predictor_block_log2] for i in range(count)]


class NewPredictions:
    """`predict` of residuals.Residuals for section new."""

    def __init__(self, positions, kinds, references, increment, context):
        self.positions = positions
        self.kinds = kinds
        self.references = references
        self.increment = increment
        self.context = context
        self.neighbours = [None] * len(kinds)
        self.learned = {}                           # entry -> its prediction of dc and sh
        if TRANSFORMER in kinds:
            self.transformer = Transformer(context.network, context.dc_transform, context.sh_transform,
                                           context.seq.feature_shift)
        search = Neighbours(references) if any(kinds) else None
        for i, kind in enumerate(kinds):
            if kind != NONE:
                self.neighbours[i] = search.find(positions[i], increment.neighbour_count)

    def __call__(self, attribute, i, values):
        kind = self.kinds[i]
        if kind == NONE:
            return self.none(attribute)
        if kind == TRANSFORMER and attribute in ("dc", "sh"):
            p = self.transformed(attribute, i, values)
        elif kind == KNN or kind == TRANSFORMER and self.context.network.knn_base:
            p = self.knn(attribute, self.neighbours[i])
        else:
            p = self.bilateral(attribute, self.neighbours[i], values)
        return tuple(x << 6 for x in p) if attribute == "rotation" else p

    # ---- 7.6.1 ----

    def none(self, attribute):
        if attribute == "opacity":
            return 0
        if attribute == "dc":
            return self.context.dc_transform.mean
        if attribute == "sh":
            if self.increment.sh_mode == 0:
                return (0,) * self.context.seq.sh_planes
            return self.context.sh_transform.mean
        return (0, 0, 0)

    # ---- 7.7.3 ----

    def knn(self, attribute, neighbours):
        nearest = neighbours[0][0]
        if nearest == 0:
            return self.attribute_of(attribute, neighbours[0][1])
        weight = [max(1, (2 ** 16 * (nearest + 1)) // (d2 + 1)) for d2, _ in neighbours]
        return self.means(attribute, weight, neighbours)

    def attribute_of(self, attribute, index):
        return getattr(self.references[index], {"log_scale": "q", "opacity": "o"}.get(attribute, attribute))

    def means(self, attribute, weight, neighbours):
        values = [self.attribute_of(attribute, index) for _, index in neighbours]
        if attribute == "opacity":
            return mean(weight, values)
        return tuple(mean(weight, column) for column in zip(*values))

    # ---- 7.7.4 ----

    def bilateral(self, attribute, neighbours, values):
        """SS-PR-007: no exception for a neighbour at distance 0"""
        return self.means(attribute, self.weights(attribute, neighbours, values), neighbours)

    def weights(self, attribute, neighbours, values):
        farthest = neighbours[-1][0]
        weight = []
        for d2, index in neighbours:
            f = feature_distance(attribute, values, self.references[index], self.context.seq.feature_shift)
            xs = (d2 * self.increment.bilateral_spatial) // (farthest + 1)
            xf = min(255, (f * self.increment.bilateral_feature) >> 6)
            weight.append(EXP[min(255, xs + xf)])
        return weight

    # ---- 7.7.6 ----

    def transformed(self, attribute, i, values):
        """p.dc and p.sh are found at once, before dc is decoded."""
        if attribute == "dc":
            neighbours = self.neighbours[i]
            affinity = self.weights("dc", neighbours, values)
            base = {name: self.knn(name, neighbours) if self.context.network.knn_base
                    else self.means(name, affinity, neighbours) for name in ("dc", "sh")}
            own = (self.positions[i], values.q, values.o, canonical(values.rotation_fine))
            near = [(self.references[index], d2) for d2, index in neighbours]
            self.learned[i] = self.transformer.predict(own, near, affinity, base)
        return self.learned[i][attribute]


def mean(weight, x):
    """SS-PR-006"""
    W = sum(weight)
    total = sum(w * value for w, value in zip(weight, x))
    return (2 * total + W) // (2 * W)


def feature_distance(attribute, values, neighbour, shift):
    """`feature` of 7.7.4; `values` are those of the new Gaussian so far."""
    f = 0
    if attribute in ("opacity", "rotation", "dc", "sh"):
        f += squares(values.q, neighbour.q, shift)
    if attribute in ("rotation", "dc", "sh"):
        f += squares([values.o], [neighbour.o], shift)
    if attribute in ("dc", "sh"):
        f += squares(canonical(values.rotation_fine), neighbour.rotation, shift)
    if attribute == "sh":
        f += squares(values.dc, neighbour.dc, 6 + shift)
    return f


def squares(a, b, shift):
    return sum(Round(x - y, shift) ** 2 for x, y in zip(a, b))
