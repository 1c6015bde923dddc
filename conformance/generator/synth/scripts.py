"""Plane models written element by element (5.12), so that each element can be chosen, and made wrong."""

from oracle import models as pm
from oracle.constants import FREQ_SUM
from oracle.conventions import bl
from .encoding import SectionEncoder, token_of


class Script:
    """The elements of one plane model as [name, descriptor, value] and the PlaneModel that they give."""

    def __init__(self, plane, bias=0, direct_log2=2, a=None, b=None):
        """a and b: (source, thresholds) or None."""
        self.plane, self.elements, self.model = plane, [], pm.PlaneModel()
        model = self.model
        model.bias, model.direct_log2 = bias, direct_log2
        self.add("reuse", "u1", 0)
        if plane.alphabet == "signed":
            self.add("bias", "se", bias)
        self.add("direct_log2_minus2", "u3", direct_log2 - 2)
        model.source_a, model.thresholds_a = a or (0, [])
        model.source_b, model.thresholds_b = b or (0, [])
        self.source("a", model.source_a, model.thresholds_a)
        if a:
            self.source("b", model.source_b, model.thresholds_b)
        model.tables, self.numbered = [], []

    def add(self, name, descriptor, value):
        self.elements.append([name, descriptor, value])

    def source(self, letter, source, thresholds):
        self.add("source_" + letter, "u4", source)
        if source:
            self.add("threshold_%s_count_minus1" % letter, "u4", len(thresholds) - 1)
            self.add("threshold_%s_first" % letter, "se", thresholds[0])
            for before, threshold in zip(thresholds, thresholds[1:]):
                self.add("threshold_%s_step_minus1" % letter, "ue", threshold - before - 1)

    # ---- tables ----

    def zero(self):
        self.add("table_kind", "u2", 0)
        self.define(pm.Table({0: FREQ_SUM}))

    def single(self, token):
        self.add("table_kind", "u2", 1)
        self.add("is_reference", "u1", 0)
        self.add("token", self.token_type(), token)
        self.define(pm.Table({token: FREQ_SUM}))

    def index(self, number):
        self.add("table_kind", "u2", 1)
        self.add("is_reference", "u1", 1)
        self.add("table_index", "u6", number)
        self.model.tables.append(self.numbered[number])

    def before(self):
        self.add("table_kind", "u2", 2)
        self.model.tables.append(self.model.tables[-1])

    def explicit(self, frequencies, mode):
        """frequencies: token -> frequency of all tokens but `mode`, whose frequency is what is left."""
        last = max(list(frequencies) + [mode])
        self.add("table_kind", "u2", 3)
        self.add("is_parametric", "u1", 0)
        self.add("last", self.token_type(), last)
        self.add("mode", "u%d" % bl(last), mode)
        length = 0
        for t in range(last + 1):
            if t != mode:
                frequency = frequencies.get(t, 0)
                self.add("length_delta", "se", bl(frequency) - length)
                length = bl(frequency)
                width = min(max(length - 1, 0), 3)
                mantissa = (frequency - (1 << length >> 1)) >> max(length - 4, 0)
                self.add("mantissa", "u%d" % width, mantissa)
                assert frequency == (1 << length >> 1) + (mantissa << max(length - 4, 0))
        self.define(pm.Table({**frequencies, mode: FREQ_SUM - sum(frequencies.values())}))

    def parametric(self, last=None, shape=2, zero_level=0, scale=8, centre=0):
        """`last` is the largest token of the plane unless it is given."""
        last = self.plane.largest_token(self.model.direct_log2) if last is None else last
        signed = self.plane.alphabet == "signed"
        self.add("table_kind", "u2", 3)
        self.add("is_parametric", "u1", 1)
        self.add("last", self.token_type(), last)
        self.add("shape", "u2", shape)
        self.add("zero_level", "u4", zero_level)
        self.add("scale", "u6", scale)
        if signed:
            self.add("centre", "se", centre)
        self.define(pm.parametric_table(signed, self.model.direct_log2, last, shape, zero_level, scale, centre))

    def token_type(self):
        return "u%d" % bl(self.plane.largest_token(self.model.direct_log2))

    def define(self, table):
        self.numbered.append(table)
        self.model.tables.append(table)

    def fit(self, histogram):
        """A table in the shortest form for the tokens that a context has."""
        if not histogram:
            self.before() if self.model.tables else self.zero()
        elif set(histogram) == {0}:
            self.zero()
        elif len(histogram) == 1:
            self.single(*histogram)
        else:
            mode = max(sorted(histogram), key=histogram.get)
            total = sum(histogram.values())
            self.explicit({t: rounded(max(1, 3500 * n // total)) for t, n in histogram.items() if t != mode}, mode)


def rounded(frequency):
    """The largest frequency of an explicit table that is not above the given one."""
    drop = max(bl(frequency) - 4, 0)
    return frequency >> drop << drop


def fitted(**parameters):
    """A plan of a plane: the model with these parameters and tables for the values that the plane has."""
    def plan(coder, plane):
        script = Script(plane, **parameters)
        for histogram in coder.histograms(plane, script.model):
            script.fit(histogram)
        return script
    return plan


def scripted(write, **parameters):
    """A plan of a plane: write(script) adds the tables."""
    def plan(coder, plane):
        script = Script(plane, **parameters)
        coder.histograms(plane, script.model)
        write(script)
        return script
    return plan


REUSE = "reuse"                                     # the plan of a plane whose model is that in force


class ScriptCoder(SectionEncoder):
    """A SectionEncoder with plans: (attribute, index) or attribute -> plan; `change` may alter the elements of a plane."""

    def __init__(self, planes, v, block_size, lanes, in_force, rule, plans, change=None):
        super().__init__(None, planes, v, block_size, lanes, in_force, None, rule)
        self.plans, self.change = plans, change or (lambda plane, elements: elements)

    def plane(self, plane):
        plan = self.plans.get((plane.attribute, plane.index)) or self.plans.get(plane.attribute) or fitted()
        if plan == REUSE:
            self.use(plane, self.in_force[plane.identity()])
            elements = [["reuse", "u1", 1]]
        else:
            elements = plan(self, plane).elements
        for _, descriptor, value in self.change(plane, elements):
            self.model_bits.write(descriptor, value)

    def histograms(self, plane, model):
        """Tokens of each context; the model is in use afterwards."""
        result = [{} for _ in range((len(model.thresholds_a) + 1) * (len(model.thresholds_b) + 1))]
        for block in self.use(plane, model):
            for context, u in block:
                token = token_of(u, model.direct_log2)[0]
                result[context][token] = result[context].get(token, 0) + 1
        return result
