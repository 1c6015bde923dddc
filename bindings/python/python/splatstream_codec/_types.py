"""Plain data that decoders give."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Tuple, Union

# What functions take as bytes, and as an operating point.
Bytes = Union[bytes, bytearray, memoryview]
OperatingPointLike = Union[str, Tuple[int, int, int]]


class OperatingPoint(NamedTuple):
    """What of a stream is decoded: layers and refinements up to these numbers, each from 0. Printed as s0,t1,r2."""

    spatial: int
    temporal: int
    refinement: int

    def __str__(self) -> str:
        return f"s{self.spatial},t{self.temporal},r{self.refinement}"


@dataclass(frozen=True)
class Damage:
    """Something that was lost on the way to a frame.

    Attributes:
        message: What, in words.
        kind: "lost", or the class of the damage: "malformed", "invalid", "unsupported", "truncated".
        code: Stable name of the cause, clause 9.2 of the specification: "CHECKSUM", "DIGEST", ...; None for lost frames.
        clause: The clause of the specification that is broken; None for lost frames.
        offset: Absolute offset of the first byte at fault; None for lost frames.
        frames: Indices of lost frames; None otherwise.
    """

    message: str
    kind: str
    code: str | None = None
    clause: str | None = None
    offset: int | None = None
    frames: range | None = None

    def __str__(self) -> str:
        return self.message
