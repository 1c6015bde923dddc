"""Clauses 7.1 and 7.13: state, order of units, confined and fatal errors; 9.3."""

import constants as c
import points
import semantics
from conventions import ByteReader, crc32
from dynamic import DynamicFrame, Gop
from errors import StreamError, require
from increment import Context, Increment
from intra import Frame, decode_refinement
from network import parse_weights
from semantics_dynamic import parse_points

START, SEQUENCE, GOP, FRAME, BETWEEN = "START", "SEQUENCE", "GOP", "FRAME", "BETWEEN"
LISTED, INDEXED, ENDED = "LISTED", "INDEXED", "ENDED"

# 7.1.2: phases in which a unit of known type is allowed; in profile 1 also those of ALLOWED_DYNAMIC
ALLOWED = {
    c.UT_SEQUENCE: (START, SEQUENCE, GOP, FRAME, BETWEEN, LISTED, INDEXED),
    c.UT_GOP: (SEQUENCE, GOP, FRAME, BETWEEN),
    c.UT_TRANSFORM: (GOP,),
    c.UT_CODEBOOK: (GOP,),
    c.UT_FRAME: (GOP, FRAME, BETWEEN),
    c.UT_REFINEMENT: (FRAME,),
    c.UT_POINTS: (SEQUENCE, GOP, FRAME, BETWEEN),
    c.UT_INDEX: (SEQUENCE, GOP, FRAME, BETWEEN, LISTED),
    c.UT_END: (SEQUENCE, GOP, FRAME, BETWEEN, LISTED, INDEXED),
}
ALLOWED_DYNAMIC = dict(ALLOWED)
ALLOWED_DYNAMIC.update({c.UT_CODEBOOK: (GOP, FRAME, BETWEEN), c.UT_REFINEMENT: (), c.UT_INCREMENT: (FRAME,),
                        c.UT_WEIGHTS: (GOP,)})
CLOSES_GOP = (c.UT_GOP, c.UT_POINTS, c.UT_INDEX, c.UT_END)


class Decoder:
    """Decodes a stream; afterwards `frames` and `errors` (first one: the verdict) tell the result."""

    def __init__(self, data, point=None, inside=False):
        self.data = data
        self.point = points.EVERYTHING if point is None else point
        self.inside = inside                        # B.3: units before some gop_header were left out
        self.file_header = None                     # as long as none has been read
        self.frames = []
        self.errors = []
        self.networks = []                          # of all GOPs
        self.coded = {}                             # unit offset -> coded sections, for entropy_state.py
        # 7.1.1
        self.phase = START
        self.sequence = None
        self.sequence_payload = None
        self.undefine()
        self.next_gop = None if inside else 0
        self.next_frame = None if inside else 0
        self.frames_left = 0
        self.frame = None
        self.gop = None                             # in profile 1
        # what the operating_points, index and end units are compared with
        self.unit_count = 0
        self.frame_count = 0
        self.gop_frames = 0
        self.gops = []
        self.gop_header_frame = None
        self.index_offset = 0
        self.ledger = points.Ledger()
        self.used_all = True                        # every unit belonged to the operating point

    def undefine(self):
        self.dc_transform, self.sh_transform, self.codebook = {}, {}, {}
        self.network = None

    @property
    def dynamic(self):
        return self.file_header.profile == c.PROFILE_DYNAMIC

    # ---- 9.3 ----

    def decode(self):
        try:
            self.start()
            pos = c.FILE_HEADER_BYTES
            while self.phase != ENDED:
                pos = self.unit(pos)
            require(pos == len(self.data), "TRAILING_BYTES", "6.11", pos)
        except StreamError as error:
            self.errors.append(error)
            self.end_frame()
        return self

    def start(self):
        self.file_header = semantics.parse_file_header(self.data)

    def unit(self, pos):
        """9.3 step 2; returns the offset of the next unit."""
        unit = semantics.parse_unit_header(self.data, pos, self.unit_count, self.file_header.profile)   # 2.1 to 2.8
        frame_unit = unit.known and self.phase == FRAME and unit.unit_type == (
            c.UT_INCREMENT if self.dynamic else c.UT_REFINEMENT)
        if unit.known and not self.beyond_point(unit, frame_unit):                 # 2.9
            if frame_unit:
                self.frame_unit(unit)
            else:
                self.other_unit(unit)
        self.unit_count += 1
        if unit.known and unit.unit_type == c.UT_FRAME:
            self.frame_count += 1
        self.ledger.add(unit, self.gop)
        return unit.end

    def beyond_point(self, unit, frame_unit):
        """What is passed over because it does not belong to the operating point: 7.1.3 before its steps, SS-BS-011"""
        if self.dynamic:
            layered = unit.unit_type in (c.UT_FRAME, c.UT_CODEBOOK, c.UT_INCREMENT)
            beyond = (layered and self.phase in (GOP, FRAME, BETWEEN)
                      and not points.belongs(unit, self.point, self.sequence, self.gop))
            stood = frame_unit and unit.frame == self.frame.number
        else:
            beyond = frame_unit and unit.refinement > self.point[2]
            stood = frame_unit
        if beyond:
            self.used_all = False
            if stood:
                self.frame.units_seen += 1
        return beyond

    def check_payload_crc(self, unit):
        payload = self.data[unit.payload_start:unit.end]
        require(unit.payload_crc == crc32(payload), "CHECK_SUM", "6.3", unit.at("payload_crc"))

    def payload_reader(self, unit):
        return ByteReader(self.data, unit.payload_start, unit.end)

    def other_unit(self, unit):
        self.check_payload_crc(unit)                                               # 2.10
        self.check_place(unit)                                                     # 2.11
        {c.UT_SEQUENCE: self.on_sequence, c.UT_GOP: self.on_gop, c.UT_FRAME: self.on_frame,
         c.UT_TRANSFORM: self.on_transform, c.UT_CODEBOOK: self.on_codebook, c.UT_WEIGHTS: self.on_weights,
         c.UT_POINTS: self.on_points, c.UT_INDEX: self.on_index, c.UT_END: self.on_end}[unit.unit_type](unit)   # 2.12

    def check_place(self, unit):
        """9.3 step 2.11: SS-BS-001 to SS-BS-003, SS-UH-007, SS-BS-006, SS-LO-005, SS-BS-010, SS-BS-009"""
        kind = unit.unit_type
        allowed = self.phase in (ALLOWED_DYNAMIC if self.dynamic else ALLOWED).get(kind, ())
        if kind == c.UT_FRAME and self.phase in (FRAME, BETWEEN) and self.frames_left == 0:
            allowed = False
        require(allowed, "UNEXPECTED_UNIT", "7.1.2", unit.start)
        self.check_layers(unit)
        if kind in CLOSES_GOP or kind == c.UT_FRAME or (kind == c.UT_CODEBOOK and self.dynamic):
            if self.frame is not None:
                if self.frame.units_seen == 0:
                    self.confined(StreamError("CONSTRAINT", "7.1.3", unit.start))
                elif self.frame.without_reference():
                    self.confined(StreamError("UNDEFINED", "7.20", unit.start))
            self.end_frame()
        if kind in CLOSES_GOP:
            complete = self.phase != GOP if self.gop is not None and self.gop.predicted else self.frames_left == 0
            require(complete, "MISMATCH", "7.1.2", unit.start)
        if kind == c.UT_GOP and self.next_frame is not None:
            require(unit.frame == self.next_frame + self.frames_left, "MISMATCH", "6.5", unit.at("frame"))
        if kind in (c.UT_TRANSFORM, c.UT_CODEBOOK, c.UT_WEIGHTS):
            require(unit.frame == self.gop_header_frame, "MISMATCH", "7.1.2", unit.at("frame"))
        if kind == c.UT_FRAME:
            later = self.gop is not None and self.gop.predicted and self.phase != GOP
            last = self.next_frame + self.frames_left - 1 if later else self.next_frame
            require(self.next_frame <= unit.frame <= last, "MISMATCH", "7.1.2", unit.at("frame"))
            if self.dynamic:                                                       # SS-BS-009
                frame_type, layer, _ = self.gop.order(unit.frame)
                require(unit.temporal_layer == layer, "MISMATCH", "7.13", unit.at("temporal_layer"))
                spatial = 0 if frame_type == c.TYPE_I else self.sequence.top
                require(unit.spatial_layer == spatial, "MISMATCH", "7.13", unit.at("spatial_layer"))

    def check_layers(self, unit):
        """The second part of SS-UH-007"""
        if self.dynamic and self.sequence is not None:
            for element, count in (("spatial_layer", self.sequence.spatial_layer_count),
                                   ("temporal_layer", self.sequence.temporal_layer_count)):
                require(getattr(unit, element) < count, "OUT_OF_RANGE", "6.3", unit.at(element))

    def end_frame(self):
        if self.frame is not None:
            self.check_carried(self.frame)
            self.frames.append(self.frame)
            self.frame = None

    def check_carried(self, frame):
        """SS-DG-007: the digest of what the frame carries where it is shown."""
        at = frame.shown_at() if self.file_header.profile == 1 else None
        if at is not None:
            header = frame.increments[at]
            if header.carried_digest != frame.carried_digest(at[1], frame.carried_lists):
                error = StreamError("DIGEST", "7.18", header.at("carried_digest"))
                error.of_carried = True
                self.errors.append(error)

    def found(self, subset):
        """The errors that are found by who shows frames in full, or as subsets."""
        return [error for error in self.errors if not (subset and error.of_carried)]

    def confined(self, error):
        self.errors.append(error)
        self.frame.dropping = True
        self.frame.erroneous = True

    # ---- effects of 7.1.2 ----

    def on_sequence(self, unit):
        sequence = semantics.parse_sequence_parameters(self.payload_reader(unit), self.file_header.profile)
        payload = self.data[unit.payload_start:unit.end]
        if self.phase == START:
            self.sequence, self.sequence_payload = sequence, payload
            self.phase = SEQUENCE
        else:
            require(payload == self.sequence_payload, "CONSTRAINT", "6.4", unit.payload_start)

    def on_gop(self, unit):
        gop = semantics.parse_gop_header(self.payload_reader(unit), unit, self.next_gop, self.file_header.profile,
                                         self.sequence.temporal_layer_count)
        self.gops.append((unit.frame, unit.start))
        self.gop_frames += gop.gop_frame_count
        self.gop_header_frame = unit.frame
        self.undefine()
        self.frames_left = gop.gop_frame_count
        self.next_gop = gop.gop_index + 1
        self.next_frame = unit.frame
        self.gop = Gop(gop, unit.frame) if self.dynamic else None
        self.phase = GOP

    def on_transform(self, unit):
        transform = semantics.parse_transform(self.payload_reader(unit), self.sequence.sh_planes,
                                              self.dc_transform, self.sh_transform)
        target = self.dc_transform if transform.transform_kind == 0 else self.sh_transform
        target[transform.transform_id] = transform

    def on_codebook(self, unit):
        book = semantics.parse_codebook(self.payload_reader(unit), self.codebook,
                                        unit.temporal_layer if self.dynamic else None)
        self.codebook[book.codebook_id] = book
        if self.phase == FRAME:
            self.phase = BETWEEN

    def on_weights(self, unit):
        self.network = parse_weights(self.payload_reader(unit), self.network is not None)
        self.networks.append(self.network)

    def on_frame(self, unit):
        frame_type = self.gop.order(unit.frame)[0] if self.dynamic else None
        header = semantics.parse_frame_header(self.payload_reader(unit), self.dc_transform, self.sh_transform,
                                              self.file_header.level, frame_type)
        self.frames_left -= unit.frame + 1 - self.next_frame
        self.next_frame = unit.frame + 1
        if self.dynamic:
            self.frame = DynamicFrame(unit.frame, header, self.gop, self.sequence)
            self.gop.frames[unit.frame - self.gop.first_frame] = self.frame
        else:
            self.frame = Frame(unit.frame, header, 13 + self.sequence.sh_planes)
        self.phase = FRAME

    def on_points(self, unit):
        entries = parse_points(self.payload_reader(unit))
        if not self.inside and self.used_all and not self.errors:
            points.check_points(entries, self.ledger, self.frames, self.sequence, self.file_header.profile)
        self.phase = LISTED

    def on_index(self, unit):
        semantics.parse_index(self.payload_reader(unit), None if self.inside else self.gops)
        self.index_offset = unit.start
        self.phase = INDEXED

    def on_end(self, unit):
        semantics.parse_end(self.payload_reader(unit), self.sequence, self.frame_count, self.gop_frames,
                            self.unit_count, self.index_offset, self.inside)
        self.phase = ENDED

    # ---- 7.1.3 and 7.13.3 ----

    def frame_unit(self, unit):
        """On a refinement unit or an increment in phase FRAME that belongs to the operating point"""
        self.check_frame_of(unit)                                                  # step 1, fatal
        self.frame.units_seen += 1
        if self.frame.passes_over(unit.refinement):                                # step 2
            return
        try:
            self.check_payload_crc(unit)                                           # step 3
            if self.dynamic:
                self.increment_unit(unit)
            else:
                self.refinement_unit(unit)
        except StreamError as error:
            self.confined(error)

    def check_frame_of(self, unit):
        """Step 1: whether the unit is of the frame in progress"""
        self.check_layers(unit)
        require(unit.frame == self.frame.number, "MISMATCH", "7.1.2", unit.at("frame"))
        if self.dynamic:
            require(unit.temporal_layer == self.frame.layer, "MISMATCH", "7.13", unit.at("temporal_layer"))
            good = self.frame.intra or unit.spatial_layer == self.sequence.top
            require(good, "MISMATCH", "7.13", unit.at("spatial_layer"))

    def refinement_unit(self, unit):
        """Steps 4 to 6 of 7.1.3"""
        frame, r = self.frame, unit.refinement
        expected = r == frame.refinements and r < self.sequence.refinement_count
        require(expected, "UNEXPECTED_UNIT", "7.1.3", unit.at("refinement"))
        header = frame.header
        *decoded, self.coded[unit.start] = decode_refinement(
            self.payload_reader(unit), unit, frame, self.sequence, self.dc_transform[header.dc_transform_id],
            self.sh_transform.get(header.sh_transform_id), self.codebook)
        frame.append(*decoded)

    def increment_unit(self, unit):
        """Steps 4 to 6 of 7.13.3"""
        frame, s, r = self.frame, unit.spatial_layer, unit.refinement
        require(frame.expects(s, r), "UNEXPECTED_UNIT", "7.13", unit.at("refinement"))
        increment = Increment(unit, frame, self.context())
        increment.decode(self.payload_reader(unit), self.file_header.level, frame.models_in_force(s, r))
        header = increment.header
        digest = frame.refinement_digest(s, r, increment.home)                     # SS-IN-008
        require(header.refinement_digest == digest, "DIGEST", "7.18", header.at("refinement_digest"))
        carried_lists = frame.carried_lists
        if r == 0 and not frame.intra:
            carried_lists = frame.carried(increment.cells)
        frame.accept(s, r, increment, carried_lists)
        self.coded[unit.start] = increment.coded

    def context(self):
        """Definitions that the frame in progress uses."""
        header = self.frame.header
        return Context(self.sequence, self.dc_transform[header.dc_transform_id],
                       self.sh_transform.get(header.sh_transform_id), self.codebook, self.network)
