"""Streams written unit by unit. A decoder reads each unit as it is written: it holds the state that the next unit depends on."""

import random
import struct

from oracle import constants as c, points
from oracle.decoding import Decoder
from oracle.lists import lists_digest
from oracle.semantics import parse_file_header
from .elements import FRAME, Elements
from .encoding import file_header, unit
from .units import offset_of, stream_of, units_of

SEQUENCE = {"sh_degree": 0, "spatial_layer_count": 1, "temporal_layer_count": 1, "percent": [100], "position_bits": 10,
            "block_log2": 6, "sequence_flags": 0, "linear_log2": 20, "segment_log2": 0, "feature_shift": 0,
            "size_weight": [0] * 5, "opacity_weight": [0] * 3, "anisotropy_weight": 0, "size_reference": 0,
            "opacity_reference": 0, "anisotropy_reference": 0, "frame_count": 0,
            "ticks_per_second": 30, "ticks_per_frame": 1, "position_offset": [0.0, 0.0, 0.0], "position_step": 0.001,
            "log_scale_offset": -5.0, "log_scale_step": 0.01, "rotation_step": 0.003, "opacity_offset": 0.0,
            "opacity_step": 0.1, "dc_step": 0.02, "sh_step": 0.02}
WHOLE_ANCHOR = 4                                    # bit 2 of sequence_flags


def sequence_payload(asked):
    e = {**SEQUENCE, **asked}
    assert set(e) == set(SEQUENCE), set(e) - set(SEQUENCE)
    percent = e["percent"]
    head = [e["sh_degree"], e["spatial_layer_count"], e["temporal_layer_count"], len(percent), *percent,
            *[0] * (10 - len(percent)), e["position_bits"], e["block_log2"], e["sequence_flags"],
            e["linear_log2"], e["segment_log2"], e["feature_shift"]]
    rule = [*e["size_weight"], *e["opacity_weight"], e["anisotropy_weight"], e["size_reference"], e["opacity_reference"],
            e["anisotropy_reference"]]
    return bytes(head) + struct.pack("<9H3i", *rule) + struct.pack(
        "<III11f", e["frame_count"], e["ticks_per_second"], e["ticks_per_frame"], *e["position_offset"],
        e["position_step"], e["log_scale_offset"], e["log_scale_step"], e["rotation_step"], e["opacity_offset"],
        e["opacity_step"], e["dc_step"], e["sh_step"])


class Made(Exception):
    """The payload of the unit with a fault, which starts at `at` in the parent."""

    def __init__(self, at, payload):
        super().__init__()
        self.at, self.payload = at, payload

    def spliced(self, parent):
        """The parent with this payload."""
        head, units = units_of(parent)
        number = next(i for i in range(len(units)) if offset_of(head, units, i) == self.at)
        return stream_of(head, units[:number] + [units[number].copy(payload=self.payload)] + units[number + 1:])


class StreamWriter:
    """Units are written by the methods in the order of the calls; close() gives the stream.

    tamper(stage, value, writer) may change what frames hold; the first unit that it has changed (`done`) ends the writing by
    the exception Made.
    """

    def __init__(self, seed, profile, level=1, tamper=None):
        self.rng, self.tamper = random.Random(seed), tamper
        self.out = bytearray(file_header(profile, level))
        self.live = Decoder(self.out)
        self.live.file_header = parse_file_header(self.out)
        self.state = self.live.state
        self.parameters, self.index_offset = None, 0

    def put(self, kind, payload, **header):
        """Writes a unit and lets the decoder read it; gives its offset."""
        at = len(self.out)
        if self.tamper and self.tamper.done:
            raise Made(at, payload)
        self.out += unit(kind, payload, **header)
        self.live.unit(at)
        assert not self.live.errors, self.live.errors[0]
        return at

    @property
    def seq(self):
        return self.live.sequence

    def sequence(self, payload=None):
        """sequence_parameters, or a copy of them."""
        self.parameters = payload or self.parameters
        self.put(c.UT_SEQUENCE, self.parameters)

    def gop(self, frame_count=1, structure=0, depth=0):
        self.first = self.live.expected_frame()
        self.number = self.first
        self.put(c.UT_GOP, struct.pack("<IIBBH", self.state.next_gop, frame_count, structure, depth, 0), frame=self.first)

    def transform(self, kind, identifier, mean, basis, rank):
        payload = struct.pack("<4B%di%dh" % (len(mean), len(basis)), identifier, kind, len(mean), rank, *mean, *basis)
        self.put(c.UT_TRANSFORM, payload, frame=self.first)

    def codebook(self, identifier, components, values, value_bytes=1, layer=0):
        payload = struct.pack("<BBHB", identifier, components, len(values) // components - 1, value_bytes)
        payload += struct.pack("<%d%s" % (len(values), "b" if value_bytes == 1 else "h"), *values)
        self.put(c.UT_CODEBOOK, payload, frame=self.first, temporal=layer)

    def frame_header(self, number, dc_id, sh_id, total, cells=None, with_digest=False):
        """cells: a CellsWriter or None; with_digest: whether there is a carried_digest."""
        frame_type, layer, _ = self.state.gop.order(number)
        u = Elements(FRAME, frame_type=frame_type, dc_transform_id=dc_id, sh_transform_id=sh_id, gaussian_count=total)
        lists = cells.displace(u) if cells else self.reference(number).carried() if frame_type != c.TYPE_I else []
        if with_digest:
            u.set("carried_digest", lists_digest(lists, 13 + self.seq.sh_planes))
        self.number = number
        u = self.tamper("frame", u, self) if self.tamper else u
        self.put(c.UT_FRAME, u.bytes(), frame=number, temporal=layer)

    def reference(self, number):
        """The reference frame of a frame, None if it is absent."""
        return self.state.gop.frames.get(self.state.gop.order(number)[2])

    def increment(self, writer):
        """The unit of an IncrementWriter."""
        payload = writer.payload()
        self.put(c.UT_INCREMENT, payload, frame=self.number, refinement=writer.r, temporal=writer.frame.layer,
                 spatial=writer.s)

    # ---- 6.16, 6.10, 6.11 ----

    def operating_points(self, entries=None):
        """operating_points with the given points, or all of the sequence."""
        live, seq, rows = self.live, self.seq, b""
        frames = live.frames + [self.state.frame] * (self.state.frame is not None)
        if entries is None:
            entries = [(s, t, r) for s in range(seq.spatial_layer_count) for t in range(seq.temporal_layer_count)
                       for r in range(seq.refinement_count)]
        for point in entries:
            gaussians = sum(points.exact_gaussians(frame, seq, point) for frame in frames)
            rows += struct.pack("<4BIQQ", *point, 0, live.record.ledger.frame_count(point, seq), gaussians,
                                live.record.ledger.byte_count(point, seq))
        self.put(c.UT_POINTS, struct.pack("<HH", len(entries), 0) + rows)

    def index(self, **header):
        entries = b"".join(struct.pack("<IIQ", frame, 0, at) for frame, at in self.live.gops)
        self.index_offset = self.put(c.UT_INDEX, struct.pack("<I", len(self.live.gops)) + entries, **header)

    def close(self):
        self.put(c.UT_END, struct.pack("<IIQ", self.live.record.frame_count, self.live.record.unit_count, self.index_offset))
        return bytes(self.out)
