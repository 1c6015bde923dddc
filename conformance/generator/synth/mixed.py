"""Random conforming streams of both profiles (A.1) that use every tool."""

from oracle import constants as c
from oracle.constants import MAX_SEGMENTS
from oracle.conventions import ceil_div
from oracle.reconstruction import prefix_count
from .cells import CellsWriter
from .increment import IncrementWriter
from .scene import random_scene
from .stream import WHOLE_ANCHOR, StreamWriter, sequence_payload


class MixedSynth(StreamWriter):
    """stream() gives the bytes."""

    writer_class = IncrementWriter

    def __init__(self, seed, tamper=None, most=None, deep=False, profile=c.PROFILE_DYNAMIC, level=None):
        """most: Gaussians of a frame, about; deep: one GOP of temporal_depth 2 or 3 in a small sequence."""
        super().__init__(seed, profile, level or 1 + seed % 4, tamper)
        self.profile, self.deep = profile, deep
        self.most = most or self.rng.choice([6, 20, 20, 40, 90, 150])

    def disturb(self):
        """Units that may stand anywhere: private ones, reserved ones, copies of sequence_parameters."""
        rng = self.rng
        if rng.random() < 0.06:
            self.put(rng.choice([13, 12, 127, 128, 255]), b"private"[:rng.randint(0, 7)], frame=77, flags=0,
                     spatial=rng.choice([0, 3, 9]), temporal=rng.choice([0, 1, 200]),
                     refinement=rng.choice([0, 9, 200]))
        if rng.random() < 0.04 and self.seq is not None:
            self.sequence()

    def stream(self):
        self.plan_gops()
        self.disturb()
        self.sequence(sequence_payload(self.chosen_sequence()))
        if self.wants("described", 0.3):
            self.put(c.UT_SCENE, random_scene(self.rng))
        for number, (structure, depth, count) in enumerate(self.gops):
            self.disturb()
            if number and self.wants("copies", 0.7):
                self.sequence()
            self.gop(count, structure, depth)
            self.definitions()
            for k in self.present(structure, depth, count):
                self.disturb()
                self.frame(self.first + k)
        self.disturb()
        if self.wants("listed", 0.85):
            self.operating_points(self.chosen_points())
        self.disturb()
        if self.wants("indexed", 0.7):
            self.index()
        self.disturb()
        return self.close()

    def wants(self, what, probability):
        """Whether an optional unit or element is written."""
        return self.rng.random() < probability

    # ---- 6.4, 6.5, 6.16 ----

    def plan_gops(self):
        rng = self.rng
        self.temporal_layers = 1 if self.profile == 0 else 4 if self.deep else rng.choice([1, 1, 2, 3, 4])
        if self.deep:
            self.gops = [(1, rng.choice([2, 3, 3]), rng.randint(9, 14))]
            return
        self.gops = []
        for _ in range(rng.choice([1, 1, 2, 2, 3])):
            if self.profile == 0 or rng.random() < 0.25:
                self.gops.append((0, 0, rng.randint(1, 2)))
            else:
                depth = rng.randint(0, min(3, self.temporal_layers - 1))
                self.gops.append((1, depth, rng.choice([1, 2, 3, 2 ** depth + 1, 2 ** depth + 2, 9 if depth else 4])))

    def chosen_sequence(self):
        """Elements of sequence_parameters"""
        rng = self.rng
        count = rng.choice([1, 2, 2, 3, 3, 4, 5]) if rng.random() < 0.95 else 10
        spatial, sh_degree = rng.choice([1, 1, 2, 2, 3, 4]), rng.choice([0, 0, 1, 1, 1, 2, 3])
        if self.deep:
            count, spatial, sh_degree = rng.randint(2, 4), rng.choice([1, 1, 2]), rng.choice([0, 0, 1])
        dynamic = self.profile == c.PROFILE_DYNAMIC
        return {
            "sh_degree": sh_degree, "spatial_layer_count": spatial if dynamic else 1,
            "temporal_layer_count": self.temporal_layers,
            "percent": sorted(rng.sample(range(1, 100), count - 1)) + [100],
            **self.chosen_grid(), **self.chosen_steps(), "block_log2": rng.choice([6, 6, 6, 7, 16]),
            "sequence_flags": rng.randint(0, 3) + WHOLE_ANCHOR * (dynamic and rng.random() < 0.3),
            "frame_count": rng.choice([0, sum(gop[2] for gop in self.gops)]),
            "ticks_per_second": rng.choice([1, 30, 60]), "ticks_per_frame": rng.choice([0, 1, 3003]),
            "position_offset": [1.5, -0.0, 2.25], "opacity_offset": 1.0, "sh_step": 0.03,
            "rotation_step": rng.choice([1.0, 0.02, 0.003, 0.0005, 0.0001, 1e-6, 0.7])}

    def chosen_grid(self, bits=None):
        """A grid that is linear or companded."""
        rng = self.rng
        bits = bits or rng.choice([1, 3, 6, 10, 12, 14, 16, 20])
        linear = rng.choice([20, bits, max(0, bits - 2), max(0, bits - 4)])
        far = max(0, 2 ** (bits - 1) - 2 ** linear)
        least = next(k for k in range(21) if ceil_div(far, 2 ** k) <= MAX_SEGMENTS)
        return {"position_bits": bits, "linear_log2": linear, "segment_log2": min(linear, least + rng.choice([0, 0, 1]))}

    def chosen_steps(self):
        """Elements of the rule of steps, idle in half of the streams."""
        rng = self.rng
        weight = lambda: rng.choice([0, 0, 30, 300, 2000])
        rule = {"size_weight": [weight() for _ in range(5)], "opacity_weight": [weight() for _ in range(3)],
                "anisotropy_weight": weight(), "size_reference": rng.choice([-300, 0, 100, 400]),
                "opacity_reference": rng.choice([-20, 0, 50]), "anisotropy_reference": rng.choice([0, 10, 200])}
        return {**(rule if rng.random() < 0.5 else {}), "feature_shift": rng.choice([0, 0, 0, 1, 3, 7])}

    def present(self, structure, depth, count):
        """Indices of the frames that are there: a frame that is absent takes those that refer to it along."""
        there = []
        for k in range(count):
            reference = self.state.gop.order(self.first + k)[2]
            if k == 0 or structure == 0:
                there.append(k)
            elif reference in there and self.rng.random() < (0.97 if k % 2 ** depth == 0 else 0.8):
                there.append(k)
        return there

    def chosen_points(self):
        if self.rng.random() < 0.2:
            return [(s, t, r) for s in range(4) for t in range(4) for r in range(10) if self.rng.random() < 0.1]
        return None

    # ---- 6.7, 6.8 ----

    def definitions(self):
        rng, planes = self.rng, self.seq.sh_planes
        self.sh_ranks = {}
        for kind, dimension in ((0, 3), (1, planes)):
            for identifier in rng.sample(range(16), self.transform_count(kind, dimension)):
                rank = self.rank(kind, dimension)
                mean = [self.mean(kind) for _ in range(dimension)]
                basis = [rng.choice([4096, -4096, 0, rng.randint(-4096, 4096)]) for _ in range(rank * dimension)]
                self.transform(kind, identifier, mean, basis, rank)
                if kind == 1:
                    self.sh_ranks[identifier] = rank
        for rank in self.sh_ranks.values():
            for _ in range(rng.randint(0, 2)):
                self.random_codebook(rng.randrange(16), rank)

    def transform_count(self, kind, dimension):
        return self.rng.randint(1, 2) if dimension else 0

    def mean(self, kind):
        return self.rng.choice(([0, 5000, -777, 2 ** 30], [0, 5000, -777, 2 ** 29])[kind])

    def rank(self, kind, dimension):
        return self.rng.randint(1, min(dimension, 3 if kind == 0 else 5))

    def random_codebook(self, identifier, rank):
        """Defines a codebook, or defines it again."""
        rng = self.rng
        old = self.state.codebook.get(identifier)
        layer = old.temporal_layer if old else rng.randrange(self.seq.temporal_layer_count)
        if rng.random() < 0.6:
            layer = old.temporal_layer if old else 0
        size, entries = rng.choice([(1, 5), (1, 17), (2, 3), (2, 40)])
        reach = {1: 60, 2: rng.choice([100, 32767])}[size]
        values = [0] * rank + [rng.randint(-reach, reach) for _ in range((entries - 1) * rank)]
        self.codebook(identifier, rank, values, size, layer)

    # ---- frames ----

    def frame(self, number):
        rng, live = self.rng, self.state
        if self.sh_ranks and rng.random() < 0.3 and number > self.first:
            self.random_codebook(rng.choice(list(live.codebook) + [rng.randrange(16)]),
                                 rng.choice(list(self.sh_ranks.values())))
        intra = live.gop.order(number)[0] == c.TYPE_I
        dc_id = rng.choice(list(live.dc_transform))
        sh_id = rng.choice(list(live.sh_transform) * 3 + [255])
        if intra:
            total = self.frame_total(number)
            self.frame_header(number, dc_id, sh_id, total)
            self.intra_units(number, total)
            return
        sizes = self.plan_sizes(self.reference(number))
        self.frame_header(number, dc_id, sh_id, sum(sizes), self.cells_of(number), self.wants("digests", 0.8))
        self.predicted_units(number, sizes)

    def cells_of(self, number):
        return CellsWriter(self.rng, self.seq, self.reference(number), self.tamper)

    def frame_total(self, number):
        """Gaussians of an I frame."""
        rng, most = self.rng, self.most
        total = rng.choice([0, 1, most] if not self.state.gop.predicted else [1] + [most] * 4)
        return rng.choice([total, most // 2, most, most, most + rng.randint(0, 70)])

    def before(self, reference):
        """Sizes of the lists of a reference frame, 0 above its level."""
        sizes = [0] * self.seq.refinement_count
        if reference is not None:
            for h in range(reference.level()):
                sizes[h] = len(reference.lists[(self.seq.top, h)])
        return sizes

    def plan_sizes(self, reference):
        """Sizes of the lists of a P or B frame."""
        rng = self.rng
        return [rng.choice([n, n, max(0, n + rng.randint(-4, 5)), rng.choice([0, n + self.most // 2])])
                for n in self.before(reference)]

    def unit(self, s, r, size):
        if r >= self.state.frame.limit:              # discarded by every decoder
            self.garbage(s, r)
            return
        writer = self.writer_class(self.rng, self.state.frame, self.live.context(self.state.frame), s, r, size, self.tamper)
        writer.predicting = self.profile == c.PROFILE_DYNAMIC
        self.increment(writer)
        self.written(writer)
        self.disturb()

    def written(self, writer):
        """Called after each increment."""

    def layer_plan(self, number):
        """The number of units of each spatial layer of an I frame, which does not increase."""
        rng, seq = self.rng, self.seq
        counts = [seq.refinement_count] * seq.spatial_layer_count
        if rng.random() < (0.3 if self.state.gop.predicted else 0.7):
            counts = sorted((rng.randint(1, seq.refinement_count) for _ in counts), reverse=True)
            counts = counts[:rng.randint(1, len(counts))]
        return counts

    def layer_size(self, before, share, s):
        """Size of a list below the highest spatial layer."""
        return self.rng.choice([before, share, self.rng.randint(before, share)])

    def intra_units(self, number, total):
        seq, sizes = self.seq, {}
        for s, count in enumerate(self.layer_plan(number)):
            for r in range(count):
                share = prefix_count(seq, total, r) - prefix_count(seq, total, r - 1)
                before = sizes.get((s - 1, r), 0)
                sizes[(s, r)] = share if s == seq.top else self.layer_size(before, share, s)
                self.unit(s, r, sizes[(s, r)])

    def unit_count(self, number):
        """Units of a P or B frame."""
        whole = self.seq.refinement_count
        return whole if self.rng.random() < 0.7 else self.rng.randint(0, whole)

    def predicted_units(self, number, sizes):
        for r in range(self.unit_count(number)):
            self.unit(self.seq.top, r, sizes[r])

    def garbage(self, s, r):
        self.put(c.UT_INCREMENT, bytes(self.rng.randrange(256) for _ in range(5)), frame=self.number, refinement=r,
                 temporal=self.state.frame.layer, spatial=s)


def mixed_stream(seed, **options):
    return MixedSynth(seed, **options).stream()
