"""SPZ, by its authors' own code built to WebAssembly."""

import numpy as np

import ply
from measure import Coded, Package, Rate

SPZ = Package("npm", "@adobe/spz", "0.2.3")
PACKAGES = [SPZ]


def rates(scene):
    """Versions at the default SH bits; with SH, also a coarser and finer choice of them."""
    if scene.sequence:
        return [_rate(4, 5, 4)]
    choices = [_rate(version, 5, 4) for version in (2, 3, 4)]
    if scene.degree:
        choices += [_rate(4, 3, 2), _rate(4, 6, 5), _rate(4, 8, 8)]
    return choices


def _rate(version, sh1_bits, sh_rest_bits):
    return Rate("SPZ v%d" % version, "sh1Bits %d, shRestBits %d" % (sh1_bits, sh_rest_bits),
                {"version": version, "sh1Bits": sh1_bits, "shRestBits": sh_rest_bits})


def code(rate, scene, decoded, tools):
    work = job(rate, scene, tools)
    done = tools.node("spz.mjs", work)
    for frame, path in zip(work["frames"], decoded):
        ply.write(path, _gaussians(np.fromfile(frame["out"], "<f4"), frame["count"]))
    call = "saveSpzToBuffer(cloud, {from: RDF, version: %(version)d, sh1Bits: %(sh1Bits)d, shRestBits: %(shRestBits)d})"
    return Coded(done["bytes"], done["gaussians"], done["encode_s"], done["decode_s"], "in-process",
                 call % rate.settings + " of @adobe/spz (WebAssembly)")


def job(rate, scene, tools):
    """What spz.mjs is told; the frames are written for it."""
    frames = []
    for number, gaussians in enumerate(scene.frames()):
        frame = {"in": tools.scratch("spz_in_%d" % number), "out": tools.scratch("spz_out_%d" % number),
                 "count": len(gaussians)}
        _cloud(gaussians).tofile(frame["in"])
        frames.append(frame)
    return {"module": tools.entry(SPZ), "pack": rate.settings, "degree": scene.degree, "frames": frames,
            "repeat": tools.repeat}


def _cloud(gaussians):
    """The attributes one after another, as spz.mjs takes them; rotations x y z w, SH with channels innermost."""
    rotations = gaussians.rotation[:, [1, 2, 3, 0]]
    parts = (gaussians.position, gaussians.scale, rotations, gaussians.opacity, gaussians.colour,
             gaussians.coefficients())
    return np.concatenate([np.ascontiguousarray(part, "<f4").ravel() for part in parts])


def _gaussians(values, count):
    position, scale, rotation, opacity, colour, sh = np.split(values, np.cumsum(np.array([3, 3, 4, 1, 3]) * count))
    rotation = rotation.reshape(count, 4)[:, [3, 0, 1, 2]]
    return ply.Gaussians(position.reshape(count, 3), colour.reshape(count, 3),
                         ply.from_coefficients(sh.reshape(count, -1, 3)), opacity.reshape(count, 1),
                         scale.reshape(count, 3), rotation)
