"""Clause 7.11: extraction, for a conforming stream."""

import struct

from . import constants as c
from .conventions import ByteReader, crc32
from .frame import Gop
from .points import belongs
from .semantics import (parse_file_header, parse_gop_header, parse_points, parse_sequence_parameters,
                        parse_unit_header)


def rewritten(data, unit, payload):
    """A unit with a new payload; payload_length, payload_crc and header_check follow, the rest is copied."""
    head = data[unit.start:unit.start + 6]
    tail = data[unit.start + 8:unit.start + 12] + struct.pack("<II", len(payload), crc32(payload))
    return head + struct.pack("<H", crc32(head + tail) & 0xFFFF) + tail + payload


def extract(data, point):
    """The bytes of the extraction at an operating point (op_s, op_t, op_r)."""
    profile = parse_file_header(data).profile
    out = bytearray(data[:c.FILE_HEADER_BYTES])
    gops, frame_count, unit_count, index_offset = [], 0, 0, 0
    seq, gop = None, None
    pos = c.FILE_HEADER_BYTES
    while True:
        unit = parse_unit_header(data, pos)
        pos = unit.end
        kind = unit.unit_type
        whole = data[unit.start:unit.end]
        reader = ByteReader(data, unit.payload_start, unit.end)
        if kind == c.UT_END:
            out += rewritten(data, unit, struct.pack("<IIQ", frame_count, unit_count, index_offset))
            return bytes(out)
        if kind == c.UT_SEQUENCE:
            seq = parse_sequence_parameters(reader, profile)
        if kind == c.UT_GOP:
            gops.append((unit.frame, len(out)))
            gop = Gop(parse_gop_header(reader, unit, profile, seq.temporal_layer_count), unit.frame)
        if kind == c.UT_POINTS:
            kept = b"".join(data[entry.at("spatial_layer"):entry.at("spatial_layer") + 24]
                            for entry in parse_points(reader)
                            if all(a <= b for a, b in zip(entry.point, point)))
            whole = rewritten(data, unit, struct.pack("<HH", len(kept) // 24, 0) + kept)
        elif kind == c.UT_INDEX:
            index_offset = len(out)
            entries = b"".join(struct.pack("<IIQ", frame, 0, offset) for frame, offset in gops)
            whole = rewritten(data, unit, struct.pack("<I", len(gops)) + entries)
        elif not belongs(unit, point, seq, gop):
            continue
        if kind == c.UT_FRAME:
            frame_count += 1
        out += whole
        unit_count += 1
