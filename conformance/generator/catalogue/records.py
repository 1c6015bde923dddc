"""Invalid vectors of transforms, codebooks and the elements of increments (6.7, 6.8, 6.14, 6.15)."""

from oracle import constants as c
from oracle.conventions import ByteReader
from ..faults import changed, cut, element, entry, invalid, kind, longer, payload, together

INTRA, VQ, DYNAMIC = "stream-several-gops", "codebook-two-stages", "temporal-gops-mixed"
FALLING, SH, CELLS = "refinement-ceiling", "colour-sh-degree-1", "cells-whole-grid"
TRANSFORM, BOOK, INCREMENT = kind(c.UT_TRANSFORM), kind(c.UT_CODEBOOK), kind(c.UT_INCREMENT)
LAST_INCREMENT = kind(c.UT_INCREMENT, nth=-1)


DEFINITIONS = [
    ("constraint-transform-id-16", INTRA, "OUT_OF_RANGE", "SS-ER-001", "transform_id is 16",
     element(TRANSFORM, "transform_id", 16)),
    ("constraint-transform-kind-2", INTRA, "RESERVED", "SS-TF-001", "transform_kind is 2",
     element(TRANSFORM, "transform_kind", 2)),
    ("constraint-transform-dimension", INTRA, "MISMATCH", "SS-TF-002", "dimension of a dc transform is 4",
     element(TRANSFORM, "dimension", 4)),
    ("constraint-transform-of-sh-in-degree-0", INTRA, "MISMATCH", "SS-TF-002",
     "a transform of kind 1 in a stream of sh_degree 0", element(TRANSFORM, "transform_kind", 1)),
    ("constraint-transform-rank-0", INTRA, "OUT_OF_RANGE", "SS-ER-001", "rank is 0", element(TRANSFORM, "rank", 0)),
    ("constraint-transform-rank-4", INTRA, "OUT_OF_RANGE", "SS-ER-001", "rank is above dimension",
     element(TRANSFORM, "rank", 4)),
    ("constraint-transform-twice", "stream-all-transforms", "CONSTRAINT", "SS-TF-003",
     "a transform_id is defined twice", element(kind(c.UT_TRANSFORM, nth=2), "transform_id", 0)),
    ("constraint-transform-mean", INTRA, "OUT_OF_RANGE", "SS-TF-004", "a mean is 2^30 + 1",
     payload(TRANSFORM, entry(8, "i", 2 ** 30 + 1))),
    ("constraint-transform-mean-low", INTRA, "OUT_OF_RANGE", "SS-TF-004", "a mean is -2^31",
     payload(TRANSFORM, entry(4, "i", -2 ** 31))),
    ("constraint-transform-basis", INTRA, "OUT_OF_RANGE", "SS-TF-004", "a coefficient is 4097",
     payload(TRANSFORM, entry(16, "h", 4097))),
    ("constraint-transform-basis-low", INTRA, "OUT_OF_RANGE", "SS-TF-004", "a coefficient is -4097",
     payload(TRANSFORM, entry(32, "h", -4097))),
    ("constraint-transform-short", INTRA, "SHORT_SECTION", "SS-ER-003", "a transform lacks its last byte",
     payload(TRANSFORM, cut(-1))),
    ("constraint-transform-long", INTRA, "TRAILING_BYTES", "SS-ER-003", "a transform has a byte too many",
     payload(TRANSFORM, longer)),
    ("constraint-codebook-id-16", VQ, "OUT_OF_RANGE", "SS-ER-001", "codebook_id is 16",
     element(BOOK, "codebook_id", 16)),
    ("constraint-codebook-components-0", VQ, "OUT_OF_RANGE", "SS-ER-001", "component_count is 0",
     element(BOOK, "component_count", 0)),
    ("constraint-codebook-components-46", VQ, "OUT_OF_RANGE", "SS-ER-001", "component_count is 46",
     element(BOOK, "component_count", 46)),
    ("constraint-codebook-value-bytes-0", VQ, "OUT_OF_RANGE", "SS-ER-001", "value_bytes is 0",
     element(BOOK, "value_bytes", 0)),
    ("constraint-codebook-value-bytes-3", VQ, "OUT_OF_RANGE", "SS-ER-001", "value_bytes is 3",
     element(BOOK, "value_bytes", 3)),
    ("constraint-codebook-short", VQ, "SHORT_SECTION", "SS-ER-003", "entries of a codebook are missing",
     payload(BOOK, cut(-1))),
    ("constraint-codebook-long", VQ, "TRAILING_BYTES", "SS-ER-003", "a codebook has a byte too many",
     payload(BOOK, longer)),
]
def rest(function, select=INCREMENT):
    """A change of what follows the elements of an increment: its sections."""
    def of_unit(u):
        elements = u.elements()
        elements.rest = function(elements.rest)
        return elements.bytes()
    return changed(select, payload=of_unit)


def stretched(data):
    """model_length of the first section with a byte more than it needs."""
    end = 1
    while data[end] > 127:
        end += 1
    return data[:end] + bytes([data[end] | 128, 0]) + data[end + 1:]


def lengthened(new):
    """model_length of the first section as other bytes."""
    return rest(lambda data: data[:1] + new + data[2:])


def block_lengths(new):
    """Other bytes after models of the first section."""
    def change(data):
        reader = ByteReader(data, 1, len(data))
        length = reader.leb128("5.15")
        return data[:reader.pos + length] + new
    return rest(change)


def flags(change, select=INCREMENT):
    """Other increment_flags, with the elements as they are."""
    return payload(select, lambda data: change(int.from_bytes(data[:2], "little")).to_bytes(2, "little") + data[2:])


INCREMENTS = [
    ("constraint-increment-count", INTRA, "MISMATCH", "SS-PA-006 SS-RU-001",
     "new_count of an I frame is one too large", element(INCREMENT, "new_count", lambda x: x + 1)),
    ("constraint-increment-floor", FALLING, "MISMATCH", "SS-PA-006 SS-RU-001",
     "new_count is the floor of the share", element(INCREMENT, "new_count", 10)),
    ("constraint-increment-none-new", INTRA, "MISMATCH", "SS-PA-006 SS-IN-001",
     "an increment of an I frame with Gaussians has flags 0", changed(INCREMENT, payload=lambda u: bytes(2) + u.payload[2:10])),
    ("constraint-increment-count-0", INTRA, "OUT_OF_RANGE", "SS-IN-001", "new_count is present and 0",
     element(INCREMENT, "new_count", 0)),
    ("constraint-increment-move-count-0", DYNAMIC, "OUT_OF_RANGE", "SS-IN-001", "move_count is present and 0",
     element(LAST_INCREMENT, "move_count", 0)),
    ("constraint-increment-parents-of-intra", INTRA, "MISMATCH", "SS-IN-005 SS-PA-001",
     "the increment of an I frame has a parent", element(INCREMENT, "parent_count", 1)),
    ("constraint-increment-flags-reserved", INTRA, "RESERVED_BITS", "SS-IN-002 SS-ER-002", "bit 12 of increment_flags is set",
     flags(lambda x: x | 1 << 12)),
    ("constraint-increment-flags-reserved-last", DYNAMIC, "RESERVED_BITS", "SS-IN-002",
     "bit 15 of increment_flags is set", flags(lambda x: x | 1 << 15, LAST_INCREMENT)),
    ("constraint-increment-predictors-in-profile-0", INTRA, "RESERVED", "SS-IN-004 SS-LM-003",
     "flag predictors in profile 0", element(INCREMENT, "predictor_block_log2", 0)),
    ("constraint-increment-predictors-without-new", "survivors-all-skip", "CONSTRAINT", "SS-IN-003",
     "flag predictors in an increment without new Gaussians", element(LAST_INCREMENT, "predictor_block_log2", 0)),
    ("constraint-increment-position-shift-of-intra", INTRA, "OUT_OF_RANGE", "SS-ER-001", "position_shift equals position_bits",
     element(INCREMENT, "position_shift", 10)),
    ("constraint-increment-lanes-of-intra", INTRA, "OUT_OF_RANGE", "SS-ER-001", "lanes_log2 is 6",
     rest(lambda data: b"\x06" + data[1:])),
    ("constraint-increment-sh-mode-0", INTRA, "OUT_OF_RANGE", "SS-IN-010 SS-IN-001", "sh_mode is present and 0",
     element(INCREMENT, "sh_mode", 0)),
    ("constraint-increment-sh-mode-3", SH, "RESERVED", "SS-IN-010", "sh_mode is 3", element(INCREMENT, "sh_mode", 3)),
    ("constraint-increment-sh-without-transform", "colour-sh-without-transform", "OUT_OF_RANGE", "SS-IN-010",
     "sh_mode is 1 in a frame without sh transform", element(INCREMENT, "sh_mode", 1)),
    ("constraint-increment-no-stages", VQ, "OUT_OF_RANGE", "SS-IN-010 SS-ER-001", "vq_stage_count is 0 in sh_mode 2",
     element(INCREMENT, "vq_stage_count", 0)),
    ("constraint-increment-five-stages", VQ, "OUT_OF_RANGE", "SS-ER-001", "vq_stage_count is 5",
     together(element(INCREMENT, "codebook_ids", [12, 3, 3, 3, 3], None), element(INCREMENT, "vq_stage_count", 5))),
    ("constraint-increment-book-16-of-intra", VQ, "OUT_OF_RANGE", "SS-IN-010", "the codebook of a stage is 16",
     element(INCREMENT, "codebook_ids", 16)),
    ("constraint-increment-book-undefined-in-intra", VQ, "UNDEFINED", "SS-IN-010", "the codebook of a stage is not defined",
     element(INCREMENT, "codebook_ids", 5)),
    ("constraint-increment-book-of-other-rank-in-intra", VQ, "MISMATCH", "SS-IN-010",
     "component_count of the codebook of a stage is not the rank of the transform",
     lambda head, units: element(BOOK, "component_count", 1)(head, payload(BOOK, cut(15))(head, units)[1])),
    ("constraint-increment-book-of-first-fault", VQ, ("OUT_OF_RANGE", "UNDEFINED"), "SS-IN-010 SS-ER-009",
     "the codebook of the first stage is not defined, and that of the second is 16",
     together(element(INCREMENT, "codebook_ids", 5), element(INCREMENT, "codebook_ids", 16, 1))),
    ("constraint-increment-digest-and-lanes", INTRA, ("OUT_OF_RANGE", "MISMATCH"), "SS-IN-012 SS-PA-006 SS-ER-009",
     "new_count is one too large, and lanes_log2 is 6",
     together(element(INCREMENT, "new_count", lambda x: x + 1), rest(lambda data: b"\x06" + data[1:]))),
    ("constraint-increment-sections-without-gaussians", "stream-empty-frame", "TRAILING_BYTES", "SS-IN-011 SS-ER-003",
     "a section follows the elements of an increment without Gaussians",
     payload(INCREMENT, lambda data: data + b"\x00\x00")),
    ("bytes-increment-empty", INTRA, "SHORT_SECTION", "SS-ER-003", "an increment has no payload", payload(INCREMENT, cut(0))),
    ("bytes-increment-flags-cut", INTRA, "SHORT_SECTION", "SS-ER-003", "the payload of an increment is one byte",
     payload(INCREMENT, cut(1))),
    ("bytes-increment-digest-cut", INTRA, "SHORT_SECTION", "SS-ER-003", "an increment ends in its refinement_digest",
     payload(INCREMENT, cut(9))),
    ("bytes-increment-count-missing", INTRA, "SHORT_SECTION", "SS-ER-003", "an increment ends before new_count",
     payload(INCREMENT, cut(10))),
    ("bytes-increment-step-cut", "refinement-attribute-steps", "SHORT_SECTION", "SS-ER-003",
     "an increment ends in its attribute_step", changed(INCREMENT, payload=lambda u: u.payload[:13])),
    ("bytes-increment-books-cut", VQ, "SHORT_SECTION", "SS-ER-003", "an increment ends in its codebook_ids",
     changed(INCREMENT, payload=lambda u: u.payload[:u.elements().length() - 1])),
    ("bytes-increment-sections-missing", INTRA, "SHORT_SECTION", "SS-ER-003 SS-IN-011", "an increment ends after its elements",
     rest(lambda data: b"")),
    ("bytes-increment-models-cut", INTRA, "SHORT_SECTION", "SS-ER-003", "models of an increment is cut",
     rest(lambda data: data[:12])),
    ("bytes-increment-block-cut", INTRA, "SHORT_SECTION", "SS-ER-003", "the block of an increment lacks its last byte",
     payload(INCREMENT, cut(-1))),
    ("bytes-increment-long", INTRA, "TRAILING_BYTES", "SS-ER-003", "a byte stands after the blocks", payload(INCREMENT, longer)),
    ("bytes-count-not-shortest", INTRA, "NUMBER", "SS-ER-003", "new_count is not in its shortest form",
     payload(INCREMENT, lambda data: data[:10] + bytes([data[10] | 128, 0]) + data[11:])),
    ("bytes-count-above-32-bits", INTRA, "NUMBER", "SS-ER-003", "the fifth byte of new_count is 16",
     payload(INCREMENT, lambda data: data[:10] + b"\xff\xff\xff\xff\x10" + data[11:])),
    ("bytes-cell-count-not-shortest", CELLS, "NUMBER", "SS-ER-003 SS-FR-007", "cell_count is not in its shortest form",
     changed(kind(c.UT_FRAME, nth=-1), payload=lambda u: stretched_cells(u))),
    ("bytes-length-not-shortest", INTRA, "NUMBER", "SS-ER-003", "model_length is not in its shortest form", rest(stretched)),
    ("bytes-length-of-six-bytes", INTRA, "NUMBER", "SS-ER-003", "model_length has more than 32 bits",
     lengthened(b"\xff" * 5 + b"\x01")),
    ("bytes-length-above-32-bits", INTRA, "NUMBER", "SS-ER-003", "the fifth byte of model_length is 16",
     lengthened(b"\xff\xff\xff\xff\x10")),
    ("bytes-block-length-not-shortest", "stream-one-block", "NUMBER", "SS-ER-003",
     "block_length is not in its shortest form", block_lengths(b"\x81\x00")),
    ("bytes-block-lengths-run-out", "attribute-parent-of-faults", "SHORT_SECTION", "SS-ER-003",
     "two blocks and two bytes, which are those of one block_length", block_lengths(b"\x81\x01")),
]


def stretched_cells(u):
    at = u.elements().length() - 2
    return u.payload[:at] + bytes([u.payload[at] | 128, 0]) + u.payload[at + 1:]


def rows():
    yield from invalid("constraint", "records", DEFINITIONS)
    for area in ("constraint", "bytes"):
        yield from invalid(area, "records", [row for row in INCREMENTS if row[0].startswith(area)])
