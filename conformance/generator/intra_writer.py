"""Streams of profile 0 written from what is asked, element by element and value by value.

tamper: {(number of the refinement unit, stage): change} makes faults: at stage `fixed` a change of the elements, at
`values` of the planes of values, at `elements` of (plane, elements of its model), at `coded` of (models, blocks), at
`payload` of the bytes. What depends on the changed thing is made after the change; digests only where there are values.
"""

import random
import struct

import oracle_path  # noqa: F401
import constants as c
import models as pm
import points
from conventions import ByteReader
from decoding import Decoder
from encoding import file_header, leb, unit
from model_script import ScriptCoder
from reconstruction import BlockValues, frame_digest, prefix_count, unit_digests
from semantics import parse_codebook, parse_sequence_parameters, parse_transform

IDENTITY = (4096, 0, 0, 0, 4096, 0, 0, 0, 4096)

SEQUENCE = {"sh_degree": 0, "spatial_layer_count": 1, "temporal_layer_count": 1, "percent": [100], "position_bits": 10,
            "block_log2": 6, "sequence_flags": 0, "rotation_threshold": [0, 0, 0], "frame_count": 0,
            "ticks_per_second": 30,
            "ticks_per_frame": 1, "position_offset": [0.0, 0.0, 0.0], "position_step": 0.001, "log_scale_offset": -5.0,
            "log_scale_step": 0.01, "rotation_step": 0.003, "opacity_offset": 0.0, "opacity_step": 0.1, "dc_step": 0.02,
            "sh_step": 0.02}


def sequence_payload(asked):
    e = {**SEQUENCE, **asked}
    assert set(e) == set(SEQUENCE), set(e) - set(SEQUENCE)
    percent = e["percent"]
    head = [e["sh_degree"], e["spatial_layer_count"], e["temporal_layer_count"], len(percent), *percent,
            *[0] * (10 - len(percent)), e["position_bits"], e["block_log2"], e["sequence_flags"],
            *e["rotation_threshold"]]
    return bytes(head) + struct.pack(
        "<III11f", e["frame_count"], e["ticks_per_second"], e["ticks_per_frame"], *e["position_offset"],
        e["position_step"],
        e["log_scale_offset"], e["log_scale_step"], e["rotation_step"], e["opacity_offset"], e["opacity_step"],
        e["dc_step"], e["sh_step"])


def morton(position, bits):
    return sum(((x >> b) & 1) << (3 * b + a) for a, x in enumerate(position) for b in range(bits))


class IntraStream:
    """Units are written by the methods in the order of the calls; close() gives the stream."""

    def __init__(self, seed=0, level=1, minor=0, tamper=None, **asked):
        self.rng, self.tamper = random.Random(seed), tamper or {}
        self.out = bytearray(file_header(c.PROFILE_INTRA, level, minor))
        self.parameters = sequence_payload(asked)
        self.seq = parse_sequence_parameters(ByteReader(self.parameters, 0, len(self.parameters)))
        self.units = self.frames = self.next_frame = self.refinements = 0
        self.gops = []
        self.put(c.UT_SEQUENCE, self.parameters)

    def put(self, kind, payload, **header):
        self.out += unit(kind, payload, **header)
        self.units += 1

    def skipped(self, kind, payload=b"private", **header):
        self.put(kind, payload, **{"flags": 0, **header})

    def gop(self, frame_count=1):
        self.gops.append((self.next_frame, len(self.out)))
        self.first = self.next_frame
        self.put(c.UT_GOP, struct.pack("<IIBBH", len(self.gops) - 1, frame_count, 0, 0, 0), frame=self.first)
        self.transforms, self.books = ({}, {}), {}

    def transform(self, kind=0, identifier=0, mean=None, basis=None, rank=None):
        """`basis` is filled up with zeros; the identity if it is absent."""
        dimension = self.seq.sh_planes if kind else 3
        rank = rank or dimension
        mean = list(mean or []) + [0] * (dimension - len(mean or []))
        if basis is None:
            basis = [4096 * (j == k) for k in range(rank) for j in range(dimension)]
        basis = list(basis) + [0] * (rank * dimension - len(basis))
        payload = struct.pack("<4B%di%dh" % (dimension, rank * dimension), identifier, kind, dimension, rank, *mean,
                              *basis)
        self.put(c.UT_TRANSFORM, payload, frame=self.first)
        self.transforms[kind][identifier] = parse_transform(ByteReader(payload, 0, len(payload)), self.seq.sh_planes,
                                                            {}, {})

    def codebook(self, identifier, components, values, value_bytes=1):
        payload = struct.pack("<BBHB", identifier, components, len(values) // components - 1, value_bytes)
        payload += struct.pack("<%d%s" % (len(values), "b" if value_bytes == 1 else "h"), *values)
        self.put(c.UT_CODEBOOK, payload, frame=self.first)
        self.books[identifier] = parse_codebook(ByteReader(payload, 0, len(payload)), {})

    def frame(self, total, dc=0, sh=c.NONE_ID):
        self.total, self.dc, self.sh = total, self.transforms[0][dc], self.transforms[1].get(sh)
        self.put(c.UT_FRAME, struct.pack("<4BI", 0, dc, sh, 0, total), frame=self.next_frame)
        self.next_frame += 1
        self.frames += 1
        self.models, self.digests = {}, []

    # ---- values ----

    def positions(self, count, bits):
        """Morton codes in order, block by block; a tenth of the places is taken twice."""
        codes = []
        for _ in range(count):
            twice = codes and self.rng.random() < 0.1
            codes.append(self.rng.choice(codes) if twice else morton([self.rng.randrange(2 ** bits) for _ in range(3)],
                                                                     bits))
        return codes

    def deltas(self, codes):
        size, result = 2 ** self.seq.block_log2, []
        for start in range(0, len(codes), size):
            block = sorted(codes[start:start + size])
            result += [b - a for a, b in zip([0] + block, block)]
        return result

    def usual(self, plane, count):
        rng = self.rng
        if plane.alphabet == "index":
            return [rng.randrange(self.books[self.stages[plane.place]].entry_count) for _ in range(count)]
        low, high = {"log_scale": (0, 40), "opacity": (-20, 20), "rotation": (-90, 90)}.get(plane.attribute, (-9, 9))
        return [rng.randint(low, high) for _ in range(count)]

    # ---- refinements ----

    def refinement(self, values=None, plans=None, codes=None, lanes_log2=0, position_shift=0, sh_mode=0, stages=()):
        """values: (attribute, place) -> values of a plane, others are random; codes: Morton codes of the positions."""
        r, number = len(self.digests), self.refinements
        n = prefix_count(self.seq, self.total, r) - prefix_count(self.seq, self.total, r - 1)
        self.stages = list(stages)
        u = type("Fixed", (), {})()
        u.digest, u.count, u.position_shift, u.lanes_log2, u.sh_mode = 0, n, position_shift, lanes_log2, sh_mode
        u.vq_stage_count, u.codebook_ids = len(stages), self.stages + [c.NONE_ID] * (4 - len(stages))
        models, blocks = b"", []
        planes = [[] for _ in range(13 + self.seq.sh_planes)]
        if n:
            coded = pm.coded_planes(self.dc.rank, sh_mode, self.sh.rank if self.sh else 0, len(stages))
            bits = self.seq.position_bits - position_shift
            v = [self.deltas(self.positions(n, bits) if codes is None else codes)]
            v += [(values or {}).get((p.attribute, p.place)) or self.usual(p, n) for p in coded[1:]]
            v = self.changed("values", v)
            change = self.tamper.get((number, "elements"))
            coder = ScriptCoder(coded, v, 2 ** self.seq.block_log2, 2 ** lanes_log2, self.models, plans or {}, change)
            models, blocks = coder.run()
            self.models = coder.by_identity()
            if (number, "values") not in self.tamper and change is None:
                planes = self.canonical(coder, coded, u)
        self.digests.append(unit_digests(planes))
        u.digest = frame_digest(self.digests)
        self.write_refinement(r, self.changed("fixed", u), *self.changed("coded", (models, blocks)))

    def canonical(self, coder, coded, u):
        planes = [[] for _ in range(13 + self.seq.sh_planes)]
        for block in coder.blocks:
            values = BlockValues(block.e, coded, coder.models, u, self.seq, self.dc, self.sh, self.books, 0)
            for whole, part in zip(planes, values.canonical()):
                whole.extend(part)
        return planes

    def write_refinement(self, r, u, models, blocks):
        payload = struct.pack("<QIBBBB4B", u.digest, u.count, u.position_shift, u.lanes_log2, u.sh_mode,
                              u.vq_stage_count,
                              *u.codebook_ids)
        payload += leb(len(models)) + models + b"".join(leb(len(b)) for b in blocks) + b"".join(blocks)
        self.put(c.UT_REFINEMENT, self.changed("payload", payload), frame=self.next_frame - 1, refinement=r)
        self.refinements += 1

    def changed(self, stage, value):
        change = self.tamper.get((self.refinements, stage))
        return change(value) if change else value

    # ---- 6.16, 6.10, 6.11 ----

    def operating_points(self):
        """An operating_points unit with all operating points of the sequence."""
        decoder = Decoder(bytes(self.out)).decode()
        entries, frames = b"", decoder.frames
        for r in range(self.seq.refinement_count):
            point = (0, 0, r)
            gaussians = sum(points.intra_gaussians(frame, self.seq, point) for frame in frames)
            entries += struct.pack("<4BIQQ", *point, 0, decoder.ledger.frame_count(point, self.seq), gaussians,
                                   decoder.ledger.byte_count(point, self.seq))
        self.put(c.UT_POINTS, struct.pack("<HH", self.seq.refinement_count, 0) + entries)

    def index(self):
        self.index_offset = len(self.out)
        entries = b"".join(struct.pack("<IIQ", frame, 0, at) for frame, at in self.gops)
        self.put(c.UT_INDEX, struct.pack("<I", len(self.gops)) + entries)

    def close(self):
        offset = getattr(self, "index_offset", 0)
        self.put(c.UT_END, struct.pack("<IIQ", self.frames, self.units, offset))
        return bytes(self.out)
