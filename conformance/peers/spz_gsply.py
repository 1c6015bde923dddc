"""SPZ again, by gsply's native code: the same format, and times without WebAssembly."""

import numpy as np

import ply
from measure import Coded, Package, Rate, in_process

PACKAGES = [Package("pip", "gsply", "0.4.6"), Package("pip", "zstandard", "0.25.0")]


def rates(scene):
    """gsply always spends 8 bits on SH."""
    options = "SH 8 bits" if scene.degree else "defaults"
    return [Rate("SPZ v%d (gsply)" % version, options, {"version": version})
            for version in ((4,) if scene.sequence else (3, 4))]


def code(rate, scene, decoded, tools):
    import gsply

    gsply.use_backend("cpp")
    inputs = [gsply.plyread(path) for path in scene.paths]
    coded = [tools.scratch("gsply_%d.spz" % number) for number in range(len(inputs))]

    def encode():
        for data, path in zip(inputs, coded):
            gsply.write_spz(path, data, **rate.settings)

    _, encode_s = in_process(encode, tools.repeat)
    outputs, decode_s = in_process(lambda: [gsply.read_spz(path) for path in coded], tools.repeat)
    for data, path in zip(outputs, decoded):
        ply.write(path, _gaussians(data))
    size = sum(_size(path) for path in coded)
    return Coded(size, sum(len(data.means) for data in outputs), encode_s, decode_s, "in-process",
                 "gsply.use_backend('cpp'); gsply.write_spz(path, data, version=%(version)d)" % rate.settings)


def _gaussians(data):
    count = len(data.means)
    sh = np.zeros((count, 0, 3), "<f4") if data.shN is None else np.asarray(data.shN).reshape(count, -1, 3)
    return ply.Gaussians(data.means, data.sh0.reshape(count, 3), ply.from_coefficients(sh),
                         data.opacities.reshape(count, 1), data.scales, data.quats)


def _size(path):
    with open(path, "rb") as file:
        return file.seek(0, 2)
