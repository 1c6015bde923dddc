"""Clause 6: the records with their constraints, one after the other.

Each parse_* function takes the reader of a payload and the state it relates to, and returns a Record. Every
element is checked before something is read or computed by means of it.
"""

from . import constants as c, syntax
from .conventions import TYPE_BYTES, ByteReader, ceil_div, crc32
from .errors import StreamError, require
from .syntax import Record


def in_range(record, element, low, high, clause, code="OUT_OF_RANGE"):
    """SS-ER-001: range of one element, or of each value of an array."""
    value = getattr(record, element)
    for one in value if isinstance(value, list) else [value]:
        # NaN fails both comparisons, infinities fail one: outside every range (6.1).
        require(low <= one <= high, code, clause, record.at(element))


def reserved_zero(record, element, clause, mask=0xFFFFFFFF):
    """SS-ER-002: the bits of `mask` are reserved."""
    value = getattr(record, element)
    for one in value if isinstance(value, list) else [value]:
        require(one & mask == 0, "RESERVED_BITS", clause, record.at(element))


def one_of(record, element, allowed, clause, code):
    require(getattr(record, element) in allowed, code, clause, record.at(element))


def element_at_end(table, start, end):
    """Offset of the element of a record in which the data end."""
    for _, kind, count, _ in table:
        size = TYPE_BYTES[kind] * count
        if start + size > end:
            return start
        start += size
    raise AssertionError("the record is complete")


# ---- 6.2 file_header ----


def parse_file_header(data):
    """SS-FH-005: the order of the checks"""
    present = data[:8]
    require(present == c.SIGNATURE[:len(present)], "SIGNATURE", "6.2", 0)             # SS-FH-001
    if len(data) < c.FILE_HEADER_BYTES:
        raise StreamError("TRUNCATED", "6.2", element_at_end(syntax.FILE_HEADER, 0, len(data)))
    header = Record(syntax.FILE_HEADER, ByteReader(data, 0, c.FILE_HEADER_BYTES))
    require(header.header_crc == crc32(data[:12]), "CHECKSUM", "6.2", header.at("header_crc"))      # SS-FH-002
    one_of(header, "version_major", (c.VERSION[0],), "6.2", "RESERVED")               # SS-FH-003
    one_of(header, "version_minor", (c.VERSION[1],), "6.2", "RESERVED")
    one_of(header, "profile", (c.PROFILE_INTRA, c.PROFILE_DYNAMIC), "6.2", "RESERVED")              # SS-FH-004
    one_of(header, "level", (1, 2, 3, 4), "6.2", "RESERVED")
    return header


# ---- 6.3 unit_header ----


def read_unit_header(data, start, units_before=0):
    """The unit_header at `start`, if its extent is usable (7.1.3): `end` is the offset after the payload."""
    if len(data) - start < c.UNIT_HEADER_BYTES:
        raise StreamError("TRUNCATED", "5.3", element_at_end(syntax.UNIT_HEADER, start, len(data)))
    reader = ByteReader(data, start, start + c.UNIT_HEADER_BYTES)
    unit = Record(syntax.UNIT_HEADER, reader)
    unit.start = start
    unit.payload_start = reader.pos
    unit.end = unit.payload_start + unit.payload_length
    unit.known = unit.unit_type in c.KNOWN_UNIT_TYPES
    covered = data[start:start + 6] + data[start + 8:start + 20]
    require(unit.header_check == crc32(covered) & 0xFFFF, "CHECKSUM", "6.3", unit.at("header_check"))   # SS-UH-001
    require(units_before + 1 <= c.MAX_UNITS, "OVER_LIMIT", "A.2", start)
    require(unit.payload_length <= c.MAX_PAYLOAD_LENGTH, "OVER_LIMIT", "A.2", unit.at("payload_length"))
    require(unit.end <= len(data), "TRUNCATED", "B.1", unit.payload_start)
    return unit


def check_unit_type(unit, profile):
    """unit_type and reserved bits of a unit_header, SS-UH-003"""
    require(unit.unit_type != 0, "NUMBER", "6.3", unit.at("unit_type"))               # SS-UH-002
    reserved_zero(unit, "unit_flags", "6.3", 0xFE)
    reserved_zero(unit, "reserved_zero", "6.3")
    require(unit.known or unit.unit_flags & 1 == 0, "RESERVED", "6.3", unit.at("unit_type"))         # SS-UH-005
    if profile != c.PROFILE_DYNAMIC:                                                  # SS-UH-006
        require(unit.unit_type != c.UT_WEIGHTS, "RESERVED", "6.3", unit.at("unit_type"))


def check_elements(unit):
    """The numbers in the unit_header of a unit of known type, SS-UH-007, SS-UH-008"""
    kind = unit.unit_type
    temporal = kind in (c.UT_FRAME, c.UT_INCREMENT, c.UT_CODEBOOK)
    refined = kind == c.UT_INCREMENT
    in_range(unit, "spatial_layer", 0, c.MAX_LAYERS - 1 if refined else 0, "6.3")
    in_range(unit, "temporal_layer", 0, c.MAX_LAYERS - 1 if temporal else 0, "6.3")
    in_range(unit, "refinement", 0, c.MAX_REFINEMENTS - 1 if refined else 0, "6.3")
    if kind in (c.UT_SEQUENCE, c.UT_SCENE, c.UT_POINTS, c.UT_INDEX, c.UT_END):
        in_range(unit, "frame", 0, 0, "6.3")


def check_layers(unit, seq):
    """SS-UH-008, the part that needs the sequence_parameters"""
    in_range(unit, "spatial_layer", 0, seq.spatial_layer_count - 1, "6.3")
    in_range(unit, "temporal_layer", 0, seq.temporal_layer_count - 1, "6.3")


def parse_unit_header(data, start, profile=c.PROFILE_DYNAMIC):
    """A unit_header with all checks of 6.3."""
    unit = read_unit_header(data, start)
    check_unit_type(unit, profile)
    if unit.known:
        check_elements(unit)
    return unit


# ---- 6.4 sequence_parameters ----


def parse_sequence_parameters(reader, profile=c.PROFILE_DYNAMIC):
    seq = Record(syntax.SEQUENCE_PARAMETERS, reader)
    q = "6.4"
    dynamic = profile == c.PROFILE_DYNAMIC
    layers = c.MAX_LAYERS if dynamic else 1
    in_range(seq, "sh_degree", 0, 3, q)
    in_range(seq, "spatial_layer_count", 1, layers, q)
    in_range(seq, "temporal_layer_count", 1, layers, q)
    in_range(seq, "refinement_count", 1, c.MAX_REFINEMENTS, q)
    check_percent(seq)
    in_range(seq, "position_bits", 1, 20, q)
    in_range(seq, "block_log2", 6, 16, q)
    reserved_zero(seq, "sequence_flags", q, 0xF8 if dynamic else 0xFC)                # SS-SP-004
    in_range(seq, "linear_log2", 0, 20, q)
    in_range(seq, "segment_log2", 0, seq.linear_log2, q)
    check_segments(seq)
    in_range(seq, "feature_shift", 0, c.MAX_FEATURE_SHIFT, q)
    for element in ("size_weight", "opacity_weight", "anisotropy_weight"):
        in_range(seq, element, 0, c.MAX_WEIGHT, q)
    in_range(seq, "size_reference", -65536, 65535, q)
    in_range(seq, "opacity_reference", -32768, 32767, q)
    in_range(seq, "anisotropy_reference", 0, 65535, q)
    in_range(seq, "ticks_per_second", 1, 2 ** 32 - 1, q)
    for element in ("position_offset", "position_step", "log_scale_offset", "log_scale_step", "rotation_step",
                    "opacity_offset", "opacity_step", "dc_step", "sh_step"):
        if element.endswith("_offset"):                                               # SS-SP-003
            in_range(seq, element, -2.0 ** 40, 2.0 ** 40, q, "CONSTRAINT")
        else:
            largest = 1.0 if element == "rotation_step" else 2.0 ** 20
            in_range(seq, element, 2.0 ** -40, largest, q, "CONSTRAINT")
    reader.check_end("5.4")
    seq.sh_planes = 3 * ((seq.sh_degree + 1) * (seq.sh_degree + 1) - 1)
    seq.canonical_axes = seq.sequence_flags & 1
    seq.whole_anchor = seq.sequence_flags >> 2 & 1
    seq.top = seq.spatial_layer_count - 1
    return seq


def check_percent(seq):
    """SS-SP-001"""
    percent, count = seq.refinement_percent, seq.refinement_count
    good = percent[0] >= 1 and percent[count - 1] == 100
    for r in range(1, count):
        good = good and percent[r] > percent[r - 1]
    for r in range(count, 10):
        good = good and percent[r] == 0
    require(good, "OUT_OF_RANGE", "6.4", seq.at("refinement_percent"))


def check_segments(seq):
    """SS-SP-008"""
    companded = 2 ** (seq.position_bits - 1) - 2 ** seq.linear_log2
    good = companded <= 0 or ceil_div(companded, 2 ** seq.segment_log2) <= c.MAX_SEGMENTS
    require(good, "CONSTRAINT", "6.4", seq.at("segment_log2"))


# ---- 6.5 gop_header ----


def parse_gop_header(reader, unit, profile, temporal_layer_count):
    """The unit against the GOPs before it (SS-GH-001) is checked in decoding.py."""
    gop = Record(syntax.GOP_HEADER, reader)
    structures = (0, 1) if profile == c.PROFILE_DYNAMIC else (0,)
    in_range(gop, "gop_frame_count", 1, 2 ** 32 - 1, "6.5")
    one_of(gop, "gop_structure", structures, "6.5", "RESERVED")                       # SS-GH-002
    depths = min(c.MAX_LAYERS, temporal_layer_count) if gop.gop_structure == 1 else 1
    in_range(gop, "temporal_depth", 0, depths - 1, "6.5")                             # SS-GH-006
    reserved_zero(gop, "reserved_zero", "6.5")
    if gop.gop_structure == 1:                                                        # SS-GH-005
        in_range(gop, "gop_frame_count", 1, c.MAX_PREDICTED_FRAMES, "6.5")
    require(unit.frame + gop.gop_frame_count <= 2 ** 32, "OUT_OF_RANGE", "6.5", gop.at("gop_frame_count"))  # SS-GH-003
    reader.check_end("5.5")
    return gop


# ---- 6.6 frame_header ----


def parse_frame_header(reader, seq, level, frame_type, dc_transforms, sh_transforms):
    """frame_type is that of 7.3.1; `cells` is the division of the section cells, or None."""
    frame = Record(syntax.FRAME_HEADER, reader)
    q = "6.6"
    one_of(frame, "frame_type", (c.TYPE_I, c.TYPE_P, c.TYPE_B), q, "RESERVED")        # SS-FR-001
    one_of(frame, "frame_type", (frame_type,), q, "MISMATCH")                         # SS-FR-002
    in_range(frame, "dc_transform_id", 0, c.MAX_ID, q)
    one_of(frame, "sh_transform_id", tuple(range(c.MAX_ID + 1)) + (c.NONE_ID,), q, "OUT_OF_RANGE")
    reserved_zero(frame, "frame_flags", q, 0xFC)                                      # SS-FR-004
    if frame_type == c.TYPE_I:
        one_of(frame, "frame_flags", (0,), q, "MISMATCH")
    one_of(frame, "dc_transform_id", dc_transforms, q, "UNDEFINED")                   # SS-FR-003
    if frame.sh_transform_id != c.NONE_ID:
        one_of(frame, "sh_transform_id", sh_transforms, q, "UNDEFINED")
    in_range(frame, "gaussian_count", 0, c.MAX_GAUSSIANS[level], q, "OVER_LIMIT")     # SS-FR-005
    if seq.ticks_per_frame != 0:                                                      # SS-FR-006
        slow = frame.gaussian_count * seq.ticks_per_second <= c.MAX_GAUSSIAN_RATE[level] * seq.ticks_per_frame
        require(slow, "OVER_LIMIT", "A.2", frame.at("gaussian_count"))
    frame.carried_digest = None
    if frame.frame_flags & 1:
        frame.read(syntax.FRAME_CARRIED_DIGEST, reader)
    frame.cell_count, frame.cell_log2, frame.cells = 0, 0, None
    if frame.frame_flags & 2:
        frame.read(syntax.FRAME_CELLS, reader)
        in_range(frame, "cell_count", 1, 2 ** 32 - 1, q)                              # SS-FR-007
        in_range(frame, "cell_count", 1, c.MAX_CELLS[level], "A.2", "OVER_LIMIT")
        in_range(frame, "cell_log2", 0, seq.position_bits, q)
        frame.cells = Division("cells", frame.cell_count, reader, seq.block_log2)     # SS-FR-008
    reader.check_end("5.6")
    return frame


# ---- 6.7 transform ----


def parse_transform(reader, sh_planes, dc_transforms, sh_transforms):
    t = Record(syntax.TRANSFORM_FIXED, reader)
    in_range(t, "transform_id", 0, c.MAX_ID, "6.7")
    one_of(t, "transform_kind", (0, 1), "6.7", "RESERVED")                            # SS-TF-001
    one_of(t, "dimension", (3 if t.transform_kind == 0 else sh_planes,), "6.7", "MISMATCH")  # SS-TF-002
    in_range(t, "rank", 1, t.dimension, "6.7")
    defined = sh_transforms if t.transform_kind == 1 else dc_transforms
    require(t.transform_id not in defined, "CONSTRAINT", "6.7", t.at("transform_id"))  # SS-TF-003
    mean_at = reader.pos
    t.mean = reader.values("i32", t.dimension, "5.7")
    basis_at = reader.pos
    t.basis = reader.values("i16", t.rank * t.dimension, "5.7")
    reader.check_end("5.7")
    for j, value in enumerate(t.mean):                                                # SS-TF-004
        require(abs(value) <= c.MEAN_MAX, "OUT_OF_RANGE", "6.7", mean_at + 4 * j)
    for k, value in enumerate(t.basis):
        require(abs(value) <= c.BASIS_MAX, "OUT_OF_RANGE", "6.7", basis_at + 2 * k)
    return t


# ---- 6.8 codebook ----


def parse_codebook(reader, codebooks, temporal_layer, level):
    """temporal_layer is that of the unit header; `codebooks` are the definitions in force before the unit."""
    book = Record(syntax.CODEBOOK_FIXED, reader)
    in_range(book, "codebook_id", 0, c.MAX_ID, "6.8")
    in_range(book, "component_count", 1, 45, "6.8")
    one_of(book, "value_bytes", (1, 2), "6.8", "OUT_OF_RANGE")
    old = codebooks.get(book.codebook_id)
    good = old is None or old.temporal_layer == temporal_layer
    require(good, "CONSTRAINT", "6.8", book.at("codebook_id"))                        # SS-CB-001
    book.temporal_layer = temporal_layer
    book.entry_count = book.entry_count_minus1 + 1
    book.value_count = book.entry_count * book.component_count
    total = book.value_count + sum(other.value_count for other in codebooks.values() if other is not old)
    require(total <= c.MAX_CODEBOOK_VALUES[level], "OVER_LIMIT", "A.2", book.at("entry_count_minus1"))  # SS-CB-002
    book.values = reader.values("i8" if book.value_bytes == 1 else "i16", book.value_count, "5.8")
    reader.check_end("5.8")
    return book


# ---- 6.10 index ----


def parse_index(reader, gops):
    """gops: (frame, offset) of each gop_header unit of the stream, or None if they are not compared."""
    index = Record(syntax.INDEX_FIXED, reader)
    if gops is not None:                                                              # SS-IX-001
        require(index.entry_count == len(gops), "MISMATCH", "6.10", index.at("entry_count"))
    require(16 * index.entry_count <= reader.left(), "SHORT_SECTION", "5.10", reader.pos)
    index.entries = [Record(syntax.INDEX_ENTRY, reader) for _ in range(index.entry_count)]
    reader.check_end("5.10")
    for entry in index.entries:
        reserved_zero(entry, "reserved_zero", "6.10")
    for before, entry in zip(index.entries, index.entries[1:]):                       # SS-IX-002
        for element in ("frame", "offset"):
            good = getattr(before, element) < getattr(entry, element)
            require(good, "MISMATCH", "6.10", entry.at(element))
    for entry, (frame, offset) in zip(index.entries, gops or []):                     # SS-IX-001
        require(entry.frame == frame, "MISMATCH", "6.10", entry.at("frame"))
        require(entry.offset == offset, "MISMATCH", "6.10", entry.at("offset"))
    return index


# ---- 6.11 end ----


def parse_end(reader):
    end = Record(syntax.END, reader)
    reader.check_end("5.11")
    return end


def check_end(end, seq, frame_count, unit_count, index_offset, gop_frames):
    """gop_frames is the sum of gop_frame_count over the gop_header units of the stream."""
    require(end.frame_count == frame_count, "MISMATCH", "6.11", end.at("frame_count"))              # SS-EN-001
    require(end.unit_count == unit_count, "MISMATCH", "6.11", end.at("unit_count"))
    require(end.index_offset == index_offset, "MISMATCH", "6.11", end.at("index_offset"))
    if seq.frame_count != 0:                                                          # SS-SP-006
        require(seq.frame_count == gop_frames, "MISMATCH", "6.4", end.at("frame_count"))


# ---- 6.14 increment ----

# The bits of increment_flags
PARENTS, MOVES, UPDATES, REMOVALS, NEW, POSITION_SHIFT, ATTRIBUTE_STEP, PREDICTORS, SH, COMPENSATION, \
    MOVE_PREDICTORS, EXTRAPOLATES_OPACITY = (1 << bit for bit in range(12))
ABSENT = {"parent_count": 0, "move_count": 0, "update_count": 0, "remove_count": 0, "new_count": 0,
          "position_shift": 0, "attribute_step": (0, 0, 0, 0, 0), "sh_mode": 0, "vq_stage_count": 0,
          "codebook_ids": (), "compensation_log_scale": 0, "compensation_opacity": 0}

# SS-IN-011
SECTIONS = ("modes", "move_predictors", "moves", "updates", "predictors", "new")


def parse_increment(reader, unit, frame, context, parent_count):
    """The elements of 5.14 up to the sections.

    `context` has the sequence, the level, the profile, and what the GOP defines; parent_count is that of 7.4.2.
    """
    u = Record(syntax.INCREMENT_FIXED, reader)
    q, flags = "6.14", u.increment_flags
    reserved_zero(u, "increment_flags", q, 0xF000)                                    # SS-IN-002
    flags_at = u.at("increment_flags")
    dynamic = context.profile == c.PROFILE_DYNAMIC
    require(not flags & PREDICTORS or dynamic, "RESERVED", q, flags_at)               # SS-IN-004
    require(not flags & PREDICTORS or flags & NEW, "CONSTRAINT", q, flags_at)         # SS-IN-003
    check_prediction_flags(flags, dynamic, frame, flags_at)
    u.predictors = bool(flags & PREDICTORS)
    u.predicts_moves = bool(flags & MOVE_PREDICTORS)
    u.extrapolates_opacity = bool(flags & EXTRAPOLATES_OPACITY)
    for element, value in ABSENT.items():                                             # SS-IN-001
        setattr(u, element, value)
    for bit, part in enumerate(syntax.INCREMENT_PARTS):
        if flags >> bit & 1:
            u.read(part, reader)
            if 1 << bit == SH:
                read_sh(u, reader)
    check_counts(u, unit, frame, context.level, parent_count)
    if u.has("position_shift"):
        in_range(u, "position_shift", 0, context.seq.position_bits - 1, q)
    if u.has("attribute_step"):
        in_range(u, "attribute_step", 0, c.MAX_ATTRIBUTE_STEP, q)
    if u.predictors:
        in_range(u, "predictor_block_log2", 0, 16, q)
        in_range(u, "neighbour_count", 1, c.MAX_NEIGHBOURS, q)
    check_sh(u, unit, context)
    if u.predicts_moves:
        in_range(u, "move_block_log2", 0, 16, q)
    return u


def check_prediction_flags(flags, dynamic, frame, at):
    """The flags of move predictors and extrapolation"""
    either = flags & (MOVE_PREDICTORS | EXTRAPOLATES_OPACITY)
    require(not either or dynamic, "RESERVED", "6.14", at)                            # SS-IN-014
    require(not either or not frame.intra, "MISMATCH", "6.14", at)                    # SS-IN-015
    good = flags & MOVES or not flags & MOVE_PREDICTORS                               # SS-IN-013
    require(good, "CONSTRAINT", "6.14", at)
    good = flags & PARENTS or not flags & EXTRAPOLATES_OPACITY
    require(good, "CONSTRAINT", "6.14", at)


def divide_increment(u, reader, block_log2):
    """The division into sections, SS-IN-011"""
    u.sections = [Division(name, count, reader, block_log2) for name, count in section_counts(u) if count > 0]
    reader.check_end("5.14")


def read_sh(u, reader):
    """The part `sh` with the ranges that its reading needs (SS-IN-010)"""
    one_of(u, "sh_mode", (0, 1, 2), "6.14", "RESERVED")
    in_range(u, "sh_mode", 1, 2, "6.14")
    if u.sh_mode == 2:
        u.read(syntax.INCREMENT_STAGES, reader)
        in_range(u, "vq_stage_count", 1, c.MAX_STAGES, "6.14")
        u.codebook_ids_at = reader.pos
        u.codebook_ids = reader.values("u8", u.vq_stage_count, "6.14")


def check_counts(u, unit, frame, level, parent_count):
    """What is known of the counts before a section is read"""
    q = "6.14"
    for element in ("parent_count", "move_count", "update_count", "remove_count", "new_count"):
        if u.has(element):                                                            # SS-IN-001
            in_range(u, element, 1, 2 ** 32 - 1, q)
    for element in ("parent_count", "new_count"):                                     # SS-IN-008
        if u.has(element):
            in_range(u, element, 1, c.MAX_GAUSSIANS[level], "A.2", "OVER_LIMIT")
    if u.has("new_count"):                                                            # SS-IN-009
        in_range(u, "new_count", 1, c.MAX_NEW_PER_BYTE * unit.payload_length, "A.2", "OVER_LIMIT")
    parents_at = u.at("parent_count" if u.has("parent_count") else "increment_flags")
    require(u.parent_count == parent_count, "MISMATCH", q, parents_at)                # SS-IN-005
    for element in ("move_count", "update_count", "remove_count"):                    # SS-IN-006
        if u.has(element):
            in_range(u, element, 1, u.parent_count, q, "MISMATCH")
    if frame.intra and u.has("remove_count"):                                         # SS-IN-007
        raise StreamError("MISMATCH", q, u.at("remove_count"))


def check_sh(u, unit, context):
    """SS-IN-010 against the frame and the definitions in force"""
    q = "6.14"
    if u.sh_mode != 0:
        require(context.sh_transform is not None, "OUT_OF_RANGE", q, u.at("sh_mode"))
    for stage, identifier in enumerate(u.codebook_ids):
        at = u.codebook_ids_at + stage
        require(identifier <= c.MAX_ID, "OUT_OF_RANGE", q, at)
        book = context.codebooks.get(identifier)
        require(book is not None, "UNDEFINED", q, at)
        require(book.temporal_layer <= unit.temporal_layer, "CONSTRAINT", q, at)
        require(book.component_count == context.sh_transform.rank, "MISMATCH", q, at)


def section_counts(u):
    """The table of SS-IN-011: (section, count) in order."""
    changed = u.increment_flags & (MOVES | UPDATES | REMOVALS)
    predictor_count = ceil_div(u.new_count, 2 ** u.predictor_block_log2) if u.predictors else 0
    move_predictor_count = ceil_div(u.move_count, 2 ** u.move_block_log2) if u.predicts_moves else 0
    return list(zip(SECTIONS, (u.parent_count if changed else 0, move_predictor_count, u.move_count, u.update_count,
                               predictor_count, u.new_count)))


# ---- 6.15 section ----


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


# ---- 6.16 operating_points ----


def parse_points(reader):
    """The entries as far as they are checked without the stream before them."""
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
        require(before is None or before < entry.point, "CONSTRAINT", q, entry.at("spatial_layer"))   # SS-PL-001
        before = entry.point
    return entries
