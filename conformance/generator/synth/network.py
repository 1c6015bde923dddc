"""Random networks (5.17.1) for learned.py.

A network is asked for by elements of 5.17.1, by `flags`, and by `fill`,
a row of FILLS; what is not asked for is random.
Weights are such that sums are neither always clamped nor always 0, unless the fill is to do that.
"""

import math
import struct

from oracle import syntax
from oracle.conventions import clamp
from oracle.network import arrays

RANGES = {"network_flags": (0, 7), "width_log2": (3, 4), "feed_forward_width": (0, 24), "geometry_width": (0, 12),
          "fourier_count": (0, 4), "rank_count": (1, 16), "dc_count": (0, 3), "sh_count": (0, 6),
          "token_shift": (0, 2), "output_shift": (0, 2)}

# Typical magnitude of what each layer multiplies its weights with, and the magnitude wanted after its shift
LAYERS = (("geometry", 60, 60), ("embedding", 40, 50), ("attention", 45, 60), ("logit", 45, 30),
          ("value", 30, 40), ("widening", 50, 60), ("narrowing", 35, 40), ("head", 45, 80))


class NetworkWriter:
    """bytes() gives a network; its elements are attributes."""

    def __init__(self, rng, asked):
        self.rng = rng
        self.fill = FILLS[asked.get("fill", "usual")]
        for element, (low, high) in RANGES.items():
            setattr(self, element, asked.get(element, rng.randint(low, high)))
        if self.dc_count + self.sh_count == 0:
            self.dc_count = 1
        self.reach = rng.choice([30, 70, 127])
        self.full_attention, self.normalised = self.network_flags & 1, self.network_flags >> 2 & 1
        self.d, self.e, self.g = 2 ** self.width_log2, self.feed_forward_width, self.geometry_width
        self.n = self.dc_count + self.sh_count
        self.f = self.n + 8
        self.layer_shift = asked.get("layer_shift") or [self.usual_shift(*layer) for layer in LAYERS]
        if asked.get("fill") in ("most", "least", "checked"):
            self.layer_shift = [1] * 8

    def usual_shift(self, layer, magnitude, wanted):
        terms = {"geometry": 3, "embedding": self.f + self.g / 2, "narrowing": max(1, self.e / 2)}.get(layer, self.d)
        weight = 70 if layer == "logit" else self.reach / 1.7
        shift = round(math.log2(math.sqrt(terms) * magnitude * weight / wanted))
        return clamp(shift + self.rng.choice([-1, 0, 0, 0, 1]), 1, 15)

    def bytes(self):
        out = bytes(getattr(self, row[0]) for row in syntax.NETWORK_FIXED[:-1]) + bytes(self.layer_shift)
        for name, kind, rows, columns in arrays(self):
            values = [self.fill(self, name, kind, k) for k in range(rows * columns)]
            out += struct.pack("<%d%s" % (len(values), {"i8": "b", "i16": "h"}[kind]), *values)
        return out


# ---- fills: value k of an array ----


def usual(writer, name, kind, k):
    if kind == "i8":
        return writer.rng.randint(-writer.reach, writer.reach)
    layer = {"geometry_bias": 0, "rank": 1, "value_bias": 4, "gain_bias": None, "widening_bias": 5,
             "narrowing_bias": 6, "head_bias": 7}[name]
    reach = 40 << (5 if layer is None else writer.layer_shift[layer])
    return writer.rng.randint(-min(reach, 32768), min(reach, 32767))


def most(writer, name, kind, k):
    return {"i8": 127, "i16": 32767}[kind]


def least(writer, name, kind, k):
    return {"i8": -128, "i16": -32768}[kind]


def checked(writer, name, kind, k):
    """Corners in random order: everything is clamped, to both sides."""
    return writer.rng.choice([most, least])(writer, name, kind, k)


def corner_biases(writer, name, kind, k):
    return usual(writer, name, kind, k) if kind == "i8" else checked(writer, name, kind, k)


def zero(writer, name, kind, k):
    return 0


def flat(writer, name, kind, k):
    """No attention and no frequencies: all shares are equal."""
    return 0 if name in ("attention", "fourier") else usual(writer, name, kind, k)


def peaked(writer, name, kind, k):
    """Large logits: one neighbour has the whole share."""
    return checked(writer, name, kind, k) if name in ("attention", "fourier") else usual(writer, name, kind, k)


def bare(writer, name, kind, k):
    """No weights in the head: outputs are its biases."""
    return 0 if name == "head" else usual(writer, name, kind, k)


FILLS = {"usual": usual, "most": most, "least": least, "checked": checked, "corner_biases": corner_biases,
         "zero": zero, "flat": flat, "peaked": peaked, "bare": bare}
