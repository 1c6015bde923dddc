"""Gaussians of trainers: checkpoints of gsplat, nerfstudio and the code of the original paper, and frames of any kind."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Protocol, Union

import numpy as np

from ._errors import SceneError
from ._native import Gaussians
from ._tensors import load_tensors

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    class _Arrays(Protocol):
        """Names and arrays: a dictionary, or a ParameterDict."""

        def keys(self) -> Any: ...
        def __getitem__(self, name: str, /) -> Any: ...

    FrameLike = Union[Gaussians, str, os.PathLike[str], _Arrays]

# The constant basis function, 1 / (2 sqrt(pi)).
_C0 = 0.28209479177387814

# Names of the attributes in files of trainers.
_GSPLAT = ("means", "scales", "quats", "opacities", "sh0", "shN")
_NERFSTUDIO = ("means", "scales", "quats", "opacities", "features_dc", "features_rest")
_OWN = ("position", "log_scale", "rotation", "opacity_logit", "dc")

_CHECKPOINTS = (".pt", ".pth", ".ckpt")


def from_checkpoint(path: str | os.PathLike[str], *, antialiased: bool = False) -> Gaussians:
    """Reads the Gaussians of a checkpoint.

    * gsplat: `ckpts/ckpt_29999_rank0.pt` of `simple_trainer.py`
    * nerfstudio: `nerfstudio_models/step-000029999.ckpt` of splatfacto
    * the code of the original paper: `chkpnt30000.pth`

    PyTorch is not needed, and nothing in the file is run: of its pickled data only tensors in plain containers are read.

    Args:
        path: A file that `torch.save` has written.
        antialiased: Whether the renderer that it was trained with makes up for its low-pass filter (gsplat:
            `rasterize_mode="antialiased"`). A checkpoint does not say.

    Raises:
        SceneError: A file of another kind, or with other content than Gaussians.

    Example:
        >>> gss.encode(gss.from_checkpoint("results/garden/ckpts/ckpt_29999_rank0.pt"), "garden.gss")
    """
    saved = load_tensors(path)
    try:
        return from_splats(_splats(saved), antialiased=antialiased)
    except (KeyError, ValueError) as error:
        raise SceneError(
            f"{os.fspath(path)}: {error.args[0]}", kind="unsupported", path=os.fspath(path)
        ) from error


def _splats(saved: Any) -> Mapping[str, Any]:
    """The attributes in what was saved, under names of gsplat or nerfstudio."""
    if isinstance(saved, Mapping):
        if isinstance(saved.get("splats"), Mapping):
            return saved["splats"]  # type: ignore[no-any-return]
        if isinstance(saved.get("pipeline"), Mapping):
            prefixes = ("_model.gauss_params.", "_model.")
            state = saved["pipeline"]
            for prefix in prefixes:
                if prefix + "means" in state:
                    return {name: state[prefix + name] for name in _NERFSTUDIO if prefix + name in state}
        if "means" in saved:
            return saved
    # (capture(), iteration): degree, position, dc, rest, scales, rotations, opacities, and what the optimiser has.
    captured = saved[0] if isinstance(saved, tuple) and saved else None
    if isinstance(captured, tuple) and len(captured) >= 7:
        _, means, sh0, rest, scales, quats, opacities = captured[:7]
        return {"means": means, "sh0": sh0, "shN": rest, "scales": scales, "quats": quats, "opacities": opacities}
    found = ", ".join(map(str, saved)) if isinstance(saved, Mapping) else type(saved).__name__
    raise KeyError(
        f"no Gaussians are in this checkpoint, only {found}; give one of gsplat, splatfacto or the original code, or the "
        "scene as a .ply"
    )


def from_splats(splats: Any, *, antialiased: bool = False) -> Gaussians:
    """Gaussians of the parameters of a trainer, without a file: arrays or tensors by name, on any device.

    Args:
        splats: With names of gsplat (means, scales, quats, opacities, sh0, shN) or of splatfacto (features_dc and
            features_rest instead of the last two), values before any activation.
        antialiased: As in `from_checkpoint`.

    Example:
        >>> encoder.push(gss.from_splats(runner.splats))
    """
    keys = set(splats.keys())
    names = _NERFSTUDIO if "features_dc" in keys else _GSPLAT
    missing = [name for name in names[:5] if name not in keys]
    if missing:
        raise KeyError(
            f"{', '.join(missing)} is not among the parameters, which are {', '.join(sorted(map(str, keys)))}; colours must be "
            "spherical harmonics, not features of a network"
        )
    means, scales, quats, opacities, dc = (_array(splats[name]) for name in names[:5])
    rest = _array(splats[names[5]]) if names[5] in keys else np.empty((len(means), 0, 3), np.float32)
    if names is _NERFSTUDIO and rest.size == 0:
        # Without harmonics splatfacto keeps colours before the sigmoid.
        dc = (1 / (1 + np.exp(-dc.astype(np.float64))) - 0.5) / _C0
    return Gaussians(
        means, scales, quats, opacities.reshape(-1), dc.reshape(len(means), 3), rest.reshape(len(means), -1, 3),
        antialiased=antialiased,
    )


def _array(values: ArrayLike | Any) -> np.ndarray[Any, np.dtype[Any]]:
    if hasattr(values, "detach"):
        values = values.detach().cpu()
    # Masked arrays stay what they are: masked values are refused, not taken.
    return values if isinstance(values, np.ma.MaskedArray) else np.asarray(values)


def as_gaussians(frame: Any) -> Gaussians:
    """A frame of any kind that `encode` takes."""
    if isinstance(frame, Gaussians):
        return frame
    if isinstance(frame, (str, os.PathLike)):
        is_checkpoint = os.fspath(frame).lower().endswith(_CHECKPOINTS)
        return from_checkpoint(frame) if is_checkpoint else Gaussians.load(frame)
    if hasattr(frame, "keys"):
        if "means" in frame.keys():
            return from_splats(frame)
        unknown = sorted(set(frame.keys()) - {*_OWN, "sh", "antialiased"})
        missing = [name for name in _OWN if name not in frame.keys()]
        if missing or unknown:
            wrong = [f"{name} is missing" for name in missing] + [f"there is no {name}" for name in unknown]
            raise ValueError(f"a frame has {', '.join(_OWN)} and sh: {', '.join(wrong)}")
        return Gaussians(**{name: frame[name] for name in frame.keys()})
    raise TypeError(f"a frame is Gaussians, a path or a mapping of arrays, not {type(frame).__name__}")
