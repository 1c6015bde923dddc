"""SOG: images in lossless WebP, SH by vector quantisation. On a sequence every frame stands alone."""

import transform
from measure import Rate

PACKAGES = [transform.TRANSFORM]


def rates(scene):
    """The SH iterations are its only knob of quality."""
    choices = (2, 10) if scene.degree and not scene.sequence else (10,)
    return [Rate("SOG", "iterations %d" % n, {"iterations": n}) for n in choices]


def code(rate, scene, decoded, tools):
    return transform.code("sog", rate.settings, scene, decoded, tools)
