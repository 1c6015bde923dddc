"""Clause 7.11: extraction, for a conforming stream."""

import struct

import constants as c
from conventions import crc32
from semantics import parse_unit_header


def rewritten(data, unit, payload):
    """A unit with a new payload; payload_length, payload_crc and header_check follow, the rest is copied."""
    head = data[unit.start:unit.start + 6]
    tail = data[unit.start + 8:unit.start + 12] + struct.pack("<II", len(payload), crc32(payload))
    return head + struct.pack("<H", crc32(head + tail) & 0xFFFF) + tail + payload


def extract(data, op_r):
    out = bytearray(data[:c.FILE_HEADER_BYTES])
    gops, frame_count, unit_count, index_offset = [], 0, 0, 0
    pos = c.FILE_HEADER_BYTES
    while True:
        unit = parse_unit_header(data, pos, 0)
        pos = unit.end
        whole = data[unit.start:unit.end]
        if unit.unit_type == c.UT_END:
            out += rewritten(data, unit, struct.pack("<IIQ", frame_count, unit_count, index_offset))
            return bytes(out)
        if op_r is not None and unit.refinement > op_r:
            continue
        if unit.unit_type == c.UT_GOP:
            gops.append((unit.frame, len(out)))
        if unit.unit_type == c.UT_FRAME:
            frame_count += 1
        if unit.unit_type == c.UT_INDEX:
            index_offset = len(out)
            entries = b"".join(struct.pack("<IIQ", frame, 0, offset) for frame, offset in gops)
            whole = rewritten(data, unit, struct.pack("<I", len(gops)) + entries)
        out += whole
        unit_count += 1
