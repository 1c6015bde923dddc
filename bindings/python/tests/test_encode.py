"""Frames to streams: arrays, files, generators; options, progress, cancellation, errors."""

from __future__ import annotations

import io
import os
import re
import signal
import subprocess
import sys
import textwrap
import threading
import time
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import moving, output_of

import splatstream_codec as gss
from splatstream_codec import EncodeOptions


def test_a_sequence_comes_back_within_its_steps(frames: list[gss.Gaussians]) -> None:
    result = gss.encode(frames, preset="fast", gop=3, psnr=60, fps=Fraction(24000, 1001))
    assert result.frames == 6 and result.size == len(bytes(result)) == result.report["bytes"]
    assert result.bits_per_gaussian == pytest.approx(8 * result.size / (6 * 300))
    assert result.psnr is not None and abs(result.psnr - 60) < 3
    decoded = list(gss.decode(bytes(result)))
    assert [frame.digest for frame in decoded] == [int(digest, 16) for digest in result.report["digests"]]
    assert decoded[1].time == pytest.approx(1001 / 24000)
    for frame, source in zip(decoded, frames):
        # Gaussians come in another order: each is near one of the source.
        apart = np.linalg.norm(frame.position[:, None] - source.position[None], axis=2).min(axis=1)
        assert len(frame) == len(source) and apart.max() < 0.02


def test_every_kind_of_frame_gives_the_same_stream(frames: list[gss.Gaussians], tmp_path: Path) -> None:
    expected = bytes(gss.encode(frames[:2], preset="fast"))
    dictionaries = [moving(number) for number in range(2)]
    assert bytes(gss.encode(dictionaries, preset="fast")) == expected
    paths = [tmp_path / f"{number}.ply" for number in range(2)]
    for frame, path in zip(frames, paths):
        frame.save_ply(path)
    assert bytes(gss.encode(paths, preset="fast")) == expected
    assert bytes(gss.encode(tuple(map(str, paths)), preset="fast")) == expected
    # A generator of one GOP is encoded as a sequence is.
    assert bytes(gss.encode((frame for frame in frames[:2]), preset="fast")) == expected


def test_the_command_writes_the_same_bytes(frames: list[gss.Gaussians], tmp_path: Path) -> None:
    folder = tmp_path / "frames"
    folder.mkdir()
    for number, frame in enumerate(frames[:3]):
        frame.save_ply(folder / f"{number}.ply")
    out = tmp_path / "command.gss"
    words = [sys.executable, "-m", "splatstream_codec", "encode", str(folder), "-o", str(out)]
    options = ["--preset", "fast", "--quality", "low", "--layers", "540,1080", "--refinements", "20,100"]
    subprocess.run([*words, *options], check=True, capture_output=True)
    encoded = gss.encode(frames[:3], preset="fast", quality="low", layers=(540, 1080), refinements=[20, 100])
    assert bytes(encoded) == out.read_bytes()


def test_python_has_the_options_of_the_command() -> None:
    words = [sys.executable, "-m", "splatstream_codec", "encode", "--help"]
    text = subprocess.run(words, check=True, capture_output=True, text=True).stdout
    of_command = {match.replace("-", "_") for match in re.findall(r"^ +(?:-\w, )?--([a-z-]+)", text, re.MULTILINE)}
    # What only files and terminals need; a frame is read by Gaussians.load, threads are those of RAYON_NUM_THREADS.
    of_files = {"out", "each", "shard", "plan", "write_plan", "max_input_memory", "samples"}
    of_files |= {"json", "threads", "help", "version", "quiet"}
    assert set(EncodeOptions.__annotations__) == of_command - of_files
    for name in EncodeOptions.__annotations__:
        assert re.search(rf"^    (\w+, )*{name}(, \w+)*: ", EncodeOptions.__doc__ or "", re.MULTILINE), name


def test_values_are_fitted_to_pictures(frames: list[gss.Gaussians]) -> None:
    options: dict[str, Any] = {"psnr": 45, "cameras": "ring:4", "all_intra": True}
    fitted = gss.encode(frames[:2], finetune=3, finetune_only=["dc", "opacity"], finetune_loss="l1-ssim", optimise_for={(0, 0, 4): 2}, **options)
    assert [frame["iterations"] for frame in fitted.report["finetuned"]] == [3, 3]
    assert fitted.report["finetuned"][0]["points"][0]["point"] == "s0,t0,r4"
    assert bytes(fitted) != bytes(gss.encode(frames[:2], **options))


def test_a_state_of_fitting_goes_when_the_stream_is_written(frames: list[gss.Gaussians], tmp_path: Path) -> None:
    state = tmp_path / "state"
    options: dict[str, Any] = {"preset": "fast", "psnr": 40, "layers": [64], "finetune": 2}
    kept = gss.encode(frames[0], finetune_state=state, resume=True, **options)
    assert bytes(kept) == bytes(gss.encode(frames[0], **options))
    assert not state.exists()
    state.mkdir()
    (state / "frame-0000-layer-0.fit").touch()
    with pytest.raises(ValueError, match="an earlier run has left its state"):
        gss.encode(frames[0], finetune_state=state, **options)


def test_a_time_needs_a_number_of_frames(frames: list[gss.Gaussians]) -> None:
    result = gss.encode(frames[:2], time_budget=30)
    assert "time budget" in {choice["tool"] for choice in result.report["chosen"]}
    with pytest.raises(ValueError, match="give them as a list"):
        gss.encode(iter(frames), time_budget=30)


def test_decoded_frames_can_be_encoded_again(talk: Path) -> None:
    small = gss.encode(gss.decode(talk, op="s0,t0,r0"), preset="fast", quality="low")
    assert small.frames == len(list(gss.decode(talk, op="s0,t0,r0")))


def test_one_frame_has_no_layers(frames: list[gss.Gaussians]) -> None:
    still = bytes(gss.encode(frames[0], preset="fast"))
    assert gss.inspect(still, "deps")["profile"] == "Intra"
    assert bytes(gss.encode(iter(frames[:1]), preset="fast")) == still
    layered = bytes(gss.encode(frames[:2], preset="fast"))
    assert gss.inspect(layered, "deps")["profile"] == "Dynamic"


def test_a_generator_needs_the_memory_of_a_gop_only(tmp_path: Path) -> None:
    held: list[int] = []
    alive: set[int] = set()

    class Counted:
        """Arrays that are counted until nobody has them."""

        def __init__(self, number: int) -> None:
            self.number = number
            self.arrays = moving(number, count=60)
            alive.add(number)
            held.append(len(alive))

        def __del__(self) -> None:
            alive.discard(self.number)

        def keys(self) -> list[str]:
            return list(self.arrays)

        def __getitem__(self, name: str) -> object:
            return self.arrays[name]

    out = tmp_path / "long.gss"
    progress: list[tuple[int, int | None]] = []
    result = gss.encode(
        (Counted(number) for number in range(40)),
        out,
        gop=4,
        preset="fast",
        progress=lambda done, all: progress.append((done, all)),
    )
    assert result.data is None and result.frames == 40 and out.stat().st_size == result.size
    assert max(held) <= 2
    assert len(list(gss.decode(out))) == 40
    done = [number for number, _ in progress]
    assert done[-1] == 40 and done == sorted(done) and {all for _, all in progress} == {None}
    with pytest.raises(ValueError, match="was written to a file"):
        bytes(result)


def test_pushing_frames(frames: list[gss.Gaussians]) -> None:
    file = io.BytesIO()
    with gss.Encoder(file, preset="fast", gop=2) as encoder:
        with pytest.raises(ValueError, match="has not ended"):
            encoder.result
        for frame in frames:
            encoder.push(frame)
        written = len(file.getvalue())
    assert 0 < written < encoder.result.size == len(file.getvalue())
    assert len(list(gss.decode(file.getvalue()))) == 6
    with pytest.raises(ValueError, match="make another"):
        encoder.push(frames[0])


def test_a_sequence_is_asked_for_its_frames_one_by_one() -> None:
    asked: list[int] = []

    class Lazy(list[gss.Gaussians]):
        def __len__(self) -> int:
            return 4

        def __getitem__(self, number):  # type: ignore[no-untyped-def]
            asked.append(number)
            return gss.Gaussians(**moving(number, count=80))

    told: list[tuple[int, int | None]] = []
    result = gss.encode(Lazy(), preset="fast", progress=lambda done, all: told.append((done, all)))
    assert result.frames == 4 and set(asked) == {0, 1, 2, 3} and told[-1] == (4, 4)


def test_options_are_those_of_the_command(frames: list[gss.Gaussians]) -> None:
    with pytest.raises(ValueError, match="95.* is not a PSNR from 20 to 90 decibels"):
        gss.encode(frames, psnr=95)
    with pytest.raises(ValueError, match="cannot be used with"):
        gss.encode(frames, psnr=50, quality="low")
    with pytest.raises(ValueError, match="possible values: fast, balanced, small"):
        gss.encode(frames, preset="slow")  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="no option 'qualty'; there are quality, psnr"):
        gss.encode(frames, qualty="low")  # type: ignore[call-arg]
    with pytest.raises(ValueError, match="1 to 4 rising heights"):
        gss.encode(frames, layers=[720, 540])
    intra = gss.encode(frames[:2], preset="fast", all_intra=True, up="-y", drop_invalid=False)
    assert gss.inspect(bytes(intra), "deps")["gops"][0]["predicted"] is False


def test_a_size_is_reached_or_warned_of(frames: list[gss.Gaussians]) -> None:
    result = gss.encode(frames, preset="fast", target_bpg=60)
    assert result.bits_per_gaussian == pytest.approx(60, rel=0.05)
    with pytest.warns(gss.EncodeWarning, match="bits per Gaussian"):
        gss.encode(frames[0], preset="fast", target_bpg=3)


def test_values_that_cannot_be_encoded_are_named(frames: list[gss.Gaussians]) -> None:
    arrays = frames[1].arrays()
    arrays["log_scale"][17, 2] = np.nan
    bad = gss.Gaussians(**arrays)
    with pytest.raises(gss.EncodeError) as error:
        gss.encode([frames[0], bad], preset="fast")
    fields = (error.value.kind, error.value.frame, error.value.gaussian, error.value.property)
    assert fields == ("invalid-value", 1, 17, "scale_2")
    with pytest.warns(gss.EncodeWarning, match="1 Gaussian was left out"):
        result = gss.encode([frames[0], bad], preset="fast", drop_invalid=True)
    assert result.report["dropped"] == 1
    with pytest.raises(gss.EncodeError) as nothing:
        gss.encode([])
    assert nothing.value.kind == "no-frames"
    with pytest.raises(gss.EncodeError):
        gss.encode(iter([]))


def test_what_a_generator_raises_is_raised_and_leaves_nothing(frames: list[gss.Gaussians], tmp_path: Path) -> None:
    def broken() -> Iterator[gss.Gaussians]:
        yield from frames[:4]
        raise LookupError("the camera is gone")

    out = tmp_path / "out.gss"
    out.write_bytes(b"as before")
    with pytest.raises(LookupError, match="the camera is gone"):
        gss.encode(broken(), out, preset="fast", gop=2)
    with pytest.raises(FileNotFoundError, match="missing.ply"):
        gss.encode([frames[0], tmp_path / "missing.ply"], out, preset="fast")
    with pytest.raises(ZeroDivisionError):
        gss.encode(iter(frames), out, preset="fast", gop=2, progress=lambda done, all: 1 // 0)
    assert out.read_bytes() == b"as before" and os.listdir(tmp_path) == ["out.gss"]
    with pytest.raises(IsADirectoryError):
        gss.encode(frames[0], tmp_path)


def test_errors_of_a_file_object_are_raised_as_they_are(frames: list[gss.Gaussians]) -> None:
    class Full(io.BytesIO):
        def write(self, data: object) -> int:
            raise OSError(28, "No space left on device")

    with pytest.raises(OSError, match="No space left"):
        gss.encode(frames[0], Full(), preset="fast")


@pytest.mark.parametrize("count", [-1, 10**9, 2**70, "all", 1.5])
def test_a_write_that_returns_no_number_of_its_bytes_is_an_error(frames: list[gss.Gaussians], count: object) -> None:
    class Boasting(io.BytesIO):
        def write(self, data: Any) -> Any:
            return count

    with pytest.raises(OSError, match=rf"write\(\) returned {re.escape(repr(count))} and was given \d+ bytes"):
        gss.encode(frames[0], Boasting(), preset="fast")
    with pytest.raises(OSError, match="was given"), gss.Encoder(Boasting(), preset="fast") as encoder:
        encoder.push(frames[0])


@pytest.mark.parametrize("call", ["push(frame)", "finish()"])
def test_a_progress_function_cannot_use_its_encoder(call: str) -> None:
    program = f"""
        import splatstream_codec as gss
        from conftest import moving

        frame = gss.Gaussians(**moving(0, count=40))
        encoder = gss.Encoder(progress=lambda *_: encoder.{call}, preset="fast", gop=1)
        try:
            for _ in range(4):
                encoder.push(frame)
        except gss.Error as error:
            print(error.kind, error)
    """
    assert output_of(program).startswith("in-use the encoder is in use by the call that runs this code")


def test_a_progress_function_that_is_refused_does_not_end_the_stream(tmp_path: Path) -> None:
    out = tmp_path / "out.gss"
    program = f"""
        import splatstream_codec as gss
        from conftest import moving

        refused = set()

        def progress(*_):
            try:
                encoder.finish()
            except gss.Error as error:
                refused.add(error.kind)

        encoder = gss.Encoder({str(out)!r}, progress=progress, preset="fast", gop=1)
        for number in range(4):
            encoder.push(moving(number, count=40))
        encoder.finish()
        print(*refused)
    """
    assert output_of(program).split() == ["in-use"]
    assert len(list(gss.decode(out))) == 4


def test_a_file_object_cannot_use_the_encoder_that_writes_to_it() -> None:
    program = """
        import io
        import splatstream_codec as gss
        from conftest import moving

        class File(io.BytesIO):
            def write(self, data):
                encoder.push(moving(0, count=40))
                return super().write(data)

        encoder = gss.Encoder(File(), preset="fast", gop=1)
        try:
            for number in range(4):
                encoder.push(moving(number, count=40))
        except gss.Error as error:
            print(error.kind)
    """
    assert output_of(program).split() == ["in-use"]


def test_other_threads_run_meanwhile(frames: list[gss.Gaussians]) -> None:
    ticks = 0
    done = threading.Event()

    def tick() -> None:
        nonlocal ticks
        while not done.is_set():
            ticks += 1
            time.sleep(0.001)

    thread = threading.Thread(target=tick)
    thread.start()
    start = time.monotonic()
    gss.encode(frames, preset="fast")
    seconds = time.monotonic() - start
    done.set()
    thread.join()
    # A lock that is kept leaves no tick but those before and after.
    assert ticks > 5 * seconds


@pytest.mark.skipif(os.name == "nt", reason="signals of Unix")
@pytest.mark.parametrize("frames", ["list", "iter"])
def test_ctrl_c_ends_encoding_and_leaves_nothing(frames: str, tmp_path: Path) -> None:
    program = f"""
        import signal, sys
        sys.path.insert(0, {str(Path(__file__).parent)!r})
        import splatstream_codec as gss
        from conftest import moving
        # What shells start in the background ignores the signal.
        signal.signal(signal.SIGINT, signal.default_int_handler)
        frames = [gss.Gaussians(**moving(number, count=4000)) for number in range(60)]
        print("ready", flush=True)
        try:
            gss.encode({frames}(frames), {str(tmp_path / "out.gss")!r}, preset="small", gop=20)
        except KeyboardInterrupt:
            print("interrupted", flush=True)
    """
    process = subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(program)], stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "ready\n"
    time.sleep(1)
    process.send_signal(signal.SIGINT)
    try:
        output, _ = process.communicate(timeout=120)
    finally:
        process.kill()
    assert output == "interrupted\n" and process.returncode == 0
    assert os.listdir(tmp_path) == []
