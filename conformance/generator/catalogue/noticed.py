"""Vectors that notice what no other one does: a check after which nothing else is wrong with the unit."""

from ..faults import changed, invalid
from ..synth.directed import DirectedSynth
from ..synth.elements import INCREMENT, Elements
from ..synth.scripts import fitted, scripted
from ..vector import Vector, seed_of
from .blocks import model, remade as remade_first, value
from .entropy import steps
from .increments import always, entry, remade
from .order import increment
from .stream import one_frame
from .tools import ALL_TOOLS, CELLS
from .values import attribute

# ---- plane models that can be read to their end, and blocks that fit them ----

TABLES, COUNT = "entropy-table-kinds", 70
AS_WRITTEN = ("payload", lambda data: data)


def opacities(values, plan):
    """A maker of the stream TABLES with other opacities and another model of them; it takes a tamper."""
    planes = attribute("opacity", (list(values) * COUNT)[:COUNT])
    return lambda tamper: one_frame(COUNT, planes, {"opacity": plan}, tamper=tamper)


def table(frequencies, mode):
    return scripted(lambda s: s.explicit(frequencies, mode))


def far_log_scales(planes):
    """The second log-scale of the first Gaussian is -60000, of which 16 bits would make -32768; its values are in their range."""
    return value(2, 0, 30000)[1](value(1, 0, -30000)[1](planes))


MODELS = [
    ("entropy-models-65-contexts", "CONSTRAINT", "SS-PM-005",
     "two sources give 65 contexts, with a table for each",
     opacities([0], fitted(a=(5, steps(12)), b=(10, steps(4, 10, 6)))), AS_WRITTEN),
    ("entropy-models-mode-just-above-last", "CONSTRAINT", "SS-PM-006",
     "mode is one above last, and the lengths of all other tokens follow",
     opacities([0, -1, 1, -2, 2, -3], table({0: 1024, 1: 512, 2: 512, 3: 512, 4: 512}, 5)), model("opacity", "last", 4)),
    ("entropy-models-mode-without-frequency", "CONSTRAINT", "SS-PM-007 SS-EC-002",
     "the other frequencies leave nothing for mode, which is not the last token",
     opacities([0, 1], table({0: 2048, 2: 2048}, 1)), AS_WRITTEN),
    ("entropy-models-mode-alone", "CONSTRAINT", "SS-PM-007 SS-EC-002",
     "an explicit table has the frequency 4096 for mode, which is the last token, and 0 for the other one",
     opacities([-1], table({0: 0}, 1)), AS_WRITTEN),
    ("entropy-models-last-never-used", "CONSTRAINT", "SS-PM-007",
     "the frequency of the last token is 0, and those of the others are right",
     opacities([0, -1], table({1: 1024, 2: 0}, 0)), AS_WRITTEN),
    ("entropy-contexts-of-wrong-values", "OUT_OF_RANGE", "SS-EC-006 SS-EC-005 SS-RC-001",
     "a log-scale is -60000, and the contexts of opacities depend on whether it is below -50000",
     opacities([0, -1, 1, -2, 2], fitted(a=(6, [-50000]))), ("new", far_log_scales)),
]


# ---- increments and frame_headers written again ----

SPATIAL, FAR = "spatial-layers-3", "cells-translation-ends"


def removal_alone(u):
    """The elements of an increment that removes one of its parents, without sections."""
    elements = u.elements()
    other = Elements(INCREMENT, refinement_digest=elements.refinement_digest, parent_count=elements.parent_count,
                     remove_count=1)
    other.increment_flags = other.needed()
    return other.bytes()


def of_new(in_force, w):
    """The models of section new as those of another section, which has none."""
    return w.frame.models_in_force(w.s, w.r).get("new")


def far(tamper=None):
    asked = next(row[3] for row in CELLS if row[0] == FAR)
    return DirectedSynth(seed_of(FAR), tamper, **asked)


ROWS = [
    ("constraint", "constraint-increment-remove-alone-in-i-frame", SPATIAL, "MISMATCH", "SS-IN-007",
     "an increment of an I frame has remove_count 1 and ends there", changed(increment(0, 1, 1), payload=removal_alone)),
]
AGAIN = [
    ("entropy", "entropy-increment-reuse-of-other-section", ALL_TOOLS[0], "CONSTRAINT", "SS-SE-001 SS-PM-001",
     "section updates reuses models where only section new has some in force",
     "in_force", lambda in_force, w: w.section_name == "updates" and not in_force and of_new(in_force, w), of_new),
    ("prediction", "prediction-frame-cell-translation", (FAR, far), "OUT_OF_RANGE", "SS-MO-002",
     "a component of the translation of a cell is 2^20 + 1",
     "cells", always, entry(2, lambda x: x + 1, -1)),
]


def rows():
    for name, code, requirements, fault, make, change in MODELS:
        yield Vector("invalid", "entropy", name, None, requirements,
                     lambda data, make=make, change=change: remade_first(data, make, change), "noticed", 1, TABLES, fault, code)
    yield from (row for area, *one in ROWS for row in invalid(area, "noticed", [one]))
    for area, name, (parent, make, *_), code, requirements, fault, *change in AGAIN:
        yield Vector("invalid", area, name, None, requirements,
                     lambda data, make=make, code=code, change=change: remade(data, make, (code,), *change), "noticed", 0,
                     parent, fault, code)
