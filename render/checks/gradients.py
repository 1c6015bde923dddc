#!/usr/bin/env python3
"""Checks splatstream_render::gradient against PyTorch's gradients of gsplat's projection and blending in 64 bits."""

import sys
from pathlib import Path

import gsplat as pictures
from gsplat import BUILTIN, LOW_PASS, MAX_ALPHA, MIN_ALPHA, MIN_TRANSMITTANCE, NEAR, ROOT, VARIANTS, np, torch

SCENES = [BUILTIN, ROOT / "../shared/data/static/kacy9k.ply"]
# Of the norm of an attribute's gradients. What is decided by rounding (alpha at 1/255, a pixel that is done) is decided
# otherwise here for some pixels.
MOST_ERROR = 1e-3
# First and last plane.
ATTRIBUTES = {"position": (0, 3), "log-scale": (3, 6), "rotation": (6, 10), "opacity": (10, 11), "dc": (11, 14), "sh": (14, None)}


def planes_of(folder, name, count):
    return np.fromfile(Path(folder) / name, dtype="<f4").reshape(-1, count).astype(np.float64)


def project(gsplat, scene, planes, view, antialiased):
    """Centres, radii, conics, opacities and colours of all Gaussians, as functions of the planes; by gsplat."""
    rotation, position = np.array(view["rotation"]), np.array(view["position"])
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation, -rotation @ position
    (fx, fy), (cx, cy) = view["focal"], view["principal"]
    intrinsics = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])
    means, quaternions, scales = planes[:3].T, planes[6:10].T, planes[3:6].T.exp()
    covariances, _ = gsplat._quat_scale_to_covar_preci(quaternions, scales, True, False)
    radii, centres, _, conics, compensations = gsplat._fully_fused_projection(
        means, covariances, torch.tensor(matrix[None]), torch.tensor(intrinsics[None]), *view["size"],
        eps2d=LOW_PASS, near_plane=NEAR, calc_compensations=True,
    )
    coefficients = planes[11:].reshape(-1, 3, planes.shape[1]).permute(2, 0, 1)
    colours = gsplat._spherical_harmonics(scene.degree, means - torch.tensor(position), coefficients)
    opacity = torch.sigmoid(planes[10])
    if antialiased:
        opacity = opacity * compensations[0]
    return centres[0], radii[0], conics[0], opacity, (colours + 0.5).clamp(min=0)


def blend(alpha, colours):
    """Colours of pixels over black."""
    alpha = torch.where(alpha >= MIN_ALPHA, alpha.clamp(max=MAX_ALPHA), torch.zeros_like(alpha))
    after = torch.cumprod(1 - alpha, dim=1)
    before = torch.cat([torch.ones_like(after[:, :1]), after[:, :-1]], dim=1)
    weights = torch.where(after >= MIN_TRANSMITTANCE, alpha * before, torch.zeros_like(alpha))
    return weights @ colours


def reference(gsplat, scene, number, slopes, antialiased):
    """Slopes of the sum of pixels times slopes by every plane."""
    view = scene.views[number]
    planes = torch.tensor(scene.planes, requires_grad=True)
    centres, radii, conics, opacity, colours = project(gsplat, scene, planes, view, antialiased)
    order = pictures.depth_order(scene, view)
    order = order[(radii.numpy() > 0).all(axis=-1)[order]]
    rows, columns = np.nonzero(slopes.any(axis=-1))
    loss = 0
    for some in np.array_split(np.arange(len(rows)), 1 + len(rows) // 16):
        pixels = torch.tensor(np.stack([columns[some], rows[some]], axis=1) + 0.5)
        apart = np.abs(centres.detach().numpy()[order][None] - pixels.numpy()[:, None])
        near = order[(apart <= radii.numpy()[order][None]).all(axis=-1).any(axis=0)]
        x, y = (pixels[:, None] - centres[near][None]).unbind(dim=-1)
        a, b, c = conics[near].unbind(dim=-1)
        density = torch.exp(-0.5 * (a * x * x + 2 * b * x * y + c * y * y))
        found = blend(opacity[near] * density, colours[near])
        loss = loss + (found * torch.tensor(slopes[rows[some], columns[some]])).sum()
    loss.backward()
    return planes.grad.numpy()


def check(gsplat, folder, name):
    """Prints a row for each view, kernel and attribute; true if all are near enough."""
    scene = pictures.Scene(folder)
    count = scene.position.shape[1]
    scene.planes = planes_of(folder, "scene.f32", count)
    good = True
    for number, view in enumerate(scene.views):
        width, height = view["size"]
        slopes = np.fromfile(Path(folder) / f"slopes-{number}.f32", dtype="<f4").reshape(height, width, 3).astype(np.float64)
        for variant in VARIANTS:
            theirs = reference(gsplat, scene, number, slopes, variant == "antialiased")
            ours = planes_of(folder, f"gradients-{number}-{variant}.f32", count)
            for attribute, (first, last) in ATTRIBUTES.items():
                ours_of, theirs_of = ours[first:last], theirs[first:last]
                if theirs_of.size == 0:
                    continue
                norm = np.linalg.norm(theirs_of)
                error = np.linalg.norm(ours_of - theirs_of) / norm
                # A comparison with NaN is false.
                near_enough = bool(norm > 0 and error <= MOST_ERROR)
                good &= near_enough
                verdict = "" if near_enough else f"  ABOVE {MOST_ERROR}"
                print(f"{name:16} {number:4} {variant:12} {attribute:10} {norm:10.3e} {error:10.2e}{verdict}", flush=True)
    return good


def main():
    options = pictures.arguments(__doc__, SCENES, views=2, height=270).parse_args()
    gsplat = pictures.gsplat_module(options.wheel)
    print(f"{'scene':16} {'view':>4} {'kernel':12} {'attribute':10} {'norm':>10} {'error':>10}")
    return pictures.check_scenes(options, "gradients", lambda folder, path: check(gsplat, folder, path.name))


if __name__ == "__main__":
    sys.exit(main())
