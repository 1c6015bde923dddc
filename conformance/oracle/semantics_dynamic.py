"""Clauses 6.14 to 6.16: increments, their sections, and operating_points, in the order of 9.3 step 3."""

import constants as c
import syntax
from conventions import ceil_div
from errors import require
from semantics import in_range, one_of, reserved_zero, sh_elements
from syntax import Record

# SS-IN-007
SECTIONS = ("cells", "modes", "moves", "updates", "predictors", "new")


class Division:
    """A section of 5.15 divided into its parts."""

    def __init__(self, name, count, reader, block_log2):
        self.name, self.count = name, count
        at = reader.pos
        lanes_log2 = reader.value("u8", "5.15")
        require(lanes_log2 <= 5, "OUT_OF_RANGE", "6.15", at)
        self.lanes = 2 ** lanes_log2
        self.models_section = reader.section(reader.leb128("5.15"), "5.15")
        lengths = [reader.leb128("5.15") for _ in range(ceil_div(count, 2 ** block_log2))]
        self.block_sections = [reader.section(length, "5.15") for length in lengths]


def parse_increment(reader, unit, frame, context, level, parent_count):
    """The fixed part and the division into sections (6.14, 6.15).

    `frame` tells whether the frame is an I frame and has its header; `context` has the sequence, the
    transforms of the frame and the codebooks; parent_count is that of 7.14.2.
    """
    u = Record(syntax.INCREMENT_FIXED, reader)
    q = "6.14"
    seq, header = context.seq, frame.header
    in_range(u, "position_shift", 0, seq.position_bits - 1, q)
    in_range(u, "attribute_shift", 0, c.MAX_ATTRIBUTE_SHIFT, q)
    in_range(u, "cell_log2", 0, seq.position_bits, q)
    one_of(u, "predictor_block_log2", tuple(range(17)) + (c.NONE_ID,), q, "OUT_OF_RANGE")
    in_range(u, "neighbour_count", 1, c.MAX_NEIGHBOURS, q)
    sh_elements(u, q)
    # limits
    in_range(u, "parent_count", 0, c.MAX_GAUSSIANS[level], "A.2", "OVER_LIMIT")
    in_range(u, "cell_count", 0, c.MAX_CELLS, "A.2", "OVER_LIMIT")
    in_range(u, "new_count", 0, c.MAX_GAUSSIANS[level], "A.2", "OVER_LIMIT")
    # relations
    require(u.parent_count == parent_count, "MISMATCH", q, u.at("parent_count"))
    if frame.intra or unit.refinement > 0:
        in_range(u, "cell_count", 0, 0, q, "MISMATCH")
    for element in ("move_count", "update_count", "remove_count"):
        in_range(u, element, 0, u.parent_count, q, "MISMATCH")
    in_range(u, "new_count", 0, header.gaussian_count, q, "MISMATCH")
    if context.sh_transform is None:
        in_range(u, "sh_mode", 0, 0, q)
    for stage in range(u.vq_stage_count):
        book = context.codebooks.get(u.codebook_ids[stage])
        at = u.at("codebook_ids") + stage
        require(book is not None, "UNDEFINED", q, at)
        require(book.temporal_layer <= unit.temporal_layer, "CONSTRAINT", q, at)
        require(book.component_count == context.sh_transform.rank, "MISMATCH", q, at)
    u.sections = [Division(name, count, reader, seq.block_log2)
                  for name, count in section_counts(u) if count > 0]
    reader.check_end("5.14")
    return u


def section_counts(u):
    """The table of SS-IN-007: (section, count) in order."""
    if u.predictor_block_log2 == c.NONE_ID:
        predictor_count = 0
    else:
        predictor_count = ceil_div(u.new_count, 2 ** u.predictor_block_log2)
    return list(zip(SECTIONS, (u.cell_count, u.parent_count, u.move_count, u.update_count,
                               predictor_count, u.new_count)))


def parse_points(reader):
    """6.16 up to SS-PL-001; returns the entries."""
    q = "6.16"
    u = Record(syntax.POINTS_FIXED, reader)
    reserved_zero(u, "reserved_zero", q)
    require(24 * u.point_count <= reader.left(), "SHORT_SECTION", "5.16", reader.pos)
    entries = [Record(syntax.OPERATING_POINT, reader) for _ in range(u.point_count)]
    reader.check_end("5.16")
    before = None
    for entry in entries:
        in_range(entry, "spatial_layer", 0, c.MAX_LAYERS - 1, q)
        in_range(entry, "temporal_layer", 0, c.MAX_LAYERS - 1, q)
        in_range(entry, "refinement", 0, c.MAX_REFINEMENTS - 1, q)
        reserved_zero(entry, "reserved_zero", q)
        entry.point = (entry.spatial_layer, entry.temporal_layer, entry.refinement)
        require(before is None or before < entry.point, "CONSTRAINT", q, entry.at("spatial_layer"))
        before = entry.point
    return entries
