"""Clause 8: blocks (8.4) and contexts (8.5). Models are in models.py."""

from bisect import bisect_right

from .constants import STATE_LOW
from .conventions import BitReader, bl, ceil_div, unzigzag
from .errors import require
from .steps import ATTRIBUTES, LOG_SCALE, OPACITY


class BlockDecoder:
    """decode_block of 8.4 for one block of n entries."""

    def __init__(self, section, planes, models, lanes, n, rule):
        self.planes = planes
        self.models = models
        self.lanes = lanes
        self.n = n
        self.rule = rule                            # the StepRule of an increment
        self.start = section.pos
        self.size = section.end - section.start
        self.e = []                                 # e[p][i], coded values
        self.word_count = section.leb128("6.13")
        self.x = section.values("u32", lanes, "6.13")
        fits = 2 * self.word_count <= section.left()                                  # SS-BL-001
        require(fits, "SHORT_SECTION", "6.13", section.pos)
        self.words = section.values("u16", self.word_count, "6.13")
        self.next_word = 0
        self.raw = BitReader(section.data, section.pos, section.end, "6.13")
        for state in self.x:
            require(state >= STATE_LOW, "ENTROPY_FINAL_STATE", "6.13", self.start)    # SS-BL-002

    def decode(self):
        for plane, model in zip(self.planes, self.models):
            self.decode_plane(plane, model)
        for state in self.x:
            require(state == STATE_LOW, "ENTROPY_FINAL_STATE", "8.4", self.start)     # SS-EC-003
        require(self.next_word == self.word_count, "ENTROPY_FINAL_STATE", "8.4", self.start)  # SS-EC-003
        self.raw.check_end()                                                          # SS-BL-003
        return self.e

    @property
    def strip(self):
        """Entries of a lane"""
        return ceil_div(self.n, self.lanes)

    def order(self):
        """SS-LN-001: (lane, entry) of the symbols of a plane"""
        places = ((lane, lane * self.strip + place) for place in range(self.strip) for lane in range(self.lanes))
        return [(lane, i) for lane, i in places if i < self.n]

    def decode_plane(self, plane, model):
        values = [None] * self.n
        self.e.append(values)
        source_a = self.source(model.source_a, plane)
        source_b = self.source(model.source_b, plane)
        nb = len(model.thresholds_b)
        signed = plane.alphabet == "signed"
        for lane, i in self.order():
            # context(p, i) of 8.5
            ca = bisect_right(model.thresholds_a, source_a(i)) if source_a else 0
            cb = bisect_right(model.thresholds_b, source_b(i)) if source_b else 0
            table = model.tables[ca * (nb + 1) + cb]
            token = self.symbol(lane, table)
            u = self.value(token, model.direct_log2)
            values[i] = unzigzag(u) if signed else u

    def symbol(self, lane, table):
        if len(table.tokens) == 1:                  # SS-EC-004: the state stays as it is
            return table.tokens[0]
        x = self.x[lane]
        slot = x & 4095
        found = bisect_right(table.cum, slot) - 1   # cum[x] <= slot < cum[x] + freq[x]
        x = table.freq[found] * (x >> 12) + slot - table.cum[found]
        if x < STATE_LOW:
            word = self.words[self.next_word] if self.next_word < self.word_count else 0
            x = (x << 16) + word
            self.next_word += 1
        self.x[lane] = x
        return table.tokens[found]

    def value(self, token, k):
        """8.2"""
        direct = 2 ** k
        if token < direct:
            return token
        n = k + (token - direct) // 4
        m = (token - direct) % 4
        return ((4 + m) << (n - 2)) + self.raw.u(n - 2)

    # ---- 8.5 ----

    def v(self, p):
        """The values of a plane with their bias."""
        return [value + self.models[p].bias for value in self.e[p]]

    def cq(self, count):
        """SS-CX-001: the first `count` of cq[0..2], each of all entries"""
        first = self.rule.first()
        rows = [[value * first for value in self.v(1)]]
        factors = [self.rule.factor(LOG_SCALE, [q]) for q in rows[0]]
        for k in range(1, count):
            rows.append([q - value * factor for q, value, factor in zip(rows[-1], self.v(1 + k), factors)])
        return rows

    def co(self):
        """SS-CX-001"""
        return [value * self.rule.factor(OPACITY, q) for value, q in zip(self.v(4), zip(*self.cq(3)))]

    def exponents(self, attribute):
        """Source 11 for the planes of an attribute"""
        opacities = [None] * self.n if attribute == OPACITY else self.co()
        return [self.rule.exponent(attribute, q, o) for q, o in zip(zip(*self.cq(3)), opacities)]

    def source(self, code, plane):
        """The value of a source as a function of i; None for source 0. Sources 1 and 2 stay in the strip (SS-LN-002)."""
        p = plane.number
        own = self.e[p]                             # grows while the plane is decoded
        before = lambda i, count: own[max(i - count, i // self.strip * self.strip):i]

        if code == 0:
            return None
        if code == 1 and plane.alphabet == "position":
            def neighbour_sum_of_position(i):
                lengths = [0, 0] + [bl(delta) for delta in before(i, 2)]
                return 2 * lengths[-1] + lengths[-2]
            return neighbour_sum_of_position
        if code == 1:
            return lambda i: sum(before(i, 4))
        if code == 2:
            return lambda i: sum(map(abs, before(i, 4)))
        if code == 3:
            values = self.e[p - 1]
        elif code == 4:
            group = self.e[p - plane.index:p]
            values = [sum(abs(e[i]) for e in group) for i in range(self.n)]
        elif code == 5:
            values = self.cq(1)[0]
        elif code == 6:
            values = self.cq(2)[1]
        elif code == 7:
            values = [sum(q) for q in zip(*self.cq(3))]
        elif code == 8:
            values = [q[0] - q[2] for q in zip(*self.cq(3))]
        elif code == 9:
            values = self.co()
        elif code == 10:
            lengths = [bl(delta) for delta in self.e[0]] + [0]
            values = [lengths[i] + lengths[i + 1] for i in range(self.n)]
        elif code == 11:
            values = self.exponents(ATTRIBUTES.index(plane.attribute))
        else:
            raise AssertionError("reserved source")
        return values.__getitem__
