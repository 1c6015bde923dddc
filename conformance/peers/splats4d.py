"""splats4d: a sequence of .splat frames of equal count, coded with bounds on the error. It has no SH.

Its program decodes one frame per call. Encoding is timed without its verification; decoding is timed by the last
frame of every group, which needs the whole group.
"""

import json
import os
import shutil

import numpy as np

import ply
from measure import Coded, Missing, Package, Rate, process, run, spoken

PACKAGES = [Package("pip", "splats4d", "0.1.0")]
SH_C0 = 0.28209479177387814
RECORD = np.dtype([("position", "<f4", 3), ("scale", "<f4", 3), ("colour", "u1", 4), ("rotation", "u1", 4)])


def rates(scene):
    """The defaults (2 mm, groups of 30, zstd 3); then one group, zstd 19, and bounds from 2 mm to 16 bits."""
    if not scene.sequence:
        return []
    extent = float(np.ptp(ply.read(scene.paths[0]).position, axis=0).max())
    best = ["--gop", str(len(scene.paths)), "--zstd-level", "19"]
    points = [("defaults", []), ("positions 2 mm, one group, zstd 19", best)]
    for parts in (2 ** 11, 2 ** 14, 2 ** 17):
        bound = ["--pos-mm", "%.6g" % (1000 * extent / parts)]
        points.append(("positions extent/%d, one group, zstd 19" % parts, best + bound))
    return [Rate("splats4d", options + ("; drops SH" if scene.degree else ""), {"flags": flags})
            for options, flags in points]


def code(rate, scene, decoded, tools):
    coder = Coder(rate, scene, tools)
    encode_s = process(coder.encode, tools.repeat)
    for number, path in enumerate(decoded):
        run(coder.decode_frame(number))
        ply.write(path, _gaussians(np.fromfile(coder.out, RECORD)))
    decode_s = sum(process(command, tools.repeat) for command in coder.decode())
    return Coded(os.path.getsize(coder.coded), scene.gaussians, encode_s, decode_s, "process", spoken(coder.encode))


class Coder:
    """The commands that code a scene, whose frames are written for them."""

    def __init__(self, rate, scene, tools):
        if len(set(scene.counts)) > 1:
            raise Missing("it needs the same count in every frame")
        self.program, self.frames = tools.program("splat4d"), len(scene.paths)
        self.coded, self.out = tools.scratch("scene.splat4d"), tools.scratch("frame.splat")
        folder = tools.scratch("frames")
        shutil.rmtree(folder, ignore_errors=True)
        os.makedirs(folder)
        for number, gaussians in enumerate(scene.frames()):
            _records(gaussians).tofile(os.path.join(folder, "frame_%04d.splat" % number))
        self.encode = [self.program, "encode", "-i", folder, "-o", self.coded, "--no-verify"] + rate.settings["flags"]

    def decode_frame(self, number):
        return [self.program, "decode", self.coded, "--frame", number, "-o", self.out]

    def decode(self):
        """What decodes every frame, once the scene is coded: the last of every group needs the whole group."""
        info = run([self.program, "info", self.coded])
        gop = json.JSONDecoder().raw_decode(info[info.index("{"):])[0]["gop"]
        return [self.decode_frame(min(begin + gop, self.frames) - 1) for begin in range(0, self.frames, gop)]


def _records(gaussians):
    records = np.zeros(len(gaussians), RECORD)
    records["position"] = gaussians.position
    records["scale"] = np.exp(gaussians.scale)
    opacity = 1 / (1 + np.exp(-gaussians.opacity))
    records["colour"] = _byte(255 * np.concatenate([gaussians.colour * SH_C0 + 0.5, opacity], 1))
    records["rotation"] = _byte(gaussians.rotation * 128 + 128)
    return records


def _byte(values):
    return np.clip(np.rint(values), 0, 255).astype(np.uint8)


def _gaussians(records):
    colour = records["colour"] / np.float32(255)
    opacity = np.clip(colour[:, 3:], 0.5 / 255, 1 - 0.5 / 255)
    rotation = (records["rotation"].astype("<f4") - 128) / 128
    length = np.linalg.norm(rotation, axis=1, keepdims=True)
    return ply.Gaussians(records["position"], (colour[:, :3] - 0.5) / SH_C0, np.zeros((len(records), 0), "<f4"),
                         np.log(opacity / (1 - opacity)), np.log(np.maximum(records["scale"], 1e-10)),
                         rotation / np.where(length == 0, 1, length))
