"""Clauses 7.7.6 and 7.7.7: the learned predictor of dc and sh, for one new Gaussian at a time."""

from math import isqrt
from operator import mul

from .constants import OUTPUT_MAX
from .conventions import Round, clamp
from .tables import EXP, SINE


def act(x, s):
    return clamp(Round(x, s), -127, 127)


def saturated(x):
    return clamp(x, -127, 127)


def product(row, x):
    """Row times array: `W[i] * x` of SS-TR-003."""
    return sum(map(mul, row, x))


def rounded_mean(values):
    """(2 * sum + K) / (2 * K)"""
    return (2 * sum(values) + len(values)) // (2 * len(values))


def sine(x):
    """7.7.7"""
    r = x % 128
    quarter = (x % 512) // 128
    return (SINE[r], SINE[128 - r], -SINE[r], -SINE[128 - r])[quarter]


class Transformer:
    """A network with the transforms of a frame; sh_transform is None where sh_transform_id is 255."""

    def __init__(self, network, dc_transform, sh_transform, feature_shift=0):
        self.network, self.feature_shift = network, feature_shift
        self.dc_transform, self.sh_transform = dc_transform, sh_transform

    def predict(self, own, neighbours, affinity, base):
        """p.dc and p.sh, by name.

        own: position, q, o and canonical rotation of the new Gaussian; neighbours: (Reference, D2) in order;
        affinity: that of SS-TR-001; base: base.dc and base.sh by name.
        """
        tokens = self.tokens(own, neighbours, affinity, base)
        near = self.near(own[0], neighbours)
        h = [self.embedded(j, token, near_j) for j, (token, near_j) in enumerate(zip(tokens, near))]
        rows, origins = self.rows(h, near)
        x = [self.fed_forward(self.normalised(self.attended(row, origin, h, near)))
             for row, origin in zip(rows, origins)]
        return self.predictions(self.outputs(x), base)

    def columns(self):
        """(attribute, transform or None, component) of each of the n values that take part in tokens and outputs."""
        result = [("dc", self.dc_transform, k) for k in range(self.network.dc_count)]
        return result + [("sh", self.sh_transform, k) for k in range(self.network.sh_count)]

    # ---- SS-TR-001 ----

    def tokens(self, own, neighbours, affinity, base):
        _, q, o, rotation = own
        apart = lambda a, b: Round(a - b, self.feature_shift)
        farthest = neighbours[-1][1]
        result = []
        for (neighbour, d2), w in zip(neighbours, affinity):
            token = [self.projected(column, neighbour, base) for column in self.columns()]
            token += [saturated(4 * apart(a, b)) for a, b in zip(neighbour.q, q)]
            token.append(saturated(2 * apart(neighbour.o, o)))
            token += [saturated(apart(a, b)) for a, b in zip(neighbour.rotation, rotation)]
            token.append((127 * d2) // (farthest + 1))
            if self.network.gated:
                token = [act(w * value, 12) for value in token]
            result.append(token)
        return result

    def projected(self, column, neighbour, base):
        attribute, transform, component = column
        if transform is None or component >= transform.rank:
            return 0
        basis = transform.basis[component * transform.dimension:(component + 1) * transform.dimension]
        difference = [a - b for a, b in zip(getattr(neighbour, attribute), base[attribute])]
        return act(product(basis, difference), 12 + self.network.token_shift + self.feature_shift)

    # ---- SS-TR-002 ----

    def near(self, position, neighbours):
        apart = [[a - b for a, b in zip(neighbour.position, position)] for neighbour, _ in neighbours]
        M = max(1, max(abs(x) for row in apart for x in row))
        return [[(254 * x + M) // (2 * M) for x in row] for row in apart]

    # ---- SS-TR-003 ----

    def embedded(self, j, token, near_j):
        net = self.network
        hidden = [max(0, act(product(row, near_j) + bias, net.layer_shift[0]))
                  for row, bias in zip(net.geometry, net.geometry_bias[0])]
        rank = net.rank[min(j, net.rank_count - 1)]
        return [act(product(net.embedding[i], token) + product(net.geometry_embedding[i], hidden) + rank[i],
                    net.layer_shift[1]) for i in range(net.d)]

    # ---- SS-TR-004 ----

    def rows(self, h, near):
        """(row, from)"""
        if self.network.full_attention:
            return h, near
        row = [saturated(rounded_mean(column) + query) for column, query in zip(zip(*h), self.network.query[0])]
        return [row], [[0, 0, 0]]

    # ---- SS-TR-005 ----

    def attended(self, row, origin, h, near):
        net = self.network
        u = [act(product(weights, row), net.layer_shift[2]) for weights in net.attention]
        logit = [Round(product(u, h_j) + self.fourier(near_j, origin), net.layer_shift[3])
                 for h_j, near_j in zip(h, near)]
        largest = max(logit)
        e = [EXP[min(255, largest - x)] for x in logit]
        r = 2 ** 26 // sum(e)
        share = [Round(x * r, 18) for x in e]
        z = [act(product(share, column), 8) for column in zip(*h)]
        return [saturated(row[i] + act(product(net.value[i], z) + net.value_bias[0][i], net.layer_shift[4]))
                for i in range(net.d)]

    def fourier(self, near_j, origin):
        weights = self.network.fourier[0]
        total = 0
        for a in range(3):
            for k in range(self.network.fourier_count):
                phase = (near_j[a] - origin[a]) << k
                total += weights[6 * k + 2 * a] * sine(phase) + weights[6 * k + 2 * a + 1] * sine(phase + 128)
        return total

    # ---- SS-TR-006 ----

    def normalised(self, x):
        net = self.network
        if not net.normalised:
            return x
        mu = Round(sum(x), net.width_log2)
        r = 2 ** 16 // max(1, isqrt(sum((value - mu) * (value - mu) for value in x)))
        return [act(gain * Round((value - mu) * r, 8) + bias, 5)
                for value, gain, bias in zip(x, net.gain[0], net.gain_bias[0])]

    # ---- SS-TR-007 ----

    def fed_forward(self, x):
        net = self.network
        if net.e == 0:
            return x
        wide = [max(0, act(product(row, x) + bias, net.layer_shift[5]))
                for row, bias in zip(net.widening, net.widening_bias[0])]
        return [saturated(x[i] + act(product(net.narrowing[i], wide) + net.narrowing_bias[0][i], net.layer_shift[6]))
                for i in range(net.d)]

    # ---- SS-TR-008 ----

    def outputs(self, x):
        net = self.network
        pool = [rounded_mean(column) for column in zip(*x)] if net.full_attention else x[0]
        return [clamp(Round(product(row, pool) + bias, net.layer_shift[7]), -1023, 1023) << net.output_shift
                for row, bias in zip(net.head, net.head_bias[0])]

    def predictions(self, out, base):
        sums = {attribute: [0] * len(values) for attribute, values in base.items()}
        for (attribute, transform, component), value in zip(self.columns(), out):
            if transform is not None and component < transform.rank:
                for i in range(transform.dimension):
                    sums[attribute][i] += transform.basis[component * transform.dimension + i] * value
        return {attribute: tuple(clamp(b + Round(s, 12), -OUTPUT_MAX, OUTPUT_MAX)
                                 for b, s in zip(values, sums[attribute])) for attribute, values in base.items()}
