"""Clauses 7.1, 7.3.2 and 9: state, phases, units, increments, ends of frames and GOPs, resynchronisation."""

from . import constants as c, points, semantics
from .cells import decode_cells
from .conventions import ByteReader, crc32
from .errors import StreamError, require
from .frame import Frame, Gop
from .increment import Context, Increment, Section, parse_sections
from .models import section_planes
from .network import parse_weights
from .scene_description import parse_scene_description

START, SEQUENCE, GOP, FRAME, BETWEEN = "START", "SEQUENCE", "GOP", "FRAME", "BETWEEN"
LISTED, INDEXED, ENDED, LOST = "LISTED", "INDEXED", "ENDED", "LOST"
IN_GOP = (GOP, FRAME, BETWEEN)

# SS-BS-001: phases in which a unit of known type is allowed
ALLOWED = {
    c.UT_SEQUENCE: (START, SEQUENCE, GOP, FRAME, BETWEEN, LISTED, INDEXED, LOST),
    c.UT_SCENE: (SEQUENCE,),
    c.UT_GOP: (SEQUENCE, GOP, FRAME, BETWEEN, LOST),
    c.UT_TRANSFORM: (GOP,),
    c.UT_WEIGHTS: (GOP,),
    c.UT_CODEBOOK: IN_GOP,
    c.UT_FRAME: IN_GOP,
    c.UT_POINTS: (SEQUENCE, GOP, FRAME, BETWEEN, LOST),
    c.UT_INDEX: (SEQUENCE, GOP, FRAME, BETWEEN, LISTED, LOST),
    c.UT_END: (SEQUENCE, GOP, FRAME, BETWEEN, LISTED, INDEXED, LOST),
}
ENDS_GOP = (c.UT_GOP, c.UT_POINTS, c.UT_INDEX, c.UT_END)
ENDS_FRAME = ENDS_GOP + (c.UT_FRAME, c.UT_CODEBOOK)
LAYERED = (c.UT_FRAME, c.UT_CODEBOOK, c.UT_INCREMENT)
NOT_CRITICAL = (c.UT_SCENE, c.UT_POINTS, c.UT_INDEX)
INTACT_BYTES = {c.UT_SEQUENCE: 106, c.UT_GOP: 12}


class State:
    """7.1.1, but for the frame in progress, which is a Frame."""

    def __init__(self):
        self.offset = c.FILE_HEADER_BYTES
        self.phase = START
        self.sequence = None
        self.sequence_payload = None
        self.described = False                      # a scene_description came in phase SEQUENCE
        self.next_gop = self.next_frame = 0         # next_gop is None in B.3 before the first GOP
        self.frames_left = 0
        self.compare = True
        self.gop = None                             # with its reference frames
        self.frame = None
        self.undefine()

    def undefine(self):
        """SS-GH-004"""
        self.dc_transform, self.sh_transform, self.codebook = {}, {}, {}
        self.network = None


class Record:
    """What is compared with the end, index and operating_points units."""

    def __init__(self):
        self.unit_count = 0
        self.frame_count = 0
        self.gop_frames = 0
        self.gops = []                              # (frame, offset)
        self.index_offset = 0
        self.ledger = points.Ledger()
        self.used_all = True                        # every unit belonged to the operating point


class Decoder:
    """Decodes a stream; afterwards `frames`, `errors` (the first one is the verdict) and `lost` tell the result.

    inside: offset of a gop_header at which decoding starts after the sequence_parameters (B.3), None for the start.
    """

    def __init__(self, data, point=None, inside=None):
        self.data = data
        self.point = points.EVERYTHING if point is None else point
        self.inside = inside
        self.file_header = None                     # as long as none has been read
        self.scene = None
        self.frames = []
        self.errors = []
        self.lost = []                              # ranges of display indices: [first, last]
        self.networks = []                          # of all GOPs
        self.coded = {}                             # unit offset -> coded sections, for entropy_state.py
        self.state = State()
        self.record = Record()

    @property
    def sequence(self):
        return self.state.sequence

    @property
    def gops(self):
        return self.record.gops

    def found(self, subset):
        """The errors that are found by a decoder that shows frames in full, or subsets."""
        return [error for error in self.errors if not (subset and error.of_carried)]

    # ---- 7.1.3: units ----

    def decode(self):
        state = self.state
        try:
            self.file_header = semantics.parse_file_header(self.data)
        except StreamError as error:
            self.report(error)
            return self
        while state.phase != ENDED and state.offset < len(self.data):
            state.offset = self.unit(state.offset)
        if state.phase == ENDED:
            if state.offset < len(self.data):                                         # SS-EN-002
                self.report(StreamError("TRAILING_BYTES", "6.11", state.offset))
            return self
        if state.phase != LOST:                                                       # SS-ER-011
            self.fatal(StreamError("TRUNCATED", "B.1", state.offset))
        self.end_of_gop()
        return self

    def unit(self, offset):
        """The unit at `offset`; gives the offset at which decoding goes on."""
        try:
            unit = semantics.read_unit_header(self.data, offset, self.record.unit_count)
        except StreamError as error:                # its extent is not usable
            if self.state.phase != LOST:
                self.fatal(error)
            return self.scan(offset + 1)
        self.process(unit)
        self.count(unit)
        return self.next_offset(unit)

    def next_offset(self, unit):
        """The next unit; in B.3 after the sequence_parameters the one at which the decoder starts."""
        if self.inside is not None and unit.unit_type == c.UT_SEQUENCE and self.state.next_gop == 0:
            self.state.next_gop, self.state.compare = None, False
            return self.inside
        return unit.end

    def count(self, unit):
        self.record.unit_count += 1
        self.record.ledger.add(unit, self.state.gop)
        if unit.unit_type == c.UT_FRAME:
            self.record.frame_count += 1

    def process(self, unit):
        """SS-ER-008: a unit, and what its error costs"""
        if self.state.phase == LOST and not self.is_wanted(unit):
            return
        try:
            semantics.check_unit_type(unit, self.file_header.profile)
        except StreamError as error:
            self.fatal(error)
            return
        if not unit.known:                                                            # SS-UH-004
            return
        if unit.unit_type == c.UT_INCREMENT:
            self.increment(unit)
            return
        try:
            semantics.check_elements(unit)
            if not self.is_discarded(unit):
                self.handle(unit)
        except StreamError as error:
            if unit.unit_type in NOT_CRITICAL:
                self.report(error)
            else:
                self.fatal(error)
        if unit.unit_type == c.UT_SCENE and self.state.phase == SEQUENCE:             # with a fault or without
            self.state.described = True

    def handle(self, unit):
        """A unit with a unit_header without fault that belongs to the operating point."""
        self.check_phase(unit)
        if unit.unit_type in ENDS_FRAME:
            self.end_of_frame(unit)
        if unit.unit_type in ENDS_GOP:
            self.end_of_gop(unit)
        if unit.unit_type in (c.UT_POINTS, c.UT_INDEX):
            self.state.phase = LISTED if unit.unit_type == c.UT_POINTS else INDEXED
        self.check_payload_crc(unit)
        {c.UT_SEQUENCE: self.on_sequence, c.UT_SCENE: self.on_scene, c.UT_GOP: self.on_gop, c.UT_FRAME: self.on_frame,
         c.UT_TRANSFORM: self.on_transform, c.UT_CODEBOOK: self.on_codebook, c.UT_WEIGHTS: self.on_weights,
         c.UT_POINTS: self.on_points, c.UT_INDEX: self.on_index, c.UT_END: self.on_end}[unit.unit_type](unit)

    def is_discarded(self, unit):
        """SS-BS-003: a unit that does not belong to the operating point"""
        state = self.state
        if state.phase not in IN_GOP or unit.unit_type not in LAYERED:
            return False
        beyond = not points.belongs(unit, self.point, state.sequence, state.gop)
        if beyond:
            self.record.used_all = False
        return beyond

    def check_phase(self, unit):
        """SS-BS-001"""
        state = self.state
        allowed = state.phase in ALLOWED[unit.unit_type]
        if unit.unit_type == c.UT_FRAME and state.phase in (FRAME, BETWEEN):
            allowed = allowed and state.frames_left > 0
        if unit.unit_type == c.UT_SCENE:                                              # SS-SD-007
            allowed = allowed and not state.described
        require(allowed, "UNEXPECTED_UNIT", "7.1.2", unit.start)

    def check_payload_crc(self, unit):
        """SS-UH-009"""
        payload = self.data[unit.payload_start:unit.end]
        require(unit.payload_crc == crc32(payload), "CHECKSUM", "6.3", unit.at("payload_crc"))

    def payload_reader(self, unit):
        return ByteReader(self.data, unit.payload_start, unit.end)

    def report(self, error):
        self.errors.append(error)
        if not error.of_carried:                    # the verdict of who shows subsets does not depend on it
            self.state.compare = False
        if self.state.frame is not None:
            self.state.frame.faulty = True

    def fatal(self, error):
        self.report(error)
        self.output_frame()
        self.state.phase = LOST

    # ---- 7.1.4: increments ----

    def increment(self, unit):
        """SS-LO-002: an increment, and what its error costs"""
        state, frame, r = self.state, self.state.frame, unit.refinement
        own = state.phase == FRAME and unit.frame == frame.number
        if own:
            frame.seen = True
        try:
            semantics.check_elements(unit)
            if self.is_discarded(unit):
                return
            require(state.phase == FRAME, "UNEXPECTED_UNIT", "7.1.2", unit.start)
            require(own, "MISMATCH", "7.1.2", unit.at("frame"))                       # SS-BS-002
            require(r < state.sequence.refinement_count, "OUT_OF_RANGE", "7.1.4", unit.at("refinement"))
        except StreamError as error:
            self.report(error)
            return
        if r >= frame.limit:                                                          # SS-LO-001
            return
        dropped = r
        try:
            self.check_layers(unit)
            if not frame.expects(unit.spatial_layer, r):                              # SS-BS-004
                dropped = frame.decoded_of(unit.spatial_layer)
                raise StreamError("UNEXPECTED_UNIT", "7.1.4", unit.at("refinement"))
            self.check_payload_crc(unit)
            increment = Increment(unit, frame, self.context(frame)).decode(self.payload_reader(unit))
            self.check_digest(unit, increment)
        except StreamError as error:
            self.report(error)
            frame.limit = min(frame.limit, dropped)
            return
        frame.accept(increment)
        self.coded[unit.start] = increment.coded

    def check_layers(self, unit):
        semantics.check_layers(unit, self.state.sequence)                             # SS-UH-008
        layer = self.state.gop.order(unit.frame)[1]                                   # SS-BS-009
        require(unit.temporal_layer == layer, "MISMATCH", "7.3.1", unit.at("temporal_layer"))

    def check_digest(self, unit, increment):
        """SS-DG-004, SS-IN-012"""
        digest = self.state.frame.refinement_digest(unit.spatial_layer, unit.refinement, increment.list)
        header = increment.header
        require(header.refinement_digest == digest, "DIGEST", "7.9.2", header.at("refinement_digest"))

    def context(self, frame):
        """Definitions that a frame uses."""
        state, header = self.state, frame.header
        return Context(self.file_header, state.sequence, state.dc_transform[header.dc_transform_id],
                       state.sh_transform.get(header.sh_transform_id), state.codebook, state.network)

    # ---- 7.1.5: ends of frames and GOPs, gaps ----

    def end_of_frame(self, unit):
        """SS-BS-005"""
        frame = self.state.frame
        if frame is None:
            return
        if frame.intra and not frame.seen:
            self.report(StreamError("CONSTRAINT", "7.1.5", unit.start))
        if frame.compares_carried() and frame.header.carried_digest != frame.carried_digest():        # SS-DG-005
            error = StreamError("DIGEST", "7.9.3", frame.header.at("carried_digest"))
            error.of_carried = True
            self.report(error)
        self.output_frame()

    def output_frame(self):
        if self.state.frame is not None:
            self.frames.append(self.state.frame)
            self.state.frame = None

    def end_of_gop(self, unit=None):
        """SS-BS-006; `unit` is the one that ends the GOP, none at the end of the data."""
        state = self.state
        all_frames_due = state.phase in (LOST, GOP) or (state.gop is not None and not state.gop.predicted)
        if state.frames_left > 0 and all_frames_due:
            self.lose(state.next_frame, self.expected_frame() - 1)
            if state.phase != LOST:
                self.report(StreamError("MISMATCH", "7.1.5", unit.start))
        state.next_frame += state.frames_left
        state.frames_left = 0

    def gap_before_gop(self, header, unit):
        """SS-BS-007"""
        state = self.state
        if header.gop_index > state.next_gop or unit.frame > state.next_frame:
            self.lose(state.next_frame, unit.frame - 1)
            if state.phase != LOST:
                self.report(StreamError("MISMATCH", "7.1.5", unit.start))

    def gap_before_frame(self, frame, unit):
        state = self.state
        if not state.gop.predicted and unit.frame > state.next_frame:                 # SS-BS-008
            self.lose(state.next_frame, unit.frame - 1)
            self.report(StreamError("MISMATCH", "7.1.5", unit.start))
        if not frame.intra and frame.reference is None:                               # SS-LO-003
            self.report(StreamError("UNDEFINED", "7.3.2", unit.start))

    def expected_frame(self):
        """Display index after this GOP."""
        return self.state.next_frame + self.state.frames_left

    def lose(self, first, last):
        """SS-ER-005: ranges that touch are one range."""
        if first > last:
            return
        if self.lost and self.lost[-1][1] + 1 == first:
            self.lost[-1][1] = last
        else:
            self.lost.append([first, last])

    # ---- 7.1.6: resynchronisation ----

    def is_wanted(self, unit):
        """SS-ER-004"""
        if self.sequence is None:
            return unit.unit_type == c.UT_SEQUENCE and self.is_intact(unit)
        if unit.unit_type == c.UT_GOP:
            return self.is_intact(unit) and self.is_acceptable(unit)
        return unit.unit_type in (c.UT_POINTS, c.UT_INDEX, c.UT_END)

    def is_intact(self, unit):
        if unit.unit_flags & 0xFE or unit.reserved_zero or unit.payload_length != INTACT_BYTES[unit.unit_type]:
            return False
        return unit.payload_crc == crc32(self.data[unit.payload_start:unit.end])

    def is_acceptable(self, unit):
        state = self.state
        if state.next_gop is None:
            return True
        gop_index = self.payload_reader(unit).value("u32", "6.5")
        return gop_index >= state.next_gop and unit.frame >= self.expected_frame()

    def scan(self, start):
        wanted = c.UT_SEQUENCE if self.sequence is None else c.UT_GOP
        for offset in range(start, len(self.data)):
            if self.data[offset] == wanted and self.is_intact_at(offset):
                return offset
        return len(self.data)

    def is_intact_at(self, offset):
        try:
            return self.is_intact(semantics.read_unit_header(self.data, offset, self.record.unit_count))
        except StreamError:
            return False

    # ---- 7.1.2: effects of units ----

    def on_sequence(self, unit):
        state, payload = self.state, self.data[unit.payload_start:unit.end]
        sequence = semantics.parse_sequence_parameters(self.payload_reader(unit), self.file_header.profile)
        if state.sequence is not None:                                                # SS-SP-005
            require(payload == state.sequence_payload, "CONSTRAINT", "6.4", unit.payload_start)
            return
        state.sequence, state.sequence_payload = sequence, payload
        if state.phase == START:
            state.phase = SEQUENCE

    def on_scene(self, unit):
        self.scene = parse_scene_description(self.payload_reader(unit))

    def on_gop(self, unit):
        state = self.state
        header = semantics.parse_gop_header(self.payload_reader(unit), unit, self.file_header.profile,
                                            state.sequence.temporal_layer_count)
        if state.next_gop is None:                                                    # SS-BS-012
            state.next_gop, state.next_frame = header.gop_index, unit.frame
        require(header.gop_index >= state.next_gop, "MISMATCH", "7.1.5", header.at("gop_index"))      # SS-BS-007
        require(unit.frame >= state.next_frame, "MISMATCH", "7.1.5", unit.at("frame"))
        self.gap_before_gop(header, unit)
        state.undefine()
        state.next_gop, state.next_frame = header.gop_index + 1, unit.frame
        state.frames_left = header.gop_frame_count
        state.gop = Gop(header, unit.frame)
        state.phase = GOP
        self.record.gops.append((unit.frame, unit.start))
        self.record.gop_frames += header.gop_frame_count

    def on_transform(self, unit):
        state = self.state
        self.check_in_gop(unit)
        transform = semantics.parse_transform(self.payload_reader(unit), state.sequence.sh_planes,
                                              state.dc_transform, state.sh_transform)
        target = state.dc_transform if transform.transform_kind == 0 else state.sh_transform
        target[transform.transform_id] = transform

    def on_codebook(self, unit):
        state = self.state
        self.check_in_gop(unit)
        semantics.check_layers(unit, state.sequence)
        book = semantics.parse_codebook(self.payload_reader(unit), state.codebook, unit.temporal_layer,
                                        self.file_header.level)
        state.codebook[book.codebook_id] = book
        if state.phase == FRAME:
            state.phase = BETWEEN

    def on_weights(self, unit):
        self.check_in_gop(unit)
        self.state.network = parse_weights(self.payload_reader(unit), self.state.network is not None)
        self.networks.append(self.state.network)

    def check_in_gop(self, unit):
        """SS-BS-002 for what a GOP defines"""
        require(unit.frame == self.state.gop.first_frame, "MISMATCH", "7.1.2", unit.at("frame"))

    def on_frame(self, unit):
        state = self.state
        good = state.next_frame <= unit.frame < self.expected_frame()                 # SS-BS-010, SS-BS-008
        require(good, "MISMATCH", "7.3.2", unit.at("frame"))
        self.check_layers(unit)
        header = semantics.parse_frame_header(self.payload_reader(unit), state.sequence, self.file_header.level,
                                              state.gop.order(unit.frame)[0], state.dc_transform, state.sh_transform)
        frame = Frame(unit.frame, header, state.gop, state.sequence)
        if not frame.intra and frame.has_carried_reference():
            self.read_cells(frame, unit)
        self.gap_before_frame(frame, unit)
        state.frames_left -= unit.frame + 1 - state.next_frame
        state.next_frame = unit.frame + 1
        state.gop.frames[frame.index_in_gop] = state.frame = frame
        state.phase = FRAME

    def read_cells(self, frame, unit):
        """SS-FR-008: the cells of a frame, where there is something to carry"""
        seq, header = self.sequence, frame.header
        sections = []
        if header.cells is not None:
            sections.append(Section(header.cells, section_planes("cells"), seq))
        frame.cell_models = parse_sections(sections, frame.reference.cell_models)
        frame.cells = decode_cells(header.cell_log2, sections[0] if sections else None, seq)
        self.coded[unit.start] = [section.coded() for section in sections]

    def on_points(self, unit):
        entries = semantics.parse_points(self.payload_reader(unit))
        if self.state.compare and self.record.used_all:
            points.check_points(entries, self.record.ledger, self.frames, self.sequence)

    def on_index(self, unit):
        semantics.parse_index(self.payload_reader(unit), self.record.gops if self.state.compare else None)
        self.record.index_offset = unit.start

    def on_end(self, unit):
        record = self.record
        end = semantics.parse_end(self.payload_reader(unit))
        if self.state.compare:
            semantics.check_end(end, self.sequence, record.frame_count, record.unit_count, record.index_offset,
                                record.gop_frames)
        self.state.phase = ENDED
