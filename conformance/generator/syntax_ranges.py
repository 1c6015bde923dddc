"""Ranges of the elements of clause 5 in conforming streams, as clause 6 and annex A give them, for syntax_coverage.py.

Record and element -> (smallest, largest, values of their own beyond that range, which may be absent from the middle).
"""

U8, U16, U32, U64 = 2 ** 8 - 1, 2 ** 16 - 1, 2 ** 32 - 1, 2 ** 64 - 1
FAR = 2.0 ** 40
STEP = (2.0 ** -40, 2.0 ** 20, ())


def some(low, high, *holes):
    return low, high, holes


def free(high):
    """A checksum or digest: its ends cannot be asked for."""
    return 0, high, (), True


FILE_HEADER = {"signature": some(0x0A, 0x89), "version_major": some(130, 130), "version_minor": some(3, 3),
               "profile": some(0, 1),
               "level": some(1, 4), "header_crc": free(U32)}
UNIT_HEADER = {"unit_type": some(1, U8), "unit_flags": some(0, 1), "spatial_layer": some(0, 3),
               "temporal_layer": some(0, 3),
               "refinement": some(0, 9), "reserved_zero": some(0, 0), "header_check": free(U16), "frame": some(0, U32),
               "payload_length": some(0, 2 ** 30), "payload_crc": free(U32)}
SEQUENCE_PARAMETERS = {
    "sh_degree": some(0, 3), "spatial_layer_count": some(1, 4), "temporal_layer_count": some(1, 4),
    "refinement_count": some(1, 10),
    "refinement_percent": some(0, 100), "position_bits": some(1, 20), "block_log2": some(6, 16),
    "sequence_flags": some(0, 7),
    "linear_log2": some(0, 20), "segment_log2": some(0, 20), "feature_shift": some(0, 7), "size_weight": some(0, 8191),
    "opacity_weight": some(0, 8191), "anisotropy_weight": some(0, 8191), "size_reference": some(-65536, 65535),
    "opacity_reference": some(-32768, 32767), "anisotropy_reference": some(0, 65535), "frame_count": some(0, U32),
         "ticks_per_second": some(1, U32),
    "ticks_per_frame": some(0, U32),
    "position_offset": some(-FAR, FAR), "position_step": STEP, "log_scale_offset": some(-FAR, FAR),
    "log_scale_step": STEP,
    "rotation_step": some(2.0 ** -40, 1.0), "opacity_offset": some(-FAR, FAR), "opacity_step": STEP, "dc_step": STEP,
    "sh_step": STEP}
GOP_HEADER = {"gop_index": some(0, U32), "gop_frame_count": some(1, U32), "gop_structure": some(0, 1),
              "temporal_depth": some(0, 3),
              "reserved_zero": some(0, 0)}
FRAME_HEADER = {"frame_type": some(0, 2), "dc_transform_id": some(0, 15), "sh_transform_id": some(0, 15, 255),
                "frame_flags": some(0, 3), "gaussian_count": some(0, 2 ** 24), "carried_digest": free(U64),
                "cell_count": some(1, 2 ** 20), "cell_log2": some(0, 20)}
TRANSFORM = {"transform_id": some(0, 15), "transform_kind": some(0, 1), "dimension": some(3, 45, 9, 24),
             "rank": some(1, 45),
             "mean": some(-2 ** 30, 2 ** 30), "basis": some(-4096, 4096)}
CODEBOOK = {"codebook_id": some(0, 15), "component_count": some(1, 45), "entry_count_minus1": some(0, U16),
            "value_bytes": some(1, 2),
            "entries as i8": some(-128, 127), "entries as i16": some(-2 ** 15, 2 ** 15 - 1)}
INDEX = {"entry_count": some(0, U32)}
INDEX_ENTRY = {"frame": some(0, U32), "reserved_zero": some(0, 0), "offset": some(142, U64)}
END = {"frame_count": some(0, U32), "unit_count": some(1, U32), "index_offset": some(0, U64)}
COUNT = some(1, 2 ** 24)
INCREMENT = {"increment_flags": some(0, 4095), "refinement_digest": free(U64), "parent_count": COUNT, "move_count": COUNT,
             "update_count": COUNT, "remove_count": COUNT, "new_count": COUNT, "position_shift": some(0, 19),
             "attribute_step": some(0, 24), "predictor_block_log2": some(0, 16), "neighbour_count": some(1, 16),
             "bilateral_spatial": some(0, U8), "bilateral_feature": some(0, U8), "sh_mode": some(1, 2),
             "vq_stage_count": some(1, 4), "codebook_ids": some(0, 15), "compensation_log_scale": some(-128, 127),
             "compensation_opacity": some(-128, 127), "move_block_log2": some(0, 16)}
SCENE = {"up_axis": some(0, 6), "kernel": some(0, 0), "colour_space": some(0, 1), "projection": some(0, 0),
         "sorting": some(0, 1), "description_flags": some(0, 31), "metres_per_unit": some(2.0 ** -149, FAR),
         "background": some(0.0, 1.0), "bounds_min": some(-FAR, FAR), "bounds_max": some(-FAR, FAR),
         "title_length": some(1, 1024), "camera_count": some(1, 64)}
CAMERA = {"position": some(-FAR, FAR), "rotation": some(-FAR, FAR),
          "vertical_field_of_view": some(2.0 ** -149, 13176794 * 2.0 ** -22)}
SECTION = {"lanes_log2": some(0, 5), "model_length": some(1, U32), "block_length": some(5, U32)}
POINTS = {"point_count": some(0, 160), "reserved_zero": some(0, 0)}
OPERATING_POINT = {"spatial_layer": some(0, 3), "temporal_layer": some(0, 3), "refinement": some(0, 9),
                   "reserved_zero": some(0, 0),
                   "frame_count": some(0, U32), "gaussian_count": some(0, U64), "byte_count": some(0, U64)}
NETWORK = {"network_flags": some(0, 15), "width_log2": some(3, 6), "feed_forward_width": some(0, 128),
           "geometry_width": some(0, 32),
           "fourier_count": some(0, 4), "rank_count": some(1, 16), "dc_count": some(0, 3), "sh_count": some(0, 16),
           "token_shift": some(0, 8),
           "output_shift": some(0, 4), "layer_shift": some(1, 15), "parameters as i8": some(-128, 127),
           "parameters as i16": some(-2 ** 15, 2 ** 15 - 1)}
BLOCK = {"word_count": some(0, U32), "state": some(65536, U32), "word": some(0, U16)}
PLANE_MODEL = {
    "reuse": some(0, 1), "bias": some(-32768, 32767), "direct_log2_minus2": some(0, 5),
    "direct_log2_minus2 of position": some(0, 3),
    "source_a": some(0, 11), "source_b": some(0, 11), "threshold_a_count_minus1": some(0, 15),
    "threshold_b_count_minus1": some(0, 15),
    "threshold_a_first": some(-2 ** 31 + 1, 2 ** 31 - 1), "threshold_b_first": some(-2 ** 31 + 1, 2 ** 31 - 1),
    "threshold_a_step_minus1": some(0, 2 ** 32 - 3), "threshold_b_step_minus1": some(0, 2 ** 32 - 3),
    "table_kind": some(0, 3),
    "is_reference": some(0, 1), "table_index": some(0, 62), "token": some(0, 251),
    "is_parametric": some(0, 1), "last": some(0, 251), "shape": some(0, 3), "zero_level": some(0, 15),
    "scale": some(0, 63), "centre": some(-32768, 32767),
    "mode": some(0, 251),
    "length_delta": some(-12, 12), "mantissa": some(0, 7)}
RECORDS = {"file_header": FILE_HEADER, "unit_header": UNIT_HEADER, "sequence_parameters": SEQUENCE_PARAMETERS,
           "gop_header": GOP_HEADER,
           "frame_header": FRAME_HEADER, "transform": TRANSFORM, "codebook": CODEBOOK,
           "scene_description": SCENE, "camera": CAMERA,
           "index": INDEX,
           "index_entry": INDEX_ENTRY, "end": END, "increment": INCREMENT, "section": SECTION, "points": POINTS,
           "operating_point": OPERATING_POINT, "weights": {"model_source": some(0, 1)}, "network": NETWORK,
           "block": BLOCK,
           "plane_model": PLANE_MODEL}
RANGES = {"%s.%s" % (record, element): row for record, elements in RECORDS.items() for element, row in elements.items()}

# those that may be absent
ARRAYS = ("geometry", "geometry_bias", "geometry_embedding", "query", "fourier", "gain", "gain_bias", "widening",
          "widening_bias", "narrowing",
          "narrowing_bias")
CONDITIONS = ["transform: transform_kind == 1", "weights: model_source == 1",
              "block: raw_bits is empty",
              "plane_model: reuse == 0", "plane_model: the alphabet is signed", "plane_model: source_a != 0",
              "plane_model: source_b != 0",
              "plane_model: threshold_a_count_minus1 == 0", "plane_model: threshold_b_count_minus1 == 0",
              "plane_model: is_reference == 1", "plane_model: is_parametric == 1",
              "plane_model: mode == last"]
CONDITIONS += ["increment: section %s is present" % name for name in ("modes", "move_predictors", "moves", "updates",
                                                                   "predictors", "new")]
CONDITIONS += ["increment: %s is present" % name for name in (
    "parent_count", "move_count", "update_count", "remove_count", "new_count", "position_shift", "attribute_step",
    "predictor_block_log2", "sh_mode", "compensation_log_scale", "move_block_log2")]
CONDITIONS += ["increment: sh_mode == 2", "increment: extrapolates_opacity == 1", "frame_header: carried_digest is present",
     "frame_header: cell_count is present"]
CONDITIONS += ["scene_description: %s is present" % name for name in ("metres_per_unit", "background", "bounds_min",
                                                                      "title_length", "camera_count")]
CONDITIONS += ["network: array %s is present" % name for name in ARRAYS]
