"""How the entropy-coded sections of a unit were decoded, as one number (conformance/README.md)."""

import struct

from .conventions import xxh64


def entropy_state(sections):
    """The digest of a unit; a section is (planes, models, blocks after decoding)."""
    out = bytearray()
    for planes, models, blocks in sections:
        for block in blocks:
            out += struct.pack("<%dI" % block.lanes, *block.x) + struct.pack("<I", block.size)
        for plane, model in zip(planes, models):
            values = [value + model.bias for block in blocks for value in block.e[plane.number]]
            # the only values that need more than 32 bits are those of the position alphabet
            out += struct.pack("<%d%s" % (len(values), "Q" if plane.alphabet == "position" else "i"), *values)
    return xxh64(0, bytes(out))
