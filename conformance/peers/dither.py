"""Moves a scene off the grid it was stored on, by one cell of that grid; README.md has the rule."""

from dataclasses import replace

import numpy as np

FEW = 4096      # a column with at most this many values, each of them common, stands on one grid
BLOCK = 256     # compressed PLY has a grid for every 256 Gaussians
WINDOW = 64     # neighbours over which a fine grid's step is looked for
NOISE = 4e-7    # of the largest magnitude: closer values are the same value in float32
REPEATED = 0.75 # of the Gaussians: with fewer distinct SH vectors than this, SH came from a vector quantiser
ROWS = 1024     # vectors compared with all others at a time
SPLAT_ROTATION = 1 / 128


def cells_of_format(path):
    """Cells that cannot be seen in the values: .splat rotations are rounded before they are normalised."""
    return {"rotation": SPLAT_ROTATION} if path.endswith(".splat") else {}


def dithered(gaussians, seed, known=None):
    random = np.random.Generator(np.random.PCG64(seed))
    move = lambda columns: np.stack([_moved(column, random) for column in columns.T.astype(np.float64)], 1)
    return replace(
        gaussians,
        position=_single(move(gaussians.position)),
        colour=_single(move(gaussians.colour)),
        sh=_single(_vectors(gaussians.sh, random, move)) if gaussians.degree else gaussians.sh,
        opacity=_single(_logit(move(_sigmoid(gaussians.opacity)))),
        scale=_single(move(gaussians.scale)),
        rotation=_single(_rotation(gaussians.rotation, random, (known or {}).get("rotation"))),
    )


def cells(values):
    """Below and above every value, how far its cell reaches."""
    distinct, where, counts = np.unique(values, return_inverse=True, return_counts=True)
    if len(distinct) == 1:
        return np.zeros(len(values)), np.zeros(len(values))
    gaps = np.diff(distinct)
    if len(distinct) <= FEW and np.median(counts) > 1:
        below = np.concatenate([gaps[:1], gaps]) / 2
        above = np.concatenate([gaps, gaps[-1:]]) / 2
        return below[where], above[where]
    half = np.maximum(_fine(distinct, gaps)[where], _blocks(values)) / 2
    return half, half


def _moved(values, random):
    below, above = cells(values)
    uniform = random.random(len(values))
    return values - below + uniform * (below + above)


def _fine(distinct, gaps):
    """Of every distinct value, the smallest gap among its neighbours."""
    gaps = np.where(gaps > NOISE * np.abs(distinct).max(), gaps, np.inf)
    padded = np.pad(gaps, (WINDOW // 2, WINDOW - WINDOW // 2), constant_values=np.inf)
    smallest = np.lib.stride_tricks.sliding_window_view(padded, WINDOW).min(axis=1)[:len(distinct)]
    return np.where(np.isfinite(smallest), smallest, 0)


def _blocks(values):
    """Of every value, the smallest gap within its block."""
    smallest = np.zeros(len(values))
    noise = NOISE * np.abs(values).max()
    for begin in range(0, len(values), BLOCK):
        gaps = np.diff(np.sort(values[begin:begin + BLOCK]))
        gaps = gaps[gaps > noise]
        if len(gaps):
            smallest[begin:begin + BLOCK] = gaps.min()
    return smallest


def _vectors(vectors, random, move):
    """Vectors of a code book move by half the distance to the nearest other, on average; else each value moves."""
    distinct, where = np.unique(vectors, axis=0, return_inverse=True)
    if len(distinct) > REPEATED * len(vectors) or len(distinct) == 1:
        return move(vectors)
    side = _nearest(distinct) / 2 * np.sqrt(12 / vectors.shape[1])
    return vectors + (random.random(vectors.shape) - 0.5) * side[where.ravel(), None]


def _nearest(vectors):
    """Of every vector, the distance to the nearest other."""
    squares = (vectors ** 2).sum(1)
    nearest = np.empty(len(vectors))
    for begin in range(0, len(vectors), ROWS):
        some = vectors[begin:begin + ROWS]
        squared = squares[begin:begin + ROWS, None] + squares - 2 * (some @ vectors.T)
        squared[np.arange(len(some)), np.arange(begin, begin + len(some))] = np.inf
        nearest[begin:begin + ROWS] = squared.min(1)
    return np.sqrt(np.maximum(nearest, 0))


def _rotation(rotation, random, cell):
    """The three smaller components move, the largest follows: so quaternions are stored."""
    rotation = rotation.astype(np.float64)
    rows = np.arange(len(rotation))
    largest = np.abs(rotation).argmax(1)
    rotation *= np.where(rotation[rows, largest] < 0, -1, 1)[:, None]
    others = np.array([[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]])[largest]
    three = rotation[rows[:, None], others]
    if cell is None:
        three = _moved(_merged(three.ravel()), random).reshape(three.shape)
    else:
        three = three + (random.random(three.shape) - 0.5) * cell
    rotation[rows[:, None], others] = three
    rotation[rows, largest] = np.sqrt(np.clip(1 - (three ** 2).sum(1), 0, None))
    return rotation / np.linalg.norm(rotation, axis=1, keepdims=True)


def _merged(values):
    """Values within float32 noise of each other made one: normalising has blurred the grid."""
    return np.round(values * 2 ** 20) / 2 ** 20


def _sigmoid(logit):
    return 1 / (1 + np.exp(-logit.astype(np.float64)))


def _logit(opacity):
    opacity = np.clip(1 - np.abs(1 - np.abs(opacity)), 1e-6, 1 - 1e-6)
    return np.log(opacity / (1 - opacity))


def _single(values):
    return values.astype("<f4")
