"""Clause 6: the records with their constraints, in the order of 9.3 step 3.

Each parse_* function takes the reader of a payload and the state it relates to, and returns a Record.
Order in a payload: presence of the fixed part; its elements in the order of the table, ranges and
reserved values; then the relations to other records; then limits; then the variable part; then
bytes left over.
"""

import constants as c
import syntax
from conventions import TYPE_BYTES, ByteReader, ceil_div, crc32
from errors import StreamError, require
from syntax import Record


def in_range(record, element, low, high, clause, code="OUT_OF_RANGE"):
    """Range of one element, or of each place of an array."""
    value = getattr(record, element)
    for place in value if isinstance(value, list) else [value]:
        # NaN fails both comparisons, infinities fail one: outside every range (6.1).
        require(low <= place <= high, code, clause, record.at(element))


def reserved_zero(record, element, clause):
    value = getattr(record, element)
    for place in value if isinstance(value, list) else [value]:
        require(place == 0, "RESERVED_BITS", clause, record.at(element))


def one_of(record, element, allowed, clause, code):
    require(getattr(record, element) in allowed, code, clause, record.at(element))


def sh_elements(record, clause):
    """sh_mode, vq_stage_count and codebook_ids, which refinements and increments share."""
    one_of(record, "sh_mode", (0, 1, 2), clause, "RESERVED")
    low, high = (1, c.MAX_STAGES) if record.sh_mode == 2 else (0, 0)
    in_range(record, "vq_stage_count", low, high, clause)
    for place, identifier in enumerate(record.codebook_ids):
        good = identifier <= c.MAX_ID if place < record.vq_stage_count else identifier == c.NONE_ID
        require(good, "OUT_OF_RANGE", clause, record.at("codebook_ids") + place)


def element_at_end(table, start, end):
    """Offset of the element of a record in which the data end."""
    for _, kind, places, _ in table:
        size = TYPE_BYTES[kind] * places
        if start + size > end:
            return start
        start += size
    raise AssertionError("the record is complete")


# ---- 6.2 file_header ----


def parse_file_header(data):
    present = data[:8]
    require(present == c.SIGNATURE[:len(present)], "SIGNATURE", "6.2", 0)
    if len(data) < c.FILE_HEADER_BYTES:
        raise StreamError("TRUNCATED", "6.2", element_at_end(syntax.FILE_HEADER, 0, len(data)))
    header = Record(syntax.FILE_HEADER, ByteReader(data, 0, c.FILE_HEADER_BYTES))
    require(header.header_crc == crc32(data[:12]), "CHECK_SUM", "6.2", header.at("header_crc"))
    one_of(header, "version_major", (c.VERSION_MAJOR,), "6.2", "RESERVED")
    one_of(header, "profile", (c.PROFILE_INTRA, c.PROFILE_DYNAMIC), "6.2", "RESERVED")
    one_of(header, "level", (1, 2, 3, 4), "6.2", "RESERVED")
    return header


# ---- 6.3 unit_header: 9.3 steps 2.1 to 2.8 ----


def parse_unit_header(data, start, units_before, profile=c.PROFILE_INTRA):
    if len(data) - start < c.UNIT_HEADER_BYTES:
        raise StreamError("TRUNCATED", "5.3", element_at_end(syntax.UNIT_HEADER, start, len(data)))
    reader = ByteReader(data, start, start + c.UNIT_HEADER_BYTES)
    unit = Record(syntax.UNIT_HEADER, reader)
    unit.start = start
    unit.payload_start = reader.pos
    covered = data[start:start + 6] + data[start + 8:start + 20]
    require(unit.header_check == crc32(covered) & 0xFFFF, "CHECK_SUM", "6.3", unit.at("header_check"))
    require(unit.unit_type != 0, "NUMBER", "6.3", unit.at("unit_type"))
    require(unit.unit_flags & 0xFE == 0, "RESERVED_BITS", "6.3", unit.at("unit_flags"))
    reserved_zero(unit, "reserved_zero", "6.3")
    unit.known = unit.unit_type in c.known_unit_types(profile)
    if not unit.known:
        require(unit.unit_flags & 1 == 0, "RESERVED", "6.3", unit.at("unit_type"))
    else:
        kind, dynamic = unit.unit_type, profile == c.PROFILE_DYNAMIC      # SS-UH-006, SS-UH-007
        spatial = dynamic and kind in (c.UT_FRAME, c.UT_INCREMENT)
        temporal = dynamic and kind in (c.UT_FRAME, c.UT_INCREMENT, c.UT_CODEBOOK)
        in_range(unit, "spatial_layer", 0, c.MAX_LAYERS - 1 if spatial else 0, "6.3")
        in_range(unit, "temporal_layer", 0, c.MAX_LAYERS - 1 if temporal else 0, "6.3")
        refined = kind in (c.UT_REFINEMENT, c.UT_INCREMENT)
        in_range(unit, "refinement", 0, c.MAX_REFINEMENTS - 1 if refined else 0, "6.3")
        if kind in (c.UT_SEQUENCE, c.UT_POINTS, c.UT_INDEX, c.UT_END):
            in_range(unit, "frame", 0, 0, "6.3")
    require(units_before + 1 <= c.MAX_UNITS, "OVER_LIMIT", "A.2", start)
    require(unit.payload_length <= c.MAX_PAYLOAD_LENGTH, "OVER_LIMIT", "A.2", unit.at("payload_length"))
    unit.end = unit.payload_start + unit.payload_length
    require(unit.end <= len(data), "TRUNCATED", "B.1", unit.payload_start)
    return unit


# ---- 6.4 sequence_parameters ----


def parse_sequence_parameters(reader, profile=c.PROFILE_INTRA):
    seq = Record(syntax.SEQUENCE_PARAMETERS, reader)
    q = "6.4"
    layers = c.MAX_LAYERS if profile == c.PROFILE_DYNAMIC else 1
    in_range(seq, "sh_degree", 0, 3, q)
    in_range(seq, "spatial_layer_count", 1, layers, q)
    in_range(seq, "temporal_layer_count", 1, layers, q)
    in_range(seq, "refinement_count", 1, c.MAX_REFINEMENTS, q)
    percent, count = seq.refinement_percent, seq.refinement_count
    good = percent[0] >= 1 and percent[count - 1] == 100
    for r in range(1, count):
        good = good and percent[r] > percent[r - 1]
    for r in range(count, 10):
        good = good and percent[r] == 0
    require(good, "OUT_OF_RANGE", q, seq.at("refinement_percent"))
    in_range(seq, "position_bits", 1, 20, q)
    in_range(seq, "block_log2", 6, 16, q)
    require(seq.sequence_flags & 0xFC == 0, "RESERVED_BITS", q, seq.at("sequence_flags"))
    threshold = seq.rotation_threshold
    require(threshold[0] >= threshold[1] >= threshold[2], "OUT_OF_RANGE", q, seq.at("rotation_threshold"))
    in_range(seq, "ticks_per_second", 1, 2 ** 32 - 1, q)
    for element in ("position_offset", "position_step", "log_scale_offset", "log_scale_step", "rotation_step",
                    "opacity_offset", "opacity_step", "dc_step", "sh_step"):
        if element.endswith("_offset"):
            in_range(seq, element, -2.0 ** 40, 2.0 ** 40, q, "CONSTRAINT")
        else:
            largest = 1.0 if element == "rotation_step" else 2.0 ** 20
            in_range(seq, element, 2.0 ** -40, largest, q, "CONSTRAINT")
    reader.check_end("5.4")
    seq.sh_planes = 3 * ((seq.sh_degree + 1) * (seq.sh_degree + 1) - 1)
    seq.canonical_axes = seq.sequence_flags & 1
    seq.top = seq.spatial_layer_count - 1
    return seq


# ---- 6.5 gop_header ----


def parse_gop_header(reader, unit, next_gop, profile=c.PROFILE_INTRA, temporal_layer_count=1):
    """next_gop is None for the first GOP of a decoder that starts inside a stream (B.3)."""
    gop = Record(syntax.GOP_HEADER, reader)
    dynamic = profile == c.PROFILE_DYNAMIC
    in_range(gop, "gop_frame_count", 1, 2 ** 32 - 1, "6.5")
    one_of(gop, "gop_structure", (0, 1) if dynamic else (0,), "6.5", "RESERVED")
    if dynamic:                                                           # SS-GH-006
        in_range(gop, "temporal_depth", 0, c.MAX_LAYERS - 1 if gop.gop_structure == 1 else 0, "6.5")
    else:
        reserved_zero(gop, "temporal_depth", "6.5")
    reserved_zero(gop, "reserved_zero", "6.5")
    if gop.gop_structure == 1:                                            # SS-GH-005, SS-GH-006
        in_range(gop, "gop_frame_count", 1, c.MAX_PREDICTED_FRAMES, "6.5")
        in_range(gop, "temporal_depth", 0, temporal_layer_count - 1, "6.5")
    require(next_gop is None or gop.gop_index == next_gop, "MISMATCH", "6.5", gop.at("gop_index"))
    require(unit.frame + gop.gop_frame_count <= 2 ** 32, "OUT_OF_RANGE", "6.5", gop.at("gop_frame_count"))
    reader.check_end("5.5")
    return gop


# ---- 6.6 frame_header ----


def parse_frame_header(reader, dc_transforms, sh_transforms, level, frame_type=None):
    """frame_type is what 7.13.1 gives the frame in profile 1, None in profile 0."""
    frame = Record(syntax.FRAME_HEADER, reader)
    types = (c.TYPE_I,) if frame_type is None else (c.TYPE_I, c.TYPE_P, c.TYPE_B)
    one_of(frame, "frame_type", types, "6.6", "RESERVED")
    in_range(frame, "dc_transform_id", 0, c.MAX_ID, "6.6")
    one_of(frame, "sh_transform_id", tuple(range(c.MAX_ID + 1)) + (c.NONE_ID,), "6.6", "OUT_OF_RANGE")
    reserved_zero(frame, "reserved_zero", "6.6")
    if frame_type is not None:                                            # SS-FR-004
        one_of(frame, "frame_type", (frame_type,), "6.6", "MISMATCH")
    one_of(frame, "dc_transform_id", dc_transforms, "6.6", "UNDEFINED")
    if frame.sh_transform_id != c.NONE_ID:
        one_of(frame, "sh_transform_id", sh_transforms, "6.6", "UNDEFINED")
    in_range(frame, "gaussian_count", 0, c.MAX_GAUSSIANS[level], "6.6", "OVER_LIMIT")
    reader.check_end("5.6")
    return frame


# ---- 6.7 transform ----


def parse_transform(reader, sh_planes, dc_transforms, sh_transforms):
    t = Record(syntax.TRANSFORM_FIXED, reader)
    in_range(t, "transform_id", 0, c.MAX_ID, "6.7")
    one_of(t, "transform_kind", (0, 1), "6.7", "RESERVED")
    one_of(t, "dimension", (3 if t.transform_kind == 0 else sh_planes,), "6.7", "MISMATCH")
    in_range(t, "rank", 1, t.dimension, "6.7")
    defined = sh_transforms if t.transform_kind == 1 else dc_transforms
    require(t.transform_id not in defined, "CONSTRAINT", "6.7", t.at("transform_id"))
    mean_at = reader.pos
    t.mean = reader.values("i32", t.dimension, "5.7")
    basis_at = reader.pos
    t.basis = reader.values("i16", t.rank * t.dimension, "5.7")
    reader.check_end("5.7")
    for j, value in enumerate(t.mean):
        require(abs(value) <= c.MEAN_MAX, "OUT_OF_RANGE", "6.7", mean_at + 4 * j)
    for k, value in enumerate(t.basis):
        require(abs(value) <= c.BASIS_MAX, "OUT_OF_RANGE", "6.7", basis_at + 2 * k)
    return t


# ---- 6.8 codebook ----


def parse_codebook(reader, codebooks, temporal_layer=None):
    """temporal_layer is that of the unit header in profile 1, None in profile 0."""
    book = Record(syntax.CODEBOOK_FIXED, reader)
    in_range(book, "codebook_id", 0, c.MAX_ID, "6.8")
    in_range(book, "component_count", 1, 45, "6.8")
    one_of(book, "value_bytes", (1, 2), "6.8", "OUT_OF_RANGE")
    old = codebooks.get(book.codebook_id)
    good = old is None or (temporal_layer is not None and old.temporal_layer == temporal_layer)
    require(good, "CONSTRAINT", "6.8", book.at("codebook_id"))            # SS-CB-001, SS-CB-003
    book.temporal_layer = temporal_layer
    book.entry_count = book.entry_count_minus1 + 1
    book.value_count = book.entry_count * book.component_count
    total = book.value_count + sum(other.value_count for other in codebooks.values() if other is not old)
    require(total <= c.MAX_CODEBOOK_VALUES, "OVER_LIMIT", "A.2", book.at("entry_count_minus1"))
    book.values = reader.values("i8" if book.value_bytes == 1 else "i16", book.value_count, "5.8")
    reader.check_end("5.8")
    return book


# ---- 6.9 refinement: the fixed part and the division into sections ----


def parse_refinement(reader, seq, frame, expected_count, sh_transform, codebooks):
    """sh_transform is the frame's sh transform or None."""
    u = Record(syntax.REFINEMENT_FIXED, reader)
    q = "6.9"
    in_range(u, "position_shift", 0, seq.position_bits - 1, q)
    in_range(u, "lanes_log2", 0, 5, q)
    sh_elements(u, q)
    # relations to other records
    require(u.gaussian_count == expected_count, "MISMATCH", "7.2", u.at("gaussian_count"))
    if sh_transform is None:
        in_range(u, "sh_mode", 0, 0, q)
    for stage in range(u.vq_stage_count):
        book = codebooks.get(u.codebook_ids[stage])
        at = u.at("codebook_ids") + stage
        require(book is not None, "UNDEFINED", q, at)
        require(book.component_count == sh_transform.rank, "MISMATCH", q, at)
    # division into sections
    at = reader.pos
    u.model_length = reader.leb128("5.9")
    if u.gaussian_count == 0:
        require(u.model_length == 0, "MISMATCH", q, at)
    u.models_section = reader.section(u.model_length, "5.9")
    block_count = ceil_div(u.gaussian_count, 2 ** seq.block_log2)
    u.block_length = [reader.leb128("5.9") for _ in range(block_count)]
    u.block_sections = [reader.section(length, "5.9") for length in u.block_length]
    reader.check_end("5.9")
    return u


# ---- 6.10 index ----


def parse_index(reader, gops):
    """gops: (frame, offset) of each gop_header unit so far; None for a decoder inside a stream."""
    index = Record(syntax.INDEX_FIXED, reader)
    if gops is not None:
        require(index.entry_count == len(gops), "MISMATCH", "6.10", index.at("entry_count"))
    require(16 * index.entry_count <= reader.left(), "SHORT_SECTION", "5.10", reader.pos)
    entries = [Record(syntax.INDEX_ENTRY, reader) for _ in range(index.entry_count)]
    reader.check_end("5.10")
    for entry in entries:
        reserved_zero(entry, "reserved_zero", "6.10")
    if gops is not None:
        for k, entry in enumerate(entries):
            require(entry.frame == gops[k][0], "MISMATCH", "6.10", entry.at("frame"))
            require(entry.offset == gops[k][1], "MISMATCH", "6.10", entry.at("offset"))
    return index


# ---- 6.11 end ----


def parse_end(reader, seq, frame_count, gop_frames, unit_count, index_offset, inside):
    """gop_frames is the sum of gop_frame_count over the gop_header units."""
    end = Record(syntax.END, reader)
    if not inside:
        require(end.frame_count == frame_count, "MISMATCH", "6.11", end.at("frame_count"))
        require(end.unit_count == unit_count, "MISMATCH", "6.11", end.at("unit_count"))
        require(end.index_offset == index_offset, "MISMATCH", "6.11", end.at("index_offset"))
        if seq.frame_count != 0:                                          # SS-SP-005
            require(seq.frame_count == gop_frames, "MISMATCH", "6.4", end.at("frame_count"))
    reader.check_end("5.11")
    return end
