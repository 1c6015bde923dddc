"""Vectors of steps (6.4, 7.6.6, source 11 of 8.5) and of feature_shift (7.7.4, 7.7.6)."""

from oracle import constants as c
from ..faults import element, invalid, kind
from ..synth.directed import directed
from ..synth.given import GivenStream
from ..vector import Vector, seed_of
from .blocks import PLAIN, plain, remade, source, value
from .entropy import ATTRIBUTES, everywhere, two_sources
from .stream import one_frame
from .values import attribute

INTRA, PARAMETERS = "stream-several-gops", kind(c.UT_SEQUENCE)
IDLE = {"size_weight": [0] * 5, "opacity_weight": [0] * 3, "anisotropy_weight": 0}
REFERENCES = {"size_reference": 30, "opacity_reference": 12, "anisotropy_reference": 25}
# 12 Gaussians: sizes 4 to 60, anisotropies 0 to 34, opacities on both sides of the references
Q0 = [2, 8, 15, 15, 16, 17, 30, 30, 14, 40, 40, 22]
TO_Q1 = [0, 3, 0, 1, 2, 4, 0, 30, 2, 20, 6, 1]
TO_Q2 = [0, 1, 0, 14, 3, 8, 0, 4, 11, 0, 18, 30]
OPACITY = [5, 12, 11, 13, -20, 30, 8, 4, 0, 12, -7, 2]


def signs(count, *values):
    return [values[i % len(values)] for i in range(count)]


def twelve(more=None):
    """Values of 12 Gaussians whose residuals of rotations and colours are small."""
    return {**attribute("log_scale", Q0, TO_Q1, TO_Q2), **attribute("opacity", OPACITY),
            **attribute("rotation", signs(12, 1, -1, 2), signs(12, 0, 3), signs(12, -2, 1, 0, 1)),
            **attribute("dc", signs(12, 1, -1), signs(12, 2, 0, -1), signs(12, 1)),
            **{("sh", k): signs(12, k % 3 - 1, 1, -1) for k in range(9)}, **(more or {})}


def by(steps=(0,) * 5, values=None, **asked):
    return one_frame(12, twelve(values), sh={}, sh_degree=1, attribute_step=steps, **{**REFERENCES, **asked})


def weights(of_size=None, of_opacity=None, anisotropy=0, weight=2048):
    """One weight alone."""
    return {"size_weight": [weight * (k == of_size) for k in range(5)],
            "opacity_weight": [weight * (k == of_opacity) for k in range(3)], "anisotropy_weight": anisotropy}


TOGETHER = {"size_weight": [1000, 1500, 2000, 2500, 3000], "opacity_weight": [900, 1700, 2400], "anisotropy_weight": 1300}
NAMES = ("log-scale", "opacity", "rotation", "dc", "sh")


def every_exponent(first_alone=False):
    """29 Gaussians with the exponents -2 to 26 before they are clamped, of every attribute or of log-scales 1 and 2."""
    exponents = range(-2, 27)
    total = len(exponents)
    if first_alone:                                 # Round(8191 * (100 - 2 * q[0]), 14) is 50 - q[0] there
        v = attribute("log_scale", [50 - k for k in exponents], [1] * total, [0, 1] * 14 + [1])
        return one_frame(total, v, **{**IDLE, "size_weight": [8191, 0, 0, 0, 0], "size_reference": 100})
    half = [50 - k for k in exponents]
    v = {**attribute("log_scale", half, [0] * total, signs(total, 0, 7)), **attribute("opacity", signs(total, 1, -1)),
         **attribute("rotation", signs(total, 1, -1), [0] * total, [1] * total),
         **attribute("dc", [1] * total, signs(total, -1, 0), [0] * total), **{("sh", k): signs(total, 1, -1) for k in range(9)}}
    return one_frame(total, v, sh={}, sh_degree=1, **{**IDLE, "size_weight": [0] + [8191] * 4, "size_reference": 100})


def bases():
    """Each attribute_step 0 to 24 in turn, in units of five Gaussians: five units have all of them."""
    s = GivenStream(sh_degree=1, percent=[20, 40, 60, 80, 100])
    s.gop()
    s.transform()
    s.transform(1, 0)
    s.frame(25, sh=0)
    for k in range(5):
        v = {**attribute("log_scale", [-1, 0, 1, 2, 0], [0, 1, -1, 0, 2], [1, 0, 0, -2, 1]),
             **attribute("opacity", [1, -1, 2, 0, 5]), **attribute("rotation", *[[1, -1, 0, 2, -2]] * 3),
             **attribute("dc", *[[1, -1, 0, 1, 0]] * 3), **{("sh", j): [0, 1, -1, 1, 0] for j in range(9)}}
        s.unit(v, sh_mode=1, attribute_step=[(5 * k + 24 * a) % 25 for a in range(5)])
    return s.close()


def halves():
    """Sums that are halves of 2^14 on both sides of 0, and just beside them."""
    return one_frame(12, twelve(), sh={}, sh_degree=1, attribute_step=[3, 4, 5, 6, 2], size_weight=[4096] * 5,
                     opacity_weight=[2048, 4096, 0], anisotropy_weight=8191, **REFERENCES)


def quantised(steps, rule, indices=None, book=None, tamper=None):
    """Sums of two stages of codebooks, multiplied."""
    s = GivenStream(sh_degree=1, tamper=tamper, **rule)
    s.gop()
    s.transform()
    s.transform(1, 0, rank=2)
    s.codebook(2, 2, book or [0, 0, 9, -7, -30, 41, 100, 3], 2)
    s.frame(12, sh=0)
    values = twelve()
    values = {key: plane for key, plane in values.items() if key[0] != "sh"}
    s.unit({**values, ("sh", 0): indices or [k % 4 for k in range(12)], ("sh", 1): [k // 3 for k in range(12)]}, sh_mode=2,
           stages=(2, 2), attribute_step=steps)
    return s.close()


LARGE_O = [32767, 32766, 32760, 32700, 0, -32768, 32767, 32765, 32767, 32500, 31000, 32767]


def at_ends(size, opacity, anisotropy, q0, to_q1, to_q2, o):
    """References at the ends of their ranges and Gaussians around them, with the largest weights."""
    values = {**attribute("log_scale", q0, to_q1, to_q2), **attribute("opacity", o),
              **attribute("dc", *[signs(12, 1, 0, -1)] * 3)}
    return by(values=values, size_weight=[0, 0, 8191, 8191, 8191], opacity_weight=[8191] * 3, anisotropy_weight=8191,
              size_reference=size, opacity_reference=opacity, anisotropy_reference=anisotropy)


def both(a, b):
    return [a] * 6 + [b] * 6


RULE = {**TOGETHER, **REFERENCES}
# Sizes of at least the reference, since every step below it is half an exponent, and colours of 0 or 1
MOST = {**attribute("log_scale", [30, 28, 16, 15, 17, 20, 25, 40, 12, 15, 15, 13], signs(12, 0, 1), signs(12, 0, 0, 1)),
        **attribute("dc", *[signs(12, 1, 0, -1)] * 3)}
ATTRIBUTE = [
    ("steps-of-every-exponent", "SS-AT-003 SS-AT-004", "Every factor of the table in every attribute, clamped at both ends",
     every_exponent),
    ("steps-of-every-exponent-of-log-scales", "SS-AT-003 SS-AT-004",
     "Every factor of the table in log_scale 1 and 2, whose exponents follow from twice the first log-scale",
     lambda: every_exponent(True)),
    ("steps-of-every-base", "SS-AT-003 SS-AT-004 SS-RC-001",
     "Every attribute_step with weights 0: nothing but the element counts",
     bases),
    ("steps-by-size", "SS-AT-004", "The five weights of the size, all different",
     lambda: by([2, 3, 4, 5, 6], **{**IDLE, "size_weight": TOGETHER["size_weight"]})),
    ("steps-by-opacity", "SS-AT-004", "The three weights of the opacity, all different",
     lambda: by([1, 1, 2, 3, 4], **{**IDLE, "opacity_weight": TOGETHER["opacity_weight"]})),
    ("steps-by-anisotropy", "SS-AT-004 SS-RC-003", "The weight of the anisotropy: below, at and above its reference",
     lambda: by(**weights(anisotropy=5000))),
    ("steps-together", "SS-AT-004 SS-RC-001 SS-RC-003 SS-RC-005", "All weights at once, with a base of each attribute",
     lambda: by([1, 2, 3, 1, 2], **TOGETHER)),
    ("steps-halves", "SS-AT-004", "Sums that are halves of 2^14 and just beside them, of both signs", halves),
    ("steps-of-canonical-axes", "SS-AT-004 SS-RC-002", "All weights at once with canonical_axes",
     lambda: by([1, 2, 3, 1, 2], sequence_flags=1, **TOGETHER)),
    ("steps-of-rising-log-scales", "SS-AT-004",
     "Without canonical_axes: the largest and the smallest log-scale stand anywhere, and size and anisotropy follow them",
     lambda: by([1, 2, 3, 1, 2], attribute("log_scale", [0, 2, 9, 8, 4, 30, 20, 10, 0, 15, 7, 1],
                                           signs(12, -3, -8, 2, 5), signs(12, 4, -2, -6, 1, -9)), **TOGETHER)),
    ("steps-vector-quantised", "SS-AT-004 SS-SH-001 SS-RC-004 SS-RC-005",
     "Sums of codebook entries, multiplied by steps of sizes and opacities",
     lambda: quantised([0, 0, 0, 0, 3], RULE)),
    ("steps-weights-most", "SS-AT-004", "All weights are 8191",
     lambda: by(values=MOST, size_weight=[8191] * 5, opacity_weight=[8191] * 3, anisotropy_weight=8191)),
    ("steps-size-reference-most", "SS-AT-004", "size_reference is 65535: one more than the size of the largest Gaussian",
     lambda: at_ends(65535, 0, 0, both(32767, 32766), signs(12, 0, 0, 1), signs(12, 0, 40), signs(12, 3, -3))),
    ("steps-size-reference-least", "SS-AT-004", "size_reference is -65536, the size of the smallest Gaussian",
     lambda: at_ends(-65536, 0, 0, both(-32768, -32766), [0] * 6 + [0, 1, 2, 0, 1, 2], [0] * 6 + [2, 1, 0, 1, 0, 0],
                     signs(12, 3, -3))),
    ("steps-opacity-reference-most", "SS-AT-004", "opacity_reference is 32767 and opacities are at the ends of their range",
     lambda: at_ends(0, 32767, 0, [0] * 12, [0] * 12, [0] * 12, LARGE_O)),
    ("steps-opacity-reference-least", "SS-AT-004", "opacity_reference is -32768, which no opacity is below",
     lambda: at_ends(30, -32768, 0, Q0, TO_Q1, TO_Q2, [-32768, -32767] + OPACITY[2:])),
    ("steps-anisotropy-reference-most", "SS-AT-004", "anisotropy_reference is 65535, one more than the largest anisotropy",
     lambda: at_ends(0, 0, 65535, [32767] * 12, [32767] * 12, signs(12, 32767, 32766, 32764, 32760), [0] * 12)),
] + [
    ("steps-weight-of-size-for-" + name, "SS-AT-004", "size_weight of %s alone" % name,
     lambda k=k: by([2] * 5, **weights(of_size=k))) for k, name in enumerate(NAMES)
] + [
    ("steps-weight-of-opacity-for-" + name, "SS-AT-004", "opacity_weight of %s alone" % name,
     lambda k=k: by([2] * 5, **weights(of_opacity=k))) for k, name in enumerate(NAMES[2:])
]


# ---- source 11 ----

EXPONENTS = [1, 4, 9, 16]


def context_sources(tamper=None):
    """Source 11 in every plane that has it, beside source 9; values as those of `twelve`, but more of them."""
    return one_frame(72, {key: list(plane) * 6 for key, plane in twelve().items()},
                     everywhere(two_sources(11, 9, EXPONENTS)), sh={}, sh_degree=1, attribute_step=[1, 2, 3, 1, 2], tamper=tamper,
                     **RULE)


def sources_with_steps(first, second):
    return one_frame(72, {key: list(plane) * 6 for key, plane in twelve().items()}, everywhere(two_sources(first, second)),
                     sh={}, sh_degree=1, attribute_step=[2, 3, 1, 2, 3], **RULE)


def quantised_contexts():
    s = GivenStream(sh_degree=1, **RULE)
    s.gop()
    s.transform()
    s.transform(1, 0, rank=2)
    s.codebook(2, 2, [0, 0, 9, -7, -30, 41, 100, 3], 2)
    s.frame(12, sh=0)
    values = {key: plane for key, plane in twelve().items() if key[0] != "sh"}
    s.unit(values, {"sh": two_sources(11, 3, EXPONENTS)}, sh_mode=2, stages=(2, 2), attribute_step=[0, 0, 1, 1, 2])
    return s.close()


ENTROPY = [
    ("entropy-source-11", "SS-CX-001 SS-EC-005 SS-PM-003",
     "The source step_exponent in every plane that has it", context_sources),
    ("entropy-source-11-of-indices", "SS-CX-001 SS-EC-005", "The source step_exponent in planes of the index alphabet",
     quantised_contexts),
] + [
    ("entropy-source-%d-with-steps" % k, "SS-CX-001 SS-EC-005", "Context source %d of values that are multiplied by steps" % k,
     lambda k=k: sources_with_steps(k, 11)) for k in range(5, 10)
]

# ---- profile 1 ----

TIGHT = {"size_weight": [300, 400, 500, 350, 450], "opacity_weight": [250, 300, 350], "anisotropy_weight": 200,
         "size_reference": 60, "opacity_reference": 20, "anisotropy_reference": 30}
BASES = {"attribute_step": [2, 3, 4, 3, 2]}
NEAR = {"percent": [50, 100], "most": 30, "gops": [(1, 0, 2)], "sizes": lambda k, before: [n + 8 for n in before], "sh_degree": 1,
        "predictors": (0, 0, 1), "mean": (5000, 0)}
WIDE = {"log_scale": lambda w, p, factor: [w.rng.randint(-200, 200), *(w.rng.randint(0, 90) for _ in "12")],
        "opacity": lambda w, p, factor: [w.rng.randint(-300, 300) - p // 2],
        "rotation": lambda w, p, factor: [w.rng.randint(-150, 150) - (x >> 7) for x in p],
        "dc": lambda w, p, factor: [w.rng.randint(-300, 300) for _ in range(w.context.dc_transform.rank)]}
OTHER_SIZES = {"log_scale": lambda w, p, factor: [w.rng.choice([-40, 40]) // factor, 0, w.rng.choice([0, 3])]}


def some(**asked):
    return {**TIGHT, "fixed": BASES, "sh_degree": 1, **asked}


DYNAMIC = [
    ("spatial", "steps-in-spatial-layers", "SS-AT-004 SS-PA-004",
     "Three spatial layers whose updates refine the values of the layer below by steps a third as large",
     some(gops=[(0, 0, 1)], spatial_layer_count=3, modes=(0, 0, 1, 1), layer_sizes=lambda share, s: share,
          fixed={"attribute_step": lambda w: [(7, 4, 1)[w.s]] * 5})),
    ("survivors", "steps-of-updates", "SS-AT-004 SS-PA-004 SS-RC-001",
     "Updates that change sizes and opacities by much: steps follow from the values before the update",
     some(gops=[(1, 0, 4)], modes=(0, 0, 1, 0), sizes=lambda k, before: before, removed=lambda n: 0, values=OTHER_SIZES)),
    ("temporal", "steps-in-b-frames", "SS-AT-004 SS-RC-001 SS-RC-003 SS-RC-005", "Steps of new and updated Gaussians in B frames",
     some(gops=[(1, 2, 5)], temporal_layer_count=3, modes=(1, 1, 2, 2))),
    ("entropy", "entropy-source-11-predicted", "SS-CX-001 SS-AT-004",
     "Predicted Gaussians, whose step_exponent follows from values without predictions and is not that of their values",
     some(gops=[(1, 0, 3)], percent=[50, 100], most=60, predictors=(0, 1, 1), sizes=lambda k, before: [n + 9 for n in before])),
    ("attribute", "steps-of-canonical-axes-in-p-frames", "SS-AT-004 SS-RC-002", "Updates and new Gaussians with canonical_axes",
     some(sequence_flags=1, gops=[(1, 0, 3)], modes=(0, 0, 1, 0))),
] + [
    ("prediction", "prediction-feature-shift-%d" % k, "SS-PR-007 SS-ER-001",
     "feature_shift %d in the bilateral predictor, between Gaussians that differ by much" % k,
     dict(NEAR, feature_shift=k, values=WIDE, fixed={
         "predictor_block_log2": 0, "neighbour_count": 6, "bilateral_spatial": 3, "attribute_step": [0] * 5,
         "bilateral_feature": (1, 1, 1, 2, 8, 30, 120, 255)[k]})) for k in range(8)
]

# ---- invalid ----

SEQUENCE = [
    ("stream-feature-shift-8", "feature_shift is 8", element(PARAMETERS, "feature_shift", 8)),
    ("stream-anisotropy-weight-8192", "anisotropy_weight is 8192", element(PARAMETERS, "anisotropy_weight", 8192)),
    ("stream-size-reference-high", "size_reference is 65536", element(PARAMETERS, "size_reference", 65536)),
    ("stream-size-reference-low", "size_reference is -65537", element(PARAMETERS, "size_reference", -65537)),
    ("stream-opacity-reference-high", "opacity_reference is 32768", element(PARAMETERS, "opacity_reference", 32768)),
    ("stream-opacity-reference-low", "opacity_reference is -32769", element(PARAMETERS, "opacity_reference", -32769)),
    ("stream-anisotropy-reference-high", "anisotropy_reference is 65536", element(PARAMETERS, "anisotropy_reference", 65536)),
    ("stream-anisotropy-reference-low", "anisotropy_reference is -1", element(PARAMETERS, "anisotropy_reference", -1)),
] + [
    ("stream-size-weight-%d" % k, "size_weight[%d] is 8192" % k, element(PARAMETERS, "size_weight", 8192, k)) for k in range(5)
] + [
    ("stream-opacity-weight-%d" % k, "opacity_weight[%d] is 65535" % k, element(PARAMETERS, "opacity_weight", 65535, k))
    for k in range(3)
]
# bases of the parent: 6144 of log-scales, opacities, rotations; 192 of colours
STEEP = [24, 24, 24, 14, 14]


def large_steps(tamper=None):
    small = {**attribute("log_scale", signs(12, 0, 1, -1), [0] * 12, signs(12, 0, 1)),
             **attribute("opacity", signs(12, 1, -1, 0)),
             **attribute("rotation", signs(12, 1, -1), [0] * 12, [1] * 12), **attribute("dc", *[signs(12, 1, -1, 0)] * 3),
             **{("sh", k): signs(12, 0, 1) for k in range(9)}}
    return one_frame(12, small, sh={}, sh_degree=1, attribute_step=STEEP, tamper=tamper)


def large_sums(tamper=None):
    """Sums of codebook entries up to 2000, multiplied by 4."""
    return quantised([0, 0, 0, 0, 3], {}, [0] * 12, [0, 0, 1000, -1000, 500, 2, 2000, 7], tamper)


MODELS = [
    ("source-11-of-log-scale", "the last log_scale plane uses source 11, which only opacity and later planes have",
     source("log_scale", 11, 2)),
    ("source-11-of-position", "the position plane uses source 11", source("position", 11)),
]
FAULTY, SUMS = "steps-parent-of-faults", "steps-vector-quantised-parent-of-faults"
# planes: position, log_scale 1 to 3, opacity 4, rotation 5 to 7, dc 8 to 10, sh 11 on
VALUES = [
    ("log-scale-0", FAULTY, "SS-RC-001", "v_log_scale[0] is 6 and its factor 6144", value(1, 3, 6)),
    ("log-scale-1", FAULTY, "SS-RC-001", "v_log_scale[1] is -6 and its factor 6144", value(2, 0, -6)),
    ("log-scale-2", FAULTY, "SS-RC-001", "v_log_scale[2] is 6 and its factor 6144", value(3, 0, 6)),
    ("product-of-log-scale-1", FAULTY, "SS-RC-001",
     "v_log_scale[1] is 6 and its factor 6144, and the log-scales that it gives are within their range", value(2, 4, 6)),
    ("product-of-log-scale-2", FAULTY, "SS-RC-001",
     "v_log_scale[2] is 6 and its factor 6144, and the log-scale that it gives is within its range", value(3, 4, 6)),
    ("opacity", FAULTY, "SS-RC-001", "v_opacity is 6 and its factor 6144", value(4, 0, 6)),
    ("rotation", FAULTY, "SS-RC-003", "v_rotation[2] is -6 and its factor 6144", value(7, 1, -6)),
    ("dc", FAULTY, "SS-RC-005", "v_dc[0] is 43 and its factor 192", value(8, 0, 43)),
    ("sh", FAULTY, "SS-RC-005 SS-RC-004", "v_sh[8] is -43 and its factor 192", value(19, 4, -43)),
    ("sum-of-entries", SUMS, "SS-RC-005 SS-SH-001", "the sum of two codebook entries is 2500 and its factor 4",
     value(11, 9, 2)),
    ("clamped-sum-of-entries", SUMS, "SS-RC-005 SS-SH-001",
     "the sum of two codebook entries is 4000 and its factor 4: the product is not clamped", value(11, 10, 3)),
]
PARENTS = {FAULTY: ("Every attribute with large steps", large_steps),
           SUMS: ("Two stages of codebooks with large entries, multiplied", large_sums)}


def rows():
    for name, requirements, purpose, build in ATTRIBUTE:
        yield Vector("valid", "attribute", "attribute-" + name, purpose, requirements, build, "given", 1)
    for name, requirements, purpose, build in ENTROPY:
        yield Vector("valid", "entropy", name, purpose, requirements, build, "given", 1)
    for area, name, requirements, purpose, asked in DYNAMIC:
        seed = seed_of(name)
        yield Vector("valid", area, name if name.startswith(area) else area + "-" + name, purpose, requirements,
                     lambda seed=seed, asked=asked: directed(seed, **asked), "directed", seed)
    for name, (purpose, make) in PARENTS.items():
        yield Vector("valid", "attribute", "attribute-" + name, purpose + "; the parent of invalid vectors",
                     "SS-AT-003 SS-RC-001 SS-RC-003 SS-RC-005", make, "given", 1)
    yield from invalid("stream", "records",
                       [(name, INTRA, "OUT_OF_RANGE", "SS-ER-001", fault, change) for name, fault, change in SEQUENCE])
    for name, fault, change in MODELS:
        yield Vector("invalid", "entropy", "entropy-models-" + name, None, "SS-PM-003 SS-EC-005 SS-CX-001",
                     lambda data, change=change: remade(data, plain, change), "blocks", 1, PLAIN, fault, "CONSTRAINT")
    for name, parent, requirements, fault, change in VALUES:
        make = PARENTS[parent][1]
        yield Vector("invalid", "constraint", "constraint-steps-" + name, None, requirements + " SS-AT-004",
                     lambda data, make=make, change=change: remade(data, make, change), "blocks", 1, "attribute-" + parent,
                     fault, "OUT_OF_RANGE")
