"""Valid vectors of plane models, tables, contexts and blocks (clauses 5.12 and 8), in profile 0."""

from oracle import models as pm
from ..synth.given import GivenStream
from ..synth.scripts import REUSE, fitted, scripted
from ..vector import Vector
from .stream import one_frame
from .values import attribute

ATTRIBUTES = ("position", "log_scale", "opacity", "rotation", "dc", "sh")
SH = {"sh": {}, "sh_degree": 1}


def everywhere(plan):
    return {name: plan for name in ATTRIBUTES}


def two_sources(first, second, first_thresholds=(0, 3, 9, 30)):
    """A plan with the sources where they are available to the plane, and thresholds that split the values."""
    def plan(coder, plane):
        thresholds = list(first_thresholds) if plane.attribute != "position" else [10, 40, 80]
        a = (first, thresholds) if pm.source_available(first, plane) else None
        b = (second, [1, 5]) if a and second and pm.source_available(second, plane) else None
        return fitted(a=a, b=b, direct_log2=3)(coder, plane)
    return plan


def steps(count, low=-30, by=2):
    return [low + by * k for k in range(count)]


def opacity(write, values, **parameters):
    """70 Gaussians whose opacity plane has a scripted model."""
    values = (list(values) * 70)[:70]
    return one_frame(70, attribute("opacity", values), {"opacity": scripted(write, **parameters)})


def all_kinds(s):
    """Ten contexts of source 1: each kind of table, references to each of them, and what comes after a reference."""
    s.zero()
    s.single(1)
    s.explicit({0: 1024, 2: 512, 3: 7}, 1)
    s.before()
    s.before()
    s.index(2)
    s.before()
    s.index(0)
    s.single(0)
    s.index(2)


def many_tables(s):
    """64 contexts; the last one names the last of 63 tables."""
    for k in range(63):
        s.explicit({t: 16 + (k % 8) * 2 for t in range(1, 40)},
                   0) if k % 9 == 0 else s.explicit({0: 1024, 1: 1024, 2: 512, 3: 512, 4: 480}, 5)
    s.index(62)


def lengths(values):
    """A table of every length 0 to 11 with the given eighths as mantissas."""
    def write(s):
        frequencies = {}
        for t, length in enumerate((1, 2, 3, 4, 5, 0, 6, 7, 8, 9, 10, 11)):
            mantissa = values & ((1 << min(max(length - 1, 0), 3)) - 1)
            frequencies[t] = (1 << length >> 1) + (mantissa << max(length - 4, 0))
        if sum(frequencies.values()) > 4000:
            del frequencies[11]
        s.explicit(frequencies, 12)
    return write


def largest_alone(s):
    s.explicit({0: 2048, 1: 1024}, 251)
    s.single(251)
    s.before()


def distributions(s):
    """Ten contexts of source 1: every shape, natural and given masses of the centre, narrow and wide, off centre."""
    for k in range(10):
        s.parametric((63, 40)[k % 2], shape=k % 4, zero_level=(0, 1, 8, 15)[k // 3], scale=(0, 4, 9, 14, 63)[k % 5],
                     centre=(0, 0, -3, 2, 32767, -32768)[k % 6])


def every_token(shape, zero_level, scale, centre=0):
    """A plan with one parametric table of all tokens of the plane."""
    return scripted(lambda s: s.parametric(shape=shape, zero_level=zero_level, scale=scale, centre=centre),
                    direct_log2=5)


def rare(s):
    """Every token that occurs has frequency 1: each symbol costs twelve bits."""
    s.explicit({t: 1 for t in range(1, 8)}, 0)


def reused(plans_of_units, total=30, percent=(30, 60, 100), seed=1, sh_modes=(1, 1, 1)):
    s = GivenStream(seed, sh_degree=1, percent=list(percent))
    s.gop()
    s.transform()
    s.transform(1, 0, rank=3)
    s.codebook(1, 3, list(range(-30, 30)))
    s.frame(total, sh=0)
    for plans, mode in zip(plans_of_units, sh_modes):
        s.unit(plans=plans, sh_mode=mode, stages=(1,) if mode == 2 else ())
    return s.close()


def wide(plane_tokens=20):
    """Models that can code any usual value, so that later units can reuse them."""
    def plan(coder, plane):
        return scripted(lambda s: s.explicit({t: 64 for t in range(1, plane_tokens + 1)}, 0), direct_log2=3)(coder,
                                                                                                             plane)
    wide_position = scripted(lambda s: s.explicit({t: 16 for t in range(1, 200)}, 0), direct_log2=3)
    return {**everywhere(plan), "log_scale": scripted(lambda s: s.explicit({t: 64 for t in range(1, 30)}, 0),
                                                      direct_log2=3),
            "rotation": scripted(lambda s: s.explicit({t: 64 for t in range(1, 40)}, 0), direct_log2=3),
            "position": wide_position}


def no_words(tamper=None):
    constant = {(name, k): [7] * 9 for name in ATTRIBUTES for k in range(3)}
    return one_frame(9, constant, codes=[0] * 9, lanes_log2=1, tamper=tamper)


REUSED = everywhere(REUSE)

ENTROPY = [
    ("entropy-lanes-%d" % (2 ** k), "SS-EC-003 SS-BL-002",
     "Blocks of %d lanes, the last block with fewer Gaussians than some of them" % 2 ** k,
     lambda k=k: one_frame(70, lanes_log2=k)) for k in range(6)
] + [
    ("entropy-lanes-without-symbols", "SS-EC-003", "Three Gaussians and 32 lanes: 29 states stay at 65536",
     lambda: one_frame(3, lanes_log2=5)),
    ("entropy-no-words", "SS-EC-004 SS-BL-001 SS-BL-003",
     "Every plane is constant: no words, states of 65536, no raw bits",
     lambda: no_words()),
    ("entropy-shortest-block", "SS-BL-001 SS-EC-004", "One Gaussian of constant planes in a block of five bytes",
     lambda: one_frame(1, {(name, k): [0] for name in ATTRIBUTES for k in range(3)}, codes=[0])),
    ("entropy-constant-by-bias", "SS-PM-002 SS-EC-004", "Constant planes of which bias alone has the value",
     lambda: one_frame(9, attribute("opacity", [-300] * 9), {"opacity": fitted(bias=-300)})),
] + [
    ("entropy-source-%d" % k, "SS-EC-005 SS-PM-003",
     "Context source %d in every plane that has it, with another source beside it" % k,
     lambda k=k: one_frame(70, plans=everywhere(two_sources(k, (k + 2) % 11)), **SH)) for k in range(1, 11)
] + [
    ("entropy-same-source-twice", "SS-EC-005", "Both sources of a plane are the same",
     lambda: one_frame(70, plans={"rotation": fitted(a=(8, [5, 20, 40]), b=(8, [10, 30]))})),
    ("entropy-contexts-64", "SS-PM-005 SS-EC-005", "Seven and seven thresholds: 64 contexts",
     lambda: one_frame(200, plans={"opacity": fitted(a=(5, steps(7, 2, 5)), b=(10, steps(7, 10, 6)))})),
    ("entropy-contexts-15-by-3", "SS-PM-005", "15 thresholds of one source and three of the other: 64 contexts",
     lambda: one_frame(200, plans={"opacity": fitted(a=(8, steps(15)), b=(2, [5, 9, 30]))})),
    ("entropy-thresholds-16", "SS-PM-004 SS-PM-005", "Sixteen thresholds of a source in each plane",
     lambda: one_frame(70, plans={name: fitted(a=(1, steps(16))) for name in ATTRIBUTES})),
    ("entropy-thresholds-16-of-b", "SS-PM-005", "One threshold of source_a and sixteen of source_b",
     lambda: one_frame(70, plans={"dc": fitted(a=(9, [0]), b=(2, steps(16, 0, 3)))})),
    ("entropy-threshold-ends", "SS-PM-004", "Thresholds at both ends of what can be written",
     lambda: one_frame(20, plans={"opacity": fitted(a=(5, [-2 ** 31 + 1, 2 ** 31 - 1]),
                                                    b=(6, [2 ** 31 - 2, 2 ** 31 - 1]))})),
    ("entropy-threshold-first-ends", "SS-PM-004", "First thresholds at both ends, and the largest step",
     lambda: one_frame(20, plans={"opacity": fitted(a=(5, [2 ** 31 - 1]), b=(6, [-2 ** 31 + 1, 2 ** 31 - 1])),
                                  "dc": fitted(a=(5, [0]), b=(6, [2 ** 31 - 1]))})),
    ("entropy-single-token-251", "SS-EC-001 SS-PM-006",
     "The largest token of the position alphabet as the only one of a table that is not used, and as mode",
     lambda: one_frame(8, plans={"position": scripted(largest_alone, direct_log2=5, a=(1, [2 ** 20, 2 ** 21]))},
                       codes=[1] * 8)),
    ("entropy-table-kinds", "SS-PM-005 SS-PM-006 SS-PM-009 SS-EC-002 SS-PM-010",
     "Each kind of table, references to tables, and the table before a reference",
     lambda: opacity(all_kinds, [0], a=(1, steps(9, -4, 1)), direct_log2=2)),
    ("entropy-parametric-tables", "SS-EC-002 SS-PM-008",
     "Parametric tables of every shape, around the values and far from them",
     lambda: opacity(distributions, [0, 1, -1, 2, -3, 5, -9, 14], a=(1, steps(9, -4, 1)), direct_log2=2)),
    ("entropy-parametric-token-0", "SS-PM-006 SS-PM-008", "A parametric table of the token 0 alone",
     lambda: opacity(lambda s: s.parametric(0, shape=3, scale=63), [0], direct_log2=2)),
] + [
    ("entropy-parametric-%s" % name, "SS-PM-006 SS-PM-008 SS-EC-001",
     "Parametric tables of all tokens in planes of every alphabet: " + purpose,
     lambda elements=elements: reused([everywhere(every_token(*elements))], percent=[100], sh_modes=[2]))
    for name, purpose, elements in (
        ("lowest", "every element is 0", (0, 0, 0)), ("highest", "the largest values", (3, 15, 63, 32767)),
        ("narrow", "the smallest width, falling fastest", (3, 1, 0, -32768)),
        ("wide", "the largest width, falling slowly", (0, 0, 63, 5)), ("middle", "values in between", (2, 9, 11, -2)))
] + [
    ("entropy-table-indices", "SS-PM-009 SS-EC-002",
     "64 contexts define 63 tables, and the last one names the last table",
     lambda: opacity(many_tables, [0, -1, 1, 2, -2], a=(5, steps(7, 2, 5)), b=(10, steps(7, 10, 6)), direct_log2=4)),
    ("entropy-lengths-low-mantissa", "SS-PM-007 SS-EC-002", "Frequencies of every length 0 to 11 with mantissa 0",
     lambda: opacity(lengths(0), [0, -1, 1, -2, 2, 3, -4, 4, -5], direct_log2=4)),
    ("entropy-lengths-high-mantissa", "SS-PM-007 SS-EC-002", "Frequencies of every length with mantissa 7",
     lambda: opacity(lengths(7), [0, -1, 1, -2, 2, 3, -4, 4, -5], direct_log2=4)),
    ("entropy-length-12", "SS-PM-007 SS-EC-002", "A frequency of 3840, the largest of length 12",
     lambda: opacity(lambda s: s.explicit({0: 3840, 2: 1}, 1), [0] * 9 + [-1, 1])),
    ("entropy-mode-1", "SS-PM-007 SS-EC-002", "The frequency of mode is 1",
     lambda: opacity(lambda s: s.explicit({0: 2048, 1: 1920, 2: 120, 3: 7}, 4), [0, -1, 2], direct_log2=3)),
    ("entropy-mode-4095", "SS-PM-007 SS-EC-002", "The frequency of mode is 4095",
     lambda: opacity(lambda s: s.explicit({1: 1}, 0), [0] * 20 + [-1])),
    ("entropy-mode-is-last", "SS-PM-006", "mode is the last token",
     lambda: opacity(lambda s: s.explicit({0: 100 // 8 * 8, 1: 8}, 2), [0, -1, 1])),
    ("entropy-rare-tokens", "SS-EC-003 SS-EC-004",
     "Every symbol has frequency 1: the states are renormalised at nearly each of them",
     lambda: opacity(rare, [-1, 1, -2, 2, -3], direct_log2=3)),
    ("entropy-signed-ends", "SS-EC-001 SS-PM-002", "Largest tokens of signed planes with bias at both ends",
     lambda: one_frame(4, {**attribute("opacity", [32767, -32768, 0, 32767]),
                           **attribute("log_scale", [-32768, 0, -32768, 0], [0] * 4, [0] * 4)},
                       {"opacity": fitted(bias=-32768), ("log_scale", 0): fitted(bias=32767)})),
] + [
    ("entropy-direct-log2-%d" % k, "SS-EC-001", "direct_log2 %d in every plane, at most 5 for positions" % k,
     lambda k=k: one_frame(20, plans={**everywhere(fitted(direct_log2=k)), "position": fitted(direct_log2=min(k, 5))},
                           **SH)) for k in range(2, 8)
] + [
    ("entropy-largest-tokens-in-tables", "SS-EC-001 SS-PM-006", "Tables up to the largest token of each alphabet",
     lambda: one_frame(8, attribute("opacity", [0, -1] * 4),
                       {"opacity": scripted(lambda s: s.explicit({0: 1024, 167: 1}, 1), direct_log2=7),
                        "position": scripted(lambda s: s.explicit({0: 8, 251: 1}, 1), direct_log2=5)}, codes=[1] * 8)),
    ("entropy-reuse-chain", "SS-PM-001", "The second and third unit reuse all models of the first",
     lambda: reused([wide(), REUSED, REUSED])),
    ("entropy-reuse-in-part", "SS-PM-001", "Some planes reuse a model that was coded again in the unit before",
     lambda: reused([wide(), {**wide(), "opacity": REUSE}, {**REUSED, "dc": fitted()}])),
    ("entropy-reuse-across-empty-unit", "SS-PM-001 SS-IN-001",
     "A unit without Gaussians lies between the models and their reuse",
     lambda: reused([wide(), None, REUSED], total=2, percent=(1, 50, 100))),
    ("entropy-reuse-other-sh-mode", "SS-PM-001",
     "sh_mode changes between the units: planes of other alphabets have no model to reuse",
     lambda: reused([wide(), {**REUSED, "sh": wide()["sh"]}, REUSED], sh_modes=(1, 2, 2))),
    ("entropy-contexts-of-blocks", "SS-EC-005", "Contexts at the start of the second block do not see the first",
     lambda: one_frame(130, plans=everywhere(two_sources(1, 2)))),
]


def rows():
    for name, requirements, purpose, build in ENTROPY:
        yield Vector("valid", "entropy", name, purpose, requirements, build, "given", 1)
