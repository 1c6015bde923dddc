"""Clause 8: blocks (8.4) and contexts (8.5). Models are in models.py."""

from bisect import bisect_right

from .constants import STATE_LOW
from .conventions import BitReader, bl, unzigzag
from .errors import require


class BlockDecoder:
    """decode_block of 8.4 for one block of n entries."""

    def __init__(self, section, planes, models, lanes, n):
        self.planes = planes
        self.models = models
        self.lanes = lanes
        self.n = n
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

    def decode_plane(self, plane, model):
        values = []
        self.e.append(values)
        source_a = self.source(model.source_a, plane)
        source_b = self.source(model.source_b, plane)
        nb = len(model.thresholds_b)
        signed = plane.alphabet == "signed"
        for i in range(self.n):
            # context(p, i) of 8.5
            ca = bisect_right(model.thresholds_a, source_a(i)) if source_a else 0
            cb = bisect_right(model.thresholds_b, source_b(i)) if source_b else 0
            table = model.tables[ca * (nb + 1) + cb]
            token = self.symbol(i % self.lanes, table)
            u = self.value(token, model.direct_log2)
            values.append(unzigzag(u) if signed else u)

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

    def log_scale_q(self, k):
        """q[k] of 7.4 for every Gaussian of the block, from e and the biases as they are."""
        v = [[value + self.models[1 + j].bias for value in self.e[1 + j]] for j in range(k + 1)]
        q = v[0]
        for j in range(1, k + 1):
            q = [a - b for a, b in zip(q, v[j])]
        return q

    def source(self, code, plane):
        """The value of a source as a function of i; None for source 0. e[p][j] with j < 0 counts as 0."""
        p = plane.number
        own = self.e[p]                             # grows while the plane is decoded

        if code == 0:
            return None
        if code == 1 and plane.alphabet == "position":
            def neighbour_sum_of_position(i):
                return 2 * (bl(own[i - 1]) if i >= 1 else 0) + (bl(own[i - 2]) if i >= 2 else 0)
            return neighbour_sum_of_position
        if code == 1:
            return lambda i: sum(own[max(i - 4, 0):i])
        if code == 2:
            return lambda i: sum(map(abs, own[max(i - 4, 0):i]))
        if code == 3:
            values = self.e[p - 1]
        elif code == 4:
            group = self.e[p - plane.index:p]
            values = [sum(abs(e[i]) for e in group) for i in range(self.n)]
        elif code == 5:
            values = self.log_scale_q(0)
        elif code == 6:
            values = self.log_scale_q(1)
        elif code == 7:
            q = [self.log_scale_q(k) for k in range(3)]
            values = [a + b + c for a, b, c in zip(*q)]
        elif code == 8:
            values = [a - b for a, b in zip(self.log_scale_q(0), self.log_scale_q(2))]
        elif code == 9:
            values = [value + self.models[4].bias for value in self.e[4]]
        elif code == 10:
            lengths = [bl(delta) for delta in self.e[0]] + [0]
            values = [lengths[i] + lengths[i + 1] for i in range(self.n)]
        else:
            raise AssertionError("reserved source")
        return values.__getitem__
