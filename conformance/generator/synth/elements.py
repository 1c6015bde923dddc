"""Increments and frame_headers as records that can be changed: elements that flags make present (5.6, 5.14)."""

import struct

from oracle.conventions import ByteReader
from .encoding import leb

CODES = {"u8": "B", "i8": "b", "u16": "H", "u32": "I", "u64": "Q"}


class Layout:
    """head: (element, type) that are always there; parts: bit of `flags` -> (element, type, value if absent) that it brings."""

    def __init__(self, flags, head, parts):
        self.flags, self.head, self.parts = flags, head, parts
        self.bits = {row[0]: bit for bit, rows in parts.items() for row in rows}


INCREMENT = Layout("increment_flags", (("increment_flags", "u16"), ("refinement_digest", "u64")), {
    0: (("parent_count", "leb", 0),),
    1: (("move_count", "leb", 0),),
    2: (("update_count", "leb", 0),),
    3: (("remove_count", "leb", 0),),
    4: (("new_count", "leb", 0),),
    5: (("position_shift", "u8", 0),),
    6: (("attribute_step", "steps", (0,) * 5),),
    7: (("predictor_block_log2", "u8", None), ("neighbour_count", "u8", 1), ("bilateral_spatial", "u8", 0),
        ("bilateral_feature", "u8", 0)),
    8: (("sh_mode", "u8", 0), ("vq_stage_count", "stages", 0), ("codebook_ids", "books", ())),
    9: (("compensation_log_scale", "i8", 0), ("compensation_opacity", "i8", 0)),
    10: (("move_block_log2", "u8", None),),
    11: (("extrapolates_opacity", "flag", 0),)})
FRAME = Layout("frame_flags", (("frame_type", "u8"), ("dc_transform_id", "u8"), ("sh_transform_id", "u8"), ("frame_flags", "u8"),
                               ("gaussian_count", "u32")), {
    0: (("carried_digest", "u64", 0),),
    1: (("cell_count", "leb", 0), ("cell_log2", "u8", 0))})


class Elements:
    """The elements of one record by name; `rest` are the bytes after them."""

    def __init__(self, layout, **values):
        self.layout, self.rest = layout, b""
        for name, _ in layout.head:
            setattr(self, name, 0)
        for rows in layout.parts.values():
            for name, _, absent in rows:
                setattr(self, name, list(absent) if isinstance(absent, tuple) else absent)
        for name, value in values.items():
            setattr(self, name, value)

    @property
    def predictors(self):
        """Whether an increment has them; as in the record of the oracle."""
        return self.predictor_block_log2 is not None

    @property
    def predicts_moves(self):
        """Whether an increment has move predictors; as in the record of the oracle."""
        return self.move_block_log2 is not None

    @classmethod
    def parse(cls, layout, payload):
        u, reader = cls(layout), ByteReader(payload, 0, len(payload))
        for name, kind in u.rows():
            setattr(u, name, u.read(reader, kind))
        u.rest = payload[reader.pos:]
        return u

    def rows(self):
        """(element, type) of the elements that are present; what follows flags is asked for after they were read."""
        yield from self.layout.head
        for bit, rows in self.layout.parts.items():
            if getattr(self, self.layout.flags) >> bit & 1:
                yield from ((name, kind) for name, kind, _ in rows)

    def read(self, reader, kind):
        if kind in ("stages", "books") and self.sh_mode != 2:
            return 0 if kind == "stages" else []
        if kind == "flag":                          # the bit itself is the element
            return 1
        if kind == "leb":
            return reader.leb128("5.14")
        if kind in ("steps", "books"):
            return list(reader.values("u8", 5 if kind == "steps" else self.vq_stage_count, "5.14"))
        return reader.value("u8" if kind == "stages" else kind, "5.14")

    def written(self, kind, value):
        if kind == "flag" or kind in ("stages", "books") and self.sh_mode != 2:
            return b""
        if kind == "leb":
            return leb(value)
        if kind in ("steps", "books"):
            return bytes(value)
        return struct.pack("<" + CODES.get(kind, "B"), value)

    def bytes(self):
        return b"".join(self.written(kind, getattr(self, name)) for name, kind in self.rows()) + self.rest

    def length(self):
        """Bytes of the elements."""
        return len(self.bytes()) - len(self.rest)

    def present(self, name):
        """Sets the flag of an element."""
        if name in self.layout.bits:
            setattr(self, self.layout.flags, getattr(self, self.layout.flags) | 1 << self.layout.bits[name])

    def set(self, name, value, index=None):
        """Changes an element, which is present afterwards."""
        self.present(name)
        if index is not None and isinstance(getattr(self, name), list):
            value = [*getattr(self, name)[:index], value, *getattr(self, name)[index + 1:]]
        setattr(self, name, value)

    def needed(self):
        """Flags of the parts that have an element other than what it is if absent."""
        return sum(1 << bit for bit, rows in self.layout.parts.items()
                   if any(getattr(self, name) != (list(absent) if isinstance(absent, tuple) else absent)
                          for name, _, absent in (rows[:1] if bit == 7 else rows)))
