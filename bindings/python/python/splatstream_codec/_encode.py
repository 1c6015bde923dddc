"""From frames to a stream."""

from __future__ import annotations

import json
import os
import tempfile
import warnings as python_warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, Any, BinaryIO, Callable, Optional, TypedDict, Union

from . import _native
from ._checkpoint import as_gaussians
from ._errors import Error
from ._native import Gaussians
from ._types import OperatingPoint

if TYPE_CHECKING:
    from types import TracebackType
    from typing import Literal

    from typing_extensions import Unpack

    from ._checkpoint import FrameLike
    from ._types import OperatingPointLike

    Output = Union[str, os.PathLike[str], BinaryIO]
    Progress = Callable[[int, Optional[int]], object]


class EncodeOptions(TypedDict, total=False):
    """What `encode` and `Encoder` take by keyword: the options of `splatstream encode`, whose help says more of each.

    quality: How close pictures of the stream are to those of the frames: "low" (40 dB), "medium" (45), "high" (50, the
        default), "visually-lossless" (57).
    psnr: The same in decibels, 20 to 90.
    target_bpg, target_mb: The size instead: bits per Gaussian, or megabytes of the stream. The latter needs a sequence.
    preset: "fast", "balanced" (the default) or "small".
    gop: Frames in a GOP; decoding can start at each.
    layers: Spatial layers by the height in lines that each is meant for, as (540, 720, 1080).
    temporal_layers: 1 to 4: 1 is I P P P, 2 is I B P B P, more are dyadic.
    all_intra: Code every frame by itself.
    refinements: Share of the Gaussians up to each refinement, percent, as (10, 20, 30, 50, 100); or "auto:5": so many, where
        pictures gain most.
    sh_degree: Highest degree of spherical harmonics kept.
    sh: "auto", "coefficients" or "vq".
    fps: Frames per second, as 30, 29.97 or Fraction(30000, 1001).
    keep_invisible: Keep Gaussians whose opacity is below 1/255 everywhere.
    prune: Leave out the Gaussians that pictures miss least, down to this PSNR of pictures without them, decibels.
    drop_invalid: Leave out Gaussians with values that are not finite; otherwise they are an error.
    importance: "removal", "contribution", "footprint" or "volume": what puts Gaussians into the first refinements.
    cameras: Views to measure in: a cameras.json or transforms.json, "ring:8" or "forward:8".
    up: What points up: "-y", "y", "-z", "z", "-x" or "x"; guessed by default.
    background: Red, green and blue around the scene, each 0 to 1.
    title: What the scene is called.
    metres_per_unit: Metres that a unit of the scene stands for.
    fidelity: "pictures" or "attributes": what predicted frames are true to.
    tolerance: How far pictures of predicted frames may be below, decibels.
    anchor: "nested" or "whole".
    predictor: "auto", "none", "knn", "bilateral" or "transformer".
    network: "registered", "trained" or a file of `splatstream train`.
    choose_by: "bits" or "l1": how a predictor is chosen.
    neighbours: Neighbours of a prediction, 1 to 16.
    without: Tools to leave out, to see what each is worth.
    finetune: Choose values by pictures of what is decoded, in so many iterations at most; True is 200.
    finetune_state: A directory that has how far that has come until the stream is written, for a run with `resume`.
    resume: Go on with what a run that was killed has left there, of the same frames and options, or begin.
    finetune_only: Attributes to fit, as ("position", "log-scale", "rotation", "opacity", "dc", "sh"); all by default.
    finetune_lines: Lines of the pictures to fit to, in turn.
    finetune_loss: What pictures are fitted by: "squared" (the default) or "l1-ssim", the loss that scenes are trained with.
    optimise_for: Operating points that matter and what a decibel at each is worth, as {"s0,t0,r1": 1, "s2,t0,r4": 3}.
    images: A folder of photographs to fit a single frame to, those that `cameras` names.
    height: Lines to reduce these photographs to.
    time_budget: Seconds that encoding may take; the preset and the iterations follow from it. It needs a sequence.
    gop_memory: Memory that GOPs coded at the same time may take together, as "2G" or bytes.
    max_memory: Most memory that encoding may take, as "4G" or bytes; by default three quarters of what the machine has free. Frames
        that take more are refused.
    """

    quality: Literal["low", "medium", "high", "visually-lossless"]
    psnr: float
    target_bpg: float
    target_mb: float
    preset: Literal["fast", "balanced", "small"]
    gop: int
    layers: Sequence[int]
    temporal_layers: int
    all_intra: bool
    refinements: Sequence[int] | str
    sh_degree: int
    sh: Literal["auto", "coefficients", "vq"]
    fps: float | Fraction
    keep_invisible: bool
    prune: float
    drop_invalid: bool
    importance: Literal["removal", "contribution", "footprint", "volume"]
    cameras: str | os.PathLike[str]
    up: Literal["-y", "y", "-z", "z", "-x", "x"]
    background: Sequence[float]
    title: str
    metres_per_unit: float
    fidelity: Literal["pictures", "attributes"]
    tolerance: float
    anchor: Literal["nested", "whole"]
    predictor: Literal["auto", "none", "knn", "bilateral", "transformer"]
    network: str | os.PathLike[str]
    choose_by: Literal["bits", "l1"]
    neighbours: int
    without: Sequence[str]
    finetune: int | Literal[True]
    finetune_state: str | os.PathLike[str]
    resume: bool
    finetune_only: Sequence[str]
    finetune_lines: Sequence[int]
    finetune_loss: Literal["squared", "l1-ssim"]
    optimise_for: Mapping[OperatingPointLike, float]
    images: str | os.PathLike[str]
    height: int
    time_budget: float
    gop_memory: int | str
    max_memory: int | str


class EncodeWarning(UserWarning):
    """What a user should know of a stream that was encoded: a quality or a size that was missed, values that were changed."""


@dataclass(frozen=True)
class EncodeResult:
    """A stream that was encoded.

    Attributes:
        data: The stream, if it was not written elsewhere.
        report: What `splatstream encode --json` prints: sizes, PSNR, GOPs, choices, warnings, digests; see cli/json.md.
    """

    data: bytes | None
    report: dict[str, Any]

    @property
    def size(self) -> int:
        """Bytes of the stream."""
        return int(self.report["bytes"])

    @property
    def frames(self) -> int:
        """Frames of the stream."""
        return int(self.report["frames"])

    @property
    def bits_per_gaussian(self) -> float:
        """Bits for each Gaussian of each frame, everything counted."""
        return float(self.report["bpg"])

    @property
    def psnr(self) -> float | None:
        """PSNR of pictures of the stream, decoded again, decibels; None if they show nothing."""
        return None if self.report["psnr_db"] is None else float(self.report["psnr_db"])

    def __bytes__(self) -> bytes:
        if self.data is None:
            raise ValueError("the stream was written to a file: read that")
        return self.data

    def __repr__(self) -> str:
        psnr = "" if self.psnr is None else f", {self.psnr:.1f} dB"
        return f"<EncodeResult: {self.frames} frames, {self.size} bytes, {self.bits_per_gaussian:.1f} bits per Gaussian{psnr}>"


def encode(
    frames: FrameLike | Iterable[FrameLike],
    out: Output | None = None,
    *,
    progress: Progress | None = None,
    **options: Unpack[EncodeOptions],
) -> EncodeResult:
    """Encodes frames to a stream.

    A sequence, such as a list of paths, is looked at twice, and frames are asked for one by one when they are needed. Any
    other iterable, such as a generator, is encoded as it comes: memory is that of a GOP, however long it is. That stream is
    slightly larger, because its beginning does not know the later frames.

    Args:
        frames: One frame, or a sequence or an iterable of frames. A frame is `Gaussians`, a `Frame`, a path of a scene file
            or checkpoint, or a mapping of arrays: with the names of `Gaussians`, or of gsplat (means, scales, quats,
            opacities, sh0, shN).
        out: A path, which appears when the stream is whole, or a file object; without it the result has the bytes.
        progress: Called with the number of frames that are coded, and of all frames or None. Where a quality or a size is
            asked for, frames may be coded several times.
        options: See `EncodeOptions`.

    Raises:
        EncodeError: Frames that cannot be encoded; says which frame, Gaussian and property.
        ValueError: Options that make no sense, arrays that do not fit together.
        KeyboardInterrupt: Ctrl-C ended it, before the next frame; nothing is left behind.

    Example:
        >>> gss.encode(sorted(glob("frames/*.ply")), "talk.gss", gop=16)
        <EncodeResult: 32 frames, 542918 bytes, 4.3 bits per Gaussian, 50.1 dB>
        >>> stream = gss.encode(gaussians, quality="visually-lossless").data
    """
    one = _one(frames)
    if one is None and not isinstance(frames, Sequence):
        with Encoder(out, progress=progress, **options) as encoder:
            for frame in frames:  # type: ignore[union-attr]
                encoder.push(frame)
        return encoder.result
    sequence: Sequence[Any] = frames if one is None else [one]  # type: ignore[assignment]
    words = _words(options)
    with _Whole(out) as whole:
        data, report = _native.encode_sequence(
            lambda number: as_gaussians(sequence[number]), len(sequence), whole.target, words, progress
        )
    return _result(data, report)


class Encoder:
    """Encodes frames as they come: each GOP is written once its frames are there, and one more.

    Args:
        out: A path, which appears when the stream is whole, or a file object; without it the result has the bytes.
        progress: Called with the number of frames that are coded, and None. It cannot use the encoder, and neither can a
            file object that is written to: that is an Error (kind "in-use").
        options: See `EncodeOptions`.

    Example:
        >>> with gss.Encoder("live.gss", gop=8) as encoder:
        ...     for frame in camera:
        ...         encoder.push(frame)
        >>> encoder.result.size
        184320
    """

    def __init__(
        self, out: Output | None = None, *, progress: Progress | None = None, **options: Unpack[EncodeOptions]
    ) -> None:
        words = _words(options)
        self._whole = _Whole(out)
        self._result: EncodeResult | None = None
        self._whole.__enter__()
        try:
            self._encoder = _native.Encoder(self._whole.target, words, progress)
        except BaseException:
            self._whole.discard()
            raise

    def push(self, frame: FrameLike) -> None:
        """Takes the next frame, and codes the GOP that it completes.

        After an error no stream comes of what was written.
        """
        self._encoder.push(as_gaussians(frame))

    def finish(self) -> EncodeResult:
        """Codes the rest, and ends the stream."""
        try:
            data, report = self._encoder.finish()
        except BaseException as error:
            # The call that has the encoder still writes.
            if not (isinstance(error, Error) and error.kind == "in-use"):
                self._whole.discard()
            raise
        self._whole.keep()
        self._result = _result(data, report)
        return self._result

    @property
    def result(self) -> EncodeResult:
        """The stream, once it has ended."""
        if self._result is None:
            raise ValueError("the stream has not ended: call finish()")
        return self._result

    def __enter__(self) -> Encoder:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if error is None and self._result is None:
            self.finish()
        elif error is not None:
            self._whole.discard()


def _one(frames: Any) -> Any:
    """What is one frame and not several."""
    is_frame = isinstance(frames, (Gaussians, Mapping, str, os.PathLike)) or hasattr(frames, "keys")
    return frames if is_frame else None


def _words(options: Mapping[str, Any]) -> list[str]:
    """Options in the words of the command line."""
    words = []
    for name, value in options.items():
        if name not in EncodeOptions.__annotations__:
            known = ", ".join(EncodeOptions.__annotations__)
            raise TypeError(f"there is no option {name!r}; there are {known}")
        if value is None or value is False:
            continue
        flag = "--" + name.replace("_", "-")
        if isinstance(value, Mapping):
            value = ",".join(f"{_point(point)}={weight}" for point, weight in value.items())
        elif isinstance(value, Fraction):
            value = f"{value.numerator}/{value.denominator}"
        elif not isinstance(value, (str, os.PathLike)) and isinstance(value, Iterable):
            value = ",".join(map(str, value))
        words.append(flag if value is True else f"{flag}={os.fspath(value) if isinstance(value, os.PathLike) else value}")
    return words


def _point(point: OperatingPointLike) -> str:
    return point if isinstance(point, str) else str(OperatingPoint(*point))


def _result(data: bytes | None, report: str) -> EncodeResult:
    told = json.loads(report)
    # A stream in memory or at a path of the caller's has no other name.
    told.pop("output", None)
    told.pop("page_bytes", None)
    for warning in told["warnings"]:
        python_warnings.warn(warning["message"], EncodeWarning, stacklevel=3)
    return EncodeResult(data, told)


class _Whole:
    """A file that appears whole or not at all; memory and file objects are left as they are."""

    def __init__(self, out: Output | None) -> None:
        self.target: Any = out
        self._path: str | None = None
        self._folder: tempfile.TemporaryDirectory[str] | None = None
        if isinstance(out, (str, os.PathLike)):
            self._path = os.path.realpath(os.fspath(out))

    def __enter__(self) -> _Whole:
        if self._path is not None:
            parent = os.path.dirname(self._path)
            if os.path.isdir(self._path):
                raise IsADirectoryError(f"{self._path} is a directory: give the stream a name")
            # Beside it, so that it can be renamed; a file in it has the usual permissions.
            self._folder = tempfile.TemporaryDirectory(prefix=".splatstream-", dir=parent)
            self.target = os.path.join(self._folder.name, "stream.gss")
        return self

    def keep(self) -> None:
        """Gives the file its name."""
        if self._path is not None and self._folder is not None:
            os.replace(self.target, self._path)
        self.discard()

    def discard(self) -> None:
        """Leaves nothing behind."""
        if self._folder is not None:
            self._folder.cleanup()
            self._folder = None

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if error is None:
            self.keep()
        else:
            self.discard()
