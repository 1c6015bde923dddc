"""Clause 7.4.5: counts of a refinement; and planes as bytes."""

import struct


def prefix_count(seq, gaussian_count, r):
    """SS-RU-001: P(r)"""
    if r < 0:
        return 0
    return (seq.refinement_percent[r] * gaussian_count + 99) // 100


def i32le(values):
    return struct.pack("<%di" % len(values), *values)
