"""Draco: one point cloud, positions by its own quantiser, the other attributes as integers of `bits`.

Draco has no notion of a Gaussian. Its quantiser is that of the command line for generic attributes, over the range
of the values; rotations go as their three smaller components and which one is left out, opacity after the sigmoid.
"""

from dataclasses import dataclass

import numpy as np

import ply
from measure import Coded, Package, Rate, in_process

PACKAGES = [Package("pip", "DracoPy", "2.2.0")]
POINTS = ((10, 6), (12, 7), (14, 8), (15, 9), (16, 10))
OTHERS = np.array([[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]])
LEVEL = 10


def rates(scene):
    if scene.sequence:
        return []
    return [Rate("Draco", "positions %d bits, others %d" % point, dict(zip(("position_bits", "bits"), point)))
            for point in POINTS]


def code(rate, scene, decoded, tools):
    import DracoPy

    (gaussians,) = scene.frames()
    bits = rate.settings["bits"]

    def encode():
        attributes, ranges = _attributes(gaussians, bits)
        position_bits = rate.settings["position_bits"]
        return DracoPy.encode(gaussians.position, quantization_bits=position_bits, compression_level=LEVEL,
                              generic_attributes=attributes), ranges

    def decode():
        return _gaussians(DracoPy.decode(coded), ranges, bits)

    (coded, ranges), encode_s = in_process(encode, tools.repeat)
    back, decode_s = in_process(decode, tools.repeat)
    ply.write(decoded[0], back)
    side = sum(r.size for r in ranges.values())
    call = "DracoPy.encode(positions, quantization_bits=%(position_bits)d, compression_level=10, " \
           "generic_attributes={scale, rotation, largest, opacity, colour, sh: %(bits)d bits})" % rate.settings
    return Coded(len(coded) + side, len(back), encode_s, decode_s, "in-process", call)


@dataclass
class Range:
    """Stored beside the Draco file, as two floats."""

    low: np.float32
    high: np.float32
    size = 8

    def quantised(self, values, bits):
        steps = (values - self.low) * ((2 ** bits - 1) / max(self.high - self.low, 1e-20))
        return np.ascontiguousarray(np.rint(steps), np.uint8 if bits <= 8 else np.uint16)

    def values(self, steps, bits):
        return (self.low + steps * ((self.high - self.low) / (2 ** bits - 1))).astype("<f4")


def _attributes(gaussians, bits):
    largest = np.abs(gaussians.rotation).argmax(1)
    rows = np.arange(len(gaussians))
    sign = np.where(gaussians.rotation[rows, largest] < 0, -1, 1)
    rotation = gaussians.rotation[rows[:, None], OTHERS[largest]] * sign[:, None]
    floats = {"scale": gaussians.scale, "rotation": rotation, "opacity": 1 / (1 + np.exp(-gaussians.opacity)),
              "colour": gaussians.colour}
    if gaussians.degree:
        floats["sh"] = gaussians.sh
    ranges = {name: Range(values.min(), values.max()) for name, values in floats.items()}
    attributes = {name: ranges[name].quantised(values, bits) for name, values in floats.items()}
    attributes["largest"] = largest.astype(np.uint8)[:, None]
    return attributes, ranges


def _gaussians(cloud, ranges, bits):
    column = lambda name: cloud.get_attribute_by_name(name)["data"].reshape(len(cloud.points), -1)
    values = {name: ranges[name].values(column(name), bits) for name in ranges}
    rows, largest = np.arange(len(cloud.points)), column("largest")[:, 0]
    rotation = np.zeros((len(rows), 4), "<f4")
    rotation[rows[:, None], OTHERS[largest]] = values["rotation"]
    rotation[rows, largest] = np.sqrt(np.clip(1 - (values["rotation"] ** 2).sum(1), 0, None))
    opacity = np.clip(values["opacity"], 1e-6, 1 - 1e-6)
    return ply.Gaussians(np.asarray(cloud.points, "<f4"), values["colour"],
                         values.get("sh", np.zeros((len(rows), 0), "<f4")), np.log(opacity / (1 - opacity)),
                         values["scale"], rotation)
