"""Exceptions, with fields that programs can decide by. Messages may change; `kind` and `code` do not."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ._types import Damage


class Error(Exception):
    """What all exceptions of this package are.

    Attributes:
        kind: What is wrong, as a stable word. Of this class itself: "not-pushed", "not-seekable", "too-much-input",
            "too-few-slots"; "in-use" where a file object or a progress function uses the decoder or encoder that calls it;
            "cancelled" where the call that runs them was ended by Ctrl-C.
    """

    kind: str

    def __init__(self, message: str, *, kind: str) -> None:
        super().__init__(message)
        self.kind = kind


class StreamError(Error):
    """The bytes are no stream that this version decodes, or need more than the limits allow.

    Attributes:
        kind: "malformed", "invalid", "unsupported", "over-limit", "truncated": clause 9.1 of the specification.
        code: Stable name of the cause, clause 9.2: "CHECKSUM", "DIGEST", ...
        clause: The clause that is broken.
        offset: Absolute offset of the first byte at fault.
        frame: Index of the last frame that was given out before; None if there was none.
    """

    def __init__(
        self,
        message: str,
        *,
        kind: str,
        code: str | None = None,
        clause: str | None = None,
        offset: int | None = None,
        frame: int | None = None,
    ) -> None:
        super().__init__(message, kind=kind)
        self.code = code
        self.clause = clause
        self.offset = offset
        self.frame = frame


class IncompleteError(StreamError):
    """After the last frame something was missing or damaged. All frames that are left have been given out.

    Attributes:
        damage: What was lost there. The other fields are those of the first damage; kind is "lost" if there is none.
    """

    def __init__(self, message: str, *, damage: list[Damage], **fields: Any) -> None:
        super().__init__(message, **fields)
        self.damage = damage


class EncodeError(Error):
    """Frames or settings that cannot be encoded.

    Attributes:
        kind: "no-frames", "setting", "invalid-value", "out-of-grid", "too-many-gaussians", "not-announced",
            "antialiasing", "source".
        frame: The frame, from 0, if one is at fault.
        gaussian: The row in that frame, if one is.
        property: The property by its PLY name, the attribute, or the setting, if one is.
    """

    def __init__(
        self,
        message: str,
        *,
        kind: str,
        frame: int | None = None,
        gaussian: int | None = None,
        property: str | None = None,
    ) -> None:
        super().__init__(message, kind=kind)
        self.frame = frame
        self.gaussian = gaussian
        self.property = property


class SceneError(Error):
    """A scene file or a checkpoint that cannot be read.

    Attributes:
        kind: "malformed", "truncated", "unsupported", "over-limit".
        path: The file.
        offset: Where in it, if that is known.
    """

    def __init__(
        self, message: str, *, kind: str, path: Path | str | None = None, offset: int | None = None
    ) -> None:
        super().__init__(message, kind=kind)
        self.path = path
        self.offset = offset


class CommandError(Error):
    """The splatstream command failed, for another reason than a stream.

    Attributes:
        kind: "usage", "other", "interrupted": see cli/json.md.
        exit_code: Its exit code.
    """

    def __init__(self, message: str, *, kind: str, exit_code: int) -> None:
        super().__init__(message, kind=kind)
        self.exit_code = exit_code
