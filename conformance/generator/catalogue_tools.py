"""Valid vectors of the tools of predicted frames: survivors, cells, prediction, codebooks between frames."""

import oracle_path  # noqa: F401
from synth_directed import DirectedSynth, directed
from vector import Vector, seed_of


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
    ("survivors-to-corners", "SS-PA-005", "Moves to the ends of the lattice on every axis",
     dict(modes=(0, 1, 0, 0), position_bits=8, sizes=same, move=lambda w, axis: w.rng.choice([-20000, 20000]),
          fixed={"position_shift": 0})),
    ("survivors-without-parents", "SS-PA-001 SS-IN-007", "Homes without parents get Gaussians in a P frame",
     dict(most=lambda number: 1, sizes=more, percent=[10, 50, 100])),
    ("survivors-anchors", "SS-CA-003", "Anchors and new Gaussians are compensated differently at lower refinements",
     dict(sizes=more, percent=[30, 60, 100], fixed={"compensation_log_scale": -7, "compensation_opacity": 11,
                                                    "predictor_block_log2": 255})),
]


def every(value):
    return lambda w, occupied: {X: value for X in occupied}


def alternating(first, second):
    return lambda w, occupied: {X: (first, second)[k % 2] for k, X in enumerate(occupied)}


def elsewhere(w, occupied):
    """Cells in which no Gaussian is."""
    last = 2 ** max(w.seq.position_bits - w.u.cell_log2, 1) - 1
    corners = [(0, 0, 0), (last, 0, 0), (0, last, last), (last, last, last)]
    return {X: ([80, 0, -80], [0, 0, 0], 1) for X in corners if X not in occupied}


def eight_cells(w, occupied):
    return {(x, y, z): ([8, 8, 8], NO_TURN, 0) for x in (0, 1) for y in (0, 1) for z in (0, 1)}


NO_TURN, NO_SHIFT = [0, 0, 0], [0, 0, 0]
CELLS = [
    ("cells-translation", "SS-MO-001 SS-MO-002 SS-MO-004", "Cells that are translated without turning",
     dict(cells=every(([8, -16, 3], NO_TURN, 0)))),
    ("cells-translation-ends", "SS-MO-002",
     "Translations of 2^20 eighths to both sides, which end at the border of the lattice",
     dict(cells=lambda w, occupied: {X: ([min(2 ** 20, 31000 * (k + 1)), -min(2 ** 20, 31000 * (k + 1)), 0], NO_TURN,
                                         0) for k, X in enumerate(occupied)},
          fixed={"cell_log2": 4}, most=60, gops=[(1, 0, 2)])),
    ("cells-turn-half", "SS-MO-002 SS-MO-003 SS-MO-004", "Turns of 8192 about each axis: 60 degrees",
     dict(cells=lambda w, occupied: {X: (NO_SHIFT, [8192 * (a == k % 3) for a in range(3)], 0) for k,
                                     X in enumerate(occupied)}, fixed={"cell_log2": 8})),
    ("cells-turn-largest", "SS-MO-002 SS-MO-004", "Turns of 8192 on all axes at once: 120 degrees",
     dict(cells=alternating((NO_SHIFT, [8192] * 3, 0), (NO_SHIFT, [-8192] * 3, 0)), fixed={"cell_log2": 9})),
    ("cells-turn-small", "SS-MO-004", "Turns of one unit, at the limit of rounding",
     dict(cells=every((NO_SHIFT, [1, -1, 1], 0)), fixed={"cell_log2": 10})),
    ("cells-whole-lattice", "SS-MO-001", "cell_log2 equals position_bits: one cell has everything",
     dict(cells=every(([5, 5, 5], [300, -200, 100], 0)), fixed={"cell_log2": 10})),
    ("cells-of-one-point", "SS-MO-001", "cell_log2 0: every cell is a lattice point",
     dict(cells=every(([64, 8, -8], [100, 0, 0], 0)), fixed={"cell_log2": 0})),
    ("cells-codes-beyond-reach", "SS-MO-001",
     "cell_log2 equals position_bits, where codes 1 to 7 are allowed and no Gaussian is in their cells",
     dict(cells=eight_cells, fixed={"cell_log2": 10})),
    ("cells-stale", "SS-CA-001 SS-MO-002", "All cells are stale: nothing is carried, but parents are displaced",
     dict(cells=every(([8, 8, 8], NO_TURN, 1)), sizes=fewer)),
    ("cells-stale-in-part", "SS-CA-001 SS-CA-002", "Every other cell is stale",
     dict(cells=alternating(([8, 8, 8], NO_TURN, 1), (NO_SHIFT, NO_TURN, 0)), sizes=same, fixed={"cell_log2": 6})),
    ("cells-elsewhere", "SS-MO-001", "Cells in which no Gaussian is", dict(cells=elsewhere, fixed={"cell_log2": 3})),
    ("cells-several-blocks", "SS-MO-001 SS-SE-001", "More than 64 cells: running sums start anew in each block",
     dict(cells=every(([8, 0, -8], [9, 9, 9], 0)), fixed={"cell_log2": 1}, most=100, gops=[(1, 0, 2)])),
    ("cells-unity-32767", "SS-MO-003", "A rotation_step so small that U is limited to 32767",
     dict(cells=every((NO_SHIFT, [4000, 0, 0], 0)), rotation_step=1e-6)),
    ("cells-unity-1", "SS-MO-003", "rotation_step 1: U is 1",
     dict(cells=every((NO_SHIFT, [4000, 99, 0], 0)), rotation_step=1.0)),
    ("cells-unity-half", "SS-MO-003", "1 / rotation_step + 1/2 is an integer: U is 2",
     dict(cells=every((NO_SHIFT, [4000, 99, 0], 0)), rotation_step=2.0 / 3)),
    ("cells-rotation-double-cover", "SS-MO-004",
     "Rotations of nearly half a turn displaced further: the scalar part changes its sign",
     dict(cells=every((NO_SHIFT, [0, 0, 8000], 0)), rotation_step=0.001,
          values={"rotation": lambda w, p, shift: [0, 0, (63500 - p[2]) >> 6]},
          fixed={"attribute_shift": [0] * 5, "predictor_block_log2": 255})),
]
NEAR = {"percent": [50, 100], "most": 24, "gops": [(1, 0, 2)], "sizes": more, "sh_degree": 1}


COLOUR_SEED = 0
MEANS = dict(NEAR, mean=(2 ** 30, 0), ranks=(3, 2), predictors=(1, 1, 1), most=40)


def at(*position):
    return lambda w, near, bits: list(position)


PREDICTION = [
    ("prediction-none", "SS-PR-003 SS-RC-005", "predictor_block_log2 255: no section predictors",
     dict(NEAR, fixed={"predictor_block_log2": 255})),
    ("prediction-none-chosen", "SS-PR-002", "Predictor 0 for every block",
     dict(NEAR, predictors=(1, 0, 0), fixed={"predictor_block_log2": 2})),
    ("prediction-knn", "SS-PR-004 SS-PR-005", "Predictor knn alone",
     dict(NEAR, predictors=(0, 1, 0), fixed={"predictor_block_log2": 0})),
    ("prediction-bilateral", "SS-PR-006 SS-PR-007", "Predictor bilateral alone",
     dict(NEAR, predictors=(0, 0, 1), fixed={"predictor_block_log2": 0, "bilateral_spatial": 20,
                                             "bilateral_feature": 5})),
    ("prediction-one-neighbour", "SS-PR-004", "neighbour_count 1",
     dict(NEAR, predictors=(0, 1, 1), fixed={"neighbour_count": 1, "predictor_block_log2": 1})),
    ("prediction-sixteen-neighbours", "SS-PR-004", "neighbour_count 16",
     dict(NEAR, predictors=(0, 1, 1), fixed={"neighbour_count": 16, "predictor_block_log2": 1})),
    ("prediction-fewer-references", "SS-PR-004", "Fewer Gaussians in the reference set than neighbour_count",
     dict(NEAR, percent=[10, 20, 100], predictors=(0, 1, 1), fixed={"neighbour_count": 16, "predictor_block_log2": 0})),
    ("prediction-no-references", "SS-PR-003", "Predictors in units with an empty reference set are read and not used",
     dict(gops=[(0, 0, 2)], percent=[100], predictors=(0, 1, 1), fixed={"predictor_block_log2": 1})),
    ("prediction-at-neighbour", "SS-PR-005 SS-PR-006",
     "New Gaussians exactly at neighbours: knn copies, bilateral makes no exception",
     dict(NEAR, predictors=(0, 1, 1), place=lambda w, near, bits: list(w.rng.choice(near)) if near else [7, 7, 7],
          fixed={"position_shift": 0, "predictor_block_log2": 0})),
    ("prediction-ties", "SS-PR-004", "Neighbours at equal distances: the index decides",
     dict(NEAR, position_bits=2, predictors=(0, 1, 1), fixed={"neighbour_count": 3, "position_shift": 0,
                                                              "predictor_block_log2": 0})),
    ("prediction-all-at-one-place", "SS-PR-004 SS-PR-005", "Every Gaussian at one place: all distances are 0",
     dict(NEAR, predictors=(0, 1, 1), place=at(100, 200, 300), cells=lambda w, occupied: {}, modes=(1, 0, 0, 0),
          fixed={"position_shift": 0})),
    ("prediction-far", "SS-PR-004 SS-PR-005", "Neighbours across the whole lattice of 20 bits: the widths of 7.12",
     dict(NEAR, position_bits=20, predictors=(0, 1, 1), place=lambda w, near,
          bits: [w.rng.choice([0, 2 ** bits - 1]) for _ in range(3)])),
    ("prediction-weights-of-zero", "SS-PR-006 SS-PR-007", "bilateral weights 0: every neighbour has the largest weight",
     dict(NEAR, predictors=(0, 0, 1), fixed={"bilateral_spatial": 0, "bilateral_feature": 0})),
    ("prediction-weights-of-255", "SS-PR-006 SS-PR-007", "bilateral weights 255: the smallest entries of EXP",
     dict(NEAR, predictors=(0, 0, 1), fixed={"bilateral_spatial": 255, "bilateral_feature": 255})),
    ("prediction-features", "SS-PR-006", "Only attribute differences weigh",
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
    ("prediction-in-b-frames", "SS-PR-001", "Reference sets of B frames, with homes of the I frame above the unit",
     dict(gops=[(1, 2, 5)], percent=[30, 60, 100], sizes=more, predictors=(0, 1, 1), temporal_layer_count=3,
          fixed={"predictor_block_log2": 0})),
]


class Books(DirectedSynth):
    """Codebooks in every phase in which they may stand."""

    def definitions(self):
        super().definitions()
        ranks = list(self.sh_ranks.values())
        for identifier in range(4):
            self.codebook(identifier, ranks[identifier % len(ranks)])
        self.codebook(0, ranks[0])                  # once more before the first frame

    def frame(self, number):
        if number > self.first:
            for identifier in (1, 2):
                self.codebook(identifier, list(self.sh_ranks.values())[identifier % len(self.sh_ranks)])
        super().frame(number)


def books(seed, **asked):
    asked = {"sh_degree": 1, "gops": [(1, 2, 5), (1, 0, 2)], "temporal_layer_count": 3, "sizes": more,
             "fixed": {}, "modes": (0, 0, 1, 1), **asked}
    return Books(seed, **asked).stream()


CODEBOOK = [
    ("codebook-defined-again", "SS-CB-003 SS-BS-010 SS-IN-006",
     "Codebooks are defined again before the first frame and between frames", {}),
    ("codebook-of-temporal-layers", "SS-CB-003 SS-IN-006 SS-OP-006",
     "Codebooks of higher temporal layers, which lower operating points do not have",
     {"gops": [(1, 3, 9)], "temporal_layer_count": 4, "most": 8}),
]
EVERY_TOOL = dict(sh_degree=1, spatial_layer_count=2, sequence_flags=1, percent=[40, 100], gops=[(1, 1, 4), (0, 0, 1)],
                  temporal_layer_count=3, most=14, sizes=None, modes=None)


def every_tool(seed):
    """A synth of a stream with all tools but the learned predictor, for faults; it takes a tamper."""
    return lambda tamper=None: Books(seed, tamper=tamper, **EVERY_TOOL)


# The parents of catalogue_increments.py: name and a function of a tamper
ALL_TOOLS = [("stability-every-tool", every_tool(8))]
COLOURS = ("prediction-colour-ends", lambda tamper=None: DirectedSynth(COLOUR_SEED, tamper, **MEANS))
TABLES = (("survivors", SURVIVORS), ("cells", CELLS), ("prediction", PREDICTION))


def rows():
    for area, table, make in (*((area, table, directed) for area, table in TABLES), ("codebook", CODEBOOK, books)):
        for name, requirements, purpose, asked in table:
            seed = seed_of(name)
            yield Vector("valid", area, name, purpose, requirements,
                         lambda seed=seed, asked=asked, make=make: make(seed, **asked), "directed", seed)
    for name, make in ALL_TOOLS:
        yield Vector("valid", "stability", name,
                     "Every tool of profile 1 but the learned predictor; the parent of many invalid vectors",
                     "SS-IN-001 SS-IN-002 SS-IN-003 SS-IN-004 SS-IN-005 SS-IN-006 SS-IN-007 SS-EC-008",
                     lambda make=make: make().stream(), "directed", 8)
    yield Vector("valid", "prediction", COLOURS[0], "Means of 2^30, from which components go downwards only",
                 "SS-RC-004 SS-RC-005", lambda: COLOURS[1]().stream(), "directed", COLOUR_SEED)
