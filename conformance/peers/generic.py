"""What zstd and xz share: they take the reference as the bytes it is, all frames as one run, and lose nothing."""

import ply
from measure import Coded, in_process


def code(compress, decompress, command, scene, decoded, tools):
    frames = [_bytes(path) for path in scene.paths]
    coded, encode_s = in_process(lambda: compress(b"".join(frames)), tools.repeat)
    back, decode_s = in_process(lambda: decompress(coded), tools.repeat)
    at = gaussians = 0
    for frame, path in zip(frames, decoded):
        with open(path, "wb") as file:
            file.write(back[at:at + len(frame)])
        at += len(frame)
        gaussians += len(ply.read(path))
    return Coded(len(coded), gaussians, encode_s, decode_s, "in-process", command)


def _bytes(path):
    with open(path, "rb") as file:
        return file.read()
