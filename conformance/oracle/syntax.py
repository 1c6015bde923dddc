"""Clause 5: the tables of the records, as data, and the reader of a fixed part.

A row is (element, type, number of values, clause). Elements of the variable part are read in semantics.py,
in the order of the tables of clause 5.
"""

FILE_HEADER = [
    ("signature", "u8", 8, "6.2"),
    ("version_major", "u8", 1, "6.2"),
    ("version_minor", "u8", 1, "6.2"),
    ("profile", "u8", 1, "6.2"),
    ("level", "u8", 1, "6.2"),
    ("header_crc", "u32", 1, "6.2"),
]

UNIT_HEADER = [
    ("unit_type", "u8", 1, "6.3"),
    ("unit_flags", "u8", 1, "6.3"),
    ("spatial_layer", "u8", 1, "6.3"),
    ("temporal_layer", "u8", 1, "6.3"),
    ("refinement", "u8", 1, "6.3"),
    ("reserved_zero", "u8", 1, "6.3"),
    ("header_check", "u16", 1, "6.3"),
    ("frame", "u32", 1, "6.3"),
    ("payload_length", "u32", 1, "6.3"),
    ("payload_crc", "u32", 1, "6.3"),
]

SEQUENCE_PARAMETERS = [
    ("sh_degree", "u8", 1, "6.4"),
    ("spatial_layer_count", "u8", 1, "6.4"),
    ("temporal_layer_count", "u8", 1, "6.4"),
    ("refinement_count", "u8", 1, "6.4"),
    ("refinement_percent", "u8", 10, "6.4"),
    ("position_bits", "u8", 1, "6.4"),
    ("block_log2", "u8", 1, "6.4"),
    ("sequence_flags", "u8", 1, "6.4"),
    ("linear_log2", "u8", 1, "6.4"),
    ("segment_log2", "u8", 1, "6.4"),
    ("feature_shift", "u8", 1, "6.4"),
    ("size_weight", "u16", 5, "6.4"),
    ("opacity_weight", "u16", 3, "6.4"),
    ("anisotropy_weight", "u16", 1, "6.4"),
    ("size_reference", "i32", 1, "6.4"),
    ("opacity_reference", "i32", 1, "6.4"),
    ("anisotropy_reference", "i32", 1, "6.4"),
    ("frame_count", "u32", 1, "6.4"),
    ("ticks_per_second", "u32", 1, "6.4"),
    ("ticks_per_frame", "u32", 1, "6.4"),
    ("position_offset", "f32", 3, "6.4"),
    ("position_step", "f32", 1, "6.4"),
    ("log_scale_offset", "f32", 1, "6.4"),
    ("log_scale_step", "f32", 1, "6.4"),
    ("rotation_step", "f32", 1, "6.4"),
    ("opacity_offset", "f32", 1, "6.4"),
    ("opacity_step", "f32", 1, "6.4"),
    ("dc_step", "f32", 1, "6.4"),
    ("sh_step", "f32", 1, "6.4"),
]

GOP_HEADER = [
    ("gop_index", "u32", 1, "6.5"),
    ("gop_frame_count", "u32", 1, "6.5"),
    ("gop_structure", "u8", 1, "6.5"),
    ("temporal_depth", "u8", 1, "6.5"),
    ("reserved_zero", "u8", 2, "6.5"),
]

# 5.6; then the parts whose bits of frame_flags are set, the section of the cells last
FRAME_HEADER = [
    ("frame_type", "u8", 1, "6.6"),
    ("dc_transform_id", "u8", 1, "6.6"),
    ("sh_transform_id", "u8", 1, "6.6"),
    ("frame_flags", "u8", 1, "6.6"),
    ("gaussian_count", "u32", 1, "6.6"),
]
FRAME_CARRIED_DIGEST = [("carried_digest", "u64", 1, "6.6")]
FRAME_CELLS = [("cell_count", "leb128", 1, "6.6"), ("cell_log2", "u8", 1, "6.6")]

TRANSFORM_FIXED = [
    ("transform_id", "u8", 1, "6.7"),
    ("transform_kind", "u8", 1, "6.7"),
    ("dimension", "u8", 1, "6.7"),
    ("rank", "u8", 1, "6.7"),
]

CODEBOOK_FIXED = [
    ("codebook_id", "u8", 1, "6.8"),
    ("component_count", "u8", 1, "6.8"),
    ("entry_count_minus1", "u16", 1, "6.8"),
    ("value_bytes", "u8", 1, "6.8"),
]

# 5.9; then the parts whose bits of description_flags are set
SCENE_FIXED = [
    ("up_axis", "u8", 1, "6.9"),
    ("kernel", "u8", 1, "6.9"),
    ("colour_space", "u8", 1, "6.9"),
    ("projection", "u8", 1, "6.9"),
    ("sorting", "u8", 1, "6.9"),
    ("description_flags", "u8", 1, "6.9"),
]
SCENE_METRES = [("metres_per_unit", "f32", 1, "6.9")]
SCENE_BACKGROUND = [("background", "f32", 3, "6.9")]
SCENE_BOUNDS = [("bounds_min", "f32", 3, "6.9"), ("bounds_max", "f32", 3, "6.9")]
SCENE_TITLE = [("title_length", "leb128", 1, "6.9")]
SCENE_CAMERAS = [("camera_count", "leb128", 1, "6.9")]
CAMERA = [
    ("position", "f32", 3, "6.9"),
    ("rotation", "f32", 4, "6.9"),
    ("vertical_field_of_view", "f32", 1, "6.9"),
]

INDEX_FIXED = [("entry_count", "u32", 1, "6.10")]

INDEX_ENTRY = [
    ("frame", "u32", 1, "6.10"),
    ("reserved_zero", "u32", 1, "6.10"),
    ("offset", "u64", 1, "6.10"),
]

END = [
    ("frame_count", "u32", 1, "6.11"),
    ("unit_count", "u32", 1, "6.11"),
    ("index_offset", "u64", 1, "6.11"),
]

# 5.14; then the parts of INCREMENT_PARTS whose bits of increment_flags are set, in order
INCREMENT_FIXED = [
    ("increment_flags", "u16", 1, "6.14"),
    ("refinement_digest", "u64", 1, "6.14"),
]
INCREMENT_PARENTS = [("parent_count", "leb128", 1, "6.14")]
INCREMENT_MOVES = [("move_count", "leb128", 1, "6.14")]
INCREMENT_UPDATES = [("update_count", "leb128", 1, "6.14")]
INCREMENT_REMOVALS = [("remove_count", "leb128", 1, "6.14")]
INCREMENT_NEW = [("new_count", "leb128", 1, "6.14")]
INCREMENT_POSITION_SHIFT = [("position_shift", "u8", 1, "6.14")]
INCREMENT_ATTRIBUTE_STEP = [("attribute_step", "u8", 5, "6.14")]
INCREMENT_PREDICTORS = [
    ("predictor_block_log2", "u8", 1, "6.14"),
    ("neighbour_count", "u8", 1, "6.14"),
    ("bilateral_spatial", "u8", 1, "6.14"),
    ("bilateral_feature", "u8", 1, "6.14"),
]
INCREMENT_SH = [("sh_mode", "u8", 1, "6.14")]
INCREMENT_STAGES = [("vq_stage_count", "u8", 1, "6.14")]       # in the part `sh`, if sh_mode is 2
INCREMENT_COMPENSATION = [
    ("compensation_log_scale", "i8", 1, "6.14"),
    ("compensation_opacity", "i8", 1, "6.14"),
]
INCREMENT_MOVE_PREDICTORS = [("move_block_log2", "u8", 1, "6.14")]
INCREMENT_PARTS = [                                 # in the order of the bits
    INCREMENT_PARENTS, INCREMENT_MOVES, INCREMENT_UPDATES, INCREMENT_REMOVALS, INCREMENT_NEW,
    INCREMENT_POSITION_SHIFT, INCREMENT_ATTRIBUTE_STEP, INCREMENT_PREDICTORS, INCREMENT_SH, INCREMENT_COMPENSATION,
    INCREMENT_MOVE_PREDICTORS,
]

POINTS_FIXED = [
    ("point_count", "u16", 1, "6.16"),
    ("reserved_zero", "u16", 1, "6.16"),
]

OPERATING_POINT = [
    ("spatial_layer", "u8", 1, "6.16"),
    ("temporal_layer", "u8", 1, "6.16"),
    ("refinement", "u8", 1, "6.16"),
    ("reserved_zero", "u8", 1, "6.16"),
    ("frame_count", "u32", 1, "6.16"),
    ("gaussian_count", "u64", 1, "6.16"),
    ("byte_count", "u64", 1, "6.16"),
]

WEIGHTS_FIXED = [("model_source", "u8", 1, "6.17")]

NETWORK_FIXED = [
    ("network_flags", "u8", 1, "6.17"),
    ("width_log2", "u8", 1, "6.17"),
    ("feed_forward_width", "u8", 1, "6.17"),
    ("geometry_width", "u8", 1, "6.17"),
    ("fourier_count", "u8", 1, "6.17"),
    ("rank_count", "u8", 1, "6.17"),
    ("dc_count", "u8", 1, "6.17"),
    ("sh_count", "u8", 1, "6.17"),
    ("token_shift", "u8", 1, "6.17"),
    ("output_shift", "u8", 1, "6.17"),
    ("layer_shift", "u8", 8, "6.17"),
]


class Record:
    """The elements of a record by name; `at(name)` is the offset in the stream of an element."""

    def __init__(self, table, reader):
        self._offset = {}
        self.read(table, reader)

    def read(self, table, reader):
        for element, kind, count, clause in table:
            self._offset[element] = reader.pos
            if kind == "leb128":
                setattr(self, element, reader.leb128(clause))
            elif count == 1:
                setattr(self, element, reader.value(kind, clause))
            else:
                setattr(self, element, reader.values(kind, count, clause))

    def has(self, element):
        """Whether the element is present."""
        return element in self._offset

    def at(self, element):
        return self._offset[element]
