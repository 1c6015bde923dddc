"""Streams in which what matters is asked for, and the rest is random: the rows of catalogue/structure.py and tools.py.

What may be asked for, beside elements of sequence_parameters by name:

most        Gaussians of an I frame             gops       (structure, depth, frame count) of each GOP
present     index of a frame in its GOP -> whether it is there
units       frame number -> units of the frame; of an I frame a list with one number for each layer
sizes       (frame number, sizes of the lists of its reference) -> sizes of its lists
fixed       element of 5.14 -> value, or a function of the writer; predictor_block_log2 None: no predictors
modes       weights of modes 0 to 3, or a function of the writer
                       removed    parents of a unit -> how many go
cells       a function of the CellsWriter and the occupied cells in order that gives {X: (translation, rotation, stale)}
cell_log2   of all frames                       predictors weights of predictors 0 to 2
position    (writer, positions near, bits) -> grid position of a new Gaussian
move        (writer, axis) -> position residual
move_predictors weights of move predictors 0 to 3
values      attribute -> function (writer, prediction, factor) -> values
layer_sizes (share, s) -> size of a list in spatial layers below the top
disturbed   whether skipped units and copies of sequence_parameters stand between others
transforms  whether there is an sh transform    ranks, mean     of all transforms
lanes       lanes_log2 of all sections          digests    whether P and B frames have carried_digest
whole       whether the anchors are whole       copies     whether sequence_parameters is repeated before GOPs
listed, indexed, described                      whether there are operating_points, index and scene_description units
"""

from oracle import constants as c
from .cells import CellsWriter
from .increment import IncrementWriter
from .mixed import MixedSynth
from .stream import WHOLE_ANCHOR

USUAL = {"most": 12, "gops": [(1, 1, 3)], "present": lambda k: True, "units": lambda number: None, "sizes": None,
         "fixed": {}, "modes": None, "removed": None, "cells": None, "cell_log2": None, "predictors": None,
         "move_predictors": None,
         "position": None, "move": None, "values": {}, "layer_sizes": None, "disturbed": False, "transforms": True,
         "listed": True, "indexed": True, "described": False, "copies": False, "digests": True, "whole": False, "level": 1,
         "ranks": None, "mean": None, "lanes": None, "profile": c.PROFILE_DYNAMIC}
SEQUENCE = {"percent": [40, 100], "sh_degree": 0, "spatial_layer_count": 1}


class DirectedWriter(IncrementWriter):
    """An IncrementWriter that does what its stream is asked for; `asked` is set by it."""

    def choose_elements(self, parent_count):
        super().choose_elements(parent_count)
        u = self.u
        if self.asked["removed"] is not None and not self.frame.intra:
            removed = min(parent_count, self.asked["removed"](parent_count))
            u.remove_count = max(removed, parent_count - self.size)
            u.new_count = self.size - (parent_count - u.remove_count)
        for name, value in self.asked["fixed"].items():
            setattr(u, name, value(self) if callable(value) else value)
        if u.new_count == 0:
            u.predictor_block_log2 = None
        if u.sh_mode != 2:
            u.vq_stage_count, u.codebook_ids = 0, []

    def choose_lanes(self, count):
        return super().choose_lanes(count) if self.asked["lanes"] is None else self.asked["lanes"]

    def mode_weights(self):
        asked = self.asked["modes"]
        return asked(self) if callable(asked) else asked or super().mode_weights()

    def predictor_weights(self):
        return self.asked["predictors"] or super().predictor_weights()

    def move(self, axis):
        return super().move(axis) if self.asked["move"] is None else self.asked["move"](self, axis)

    def position(self, near, bits, shift):
        asked = self.asked["position"]
        return super().position(near, bits, shift) if asked is None else asked(self, near, bits)

    def move_predictor_weights(self):
        return self.asked["move_predictors"] or super().move_predictor_weights()

    def choose(self, attribute, prediction, factor):
        asked = self.asked["values"].get(attribute)
        return asked(self, prediction, factor) if asked else super().choose(attribute, prediction, factor)


class DirectedSynth(MixedSynth):
    writer_class = DirectedWriter

    def __init__(self, seed, tamper=None, **asked):
        sequence = {key: value for key, value in asked.items() if key not in USUAL}
        self.elements = {**SEQUENCE, **sequence}
        self.asked = {**USUAL, **{key: value for key, value in asked.items() if key in USUAL}}
        if self.asked["whole"]:
            self.elements["sequence_flags"] = self.elements.get("sequence_flags", 0) | WHOLE_ANCHOR
        super().__init__(seed, tamper, self.asked["most"], profile=self.asked["profile"], level=self.asked["level"])
        self.writer_class = type("AskedWriter", (self.writer_class,), {"asked": self.asked})

    def plan_gops(self):
        self.gops = self.asked["gops"]
        self.temporal_layers = self.elements.get("temporal_layer_count", 1 + max(depth for _, depth, _ in self.gops))

    def chosen_sequence(self):
        return {**self.elements, "temporal_layer_count": self.temporal_layers}

    def disturb(self):
        if self.asked["disturbed"]:
            super().disturb()

    def wants(self, what, probability):
        return self.asked[what]

    def chosen_points(self):
        return None

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
        if self.asked["sizes"] is None:
            return super().plan_sizes(reference)
        return self.asked["sizes"](self.planned, self.before(reference))

    def frame(self, number):
        self.planned = number
        super().frame(number)

    def cells_of(self, number):
        lanes = self.asked["lanes"] or 0
        return CellsWriter(self.rng, self.seq, self.reference(number), self.tamper, self.asked["cells"],
                           self.asked["cell_log2"], lanes)

    def layer_plan(self, number):
        return self.asked["units"](number) or [self.seq.refinement_count] * self.seq.spatial_layer_count

    def layer_size(self, before, share, s):
        lower = self.asked["layer_sizes"] or (lambda share, s: self.rng.randint(before, share))
        return max(before, min(share, lower(share, s)))

    def unit_count(self, number):
        asked = self.asked["units"](number)
        return self.seq.refinement_count if asked is None else asked


def directed(seed, **asked):
    """A stream that the decoder accepts."""
    return DirectedSynth(seed, **asked).stream()
