"""Valid vectors of the tools of predicted frames: survivors, cells, prediction, codebooks between frames."""

import struct
from fractions import Fraction
from math import floor

from ..synth.directed import DirectedSynth, directed
from ..vector import Vector, seed_of


def same(number, before):
    return before


def more(number, before):
    return [n + 6 for n in before]


def fewer(number, before):
    return [n // 2 for n in before]


SURVIVORS = [
    ("survivors-all-skip", "SS-PA-002 SS-PA-004", "Mode SKIP for every parent: no section moves or updates",
     dict(modes=(1, 0, 0, 0), sizes=same, removed=lambda n: 0)),
    ("survivors-all-move", "SS-PA-004 SS-PA-005", "Mode MOVE for every parent",
     dict(modes=(0, 1, 0, 0), sizes=same, removed=lambda n: 0)),
    ("survivors-all-update", "SS-PA-004 SS-RC-001", "Mode UPDATE for every parent",
     dict(modes=(0, 0, 1, 0), sizes=same, removed=lambda n: 0, sh_degree=1)),
    ("survivors-all-move-and-update", "SS-PA-004", "Mode MOVE and UPDATE for every parent",
     dict(modes=(0, 0, 0, 1), sizes=same, removed=lambda n: 0, sh_degree=1)),
    ("survivors-all-removed", "SS-PA-002 SS-PA-003", "Mode REMOVE for every parent, and nothing new",
     dict(sizes=lambda k, before: [0] * len(before), removed=lambda n: n)),
    ("survivors-half-removed", "SS-PA-003 SS-PR-001",
     "Half of the parents are removed; they stay in the reference set",
     dict(sizes=same, removed=lambda n: n // 2, predictors=(0, 1, 1))),
    ("survivors-to-corners", "SS-PA-005", "Moves to the ends of the grid on every axis",
     dict(modes=(0, 1, 0, 0), position_bits=8, sizes=same, move=lambda w, axis: w.rng.choice([-20000, 20000]),
          fixed={"position_shift": 0})),
    ("survivors-without-parents", "SS-PA-001 SS-IN-011", "Lists without parents get Gaussians in a P frame",
     dict(most=lambda number: 1, sizes=more, percent=[10, 50, 100])),
    ("survivors-anchors", "SS-CA-004", "Anchors and new Gaussians are compensated differently at lower refinements",
     dict(sizes=more, percent=[30, 60, 100], fixed={"compensation_log_scale": -7, "compensation_opacity": 11,
                                                    "predictor_block_log2": None})),
]


def every(value):
    return lambda w, occupied: {X: value for X in occupied}


def alternating(first, second):
    return lambda w, occupied: {X: (first, second)[k % 2] for k, X in enumerate(occupied)}


def f32(x):
    return struct.unpack("<f", struct.pack("<f", x))[0]


def step_of_half():
    """A binary32 number f for which floor(1 / f + 1/2) is another integer in single precision."""
    for k in range(100, 1000):
        f = f32(1 / (k + 0.5))
        if floor(1 / Fraction(f) + Fraction(1, 2)) == k and f32(f32(1 / f) + 0.5) == k + 1:
            return f
    raise ValueError("no such number")


def elsewhere(w, occupied):
    """Cells in which no Gaussian is."""
    last = 2 ** max(w.seq.position_bits - w.cell_log2, 1) - 1
    corners = [(0, 0, 0), (last, 0, 0), (0, last, last), (last, last, last)]
    return {X: ([80, 0, -80], [0, 0, 0], 1) for X in corners if X not in occupied}


def eight_cells(w, occupied):
    return {(x, y, z): ([8, 8, 8], NO_ROTATION, 0) for x in (0, 1) for y in (0, 1) for z in (0, 1)}


NO_ROTATION, NO_SHIFT = [0, 0, 0], [0, 0, 0]
STEP_OF_HALF = step_of_half()
NO_ROTATIONS = {"rotation": lambda w, p, factor: [0, 0, 0]}
CELLS = [
    ("cells-translation", "SS-MO-001 SS-MO-002 SS-MO-004", "Cells that are translated without rotating",
     dict(cells=every(([8, -16, 3], NO_ROTATION, 0)))),
    ("cells-translation-ends", "SS-MO-002",
     "Translations of 2^20 eighths to both sides, which end at the border of the grid",
     dict(cells=lambda w, occupied: {X: ([min(2 ** 20, 31000 * (k + 1)), -min(2 ** 20, 31000 * (k + 1)), 0], NO_ROTATION,
                                         0) for k, X in enumerate(occupied)},
          cell_log2=4, most=60, gops=[(1, 0, 2)])),
    ("cells-rotation-half", "SS-MO-002 SS-MO-003 SS-MO-004", "Rotations of 8192 about each axis: 60 degrees",
     dict(cells=lambda w, occupied: {X: (NO_SHIFT, [8192 * (a == k % 3) for a in range(3)], 0) for k,
                                     X in enumerate(occupied)}, cell_log2=8)),
    ("cells-rotation-largest", "SS-MO-002 SS-MO-004", "Rotations of 8192 on all axes at once: 120 degrees",
     dict(cells=alternating((NO_SHIFT, [8192] * 3, 0), (NO_SHIFT, [-8192] * 3, 0)), cell_log2=9)),
    ("cells-rotation-small", "SS-MO-004", "Rotations of one unit, at the limit of rounding",
     dict(cells=every((NO_SHIFT, [1, -1, 1], 0)), cell_log2=10)),
    ("cells-whole-grid", "SS-MO-001", "cell_log2 equals position_bits: one cell has everything",
     dict(cells=every(([5, 5, 5], [300, -200, 100], 0)), cell_log2=10)),
    ("cells-whole-large-grid", "SS-MO-001 SS-FR-007", "cell_log2 is 20 in a grid of 20 bits",
     dict(cells=every(([5, 5, 5], [300, -200, 100], 0)), cell_log2=20, position_bits=20)),
    ("cells-of-one-point", "SS-MO-001", "cell_log2 0: every cell is a grid point",
     dict(cells=every(([64, 8, -8], [100, 0, 0], 0)), cell_log2=0)),
    ("cells-codes-beyond-reach", "SS-MO-001",
     "cell_log2 equals position_bits, where codes 1 to 7 are allowed and no Gaussian is in their cells",
     dict(cells=eight_cells, cell_log2=10)),
    ("cells-stale", "SS-CA-001 SS-MO-002", "All cells are stale: nothing is carried, but parents are displaced",
     dict(cells=every(([8, 8, 8], NO_ROTATION, 1)), sizes=fewer)),
    ("cells-stale-in-part", "SS-CA-001 SS-CA-003", "Every other cell is stale",
     dict(cells=alternating(([8, 8, 8], NO_ROTATION, 1), (NO_SHIFT, NO_ROTATION, 0)), sizes=same, cell_log2=6)),
    ("cells-elsewhere", "SS-MO-001", "Cells in which no Gaussian is", dict(cells=elsewhere, cell_log2=3)),
    ("cells-several-blocks", "SS-MO-001 SS-SE-001", "More than 64 cells: running sums start again in each block",
     dict(cells=every(([8, 0, -8], [9, 9, 9], 0)), cell_log2=1, most=100, gops=[(1, 0, 2)])),
    ("cells-unity-32767", "SS-MO-003", "A rotation_step so small that U is limited to 32767",
     dict(cells=every((NO_SHIFT, [4000, 0, 0], 0)), rotation_step=1e-6)),
    ("cells-unity-1", "SS-MO-003", "rotation_step 1: U is 1",
     dict(cells=every((NO_SHIFT, [4000, 99, 0], 0)), rotation_step=1.0)),
    ("cells-unity-half", "SS-MO-003",
     "1 / rotation_step + 1/2 is just below an integer, which single precision takes for that integer",
     dict(cells=every((NO_SHIFT, [0, 0, 8192], 0)), rotation_step=STEP_OF_HALF, values=NO_ROTATIONS, modes=(1, 0, 0, 0))),
    ("cells-rotation-clamped", "SS-MO-004", "Rotations whose integers are beyond 32767 after a displacement",
     dict(cells=every((NO_SHIFT, [0, 0, 8192], 0)), modes=(1, 0, 0, 0),
          values={"rotation": lambda w, p, factor: [(32767 - (x >> 6)) * (k < 2) for k, x in enumerate(p)]},
          fixed={"attribute_step": [0] * 5, "predictor_block_log2": None})),
    ("cells-rotation-double-cover", "SS-MO-004",
     "Rotations of nearly half a revolution displaced further: the scalar part changes its sign",
     dict(cells=every((NO_SHIFT, [0, 0, 8000], 0)), rotation_step=0.001,
          values={"rotation": lambda w, p, factor: [0, 0, (63500 - p[2]) >> 6]},
          fixed={"attribute_step": [0] * 5, "predictor_block_log2": None})),
]
NEAR = {"percent": [50, 100], "most": 24, "gops": [(1, 0, 2)], "sizes": more, "sh_degree": 1}


COLOUR_SEED = 0
MEANS = dict(NEAR, mean=(2 ** 30, 0), ranks=(3, 2), predictors=(1, 1, 1), most=40)


WINDOW = dict(NEAR, most=90, predictors=(0, 1, 1), cells=lambda w, occupied: {}, modes=(1, 0, 0, 0),
              fixed={"position_shift": 0, "predictor_block_log2": 0, "neighbour_count": 16})


def apart(new, others):
    """New Gaussians of P frames at one position, those of I frames elsewhere."""
    return lambda w, near, bits: [others(w.rng) for _ in range(3)] if w.frame.intra else list(new)


def at(*position):
    return lambda w, near, bits: list(position)


PREDICTION = [
    ("prediction-none", "SS-PR-003 SS-RC-006", "No flag predictors: no section predictors",
     dict(NEAR, fixed={"predictor_block_log2": None})),
    ("prediction-none-chosen", "SS-PR-002", "Predictor 0 for every block",
     dict(NEAR, predictors=(1, 0, 0), fixed={"predictor_block_log2": 2})),
    ("prediction-knn", "SS-PR-005 SS-PR-006 SS-IN-004", "Predictor knn alone",
     dict(NEAR, predictors=(0, 1, 0), fixed={"predictor_block_log2": 0})),
    ("prediction-bilateral", "SS-PR-007 SS-PR-008", "Predictor bilateral alone",
     dict(NEAR, predictors=(0, 0, 1), fixed={"predictor_block_log2": 0, "bilateral_spatial": 20,
                                             "bilateral_feature": 5})),
    ("prediction-one-neighbour", "SS-PR-005", "neighbour_count 1",
     dict(NEAR, predictors=(0, 1, 1), fixed={"neighbour_count": 1, "predictor_block_log2": 1})),
    ("prediction-sixteen-neighbours", "SS-PR-005", "neighbour_count 16",
     dict(NEAR, predictors=(0, 1, 1), fixed={"neighbour_count": 16, "predictor_block_log2": 1})),
    ("prediction-fewer-references", "SS-PR-005", "Fewer Gaussians in the reference set than neighbour_count",
     dict(NEAR, percent=[10, 20, 100], predictors=(0, 1, 1), fixed={"neighbour_count": 16, "predictor_block_log2": 0})),
    ("prediction-no-references", "SS-PR-003", "Predictors in units with an empty reference set are read and not used",
     dict(gops=[(0, 0, 2)], percent=[100], predictors=(0, 1, 1), fixed={"predictor_block_log2": 1})),
    ("prediction-at-neighbour", "SS-PR-006 SS-PR-007",
     "New Gaussians exactly at neighbours: knn copies, bilateral makes no exception",
     dict(NEAR, predictors=(0, 1, 1), position=lambda w, near, bits: list(w.rng.choice(near)) if near else [7, 7, 7],
          fixed={"position_shift": 0, "predictor_block_log2": 0})),
    ("prediction-ties", "SS-PR-005", "Neighbours at equal distances: the index decides",
     dict(NEAR, position_bits=2, predictors=(0, 1, 1), fixed={"neighbour_count": 3, "position_shift": 0,
                                                              "predictor_block_log2": 0})),
    ("prediction-all-at-one-position", "SS-PR-005 SS-PR-006", "Every Gaussian at one position: all distances are 0",
     dict(NEAR, predictors=(0, 1, 1), position=at(100, 200, 300), cells=lambda w, occupied: {}, modes=(1, 0, 0, 0),
          fixed={"position_shift": 0})),
    ("prediction-window-at-start", "SS-PR-005", "New Gaussians before all Gaussians of the reference set in Morton order",
     dict(WINDOW, position=apart([0, 0, 0], lambda rng: rng.randint(300, 1023)))),
    ("prediction-window-at-end", "SS-PR-005", "New Gaussians after all Gaussians of the reference set in Morton order",
     dict(WINDOW, position=apart([1023, 1023, 1023], lambda rng: rng.randint(0, 700)))),
    ("prediction-window-few-before", "SS-PR-005",
     "Fewer than 16 Gaussians of the reference set before the new ones in Morton order",
     dict(WINDOW, position=apart([40, 40, 40], lambda rng: rng.choice([20, 600, 700, 800, 900, 1000, 1023])))),
    ("prediction-window-equal-codes", "SS-PR-005",
     "More Gaussians with the code of the new ones than the window has: the first of them are candidates",
     dict(WINDOW, position=apart([100, 100, 100], lambda rng: 100))),
    ("prediction-window-ties", "SS-PR-005", "Candidates and Gaussians beyond the window at equal distances",
     dict(WINDOW, position_bits=3, position=lambda w, near, bits: [w.rng.randrange(8) for _ in range(3)])),
    ("prediction-window-misses-nearest", "SS-PR-005",
     "The nearest Gaussians are on the other side of the middle of the grid, far away in Morton order",
     dict(WINDOW, position=lambda w, near, bits: [w.rng.choice([510, 511] if w.u.new_count % 2 else [512, 513]),
                                                  w.rng.randrange(1024), w.rng.randrange(1024)])),
    ("prediction-far", "SS-PR-005 SS-PR-006", "Neighbours across the whole grid of 20 bits: the widths of 7.12",
     dict(NEAR, position_bits=20, predictors=(0, 1, 1), position=lambda w, near,
          bits: [w.rng.choice([0, 2 ** bits - 1]) for _ in range(3)])),
    ("prediction-weights-of-zero", "SS-PR-007 SS-PR-008", "bilateral weights 0: every neighbour has the largest weight",
     dict(NEAR, predictors=(0, 0, 1), fixed={"bilateral_spatial": 0, "bilateral_feature": 0})),
    ("prediction-weights-of-255", "SS-PR-007 SS-PR-008", "bilateral weights 255: the smallest entries of EXP",
     dict(NEAR, predictors=(0, 0, 1), fixed={"bilateral_spatial": 255, "bilateral_feature": 255})),
    ("prediction-features", "SS-PR-007", "Only attribute differences weigh",
     dict(NEAR, predictors=(0, 0, 1), fixed={"bilateral_spatial": 0, "bilateral_feature": 1})),
] + [
    ("prediction-blocks-of-%d" % 2 ** k, "SS-PR-002", "predictor_block_log2 %d" % k,
     dict(NEAR, fixed={"predictor_block_log2": k})) for k in (1, 3, 6, 16)
] + [
    ("prediction-across-blocks", "SS-PR-002 SS-SE-001", "Predictors of blocks that cross the blocks of section new",
     dict(NEAR, most=160, fixed={"predictor_block_log2": 5})),
    ("prediction-in-spatial-layers", "SS-PR-001", "Reference sets of the units of higher spatial layers",
     dict(gops=[(0, 0, 1)], spatial_layer_count=3, percent=[30, 60, 100], most=30, predictors=(0, 1, 1),
          fixed={"predictor_block_log2": 0})),
    ("prediction-in-b-frames", "SS-PR-001", "Reference sets of B frames, with lists of the I frame above the unit",
     dict(gops=[(1, 2, 5)], percent=[30, 60, 100], sizes=more, predictors=(0, 1, 1), temporal_layer_count=3,
          fixed={"predictor_block_log2": 0})),
]


class Books(DirectedSynth):
    """Codebooks in every phase in which they may stand."""

    def definitions(self):
        super().definitions()
        ranks = list(self.sh_ranks.values())
        for identifier in range(4):
            self.random_codebook(identifier, ranks[identifier % len(ranks)])
        self.random_codebook(0, ranks[0])                  # once more before the first frame

    def frame(self, number):
        if number > self.first:
            for identifier in (1, 2):
                self.random_codebook(identifier, list(self.sh_ranks.values())[identifier % len(self.sh_ranks)])
        super().frame(number)


def books(seed, **asked):
    asked = {"sh_degree": 1, "gops": [(1, 2, 5), (1, 0, 2)], "temporal_layer_count": 3, "sizes": more,
             "fixed": {}, "modes": (0, 0, 1, 1), **asked}
    return Books(seed, **asked).stream()


CODEBOOK = [
    ("codebook-defined-again", "SS-CB-001 SS-BS-010 SS-IN-010",
     "Codebooks are defined again before the first frame and between frames", {}),
    ("codebook-of-temporal-layers", "SS-CB-001 SS-IN-010 SS-OP-002",
     "Codebooks of higher temporal layers, which lower operating points do not have",
     {"gops": [(1, 3, 9)], "temporal_layer_count": 4, "most": 8}),
]
EVERY_TOOL = dict(sh_degree=1, spatial_layer_count=2, sequence_flags=1, percent=[40, 100], gops=[(1, 1, 4), (0, 0, 1)],
                  temporal_layer_count=3, most=14, sizes=None, modes=None)


def every_tool(seed):
    """A synth of a stream with all tools but the learned predictor, for faults; it takes a tamper."""
    return lambda tamper=None: Books(seed, tamper=tamper, **EVERY_TOOL)


# The parents of catalogue_increments.py: name and a function of a tamper
ALL_TOOLS = [("stability-every-tool", every_tool(22), 22), ("stability-every-tool-without-sh", every_tool(2), 2)]
COLOURS = ("prediction-colour-ends", lambda tamper=None: DirectedSynth(COLOUR_SEED, tamper, **MEANS))
# Updates at which a value may be out of range while what it gives is not
LARGE = ("survivors-large-updates", lambda tamper=None: DirectedSynth(
    3, tamper, percent=[100], gops=[(1, 0, 2)], modes=(0, 0, 1, 0), sizes=same, removed=lambda n: 0, cells=lambda w, occupied: {},
    values={"log_scale": lambda w, p, factor: [0 if any(p) else 10000, 0, 0], "rotation": lambda w, p, factor: [
        0 if any(p) else 1000] * 3}, fixed={"attribute_step": [1, 0, 0, 0, 0], "predictor_block_log2": None}))
TABLES = (("survivors", SURVIVORS), ("cells", CELLS), ("prediction", PREDICTION))


def rows():
    for area, table, make in (*((area, table, directed) for area, table in TABLES), ("codebook", CODEBOOK, books)):
        for name, requirements, purpose, asked in table:
            seed = seed_of(name)
            yield Vector("valid", area, name, purpose, requirements,
                         lambda seed=seed, asked=asked, make=make: make(seed, **asked), "directed", seed)
    for name, make, seed in ALL_TOOLS:
        yield Vector("valid", "stability", name,
                     "Every tool of profile 1 but the learned predictor; the parent of many invalid vectors",
                     "SS-IN-005 SS-FR-007 SS-IN-006 SS-PA-006 SS-IN-008 SS-IN-010 SS-IN-011 SS-IN-011",
                     lambda make=make: make().stream(), "directed", seed)
    yield Vector("valid", "survivors", LARGE[0], "Updates of large log-scales and rotations; the parent of invalid vectors",
                 "SS-RC-001 SS-RC-003 SS-PA-004", lambda: LARGE[1]().stream(), "directed", 3)
    yield Vector("valid", "prediction", COLOURS[0], "Means of 2^30, from which components go downwards only",
                 "SS-RC-005 SS-RC-006", lambda: COLOURS[1]().stream(), "directed", COLOUR_SEED)
