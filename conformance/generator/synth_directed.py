"""Streams of profile 1 in which what matters is asked for, and the rest is random: the rows of catalogue_dynamic.py.

What may be asked for, beside elements of sequence_parameters by name:

most        Gaussians of an I frame             gops       (structure, depth, frame count) of each GOP
present     place of a frame in its GOP -> whether it is there
units       frame number -> units of the frame; of an all-intra I frame a list with one number for each layer
sizes       (frame number, sizes of the homes of its reference) -> sizes of its homes
fixed       element of 5.14 -> value, or a function of the writer
modes       weights of modes 0 to 3             removed    parents of a unit -> how many go
cells       a function of the writer and the occupied cells in order that gives {X: (translation, turn, stale)}
predictors  weights of predictors 0 to 2        place      (writer, positions near, bits) -> place of a new Gaussian
move        (writer, axis) -> position residual
values      attribute -> function (writer, prediction, shift) -> values
layer_sizes (share, s) -> home size in spatial layers below the top
disturbed   whether skipped units and copies of sequence_parameters stand between others
transforms  whether there is an sh transform    ranks, mean     of all transforms
lanes       lanes_log2 of all sections
listed, indexed                                 whether there are operating_points and index units
"""

import oracle_path  # noqa: F401
import constants as c
from decoding import Decoder
from encoding import file_header
from intra_writer import sequence_payload
from reconstruction import prefix_count
from synth_dynamic import DynamicSynth
from synth_increment import IncrementWriter, clamped, morton

USUAL = {"most": 12, "gops": [(1, 1, 3)], "present": lambda k: True, "units": lambda number: None, "sizes": None,
         "fixed": {},
         "modes": None, "removed": None, "cells": None, "predictors": None, "place": None, "move": None, "values": {},
         "layer_sizes": None, "disturbed": False, "transforms": True, "listed": True, "indexed": True, "level": 1,
         "ranks": None, "mean": None, "lanes": None}
SEQUENCE = {"percent": [40, 100], "sh_degree": 0, "spatial_layer_count": 1}


class DirectedWriter(IncrementWriter):
    """An IncrementWriter that does what its frame is asked for."""

    @property
    def asked(self):
        return self.frame.asked

    def choose_fixed(self, parent_count):
        super().choose_fixed(parent_count)
        for name, value in self.asked["fixed"].items():
            setattr(self.u, name, value(self) if callable(value) else value)
        if self.asked["removed"] is not None and not self.frame.intra:
            removed = self.asked["removed"](parent_count)
            self.u.remove_count = clamped(max(removed, parent_count - self.size), parent_count)
            self.u.new_count = self.size - (parent_count - self.u.remove_count)
        if self.u.sh_mode != 2:
            self.u.vq_stage_count, self.u.codebook_ids = 0, [255] * 4

    def cell_places(self, bits):
        if self.asked["cells"] is None:
            return super().cell_places(bits)
        self.cell_rows = self.asked["cells"](self, sorted(self.occupied(), key=lambda X: morton(X, bits)))
        return list(self.cell_rows)

    def cell_values(self, i):
        if self.asked["cells"] is None:
            return super().cell_values(i)
        bits = max(self.seq.position_bits - self.u.cell_log2, 1)
        return self.cell_rows[sorted(self.cell_rows, key=lambda X: morton(X, bits))[i]]

    def choose_lanes(self, count):
        return super().choose_lanes(count) if self.asked["lanes"] is None else self.asked["lanes"]

    def mode_weights(self):
        return self.asked["modes"] or super().mode_weights()

    def predictor_weights(self):
        return self.asked["predictors"] or super().predictor_weights()

    def move(self, axis):
        return super().move(axis) if self.asked["move"] is None else self.asked["move"](self, axis)

    def place(self, near, bits, shift):
        return super().place(near, bits, shift) if self.asked["place"] is None else self.asked["place"](self, near,
                                                                                                        bits)

    def choose(self, attribute, prediction, shift):
        asked = self.asked["values"].get(attribute)
        return asked(self, prediction, shift) if asked else super().choose(attribute, prediction, shift)


class DirectedSynth(DynamicSynth):
    writer_class = DirectedWriter

    def __init__(self, seed, tamper=None, **asked):
        sequence = {key: value for key, value in asked.items() if key not in USUAL}
        self.elements = {**SEQUENCE, **sequence}
        self.asked = {**USUAL, **{key: value for key, value in asked.items() if key in USUAL}}
        super().__init__(seed, tamper, self.asked["most"])

    def plan_gops(self):
        self.gops = self.asked["gops"]
        self.temporal_layers = self.elements.get("temporal_layer_count", 1 + max(depth for _, depth, _ in self.gops))

    def sequence(self):
        self.parameters = sequence_payload({**self.elements, "temporal_layer_count": self.temporal_layers})
        return self.parameters

    def disturb(self):
        if self.asked["disturbed"]:
            super().disturb()

    def present(self, structure, depth, count):
        return [k for k in range(count) if self.asked["present"](k)]

    def transform_count(self, kind, dimension):
        return 0 if kind == 1 and not self.asked["transforms"] else super().transform_count(kind, dimension)

    def rank(self, kind, dimension):
        return min(self.asked["ranks"][kind], dimension) if self.asked["ranks"] else super().rank(kind, dimension)

    def mean(self, kind):
        return super().mean(kind) if self.asked["mean"] is None else self.asked["mean"][kind]

    def frame_total(self, number):
        return self.most(number) if callable(self.most) else self.most

    def plan_sizes(self, reference):
        before = [0] * self.seq.refinement_count
        if reference is not None:
            for h in range(reference.level()):
                before[h] = len(reference.homes[(self.seq.top, h)])
        if self.asked["sizes"] is None:
            return super().plan_sizes(reference)
        return self.asked["sizes"](self.number, before)

    def header(self):
        return file_header(c.PROFILE_DYNAMIC, self.asked["level"])

    def wants(self, what, probability):
        return self.asked[what]

    def increment(self, number, s, r, size, layers):
        self.live.frame.asked = self.asked
        super().increment(number, s, r, size, layers)

    def layer_plan(self, number):
        asked = self.asked["units"](number)
        whole = [self.seq.refinement_count] * self.seq.spatial_layer_count
        return [count - 1 for count in (whole if asked is None or self.live.gop.predicted else asked)]

    def intra_units(self, number, total):
        sizes = {}
        for s, b in enumerate(self.layer_plan(number)):
            for r in range(b + 1):
                share = prefix_count(self.seq, total, r) - prefix_count(self.seq, total, r - 1)
                before = sizes.get((s - 1, r), 0)
                lower = self.asked["layer_sizes"] or (lambda share, s: self.rng.randint(before, share))
                sizes[(s, r)] = share if s == self.seq.top else max(before, min(share, lower(share, s)))
                if self.live.frame.dropping:
                    self.garbage(number, s, r, 0)
                else:
                    self.increment(number, s, r, sizes[(s, r)], {"temporal": 0})

    def predicted_units(self, number, sizes, layers):
        asked = self.asked["units"](number)
        level = self.live.frame.reference_level()
        for r in range(self.seq.refinement_count if asked is None else asked):
            if r < level and not self.live.frame.dropping:
                self.increment(number, self.seq.top, r, sizes[r], layers)
            else:
                self.garbage(number, self.seq.top, r, layers["temporal"])


def directed(seed, **asked):
    """A stream that the decoder accepts."""
    data = DirectedSynth(seed, **asked).stream()
    errors = Decoder(data).decode().errors
    if errors:
        raise ValueError(errors[0])
    return data
