"""The programs of the README run as they are written."""

from __future__ import annotations

import json
import os
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import moving

import splatstream_codec as gss

HERE = Path(__file__).resolve().parent
README = (HERE.parent / "README.md").read_text(encoding="utf-8")
PROGRAMS = re.findall(r"```python\n(.*?)```", README, re.DOTALL)


def run(text: str, names: dict[str, Any]) -> None:
    exec(compile(text, "README.md", "exec"), names)


def test_from_nothing_to_a_stream(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert len([line for line in PROGRAMS[0].splitlines() if line]) <= 10
    monkeypatch.chdir(tmp_path)
    run(PROGRAMS[0], {})
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("<EncodeResult: 8 frames, ") and len(lines) == 9
    assert [line.split()[0] for line in lines[1:]] == list("01234567")


# The scenes of these tests are too small for what the programs ask for.
@pytest.mark.filterwarnings("ignore::splatstream_codec.EncodeWarning")
def test_from_a_training_run_to_frames(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """In the order of the README, with names and files that a reader has."""
    monkeypatch.chdir(tmp_path)
    checkpoint, loop, reading = PROGRAMS[1:]

    trained = Path("results/garden/ckpts/ckpt_29999_rank0.pt")
    trained.parent.mkdir(parents=True)
    shutil.copy(HERE / "data" / "gsplat.pt", trained)
    names: dict[str, Any] = {"gss": gss}
    run(checkpoint, names)
    assert [len(frame) for frame in gss.decode("garden.gss")] == [5]

    def deform(splats: dict[str, Any], time: int) -> dict[str, Any]:
        return {**splats, "means": splats["means"] + 0.01 * np.float32(time)}

    arrays = moving(0, count=30)
    own = {"means": "position", "scales": "log_scale", "quats": "rotation", "opacities": "opacity_logit"}
    splats = {name: arrays[array] for name, array in own.items()}
    names |= {"deform": deform, "splats": {**splats, "sh0": arrays["dc"][:, None], "shN": arrays["sh"][:, :0]}}
    run(loop, names)
    psnr, size = capsys.readouterr().out.split()
    assert float(psnr) > 40 and int(size) == os.path.getsize("dance.gss")

    os.rename("dance.gss", "talk.gss")
    stream = Path("talk.gss").read_bytes()
    shown: list[int] = []
    uploaded: list[tuple[int, int]] = []
    names |= {
        "show": lambda frame: shown.append(frame.index),
        "chunks": [stream[at : at + 1000] for at in range(0, len(stream), 1000)],
        "upload": lambda start, position, rotation: uploaded.append((len(position), len(rotation))),
    }
    run(reading, names)
    # From 2.5 s on, then all as they come.
    assert shown == [*range(75, 300), *range(300)]
    assert uploaded[0] == (30, 30)

    # Calls in the text.
    gss.from_checkpoint(trained).save_ply("ckpt.ply")
    camera = {"file_path": "0.png", "transform_matrix": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 40], [0, 0, 0, 1]]}
    views = {"w": 96, "h": 54, "fl_x": 80, "fl_y": 80, "frames": [camera]}
    Path("transforms.json").write_text(json.dumps(views), encoding="utf-8")
    calls = re.findall(r"`(gss\.\w+\([^`]*\))`", README)
    assert len(calls) == 2
    for call in calls:
        assert eval(call, names)
