"""Vectors of move prediction and of extrapolated opacities (7.4.6 to 7.4.8), and of their flags (6.14)."""

from oracle import constants as c
from oracle.lists import position_limit
from ..faults import element, flipped, invalid, kind
from ..synth.directed import DirectedSynth, directed
from ..vector import Vector, seed_of
from .increments import entry, remade
from .order import increment, whole_frame
from .structure import QUARTERS
from .tools import NO_ROTATION, alternating, every, more, same

INCREMENT = kind(c.UT_INCREMENT)
KEEP = dict(sizes=same, removed=lambda n: 0)
TURNING = alternating(([40, -24, 8], [400, -100, 50], 0), ([-16, 8, 56], NO_ROTATION, 0))
DRIFT = every(([12, -20, 28], NO_ROTATION, 0))
NO_CELLS = lambda w, occupied: {}
ALONE = [(1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1)]
PREDICTOR_NAMES = ("cells", "previous", "neighbours", "both")


def near(reach):
    """Moves of at most so many steps."""
    return lambda w, axis: w.rng.randint(-reach, reach)


def blocks(log2, **more_fixed):
    return {"fixed": {"move_block_log2": log2, "position_shift": 0, **more_fixed}}


MOVING = dict(KEEP, **blocks(0), gops=[(1, 0, 4)], most=12, percent=[100], modes=(1, 3, 1, 1), cells=TURNING, cell_log2=7,
              move=near(9))
DEEP = dict(MOVING, gops=[(1, 3, 10)], temporal_layer_count=4, most=7, move_predictors=(0, 1, 1, 1))


def along_diagonal(w, near_ones, bits):
    """Each position in another place of the order of Morton codes, far from the border."""
    x = w.rng.randrange(2 ** bits // 4, 3 * 2 ** bits // 4)
    return [x, x, x]


def at_edges(w, near_ones, bits):
    return [w.rng.choice([0, 1, 2 ** bits - 2, 2 ** bits - 1]) for _ in range(3)]


def outwards(w, axis):
    """Moves that go on towards the ends of the grid; the writer shortens those that would leave it."""
    return w.rng.choice([-1, 1]) * w.rng.choice([3, 60, 200])


SURVIVORS = [
    ("moves-predicted-by-" + name, "SS-PA-010 SS-PA-004 SS-PA-007",
     "Move predictor %d alone, over five frames with cells" % k, dict(MOVING, move_predictors=weights))
    for k, (name, weights) in enumerate(zip(PREDICTOR_NAMES, ALONE))
] + [
    ("moves-predicted-by-%s-without-cells" % name, "SS-PA-010 SS-PA-007",
     "Move predictor %d alone where nothing is displaced" % k, dict(MOVING, move_predictors=ALONE[k], cells=NO_CELLS))
    for k, name in ((1, "previous"), (2, "neighbours"), (3, "both"))
] + [
    ("moves-predicted-in-blocks-of-%d" % 2 ** k, "SS-PA-009 SS-PA-010 SS-IN-011",
     "All move predictors in blocks of %d moves" % 2 ** k,
     dict(MOVING, **blocks(k), gops=[(1, 0, 3)], most=40, modes=(1, 4, 0, 1), move_predictors=(1, 1, 1, 1))) for k in (0, 1, 3,
          16)
] + [
    ("moves-predicted-across-blocks", "SS-PA-009 SS-PA-010 SS-SE-001",
     "Move predictors of eight moves in sections of several blocks",
     dict(MOVING, **blocks(3), gops=[(1, 0, 3)], most=150, percent=[100], modes=(1, 12, 0, 0), move_predictors=(1, 1, 1, 1))),
    ("moves-in-first-p-frame", "SS-PA-007 SS-PA-010 SS-PA-008",
     "The first P frame of each GOP: no motion is known of the reference frame, an I frame",
     dict(MOVING, gops=[(1, 0, 2), (1, 0, 2)], move_predictors=(0, 1, 0, 1))),
    ("moves-of-every-span", "SS-PA-008 SS-PA-010",
     "Frames of spans 1, 2, 4 and 8, whose reference frames have the same or a longer one",
     dict(DEEP, gops=[(1, 3, 13)])),
    ("moves-of-span-1-after-8", "SS-PA-008", "A B frame of span 1 that refers to a P frame of span 8",
     dict(DEEP, present=lambda k: k in (0, 8, 9), move_predictors=(0, 1, 0, 0))),
    ("moves-of-spans-that-halve", "SS-PA-008",
     "Spans 8, 4, 2 and 1 one after the other: motions are halved and rounded each time",
     dict(DEEP, gops=[(1, 3, 16)], present=lambda k: k in (0, 8, 12, 14, 15), most=10, modes=(1, 2, 0, 0),
          move_predictors=(1, 2, 0, 0), cells=every(([40, -24, 8], [400, -100, 50], 0)))),
    ("moves-of-missing-b-frames", "SS-PA-008 SS-BS-010",
     "Some B frames are absent: spans are counted in display indices all the same",
     dict(DEEP, gops=[(1, 3, 16)], present=lambda k: k in (0, 2, 4, 8, 12, 13, 14), most=8)),
    ("moves-of-depth-1", "SS-PA-008", "Spans 1 and 2 in turn", dict(DEEP, gops=[(1, 1, 6)], temporal_layer_count=2)),
    ("moves-of-new-gaussians", "SS-PA-007 SS-PA-010", "Gaussians that are new in one frame move in the next: their motion was 0",
     dict(MOVING, sizes=more, gops=[(1, 0, 4)], most=6, move_predictors=(0, 1, 0, 1), modes=(0, 1, 0, 0))),
    ("moves-after-skip", "SS-PA-007", "A parent that a frame skips has the motion of its cell, whatever it did before",
     dict(MOVING, gops=[(1, 0, 6)], modes=(2, 1, 0, 0), move_predictors=(0, 1, 0, 0), move=near(200))),
    ("moves-after-update", "SS-PA-007", "A parent that a frame updates has the motion of its cell",
     dict(MOVING, gops=[(1, 0, 5)], modes=(0, 1, 2, 0), move_predictors=(0, 1, 0, 1), move=near(200))),
    ("moves-beside-removed", "SS-PA-011", "Half of the parents are removed: they have places in the order and are no neighbours",
     dict(MOVING, most=30, gops=[(1, 0, 3)], removed=lambda n: n // 2, sizes=same, modes=(0, 1, 0, 0), move_predictors=(0, 0, 1,
          1))),
    ("moves-beside-skipped", "SS-PA-011", "Most parents are skipped or updated: their motions are known before those that move",
     dict(MOVING, most=30, gops=[(1, 0, 3)], modes=(3, 2, 3, 0), move_predictors=(0, 0, 1, 1))),
    ("moves-all", "SS-PA-011", "Every parent moves: only those before it are neighbours, and the first has none",
     dict(MOVING, most=30, gops=[(1, 0, 3)], modes=(0, 1, 0, 0), move_predictors=(0, 0, 1, 1), move=near(40))),
    ("moves-without-neighbours", "SS-PA-011 SS-PA-010", "One Gaussian in each list: the average of no neighbours is 0",
     dict(MOVING, most=1, percent=[100], modes=(0, 1, 0, 0), move_predictors=(0, 0, 1, 1))),
    ("moves-of-two", "SS-PA-011 SS-PA-010", "Two and three parents: fewer neighbours than four",
     dict(MOVING, most=5, percent=[40, 100], modes=(0, 1, 0, 0), move_predictors=(0, 0, 1, 1), move=near(99))),
    ("moves-beside-other-lists", "SS-PA-011", "Parents of lower refinements are neighbours, those of higher ones are not",
     dict(MOVING, percent=[30, 60, 100], gops=[(1, 0, 3)], most=30, modes=(1, 2, 1, 0), move_predictors=(0, 0, 1, 1))),
    ("moves-removed-in-other-lists", "SS-PA-011", "Parents that another increment of the frame removed are no neighbours",
     dict(MOVING, percent=[30, 60, 100], gops=[(1, 0, 3)], most=30, removed=lambda n: n // 3, modes=(0, 1, 0, 0),
          move_predictors=(0, 0, 1, 1))),
    ("moves-at-ties", "SS-PA-011", "A grid of 64 points: neighbours at equal distances and with equal codes, of several lists",
     dict(MOVING, position_bits=2, most=40, percent=[30, 60, 100], cells=NO_CELLS, modes=(1, 2, 0, 0), move_predictors=(0, 0, 1,
          1),
          move=near(1))),
    ("moves-at-one-position", "SS-PA-011", "Every Gaussian starts at one position: codes and distances are equal",
     dict(MOVING, most=44, percent=[50, 100], position=lambda w, near_ones, bits: [300, 200, 100], cells=NO_CELLS,
          modes=(2, 3, 0, 0), move_predictors=(0, 0, 1, 0), gops=[(1, 0, 3)])),
    ("moves-in-window", "SS-PA-011", "More parents than the window has, on a line: 16 before and 16 after",
     dict(MOVING, most=90, percent=[100], gops=[(1, 0, 2)], position=along_diagonal, cells=NO_CELLS, modes=(1, 6, 0, 0),
          move_predictors=(0, 0, 1, 0))),
    ("moves-of-far-neighbours", "SS-PA-011 SS-PA-010", "Neighbours across the whole grid of 20 bits, and moves from end to end",
     dict(MOVING, position_bits=20, most=12, position=lambda w, near_ones, bits: [w.rng.choice([0, 5,
          2 ** bits - 1]) for _ in "xyz"],
          cells=NO_CELLS, modes=(0, 1, 0, 0), move_predictors=(0, 1, 1, 1), move=lambda w, axis: w.rng.choice([-32768, 0, 32767]),
          fixed={"move_block_log2": 0, "position_shift": 5})),
    ("moves-clamped", "SS-PA-004 SS-PA-010", "Predictions beyond the ends of the grid are clamped before the residual is added",
     dict(MOVING, position_bits=8, most=24, position=at_edges, cells=DRIFT, modes=(0, 1, 0, 0), move_predictors=(0, 1, 1, 1),
          move=outwards)),
    ("moves-with-position-shift", "SS-PA-004 SS-PA-010", "position_shift 4: residuals are coarse, predictions are not",
     dict(MOVING, fixed={"move_block_log2": 0, "position_shift": 4}, move_predictors=(0, 1, 1, 1))),
    ("moves-without-section", "SS-PA-007 SS-IN-001 SS-PA-010",
     "Every other frame has no move predictors: motions are kept in it as well",
     dict(MOVING, gops=[(1, 0, 6)], move_predictors=(0, 1, 1, 1),
          fixed={"move_block_log2": lambda w: 0 if w.frame.index_in_gop % 2 == 0 else None, "position_shift": 0})),
    ("moves-predicted-in-one-list", "SS-PA-011 SS-PA-007",
     "Only the last of three lists has move predictors, and neighbours of all",
     dict(MOVING, percent=[30, 60, 100], gops=[(1, 0, 3)], most=24, move_predictors=(0, 0, 1, 1),
          fixed={"move_block_log2": lambda w: 0 if w.r == 2 else None, "position_shift": 0})),
]
TEMPORAL = [
    ("temporal-moves-of-fewer-units", "SS-PA-007 SS-PA-011 SS-LO-001", "P and B frames of fewer increments than lists",
     dict(DEEP, gops=[(1, 2, 7)], percent=QUARTERS, units=lambda k: [None, 2, 3, 2, 3, 1, 2][k], most=16)),
    ("temporal-moves-nested", "SS-PA-011 SS-OP-002 SS-LO-004",
     "Three spatial layers and four lists: each operating point has its neighbours",
     dict(MOVING, spatial_layer_count=3, percent=QUARTERS, gops=[(1, 1, 3)], move_predictors=(0, 1, 1, 1))),
    ("temporal-moves-whole-anchor", "SS-PA-007 SS-PA-011 SS-OP-002", "A whole anchor, of which P and B frames refer to all lists",
     dict(MOVING, whole=True, percent=QUARTERS, gops=[(1, 2, 6)], move_predictors=(0, 1, 1, 1))),
    ("temporal-moves-stale", "SS-PA-010 SS-CA-001", "Parents of stale cells are displaced and moved as others are",
     dict(MOVING, percent=[40, 100], cells=every(([12, -20, 28], [300, 0, -200], 1)),
          units=lambda k: None if k == 0 else 1 + k % 2,
          move_predictors=(0, 1, 1, 1))),
]

# ---- opacities that go on as they did ----

FADING = dict(KEEP, gops=[(1, 0, 5)], most=12, percent=[100], modes=(3, 1, 3, 1),
              values={"opacity": lambda w, p, factor: [w.rng.randint(-40, 40) // factor]},
              fixed={"extrapolates_opacity": 1, "move_block_log2": None, "predictor_block_log2": None})


def towards_ends(w, p, factor):
    """Opacities near the ends of their range that go on to them."""
    if p == 0:
        return [w.rng.choice([-30000, 30000])]
    return [max(-32768 - p, min(32767 - p, 1500 if p > 0 else -1500))]




def fixed(**asked):
    return {**FADING["fixed"], **asked}


FADES = [
    ("fading-opacities", "SS-PA-012 SS-PA-007",
     "Opacities go on as they did, of parents that are skipped, moved and updated", FADING),
    ("fading-of-skipped", "SS-PA-012 SS-PA-007",
     "Updates in one frame, then increments of parents alone, which fade on by themselves",
     dict(FADING, gops=[(1, 0, 5)], modes=lambda w: (0, 0, 1, 0) if w.frame.index_in_gop == 1 else (1, 0, 0, 0))),
    ("fading-at-ends", "SS-PA-012", "Extrapolated opacities are clamped at both ends of their range",
     dict(FADING, modes=(2, 0, 1, 0), values={"opacity": towards_ends}, fixed=fixed(attribute_step=[0] * 5))),
    ("fading-of-every-span", "SS-PA-012 SS-PA-008", "Fades of spans 1, 2, 4 and 8",
     dict(FADING, gops=[(1, 3, 13)], temporal_layer_count=4, most=8)),
    ("fading-in-first-p-frame", "SS-PA-012 SS-PA-007", "Frames that refer to an I frame: fades of 0",
     dict(FADING, gops=[(1, 0, 2), (1, 1, 3)])),
    ("fading-of-new-gaussians", "SS-PA-012 SS-PA-007", "Gaussians that are new in one frame do not fade in the next",
     dict(FADING, sizes=more, gops=[(1, 0, 4)], most=6)),
    ("fading-of-removed", "SS-PA-012 SS-PR-001",
     "Parents that are removed, and a reference set with opacities that are not extrapolated",
     dict(FADING, sizes=same, removed=lambda n: n // 3, percent=[60, 100], predictors=(0, 1, 1), gops=[(1, 0, 4)], most=16,
          fixed=fixed(predictor_block_log2=0, neighbour_count=3))),
    ("fading-now-and-then", "SS-PA-012 SS-PA-007 SS-IN-001",
     "Every other frame extrapolates: fades are kept in the others as well",
     dict(FADING, fixed=fixed(extrapolates_opacity=lambda w: w.frame.index_in_gop % 2))),
    ("fading-in-one-list", "SS-PA-012", "One of three lists extrapolates",
     dict(FADING, percent=[30, 60, 100], fixed=fixed(extrapolates_opacity=lambda w: int(w.r == 1 and not w.frame.intra)))),
    ("fading-with-steps", "SS-PA-012 SS-AT-004",
     "Steps of rotations and colours follow from opacities after extrapolation, before the update",
     dict(FADING, opacity_weight=[300, 400, 500], opacity_reference=40, sh_degree=1, modes=(0, 0, 1, 0),
          values={**FADING["values"], "rotation": lambda w, p, factor: [1, -1, 0]})),
    ("fading-of-fewer-units", "SS-PA-012 SS-CA-004", "Lists that a frame lacks are carried, with opacities as in the I frame",
     dict(FADING, percent=[30, 60, 100], units=lambda k: None if k == 0 else 1 + k % 3)),
]


# ---- invalid ----


def synth(seed, asked):
    return lambda tamper=None: DirectedSynth(seed, tamper, **asked)


LAYERED = dict(KEEP, spatial_layer_count=2, gops=[(1, 0, 2)], modes=(0, 1, 1, 1), most=12, layer_sizes=lambda share,
     s: share // 2,
               fixed={"move_block_log2": None})
LAYERS = "survivors-moves-parent-of-faults"
MIXED = "survivors-moves-predicted-in-blocks-of-1"
FADED = "survivors-fading-opacities"
WITHOUT_PARENTS, ALL_SKIP, INTRA = "survivors-without-parents", "survivors-all-skip", "stream-several-gops"


def with_predictors(u, w):
    """Move predictors with a section that fits them."""
    u.set("move_block_log2", 0)
    w.v["move_predictors"] = [[0] * u.move_count]
    return u


def in_i_frame(u, w):
    return w.frame.intra and u.move_count > 0


def predicts_moves(u, w):
    return u.predicts_moves


def set_flag(u, w):
    u.set("extrapolates_opacity", 1)
    return u


def goes_out(v, w):
    """A residual that would be right from the displaced position, and leaves the grid from the predicted one."""
    v[0][0] = -(w.starts[0][0] >> (w.u.position_shift + 6)) - 1
    return v


def one_above(w):
    """(axis, mover, move) that ends one above the largest position_fine."""
    step = 64 << w.u.position_shift
    for j, start in enumerate(w.starts):
        for a in range(3):
            way = position_limit(w.seq) + 1 - start[a]
            if way % step == 0:
                return a, j, way // step
    return None


def just_above(v, w):
    a, j, move = one_above(w)
    v[a][j] = move
    return v


AGAIN = [
    ("move-just-above", MIXED, "CONSTRAINT", "SS-PA-005", "a move ends a 64th above the largest position", "moves",
     lambda v, w: one_above(w) is not None, just_above),
    ("move-predictor-4", MIXED, "OUT_OF_RANGE", "SS-PA-009", "a move predictor is 4", "move_predictors", lambda v, w: True,
     entry(0, 4)),
    ("move-predictor-negative", MIXED, "OUT_OF_RANGE", "SS-PA-009", "a move predictor is -1", "move_predictors", lambda v,
         w: True,
     entry(0, -1, -1)),
    ("move-block-log2-17", MIXED, "OUT_OF_RANGE", "SS-ER-001", "move_block_log2 is 17", "elements", predicts_moves,
     lambda u, w: u.set("move_block_log2", 17) or u),
    ("move-predictors-in-i-frame", LAYERS, "MISMATCH", "SS-IN-015", "has_move_predictors in an I frame with moves", "elements",
     in_i_frame, with_predictors),
    ("extrapolation-in-i-frame", LAYERS, "MISMATCH", "SS-IN-015", "extrapolates_opacity in an I frame with parents", "elements",
     in_i_frame, set_flag),
    ("predicted-move-out", MIXED, "CONSTRAINT", "SS-PA-005 SS-PA-010", "a move ends below 0 from its predicted position", "moves",
     lambda v, w: bool(w.starts) and w.u.predicts_moves, goes_out),
    ("move-predictors-other", MIXED, "DIGEST", "SS-PA-010 SS-IN-012",
         "a move predictor is another one than when the digest was made",
     "move_predictors", lambda v, w: not w.frame.reference.intra, entry(0, lambda x: (x + 1) % 4)),
]
PARENTS = {MIXED: next(row[3] for row in SURVIVORS if row[0] == "moves-predicted-in-blocks-of-1"), LAYERS: LAYERED}
FLAGS = [
    ("constraint-increment-move-predictors-without-moves", ALL_SKIP, "CONSTRAINT", "SS-IN-013",
     "has_move_predictors in an increment without moves", element(kind(c.UT_INCREMENT, nth=-1), "move_block_log2", 3)),
    ("constraint-increment-extrapolation-without-parents", WITHOUT_PARENTS, "CONSTRAINT", "SS-IN-013",
     "extrapolates_opacity in an increment of a P frame without parents", element(increment(1, 2), "extrapolates_opacity", 1)),
    ("constraint-increment-move-predictors-in-profile-0", INTRA, ("RESERVED", "MISMATCH", "CONSTRAINT"), "SS-IN-014 SS-LM-003",
     "has_move_predictors in profile 0", element(INCREMENT, "move_block_log2", 0)),
    ("constraint-increment-extrapolation-in-profile-0", INTRA, ("RESERVED", "MISMATCH", "CONSTRAINT"), "SS-IN-014 SS-LM-003",
     "extrapolates_opacity in profile 0", element(INCREMENT, "extrapolates_opacity", 1)),
    ("digest-extrapolation-absent", FADED, "DIGEST", "SS-PA-012 SS-IN-012",
         "a frame does not extrapolate opacities as its digest asks",
     element(increment(2), "increment_flags", lambda x: x & ~(1 << 11))),
]
LOSSES = [
    ("loss-of-list-with-motions", "survivors-moves-beside-other-lists", "CHECKSUM", "SS-PA-011 SS-LO-002",
     "increment 2 of a P frame is damaged: lists 0 and 1 of the next frame find the same move neighbours", flipped(increment(1,
          2))),
    ("loss-of-b-frame-with-motions", "survivors-moves-of-every-span", "UNDEFINED", "SS-PA-008 SS-LO-003",
     "frame 2 is absent, and frame 3, which refers to it, has no Gaussians", whole_frame(2)),
    ("loss-of-unit-with-motions", "survivors-moves-of-every-span", "CHECKSUM", "SS-PA-007 SS-LO-002",
     "increment 0 of a B frame is damaged, and frames that do not refer to it predict as before", flipped(increment(6, 0))),
]


def rows():
    for area, table in (("survivors", SURVIVORS + FADES), ("temporal", TEMPORAL)):
        for name, requirements, purpose, asked in table:
            name = name if name.startswith(area) else area + "-" + name
            seed = seed_of(name)
            yield Vector("valid", area, name, purpose, requirements,
                         lambda seed=seed, asked=asked: directed(seed, **asked), "directed", seed)
    yield Vector("valid", "survivors", LAYERS, "An I frame with moves and parents; the parent of invalid vectors",
         "SS-PA-004 SS-PA-007",
                 lambda: directed(seed_of(LAYERS), **LAYERED), "directed", seed_of(LAYERS))
    for name, parent, code, requirements, fault, *change in AGAIN:
        make = synth(seed_of(parent), PARENTS[parent])
        yield Vector("invalid", "prediction", "prediction-increment-" + name, None, requirements,
                     lambda data, make=make, code=code, change=change: remade(data, make, (code,), *change), "increments", 0,
                          parent,
                     fault, code)
    yield from invalid("constraint", "records", [row for row in FLAGS if row[0].startswith("constraint")])
    yield from invalid("digest", "digest", [row for row in FLAGS if row[0].startswith("digest")])
    yield from invalid("loss", "losses", LOSSES)
