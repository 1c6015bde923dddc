"""Vectors of lanes: the strips of a block, their contexts and the order of raw bits (8.4, 8.5)."""

from oracle.conventions import ByteReader
from ..synth.cells import morton
from ..synth.directed import directed
from ..synth.encoding import leb
from ..synth.given import GivenStream
from ..synth.scripts import fitted
from ..vector import Vector, seed_of
from .blocks import remade
from .entropy import SH, everywhere, two_sources
from .stream import one_frame
from .tools import every, same
from .values import attribute


def apart(count, *values):
    return [values[k % len(values)] + k // len(values) for k in range(count)]


def rising(total):
    """Values that differ from entry to entry, so that another order of the entries gives others."""
    return {**attribute("log_scale", apart(total, 0, 9, 3, 30, -4), apart(total, 0, 5, 1), apart(total, 2, 0, 7, 1)),
            **attribute("opacity", apart(total, -9, 0, 12, 3)),
            **attribute("rotation", *(apart(total, 50, -80, k) for k in range(3))),
            **attribute("dc", *(apart(total, -3, k, 4) for k in range(3)))}


def strips(total, lanes_log2, first=1, second=2, **asked):
    """A block whose planes have contexts of the entries before, in strips."""
    return one_frame(total, rising(total), everywhere(two_sources(first, second)), lanes_log2=lanes_log2, **asked)


def raw_bits(total, lanes_log2):
    """Every value costs raw bits, so that their order is that of the symbols."""
    v = {**attribute("log_scale", apart(total, 300, -2000, 900), apart(total, 40, 700), apart(total, 90, 5)),
         **attribute("opacity", apart(total, -3000, 170, 9000)),
         **attribute("rotation", *(apart(total, 500, -800, 90 * k) for k in range(3))),
         **attribute("dc", *(apart(total, -300, 50 * k, 400) for k in range(3)))}
    return one_frame(total, v, everywhere(fitted(direct_log2=2)), lanes_log2=lanes_log2, position_bits=20)


def jumps(total, lanes_log2):
    """Positions far apart at the ends of strips: source 10 looks into the next strip, source 1 does not look back."""
    codes, code = [], 0
    for k in range(total):
        code += (1 << 3 * (k % 9)) + k % 2
        codes.append(code)
    return one_frame(total, rising(total), everywhere(two_sources(10, 1)), lanes_log2=lanes_log2, codes=codes)


def last_positions():
    """Two blocks, so that the strips of the second are shorter; codes start again in each block and not in each strip."""
    s = GivenStream()
    s.gop()
    s.transform()
    s.frame(75)
    s.unit(rising(75), everywhere(two_sources(2, 1)), codes=sorted(morton([k, 75 - k, k % 9], 10) for k in range(75)),
           lanes_log2=3)
    return s.close()


ENTROPY = [
    ("entropy-strips-of-%d-in-%d-lanes" % (total, 2 ** k), "SS-LN-001 SS-LN-002 SS-EC-003",
     "%d Gaussians in %d lanes, with contexts of the entries before" % (total, 2 ** k), lambda total=total, k=k: strips(total, k))
    for total, k in ((2, 1), (5, 1), (10, 2), (5, 2), (9, 3), (17, 3), (16, 4), (33, 4), (40, 5), (64, 5), (33, 5))
] + [
    ("entropy-one-entry-in-%d-lanes" % 2 ** k, "SS-LN-001 SS-EC-003",
     "One Gaussian in %d lanes: all states but the first stay at 65536" % 2 ** k, lambda k=k: strips(1, k)) for k in range(6)
] + [
    ("entropy-strips-magnitudes-in-%d-lanes" % 2 ** k, "SS-LN-002 SS-EC-005",
     "Source neighbour_magnitude before source neighbour_sum in strips of %d lanes" % 2 ** k,
     lambda k=k: strips(30, k, 2, 1)) for k in (1, 3)
] + [
    ("entropy-strips-of-%d-positions" % 2 ** k, "SS-LN-002 SS-EC-005",
     "Source position_spacing, which looks into the next of %d strips, and neighbour_sum, which stays in its own" % 2 ** k,
     lambda k=k: jumps(29, k)) for k in (1, 2, 4)
] + [
    ("entropy-raw-bits-of-%d-lanes" % 2 ** k, "SS-LN-001 SS-EC-004",
     "Raw bits of every symbol of 13 Gaussians in %d lanes" % 2 ** k, lambda k=k: raw_bits(13, k)) for k in (1, 2, 5)
] + [
    ("entropy-strips-of-two-blocks", "SS-LN-001 SS-LN-002 SS-PO-002",
     "Strips of eight entries in the first block and two in the second",
     last_positions),
    ("entropy-strips-of-sh", "SS-LN-001 SS-LN-002", "Sixteen lanes with the sources previous_plane and group_magnitude",
     lambda: one_frame(41, plans=everywhere(two_sources(3, 4)), lanes_log2=4, **SH)),
]
SECTIONS = [
    ("entropy-sections-of-%d-lanes-with-moves" % 2 ** k, "SS-LN-001 SS-LN-002 SS-IN-011",
     "All sections of increments and of cells with %d lanes" % 2 ** k,
     dict(lanes=k, most=26, gops=[(1, 0, 3)], sizes=same, modes=(1, 2, 1, 1), cells=every(([24, -16, 8], [9, 0, 0], 0)),
          cell_log2=7,
          fixed={"move_block_log2": 0})) for k in (1, 2, 5)
]


# ---- invalid ----


def exchanged(first, second):
    """Two lanes of the first block have each other's states."""
    def change(coded):
        data = coded[1][0]
        reader = ByteReader(data, 0, len(data))
        head = len(leb(reader.leb128("6.13")))
        states = [data[head + 4 * k:head + 4 * k + 4] for k in range(4)]
        states[first], states[second] = states[second], states[first]
        return coded[0], [data[:head] + b"".join(states) + data[head + 16:]] + coded[1][1:]
    return "coded", change


PARENT = "entropy-strips-of-10-in-4-lanes"


def parent(tamper):
    return strips(10, 2, tamper=tamper)


def rows():
    for name, requirements, purpose, build in ENTROPY:
        yield Vector("valid", "entropy", name, purpose, requirements, build, "given", 1)
    for name, requirements, purpose, asked in SECTIONS:
        seed = seed_of(name)
        yield Vector("valid", "entropy", name, purpose, requirements,
                     lambda seed=seed, asked=asked: directed(seed, **asked), "directed", seed)
    yield Vector("invalid", "entropy", "entropy-lanes-exchanged", None, "SS-LN-001 SS-EC-003 SS-BL-002",
                 lambda data: remade(data, parent, exchanged(0, 3)), "blocks", 1, PARENT,
                 "the states of the first and of the last lane are exchanged", None,
                 ("ENTROPY_FINAL_STATE", "SHORT_SECTION", "TRAILING_BYTES", "PADDING"))
