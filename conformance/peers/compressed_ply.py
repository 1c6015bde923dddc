"""PlayCanvas's compressed PLY: fixed bits on a grid for every 256 Gaussians, nothing after it."""

import transform
from measure import Rate

PACKAGES = [transform.TRANSFORM]


def rates(scene):
    return [] if scene.sequence else [Rate("compressed.ply", "as it is")]


def code(rate, scene, decoded, tools):
    return transform.code("compressed.ply", rate.settings, scene, decoded, tools)
