"""The frames of a stream, one after the other."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, BinaryIO, Union

from ._native import Decoder, Frame, Limits

if TYPE_CHECKING:
    import os
    from collections.abc import Iterator

    from ._types import Bytes, OperatingPointLike

    Source = Union[str, os.PathLike[str], Bytes, BinaryIO]

# Bytes that are read at once of what cannot seek.
_CHUNK = 1 << 18


def decode(
    source: Source,
    *,
    op: OperatingPointLike | None = None,
    frames: range | slice | None = None,
    limits: Limits | None = None,
    ahead: bool = False,
) -> Iterator[Frame]:
    """Iterates the frames of a stream.

    Args:
        source: A path, bytes, or a file object in binary mode; it is read as it is needed. One that cannot seek, as
            standard input or a socket, is decoded as it comes.
        op: The operating point, as "s0,t1,r2" or (0, 1, 2): layers and refinements up to these, of which 255 is all that
            there are; everything by default.
        frames: Which frames by their index: range(10, 20), slice(10, None), range(0, 100, 5). Decoding starts at the GOP of
            the first one if the stream has an index.
        limits: What the stream may take; the default is safe for streams of strangers.
        ahead: Decode two frames at a time where neither needs the other.

    Raises:
        ValueError: With the first frame: the stream has fewer layers or refinements than the operating point; says the highest.
        StreamError: The stream cannot be decoded at all, or not within the limits.
        IncompleteError: After the last frame: something was missing or damaged there. Damage elsewhere costs frames;
            `Frame.warnings` tell.

    Example:
        >>> for frame in gss.decode("talk.gss", op="s0,t1,r1"):
        ...     print(frame.index, frame.time, frame.position.mean(axis=0))
    """
    wanted = _wanted(frames)
    if hasattr(source, "read") and not _can_seek(source):
        return _pushed(source, wanted, Decoder(op=op, limits=limits, ahead=ahead))
    return _frames(Decoder(source, op=op, limits=limits, ahead=ahead), wanted)


def _wanted(frames: range | slice | None) -> range:
    """The frames asked for as a range that goes up."""
    frames = slice(None) if frames is None else frames
    if not isinstance(frames, (range, slice)):
        raise TypeError(f"frames is {frames!r}: give a range or a slice, as range(5, 6) for frame 5 or slice(10, None)")
    start, step = frames.start or 0, 1 if frames.step is None else frames.step
    # Indices have 32 bits.
    stop = 1 << 32 if frames.stop is None else frames.stop
    if start < 0 or stop < 0 or step < 1:
        raise ValueError(f"frames is {frames}: give numbers from 0 that go up, as range(10, 20)")
    return range(start, stop, step)


def _can_seek(file: Any) -> bool:
    seekable = getattr(file, "seekable", None)
    return bool(seekable()) if seekable is not None else hasattr(file, "seek")


def _frames(decoder: Decoder, wanted: range) -> Iterator[Frame]:
    if wanted.start > 0 and wanted:
        decoder.seek(wanted.start)
    last = wanted[-1] if wanted else -1
    while last >= 0:
        frame = decoder.next_frame()
        if frame is None or frame.index > last:
            return
        if frame.index in wanted:
            yield frame
        # What follows the last one is not decoded.
        if frame.index == last:
            return


def _pushed(file: Any, wanted: range, decoder: Decoder) -> Iterator[Frame]:
    # What can be read now is better than as much as was asked for.
    read = getattr(file, "read1", file.read)
    last = wanted[-1] if wanted else -1
    while not decoder.is_finished:
        data = read(_CHUNK)
        if data:
            decoder.push(data)
        else:
            decoder.end()
        for frame in decoder:
            if frame.index > last:
                return
            if frame.index in wanted:
                yield frame
            if frame.index == last:
                return
        if not data:
            return
