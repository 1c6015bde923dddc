"""Draco: one point cloud, positions by its own quantiser, the other attributes as integers of `bits`.

Draco has no notion of a Gaussian, and DracoPy quantises nothing but positions. What it does to them is done to the
others here: even steps over the range of the values; SH, as in SPZ, over -1 to 1 and with fewer bits. Rotations go as
their three smaller components and which one is left out, opacity after the sigmoid.

Its kd-tree gives every component the bits of the widest, which SH cannot afford; its sequential mode keeps the order it
is given, here Morton's.
"""

from dataclasses import dataclass

import numpy as np

import ply
from measure import Coded, Package, Rate, in_process

PACKAGES = [Package("pip", "DracoPy", "2.2.0")]
POINTS = ((10, 6), (12, 7), (14, 8), (15, 9), (16, 10))
OTHERS = np.array([[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]])
SH_LESS = 3  # bits
LEVEL = 10
MORTON_BITS = 16


def rates(scene):
    if scene.sequence:
        return []
    points = []
    for mode in ("sequential",) if scene.degree else ("kd-tree", "sequential"):
        for position_bits, bits in POINTS:
            options = "%s, positions %d bits, others %d" % (mode, position_bits, bits)
            if scene.degree:
                options += ", SH %d" % (bits - SH_LESS)
            points.append(Rate("Draco", options, {"mode": mode, "position_bits": position_bits, "bits": bits}))
    return points


def code(rate, scene, decoded, tools):
    import DracoPy

    (gaussians,) = scene.frames()
    flags = {"quantization_bits": rate.settings["position_bits"], "compression_level": LEVEL,
             "preserve_order": rate.settings["mode"] == "sequential"}

    def encode():
        ordered = _in_morton_order(gaussians) if flags["preserve_order"] else gaussians
        attributes, ranges = _attributes(ordered, rate.settings["bits"])
        return DracoPy.encode(ordered.position, generic_attributes=attributes, **flags), ranges

    def decode():
        return _gaussians(DracoPy.decode(coded), ranges)

    (coded, ranges), encode_s = in_process(encode, tools.repeat)
    back, decode_s = in_process(decode, tools.repeat)
    ply.write(decoded[0], back)
    side = sum(r.size for r in ranges.values())
    call = "DracoPy.encode(positions, generic_attributes={scale, rotation, largest, opacity, colour, sh}, %s)" \
        % ", ".join("%s=%s" % flag for flag in flags.items())
    return Coded(len(coded) + side, len(back), encode_s, decode_s, "in-process", call)


@dataclass
class Range:
    """Stored beside the Draco file, as two floats."""

    low: np.float32
    high: np.float32
    bits: int
    size = 8

    @property
    def step(self):
        return max(self.high - self.low, 1e-20) / (2 ** self.bits - 1)

    def quantised(self, values):
        steps = np.rint((np.clip(values, self.low, self.high) - self.low) / self.step)
        return np.ascontiguousarray(steps, np.uint8 if self.bits <= 8 else np.uint16)

    def values(self, steps):
        return (self.low + steps * self.step).astype("<f4")


def _attributes(gaussians, bits):
    largest = np.abs(gaussians.rotation).argmax(1)
    rows = np.arange(len(gaussians))
    sign = np.where(gaussians.rotation[rows, largest] < 0, -1, 1)
    rotation = gaussians.rotation[rows[:, None], OTHERS[largest]] * sign[:, None]
    floats = {"scale": gaussians.scale, "rotation": rotation, "opacity": 1 / (1 + np.exp(-gaussians.opacity)),
              "colour": gaussians.colour}
    if gaussians.degree:
        floats["sh"] = gaussians.sh
    ranges = {name: Range(values.min(), values.max(), bits) for name, values in floats.items()}
    if gaussians.degree:
        ranges["sh"] = Range(np.float32(-1), np.float32(1), bits - SH_LESS)
    attributes = {name: ranges[name].quantised(values) for name, values in floats.items()}
    attributes["largest"] = largest.astype(np.uint8)[:, None]
    return attributes, ranges


def _in_morton_order(gaussians):
    position = gaussians.position - gaussians.position.min(0)
    cell = (position * ((2 ** MORTON_BITS - 1) / max(position.max(), 1e-20))).astype(np.int64)
    key = np.zeros(len(cell), np.int64)
    for bit in range(MORTON_BITS):
        for axis in range(3):
            key |= (cell[:, axis] >> bit & 1) << (3 * bit + axis)
    order = np.argsort(key, kind="stable")
    return ply.Gaussians(*(column[order] for column in vars(gaussians).values()))


def _gaussians(cloud, ranges):
    column = lambda name: cloud.get_attribute_by_name(name)["data"].reshape(len(cloud.points), -1)
    values = {name: ranges[name].values(column(name)) for name in ranges}
    rows, largest = np.arange(len(cloud.points)), column("largest")[:, 0]
    rotation = np.zeros((len(rows), 4), "<f4")
    rotation[rows[:, None], OTHERS[largest]] = values["rotation"]
    rotation[rows, largest] = np.sqrt(np.clip(1 - (values["rotation"] ** 2).sum(1), 0, None))
    opacity = np.clip(values["opacity"], 1e-6, 1 - 1e-6)
    return ply.Gaussians(np.asarray(cloud.points, "<f4"), values["colour"],
                         values.get("sh", np.zeros((len(rows), 0), "<f4")), np.log(opacity / (1 - opacity)),
                         values["scale"], rotation)
