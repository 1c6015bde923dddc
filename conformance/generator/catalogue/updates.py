"""Vectors of updates (7.6.1, 7.6.2, 7.6.6): each log-scale by itself, and steps of the parent before the update."""

from ..synth.directed import DirectedSynth
from ..vector import Vector, seed_of
from .increments import entry, remade
from .tools import same

# A GOP of one list, all of whose Gaussians are updated in each P frame, without moves and cells
UPDATED = dict(gops=[(1, 0, 3)], most=12, percent=[100], modes=(0, 0, 1, 0), sizes=same, removed=lambda n: 0,
               cells=lambda w, occupied: {}, sh_degree=1, mean=(0, 0),
               fixed={"attribute_step": [0] * 5, "predictor_block_log2": None, "move_block_log2": None,
                      "extrapolates_opacity": 0, "sh_mode": lambda w: int(w.context.sh_transform is not None)})
NO_WEIGHTS = {"size_weight": [0] * 5, "opacity_weight": [0] * 3, "anisotropy_weight": 0}
CANONICAL = {"sequence_flags": 1}


def in_turn(new, *updates):
    """A choice of values: rows of new Gaussians, then those of the updates of each frame, one row after the other."""
    def choose(w, p, factor):
        rows = updates[(w.frame.index_in_gop - 1) % len(updates)] if w.chosen == "updates" else new
        turns = w.__dict__.setdefault("turns", {})
        turn = turns[id(rows)] = turns.get(id(rows), -1) + 1
        return list(rows[turn % len(rows)])
    return choose


SEED = seed_of("updates-9")                     # one with which every fault can be coded


def updated(**asked):
    """A function of a tamper that gives the synth of a stream."""
    asked = {**UPDATED, **NO_WEIGHTS, **asked, "fixed": {**UPDATED["fixed"], **asked.get("fixed", {})}}
    return lambda tamper=None: DirectedSynth(SEED, tamper, **asked)


# ---- log-scales ----

SMALL = {"opacity": in_turn([[3], [-2], [40]], [[1], [0], [-1]]), "rotation": in_turn([[5, -4, 3]], [[1, 0, -1], [-2, 1, 1]]),
         "dc": lambda w, p, factor: [1, -1, 1][:w.context.dc_transform.rank],
         "sh": lambda w, p, factor: [(1, -1, 0)[k % 3] for k in range(w.context.sh_transform.rank if w.u.sh_mode else 0)]}
# The rows of new Gaussians have the largest log-scale and two differences
ANY_ORDER = [[10, 3, 2], [-20, -5, 9], [0, 0, 0], [7, -7, -7]]
EVERY_SIGN = [[a, b, c] for a in (1, -2, 0) for b in (3, -1, 0) for c in (-4, 2)]
SORTED = [[10, 1, 1], [30, 0, 0], [-5, 4, 0], [8, 0, 6]]
# from 10, 9, 8; 30, 30, 30; -5, -9, -9; 8, 8, 2
SORTED_AGAIN = [[-5, -5, -5], [0, -1, -2], [-4, 0, 0], [-6, -6, 0]]
# from 5, 4, 3; 30, 29, 28; -9, -9, -9; 2, 2, 2
AND_AGAIN = [[7, 8, 9], [0, 1, 2], [0, 0, -1], [30, 30, 30]]
ENDS = [[0, 0, 0], [20000, 0, 0], [-10000, 0, 0]]
# from 0, 0, 0; three times 20000; three times -10000
TO_ENDS = [[32767, -32768, 0], [-32768, 12767, -32768], [-22768, 32767, 32767]]
# from 32767, -32768, 0; -12768, 32767, -12768; -32768, 22767, 22767
FROM_ENDS = [[-32768, 32767, 32767], [-20000, -32768, 32767], [32767, 10000, -32768]]

VALUES = [
    ("updates-of-each-log-scale", "SS-PA-004 SS-RC-001", "Updates of each log-scale by itself, with residuals of all signs",
     updated(values={**SMALL, "log_scale": in_turn(ANY_ORDER, EVERY_SIGN[:12], EVERY_SIGN[6:])})),
    ("updates-of-sorted-log-scales", "SS-RC-002 SS-PA-004",
     "Updates with canonical_axes: log-scales are sorted after all three residuals, and not after each; some become equal",
     updated(**CANONICAL, most=8, values={**SMALL, "log_scale": in_turn(SORTED, SORTED_AGAIN, AND_AGAIN)})),
    ("updates-that-unsort-log-scales", "SS-RC-002 SS-PA-004",
     "Without canonical_axes updates may exchange the order of log-scales",
     updated(values={**SMALL, "log_scale": in_turn(SORTED, [[-30, 0, 30], [-1, 1, 0], [0, 0, 9]])})),
    ("updates-to-ends", "SS-RC-001 SS-PA-004",
     "Updates that end at the ends of the range, of log-scales, their residuals and opacities; the parent of invalid vectors",
     updated(most=6, fixed={"attribute_step": lambda w: [0, 0 if w.frame.intra else 2, 0, 0, 0]},
             values={**SMALL, "log_scale": in_turn(ENDS, TO_ENDS, FROM_ENDS), "opacity": in_turn(
                 [[1], [-32768], [32767]], [[10922], [21845], [-21845]], [[-21845], [-1], [0]])})),
    ("updates-of-products-to-ends", "SS-RC-001 SS-AT-004",
     "Updates whose residuals are multiplied by 3 and reach the largest products within the range",
     updated(gops=[(1, 0, 2)], most=4, fixed={"attribute_step": [2, 2, 0, 0, 0]},
             values={**SMALL, "log_scale": in_turn([[0, 0, 0], [-3000, 0, 0]], [[10922, -10922, 10922], [10922, 1, -7922]]),
                     "opacity": in_turn([[0]], [[10922], [-10922]])})),
]

# ---- steps ----

SEVEN = {"size_weight": [2048] * 5, "size_reference": 40}
# Sizes on both sides of the reference; updates move each of them by several exponents
AROUND = [[20, 4, 3], [12, 0, 2], [30, 9, 0], [17, 6, 6]]
FAR = [[-9, -5, -4], [16, 10, 9], [-25, -19, -8], [0, 9, -3]]
BACK = [[5, 4, 6], [-12, -9, -8], [11, 12, 2], [-1, -2, -3]]
OF_SIZE = {**SMALL, "log_scale": in_turn(AROUND, FAR, BACK)}
# 2048 * 4 is half of 2^14: the exponent is that of the parent, and one step of the update changes it
EDGE = [[18, 0, 2], [18, 0, 3], [19, 2, 2], [17, 1, 1]]
ONE = [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]]
OPACITIES = in_turn([[30], [-30], [10], [12]], [[-30], [40], [5], [-7]], [[25], [-25], [-9], [3]])
ONE_OPACITY = in_turn([[8], [4], [12], [9]], [[1], [-1], [-1], [1]])
# anisotropies 2, 18, 9 and 0
NEEDLES = [[20, 1, 1], [20, 9, 9], [20, 0, 9], [20, 0, 0]]
STRETCHED = [[0, -3, -15], [-15, 0, 0], [9, 0, 0], [0, 0, -20]]

STEPS = [
    ("steps-before-updates-of-size", "SS-AT-004 SS-PA-004",
     "Updates that change sizes by several step exponents: the exponents are those of the parent before the update",
     updated(**SEVEN, values=OF_SIZE)),
    ("steps-before-updates-of-size-of-log-scales", "SS-AT-004",
     "The same with the weight of log_scale alone: v_log_scale[0] takes attribute_step, the others the step of the parent",
     updated(size_weight=[2048, 0, 0, 0, 0], size_reference=40, fixed={"attribute_step": [3, 0, 0, 0, 0]},
             values={**SMALL, "log_scale": in_turn(AROUND, [[-3, -1, 1], [5, 1, 1], [-8, 0, -1], [1, 2, 1]])})),
    ("steps-before-updates-at-edges-of-size", "SS-AT-004",
     "Sizes at which one log-scale step changes the step exponent, and updates by one step",
     updated(**SEVEN, values={**SMALL, "log_scale": in_turn(EDGE, ONE, ONE[::-1])})),
    ("steps-before-updates-of-opacity", "SS-AT-004 SS-PA-004",
     "Updates that change opacities by several step exponents of rotation, dc and sh",
     updated(opacity_weight=[2048, 3000, 4096], opacity_reference=12,
             values={**SMALL, "log_scale": in_turn(AROUND, ONE), "opacity": OPACITIES})),
    ("steps-before-updates-at-edges-of-opacity", "SS-AT-004",
     "Opacities at which one step changes the step exponents, and updates by one step",
     updated(opacity_weight=[2048] * 3, opacity_reference=12,
             values={**SMALL, "log_scale": in_turn(AROUND, ONE), "opacity": ONE_OPACITY})),
    ("steps-before-updates-of-anisotropy", "SS-AT-004 SS-RC-003",
     "Updates that make Gaussians longer and rounder: the step of the rotation is that of the parent",
     updated(anisotropy_weight=4096, anisotropy_reference=20,
             values={**SMALL, "log_scale": in_turn(NEEDLES, STRETCHED, ONE)})),
    ("steps-before-updates-with-canonical-axes", "SS-AT-004 SS-RC-002", "All weights at once with canonical_axes",
     updated(**CANONICAL, **SEVEN, opacity_weight=[900, 1700, 2400], opacity_reference=12, anisotropy_weight=1300,
             anisotropy_reference=25,
             values={**SMALL, "log_scale": in_turn(SORTED, [[9, 0, 0], [6, 5, 0], [2, 0, 0], [-2, -2, -9]]),
                     "opacity": OPACITIES})),
    ("steps-after-extrapolation", "SS-AT-004 SS-PA-012",
     "Opacities that fade: the step exponents of an update follow from the extrapolated opacity before the residual is added",
     updated(gops=[(1, 0, 5)], opacity_weight=[2048, 3000, 4096], opacity_reference=12, fixed={"extrapolates_opacity": 1},
             values={**SMALL, "log_scale": in_turn(AROUND, ONE), "opacity": in_turn(
                 [[30], [-10], [11]], [[-20], [18], [-6]], [[8], [-9], [5]])})),
]
LAYERS = [
    ("steps-before-updates-in-layers", "SS-AT-004 SS-PA-004",
     "Three spatial layers, each of which refines all values by residuals of -1, 0 and 1 with steps a third as large",
     updated(**CANONICAL, **SEVEN, gops=[(0, 0, 1)], spatial_layer_count=3, layer_sizes=lambda share, s: share,
             opacity_weight=[900, 1700, 2400], opacity_reference=12, anisotropy_weight=1300, anisotropy_reference=25,
             fixed={"attribute_step": lambda w: [(7, 4, 1)[w.s]] * 5},
             values={"log_scale": in_turn([[3, 1, 0], [1, 0, 0], [5, 2, 1], [-1, 1, 1]],
                                          [[0, 0, 0], [1, 0, 0], [1, 0, -1], [0, 0, 0]]),
                     "opacity": in_turn([[1], [-1], [3]], [[-1], [0], [1], [1]]),
                     "rotation": in_turn([[2, 0, -1], [0, 3, 1]], [[1, 0, -1], [0, -1, 1]]),
                     "dc": SMALL["dc"], "sh": SMALL["sh"]})),
]

# ---- invalid ----

ENDS_PARENT, SORTED_PARENT = "survivors-updates-to-ends", "survivors-updates-of-sorted-log-scales"


def outside():
    """Values of the first P frame of ENDS_PARENT, one too far. Gaussians 1 and 2 had the log-scales 20000 and -10000."""
    for k in range(3):
        yield ("log-scale-%d-high" % k, "log-scale %d becomes 32768" % k, entry(k, 12768, 1))
        yield ("log-scale-%d-low" % k, "log-scale %d becomes -32769" % k, entry(k, -22769, 2))
        yield ("residual-%d-high" % k, "v_log_scale[%d] is 32768, and the log-scale becomes 22768" % k, entry(k, 32768, 2))
        yield ("residual-%d-low" % k, "v_log_scale[%d] is -32769, and the log-scale becomes -12769" % k, entry(k, -32769, 1))
    yield "opacity-high", "an opacity becomes 32770", entry(3, 10923, 0)
    yield "opacity-low", "an opacity becomes -32771", entry(3, -10924, 0)


# planes log_scale 1 and 2 of the first P frame, after which the four log-scales are sorted
UNSORTED = [
    ("1-rises", "log-scale 1 of an update becomes one larger than log-scale 0", entry(1, -3, 0)),
    ("2-rises", "log-scale 2 of an update becomes one larger than log-scale 1", entry(2, 0, 1)),
    ("0-falls", "log-scale 0 of an update becomes one smaller than log-scale 1; no residual is above 0", entry(0, -5, 2)),
]


def of_first_p_frame(values, w):
    return w.frame.index_in_gop == 1


def rows():
    makers = {}
    for area, table in (("survivors", VALUES), ("survivors", STEPS), ("spatial", LAYERS)):
        for name, requirements, purpose, make in table:
            makers[area + "-" + name] = make
            yield Vector("valid", area, area + "-" + name, purpose, requirements, lambda make=make: make().stream(), "directed",
                         SEED)
    faults = [(ENDS_PARENT, "OUT_OF_RANGE", "SS-RC-001", *row) for row in outside()]
    faults += [(SORTED_PARENT, "CONSTRAINT", "SS-RC-002", "log-scale-" + name, *row) for name, *row in UNSORTED]
    for parent, code, requirements, name, fault, change in faults:
        yield Vector("invalid", "constraint", "constraint-update-" + name, None, requirements,
                     lambda data, make=makers[parent], code=code, change=change: remade(
                         data, make, (code,), "updates", of_first_p_frame, change),
                     "increments", 0, parent, "in an update, " + fault, code)
