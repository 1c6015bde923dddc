#!/usr/bin/env python3
"""Checks splatstream_render::render against the projection of gsplat and blending in 64 bits."""

import argparse
import json
import subprocess
import sys
import tempfile
import types
import zipfile
from pathlib import Path

try:
    import numpy as np
    import torch
except ImportError as missing:
    sys.exit(f"{missing}; pip install numpy torch")

ROOT = Path(__file__).resolve().parents[2]
BUILTIN = Path("builtin")
FILES = ("plant.splat", "playbot/0_0", "biker.compressed.ply")
SCENES = [BUILTIN, *(ROOT / "../shared/data/static" / file for file in FILES)]
VERSION = "1.5.3"
MODULE = "gsplat/cuda/_torch_impl.py"
LEAST_DB = 50.0
VARIANTS = ("classic", "antialiased")

# What render/src/rasterise states.
MAX_ALPHA = 0.99
MIN_ALPHA = 1 / 255
MIN_TRANSMITTANCE = 1e-4
LOW_PASS = 0.3
NEAR = 0.01


def gsplat_module(wheel):
    """The one file of gsplat that needs no GPU; importing the package would want CUDA."""
    with tempfile.TemporaryDirectory() as folder:
        if wheel is None:
            command = [sys.executable, "-m", "pip", "download", "-q", "--no-deps"]
            subprocess.check_call([*command, f"gsplat=={VERSION}", "-d", folder])
            (wheel,) = Path(folder).glob("gsplat-*.whl")
        source = zipfile.ZipFile(wheel).read(MODULE)
    module = types.ModuleType("gsplat_torch")
    exec(compile(source, MODULE, "exec"), module.__dict__)
    return module


def write_views(example, scene, count, height, folder):
    command = ["cargo", "run", "-q", "--release", "-p", "splatstream-render", "--example", example, "--"]
    name = scene if scene == BUILTIN else scene.resolve()
    subprocess.check_call([*command, str(name), str(count), str(height), folder], cwd=ROOT)


class Scene:
    """What the example `views` wrote."""

    def __init__(self, folder):
        self.folder = Path(folder)
        description = json.loads((self.folder / "views.json").read_text())
        self.views, self.degree = description["views"], description["sh_degree"]
        planes = np.fromfile(self.folder / "scene.f32", dtype="<f4").reshape(-1, description["gaussians"])
        self.position, log_scale, self.rotation, logit, colour = np.split(planes.astype(np.float64), [3, 6, 10, 11])
        self.scale = np.exp(log_scale)
        self.opacity = 1 / (1 + np.exp(-logit[0]))
        # Coefficient, channel, Gaussian: the constant one first.
        self.sh = colour.reshape(-1, 3, description["gaussians"])

    def pixels(self, view, variant):
        width, height = self.views[view]["size"]
        pixels = np.fromfile(self.folder / f"view-{view}-{variant}.f32", dtype="<f4")
        return pixels.reshape(height, width, 4).astype(np.float64)


def tensor(array):
    return torch.from_numpy(np.ascontiguousarray(array))


def depth_order(scene, view):
    """Nearest first by the depth in 32 bits, as the renderer sorts; equal depths in the order of the frame."""
    offset = scene.position.astype(np.float32) - np.float32(view["position"])[:, None]
    terms = np.float32(view["rotation"][2])[:, None] * offset
    return np.argsort(terms[0] + terms[1] + terms[2], kind="stable")


def project(gsplat, scene, view):
    """Centres, radii, conics, compensations and colours of what the view may show, nearest first; all by gsplat."""
    rotation, position = np.array(view["rotation"]), np.array(view["position"])
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation, -rotation @ position
    (fx, fy), (cx, cy) = view["focal"], view["principal"]
    intrinsics = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])
    means, quaternions, scales = tensor(scene.position.T), tensor(scene.rotation.T), tensor(scene.scale.T)
    covariances, _ = gsplat._quat_scale_to_covar_preci(quaternions, scales, True, False)
    radii, centres, _, conics, compensations = gsplat._fully_fused_projection(
        means, covariances, tensor(matrix[None]), tensor(intrinsics[None]), *view["size"],
        eps2d=LOW_PASS, near_plane=NEAR, calc_compensations=True,
    )
    directions = means - tensor(position)
    colours = gsplat._spherical_harmonics(scene.degree, directions, tensor(scene.sh.transpose(2, 0, 1)))
    order = depth_order(scene, view)
    order = order[(radii[0].numpy() > 0).all(axis=-1)[order]]
    parts = [centres[0], radii[0], conics[0], compensations[0], (colours + 0.5).clamp(min=0)]
    return [part.numpy()[order] for part in parts] + [scene.opacity[order]]


def density(conics, offsets):
    """Of Gaussians at `offsets` from their centres: pixel, Gaussian, axis."""
    x, y = offsets[..., 0], offsets[..., 1]
    return np.exp(-0.5 * (conics[:, 0] * x * x + 2 * conics[:, 1] * x * y + conics[:, 2] * y * y))


def blend(alpha, colours):
    """Colour and alpha of pixels over black."""
    alpha = np.where(alpha >= MIN_ALPHA, np.minimum(alpha, MAX_ALPHA), 0)
    after = np.cumprod(1 - alpha, axis=1)
    before = np.concatenate([np.ones_like(after[:, :1]), after[:, :-1]], axis=1)
    weights = np.where(after >= MIN_TRANSMITTANCE, alpha * before, 0)
    return np.concatenate([weights @ colours, weights.sum(axis=1, keepdims=True)], axis=1)


def blocks(pixels, centres, radii):
    """Pixels near each other, and the Gaussians that may reach them: by gsplat's radii, not the renderer's tiles."""
    side = 21
    for row in np.unique(pixels[:, 1] // side):
        in_row = np.flatnonzero(pixels[:, 1] // side == row)
        reach_row = np.flatnonzero(np.abs(centres[:, 1] - (row + 0.5) * side) <= radii[:, 1] + side / 2)
        for column in np.unique(pixels[in_row, 0] // side):
            apart = np.abs(centres[reach_row, 0] - (column + 0.5) * side)
            reach = reach_row[apart <= radii[reach_row, 0] + side / 2]
            inside = in_row[pixels[in_row, 0] // side == column]
            for some in np.array_split(inside, 1 + len(inside) * len(reach) // 1_000_000):
                yield some, reach


def reference(projected, pixels):
    """Colour and alpha at `pixels` (x, y), for both variants."""
    centres, radii, conics, compensations, colours, opacity = projected
    found = {variant: np.empty((len(pixels), 4)) for variant in VARIANTS}
    for some, reach in blocks(pixels, centres, radii):
        offsets = pixels[some, None] + 0.5 - centres[None, reach]
        densities = density(conics[reach], offsets)
        compensated = opacity[reach] * compensations[reach]
        found["classic"][some] = blend(opacity[reach] * densities, colours[reach])
        found["antialiased"][some] = blend(compensated * densities, colours[reach])
    return found


def choose(size, count, seed):
    width, height = size
    every = width * height
    numbers = np.random.default_rng(seed).choice(every, every if count == 0 else min(count, every), replace=False)
    return np.stack([numbers % width, numbers // width], axis=1)


def check(gsplat, scene, name, pixels_per_view):
    """Prints a row for each variant; true if both are near enough."""
    errors = {variant: [] for variant in VARIANTS}
    for number, view in enumerate(scene.views):
        projected = project(gsplat, scene, view)
        pixels = choose(view["size"], pixels_per_view, number)
        for variant, theirs in reference(projected, pixels).items():
            ours = scene.pixels(number, variant)[pixels[:, 1], pixels[:, 0]]
            # Where both are empty there is nothing to compare.
            covered = (ours[:, 3] > 0) | (theirs[:, 3] > 0)
            errors[variant].append((ours - theirs)[covered])
    good = True
    for variant, found in errors.items():
        error = np.abs(np.concatenate(found))
        psnr = 10 * np.log10(1 / np.mean(error[:, :3] ** 2))
        # A comparison with NaN is false.
        near_enough = bool(psnr >= LEAST_DB)
        good &= near_enough
        worst = f"{error[:, :3].max():9.1e} {error[:, 3].max():9.1e}"
        verdict = "" if near_enough else f"  BELOW {LEAST_DB:.0f} dB"
        print(f"{name:24} {variant:12} {len(error):8} {psnr:9.2f} {worst}{verdict}", flush=True)
    return good


def arguments(about, scenes, views, height):
    """What both checks are asked for, with their defaults."""
    parser = argparse.ArgumentParser(description=about)
    parser.add_argument("scenes", nargs="*", type=Path, default=scenes, help="files, or builtin; else that and ../shared/data")
    parser.add_argument("--views", type=int, default=views, help="cameras on a ring")
    parser.add_argument("--height", type=int, default=height, help="rows of a view")
    parser.add_argument("--wheel", type=Path, help=f"gsplat {VERSION}, if it was downloaded already")
    return parser


def check_scenes(options, example, check_files):
    """Lets an example write each scene; 0 if a function of the folder and of the scene finds all near enough."""
    good = True
    for path in options.scenes:
        if path != BUILTIN and not path.exists():
            print(f"{path.name:24} skipped: not there")
            continue
        with tempfile.TemporaryDirectory() as folder:
            write_views(example, path, options.views, options.height, folder)
            good &= check_files(folder, path)
    return 0 if good else 1


def main():
    parser = arguments(__doc__, SCENES, views=3, height=540)
    parser.add_argument("--pixels", type=int, default=4000, help="chosen at random in each view; 0 for all")
    options = parser.parse_args()
    gsplat = gsplat_module(options.wheel)
    print(f"{'scene':24} {'variant':12} {'pixels':>8} {'PSNR dB':>9} {'colour':>9} {'alpha':>9}")

    def check_files(folder, path):
        name = "/".join(path.parts[-2:]).removeprefix("static/")
        return check(gsplat, Scene(folder), name, options.pixels)

    return check_scenes(options, "views", check_files)


if __name__ == "__main__":
    with torch.no_grad():
        sys.exit(main())
