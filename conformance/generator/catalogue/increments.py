"""Invalid vectors of frames: one increment or frame_header of a parent is written again with one wrong element, value or
block.

A row is area, name, code, requirements, fault, stage at which the writers ask, whether the fault can be made there, and
the change. Several codes: each of them is right. What comes after the unit stays as in the parent.
"""

import copy

from oracle import models as pm
from oracle.decoding import Decoder
from oracle.constants import MAX_CELLS
from oracle.lists import REMOVE
from oracle.tables import STEP
from ..synth.cells import CellsWriter
from ..synth.scripts import Script
from ..synth.stream import Made
from ..vector import Vector
from .tools import ALL_TOOLS, COLOURS, LARGE


class Tamper:
    """Makes a fault the first time that it can be made, after `skip` times."""

    def __init__(self, stage, applicable, change, skip):
        self.stage, self.applicable, self.change, self.skip = stage, applicable, change, skip
        self.done = False

    def __call__(self, stage, value, writer):
        if self.done or stage != self.stage or not self.applicable(value, writer):
            return value
        if self.skip > 0:
            self.skip -= 1
            return value
        self.done = True
        value = copy.copy(value) if stage in ("elements", "frame", "in_force", "available") else copy.deepcopy(value)
        return self.change(value, writer)


def remade(parent, make, codes, *fault):
    """The parent with the fault in the first unit in which it gives one of the codes."""
    for skip in range(12):
        try:
            make(Tamper(*fault, skip)).stream()
            break                                   # there is no further unit
        except Made as made:
            data = made.spliced(parent)
            errors = Decoder(data).decode().errors
            if errors and errors[0].code in codes:
                return data
    raise ValueError("no unit for it")


def always(value, writer):
    return True


def of_increment(value, writer):
    return not isinstance(writer, CellsWriter)


def of_cells(value, writer):
    return isinstance(writer, CellsWriter)


def element(name, value, index=None):
    """A change of one element, which is present afterwards; `value` may be a function of the record and the writer."""
    def change(u, w):
        u.set(name, value(u, w) if callable(value) else value, index)
        return u
    return change


def entry(plane, value, which=0):
    """A change of one value of a section; `value` may be a function of the old one."""
    def change(v, w):
        v[plane][which] = value(v[plane][which]) if callable(value) else value
        return v
    return change


def fewer_moves(u, w):
    u.move_count -= 1
    w.v["moves"] = [plane[:-1] for plane in w.v["moves"]]
    return u


def first_move_out(v, w):
    """Below 0 from every position, if the grid is smaller than 2^14."""
    v[0][0] = -20000
    return v


def log_scales_rise(v, w):
    """q[2] becomes larger than q[1] (SS-RC-002) while all ranges hold."""
    v[2][0] += 30000 // STEP[w.u.attribute_step[0]]
    return v


def other_book(test):
    """An identifier of a codebook for which test(book, writer) holds, None if there is none."""
    def find(u, w):
        for identifier, book in w.context.codebooks.items():
            if test(book, w):
                return identifier
        return None
    return find


higher = other_book(lambda b, w: b.temporal_layer > w.frame.layer)
wider = other_book(lambda b, w: b.temporal_layer <= w.frame.layer
                   and b.component_count != w.context.sh_transform.rank)


def undefined(u, w):
    return next((i for i in range(16) if i not in w.context.codebooks), None)


def vq(u, w):
    return u.sh_mode == 2


def has_predictors(u, w):
    return u.predictors


def predicted(u, w):
    return not w.frame.intra


def block_changed(change):
    def changed(coded, w):
        models, blocks = coded
        return models, [change(blocks[0])] + blocks[1:]
    return changed


def state_out(block):
    """The first state below 65536."""
    head = 1
    while block[head - 1] > 127:
        head += 1
    return block[:head] + b"\xff\xff\x00\x00" + block[head + 4:]


def small_grid(v, w):
    return w.seq.position_bits <= 14


def full_dc(v, w):
    """Component 0 as large as it may be, the others 0."""
    for k in range(w.context.dc_transform.rank):
        v[8 + k][0] = 8191 // STEP[w.u.attribute_step[3]] if k == 0 else 0
    return v


def dc_at_limit(v, w):
    """dc[0] of the first new Gaussian is 2^30 without its component, and cannot have more (SS-RC-006)."""
    t = w.context.dc_transform
    none = w.u.predictor_block_log2 is None or w.v["predictors"][0][0] == 0
    return none and t.mean[0] == 2 ** 30 and t.basis[0] > 100


def model_of_modes(in_force, w):
    """A model that no unit has coded, for a unit without models in force."""
    plane = pm.section_planes("modes", 0, 0, 0, 0)[0]
    script = Script(plane)
    script.explicit({t: 512 for t in range(1, 7)}, 0)
    return {plane.identity(): script.model}


FAULTS = [
    ("entropy", "entropy-increment-source-not-in-section", "CONSTRAINT", "SS-EC-005 SS-PM-003",
     "the plane of modes uses source 10, which section new alone has",
     "available", lambda value, w: w.section_name == "modes", lambda value, w: lambda source, plane: source == 10),
    ("entropy", "entropy-increment-source-11-of-updates", "CONSTRAINT", "SS-EC-005 SS-PM-003 SS-CX-001",
     "a plane of updates uses source 11, which section new alone has", "available", lambda value, w: w.section_name == "updates",
     lambda value, w: lambda source, plane: source == 11 and plane.attribute in ("rotation", "dc")),
] + [
    ("entropy", "entropy-increment-source-3-of-" + plane, "CONSTRAINT", "SS-EC-005 SS-PM-003",
     "the first plane of section %s uses source 3, and there is no plane before it" % name,
     "available", lambda value, w, name=name: w.section_name == name, lambda value, w: lambda source, plane: source == 3)
    for name, plane in (("modes", "mode"), ("moves", "move"), ("updates", "log-scale"), ("predictors", "predictor"))
] + [
    ("entropy", "entropy-increment-reuse-without-model", "CONSTRAINT", "SS-PM-001",
     "reuse is 1 in section modes of a unit for which no models are in force",
     "in_force", lambda value, w: w.section_name == "modes" and not value, model_of_modes),
    ("constraint", "constraint-increment-parent-count", "MISMATCH", "SS-IN-005", "parent_count is one too large",
     "elements", always,
     element("parent_count", lambda u, w: u.parent_count + 1)),
    ("limit", "limit-increment-parent-count-limit", ("OVER_LIMIT", "MISMATCH"), "SS-IN-008 SS-LM-001",
     "parent_count is above the limit of every level",
     "elements", always,
     element("parent_count", 2 ** 24 + 1)),
    ("prediction", "prediction-increment-move-count-large", "MISMATCH", "SS-IN-006", "move_count is above parent_count",
     "elements", always,
     element("move_count", lambda u, w: u.parent_count + 1)),
    ("prediction", "prediction-increment-move-count", "MISMATCH", "SS-PA-003",
     "move_count and section moves are one less than the modes give",
     "elements", lambda u, w: u.move_count > 1,
     fewer_moves),
    ("prediction", "prediction-increment-remove-count", "MISMATCH", "SS-PA-003",
     "remove_count is one more than the modes give",
     "elements", lambda u, w: predicted(u, w) and u.remove_count < u.parent_count and w.v["modes"],
     element("remove_count", lambda u, w: u.remove_count + 1)),
    ("constraint", "constraint-increment-new-count", "MISMATCH", "SS-PA-006",
     "new_count is above gaussian_count of the frame_header",
     "elements", always,
     element("new_count", lambda u, w: w.frame.header.gaussian_count + 1)),
    ("limit", "limit-increment-new-count-limit", ("OVER_LIMIT", "MISMATCH"), "SS-IN-008 SS-LM-001",
     "new_count is above the limit of every level",
     "elements", always,
     element("new_count", 2 ** 24 + 1)),
    ("constraint", "constraint-increment-position-shift", "OUT_OF_RANGE", "SS-ER-001",
     "position_shift equals position_bits",
     "elements", always,
     element("position_shift", lambda u, w: w.seq.position_bits)),
    ("constraint", "constraint-increment-attribute-step", "OUT_OF_RANGE", "SS-ER-001", "attribute_step of sh is 25",
     "elements", always,
     element("attribute_step", 25, 4)),
    ("constraint", "constraint-increment-predictor-block", "OUT_OF_RANGE", "SS-ER-001", "predictor_block_log2 is 17",
     "elements", has_predictors,
     element("predictor_block_log2", 17)),
    ("constraint", "constraint-increment-neighbours-none", "OUT_OF_RANGE", "SS-ER-001", "neighbour_count is 0",
     "elements", has_predictors,
     element("neighbour_count", 0)),
    ("constraint", "constraint-increment-neighbours-many", "OUT_OF_RANGE", "SS-ER-001", "neighbour_count is 17",
     "elements", has_predictors,
     element("neighbour_count", 17)),
    ("constraint", "constraint-increment-sh-mode-reserved", "RESERVED", "SS-IN-010", "sh_mode is 3",
     "elements", always,
     element("sh_mode", 3)),
    ("constraint", "constraint-increment-sh-mode-without-transform", "OUT_OF_RANGE", "SS-IN-010",
     "sh_mode is 1 in a frame without sh transform",
     "elements", lambda u, w: w.context.sh_transform is None,
     element("sh_mode", 1)),
    ("constraint", "constraint-increment-stages-none", "OUT_OF_RANGE", "SS-IN-010 SS-ER-001",
     "vq_stage_count is 0 in sh_mode 2",
     "elements", vq,
     element("vq_stage_count", 0)),
    ("constraint", "constraint-increment-book-16", "OUT_OF_RANGE", "SS-IN-010", "the codebook of a stage is 16",
     "elements", vq,
     element("codebook_ids", 16, 0)),
    ("constraint", "constraint-increment-book-undefined", "UNDEFINED", "SS-IN-010",
     "the codebook of a stage is not defined",
     "elements", lambda u, w: vq(u, w) and undefined(u, w) is not None,
     element("codebook_ids", undefined, 0)),
    ("constraint", "constraint-increment-book-of-higher-layer", "CONSTRAINT", "SS-IN-010",
     "the codebook of a stage is of a higher temporal layer than the unit",
     "elements", lambda u, w: vq(u, w) and higher(u, w) is not None,
     element("codebook_ids", higher, 0)),
    ("constraint", "constraint-increment-book-of-other-rank", "MISMATCH", "SS-IN-010",
     "component_count of the codebook of a stage is not the rank of the transform",
     "elements", lambda u, w: vq(u, w) and wider(u, w) is not None,
     element("codebook_ids", wider, 0)),
    ("constraint", "constraint-increment-list-too-large", "MISMATCH", "SS-PA-006",
     "the lists of a P or B frame have one Gaussian more than gaussian_count",
     "size", lambda size, w: not w.frame.intra and w.r == w.seq.refinement_count - 1,
     lambda size, w: size + 1),
    ("constraint", "constraint-increment-share", "MISMATCH", "SS-PA-006",
     "a list of an I frame at its highest layer has one Gaussian less than its share",
     "size", lambda size,
     w: w.frame.intra and w.s == w.seq.top and size > (len(w.frame.lists[(w.s - 1, w.r)]) if w.s else 0),
     lambda size, w: size - 1),
    ("prediction", "prediction-increment-mode-5", "OUT_OF_RANGE", "SS-PA-002", "a mode is 5",
     "modes", always,
     entry(0, 5)),
    ("prediction", "prediction-increment-mode-negative", "OUT_OF_RANGE", "SS-PA-002", "a mode is -1",
     "modes", always,
     entry(0, -1, -1)),
    ("prediction", "prediction-increment-mode-remove-in-i-frame", "CONSTRAINT", "SS-PA-002",
     "a mode of an I frame is REMOVE",
     "modes", lambda v, w: w.frame.intra,
     entry(0, REMOVE)),
    ("prediction", "prediction-increment-move-out", "CONSTRAINT", "SS-PA-005", "a move ends below 0",
     "moves", small_grid,
     first_move_out),
    ("prediction", "prediction-frame-cell-twice", "CONSTRAINT", "SS-MO-001", "two cells have the same code",
     "cells", lambda v, w: len(v[0]) in range(2, 65),
     entry(0, 0, 1)),
    ("prediction", "prediction-frame-cell-out", "CONSTRAINT", "SS-MO-001",
     "the code of a cell is beyond the grid",
     "cells", lambda v, w: w.seq.position_bits < 20,
     entry(0, 2 ** 59, -1)),
    ("prediction", "prediction-frame-cell-stale-2", "OUT_OF_RANGE", "SS-MO-002", "stale is 2",
     "cells", always,
     entry(1, 2)),
    ("prediction", "prediction-frame-cell-rotation", "OUT_OF_RANGE", "SS-MO-002",
     "a component of the rotation of a cell is above 8192",
     "cells", always,
     entry(6, lambda x: x + (20000 if x >= 0 else -20000))),
    ("prediction", "prediction-increment-predictor-without-network", "UNDEFINED", "SS-PR-002",
     "a predictor is 3 in a GOP without network",
     "predictors", always,
     entry(0, 3, -1)),
    ("prediction", "prediction-increment-predictor-4", "OUT_OF_RANGE", "SS-PR-002", "a predictor is 4",
     "predictors", always,
     entry(0, 4)),
    ("prediction", "prediction-increment-predictor-negative", "OUT_OF_RANGE", "SS-PR-002", "a predictor is -1",
     "predictors", always,
     entry(0, -1, -1)),
    ("constraint", "constraint-increment-position-out", "CONSTRAINT", "SS-PO-001",
     "the code of a new Gaussian is beyond the grid",
     "new", lambda v, w: w.seq.position_bits < 20,
     entry(0, 2 ** 59 + 5, -1)),
    ("constraint", "constraint-increment-log-scale-out", "OUT_OF_RANGE", "SS-RC-001",
     "a log-scale of a new Gaussian is above 32767",
     "new", always,
     entry(1, 40000)),
    ("constraint", "constraint-increment-log-scale-rises", "CONSTRAINT", "SS-RC-002",
     "log-scales of an updated Gaussian increase, with canonical_axes",
     "updates", lambda v, w: w.seq.canonical_axes == 1,
     log_scales_rise),
    ("constraint", "constraint-increment-opacity-out", "OUT_OF_RANGE", "SS-RC-001", "an opacity is below -32768",
     "updates", always,
     entry(3, -40000)),
    ("constraint", "constraint-increment-rotation-out", "OUT_OF_RANGE", "SS-RC-003", "v_rotation is below -32768",
     "new", always,
     entry(6, -33000)),
    ("constraint", "constraint-increment-dc-component", "OUT_OF_RANGE", "SS-RC-005", "a dc component is above 8191",
     "new", always,
     entry(8, 8192)),
    ("constraint", "constraint-increment-dc-output", "OUT_OF_RANGE", "SS-RC-006", "dc of a new Gaussian is above 2^30",
     "new", dc_at_limit,
     full_dc),
    ("constraint", "constraint-increment-dc-component-multiplied", "OUT_OF_RANGE", "SS-RC-005",
     "a dc component is below -8191 after it was multiplied",
     "updates", lambda v, w: w.u.attribute_step[3] > 0,
     lambda v, w: entry(7, -(8191 // STEP[w.u.attribute_step[3]]) - 2)(v, w)),
    ("constraint", "constraint-increment-sh-index", "OUT_OF_RANGE", "SS-RC-005",
     "an index is not below the number of entries of its codebook",
     "new", lambda v, w: w.u.sh_mode == 2,
     entry(-1, 60000, -1)),
    ("prediction", "prediction-increment-models-long", "TRAILING_BYTES", "SS-PM-010", "models has a byte too many",
     "coded", of_increment,
     lambda coded, w: (coded[0] + b"\x00", coded[1])),
    ("prediction", "prediction-increment-models-short", "SHORT_SECTION", "SS-PM-010 SS-IN-011", "models has no bytes",
     "coded", lambda coded, w: of_increment(coded, w) and len(coded[0]) > 0,
     lambda coded, w: (b"", coded[1])),
    ("entropy", "entropy-increment-block-long", "TRAILING_BYTES", "SS-BL-003", "a block has a byte too many",
     "coded", of_increment,
     block_changed(lambda block: block + b"\x00")),
    ("entropy", "entropy-increment-block-short", "SHORT_SECTION", "SS-BL-001", "a block has four bytes",
     "coded", of_increment,
     block_changed(lambda block: block[:4])),
    ("entropy", "entropy-increment-block-state", "ENTROPY_FINAL_STATE", "SS-BL-002", "a state is below 65536",
     "coded", of_increment,
     block_changed(state_out)),
    ("entropy", "entropy-increment-lanes-6", "OUT_OF_RANGE", "SS-ER-001", "lanes_log2 of a section is 6",
     "lanes", always,
     lambda lanes_log2, w: 6),
    ("constraint", "constraint-increment-payload-long", "TRAILING_BYTES", "SS-ER-003 SS-IN-011",
     "a byte stands after the sections",
     "payload", always,
     lambda payload, w: payload + b"\x00"),
    ("constraint", "constraint-increment-payload-short", "SHORT_SECTION", "SS-ER-003",
     "the last byte of an increment is missing",
     "payload", lambda payload, w: bool(w.v["new"]),
     lambda payload, w: payload[:-1]),
    ("constraint", "constraint-increment-payload-cut", "SHORT_SECTION", "SS-ER-003",
     "the elements of an increment are cut",
     "payload", always,
     lambda payload, w: payload[:5]),
    ("limit", "limit-frame-cell-count", "OVER_LIMIT", "SS-FR-007 SS-LM-001", "cell_count is above the limit of the level",
     "frame", lambda u, w: u.cell_count > 0,
     element("cell_count", lambda u, w: MAX_CELLS[w.live.file_header.level] + 1)),
    ("limit", "limit-increment-new-count-for-bytes", ("OVER_LIMIT", "MISMATCH"), "SS-IN-009 SS-LM-001",
     "new_count is above 16 times payload_length",
     "elements", lambda u, w: w.frame.intra,
     element("new_count", 60000)),
    ("constraint", "constraint-frame-cells-models-long", "TRAILING_BYTES", "SS-PM-010 SS-FR-008",
     "models of the cells of a frame has a byte too many",
     "coded", of_cells,
     lambda coded, w: (coded[0] + b"\x00", coded[1])),
    ("entropy", "entropy-frame-cells-state", "ENTROPY_FINAL_STATE", "SS-BL-002 SS-FR-008",
     "a state of a block of the cells is below 65536",
     "coded", of_cells,
     block_changed(state_out)),
    ("constraint", "constraint-increment-remove-in-i-frame", ("MISMATCH", "CONSTRAINT"), "SS-IN-007 SS-PA-002",
     "remove_count is present in an I frame", "elements", lambda u, w: w.frame.intra and w.s > 0 and w.v["modes"],
     element("remove_count", 1)),
    ("constraint", "constraint-increment-multiplied-value", "OUT_OF_RANGE", "SS-RC-001",
     "the product of a v_log_scale with its factor is -40000, and the log-scale that it gives is within its range",
     "updates", always,
     entry(0, -20000)),
    ("constraint", "constraint-increment-update-rotation", "OUT_OF_RANGE", "SS-RC-003",
     "v_rotation of an update is -32769, and the rotation that it gives is within its range",
     "updates", always,
     entry(4, -32769)),
]


PARENTS = {"constraint-increment-sh-mode-without-transform": ALL_TOOLS[1][:2],
           "constraint-increment-dc-output": COLOURS, "constraint-increment-multiplied-value": LARGE,
           "constraint-increment-update-rotation": LARGE}


def codes_of(code):
    return code if isinstance(code, tuple) else (code,)


def rows():
    for area, name, code, requirements, fault, *change in FAULTS:
        parent, make = PARENTS.get(name, ALL_TOOLS[0][:2])
        yield Vector("invalid", area, name, None, requirements,
                     lambda data, code=code, change=change, make=make: remade(data, make, codes_of(code), *change),
                     "increments", 0, parent, fault, None if isinstance(code, tuple) else code,
                     code if isinstance(code, tuple) else ())
