"""Random conforming streams of profile 1 (A.1); synth.py writes them to files.

Each unit is fed to a decoder of its own as it is written: it holds the state that the next unit depends on.
"""

import random
import struct

import constants as c
import points
from decoding import Decoder
from encoding import file_header, unit
from errors import StreamError
from reconstruction import prefix_count
from synth_increment import IncrementWriter


class DynamicSynth:
    """stream() gives the bytes. tamper(stage, value, writer) may change what increments hold (synth_faults.py)."""

    writer_class = IncrementWriter

    def __init__(self, seed, tamper=None, most=None, deep=False):
        """most: Gaussians of a frame, about; deep: one GOP of temporal_depth 2 or 3 in a small sequence."""
        self.rng = random.Random(seed)
        self.tamper = tamper
        self.deep = deep
        self.most = most or self.rng.choice([6, 20, 20, 40, 90, 150])
        self.out = bytearray()
        self.live = Decoder(self.out)
        self.writers = []                           # (offset of the unit, IncrementWriter)

    def put(self, kind, payload, **header):
        """Writes a unit and lets the decoder read it."""
        at = len(self.out)
        self.out += unit(kind, payload, **header)
        self.live.unit(at)
        assert self.tamper or not self.live.errors, self.live.errors[0]
        return at

    def header(self):
        return file_header(c.PROFILE_DYNAMIC, self.rng.randint(1, 4), self.rng.choice([0, 0, 2]))

    def disturb(self):
        """Units that may stand anywhere: private ones, unknown ones, copies of sequence_parameters."""
        rng = self.rng
        if rng.random() < 0.06:
            self.put(rng.choice([13, 12, 127, 128, 255]), b"private"[:rng.randint(0, 7)], frame=77, flags=0,
                     spatial=rng.choice([0, 3, 9]), temporal=rng.choice([0, 1, 200]),
                     refinement=rng.choice([0, 9, 200]))
        if rng.random() < 0.04 and self.live.sequence is not None:
            self.put(c.UT_SEQUENCE, self.parameters)

    def stream(self):
        rng = self.rng
        self.out += self.header()
        self.live.start()
        self.plan_gops()
        self.disturb()
        self.put(c.UT_SEQUENCE, self.sequence())
        self.seq = self.live.sequence
        first = 0
        for index, (structure, depth, count) in enumerate(self.gops):
            self.disturb()
            self.put(c.UT_GOP, struct.pack("<IIBBH", index, count, structure, depth, 0), frame=first)
            self.first = first
            self.definitions()
            for number in self.present(structure, depth, count):
                self.disturb()
                self.frame(first + number)
            first += count
        self.disturb()
        if self.wants("listed", 0.85):
            self.points()
        self.disturb()
        index_offset = 0
        if self.wants("indexed", 0.7):
            entries = b"".join(struct.pack("<IIQ", frame, 0, at) for frame, at in self.live.gops)
            index_offset = self.put(c.UT_INDEX, struct.pack("<I", len(self.live.gops)) + entries)
        self.disturb()
        self.put(c.UT_END, struct.pack("<IIQ", self.live.frame_count, self.live.unit_count, index_offset))
        return bytes(self.out)

    def wants(self, what, probability):
        """Whether an optional unit is written."""
        return self.rng.random() < probability

    # ---- 6.4, 6.5 ----

    def plan_gops(self):
        rng = self.rng
        self.temporal_layers = rng.choice([1, 1, 2, 3, 4])
        self.gops = []
        if self.deep:
            self.temporal_layers = 4
            self.gops = [(1, rng.choice([2, 3, 3]), rng.randint(9, 14))]
            return
        for _ in range(rng.choice([1, 1, 2, 2, 3])):
            if rng.random() < 0.25:
                self.gops.append((0, 0, rng.randint(1, 2)))
            else:
                depth = rng.randint(0, min(3, self.temporal_layers - 1))
                self.gops.append((1, depth, rng.choice([1, 2, 3, 2 ** depth + 1, 2 ** depth + 2, 9 if depth else 4])))

    def sequence(self):
        rng = self.rng
        count = rng.choice([1, 2, 2, 3, 3, 4, 5]) if rng.random() < 0.95 else 10
        spatial, sh_degree = rng.choice([1, 1, 2, 2, 3, 4]), rng.choice([0, 0, 1, 1, 1, 2, 3])
        if self.deep:
            count, spatial, sh_degree = rng.randint(2, 4), rng.choice([1, 1, 2]), rng.choice([0, 0, 1])
        percent = sorted(rng.sample(range(1, 100), count - 1)) + [100]
        threshold = sorted([rng.choice([0, 0, 2, 5, 40, 100, 255]) for _ in range(3)], reverse=True)
        total = sum(gop[2] for gop in self.gops)
        payload = bytes([sh_degree, spatial, self.temporal_layers, count]
                        + percent + [0] * (10 - count)
                        + [rng.choice([1, 3, 6, 10, 12, 14, 16, 20]), rng.choice([6, 6, 6, 7, 16]), rng.randint(0, 3)]
                        + threshold)
        self.parameters = payload + struct.pack(
            "<III11f", rng.choice([0, total]), rng.choice([1, 30, 90000]), rng.choice([0, 1, 3003]), 1.5, -0.0, 2.25,
            0.001, -5.0, 0.01, rng.choice([1.0, 0.02, 0.003, 0.0005, 0.0001, 1e-6, 0.7]), 1.0, 0.1, 0.02, 0.03)
        return self.parameters

    def present(self, structure, depth, count):
        """Places of the frames that are there: a frame that is absent takes those that refer to it along."""
        there = []
        for k in range(count):
            place = self.live.gop.order(self.first + k)[2]
            if k == 0 or structure == 0:
                there.append(k)
            elif place in there and self.rng.random() < (0.97 if k % 2 ** depth == 0 else 0.8):
                there.append(k)
        return there

    # ---- 6.7, 6.8 ----

    def definitions(self):
        rng, planes = self.rng, self.seq.sh_planes
        self.sh_ranks = {}
        for kind, dimension in ((0, 3), (1, planes)):
            for identifier in rng.sample(range(16), self.transform_count(kind, dimension)):
                rank = self.rank(kind, dimension)
                payload = bytes([identifier, kind, dimension, rank])
                payload += b"".join(struct.pack("<i", self.mean(kind)) for _ in range(dimension))
                payload += b"".join(struct.pack("<h", rng.choice([4096, -4096, 0, rng.randint(-4096, 4096)]))
                                    for _ in range(rank * dimension))
                self.put(c.UT_TRANSFORM, payload, frame=self.first)
                if kind == 1:
                    self.sh_ranks[identifier] = rank
        for rank in self.sh_ranks.values():
            for _ in range(rng.randint(0, 2)):
                self.codebook(rng.randrange(16), rank)

    def transform_count(self, kind, dimension):
        return self.rng.randint(1, 2) if dimension else 0

    def mean(self, kind):
        return self.rng.choice(([0, 5000, -777, 2 ** 30], [0, 5000, -777, 2 ** 29])[kind])

    def rank(self, kind, dimension):
        return self.rng.randint(1, min(dimension, 3 if kind == 0 else 5))

    def codebook(self, identifier, rank):
        """Defines a codebook, or defines it again."""
        rng = self.rng
        old = self.live.codebook.get(identifier)
        layer = old.temporal_layer if old else rng.randrange(self.seq.temporal_layer_count)
        if rng.random() < 0.6:
            layer = old.temporal_layer if old else 0
        size, entries = rng.choice([(1, 5), (1, 17), (2, 3), (2, 40)])
        reach = {1: 60, 2: rng.choice([100, 32767])}[size]
        values = [rng.randint(-reach, reach) for _ in range(entries * rank)]
        payload = struct.pack("<BBHB", identifier, rank, entries - 1, size)
        payload += struct.pack("<%d%s" % (len(values), "b" if size == 1 else "h"), *values)
        self.put(c.UT_CODEBOOK, payload, frame=self.first, temporal=layer)
        book = self.live.codebook.get(identifier)
        if book is not None:
            book.largest = max(map(abs, values))

    # ---- frames ----

    def frame(self, number):
        rng, seq, live = self.rng, self.seq, self.live
        self.number = number
        if self.sh_ranks and rng.random() < 0.3 and number > self.first:
            identifier = rng.choice(list(live.codebook) + [rng.randrange(16)])
            self.codebook(identifier, rng.choice(list(self.sh_ranks.values())))
        frame_type, layer, place = live.gop.order(number)
        reference = live.gop.frames.get(place)
        intra = frame_type == c.TYPE_I
        if intra:
            total, sizes = self.frame_total(number), None
        else:
            sizes = self.plan_sizes(reference)
            total = sum(sizes)
        dc_id = rng.choice(list(live.dc_transform))
        sh_id = rng.choice(list(live.sh_transform) * 3 + [255])
        layers = {"temporal": layer, "spatial": 0 if intra else seq.top}
        self.put(c.UT_FRAME, struct.pack("<BBBBI", frame_type, dc_id, sh_id, 0, total), frame=number, **layers)
        if intra:
            self.intra_units(number, total)
        else:
            self.predicted_units(number, sizes, layers)

    def frame_total(self, number):
        """Gaussians of an I frame."""
        rng, most = self.rng, self.most
        total = rng.choice([0, 1, most] if not self.live.gop.predicted else [1] + [most] * 4)
        return rng.choice([total, most // 2, most, most, most + rng.randint(0, 70)])

    def plan_sizes(self, reference):
        """Sizes of the homes of a P or B frame."""
        sizes = []
        for h in range(self.seq.refinement_count):
            before = 0
            if reference is not None and h < reference.level():
                before = len(reference.homes[(self.seq.top, h)])
            sizes.append(self.rng.choice([before, before, max(0, before + self.rng.randint(-4, 5)),
                                          self.rng.choice([0, before + self.most // 2])]))
        return sizes

    def increment(self, number, s, r, size, layers):
        writer = self.writer_class(self.rng, self.live.frame, self.live.context(), s, r, size, self.tamper)
        payload = writer.payload()
        self.writers.append((len(self.out), writer))
        self.put(c.UT_INCREMENT, payload, frame=number, refinement=r, temporal=layers["temporal"], spatial=s)
        self.disturb()

    def intra_units(self, number, total):
        """SS-BS-012: all units where other frames can refer to the frame, else b(s) that fall."""
        rng, seq = self.rng, self.seq
        last = [seq.refinement_count - 1] * seq.spatial_layer_count
        if not self.live.gop.predicted and rng.random() < 0.7:
            last = sorted((rng.randrange(seq.refinement_count) for _ in last), reverse=True)
            last = last[:rng.randint(1, len(last))]
        sizes = {}
        for s, b in enumerate(last):
            for r in range(b + 1):
                share = prefix_count(seq, total, r) - prefix_count(seq, total, r - 1)
                before = sizes.get((s - 1, r), 0)
                sizes[(s, r)] = share if s == seq.top else rng.choice([before, share, rng.randint(before, share)])
                if self.live.frame.dropping:
                    self.garbage(number, s, r, 0)
                else:
                    self.increment(number, s, r, sizes[(s, r)], {"temporal": 0})

    def predicted_units(self, number, sizes, layers):
        rng, seq, frame = self.rng, self.seq, self.live.frame
        units = seq.refinement_count if rng.random() < 0.7 else rng.randint(1, seq.refinement_count)
        level = frame.reference_level()
        for r in range(units):
            if r < level and not frame.dropping:
                self.increment(number, seq.top, r, sizes[r], layers)
            elif rng.random() < 0.5 or r == 0:      # passed over by every decoder (SS-LO-003)
                self.garbage(number, seq.top, r, layers["temporal"])

    def garbage(self, number, s, r, temporal):
        self.put(c.UT_INCREMENT, bytes(self.rng.randrange(256) for _ in range(5)), frame=number, refinement=r,
                 temporal=temporal, spatial=s)

    # ---- 6.16 ----

    def points(self):
        rng, live, seq = self.rng, self.live, self.seq
        every = [(s, t, r) for s in range(seq.spatial_layer_count) for t in range(seq.temporal_layer_count)
                 for r in range(seq.refinement_count)]
        if rng.random() < 0.2:
            every = [(s, t, r) for s in range(4) for t in range(4) for r in range(10) if rng.random() < 0.1]
        live_frame, frames = live.frame, list(live.frames)
        if live_frame is not None:
            frames.append(live_frame)
        entries = b""
        for point in every:
            gaussians = sum(points.exact_gaussians(frame, seq, point) for frame in frames) if not live.errors else 0
            entries += struct.pack("<4BIQQ", *point, 0, live.ledger.frame_count(point, seq), gaussians,
                                   live.ledger.byte_count(point, seq))
        self.put(c.UT_POINTS, struct.pack("<HH", len(every), 0) + entries)


def valid_stream(seed, **options):
    """A stream that the decoder accepts."""
    data = DynamicSynth(seed, **options).stream()
    errors = Decoder(data).decode().errors
    if errors:
        raise StreamError(errors[0].code, errors[0].clause, errors[0].byte)
    return data
