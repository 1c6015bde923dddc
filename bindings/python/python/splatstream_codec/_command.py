"""What commands print, as dictionaries: the `splatstream` command of this package runs beside this program."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any, Union

from ._checkpoint import as_gaussians
from ._errors import CommandError, StreamError
from ._native import Gaussians

if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Literal

    from ._checkpoint import FrameLike

    Scene = Union[FrameLike, bytes, Sequence[FrameLike]]


def compare(
    a: Scene,
    b: Scene,
    *,
    cameras: str | os.PathLike[str] | None = None,
    height: int | None = None,
    up: Literal["-y", "y", "-z", "z", "-x", "x"] | None = None,
    background: Sequence[float] | None = None,
    match: Literal["auto", "order", "nearest"] = "auto",
) -> dict[str, Any]:
    """Compares two scenes or streams frame by frame: the error of each attribute and, with cameras, of pictures.

    Args:
        a, b: Each a path of a stream, of a scene file or of a folder of frames; the bytes of a stream; Gaussians; or a list
            of frames as `encode` takes them. A is the reference.
        cameras: Draw both from these cameras and compare pictures: a cameras.json or transforms.json, "ring:8" or
            "forward:8".
        height: Rows of the pictures.
        up: What points up, for cameras that are made; guessed by default.
        background: Red, green and blue around the scene, each 0 to 1.
        match: How Gaussians find their partners.

    Returns:
        The keys of `splatstream compare --json`, described in cli/json.md: `attributes`, `psnr_db`, `ssim`, ...

    Raises:
        StreamError: A stream is damaged.
        CommandError: Anything else.

    Example:
        >>> gss.compare("garden.ply", "garden.gss", cameras="ring:8")["psnr_db"]
        50.06
    """
    words = ["compare", f"--match={match}"]
    for name, value in (("cameras", cameras), ("height", height), ("up", up)):
        if value is not None:
            words.append(f"--{name}={os.fspath(value) if isinstance(value, os.PathLike) else value}")
    if background is not None:
        words.append(f"--background={','.join(map(str, background))}")
    with tempfile.TemporaryDirectory(prefix="splatstream-") as folder:
        paths = [_on_disk(scene, Path(folder) / name) for scene, name in ((a, "a"), (b, "b"))]
        report: dict[str, Any] = _report([*words, "--", *paths])
        return report


def inspect(
    stream: str | os.PathLike[str] | bytes,
    view: Literal["tree", "units", "ops", "deps", "stats"] = "tree",
) -> Any:
    """What a stream consists of.

    Args:
        stream: A path, or the bytes.
        view: "tree": every element, its place, value, meaning and clause; "units": a line a unit; "ops": what every
            operating point costs and looks like; "deps": what needs what; "stats": what each attribute costs.

    Returns:
        The keys of `splatstream inspect --json`, described in cli/json.md.

    Raises:
        StreamError: The stream is damaged. What could be read of it is its attribute `report`.
        CommandError: Anything else.

    Example:
        >>> for point in gss.inspect("talk.gss", "ops"):
        ...     print(point["op"], point["bytes"], point["psnr_db"])
    """
    words = ["inspect", f"--{view}"]
    if isinstance(stream, (bytes, bytearray, memoryview)):
        return _report([*words, "-"], bytes(stream))
    return _report([*words, "--", os.fspath(stream)])


def _on_disk(scene: Any, path: Path) -> str:
    """A path of what is in memory."""
    if isinstance(scene, (str, os.PathLike)):
        return os.fspath(scene)
    if isinstance(scene, (bytes, bytearray, memoryview)):
        stream = path.with_suffix(".gss")
        stream.write_bytes(scene)
        return str(stream)
    path.mkdir()
    frames = [scene] if isinstance(scene, Gaussians) or hasattr(scene, "keys") else scene
    for number, frame in enumerate(frames):
        as_gaussians(frame).save_ply(path / f"{number:06}.ply")
    return str(path)


def _report(words: list[str], stdin: bytes | None = None) -> Any:
    # The same package, wherever this program has found it.
    package = str(Path(__file__).resolve().parent.parent)
    paths = [package, *filter(None, [os.environ.get("PYTHONPATH")])]
    done = subprocess.run(
        [sys.executable, "-m", __package__, *words[:1], "--json", *words[1:]],
        input=stdin,
        stdin=subprocess.DEVNULL if stdin is None else None,
        capture_output=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(paths)},
        check=False,
    )
    text = done.stderr.decode(errors="replace").strip()
    try:
        report = json.loads(done.stdout)
    except ValueError:
        report = None
    if done.returncode == 0 and report is not None:
        return report
    raise _failure(report, text, done.returncode)


def _failure(report: Any, text: str, exit_code: int) -> Exception:
    """The exception for a command that has failed, with or without a report."""
    error = report.get("error") if isinstance(report, dict) else None
    # A command that prints a report of a damaged stream says there what is wrong, under one of these keys.
    faults = [error] if isinstance(error, dict) else []
    if isinstance(report, dict):
        faults += [fault for key in ("errors", "errors_a", "errors_b") for fault in report.get(key) or []]
    fault = next((fault.get("fault") or fault for fault in faults if fault.get("fault") or "class" in fault), None)
    if fault is None:
        words = error if isinstance(error, dict) else {"kind": "other", "message": text}
        return CommandError(words["message"], kind=words["kind"], exit_code=exit_code)
    failure = StreamError(
        text or fault["message"], kind=fault["class"], code=fault["code"], clause=fault["clause"], offset=fault["byte"]
    )
    failure.report = report  # type: ignore[attr-defined]
    return failure
