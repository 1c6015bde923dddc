"""Streams of profile 0 written from what is asked, element by element and value by value.

tamper: (stage, change) makes a fault in the first increment. The stages are `elements` (of 5.14), `new` (planes of values),
`plane` ((plane, elements of its model)), `coded` (models and blocks) and `payload`. The digest stays that of what was
asked for.
"""

from oracle import constants as c
from oracle.reconstruction import prefix_count
from .increment import IncrementWriter
from .scripts import ScriptCoder
from .stream import StreamWriter, sequence_payload

IDENTITY = (4096, 0, 0, 0, 4096, 0, 0, 0, 4096)


class GivenWriter(IncrementWriter):
    """Values, models and elements are given; see GivenStream.unit()."""

    given = None

    def choose_elements(self, parent_count):
        u, given = self.u, self.given
        u.position_shift, u.sh_mode = given["position_shift"], given["sh_mode"]
        u.attribute_step = list(given["attribute_step"])
        u.codebook_ids, u.vq_stage_count = list(given["stages"]), len(given["stages"])
        u.new_count = self.size

    def choose_flags(self):
        self.u.increment_flags = self.u.needed()

    def choose_lanes(self, count):
        return self.given["lanes_log2"]

    def positions(self, parents):
        """Those of given Morton codes; else at random, a tenth of them twice."""
        codes = self.given["codes"]
        if codes is None:
            codes, bits = [], self.seq.position_bits - self.u.position_shift
            for _ in range(self.u.new_count):
                twice = codes and self.rng.random() < 0.1
                codes.append(self.rng.choice(codes) if twice else self.rng.randrange(8 ** bits))
        return self.in_blocks(codes)

    def taker(self, name):
        def take(attribute, predictions, factors):
            planes = [self.given["values"].get((attribute, plane.index)) or self.usual(plane, len(predictions))
                      for plane in self.planes(name) if plane.attribute == attribute]
            self.v[name] = self.v[name] + planes
            return planes

        return take

    def usual(self, plane, count):
        rng = self.rng
        if plane.alphabet == "index":
            book = self.context.codebooks[self.u.codebook_ids[plane.index]]
            return [rng.randrange(book.entry_count) for _ in range(count)]
        low, high = {"log_scale": (0, 40), "opacity": (-20, 20), "rotation": (-90, 90)}.get(plane.attribute, (-9, 9))
        return [rng.randint(low, high) for _ in range(count)]

    def coder(self, planes, v, lanes_log2, in_force):
        change = lambda plane, elements: self.tamper("plane", (plane, elements), self)[1]
        return ScriptCoder(planes, v, self.block_size(), 2 ** lanes_log2, in_force, self.rule, self.given["plans"],
                           change)


class FirstIncrement:
    """A tamper of a StreamWriter: a change at one stage of the first increment."""

    def __init__(self, stage, change):
        self.stage, self.change, self.done = stage, change, False

    def __call__(self, stage, value, writer):
        self.done = self.done or stage == self.stage
        return self.change(value) if stage == self.stage else value


class GivenStream(StreamWriter):
    def __init__(self, seed=0, level=1, tamper=None, **asked):
        super().__init__(seed, c.PROFILE_INTRA, level, FirstIncrement(*tamper) if tamper else None)
        self.sequence(sequence_payload(asked))

    def skipped(self, kind, payload=b"private", **header):
        self.put(kind, payload, **{"flags": 0, **header})

    def transform(self, kind=0, identifier=0, mean=None, basis=None, rank=None):
        """`basis` is filled up with zeros; the identity if it is absent."""
        dimension = self.seq.sh_planes if kind else 3
        rank = rank or dimension
        mean = list(mean or []) + [0] * (dimension - len(mean or []))
        if basis is None:
            basis = [4096 * (j == k) for k in range(rank) for j in range(dimension)]
        super().transform(kind, identifier, mean, list(basis) + [0] * (rank * dimension - len(basis)), rank)

    def frame(self, total, dc=0, sh=c.NONE_ID):
        self.total, self.units = total, 0
        self.frame_header(self.state.next_frame, dc, sh, total)

    def unit(self, values=None, plans=None, codes=None, lanes_log2=0, position_shift=0, sh_mode=0, stages=(),
             attribute_step=(0,) * 5):
        """The next increment. values: (attribute, index) -> values of a plane, others are random; plans: those of scripts.py;
        codes: Morton codes of the positions."""
        r = self.units
        size = prefix_count(self.seq, self.total, r) - prefix_count(self.seq, self.total, r - 1)
        writer = GivenWriter(self.rng, self.state.frame, self.live.context(self.state.frame), 0, r, size, self.tamper)
        writer.given = {"values": values or {}, "plans": plans or {}, "codes": codes, "lanes_log2": lanes_log2,
                        "position_shift": position_shift, "sh_mode": sh_mode, "stages": stages,
                        "attribute_step": attribute_step}
        self.increment(writer)
        self.units += 1
