"""Invalid vectors of records: sequence_parameters, gop_header, frame_header, transform, codebook, refinement, index,
end, operating_points (clauses 6.4 to 6.11, 6.16)."""

import struct

import oracle_path  # noqa: F401
import constants as c
from conventions import ByteReader
from faults import element, invalid, kept_end, kind, payload, together

INTRA, VQ, DYNAMIC = "stream-several-gops", "codebook-two-stages", "temporal-gops-mixed"
FALLING, BOOKS, SH = "refinement-ceiling", "codebook-defined-again", "colour-sh-degree-1"
INFINITY, NAN = float("inf"), float("nan")

PARAMETERS, GOP, FRAME = kind(c.UT_SEQUENCE), kind(c.UT_GOP), kind(c.UT_FRAME)
TRANSFORM, BOOK, REFINED = kind(c.UT_TRANSFORM), kind(c.UT_CODEBOOK), kind(c.UT_REFINEMENT)
POINTS, INDEX, END = kind(c.UT_POINTS), kind(c.UT_INDEX), kind(c.UT_END)
LAST_GOP = kind(c.UT_GOP, nth=-1)


def entry(at, kind_of_value, value):
    """An element of an entry of the variable part, by its offset in the payload."""
    def change(data):
        old = struct.unpack_from("<" + kind_of_value, data, at)[0]
        new = struct.pack("<" + kind_of_value, value(old) if callable(value) else value)
        return data[:at] + new + data[at + len(new):]
    return change


def cut(size):
    return lambda data: data[:size]


def longer(data):
    return data + b"\x00"


def stretched(data):
    """model_length with a byte more than it needs."""
    end = 20
    while data[end] > 127:
        end += 1
    return data[:end] + bytes([data[end] | 128, 0]) + data[end + 1:]


def block_lengths(new):
    """Other bytes behind models of a refinement unit."""
    def change(data):
        reader = ByteReader(data, 20, len(data))
        length = reader.leb128("5.9")
        return data[:reader.pos + length] + new
    return payload(REFINED, change)


def percent(*values):
    return payload(PARAMETERS, lambda data: data[:4] + bytes(values) + bytes(10 - len(values)) + data[14:])


def f32(name, value, place=0):
    return element(PARAMETERS, name, value, place)


SEQUENCE = [
    ("stream-sh-degree-4", INTRA, "OUT_OF_RANGE", "SS-ER-001", "sh_degree is 4", element(PARAMETERS, "sh_degree", 4)),
    ("stream-two-spatial-layers-in-profile-0", INTRA, "OUT_OF_RANGE", "SS-ER-001",
     "spatial_layer_count is 2 in profile 0", element(PARAMETERS, "spatial_layer_count", 2)),
    ("stream-two-temporal-layers-in-profile-0", INTRA, "OUT_OF_RANGE", "SS-ER-001",
     "temporal_layer_count is 2 in profile 0", element(PARAMETERS, "temporal_layer_count", 2)),
    ("stream-no-spatial-layers", DYNAMIC, "OUT_OF_RANGE", "SS-ER-001", "spatial_layer_count is 0",
     element(PARAMETERS, "spatial_layer_count", 0)),
    ("stream-five-spatial-layers", DYNAMIC, "OUT_OF_RANGE", "SS-ER-001", "spatial_layer_count is 5",
     element(PARAMETERS, "spatial_layer_count", 5)),
    ("stream-five-temporal-layers", DYNAMIC, "OUT_OF_RANGE", "SS-ER-001", "temporal_layer_count is 5",
     element(PARAMETERS, "temporal_layer_count", 5)),
    ("stream-no-refinements", INTRA, "OUT_OF_RANGE", "SS-ER-001", "refinement_count is 0",
     element(PARAMETERS, "refinement_count", 0)),
    ("stream-eleven-refinements", INTRA, "OUT_OF_RANGE", "SS-ER-001", "refinement_count is 11",
     element(PARAMETERS, "refinement_count", 11)),
    ("stream-percent-0", FALLING, "OUT_OF_RANGE", "SS-SP-001", "the first percentage is 0",
     percent(0, 20, 30, 50, 100)),
    ("stream-percent-equal", FALLING, "OUT_OF_RANGE", "SS-SP-001", "two percentages are equal",
     percent(10, 20, 20, 50, 100)),
    ("stream-percent-falls", FALLING, "OUT_OF_RANGE", "SS-SP-001", "a percentage is below the one before",
     percent(10, 30, 20, 50, 100)),
    ("stream-percent-99", FALLING, "OUT_OF_RANGE", "SS-SP-001", "the last percentage is 99",
     percent(10, 20, 30, 50, 99)),
    ("stream-percent-101", FALLING, "OUT_OF_RANGE", "SS-SP-001", "the last percentage is 101",
     percent(10, 20, 30, 50, 101)),
    ("stream-percent-too-many", FALLING, "OUT_OF_RANGE", "SS-SP-001", "a percentage stands beyond refinement_count",
     percent(10, 20, 30, 50, 100, 100)),
    ("stream-position-bits-0", INTRA, "OUT_OF_RANGE", "SS-ER-001", "position_bits is 0",
     element(PARAMETERS, "position_bits", 0)),
    ("stream-position-bits-21", INTRA, "OUT_OF_RANGE", "SS-ER-001", "position_bits is 21",
     element(PARAMETERS, "position_bits", 21)),
    ("stream-block-log2-5", INTRA, "OUT_OF_RANGE", "SS-ER-001", "block_log2 is 5",
     element(PARAMETERS, "block_log2", 5)),
    ("stream-block-log2-17", INTRA, "OUT_OF_RANGE", "SS-ER-001", "block_log2 is 17",
     element(PARAMETERS, "block_log2", 17)),
    ("stream-flags-4", INTRA, "RESERVED_BITS", "SS-ER-002", "bit 2 of sequence_flags is set",
     element(PARAMETERS, "sequence_flags", 4)),
    ("stream-thresholds-rise", INTRA, "OUT_OF_RANGE", "SS-SP-002", "rotation_threshold increases",
     element(PARAMETERS, "rotation_threshold", 1, 2)),
    ("stream-no-ticks", INTRA, "OUT_OF_RANGE", "SS-ER-001", "ticks_per_second is 0",
     element(PARAMETERS, "ticks_per_second", 0)),
    ("stream-step-0", INTRA, "CONSTRAINT", "SS-SP-003", "position_step is 0", f32("position_step", 0.0)),
    ("stream-step-negative", INTRA, "CONSTRAINT", "SS-SP-003", "log_scale_step is negative",
     f32("log_scale_step", -0.01)),
    ("stream-step-below", INTRA, "CONSTRAINT", "SS-SP-003", "opacity_step is below 2^-40",
     f32("opacity_step", 2.0 ** -41)),
    ("stream-step-above", INTRA, "CONSTRAINT", "SS-SP-003", "dc_step is above 2^20", f32("dc_step", 2.0 ** 20 + 1)),
    ("stream-rotation-step-above-1", INTRA, "CONSTRAINT", "SS-SP-003", "rotation_step is above 1",
     f32("rotation_step", 1.0000001192092896)),
    ("stream-step-subnormal", INTRA, "CONSTRAINT", "SS-SP-003", "sh_step is a subnormal number", f32("sh_step", 1e-40)),
    ("stream-offset-infinite", INTRA, "CONSTRAINT", "SS-SP-003", "position_offset[2] is infinite",
     f32("position_offset", INFINITY, 2)),
    ("stream-offset-nan", INTRA, "CONSTRAINT", "SS-SP-003", "opacity_offset is not a number",
     f32("opacity_offset", NAN)),
    ("stream-offset-far", INTRA, "CONSTRAINT", "SS-SP-003", "log_scale_offset is below -2^40",
     f32("log_scale_offset", -2.0 ** 41)),
    ("stream-parameters-short", INTRA, "SHORT_SECTION", "SS-ER-003", "sequence_parameters lacks its last byte",
     payload(PARAMETERS, cut(-1))),
    ("stream-parameters-long", INTRA, "TRAILING_BYTES", "SS-ER-003", "sequence_parameters has a byte too many",
     payload(PARAMETERS, longer)),
    ("stream-parameters-change", "stream-parameters-repeated", "CONSTRAINT", "SS-SP-004",
     "a copy of sequence_parameters has another ticks_per_frame",
     element(kind(c.UT_SEQUENCE, nth=3), "ticks_per_frame", 2)),
    ("stream-frame-count-wrong", "stream-frame-count-known", "MISMATCH", "SS-SP-005",
     "frame_count of sequence_parameters is one too large", element(PARAMETERS, "frame_count", 4)),
]
GOPS = [
    ("stream-gop-index", INTRA, "MISMATCH", "SS-GH-001", "gop_index of the second GOP is 2",
     element(kind(c.UT_GOP, nth=1), "gop_index", 2)),
    ("stream-gop-without-frames", INTRA, "OUT_OF_RANGE", "SS-ER-001", "gop_frame_count is 0",
     element(GOP, "gop_frame_count", 0)),
    ("stream-gop-too-many-frames", INTRA, "OUT_OF_RANGE", "SS-GH-003", "the display indices of a GOP go beyond 2^32",
     element(LAST_GOP, "gop_frame_count", 2 ** 32 - 1)),
    ("stream-gop-predicted-in-profile-0", INTRA, "RESERVED", "SS-GH-002", "gop_structure is 1 in profile 0",
     element(GOP, "gop_structure", 1)),
    ("stream-gop-structure-2", DYNAMIC, "RESERVED", "SS-GH-002", "gop_structure is 2",
     element(GOP, "gop_structure", 2)),
    ("stream-gop-depth-in-profile-0", INTRA, "RESERVED_BITS", "SS-GH-006 SS-ER-002",
     "temporal_depth is 1 in profile 0", element(GOP, "temporal_depth", 1)),
    ("stream-gop-depth-in-all-intra", DYNAMIC, "OUT_OF_RANGE", "SS-GH-006", "temporal_depth is 1 in an all-intra GOP",
     element(kind(c.UT_GOP, nth=1), "temporal_depth", 1)),
    ("stream-gop-depth-4", DYNAMIC, "OUT_OF_RANGE", "SS-GH-006", "temporal_depth is 4",
     element(GOP, "temporal_depth", 4)),
    ("stream-gop-depth-above-layers", DYNAMIC, "OUT_OF_RANGE", "SS-GH-006",
     "temporal_depth is 3 with three temporal layers", element(GOP, "temporal_depth", 3)),
    ("stream-gop-reserved", DYNAMIC, "RESERVED_BITS", "SS-ER-002", "reserved_zero of a gop_header is not 0",
     element(GOP, "reserved_zero", 1, 1)),
    ("stream-gop-1025-frames", "temporal-gop-of-1024", "OUT_OF_RANGE", "SS-GH-005",
     "gop_frame_count of a predicted GOP is 1025", element(GOP, "gop_frame_count", 1025)),
    ("stream-gop-short", INTRA, "SHORT_SECTION", "SS-ER-003", "a gop_header lacks its last byte",
     payload(GOP, cut(-1))),
    ("stream-gop-long", INTRA, "TRAILING_BYTES", "SS-ER-003", "a gop_header has a byte too many", payload(GOP, longer)),
]
FRAMES = [
    ("stream-frame-type-in-profile-0", INTRA, "RESERVED", "SS-FR-001", "frame_type is 1 in profile 0",
     element(FRAME, "frame_type", 1)),
    ("stream-frame-type-3", DYNAMIC, "RESERVED", "SS-FR-001", "frame_type is 3", element(FRAME, "frame_type", 3)),
    ("stream-frame-type-other", DYNAMIC, "MISMATCH", "SS-FR-004", "frame_type of a P frame is that of a B frame",
     element(kind(c.UT_FRAME, nth=-1), "frame_type", lambda x: 3 - x)),
    ("stream-frame-transform-16", INTRA, "OUT_OF_RANGE", "SS-ER-001", "dc_transform_id is 16",
     element(FRAME, "dc_transform_id", 16)),
    ("stream-frame-sh-transform-16", SH, "OUT_OF_RANGE", "SS-ER-001", "sh_transform_id is 16",
     element(FRAME, "sh_transform_id", 16)),
    ("stream-frame-transform-before-bytes-left", INTRA, "UNDEFINED", "SS-ER-006 SS-FR-002",
     "dc_transform_id names no transform, and a byte stands behind the elements of the frame_header",
     together(element(FRAME, "dc_transform_id", 5), payload(FRAME, longer))),
    ("stream-gop-index-before-bytes-left", INTRA, "MISMATCH", "SS-ER-006 SS-GH-001",
     "gop_index of the first GOP is 1, and a byte stands behind the elements of the gop_header",
     together(element(GOP, "gop_index", 1), payload(GOP, longer))),
    ("stream-frame-transform-undefined", INTRA, "UNDEFINED", "SS-FR-002", "dc_transform_id names no transform",
     element(FRAME, "dc_transform_id", 5)),
    ("stream-frame-sh-transform-undefined", SH, "UNDEFINED", "SS-FR-002",
     "sh_transform_id names no transform, though there is a dc transform with the identifier",
     element(FRAME, "sh_transform_id", 0)),
    ("stream-empty-frame-transform-undefined", "stream-empty-frame", "UNDEFINED", "SS-FR-002",
     "a frame without Gaussians names no transform", element(FRAME, "dc_transform_id", 15)),
    ("stream-frame-reserved", INTRA, "RESERVED_BITS", "SS-ER-002", "reserved_zero of a frame_header is not 0",
     element(FRAME, "reserved_zero", 128)),
    ("stream-frame-short", INTRA, "SHORT_SECTION", "SS-ER-003", "a frame_header lacks its last byte",
     payload(FRAME, cut(-1))),
    ("stream-frame-long", INTRA, "TRAILING_BYTES", "SS-ER-003", "a frame_header has a byte too many",
     payload(FRAME, longer)),
]
LISTS = [
    ("stream-index-count", INTRA, "MISMATCH", "SS-IX-001", "entry_count of the index is one too large",
     kept_end(element(INDEX, "entry_count", 4))),
    ("stream-index-short", INTRA, "SHORT_SECTION", "SS-ER-003 SS-IX-001", "the last entry of the index is cut",
     kept_end(payload(INDEX, cut(-1)))),
    ("stream-index-long", INTRA, "TRAILING_BYTES", "SS-ER-003", "a byte stands after the index",
     kept_end(payload(INDEX, longer))),
    ("stream-index-reserved", INTRA, "RESERVED_BITS", "SS-ER-002", "reserved_zero of an entry of the index is not 0",
     kept_end(payload(INDEX, entry(8, "I", 1)))),
    ("stream-index-frame", INTRA, "MISMATCH", "SS-IX-001", "frame of the second entry of the index is wrong",
     kept_end(payload(INDEX, entry(20, "I", lambda x: x + 1)))),
    ("stream-index-offset", INTRA, "MISMATCH", "SS-IX-001",
     "an offset of the index is that of the payload, not of the unit",
     kept_end(payload(INDEX, entry(12, "Q", lambda x: x + 20)))),
    ("stream-end-frames", INTRA, "MISMATCH", "SS-EN-001", "frame_count of the end unit is wrong",
     kept_end(element(END, "frame_count", 5))),
    ("stream-end-units", INTRA, "MISMATCH", "SS-EN-001", "unit_count counts the end unit",
     kept_end(element(END, "unit_count", lambda x: x + 1))),
    ("stream-end-index-offset", INTRA, "MISMATCH", "SS-EN-001", "index_offset is wrong",
     kept_end(element(END, "index_offset", lambda x: x + 1))),
    ("stream-end-index-offset-0", INTRA, "MISMATCH", "SS-EN-001", "index_offset is 0 though there is an index",
     kept_end(element(END, "index_offset", 0))),
    ("stream-end-index-none", "stream-without-index", "MISMATCH", "SS-EN-001",
     "index_offset is not 0 though there is no index", kept_end(element(END, "index_offset", 16))),
    ("stream-end-short", INTRA, "SHORT_SECTION", "SS-ER-003", "the end unit lacks its last byte",
     kept_end(payload(END, cut(-1)))),
    ("stream-end-long", INTRA, "TRAILING_BYTES", "SS-ER-003", "the end unit has a byte too many",
     kept_end(payload(END, longer))),
    ("stream-end-count-before-bytes-left", INTRA, "MISMATCH", "SS-ER-006 SS-EN-001",
     "unit_count is one more than there are units, and a byte stands behind the end unit's elements",
     kept_end(together(element(END, "unit_count", lambda x: x + 1), payload(END, longer)))),
    ("stream-points-reserved", INTRA, "RESERVED_BITS", "SS-ER-002", "reserved_zero of operating_points is not 0",
     payload(POINTS, entry(2, "H", 1))),
    ("stream-points-entry-reserved", INTRA, "RESERVED_BITS", "SS-ER-002",
     "reserved_zero of an operating point is not 0", payload(POINTS, entry(7, "B", 1))),
    ("stream-points-short", INTRA, "SHORT_SECTION", "SS-ER-003", "point_count is one too large",
     element(POINTS, "point_count", lambda x: x + 1)),
    ("stream-points-long", INTRA, "TRAILING_BYTES", "SS-ER-003", "a byte stands after the entries of operating_points",
     payload(POINTS, longer)),
    ("stream-points-spatial-layer-4", DYNAMIC, "OUT_OF_RANGE", "SS-ER-001", "spatial_layer of an operating point is 4",
     payload(POINTS, entry(4, "B", 4))),
    ("stream-points-temporal-layer-4", DYNAMIC, "OUT_OF_RANGE", "SS-ER-001",
     "temporal_layer of an operating point is 4", payload(POINTS, entry(5, "B", 4))),
    ("stream-points-refinement-10", DYNAMIC, "OUT_OF_RANGE", "SS-ER-001", "refinement of an operating point is 10",
     payload(POINTS, entry(6, "B", 10))),
    ("stream-points-order", DYNAMIC, "CONSTRAINT", "SS-PL-001", "two operating points are exchanged",
     payload(POINTS, lambda data: data[:4] + data[28:52] + data[4:28] + data[52:])),
    ("stream-points-twice", DYNAMIC, "CONSTRAINT", "SS-PL-001", "an operating point stands twice",
     payload(POINTS, lambda data: data[:4] + data[4:28] * 2 + data[52:])),
    ("stream-points-frames", DYNAMIC, "MISMATCH", "SS-PL-002", "frame_count of an operating point is wrong",
     payload(POINTS, entry(8, "I", lambda x: x + 1))),
    ("stream-points-gaussians", DYNAMIC, "MISMATCH", "SS-PL-002", "gaussian_count of an operating point is wrong",
     payload(POINTS, entry(12, "Q", lambda x: x + 1))),
    ("stream-points-bytes", DYNAMIC, "MISMATCH", "SS-PL-002", "byte_count of an operating point is wrong",
     payload(POINTS, entry(20, "Q", lambda x: x + 20))),
    ("stream-points-gaussians-of-intra", FALLING, "MISMATCH", "SS-PL-002",
     "gaussian_count of an operating point of profile 0 is wrong", payload(POINTS, entry(12, "Q", lambda x: x + 1))),
]
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
    ("constraint-codebook-twice", VQ, "CONSTRAINT", "SS-CB-001", "a codebook_id is defined twice in profile 0",
     element(BOOK, "codebook_id", 12)),
    ("constraint-codebook-short", VQ, "SHORT_SECTION", "SS-ER-003", "entries of a codebook are missing",
     payload(BOOK, cut(-1))),
    ("constraint-codebook-long", VQ, "TRAILING_BYTES", "SS-ER-003", "a codebook has a byte too many",
     payload(BOOK, longer)),
]
REFINEMENTS = [
    ("constraint-refinement-count", INTRA, "MISMATCH", "SS-RU-001 SS-RU-006",
     "gaussian_count of a refinement unit is one too large", element(REFINED, "gaussian_count", lambda x: x + 1)),
    ("constraint-refinement-floor", FALLING, "MISMATCH", "SS-RU-001 SS-RU-006",
     "gaussian_count is the floor of the share", element(REFINED, "gaussian_count", 10)),
    ("constraint-refinement-position-shift", INTRA, "OUT_OF_RANGE", "SS-ER-001", "position_shift equals position_bits",
     element(REFINED, "position_shift", 10)),
    ("constraint-refinement-lanes", INTRA, "OUT_OF_RANGE", "SS-ER-001", "lanes_log2 is 6",
     element(REFINED, "lanes_log2", 6)),
    ("constraint-refinement-sh-mode-3", SH, "RESERVED", "SS-RU-003", "sh_mode is 3", element(REFINED, "sh_mode", 3)),
    ("constraint-refinement-sh-without-transform", "colour-sh-without-transform", "OUT_OF_RANGE", "SS-RU-003",
     "sh_mode is 1 in a frame without sh transform", element(REFINED, "sh_mode", 1)),
    ("constraint-refinement-no-stages", VQ, "OUT_OF_RANGE", "SS-RU-004 SS-ER-001", "vq_stage_count is 0 in sh_mode 2",
     element(REFINED, "vq_stage_count", 0)),
    ("constraint-refinement-five-stages", VQ, "OUT_OF_RANGE", "SS-ER-001", "vq_stage_count is 5",
     element(REFINED, "vq_stage_count", 5)),
    ("constraint-refinement-stages-without-vq", SH, "OUT_OF_RANGE", "SS-ER-001", "vq_stage_count is 1 in sh_mode 1",
     element(REFINED, "vq_stage_count", 1)),
    ("constraint-refinement-book-16", VQ, "OUT_OF_RANGE", "SS-RU-004", "the codebook of a stage is 16",
     element(REFINED, "codebook_ids", 16)),
    ("constraint-refinement-book-too-many", VQ, "OUT_OF_RANGE", "SS-RU-004",
     "a codebook stands in a place without stage", element(REFINED, "codebook_ids", 0, 3)),
    ("constraint-refinement-book-undefined", VQ, "UNDEFINED", "SS-RU-004", "the codebook of a stage is not defined",
     element(REFINED, "codebook_ids", 5)),
    ("constraint-refinement-book-of-other-rank", VQ, "MISMATCH", "SS-RU-004",
     "component_count of the codebook of a stage is not the rank of the transform",
     lambda head, units: element(BOOK, "component_count", 1)(head, payload(BOOK, cut(15))(head, units)[1])),
    ("constraint-refinement-models-without-gaussians", "stream-empty-frame", "MISMATCH", "SS-RU-002",
     "model_length is 1 in a unit without Gaussians",
     payload(REFINED, lambda data: data[:-1] + b"\x01\x00")),
    ("constraint-refinement-short", INTRA, "SHORT_SECTION", "SS-ER-003", "the fixed part of a refinement unit is cut",
     payload(REFINED, cut(19))),
    ("constraint-refinement-models-cut", INTRA, "SHORT_SECTION", "SS-ER-003", "models of a refinement unit is cut",
     payload(REFINED, cut(30))),
    ("constraint-refinement-block-cut", INTRA, "SHORT_SECTION", "SS-ER-003",
     "the block of a refinement unit lacks its last byte", payload(REFINED, cut(-1))),
    ("constraint-refinement-long", INTRA, "TRAILING_BYTES", "SS-ER-003", "a byte stands after the blocks",
     payload(REFINED, longer)),
    ("bytes-length-not-shortest", INTRA, "NUMBER", "SS-ER-003",
     "model_length of a refinement unit is not in its shortest form",
     payload(REFINED, stretched)),
    ("bytes-length-of-six-bytes", INTRA, "NUMBER", "SS-ER-003", "model_length has more than 32 bits",
     payload(REFINED, lambda data: data[:20] + b"\xff" * 5 + b"\x01" + data[21:])),
    ("bytes-block-length-not-shortest", "stream-one-block", "NUMBER", "SS-ER-003",
     "block_length is not in its shortest form", block_lengths(b"\x81\x00")),
    ("bytes-block-lengths-run-out", "attribute-parent-of-faults", "SHORT_SECTION", "SS-ER-003",
     "two blocks and two bytes, which are those of one block_length", block_lengths(b"\x81\x01")),
    ("bytes-length-above-32-bits", INTRA, "NUMBER", "SS-ER-003", "the fifth byte of model_length is 16",
     payload(REFINED, lambda data: data[:20] + b"\xff\xff\xff\xff\x10" + data[21:])),
]


def rows():
    for table in (SEQUENCE, GOPS, FRAMES, LISTS):
        yield from invalid("stream", "records", table)
    yield from invalid("constraint", "records", DEFINITIONS + REFINEMENTS[:-5])
    yield from invalid("bytes", "records", REFINEMENTS[-5:])
