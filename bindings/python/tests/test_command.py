"""The command of the package, and what it prints as dictionaries."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from conftest import moving

import splatstream_codec as gss


def test_the_command_is_installed(talk: Path, tmp_path: Path) -> None:
    command = Path(sys.executable).with_name("splatstream")
    version = subprocess.run([command, "--version"], check=True, capture_output=True, text=True).stdout
    assert version.startswith(f"splatstream {gss.__version__} ")
    subprocess.run([command, "decode", talk, "-o", tmp_path / "out"], check=True, capture_output=True)
    assert len(list((tmp_path / "out").iterdir())) == 12
    wrong = subprocess.run([command, "decode", tmp_path / "none.gss"], check=False, capture_output=True, text=True)
    assert wrong.returncode == 2 and "splatstream decode" in wrong.stderr
    missing = subprocess.run(
        [command, "inspect", tmp_path / "none.gss"], check=False, capture_output=True, text=True
    )
    assert missing.returncode == 1 and "none.gss" in missing.stderr


def test_inspecting(talk: Path) -> None:
    data = talk.read_bytes()
    tree = gss.inspect(talk)
    assert tree["bytes"] == len(data) and tree["error"] is None
    assert {unit["type"] for unit in gss.inspect(data, "units")["units"]} >= {"frame_header", "increment"}
    points = gss.inspect(talk, "ops")
    highest = max(points, key=lambda point: point["bytes"])
    decoder = gss.Decoder(talk)
    decoder.next_frame()
    assert highest["op"] == str(decoder.highest_point) and highest["frames"] == 12
    assert gss.inspect(talk, "stats")["bytes"] == len(data)
    assert gss.inspect(talk, "deps")["profile"] == "Dynamic"


def test_inspecting_what_is_damaged(talk: Path) -> None:
    with pytest.raises(gss.StreamError) as error:
        gss.inspect(b"no stream at all")
    assert (error.value.kind, error.value.code) == ("malformed", "SIGNATURE")
    with pytest.raises(gss.StreamError) as cut:
        gss.inspect(talk.read_bytes()[:5000])
    assert cut.value.kind == "truncated" and cut.value.offset
    with pytest.raises(gss.CommandError) as missing:
        gss.inspect(talk.with_name("none.gss"))
    assert missing.value.kind == "other" and missing.value.exit_code == 1 and "none.gss" in str(missing.value)


def test_comparing(frames: list[gss.Gaussians], stream: bytes, tmp_path: Path) -> None:
    report = gss.compare(frames, stream, cameras="ring:2", height=90)
    assert report["frames"] == 6 and report["pairs"] == 6 * 300
    assert 40 < report["psnr_db"] < 70
    one = frames[0]
    one.save_ply(tmp_path / "one.ply")
    same = gss.compare(one, tmp_path / "one.ply")
    assert same["attributes"]["position"]["max"] == 0 and same["psnr_db"] is None
    far = gss.compare(one, moving(5), match="nearest")
    assert far["attributes"]["position"]["max"] > 0
    with pytest.raises(gss.CommandError) as error:
        gss.compare(one, gss.Gaussians(**moving(0, count=5)), match="order")
    assert error.value.kind == "usage" and "equal counts" in str(error.value)
    with pytest.raises(gss.StreamError):
        gss.compare(stream[: len(stream) // 2], stream)
