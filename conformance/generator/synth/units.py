"""Streams as lists of units that can be changed; writing makes checksums, index and end unit right."""

import struct

from oracle import constants as c, syntax
from oracle.conventions import STRUCT_CODE, TYPE_BYTES
from oracle.semantics import parse_unit_header
from .elements import FRAME, INCREMENT, Elements
from .encoding import unit

FIXED_PARTS = {c.UT_SEQUENCE: syntax.SEQUENCE_PARAMETERS, c.UT_GOP: syntax.GOP_HEADER,
               c.UT_TRANSFORM: syntax.TRANSFORM_FIXED, c.UT_CODEBOOK: syntax.CODEBOOK_FIXED,
               c.UT_INDEX: syntax.INDEX_FIXED + syntax.INDEX_ENTRY, c.UT_END: syntax.END,
               c.UT_POINTS: syntax.POINTS_FIXED + syntax.OPERATING_POINT,
               c.UT_WEIGHTS: syntax.WEIGHTS_FIXED + syntax.NETWORK_FIXED}
LAYOUTS = {c.UT_FRAME: FRAME, c.UT_INCREMENT: INCREMENT}


class Unit:
    """A unit that can be changed; `raw` replaces bytes of the written unit after its checksums were made."""

    def __init__(self, header, payload):
        self.kind, self.flags = header.unit_type, header.unit_flags
        self.s, self.t, self.r = header.spatial_layer, header.temporal_layer, header.refinement
        self.frame, self.payload = header.frame, payload
        self.reserved = 0
        self.raw = ()

    def copy(self, **values):
        other = Unit.__new__(Unit)
        other.__dict__.update(self.__dict__, **values)
        return other

    def bytes(self):
        data = bytearray(unit(self.kind, self.payload, self.frame, self.r, self.flags, self.s, self.t, self.reserved))
        for at, value in self.raw:
            data[at] ^= value
        return bytes(data)

    def size(self):
        return c.UNIT_HEADER_BYTES + len(self.payload)

    def elements(self):
        """The elements of an increment or a frame_header."""
        return Elements.parse(LAYOUTS[self.kind], self.payload)

    def element(self, name, index=0):
        """(offset in the payload, type) of an element, the later one where a name stands twice."""
        offset, found = 0, None
        for element, kind, count, _ in FIXED_PARTS[self.kind]:
            if element == name:
                found = offset + index * TYPE_BYTES[kind], STRUCT_CODE[kind]
            offset += TYPE_BYTES[kind] * count
        return found

    def get(self, name, index=0):
        if self.kind in LAYOUTS:
            value = getattr(self.elements(), name)
            return value[index] if isinstance(value, list) else value
        at, kind = self.element(name, index)
        return struct.unpack_from("<" + kind, self.payload, at)[0]

    def set(self, name, value, index=0):
        if self.kind in LAYOUTS:
            u = self.elements()
            u.set(name, value, index)
            self.payload = u.bytes()
            return
        at, kind = self.element(name, index)
        payload = bytearray(self.payload)
        struct.pack_into("<" + kind, payload, at, value)
        self.payload = bytes(payload)


def units_of(data):
    pos, units = c.FILE_HEADER_BYTES, []
    while pos < len(data):
        header = parse_unit_header(data, pos)
        units.append(Unit(header, bytes(data[header.payload_start:header.end])))
        pos = header.end
    return data[:c.FILE_HEADER_BYTES], units


def stream_of(head, units, keep_end=False):
    """The bytes, with entries of the index and the elements of the end unit made right."""
    out, gops, index_offset = bytearray(head), [], 0
    for count, u in enumerate(units):
        if u.kind == c.UT_GOP:
            gops.append((u.frame, len(out)))
        if u.kind == c.UT_INDEX and not keep_end:
            index_offset = len(out)
            u = u.copy(payload=struct.pack("<I", len(gops)) + b"".join(struct.pack("<IIQ", f, 0, at) for f, at in gops))
        if u.kind == c.UT_END and not keep_end:
            frames = sum(v.kind == c.UT_FRAME for v in units[:count])
            u = u.copy(payload=struct.pack("<IIQ", frames, count, index_offset))
        out += u.bytes()
    return bytes(out)


def offset_of(head, units, number):
    """Offset in the stream of a unit."""
    return len(head) + sum(u.size() for u in units[:number])
