"""Frames of streams: files, bytes, file objects, pieces; operating points; damage."""

from __future__ import annotations

import io
import os
import threading
from pathlib import Path

import numpy as np
import pytest
from conftest import output_of

import splatstream_codec as gss


def digests(source: object, **options: object) -> list[int | None]:
    return [frame.digest for frame in gss.decode(source, **options)]  # type: ignore[arg-type]


def test_all_sources_give_the_same_frames(talk: Path) -> None:
    data = talk.read_bytes()
    expected = digests(talk)
    assert len(expected) == len(set(expected)) == 12
    for source in (str(talk), data, bytearray(data), memoryview(data), io.BytesIO(data)):
        assert digests(source) == expected
    with talk.open("rb") as file:
        assert digests(file) == expected
    assert digests(talk, ahead=True) == expected


def test_a_pipe_is_decoded_as_it_comes(talk: Path) -> None:
    reading, writing = os.pipe()

    def write() -> None:
        with os.fdopen(writing, "wb") as file:
            file.write(talk.read_bytes())

    writer = threading.Thread(target=write)
    writer.start()
    with os.fdopen(reading, "rb") as file:
        assert digests(file) == digests(talk)
    writer.join()


def test_arrays_have_a_row_for_each_gaussian_and_are_read_only(talk: Path) -> None:
    frame = next(gss.decode(talk))
    count = len(frame)
    shapes = {"position": (3,), "log_scale": (3,), "rotation": (4,), "opacity_logit": (), "dc": (3,)}
    for name, shape in shapes.items():
        array = getattr(frame, name)
        assert array.shape == (count, *shape) and array.dtype == np.float32, name
        assert array.flags.c_contiguous and not array.flags.writeable
        assert np.isfinite(array).all()
        # Made once.
        assert getattr(frame, name) is array
    assert frame.sh.shape == (count, (frame.sh_degree + 1) ** 2 - 1, 3)
    assert np.allclose(np.linalg.norm(frame.rotation, axis=1), 1, atol=1e-5)
    with pytest.raises(ValueError, match="read-only"):
        frame.position[0] = 0


def test_planes_are_the_same_values_without_a_copy(talk: Path) -> None:
    frame = next(gss.decode(talk))
    planes = frame.planes()
    assert np.array_equal(np.stack(planes["position"], axis=1), frame.position)
    assert np.array_equal(np.stack(planes["rotation"], axis=1), frame.rotation)
    assert np.array_equal(planes["opacity_logit"][0], frame.opacity_logit)
    x, again = planes["position"][0], frame.planes()["position"][0]
    assert np.shares_memory(x, again) and not x.flags.writeable
    # The array keeps the frame.
    assert id(x.base) == id(frame)
    del frame, planes, again
    assert np.isfinite(x).all()


def test_coefficients_of_harmonics_follow_each_other_and_channels_lie_side_by_side() -> None:
    from conftest import moving

    one = gss.Gaussians(**moving(0, count=10, degree=2))
    planes = one.planes()["sh"]
    assert len(planes) == 24 and one.sh.shape == (10, 8, 3)
    for coefficient in range(8):
        for channel in range(3):
            assert np.array_equal(planes[3 * coefficient + channel], one.sh[:, coefficient, channel])


def test_arrays_to_change_are_copies(talk: Path) -> None:
    frame = next(gss.decode(talk))
    arrays = frame.arrays()
    before = frame.position.copy()
    arrays["position"] += 1
    assert np.array_equal(frame.position, before)
    moved = gss.Gaussians(**arrays)
    assert np.array_equal(moved.position, before + 1)
    assert np.array_equal(moved.dc, frame.dc)


def test_integers_are_on_the_grid_of_the_stream(talk: Path) -> None:
    first, second = (next(gss.decode(talk)) for _ in range(2))
    integers = first.integers()
    assert integers["position"][0].dtype == np.uint32 and integers["dc"][0].dtype == np.int32
    assert len(integers["rotation"]) == 3
    # A grid: as many different values of x as there are different integers, in the same order.
    x, steps = first.planes()["position"][0], integers["position"][0]
    order = np.argsort(steps, kind="stable")
    assert (np.diff(x[order]) >= 0).all() and len(np.unique(x)) == len(np.unique(steps))
    assert all(np.array_equal(a, b) for a, b in zip(integers["dc"], second.integers()["dc"]))


def test_what_is_known_of_a_frame(talk: Path) -> None:
    frames = list(gss.decode(talk))
    assert [frame.index for frame in frames] == list(range(12))
    assert frames[0].is_keyframe and frames[0].time == 0.0 and frames[3].time == pytest.approx(0.1)
    assert not all(frame.is_keyframe for frame in frames)
    assert all(frame.bytes > 0 and frame.warnings == [] and frame.carried == 0 for frame in frames)
    assert frames[0].identities.dtype == np.uint32 and len(set(frames[0].identities.tolist())) == len(frames[0])
    assert repr(frames[3]).startswith("<Frame 3: ")


def test_an_operating_point_is_a_smaller_scene(talk: Path) -> None:
    decoder = gss.Decoder(talk)
    everything = decoder.next_frame()
    highest = decoder.highest_point
    assert everything is not None and highest is not None
    assert everything.operating_point == highest and str(highest) == "s0,t1,r2"
    small = list(gss.decode(talk, op="s0,t0,r0"))
    assert 0 < len(small[0]) < len(everything) and len(small) == 6
    assert small[0].refinements == 1 and small[0].operating_point == gss.OperatingPoint(0, 0, 0)
    assert digests(talk, op=(0, 0, 0)) == [frame.digest for frame in small]
    # The most important ones come first.
    assert np.array_equal(everything.position[: len(small[0])], small[0].position)
    with pytest.raises(ValueError, match="write it as s0,t0,r2"):
        gss.decode(talk, op="best")


def test_the_point_changes_while_decoding(talk: Path) -> None:
    decoder = gss.Decoder(talk)
    first = decoder.next_frame()
    decoder.set_operating_point("s0,t0,r0")
    # One frame may have been decoded already.
    later = list(decoder)[1:]
    assert first is not None and later and all(len(frame) < len(first) for frame in later)


def test_a_point_that_the_stream_does_not_have_is_refused(talk: Path) -> None:
    for point in ("s3,t0,r9", "s1,t0,r0", (0, 2, 0), (0, 0, 3)):
        with pytest.raises(ValueError, match="there is no operating point .* go from s0,t0,r0 to s0,t1,r2"):
            digests(talk, op=point)
    with talk.open("rb", buffering=0) as file:
        file.seekable = lambda: False  # type: ignore[method-assign]
        with pytest.raises(ValueError, match="to s0,t1,r2"):
            digests(file, op="s3,t0,r9")
    # The highest number that can be written is all that there is.
    assert digests(talk, op=(255, 255, 255)) == digests(talk) == digests(talk, op="s0,t1,r2")
    assert digests(talk, op=(255, 0, 0)) == digests(talk, op=(0, 0, 0))


def test_a_point_that_is_refused_costs_no_frame(talk: Path) -> None:
    expected = digests(talk)
    decoder = gss.Decoder(op="s0,t1,r3")
    assert decoder.next_frame() is None
    decoder.push(talk.read_bytes())
    decoder.end()
    for _ in range(2):
        with pytest.raises(ValueError, match="to s0,t1,r2"):
            decoder.next_frame()
    assert decoder.highest_point == (0, 1, 2) and not decoder.is_finished
    decoder.set_operating_point("s0,t1,r2")
    assert [frame.digest for frame in decoder] == expected
    # Once it is known what the stream has, the call itself refuses, and changes nothing.
    seeking = gss.Decoder(talk, op="s1,t1,r2")
    with pytest.raises(ValueError, match="to s0,t1,r2"):
        next(seeking)
    seeking.set_operating_point("s0,t1,r2")
    seeking.seek(3)
    frame = seeking.next_frame()
    with pytest.raises(ValueError, match="there is no operating point s0,t9,r0"):
        seeking.set_operating_point("s0,t9,r0")
    assert frame is not None and [frame.digest, *(frame.digest for frame in seeking)] == expected[3:]


def test_what_is_no_point_and_no_range_is_said(talk: Path) -> None:
    with pytest.raises(ValueError, match=r"is \(256, 0, 0\), and its numbers go from 0 to 255"):
        gss.decode(talk, op=(256, 0, 0))
    with pytest.raises(ValueError, match=r"is \(0, -1, 0\), and its numbers"):
        gss.Decoder(talk).set_operating_point((0, -1, 0))
    for point in ((0, 0), 3, (0.5, 0, 0)):
        with pytest.raises(TypeError, match=r"operating point is .*: write it as \"s0,t0,r2\" or \(0, 0, 2\)"):
            gss.decode(talk, op=point)  # type: ignore[arg-type]
    for frames in (5, [1, 2], "1:2"):
        with pytest.raises(TypeError, match=r"frames is .*: give a range or a slice, as range\(5, 6\)"):
            gss.decode(talk, frames=frames)  # type: ignore[arg-type]


def test_some_frames(talk: Path) -> None:
    def of(frames: range | slice) -> list[int]:
        return [frame.index for frame in gss.decode(talk, frames=frames)]

    assert of(range(5, 7)) == [5, 6]
    assert of(slice(10, None)) == [10, 11]
    assert of(range(1, 12, 4)) == [1, 5, 9]
    assert of(range(3, 3)) == []
    assert of(range(100, 200)) == []
    expected = digests(talk)
    assert digests(talk, frames=range(5, 7)) == expected[5:7]
    with pytest.raises(ValueError, match="numbers from 0 that go up"):
        of(range(5, 0, -1))


def test_seeking(talk: Path) -> None:
    expected = digests(talk)
    decoder = gss.Decoder(talk)
    assert decoder.frame_count is None
    for to in (6, 0, 3):
        decoder.seek(to)
        frame = decoder.next_frame()
        assert frame is not None and (frame.index, frame.digest) == (to, expected[to])
    assert decoder.frame_count == 12 and decoder.frame_duration == pytest.approx(1 / 30)
    decoder.seek(time=0.17)
    frame = decoder.next_frame()
    assert frame is not None and frame.index == 5
    # After the end as well.
    assert len(list(decoder)) == 6 and decoder.is_finished
    decoder.seek(11)
    assert [frame.index for frame in decoder] == [11]
    with pytest.raises(ValueError, match="-1"):
        decoder.seek(time=-1)
    with pytest.raises(TypeError):
        decoder.seek()


@pytest.mark.parametrize("size", [1, 777, 100_000])
def test_bytes_that_arrive_in_pieces(talk: Path, size: int) -> None:
    data = talk.read_bytes()
    decoder = gss.Decoder()
    found = []
    for at in range(0, len(data), size):
        decoder.push(data[at : at + size])
        found += [frame.digest for frame in decoder]
    decoder.end()
    found += [frame.digest for frame in decoder]
    assert decoder.is_finished and found == digests(talk)


def test_frames_come_before_all_bytes_are_there(talk: Path) -> None:
    data = talk.read_bytes()
    decoder = gss.Decoder()
    decoder.push(data[: len(data) // 2])
    first = [frame.digest for frame in decoder]
    assert first == digests(talk)[: len(first)] and len(first) >= 3 and not decoder.is_finished
    decoder.end()
    # What is there of the frame that is cut, and what is missing.
    *_, last = decoder
    assert [damage.kind for damage in last.warnings] == ["truncated", "lost"]


def test_what_cannot_be_done_is_said(talk: Path) -> None:
    with pytest.raises(gss.Error) as pushed:
        gss.Decoder(talk).push(b"")
    assert pushed.value.kind == "not-pushed"
    with pytest.raises(gss.Error) as sought:
        gss.Decoder().seek(3)
    assert sought.value.kind == "not-seekable"
    with pytest.raises(FileNotFoundError) as missing:
        gss.Decoder(talk.with_name("missing.gss"))
    assert missing.value.filename == str(talk.with_name("missing.gss"))
    with pytest.raises(TypeError, match="int, not a path"):
        gss.Decoder(7)  # type: ignore[arg-type]


def test_errors_have_fields(talk: Path) -> None:
    with pytest.raises(gss.StreamError) as error:
        list(gss.decode(b"ply\nformat ascii 1.0\n"))
    assert (error.value.kind, error.value.code, error.value.offset) == ("malformed", "SIGNATURE", 0)
    assert error.value.clause and error.value.frame is None
    limits = gss.Limits(max_gaussians=10)
    with pytest.raises(gss.StreamError) as over:
        list(gss.decode(talk, limits=limits))
    assert over.value.kind == "over-limit"
    assert gss.Limits() != limits and gss.Limits.unlimited().max_memory == 2**64 - 1


def test_damage_costs_frames_and_is_told(stream: bytes) -> None:
    whole = [frame.digest for frame in gss.decode(stream)]
    damaged = bytearray(stream)
    # In the middle of the first GOP of two; frames of the second do not need it.
    damaged[len(damaged) // 4] ^= 0x55
    told: list[gss.Damage] = []
    found = []
    try:
        for frame in gss.decode(damaged):
            found.append((frame.index, frame.digest))
            told += frame.warnings
    except gss.IncompleteError as error:
        told += error.damage
    assert [pair for pair in found if pair[0] >= 3] == list(enumerate(whole))[3:]
    assert told and told[0].kind == "malformed" and told[0].code and told[0].offset and str(told[0])


def test_a_stream_that_is_cut_gives_what_is_there(talk: Path) -> None:
    data = talk.read_bytes()
    frames = list(gss.decode(data[: len(data) // 2]))
    assert [frame.index for frame in frames] == [0, 1, 2, 3, 4] and len(frames[4]) < len(frames[3])
    truncated, lost = frames[4].warnings
    assert (truncated.kind, truncated.code, truncated.clause) == ("truncated", "TRUNCATED", "B.1")
    assert truncated.offset == 8009 and truncated.frames is None
    assert (lost.kind, lost.frames, str(lost)) == ("lost", range(5, 8), "frames 5 to 7 are lost")


def test_what_is_missing_after_the_last_frame_is_an_error(talk: Path) -> None:
    found = []
    with pytest.raises(gss.IncompleteError) as error:
        for frame in gss.decode(talk.read_bytes()[:-10]):
            found.append(frame.index)
    assert found == list(range(12)) and error.value.frame == 11
    assert (error.value.kind, error.value.code) == ("truncated", "TRUNCATED")
    assert [damage.kind for damage in error.value.damage] == ["truncated"]
    assert isinstance(error.value, gss.StreamError)


def test_errors_of_file_objects_are_raised_as_they_are() -> None:
    class Broken(io.RawIOBase):
        def readable(self) -> bool:
            return True

        def seekable(self) -> bool:
            return True

        def seek(self, offset: int, whence: int = 0) -> int:
            return 0

        def read(self, size: int = -1) -> bytes:
            raise PermissionError("not today")

    with pytest.raises(PermissionError, match="not today"):
        list(gss.decode(Broken()))  # type: ignore[arg-type]
    with pytest.raises(OSError, match="binary mode"):
        list(gss.decode(io.StringIO("text")))  # type: ignore[arg-type]


def test_other_threads_run_while_a_frame_is_decoded(talk: Path) -> None:
    data = talk.read_bytes()
    expected = digests(data)
    results: list[list[int | None]] = [[] for _ in range(4)]

    def work(at: int) -> None:
        results[at] = digests(data)

    threads = [threading.Thread(target=work, args=(at,)) for at in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert results == [expected] * 4


def test_threads_may_share_a_decoder(talk: Path) -> None:
    decoder = gss.Decoder(talk)
    found: list[int] = []
    threads = [threading.Thread(target=lambda: found.extend(frame.index for frame in decoder)) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(found) == list(range(12))


@pytest.mark.parametrize("call", ["next_frame()", "seek(0)", "is_finished", "highest_point"])
def test_a_file_object_cannot_use_the_decoder_that_reads_it(talk: Path, call: str) -> None:
    program = f"""
        import io
        import splatstream_codec as gss

        class File(io.BytesIO):
            def read(self, size=-1):
                decoder.{call}
                return super().read(size)

        with open({str(talk)!r}, "rb") as file:
            decoder = gss.Decoder(File(file.read()))
        try:
            decoder.next_frame()
        except gss.Error as error:
            print(error.kind, error)
    """
    assert output_of(program).startswith("in-use the decoder is in use by the call that runs this code")


def test_decoders_that_read_each_other_are_refused_and_others_are_not(talk: Path) -> None:
    program = f"""
        import io
        import splatstream_codec as gss

        class File(io.BytesIO):
            other = None

            def read(self, size=-1):
                if self.other is not None:
                    self.other.next_frame()
                return super().read(size)

        def pair():
            with open({str(talk)!r}, "rb") as file:
                data = file.read()
            files = [File(data), File(data)]
            return files, [gss.Decoder(file) for file in files]

        files, decoders = pair()
        files[0].other = decoders[1]
        print(decoders[0].next_frame().index)

        files, decoders = pair()
        files[0].other, files[1].other = decoders[1], decoders[0]
        try:
            decoders[0].next_frame()
        except gss.Error as error:
            print(error.kind)
        files[0].other = None
        decoders[0].seek(0)
        print(decoders[0].next_frame().index)
    """
    assert output_of(program).split() == ["0", "in-use", "0"]


@pytest.mark.skipif(os.name == "nt", reason="signals of Unix")
def test_ctrl_c_ends_a_call_whose_file_object_waits_for_another_decoder(talk: Path) -> None:
    program = f"""
        import io, os, signal, threading
        import splatstream_codec as gss

        signal.signal(signal.SIGINT, signal.default_int_handler)
        reads, goes_on = threading.Event(), threading.Event()

        class Slow(io.BytesIO):
            def read(self, size=-1):
                reads.set()
                goes_on.wait()
                return super().read(size)

        class Waiting(io.BytesIO):
            def read(self, size=-1):
                threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT)).start()
                slow.next_frame()
                return super().read(size)

        with open({str(talk)!r}, "rb") as file:
            data = file.read()
        slow, waiting = gss.Decoder(Slow(data)), gss.Decoder(Waiting(data))
        thread = threading.Thread(target=slow.next_frame)
        thread.start()
        reads.wait()
        try:
            waiting.next_frame()
        except KeyboardInterrupt:
            print("interrupted")
        goes_on.set()
        thread.join()
        print(slow.next_frame().index)
    """
    assert output_of(program).split() == ["interrupted", "1"]


def test_what_the_stream_says_of_its_scene(frames: list[gss.Gaussians]) -> None:
    data = bytes(gss.encode(frames[0], preset="fast", title="a cloud", up="y", background=(1, 1, 1)))
    decoder = gss.Decoder(data)
    assert decoder.description is None
    decoder.next_frame()
    description = decoder.description
    assert description is not None
    assert (description["title"], description["up"], description["background"]) == ("a cloud", "+y", [1, 1, 1])
    low, high = description["bounds"]
    assert (np.array(low) < high).all() and description["cameras"] == []
