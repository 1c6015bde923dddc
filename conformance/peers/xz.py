"""xz on the reference PLY."""

import lzma

import generic
from measure import Rate

PACKAGES = []


def rates(scene):
    return [Rate("xz", "preset 6, raw PLY")]


def code(rate, scene, decoded, tools):
    return generic.code(lambda data: lzma.compress(data, preset=6), lzma.decompress,
                        "lzma.compress(ply, preset=6)", scene, decoded, tools)
