"""The first program of the README runs as it is written."""

from __future__ import annotations

import re
from pathlib import Path

import pytest


def test_from_nothing_to_a_stream(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    readme = (Path(__file__).resolve().parent.parent / "README.md").read_text(encoding="utf-8")
    programs = re.findall(r"```python\n(.*?)```", readme, re.DOTALL)
    assert len([line for line in programs[0].splitlines() if line]) <= 10
    monkeypatch.chdir(tmp_path)
    exec(compile(programs[0], "README.md", "exec"), {})
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("<EncodeResult: 8 frames, ") and len(lines) == 9
    assert [line.split()[0] for line in lines[1:]] == list("01234567")
    # The others need a scene, and are programs all the same.
    for program in programs[1:]:
        compile(program, "README.md", "exec")
