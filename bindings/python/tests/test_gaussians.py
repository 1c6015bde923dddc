"""Frames in memory: arrays in and out, scene files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import moving

import splatstream_codec as gss


@pytest.mark.parametrize("degree", range(4))
def test_a_ply_file_keeps_every_value(degree: int, tmp_path: Path) -> None:
    arrays = moving(0, count=20, degree=degree)
    one = gss.Gaussians(**arrays)
    assert one.sh_degree == degree and len(one) == 20
    one.save_ply(tmp_path / "one.ply")
    again = gss.Gaussians.load(tmp_path / "one.ply")
    for name, given in arrays.items():
        assert np.array_equal(getattr(again, name), getattr(one, name)), name
        assert np.allclose(getattr(again, name), given, atol=1e-6), name


def test_anything_that_numpy_takes_makes_a_frame() -> None:
    arrays = moving(0, count=4)
    doubles = {name: values.astype(np.float64)[::1].tolist() for name, values in arrays.items() if name != "sh"}
    assert np.allclose(gss.Gaussians(**doubles).position, arrays["position"])
    columns = {**arrays, "opacity_logit": arrays["opacity_logit"][:, None], "dc": arrays["dc"][:, None, :]}
    assert np.array_equal(gss.Gaussians(**columns).dc, arrays["dc"])
    assert np.array_equal(gss.Gaussians(**columns).opacity_logit, arrays["opacity_logit"])
    # As it is said.
    assert "(N, 1)" in (gss.Gaussians.__doc__ or "")
    fortran = {**arrays, "position": np.asfortranarray(arrays["position"])}
    assert np.array_equal(gss.Gaussians(**fortran).position, arrays["position"])
    assert gss.Gaussians(**{**arrays, "sh": None}).sh.shape == (4, 0, 3)
    # The frame has its own values.
    one = gss.Gaussians(**arrays)
    before = one.position.copy()
    arrays["position"][:] = 0
    assert np.array_equal(one.position, before)


def test_rotations_get_length_one() -> None:
    arrays = moving(0, count=4)
    arrays["rotation"] = arrays["rotation"] * 7
    assert np.allclose(np.linalg.norm(gss.Gaussians(**arrays).rotation, axis=1), 1, atol=1e-6)


def test_tensors_come_from_their_device() -> None:
    class Tensor:
        """As one of PyTorch that is on a device and part of a graph."""

        def __init__(self, values: Any, where: str = "graph") -> None:
            self.values, self.where = values, where

        def detach(self) -> Tensor:
            return Tensor(self.values, "device")

        def cpu(self) -> Tensor:
            assert self.where == "device"
            return Tensor(self.values, "host")

        def __array__(self, dtype: Any = None, copy: object = None) -> Any:
            assert self.where == "host"
            return np.asarray(self.values, dtype=dtype)

    arrays = moving(0, count=4)
    tensors: dict[str, Any] = {name: Tensor(values) for name, values in arrays.items()}
    one = gss.Gaussians(**tensors)
    assert np.array_equal(one.position, arrays["position"])


@pytest.mark.parametrize(
    ("name", "shape", "message"),
    [
        ("log_scale", (4, 2), r"log_scale has shape \[4, 2\], not \(4, 3\)"),
        ("rotation", (5, 4), r"rotation has shape \[5, 4\], not \(4, 4\)"),
        ("position", (4, 1), r"position has shape \[4, 1\], not \(4, 3\)"),
        ("opacity_logit", (4, 2), r"opacity_logit has shape \[4, 2\], not \(4,\)"),
        ("sh", (4, 5, 3), r"sh has shape \[4, 5, 3\].*K 0, 3, 8 or 15"),
        ("sh", (3, 3, 3), r"sh has shape \[3, 3, 3\]"),
        ("sh", (4, 9), r"sh has shape \[4, 9\]"),
    ],
)
def test_arrays_that_do_not_fit_are_named(name: str, shape: tuple[int, ...], message: str) -> None:
    arrays = {**moving(0, count=4), name: np.zeros(shape, np.float32)}
    with pytest.raises(ValueError, match=message):
        gss.Gaussians(**arrays)


def test_arrays_of_words_are_refused() -> None:
    with pytest.raises(ValueError, match="dc cannot be made an array of float32"):
        gss.Gaussians(**{**moving(0, count=1), "dc": [["red", "green", "blue"]]})
    with pytest.raises(ValueError, match="there is no colour"):
        gss.encode({**moving(0, count=1), "colour": 1})
    with pytest.raises(TypeError, match="not int"):
        gss.encode([1])  # type: ignore[list-item]


@pytest.mark.parametrize("name", ["position", "opacity_logit", "sh"])
def test_masked_values_are_refused(name: str) -> None:
    arrays = moving(0, count=4, degree=1)
    masked = np.ma.masked_array(arrays[name], mask=np.zeros(arrays[name].shape, bool))
    # Nothing is masked.
    assert np.array_equal(getattr(gss.Gaussians(**{**arrays, name: masked}), name), arrays[name])
    masked[2] = np.ma.masked
    with pytest.raises(ValueError, match=f"{name} has masked values"):
        gss.Gaussians(**{**arrays, name: masked})
    trained = {"position": "means", "opacity_logit": "opacities", "sh": "shN"}
    own = {"log_scale": "scales", "rotation": "quats", "dc": "sh0", **trained}
    with pytest.raises(ValueError, match=f"{name} has masked values"):
        gss.from_splats({own[key]: masked if key == name else values for key, values in arrays.items()})


def test_selecting() -> None:
    one = gss.Gaussians(**moving(0, count=10))
    some = one.select([7, 0, 7])
    assert np.array_equal(some.position, one.position[[7, 0, 7]])
    with pytest.raises(IndexError, match="index 10: there are 10 Gaussians"):
        one.select([10])
    for index in (-1, 2**32, 2**70, -(2**70)):
        with pytest.raises(IndexError, match=f"index {index}: there are 10 Gaussians, with indices from 0 to 9"):
            one.select([0, index])
    with pytest.raises(IndexError, match="index 0: there are 0 Gaussians$"):
        one.select([]).select([0])
    with pytest.raises(TypeError):
        one.select([1.0])  # type: ignore[list-item]
    assert np.array_equal(one.select(np.array([3, 1])).position, one.position[[3, 1]])


def test_files_that_cannot_be_read_are_named(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        gss.Gaussians.load(tmp_path / "missing.ply")
    gss.Gaussians(**moving(0)).save_ply(tmp_path / "one.ply")
    cut = tmp_path / "cut.ply"
    cut.write_bytes((tmp_path / "one.ply").read_bytes()[:-10])
    with pytest.raises(gss.SceneError) as error:
        gss.Gaussians.load(cut)
    assert error.value.kind == "truncated" and error.value.offset and str(error.value.path) == str(cut)
    with pytest.raises(gss.SceneError) as limited:
        gss.Gaussians.load(tmp_path / "one.ply", max_memory=1000)
    assert limited.value.kind == "over-limit"
    (tmp_path / "text.ply").write_text("hello")
    with pytest.raises(gss.SceneError) as unknown:
        gss.Gaussians.load(tmp_path / "text.ply")
    assert unknown.value.kind == "unsupported"
