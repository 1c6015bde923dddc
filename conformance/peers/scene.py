"""A scene, or the frames of one, brought once to a standard PLY that every peer starts from."""

import json
import os
from dataclasses import dataclass

import dither
import ply
import transform
from measure import run

CLOSE = 1e-5  # rounding of two float32 readers, in units of the scene


@dataclass
class Scene:
    name: str
    source: str     # as it was asked for
    paths: list     # the reference: one PLY for every frame
    counts: list    # Gaussians in every frame
    degree: int
    sequence: bool

    @property
    def gaussians(self):
        return sum(self.counts)

    def frames(self):
        return [ply.read(path) for path in self.paths]


def prepare(source, folder, tools, dithered):
    """Writes the reference below `folder`; with `dithered`, that of the scene moved off its own grid."""
    sources, sequence = _frames(source)
    name = _name(source) + ("_d" if dithered else "")
    paths = [os.path.join(folder, name, _name(frame) + ".ply") if sequence else os.path.join(folder, name + ".ply")
             for frame in sources]
    counts, degrees = [], []
    for number, (frame, path) in enumerate(zip(sources, paths)):
        gaussians = _read(frame, tools)
        if dithered:
            cells = dither.cells_of_format(frame)
            gaussians = dither.dithered(gaussians, seed=number, known=cells)
        os.makedirs(os.path.dirname(path), exist_ok=True)
        ply.write(path, gaussians)
        counts.append(len(gaussians))
        degrees.append(gaussians.degree)
    if len(set(degrees)) != 1:
        raise ValueError("%s: the frames have different SH degrees" % source)
    return Scene(name, source, paths, counts, degrees[0], sequence)


def check(scene, splatstream):
    """Our own reader must see the reference in the source: as many Gaussians, in the same places."""
    for source, path in zip(_frames(scene.source)[0], scene.paths):
        if os.path.basename(source) == "meta.json":
            source = os.path.dirname(source)
        found = json.loads(run([splatstream, "compare", source, path, "--json"]))
        apart = found["attributes"]["position"]["rmse"]
        if found["gaussians_a"] != found["gaussians_b"] or apart > CLOSE:
            raise ValueError("%s: splatstream reads %d Gaussians, the reference has %d; positions are %g apart"
                             % (source, found["gaussians_a"], found["gaussians_b"], apart))


def _frames(source):
    """(the files, whether they are frames): a folder is a sequence unless it is one SOG."""
    if not os.path.isdir(source):
        return [source], False
    if os.path.exists(os.path.join(source, "meta.json")):
        return [os.path.join(source, "meta.json")], False
    frames = [name for name in sorted(os.listdir(source)) if name.endswith((".ply", ".splat", ".sog", ".spz"))]
    if not frames:
        raise ValueError("%s holds no frames" % source)
    return [os.path.join(source, name) for name in frames], True


def _read(path, tools):
    if ply.is_standard(path):
        return ply.read(path)
    tools.install(transform.TRANSFORM)
    gaussians = transform.to_gaussians(path, tools)
    expected = transform.count(path, tools)
    if len(gaussians) != expected:
        raise ValueError("%s: %d Gaussians were read, it holds %d" % (path, len(gaussians), expected))
    return gaussians


def _name(source):
    source = os.path.normpath(source)
    stem = os.path.basename(source).split(".")[0]
    if os.path.exists(os.path.join(source, "meta.json")):
        return "%s_%s" % (os.path.basename(os.path.dirname(source)), stem)
    return stem
