"""Clause 7.10: the f32 attributes with the expansion of positions, and files of planes.

Python's float is binary64. The product of two binary32 numbers is exact in binary64, and for sums and
square roots of binary32 numbers rounding first to 53 and then to 24 bits equals rounding once, since
53 >= 2 * 24 + 2. So fl() of a binary64 operation on binary32 operands is the one rounding of 4.8.
"""

import math
import os
import struct

from .reconstruction import i32le


def fl(x):
    return struct.unpack("<f", struct.pack("<f", x))[0]


def float_planes(seq, planes):
    """SS-OUT-001: name -> list of values for each f32 attribute of a frame; `planes` are the canonical planes."""
    out = {}

    def affine(name, offset, step, integers):
        out[name] = [fl(offset + fl(step * fl(value))) for value in integers]

    def scaled(name, factor, integers):
        out[name] = [fl(factor * fl(value)) for value in integers]

    for a in range(3):
        expanded = [expand(code, seq) for code in planes[a]]
        affine("position%d" % a, seq.position_offset[a], seq.position_step, expanded)
    for a in range(3):
        affine("log_scale%d" % a, seq.log_scale_offset, seq.log_scale_step, planes[3 + a])
    affine("opacity", seq.opacity_offset, seq.opacity_step, planes[6])
    w, x, y, z = rotations(seq.rotation_step, planes[7:10])
    out["rotation0"], out["rotation1"], out["rotation2"], out["rotation3"] = w, x, y, z
    for h in range(3):
        scaled("dc%d" % h, fl(seq.dc_step * 0.015625), planes[10 + h])
    for j in range(seq.sh_planes):
        scaled("sh%d" % j, fl(seq.sh_step * 0.015625), planes[13 + j])
    return out


def expand(code, seq):
    """SS-OUT-005"""
    middle = 2 ** (seq.position_bits - 1)
    distance, linear = abs(code - middle), 2 ** seq.linear_log2
    length = distance
    if distance > linear:
        segment, rest = divmod(distance - linear, 2 ** seq.segment_log2)
        segment += 1
        length = linear + (2 ** segment - 2) * 2 ** seq.segment_log2 + rest * 2 ** segment
    return middle + length if code >= middle else middle - length


def rotations(step, planes):
    """SS-OUT-002"""
    result = ([], [], [], [])
    for r0, r1, r2 in zip(*planes):
        x = fl(step * fl(r0))
        y = fl(step * fl(r1))
        z = fl(step * fl(r2))
        total = fl(fl(fl(x * x) + fl(y * y)) + fl(z * z))
        rest = fl(1.0 - total)                      # SS-OUT-003: x, y and z stay as they are
        w = fl(math.sqrt(rest)) if rest > 0 else 0.0
        for plane, value in zip(result, (w, x, y, z)):
            plane.append(value)
    return result


def write_frame(folder, number, planes, seq, with_floats):
    os.makedirs(folder, exist_ok=True)
    for p, plane in enumerate(planes):
        with open(os.path.join(folder, "f%04d.p%02d.i32le" % (number, p)), "wb") as f:
            f.write(i32le(plane))
    if with_floats:
        for name, values in float_planes(seq, planes).items():
            with open(os.path.join(folder, "f%04d.%s.f32" % (number, name)), "wb") as f:
                f.write(struct.pack("<%df" % len(values), *values))
