"""What several peers and the readers share: PlayCanvas's splat-transform, called in memory on one thread."""

import os

import ply
from measure import Coded, Package

TRANSFORM = Package("npm", "@playcanvas/splat-transform", "3.7.0")


def to_gaussians(path, tools):
    """Reads any format that splat-transform reads."""
    out = tools.scratch("transform.ply")
    convert(tools, [{"in": os.path.abspath(path), "out": out}], "ply", {}, decode=False)
    return ply.read(out)


def count(path, tools):
    """How many Gaussians the file says it holds, from its header."""
    job = {"module": tools.entry(TRANSFORM), "info": os.path.abspath(path)}
    return tools.node("transform.mjs", job)["gaussians"]


def code(suffix, options, scene, decoded, tools):
    """Codes the reference to the format of `suffix` and back."""
    frames = [{"in": path, "out": out} for path, out in zip(map(os.path.abspath, scene.paths),
                                                            map(os.path.abspath, decoded))]
    done = convert(tools, frames, suffix, options, decode=True)
    gaussians = 0
    for path in decoded:
        frame = ply.read(path)
        ply.write(path, frame)
        gaussians += len(frame)
    call = "writeSource(readFile(ply), '%s', %s) of splat-transform, without a GPU, one thread" % (suffix, options)
    return Coded(done["bytes"], gaussians, done["encode_s"], done["decode_s"], "in-process", call)


def convert(tools, frames, suffix, options, decode):
    job = {"module": tools.entry(TRANSFORM), "frames": frames, "suffix": suffix, "options": options,
           "decode": decode, "repeat": tools.repeat if decode else 1}
    return tools.node("transform.mjs", job)
