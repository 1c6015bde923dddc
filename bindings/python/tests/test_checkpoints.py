"""Checkpoints of trainers, written by PyTorch 1.13 (data/make.py) and read without it."""

from __future__ import annotations

import io
import os
import pickle
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import moving

import splatstream_codec as gss

DATA = Path(__file__).parent / "data"


def values(*shape: int) -> Any:
    """As in data/make.py."""
    return 1 + np.arange(np.prod((5, *shape)), dtype=np.float32).reshape(5, *shape) / 8


@pytest.mark.parametrize(
    ("name", "coefficients"), [("gsplat.pt", 15), ("splatfacto.ckpt", 8), ("original.pth", 3)]
)
def test_what_trainers_write(name: str, coefficients: int) -> None:
    one = gss.from_checkpoint(DATA / name)
    assert np.array_equal(one.position, values(3))
    assert np.array_equal(one.log_scale, values(3))
    assert np.array_equal(one.opacity_logit, values())
    assert np.array_equal(one.dc, values(3))
    assert np.array_equal(one.sh, values(coefficients, 3))
    lengths = np.linalg.norm(values(4), axis=1, keepdims=True)
    assert np.allclose(one.rotation, values(4) / lengths, atol=1e-6)
    assert not one.antialiased and gss.from_checkpoint(DATA / name, antialiased=True).antialiased


def test_views_and_other_types_of_values() -> None:
    one = gss.from_checkpoint(DATA / "mixed.pt")
    both = values(7)
    assert np.array_equal(one.position, both[:, :3])
    assert np.allclose(one.rotation, both[:, 3:] / np.linalg.norm(both[:, 3:], axis=1, keepdims=True), atol=1e-6)
    assert np.array_equal(one.log_scale, 1 + np.arange(15).reshape(3, 5).T / 8)
    assert np.array_equal(one.opacity_logit, values())
    assert np.array_equal(one.dc, values(3))
    assert one.sh.shape == (5, 0, 3)


def test_without_harmonics_splatfacto_keeps_colours() -> None:
    one = gss.from_checkpoint(DATA / "splatfacto-without-sh.ckpt")
    colours = 1 / (1 + np.exp(-values(3)))
    assert np.allclose(0.5 + 0.28209479 * one.dc, colours, atol=1e-6)


@pytest.mark.filterwarnings("ignore::splatstream_codec.EncodeWarning")
def test_a_checkpoint_is_a_frame() -> None:
    paths = [DATA / "gsplat.pt", DATA / "original.pth"]
    assert gss.encode(paths[0], preset="fast").frames == 1
    assert gss.encode([os.fspath(path) for path in paths], preset="fast").frames == 2


def test_parameters_need_no_file() -> None:
    names = {"means": "position", "scales": "log_scale", "quats": "rotation", "opacities": "opacity_logit"}
    arrays = moving(0, count=20, degree=1)
    splats = {name: arrays[own] for name, own in names.items()}
    splats |= {"sh0": arrays["dc"][:, None], "shN": arrays["sh"]}
    assert np.array_equal(gss.from_splats(splats).sh, arrays["sh"])
    assert bytes(gss.encode(splats, preset="fast")) == bytes(gss.encode(arrays, preset="fast"))
    del splats["sh0"]
    with pytest.raises(KeyError, match="sh0 is not among the parameters"):
        gss.from_splats(splats)


def saved(content: bytes, compression: int = zipfile.ZIP_STORED) -> io.BytesIO:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", compression) as archive:
        archive.writestr("archive/data.pkl", content)
    return file


def test_nothing_in_a_file_is_run(tmp_path: Path) -> None:
    class Attack:
        def __reduce__(self) -> tuple[Any, ...]:
            return os.system, (f"touch {tmp_path / 'attacked'}",)

    path = tmp_path / "attack.pt"
    path.write_bytes(saved(pickle.dumps({"splats": Attack()}, protocol=2)).getvalue())
    with pytest.raises(gss.SceneError, match="no Gaussians are in this checkpoint"):
        gss.from_checkpoint(path)
    assert not (tmp_path / "attacked").exists()


def test_files_that_are_no_checkpoints_are_named(tmp_path: Path) -> None:
    path = tmp_path / "one.pt"
    for content, message in [
        (b"hello", "not a file of torch.save"),
        (saved(b"hello").getvalue(), "cannot be read"),
        (saved(pickle.dumps({"state_dict": 1})).getvalue(), "only state_dict"),
        (saved(pickle.dumps([1, 2])).getvalue(), "only list"),
        (saved(pickle.dumps(1), zipfile.ZIP_DEFLATED).getvalue(), "compressed"),
        ((DATA / "gsplat.pt").read_bytes()[:3000], "not a file of torch.save"),
    ]:
        path.write_bytes(content)
        with pytest.raises(gss.SceneError, match=message) as error:
            gss.from_checkpoint(path)
        assert error.value.path == str(path)
    with pytest.raises(FileNotFoundError):
        gss.from_checkpoint(tmp_path / "missing.pt")


def test_a_tensor_that_its_storage_does_not_hold_is_refused(tmp_path: Path) -> None:
    whole = zipfile.ZipFile(DATA / "gsplat.pt")
    path = tmp_path / "cut.pt"
    with zipfile.ZipFile(path, "w") as archive:
        for name in whole.namelist():
            data = whole.read(name)
            archive.writestr(name, data[:8] if "/data/" in name else data)
    with pytest.raises(gss.SceneError, match="a tensor needs .* values, its storage has 2"):
        gss.from_checkpoint(path)
