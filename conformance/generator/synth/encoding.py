"""Writing of bit sections, units, plane models and blocks: the inverse of clauses 4, 5.12, 8.2 to 8.5."""

import struct

from oracle import constants as c, models as pm
from oracle.constants import FREQ_SUM, MAX_CONTEXTS
from oracle.conventions import bl, crc32
from oracle.parsing import BlockDecoder


class Bits:
    """A bit section of 4.4 that is being written."""

    def __init__(self):
        self.value, self.count = 0, 0

    def u(self, value, n):
        assert 0 <= value < 1 << n
        self.value |= value << self.count
        self.count += n

    def ue(self, value):
        z = (value + 1).bit_length() - 1
        self.u(0, z)
        self.u(1, 1)
        self.u(value + 1 - 2 ** z, z)

    def se(self, value):
        self.ue(2 * value - 1 if value > 0 else -2 * value)

    def bytes(self):
        return self.value.to_bytes((self.count + 7) // 8, "little")

    def write(self, descriptor, value):
        """An element by its descriptor of clause 5: uN, ue or se."""
        if descriptor in ("ue", "se"):
            getattr(self, descriptor)(value)
        else:
            self.u(value, int(descriptor[1:]))


def leb(value):
    out = bytearray()
    while value > 127:
        out.append(value & 127 | 128)
        value >>= 7
    return bytes(out + bytes([value]))


def unit(kind, payload, frame=0, refinement=0, flags=None, spatial=0, temporal=0, reserved=0):
    """unit_header and payload; `critical` is that of the table of 6.3 unless flags are given."""
    flags = int(kind not in (c.UT_INDEX, c.UT_SCENE, c.UT_POINTS)) if flags is None else flags
    head = bytes([kind, flags, spatial, temporal, refinement, reserved])
    tail = struct.pack("<III", frame, len(payload), crc32(payload))
    return head + struct.pack("<H", crc32(head + tail) & 0xFFFF) + tail + payload


def file_header(profile, level, minor=3, major=130):
    head = c.SIGNATURE + bytes([major, minor, profile, level])
    return head + struct.pack("<I", crc32(head))


def zigzag(v):
    return 2 * v if v >= 0 else -2 * v - 1


def token_of(u, k):
    """8.2 backwards: (token, raw bits, their number)"""
    if u < 2 ** k:
        return u, 0, 0
    n = bl(u) - 1
    m = (u >> (n - 2)) - 4
    return 2 ** k + 4 * (n - k) + m, u & (2 ** (n - 2) - 1), n - 2


class SectionEncoder:
    """Chooses random models that can code given values, and codes them in blocks.

    planes: those of 8.1; v: the values of each plane over all entries (deltas and indices as they are);
    in_force: identity -> PlaneModel that may be reused, or None; rule: the StepRule of an increment.
    """

    def __init__(self, rng, planes, v, block_size, lanes, in_force, available, rule=None):
        self.rng, self.planes, self.v, self.lanes = rng, planes, v, lanes
        self.in_force, self.available = in_force or {}, available
        self.count = len(v[0])
        self.starts = range(0, self.count, block_size)
        self.block_size = block_size
        self.models = []
        self.blocks = []                            # a BlockDecoder for each block, used for its contexts
        for start in self.starts:
            block = BlockDecoder.__new__(BlockDecoder)
            block.planes, block.models, block.e = planes, self.models, []
            block.lanes, block.rule = lanes, rule
            block.n = min(block_size, self.count - start)
            self.blocks.append(block)
        self.coded = [[] for _ in self.blocks]      # per block: (plane's model, [(context, u)])
        self.model_bits = Bits()
        self.reused = 0

    def run(self):
        """(bytes of models, [bytes of each block])"""
        for plane in self.planes:
            self.plane(plane)
        return self.model_bits.bytes(), [self.block(k) for k in range(len(self.blocks))]

    def by_identity(self):
        return {plane.identity(): model for plane, model in zip(self.planes, self.models)}

    # ---- models ----

    def plane(self, plane):
        old = self.in_force.get(plane.identity())
        if old is not None and self.rng.random() < 0.8 and self.fits(plane, old):
            self.model_bits.u(1, 1)
            self.reused += 1
            return
        self.model_bits.u(0, 1)
        model = self.parameters(plane)
        contexts = self.use(plane, model)
        histograms = [{} for _ in range((len(model.thresholds_a) + 1) * (len(model.thresholds_b) + 1))]
        for block in contexts:
            for context, u in block:
                token = token_of(u, model.direct_log2)[0]
                histograms[context][token] = histograms[context].get(token, 0) + 1
        self.tables(plane, model, histograms)

    def fits(self, plane, model):
        """Whether a model in force can code the values; if so it is in use afterwards."""
        before = len(self.models)
        contexts = self.use(plane, model)
        for block in contexts:
            for context, u in block:
                token = token_of(u, model.direct_log2)[0]
                if u >= 2 ** {"position": 60, "signed": 17, "index": 16}[plane.alphabet] \
                        or token not in model.tables[context].tokens:
                    del self.models[before:]
                    for coded, part in zip(self.coded, self.blocks):
                        coded.pop()
                        part.e.pop()
                    return False
        return True

    def use(self, plane, model):
        """Appends the model, and for each block the coded values; gives (context, u) of its symbols."""
        self.models.append(model)
        result = []
        values = self.v[plane.number]
        for start, block, coded in zip(self.starts, self.blocks, self.coded):
            e = [x - model.bias for x in values[start:start + block.n]]
            block.e.append(e)
            source_a, source_b = block.source(model.source_a, plane), block.source(model.source_b, plane)
            symbols = []
            for i, value in enumerate(e):
                ca = sum(t <= source_a(i) for t in model.thresholds_a) if source_a else 0
                cb = sum(t <= source_b(i) for t in model.thresholds_b) if source_b else 0
                u = zigzag(value) if plane.alphabet == "signed" else value
                symbols.append((ca * (len(model.thresholds_b) + 1) + cb, u))
            coded.append((model, symbols))
            result.append(symbols)
        return result

    def parameters(self, plane):
        rng, bits, model = self.rng, self.model_bits, pm.PlaneModel()
        model.bias = 0
        if plane.alphabet == "signed":
            some = rng.choice(self.v[plane.number])
            model.bias = max(-32768, min(32767, rng.choice([0, 0, some, some, some + rng.randint(-3, 3)])))
            bits.se(model.bias)
        model.direct_log2 = rng.choice([2, 2, 3, 3, 4, 5, 5 if plane.alphabet == "position" else 7])
        bits.u(model.direct_log2 - 2, 3)
        sources = [s for s in range(1, 12) if self.available(s, plane)]
        model.source_a = rng.choice(sources) if sources and rng.random() < 0.45 else 0
        model.source_b = rng.choice(sources) if model.source_a and rng.random() < 0.4 else 0
        model.thresholds_a, model.thresholds_b = [], []
        bits.u(model.source_a, 4)
        if model.source_a:
            model.thresholds_a = self.thresholds(rng.choice([1, 1, 1, 2, 2, 3, 16]))
            bits.u(model.source_b, 4)
            if model.source_b:
                most = MAX_CONTEXTS // (len(model.thresholds_a) + 1) - 1
                model.thresholds_b = self.thresholds(min(most, rng.choice([1, 1, 2, 3])))
        return model

    def thresholds(self, count):
        self.model_bits.u(count - 1, 4)
        t = [self.rng.choice([0, 1, 2, 5, -3, 20, -40, 300])]
        self.model_bits.se(t[0])
        for _ in range(count - 1):
            step = self.rng.choice([0, 1, 5, 30])
            self.model_bits.ue(step)
            t.append(t[-1] + step + 1)
        return t

    def tables(self, plane, model, histograms):
        rng, bits = self.rng, self.model_bits
        largest = plane.largest_token(model.direct_log2)
        model.tables, numbered = [], []
        wide = rng.random() < 0.35
        for context, histogram in enumerate(histograms):
            need = set(histogram)
            if context > 0 and need <= set(model.tables[-1].tokens) and rng.random() < 0.6:
                bits.u(2, 2)
                model.tables.append(model.tables[-1])
                continue
            fitting = [k for k, table in enumerate(numbered) if k < 64 and need <= set(table.tokens)]
            if fitting and rng.random() < 0.5:
                number = rng.choice(fitting)
                bits.u(1, 2)
                bits.u(1, 1)
                bits.u(number, 6)
                model.tables.append(numbered[number])
                continue
            if not need:
                need = {rng.choice([0, 0, rng.randint(0, largest)])}
            if len(need) == 1 and not wide:
                token = need.pop()
                if token == 0 and rng.random() < 0.8:
                    bits.u(0, 2)
                else:
                    bits.u(1, 2)
                    bits.u(0, 1)
                    bits.u(token, bl(largest))
                table = pm.Table({token: FREQ_SUM})
            else:
                bits.u(3, 2)
                table = self.coded_table(plane, model, histogram or {t: 1 for t in need}, wide)
            numbered.append(table)
            model.tables.append(table)

    def coded_table(self, plane, model, histogram, wide):
        """table_kind 3"""
        rng, bits = self.rng, self.model_bits
        largest, signed = plane.largest_token(model.direct_log2), plane.alphabet == "signed"
        is_parametric = rng.random() < 0.3
        bits.u(int(is_parametric), 1)
        if not is_parametric:
            return self.explicit(histogram, largest, wide)
        last = min(largest, max(histogram) + rng.choice([0, 0, 1, 5, 255]))
        shape, zero_level = rng.randint(0, 3), rng.choice([0, rng.randint(0, 15)])
        scale = rng.choice([rng.randint(0, 16), rng.randint(0, 63)])
        centre = rng.choice([0, rng.randint(-9, 9), rng.randint(-32768, 32767)]) if signed else 0
        for value, width in ((last, bl(largest)), (shape, 2), (zero_level, 4), (scale, 6)):
            bits.u(value, width)
        if signed:
            bits.se(centre)
        return pm.parametric_table(signed, model.direct_log2, last, shape, zero_level, scale, centre)

    def explicit(self, histogram, largest, wide):
        rng, bits = self.rng, self.model_bits
        weight = dict(histogram)
        if wide:
            for t in range(min(largest, max(weight) + rng.choice([4, 12])) + 1):
                weight.setdefault(t, 0)
        while len(weight) < 2 or rng.random() < 0.2:
            weight.setdefault(rng.randint(0, largest), 0)
        last = max(weight)
        mode = max(weight, key=weight.get) if rng.random() < 0.7 else rng.randint(0, last)
        total = sum(weight.values())
        bits.u(last, bl(largest))
        bits.u(mode, bl(last))
        freq, length = {}, 0
        for t in range(last + 1):
            if t == mode:
                continue
            wanted = max(1, weight[t] * 3500 // max(total, 1)) if t in weight else 0
            bits.se(bl(wanted) - length)
            length = bl(wanted)
            freq[t] = 0
            if length:
                mantissa = (wanted - 2 ** (length - 1)) >> max(length - 4, 0)
                bits.u(mantissa, min(length - 1, 3))
                freq[t] = 2 ** (length - 1) + (mantissa << max(length - 4, 0))
        freq[mode] = FREQ_SUM - sum(freq.values())
        return pm.Table(freq)

    # ---- blocks ----

    def block(self, k):
        """8.4 backwards"""
        raw, symbols = Bits(), []
        for model, coded in self.coded[k]:
            for lane, i in self.blocks[k].order():
                context, u = coded[i]
                token, low, count = token_of(u, model.direct_log2)
                raw.u(low, count)
                table = model.tables[context]
                row = table.tokens.index(token)
                symbols.append((lane, table.freq[row], table.cum[row]))
        return rans(symbols, self.lanes) + raw.bytes()


def section(lanes_log2, models, blocks):
    """5.15"""
    return (bytes([lanes_log2]) + leb(len(models)) + models
            + b"".join(leb(len(block)) for block in blocks) + b"".join(blocks))


def rans(symbols, lanes):
    """word_count, states and words for (lane, freq, cum) in the order of decoding."""
    x, words = [65536] * lanes, []
    for lane, freq, cum in reversed(symbols):
        if x[lane] >= freq << 20:
            words.append(x[lane] & 0xFFFF)
            x[lane] >>= 16
        x[lane] = ((x[lane] // freq) << 12) + x[lane] % freq + cum
    words.reverse()
    return leb(len(words)) + struct.pack("<%dI" % lanes, *x) + struct.pack("<%dH" % len(words), *words)
