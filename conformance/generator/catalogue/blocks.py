"""Invalid vectors of plane models and blocks (5.12, 5.13) and of values of new Gaussians.

The parents are streams of one increment; it is written again with one element, block or value changed.
"""

import struct

from oracle.conventions import ByteReader
from ..synth.encoding import leb
from ..synth.given import GivenStream
from ..synth.stream import Made
from ..synth.scripts import REUSE, fitted, scripted
from ..vector import Vector
from .entropy import all_kinds, no_words, steps, two_sources
from .stream import one_frame
from .values import attribute

# ---- parents ----


def sources(tamper=None):
    """Both sources and every kind of table in the opacity plane, explicit tables elsewhere."""
    return one_frame(70, attribute("opacity", [0] * 70), {"opacity": scripted(all_kinds, a=(1, steps(9, -4, 1)), direct_log2=4),
                                                           "rotation": two_sources(8, 9)}, tamper=tamper,
                                                           sequence_flags=1)


def plain(tamper=None):
    return one_frame(66, plans={"position": fitted(direct_log2=4), "opacity": fitted(direct_log2=4)}, tamper=tamper,
                     sequence_flags=1, anisotropy_weight=1000, anisotropy_reference=90, **SH)


def quantised(tamper=None):
    s = GivenStream(sh_degree=1, tamper=tamper)
    s.gop()
    s.transform()
    s.transform(1, 0, rank=2)
    s.codebook(3, 2, list(range(-10, 10)))
    s.frame(9, sh=0)
    s.unit(sh_mode=2, stages=(3, 3))
    return s.close()


def repeated(tamper=None):
    """A second unit that could reuse models."""
    s = GivenStream(percent=[50, 100], tamper=tamper)
    s.gop()
    s.transform()
    s.frame(20)
    values = {("opacity", 0): list(range(10))}
    s.unit(values)
    s.unit(values, {"opacity": REUSE})
    return s.close()


SH = {"sh": {}, "sh_degree": 1}
TOKEN = "u7"                                        # of signed planes with direct_log2 4, whose largest token is 67
PARENTS = {"entropy-parent-of-faults": ("Models with both sources and every kind of table", sources),
           "attribute-parent-of-faults": ("Two blocks of Gaussians with canonical_axes, steps of rotations and sh", plain),
           "codebook-parent-of-faults": ("Two VQ stages", quantised),
           "entropy-reuse-parent-of-faults": ("Two units, of which the second reuses a model", repeated)}
SOURCES, PLAIN, QUANTISED, REPEATED = PARENTS


# ---- changes ----


def of_plane(attribute_name, index, function):
    """A change of the elements of the model of one plane."""
    def change(pair):
        plane, elements = pair
        if (plane.attribute, plane.index) == (attribute_name, index):
            elements = function(elements)
        return plane, elements
    return "plane", change


def model(attribute_name, name, value, nth=0, index=0):
    """Element `name` of the model of a plane, the nth one of it; what follows stays."""
    def change(elements):
        row = [row for row in elements if row[0] == name][nth]
        row[2] = value(row[2]) if callable(value) else value
        return elements
    return of_plane(attribute_name, index, change)


def stop_after(attribute_name, name, value, nth=0):
    """As `model`, with zero bits in the place of what follows in this model."""
    def change(elements):
        at = [i for i, row in enumerate(elements) if row[0] == name][nth]
        elements[at][2] = value
        return elements[:at + 1] + [["zeros", "u32", 0]] * 4
    return of_plane(attribute_name, 0, change)


def source(attribute_name, code, index=0):
    """source_a 0 becomes a source with one threshold, with the tables as they were and one more."""
    def change(elements):
        at = [row[0] for row in elements].index("source_a")
        return elements[:at] + [["source_a", "u4", code], ["threshold_a_count_minus1", "u4", 0], ["threshold_a_first", "se", 0],
                                ["source_b", "u4", 0]] + elements[at + 1:] + [["table_kind", "u2", 2]]
    return of_plane(attribute_name, index, change)


def value(plane, entry, new):
    """One value of a plane by its number; 0 is position."""
    def change(v):
        v[plane] = list(v[plane])
        v[plane][entry] = new
        return v
    return "new", change


def twice(plane, new):
    """Two values of a plane, so that one fault cannot undo the other."""
    return "new", lambda v: value(plane, 1, new)[1](value(plane, 0, new)[1](v))


def steep(v):
    """The last step of a Gaussian whose second log-scale is below -1 is as large as it may be."""
    i = next(i for i, (first, step) in enumerate(zip(v[1], v[2])) if first - step < -1)
    return value(3, i, 32767)[1](v)


def models(function):
    return "coded", lambda coded: (function(coded[0]), coded[1])


def block(function, which=0):
    """A change of the parts of a block: words, states, list of words, raw bytes."""
    def change(coded):
        blocks = list(coded[1])
        blocks[which] = rebuilt(blocks[which], function)
        return coded[0], blocks
    return "coded", change


def rebuilt(data, function, lanes=1):
    reader = ByteReader(data, 0, len(data))
    count = reader.leb128("6.13")
    states, words = reader.values("u32", lanes, "6.13"), reader.values("u16", count, "6.13")
    count, states, words, raw = function(count, states, words, data[reader.pos:])
    return leb(count) + struct.pack("<%dI%dH" % (len(states), len(words)), *states, *words) + raw


def raw_block(function, which=0):
    def change(coded):
        blocks = list(coded[1])
        blocks[which] = function(blocks[which])
        return coded[0], blocks
    return "coded", change


# planes of PLAIN: position, log_scale 1 to 3, opacity 4, rotation 5 to 7, dc 8 to 10, sh 11 on
MODELS = [
    ("models-bias-high", PLAIN, "CONSTRAINT", "SS-PM-002", "bias is 32768", model("opacity", "bias", 32768)),
    ("models-bias-low", PLAIN, "CONSTRAINT", "SS-PM-002", "bias is -32769", model("opacity", "bias", -32769)),
    ("models-direct-log2-8", PLAIN, "CONSTRAINT", "SS-PM-002", "direct_log2_minus2 of a signed plane is 6",
     model("opacity", "direct_log2_minus2", 6)),
    ("models-direct-log2-6-of-position", PLAIN, "CONSTRAINT", "SS-PM-002",
     "direct_log2_minus2 of the position plane is 4", model("position", "direct_log2_minus2", 4)),
    ("models-source-12", PLAIN, "RESERVED", "SS-PM-003", "source_a is 12", source("opacity", 12)),
    ("models-source-15", SOURCES, "RESERVED", "SS-PM-003", "source_b is 15", stop_after("opacity", "source_b", 15)),
    ("models-source-of-position", PLAIN, "CONSTRAINT", "SS-PM-003 SS-EC-005", "the position plane uses source 10",
     source("position", 10)),
    ("models-source-before-its-plane", PLAIN, "CONSTRAINT", "SS-PM-003 SS-EC-005",
     "the opacity plane uses source 9, its own value", source("opacity", 9)),
    ("models-source-of-log-scale-0", PLAIN, "CONSTRAINT", "SS-PM-003 SS-EC-005",
     "the first log_scale plane uses source 5, its own value", source("log_scale", 5)),
    ("models-source-3-of-log-scale-0", PLAIN, "CONSTRAINT", "SS-PM-003 SS-EC-005",
     "the first log_scale plane uses source 3; the plane before is that of positions", source("log_scale", 3)),
    ("models-source-of-index-0", PLAIN, "CONSTRAINT", "SS-PM-003", "a plane of index 0 uses source 4",
     source("rotation", 4)),
    ("models-source-of-index", QUANTISED, "CONSTRAINT", "SS-PM-003", "an index plane uses source 1", source("sh", 1)),
    ("models-source-3-of-index-0", QUANTISED, "CONSTRAINT", "SS-PM-003", "the first index plane uses source 3",
     source("sh", 3)),
    ("models-threshold-above", SOURCES, "CONSTRAINT", "SS-PM-004", "a threshold is above 2^31 - 1",
     model("opacity", "threshold_a_step_minus1", 2 ** 32 - 2, 7)),
    ("models-contexts-65", SOURCES, "CONSTRAINT", "SS-PM-005", "source_a and source_b give more than 64 contexts",
     "contexts"),
    ("models-first-table-before", PLAIN, "CONSTRAINT", "SS-PM-005", "table_kind of context 0 is 2",
     stop_after("opacity", "table_kind", 2)),
    ("models-token-large", SOURCES, "CONSTRAINT", "SS-PM-006 SS-EC-001",
     "token is above the largest token of the plane", model("opacity", "token", 68)),
    ("models-last-large", PLAIN, "CONSTRAINT", "SS-PM-006 SS-EC-001", "last is above the largest token of the plane",
     stop_after("opacity", "last", 68)),
    ("models-parametric-last-large", SOURCES, "CONSTRAINT", "SS-PM-006 SS-EC-001",
     "last of a parametric table is above the largest token of the plane", "parametric-last-68"),
    ("models-mode-above-last", SOURCES, "CONSTRAINT", "SS-PM-006", "mode is above last", "mode-above-last"),
    ("models-centre-above", SOURCES, "CONSTRAINT", "SS-PM-008", "centre is 32768", "centre-above"),
    ("models-centre-below", SOURCES, "CONSTRAINT", "SS-PM-008", "centre is -32769", "centre-below"),
    ("models-length-negative", PLAIN, "CONSTRAINT", "SS-PM-007", "a length is -1",
     stop_after("opacity", "length_delta", -1)),
    ("models-length-13", PLAIN, "CONSTRAINT", "SS-PM-007", "a length is 13", stop_after("opacity", "length_delta", 13)),
    ("models-mode-frequency-0", SOURCES, "CONSTRAINT", "SS-PM-007 SS-EC-002",
     "the other frequencies leave nothing for mode", "mode-0"),
    ("models-mode-frequency-4096", SOURCES, "CONSTRAINT", "SS-PM-007 SS-EC-002", "the other frequencies are 0",
     "mode-4096"),
    ("models-last-without-frequency", SOURCES, "CONSTRAINT", "SS-PM-007", "the frequency of last is 0", "last-0"),
    ("models-table-index-undefined", SOURCES, "CONSTRAINT", "SS-PM-009",
     "table_index names a table that is not defined yet", model("opacity", "table_index", 3)),
    ("models-reuse-in-first-unit", REPEATED, "CONSTRAINT", "SS-PM-001", "reuse is 1 where no unit was before", "reuse"),
    ("models-number-too-long", PLAIN, "NUMBER", "SS-PM-002", "a bias has 32 leading zeros", "zeros"),
    ("models-byte-left", PLAIN, "TRAILING_BYTES", "SS-PM-010", "a byte stands after the last model",
     models(lambda data: data + b"\x00")),
    ("models-byte-missing", PLAIN, "SHORT_SECTION", "SS-PM-010", "the last byte of models is missing",
     models(lambda data: data[:-1])),
    ("models-none", PLAIN, "SHORT_SECTION", "SS-PM-010", "models has no bytes", models(lambda data: b"")),
    ("models-padding", PLAIN, "PADDING", "SS-PM-010", "a padding bit of models is 1",
     models(lambda data: data[:-1] + bytes([data[-1] | 128]))),
]


def special(name):
    """Changes of several elements of one table: one fault that is spread over them."""
    def explicit(rows):
        def change(elements):
            at = [row[0] for row in elements].index("last")
            return elements[:at - 2] + [["table_kind", "u2", 3], ["is_parametric", "u1", 0]] + rows
        return change

    def parametric(last, centre):
        def change(elements):
            at = [row[0] for row in elements].index("last")
            rows = [["table_kind", "u2", 3], ["is_parametric", "u1", 1], ["last", TOKEN, last],
                    ["shape, zero_level, scale", "u12", 0], ["centre", "se", centre]]
            return elements[:at - 2] + rows + [["zeros", "u32", 0]] * 4
        return change

    def contexts(elements):
        at = [row[0] for row in elements].index("source_b")
        thresholds = [["source_b", "u4", 1], ["threshold_b_count_minus1", "u4", 6], ["threshold_b_first", "se", 0]]
        return elements[:at] + thresholds + [["threshold_b_step_minus1", "ue", 0]] * 6 + elements[at + 1:]

    def reuse(elements):
        return [["reuse", "u1", 1]]

    def zeros(elements):
        return elements[:1] + [["zeros", "u32", 0], ["one", "u1", 1]] + elements[2:]

    frequency = lambda delta, mantissa: [["length_delta", "se", delta], ["mantissa", "u3", mantissa]]
    head = lambda last, mode: [["last", TOKEN, last], ["mode", "u%d" % last.bit_length(), mode]]
    return of_plane("opacity", 0, {
        "contexts": contexts, "reuse": reuse, "zeros": zeros,
        "mode-above-last": explicit(head(4, 5)), "parametric-last-68": parametric(68, 0),
        "centre-above": parametric(9, 32768), "centre-below": parametric(9, -32769),
        "mode-0": explicit(head(2, 2) + frequency(12, 0) + frequency(0, 0)),
        "mode-4096": explicit(head(1, 0) + [["length_delta", "se", 0]]),
        "last-0": explicit(head(2, 0) + frequency(11, 0) + [["length_delta", "se", -11]])}[name])


BLOCKS = [
    ("block-state-low", PLAIN, "ENTROPY_FINAL_STATE", "SS-BL-002", "the initial state is 65535",
     block(lambda n, x, w, raw: (n, [65535], w, raw))),
    ("block-state-0", PLAIN, "ENTROPY_FINAL_STATE", "SS-BL-002", "the initial state of the second block is 0",
     block(lambda n, x, w, raw: (n, [0], w, raw), 1)),
    ("block-state-other", "entropy-no-words", "ENTROPY_FINAL_STATE", "SS-EC-003 SS-EC-004",
     "the state of a block of constant planes is 65537 from its start to its end",
     raw_block(lambda data: data[:1] + b"\x01" + data[2:])),
    ("block-word-left", PLAIN, "ENTROPY_FINAL_STATE", "SS-EC-003", "a word stands after those that are taken",
     block(lambda n, x, w, raw: (n + 1, x, w + [0], raw))),
    ("block-word-missing", PLAIN, "ENTROPY_FINAL_STATE", "SS-EC-003", "the last word is missing",
     block(lambda n, x, w, raw: (n - 1, x, w[:-1], raw))),
    ("block-words-beyond", PLAIN, "SHORT_SECTION", "SS-BL-001", "word_count goes beyond the block",
     block(lambda n, x, w, raw: (n + 2 ** 20, x, w, raw))),
    ("block-empty", PLAIN, "SHORT_SECTION", "SS-BL-001", "a block has no bytes", raw_block(lambda data: b"")),
    ("block-states-cut", PLAIN, "SHORT_SECTION", "SS-BL-001", "a block ends in its first state",
     raw_block(lambda data: data[:3])),
    ("block-raw-missing", PLAIN, "SHORT_SECTION", "SS-BL-003", "raw_bits has no bytes",
     block(lambda n, x, w, raw: (n, x, w, b""))),
    ("block-raw-byte-left", PLAIN, "TRAILING_BYTES", "SS-BL-003", "a byte stands after the raw bits",
     block(lambda n, x, w, raw: (n, x, w, raw + b"\x00"))),
    ("block-raw-padding", PLAIN, "PADDING", "SS-BL-003", "a bit after the last raw bit is 1",
     block(lambda n, x, w, raw: (n, x, w, raw[:-1] + bytes([raw[-1] | 128])), 1)),
    ("block-lane-unused", "entropy-lanes-without-symbols", "ENTROPY_FINAL_STATE", "SS-EC-003",
     "the state of a lane without symbols is not 65536", "unused-lane"),
    ("block-word-count-long", PLAIN, "NUMBER", "SS-BL-001", "word_count is not in its shortest form",
     raw_block(lambda data: stretched(data))),
]


def stretched(data):
    end = 0
    while data[end] > 127:
        end += 1
    return data[:end] + bytes([data[end] | 128, 0]) + data[end + 1:]


VALUES = [
    ("position-beyond", PLAIN, "CONSTRAINT", "SS-PO-001",
     "the last code of a block is 2^30, that of a grid of 11 bits", value(0, 63, 2 ** 30)),
    ("position-far-beyond", PLAIN, "CONSTRAINT", "SS-PO-001", "a delta is 2^60 - 1", value(0, 65, 2 ** 60 - 1)),
    ("log-scale-high", PLAIN, "OUT_OF_RANGE", "SS-RC-001", "v_log_scale[0] is 32768", value(1, 3, 32768)),
    ("log-scale-low", PLAIN, "OUT_OF_RANGE", "SS-RC-001", "q[2] is below -32768", ("new", steep)),
    ("log-scale-rises", PLAIN, "CONSTRAINT", "SS-RC-002", "v_log_scale[1] is -1 with canonical_axes", value(2, 0, -1)),
    ("log-scale-2-rises", PLAIN, "CONSTRAINT", "SS-RC-002",
     "v_log_scale[2] is -1 with canonical_axes, in the second block", value(3, 65, -1)),
    ("opacity-high", PLAIN, "OUT_OF_RANGE", "SS-RC-001", "opacity is 32768", value(4, 0, 32768)),
    ("opacity-low", PLAIN, "OUT_OF_RANGE", "SS-RC-001", "opacity is -32769", value(4, 0, -32769)),
    ("opacity-high-twice", PLAIN, "OUT_OF_RANGE", "SS-RC-001", "two opacities are 32768", twice(4, 32768)),
    ("opacity-low-twice", PLAIN, "OUT_OF_RANGE", "SS-RC-001", "two opacities are -32769", twice(4, -32769)),
    ("rotation-value-low", PLAIN, "OUT_OF_RANGE", "SS-RC-003", "v_rotation[0] is -32769", value(5, 0, -32769)),
    ("rotation-multiplied", PLAIN, "OUT_OF_RANGE", "SS-RC-003 SS-AT-004",
     "rotation[1] is beyond 32767 after v_rotation[1] was multiplied by its step", value(6, 0, 30000)),
    ("dc-component-high", PLAIN, "OUT_OF_RANGE", "SS-RC-005", "v_dc[0] is 8192", value(8, 0, 8192)),
    ("dc-component-low", PLAIN, "OUT_OF_RANGE", "SS-RC-005", "v_dc[2] is -8192", value(10, 65, -8192)),
    ("sh-component-high", PLAIN, "OUT_OF_RANGE", "SS-RC-004", "v_sh[8] is 8192", value(19, 0, 8192)),
    ("sh-index-beyond", QUANTISED, "OUT_OF_RANGE", "SS-SH-001", "an index is the number of entries", value(11, 0, 10)),
    ("sh-index-65535", QUANTISED, "OUT_OF_RANGE", "SS-SH-001", "an index is 65535 in a codebook of ten entries",
     value(12, 8, 65535)),
]


def unused_lane(tamper=None):
    return one_frame(3, lanes_log2=5, tamper=tamper)


def last_lane(coded):
    data = coded[1][0]
    at = len(leb(ByteReader(data, 0, len(data)).leb128("6.13"))) + 4 * 31
    return coded[0], [data[:at] + b"\x01\x00\x01\x00" + data[at + 4:]]


def remade(parent, make, change):
    """The parent with its first increment changed."""
    try:
        make(change)
    except Made as made:
        return made.spliced(parent)
    raise ValueError("no increment")


def rows():
    for name, (purpose, make) in PARENTS.items():
        area = name.split("-")[0]
        yield Vector("valid", area, name, purpose + "; the parent of invalid vectors", "SS-EC-003 SS-EC-006", make,
                     "given", 1)
    makers = {name: make for name, (_, make) in PARENTS.items()}
    makers["entropy-lanes-without-symbols"] = unused_lane
    makers["entropy-no-words"] = no_words
    for area, table in (("entropy", MODELS + BLOCKS), ("constraint", VALUES)):
        for name, parent, code, requirements, fault, change in table:
            if change == "unused-lane":
                change = ("coded", last_lane)
            elif isinstance(change, str):
                change = special(change)
            yield Vector("invalid", area, area + "-" + name, None, requirements + " SS-EC-006",
                         lambda data, make=makers[parent], change=change: remade(data, make, change),
                         "blocks", 1, parent, fault, code)
