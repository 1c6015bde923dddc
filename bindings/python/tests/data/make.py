"""Writes the checkpoints beside it with PyTorch, as trainers write theirs: the tests read them without.

    python make.py      # with torch installed
"""

from __future__ import annotations

from collections import OrderedDict
from pathlib import Path

import torch

HERE = Path(__file__).resolve().parent
COUNT = 5


def values(*shape: int) -> torch.Tensor:
    """Numbers that tell every place: 0, 1/8, 2/8, ..."""
    return torch.arange(int(torch.tensor(shape).prod())).reshape(shape) / 8


def splats(rest: int) -> torch.nn.ParameterDict:
    """The parameters of gsplat."""
    shapes = {"means": (3,), "scales": (3,), "quats": (4,), "opacities": (), "sh0": (1, 3), "shN": (rest, 3)}
    return torch.nn.ParameterDict(
        {name: torch.nn.Parameter(values(COUNT, *shape) + 1) for name, shape in shapes.items()}
    )


def gsplat() -> None:
    parameters = splats(15)
    torch.save({"step": 29999, "splats": parameters.state_dict()}, HERE / "gsplat.pt")
    # Of other types, and a view that shares the storage of another.
    both = values(COUNT, 7) + 1
    mixed = {
        "means": both[:, :3],
        "quats": both[:, 3:],
        "scales": (values(3, COUNT) + 1).double().T,
        "opacities": (values(COUNT) + 1).half(),
        "sh0": (values(COUNT, 1, 3) + 1).bfloat16(),
    }
    torch.save(mixed, HERE / "mixed.pt")


def nerfstudio() -> None:
    for name, rest in (("splatfacto", 8), ("splatfacto-without-sh", 0)):
        parameters = splats(15)
        state = {f"_model.gauss_params.{key}": parameters[key] for key in ("means", "scales", "quats")}
        state["_model.gauss_params.opacities"] = values(COUNT, 1) + 1
        state["_model.gauss_params.features_dc"] = values(COUNT, 3) + 1
        state["_model.gauss_params.features_rest"] = values(COUNT, rest, 3) + 1
        state["_model.camera_optimizer.pose_adjustment"] = torch.zeros(2, 6)
        optimizer = torch.optim.Adam([parameters["means"]], lr=1e-3)
        parameters["means"].sum().backward()
        optimizer.step()
        saved = {
            "step": 29999,
            "pipeline": OrderedDict(state),
            "optimizers": {"means": optimizer.state_dict()},
            "schedulers": {},
            "scalers": torch.cuda.amp.GradScaler(enabled=False).state_dict(),
        }
        # After the step: what the file has is what the tests know.
        with torch.no_grad():
            parameters["means"].copy_(values(COUNT, 3) + 1)
        torch.save(saved, HERE / f"{name}.ckpt")


def original() -> None:
    parameters = splats(3)
    captured = (
        1, parameters["means"], parameters["sh0"], parameters["shN"], parameters["scales"], parameters["quats"],
        torch.nn.Parameter(values(COUNT, 1) + 1), torch.zeros(COUNT), torch.zeros(COUNT, 1), torch.zeros(COUNT, 1),
        {"state": {}}, 5.4,
    )
    torch.save((captured, 30000), HERE / "original.pth")


gsplat()
nerfstudio()
original()
