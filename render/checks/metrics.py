#!/usr/bin/env python3
"""Checks splatstream_render::metrics against scikit-image, scipy and a forward pass in NumPy."""

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

try:
    import numpy as np
    from PIL import Image
    from scipy.interpolate import PchipInterpolator
    from skimage.metrics import peak_signal_noise_ratio, structural_similarity
except ImportError as missing:
    sys.exit(f"{missing}; pip install numpy scipy scikit-image pillow")

ROOT = Path(__file__).resolve().parents[2]
PICTURES = ROOT / "render/tests/pictures"
WEIGHTS = ROOT / "../shared/data/metric/st-lpips-alex.npz"
TOLERANCE = 1e-4

# Rate and quality: as measured curves look, of other lengths, crossing, dominated points, too little in common.
CURVES = {
    "two codecs": (
        [[1000, 32.1], [2000, 35.0], [4000, 37.6], [8000, 39.8]],
        [[900, 32.4], [1700, 35.2], [3500, 38.1], [7200, 40.3]],
    ),
    "five points and three": (
        [[100, 28.0], [210, 30.9], [400, 33.5], [830, 35.2], [1600, 36.1]],
        [[150, 30.0], [500, 34.9], [900, 35.4]],
    ),
    "crossing": (
        [[10, 20.0], [20, 26.0], [40, 29.0], [80, 30.5]],
        [[9, 18.0], [22, 27.5], [43, 29.1], [75, 29.9]],
    ),
    "a dominated point, out of order": (
        [[400, 33.0], [100, 28.0], [200, 31.0], [300, 30.0], [800, 34.5]],
        [[90, 28.0], [190, 31.5], [350, 33.0], [700, 34.8]],
    ),
    "lines": ([[1, 10.0], [10, 20.0]], [[2, 11.0], [8, 19.0]]),
}


def synthetic_pictures():
    """Names to (reference, picture, alpha): smooth, textured, of odd sizes, and a scene on black."""
    random = np.random.default_rng(7)
    pictures = {}
    for name, (height, width) in {"odd": (61, 83), "wide": (48, 131), "small": (21, 23)}.items():
        y, x = np.mgrid[0:height, 0:width]
        waves = [0.5 + 0.4 * np.sin(0.11 * (c + 1) * x + 0.07 * y) * np.cos(0.05 * y * (3 - c)) for c in range(3)]
        reference = np.stack(waves, axis=-1)
        reference[height // 3 : height // 2, width // 4 : width // 2] = [0.9, 0.2, 0.1]
        noise = random.normal(0, 0.03, reference.shape)
        pictures[name] = (reference, reference + noise, None)
    y, x = np.mgrid[0:96, 0:96]
    alpha = ((x - 44) ** 2 + (y - 50) ** 2 < 30**2).astype(float)
    surface = np.stack([x / 96, 0.5 + 0.3 * np.sin(x * y / 90), 1 - y / 96], axis=-1) * alpha[..., None]
    coarse = np.round(np.roll(surface, 1, axis=1) * 12) / 12
    pictures["scene"] = (surface, coarse, alpha)
    return pictures


def write_pictures():
    for name, (reference, picture, alpha) in synthetic_pictures().items():
        layers = {"reference": reference, "picture": picture, "mask": alpha}
        for layer, values in layers.items():
            if values is not None:
                bytes_ = (np.clip(values, 0, 1) * 255 + 0.5).astype(np.uint8)
                Image.fromarray(bytes_).save(PICTURES / f"{name}-{layer}.png", optimize=True)


def load(path):
    return np.asarray(Image.open(path).convert("RGB"), dtype=np.float64) / 255


def decibel(mse):
    return 10 * np.log10(1 / mse)


def expected_figures(reference_path, picture_path, mask_path):
    a, b = load(reference_path), load(picture_path)
    mask = load(mask_path)[..., 0] > 0 if mask_path else np.ones(a.shape[:2], dtype=bool)
    settings = {"gaussian_weights": True, "sigma": 1.5, "use_sample_covariance": False, "data_range": 1.0}
    ssim, per_pixel = structural_similarity(a, b, channel_axis=-1, full=True, **settings)
    inner = np.zeros_like(mask)
    inner[5:-5, 5:-5] = True
    to_yuv = np.array([[0.2126, 0.7152, 0.0722], [-0.2126, -0.7152, 0.9278], [0.7874, -0.7152, -0.0722]])
    to_yuv[1] /= 1.8556
    to_yuv[2] /= 1.5748
    yuv = [decibel(np.mean(plane**2)) for plane in np.moveaxis((a - b) @ to_yuv.T, -1, 0)]
    figures = {
        "psnr_db": peak_signal_noise_ratio(a, b, data_range=1.0),
        "psnr_masked_db": decibel(np.mean((a - b)[mask] ** 2)),
        "yuv_psnr_db": (6 * yuv[0] + yuv[1] + yuv[2]) / 8,
        "ssim": ssim,
        "ssim_masked": per_pixel[mask & inner].mean(),
    }
    if WEIGHTS.exists():
        figures["st_lpips"] = learned_distance(a, b)
    return {name: float(figure) for name, figure in figures.items()}


def convolve(maps, weights, bias, padding):
    maps = np.pad(maps, ((0, 0), (padding, padding), (padding, padding)))
    windows = np.lib.stride_tricks.sliding_window_view(maps, weights.shape[2:], axis=(1, 2))
    return np.einsum("ihwkl,oikl->ohw", windows, weights, optimize=True) + bias[:, None, None]


def blur(maps, kernel):
    """Every second pixel of the blurred maps, with two reflected pixels at each border."""
    maps = np.pad(maps, ((0, 0), (2, 2), (2, 2)), mode="reflect")
    windows = np.lib.stride_tricks.sliding_window_view(maps, (3, 3), axis=(1, 2))[:, ::2, ::2]
    return np.einsum("chwkl,ckl->chw", windows, kernel[:, 0])


def pool(maps):
    return np.lib.stride_tricks.sliding_window_view(maps, (3, 3), axis=(1, 2)).max(axis=(3, 4))


def features(picture, weights):
    """The layers in the order in which the network defines them, in 64 bits."""

    def layer(maps, name, padding):
        return convolve(maps, weights[f"{name}.weight"], weights[f"{name}.bias"], padding)

    maps = np.moveaxis(2 * picture - 1, -1, 0)
    maps = (maps - weights["scaling_layer.shift"][0]) / weights["scaling_layer.scale"][0]
    one = np.maximum(blur(layer(maps, "net.slice1.0", 2), weights["net.slice1.1.filt"]), 0)
    two = np.maximum(layer(blur(pool(one), weights["net.slice2.4.filt"]), "net.slice2.5", 2), 0)
    three = np.maximum(layer(blur(pool(two), weights["net.slice3.8.filt"]), "net.slice3.9", 1), 0)
    four = np.maximum(layer(three, "net.slice4.11", 1), 0)
    five = np.maximum(layer(four, "net.slice5.13", 1), 0)
    return [one, two, three, four, five]


def learned_distance(a, b):
    weights = {name: array.astype(np.float64) for name, array in np.load(WEIGHTS).items()}
    distance = 0
    for index, layers in enumerate(zip(features(a, weights), features(b, weights))):
        unit = [maps / (np.sqrt((maps**2).sum(axis=0)) + 1e-10) for maps in layers]
        channel_weights = weights[f"lin{index}.model.1.weight"][0]
        distance += ((unit[0] - unit[1]) ** 2 * channel_weights).sum(axis=0).mean()
    return distance


def expected_differences(anchor, test):
    def rising(points):
        kept = []
        for rate, quality in sorted(points, key=lambda point: (point[0], -point[1])):
            if not kept or quality > kept[-1][1]:
                kept.append((rate, quality))
        return np.array(kept)

    def mean_difference(axes):
        curves = [PchipInterpolator(*axes(rising(points))) for points in (anchor, test)]
        start, end = max(c.x[0] for c in curves), min(c.x[-1] for c in curves)
        return (curves[1].integrate(start, end) - curves[0].integrate(start, end)) / (end - start)

    exponent = mean_difference(lambda p: (p[:, 1], np.log10(p[:, 0])))
    gain = mean_difference(lambda p: (np.log10(p[:, 0]), p[:, 1]))
    return {"bd_rate": float(100 * (10**exponent - 1)), "bd_psnr": float(gain)}


def ours(*arguments):
    command = ["cargo", "run", "-q", "--release", "-p", "splatstream-render", "--example", "metrics", "--"]
    return json.loads(subprocess.check_output([*command, *map(str, arguments)], cwd=ROOT))


def agree(name, expected, found):
    """Prints a row for each figure; true if all agree."""
    good = True
    for figure, value in expected.items():
        difference = abs(found[figure] - value)
        # The learned distance is small; an absolute tolerance would accept anything.
        allowed = TOLERANCE * (abs(value) if figure == "st_lpips" else 1)
        good &= difference <= allowed
        verdict = "" if difference <= allowed else "  DIFFERS"
        print(f"{name:32} {figure:15} {value:14.8f} {found[figure]:14.8f} {difference:9.1e}{verdict}")
    return good


def check_pictures(paths):
    """Figures by name, and whether all agree."""
    expected, good = {}, True
    for name, (reference, picture, mask) in paths.items():
        expected[name] = expected_figures(reference, picture, mask)
        options = (["--mask", mask] if mask else []) + (["--weights", WEIGHTS] if WEIGHTS.exists() else [])
        good &= agree(name, expected[name], ours("pictures", reference, picture, *options))
    return expected, good


def check_curves():
    expected, good = {}, True
    for name, (anchor, test) in CURVES.items():
        with tempfile.NamedTemporaryFile("w", suffix=".json") as file:
            json.dump({"anchor": anchor, "test": test}, file)
            file.flush()
            figures = expected_differences(anchor, test)
            good &= agree(name, figures, ours("curves", file.name))
        expected[name] = {"anchor": anchor, "test": test, **figures}
    return expected, good


def stored_pictures():
    def layer(path, name):
        other = path.with_name(path.name.replace("-reference", f"-{name}"))
        return other if other.exists() else None

    references = sorted(PICTURES.glob("*-reference.png"))
    return {p.name.split("-")[0]: (p, layer(p, "picture"), layer(p, "mask")) for p in references}


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("pictures", nargs="*", type=Path, help="reference, picture, and a mask if any")
    parser.add_argument("--bless", action="store_true", help="writes render/tests/pictures anew")
    options = parser.parse_args()
    print(f"{'case':32} {'figure':15} {'expected':>14} {'ours':>14} {'apart':>9}")
    if options.pictures:
        reference, picture, mask = (options.pictures + [None])[:3]
        _, good = check_pictures({reference.stem: (reference, picture, mask)})
        return 0 if good else 1
    if options.bless:
        write_pictures()
    pictures, pictures_good = check_pictures(stored_pictures())
    curves, curves_good = check_curves()
    file = PICTURES / "expected.json"
    found = {"pictures": pictures, "curves": curves}
    if options.bless:
        file.write_text(json.dumps(found, indent=1) + "\n")
    stored = json.loads(file.read_text())
    for kind, cases in found.items():
        for name, figures in cases.items():
            for figure, value in figures.items():
                if isinstance(value, float) and abs(stored[kind][name][figure] - value) > 1e-9:
                    print(f"{file.name} has another {figure} of {name}: run with --bless")
                    pictures_good = False
    return 0 if pictures_good and curves_good else 1


if __name__ == "__main__":
    sys.exit(main())
