"""What tests have in common: a stream, and frames of a small moving scene."""

from __future__ import annotations

import subprocess
import sys
import textwrap
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import splatstream_codec as gss

Arrays = dict[str, Any]


@pytest.fixture(scope="session")
def talk() -> Path:
    """A stream of 12 frames in 3 GOPs with temporal layers and refinements, beside the folder of the tests or where the repository has it."""
    here = Path(__file__).resolve().parent
    places = [here.parent / "talk.gss", here.parents[2] / "examples" / "talk.gss"]
    return next(place for place in places if place.exists())


def moving(number: int, count: int = 300, degree: int = 0) -> Arrays:
    """A frame of a cloud that turns a little with each frame."""
    random = np.random.default_rng(7)
    position = random.normal(0.0, 1.0, (count, 3)).astype(np.float32)
    angle = 0.02 * number
    turn = np.array(
        [[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]], np.float32
    )
    rotation = random.normal(0.0, 1.0, (count, 4)).astype(np.float32)
    return {
        "position": position @ turn.T,
        "log_scale": random.uniform(-3.5, -2.0, (count, 3)).astype(np.float32),
        "rotation": rotation / np.linalg.norm(rotation, axis=1, keepdims=True),
        "opacity_logit": random.uniform(0.0, 4.0, count).astype(np.float32),
        "dc": random.normal(0.0, 1.0, (count, 3)).astype(np.float32),
        "sh": random.normal(0.0, 0.1, (count, (degree + 1) ** 2 - 1, 3)).astype(np.float32),
    }


def output_of(program: str) -> str:
    """What a program prints that hangs if it is wrong, and then has to be killed: no signal ends it."""
    start = f"import sys; sys.path.insert(0, {str(Path(__file__).parent)!r})\n"
    words = [sys.executable, "-c", start + textwrap.dedent(program)]
    return subprocess.run(words, check=True, stdout=subprocess.PIPE, text=True, timeout=60).stdout


@pytest.fixture(scope="session")
def frames() -> list[gss.Gaussians]:
    """Six frames of the cloud."""
    return [gss.Gaussians(**moving(number)) for number in range(6)]


@pytest.fixture(scope="session")
def stream(frames: list[gss.Gaussians]) -> bytes:
    """These frames as a stream."""
    return bytes(gss.encode(frames, preset="fast", gop=3))
