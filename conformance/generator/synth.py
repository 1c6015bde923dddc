#!/usr/bin/env python3
"""Writes random conforming streams that use every tool of version 1.0: synth.py SEED OUT.gss [0 | 1]

The last argument is the profile, 0 if there is none; streams of profile 1 are made in synth_dynamic.py.

The values have no meaning: tokens are drawn from random tables. It serves to reach the paths that
streams of an ordinary encoder leave out (position_shift, rotation thresholds, VQ stages, 16-bit
codebooks, table references, all sources, 32 lanes, several GOPs, private units).
"""

import random
import struct
import sys

import models as pm
from constants import SIGNATURE
from conventions import ByteReader, crc32
from encoding import Bits, leb, rans, unit
from parsing import BlockDecoder
from reconstruction import BlockValues, frame_digest, prefix_count, unit_digests
from semantics import parse_codebook, parse_sequence_parameters, parse_transform


class Synth:
    def __init__(self, seed):
        self.rng = random.Random(seed)
        self.out = bytearray()
        self.units = 0

    def put(self, *args, **kw):
        at = len(self.out)
        self.out += unit(*args, **kw)
        self.units += 1
        if self.rng.random() < 0.1:
            self.out += unit(self.rng.choice([9, 10, 127, 128, 255]), b"private", 77, 200, 0)
            self.units += 1
        return at

    def stream(self):
        rng = self.rng
        head = SIGNATURE + bytes([1, rng.choice([0, 3]), 0, rng.randint(1, 4)])
        self.out += head + struct.pack("<I", crc32(head))
        count = rng.randint(1, 10)
        percent = sorted(rng.sample(range(1, 100), count - 1)) + [100]
        threshold = sorted([rng.choice([0, 0, 5, 40, 100, 255]) for _ in range(3)], reverse=True)
        gop_sizes = [rng.randint(1, 2) for _ in range(rng.randint(1, 2))]
        payload = bytes([rng.randint(0, 3), 1, 1, count] + percent + [0] * (10 - count)
                        + [rng.randint(6, 20), 6, rng.randint(0, 3)] + threshold)
        payload += struct.pack("<III11f", rng.choice([0, sum(gop_sizes)]), 30, 1, 1.5, -0.0, 2.25,
                               0.001, -5.0, 0.01, 0.003, 1.0, 0.1, 0.02, 0.03)
        self.seq = parse_sequence_parameters(ByteReader(payload, 0, len(payload)))
        self.put(1, payload)
        frame, gops = 0, []
        for g, size in enumerate(gop_sizes):
            gops.append((frame, self.put(2, struct.pack("<IIBBBB", g, size, 0, 0, 0, 0), frame)))
            self.definitions(frame)
            for _ in range(size):
                self.frame(frame)
                frame += 1
                if rng.random() < 0.3:
                    self.put(1, payload)
        index = 0
        if rng.random() < 0.7:
            entries = b"".join(struct.pack("<IIQ", f, 0, at) for f, at in gops)
            index = self.put(7, struct.pack("<I", len(gops)) + entries)
        self.out += unit(8, struct.pack("<IIQ", frame, self.units, index))
        return bytes(self.out)

    def definitions(self, frame):
        rng, planes = self.rng, self.seq.sh_planes
        self.dc, self.sh, self.books = {}, {}, {}
        for kind, dimension, target in ((0, 3, self.dc), (1, planes, self.sh)):
            for identifier in rng.sample(range(16), 2 if dimension else 0):
                rank = rng.randint(1, min(dimension, 12))
                payload = bytes([identifier, kind, dimension, rank])
                payload += b"".join(struct.pack("<i", rng.choice([0, 2 ** 30, -2 ** 30,
                                                                  999])) for _ in range(dimension))
                payload += b"".join(struct.pack("<h", rng.randint(-4096, 4096)) for _ in range(rank * dimension))
                self.put(4, payload, frame)
                target[identifier] = parse_transform(ByteReader(payload, 0, len(payload)), planes, {}, {})
        for transform in self.sh.values():
            for _ in range(2):
                identifier = rng.choice([i for i in range(16) if i not in self.books])
                size, entries = rng.randint(1, 2), rng.choice([600, 1000])
                payload = struct.pack("<BBHB", identifier, transform.rank, entries - 1, size)
                payload += bytes(rng.randrange(256) for _ in range(entries * transform.rank * size))
                self.put(5, payload, frame)
                self.books[identifier] = parse_codebook(ByteReader(payload, 0, len(payload)), {})

    def frame(self, number):
        rng, seq = self.rng, self.seq
        total = rng.choice([0, 1, 2, 63, 64, 65, 200, 300])
        dc_id = rng.choice(list(self.dc))
        sh_id = rng.choice(list(self.sh) + [255]) if self.sh else 255
        self.put(3, struct.pack("<BBBBI", 0, dc_id, sh_id, 0, total), number)
        previous, digests = None, []
        for r in range(rng.randint(1, seq.refinement_count)):
            n = prefix_count(seq, total, r) - prefix_count(seq, total, r - 1)
            body = type("Body", (), {})()
            body.position_shift = rng.randint(0, max(0, seq.position_bits - 6))
            body.lanes_log2 = rng.randint(0, 5)
            books = [b for b, v in self.books.items() if sh_id != 255 and v.component_count == self.sh[sh_id].rank]
            body.sh_mode = 0 if sh_id == 255 else rng.randint(0, 2)
            body.vq_stage_count = rng.randint(1, 4) if body.sh_mode == 2 else 0
            body.codebook_ids = [rng.choice(books) for _ in range(body.vq_stage_count)]
            body.codebook_ids += [255] * (4 - body.vq_stage_count)
            models, blocks, planes = b"", [], [[] for _ in range(13 + seq.sh_planes)]
            if n > 0:
                coded = pm.coded_planes(self.dc[dc_id].rank, body.sh_mode,
                                        self.sh[sh_id].rank if sh_id != 255 else 0, body.vq_stage_count)
                bits = Bits()
                used = [self.model(bits, plane, previous) for plane in coded]
                models = bits.bytes()
                previous = {p.identity(): m for p, m in zip(coded, used)}
                for start in range(0, n, 64):
                    e, block = self.block(coded, used, 2 ** body.lanes_log2, min(64, n - start))
                    blocks.append(block)
                    values = BlockValues(e, coded, used, body, seq, self.dc[dc_id],
                                         self.sh.get(sh_id), self.books, 0)
                    for whole, part in zip(planes, values.canonical()):
                        whole.extend(part)
            digests.append(unit_digests(planes))
            payload = struct.pack("<QIBBBB4B", frame_digest(digests), n, body.position_shift, body.lanes_log2,
                                  body.sh_mode, body.vq_stage_count, *body.codebook_ids)
            payload += leb(len(models)) + models + b"".join(leb(len(b)) for b in blocks) + b"".join(blocks)
            self.put(6, payload, number, r)

    def model(self, bits, plane, previous):
        rng = self.rng
        if previous and plane.identity() in previous and rng.random() < 0.4:
            bits.u(1, 1)
            return previous[plane.identity()]
        bits.u(0, 1)
        model = pm.PlaneModel()
        model.bias = 0
        if plane.alphabet == "signed":
            # log_scale differences must not be negative with canonical axes; tokens stay below 300
            model.bias = rng.randint(300, 500) if plane.attribute == "log_scale" else rng.randint(-900, 900)
            bits.se(model.bias)
        model.direct_log2 = rng.randint(2, 5 if plane.alphabet == "position" else 7)
        bits.u(model.direct_log2 - 2, 3)
        sources = [s for s in range(1, 11) if pm.source_available(s, plane)]
        model.source_a = rng.choice([0] + sources)
        model.source_b = rng.choice([0] + sources) if model.source_a else 0
        model.thresholds_a, model.thresholds_b = [], []
        bits.u(model.source_a, 4)
        if model.source_a:
            model.thresholds_a = self.thresholds(bits, rng.randint(1, 16))
            bits.u(model.source_b, 4)
            if model.source_b:
                most = 64 // (len(model.thresholds_a) + 1) - 1
                model.thresholds_b = self.thresholds(bits, rng.randint(1, min(16, most)))
        model.tables, numbered = [], []
        largest = model.direct_log2                                     # keep values below about 300
        largest = 2 ** largest + 4 * max(0, 8 - largest) - 1 if plane.alphabet != "position" else 12
        for context in range((len(model.thresholds_a) + 1) * (len(model.thresholds_b) + 1)):
            kind = rng.choice([0, 1, 1, 2, 3, 3, 3] if context else [0, 1, 3, 3])
            bits.u(kind, 2)
            if kind == 2:
                model.tables.append(model.tables[-1])
                continue
            if kind == 1:
                reference = rng.randint(0, 1) if numbered else 0
                bits.u(reference, 1)
                if reference:
                    place = rng.randrange(len(numbered))
                    bits.u(place, 6)
                    model.tables.append(numbered[place])
                    continue
            token = rng.randint(0, largest)
            if kind == 1:
                bits.u(token, 8)
            table = {0: pm.Table({0: 4096}), 1: pm.Table({token: 4096})}.get(kind) or self.explicit(bits, largest)
            numbered.append(table)
            model.tables.append(table)
        return model

    def thresholds(self, bits, count):
        bits.u(count - 1, 4)
        t = [self.rng.randint(-40, 40)]
        bits.se(t[0])
        for _ in range(count - 1):
            step = self.rng.choice([0, 1, 5, 30])
            bits.ue(step)
            t.append(t[-1] + step + 1)
        return t

    def explicit(self, bits, largest):
        rng = self.rng
        last = rng.randint(1, largest)
        mode = rng.randint(0, last)
        freq, length, left = {}, 0, 4095
        bits.u(last, 8)
        bits.u(mode, 8)
        for t in range(last + 1):
            if t == mode:
                continue
            new = rng.choice([0, 0, 1, 2, 3, 4, 5, 8, 11]) if t != last else rng.randint(1, 4)
            if t == 0 and mode == last:
                new = 3                             # some token beside mode has a frequency
            left_here = left - (15 if t != last else 0)
            while new and 2 ** new > left_here:
                new -= 1
            bits.se(new - length)
            length = new
            freq[t] = 0
            if length:
                mantissa = rng.randrange(2 ** min(length - 1, 3))
                bits.u(mantissa, min(length - 1, 3))
                freq[t] = 2 ** (length - 1) + (mantissa << max(length - 4, 0))
            left -= freq[t]
        freq[mode] = 4096 - sum(freq.values())
        return pm.Table(freq)

    def block(self, planes, models, lanes, n):
        """Draws the tokens, then runs the rANS coder backwards."""
        rng = self.rng
        context = BlockDecoder.__new__(BlockDecoder)
        context.planes, context.models, context.n, context.e = planes, models, n, []
        symbols, raw = [], Bits()
        context.raw = type("Raw", (), {"u": lambda self, b: draw(b)})()

        def draw(b):
            value = rng.randrange(2 ** b)
            raw.u(value, b)
            return value

        def symbol(lane, table):
            place = rng.choices(range(len(table.tokens)), table.freq)[0]
            symbols.append((lane, table.freq[place], table.cum[place]))
            return table.tokens[place]

        context.lanes, context.symbol = lanes, symbol
        for plane, model in zip(planes, models):
            context.decode_plane(plane, model)
        return context.e, rans(symbols, lanes) + raw.bytes()


def main():
    seed, path = int(sys.argv[1]), sys.argv[2]
    if sys.argv[3:] == ["1"]:
        from synth_dynamic import valid_stream
        data = valid_stream(seed)
    else:
        data = Synth(seed).stream()
    with open(path, "wb") as f:
        f.write(data)


if __name__ == "__main__":
    main()
