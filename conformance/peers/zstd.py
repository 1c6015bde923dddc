"""zstd at level 19 on the reference PLY; on a sequence with long matches, so that a frame sees the ones before it."""

import generic
from measure import Package, Rate

PACKAGES = [Package("pip", "zstandard", "0.25.0")]


def rates(scene):
    return [Rate("zstd", "-19 --long, raw PLY" if scene.sequence else "-19, raw PLY")]


def code(rate, scene, decoded, tools):
    import zstandard

    long = {"enable_ldm": True, "window_log": 27} if scene.sequence else {}
    parameters = zstandard.ZstdCompressionParameters.from_level(19, **long)
    compress = zstandard.ZstdCompressor(compression_params=parameters).compress
    decompress = zstandard.ZstdDecompressor(max_window_size=1 << 27).decompress
    command = "zstandard.ZstdCompressor(from_level(19%s)).compress(ply)" % "".join(", %s=%s" % w for w in long.items())
    return generic.code(compress, decompress, command, scene, decoded, tools)
