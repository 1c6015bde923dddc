"""Clause 7.1: state, order of units, refinement units of a frame, confined and fatal errors; 9.3."""

import constants as c
import models as plane_models
import reconstruction
import semantics
from conventions import ByteReader, crc32
from errors import StreamError, require
from parsing import BlockDecoder

START, SEQUENCE, GOP, FRAME, INDEXED, ENDED = "START", "SEQUENCE", "GOP", "FRAME", "INDEXED", "ENDED"

# 7.1.2: phases in which a unit of known type is allowed
ALLOWED = {
    c.UT_SEQUENCE: (START, SEQUENCE, GOP, FRAME, INDEXED),
    c.UT_GOP: (SEQUENCE, GOP, FRAME),
    c.UT_TRANSFORM: (GOP,),
    c.UT_CODEBOOK: (GOP,),
    c.UT_FRAME: (GOP, FRAME),
    c.UT_REFINEMENT: (FRAME,),
    c.UT_INDEX: (SEQUENCE, GOP, FRAME),
    c.UT_END: (SEQUENCE, GOP, FRAME, INDEXED),
}
ENDS_FRAME = (c.UT_GOP, c.UT_FRAME, c.UT_INDEX, c.UT_END)


class Frame:
    """A frame in progress or output: canonical planes and unit digests of its refinements."""

    def __init__(self, number, header, plane_count):
        self.number = number
        self.header = header
        self.planes = [[] for _ in range(plane_count)]
        self.digests = []                           # D[r]
        self.units_seen = 0                         # refinement units that stood, of whatever fate

    @property
    def refinements(self):
        return len(self.digests)

    @property
    def gaussians(self):
        return len(self.planes[0])

    def digest(self):
        return reconstruction.frame_digest(self.digests)


class Decoder:
    """Decodes a stream; afterwards `frames` and `errors` (first one: the verdict) tell the result."""

    def __init__(self, data, op_r=None, inside=False):
        self.data = data
        self.op_r = c.MAX_REFINEMENTS - 1 if op_r is None else op_r
        self.inside = inside                        # B.3: units before some gop_header were left out
        self.frames = []
        self.errors = []
        # 7.1.1
        self.phase = START
        self.sequence = None
        self.sequence_payload = None
        self.undefine()
        self.next_gop = None if inside else 0
        self.next_frame = None if inside else 0
        self.frames_left = 0
        self.next_refinement = 0
        self.dropping = False
        self.models = None
        self.frame = None
        # what the end and index units are compared with
        self.unit_count = 0
        self.frame_count = 0
        self.gops = []
        self.index_offset = 0

    def undefine(self):
        self.dc_transform, self.sh_transform, self.codebook = {}, {}, {}

    # ---- 9.3 ----

    def decode(self):
        try:
            self.file_header = semantics.parse_file_header(self.data)
            pos = c.FILE_HEADER_BYTES
            while self.phase != ENDED:
                pos = self.unit(pos)
            require(pos == len(self.data), "TRAILING_BYTES", "6.11", pos)
        except StreamError as error:
            self.errors.append(error)
            self.end_frame()
        return self

    def unit(self, pos):
        """9.3 step 2; returns the offset of the next unit."""
        unit = semantics.parse_unit_header(self.data, pos, self.unit_count)        # 2.1 to 2.8
        passed_over = False
        if unit.known and unit.unit_type == c.UT_REFINEMENT and self.phase == FRAME:
            self.frame.units_seen += 1
            passed_over = unit.refinement > self.op_r or self.dropping
        if unit.known and not passed_over:                                         # 2.9
            if unit.unit_type == c.UT_REFINEMENT and self.phase == FRAME:
                self.refinement_unit(unit)
            else:
                self.other_unit(unit)
        self.unit_count += 1
        return unit.end

    def check_payload_crc(self, unit):
        payload = self.data[unit.payload_start:unit.end]
        require(unit.payload_crc == crc32(payload), "CHECK_SUM", "6.3", unit.at("payload_crc"))

    def payload_reader(self, unit):
        return ByteReader(self.data, unit.payload_start, unit.end)

    def other_unit(self, unit):
        self.check_payload_crc(unit)                                               # 2.10
        self.check_place(unit)                                                     # 2.11
        {c.UT_SEQUENCE: self.on_sequence, c.UT_GOP: self.on_gop, c.UT_FRAME: self.on_frame,
         c.UT_TRANSFORM: self.on_transform, c.UT_CODEBOOK: self.on_codebook,
         c.UT_INDEX: self.on_index, c.UT_END: self.on_end}[unit.unit_type](unit)   # 2.12

    def check_place(self, unit):
        """9.3 step 2.11, SS-BS-001 to SS-BS-003, SS-BS-006"""
        kind = unit.unit_type
        allowed = self.phase in ALLOWED[kind]
        if kind == c.UT_FRAME and self.phase == FRAME and self.frames_left == 0:
            allowed = False
        require(allowed, "UNEXPECTED_UNIT", "7.1.2", unit.start)
        if kind in ENDS_FRAME:
            if self.frame is not None and self.frame.units_seen == 0:
                self.errors.append(StreamError("CONSTRAINT", "7.1.3", unit.start))
            self.end_frame()
        if kind in (c.UT_GOP, c.UT_INDEX, c.UT_END):
            require(self.frames_left == 0, "MISMATCH", "7.1.2", unit.start)
        if kind == c.UT_GOP and self.next_frame is not None:
            require(unit.frame == self.next_frame, "MISMATCH", "6.5", unit.at("frame"))
        if kind in (c.UT_TRANSFORM, c.UT_CODEBOOK, c.UT_FRAME):
            # in phase GOP no frame of the GOP has come, so next_frame is the first frame of the GOP
            require(unit.frame == self.next_frame, "MISMATCH", "7.1.2", unit.at("frame"))

    def end_frame(self):
        if self.frame is not None:
            self.frames.append(self.frame)
            self.frame = None

    # ---- effects of 7.1.2 ----

    def on_sequence(self, unit):
        sequence = semantics.parse_sequence_parameters(self.payload_reader(unit))
        payload = self.data[unit.payload_start:unit.end]
        if self.phase == START:
            self.sequence, self.sequence_payload = sequence, payload
            self.phase = SEQUENCE
        else:
            require(payload == self.sequence_payload, "CONSTRAINT", "6.4", unit.payload_start)

    def on_gop(self, unit):
        gop = semantics.parse_gop_header(self.payload_reader(unit), unit, self.next_gop)
        self.gops.append((unit.frame, unit.start))
        self.undefine()
        self.frames_left = gop.gop_frame_count
        self.next_gop = gop.gop_index + 1
        self.next_frame = unit.frame
        self.phase = GOP

    def on_transform(self, unit):
        transform = semantics.parse_transform(self.payload_reader(unit), self.sequence.sh_planes,
                                              self.dc_transform, self.sh_transform)
        target = self.dc_transform if transform.transform_kind == 0 else self.sh_transform
        target[transform.transform_id] = transform

    def on_codebook(self, unit):
        book = semantics.parse_codebook(self.payload_reader(unit), self.codebook)
        self.codebook[book.codebook_id] = book

    def on_frame(self, unit):
        header = semantics.parse_frame_header(self.payload_reader(unit), self.dc_transform,
                                              self.sh_transform, self.file_header.level)
        self.frames_left -= 1
        self.next_frame += 1
        self.frame_count += 1
        self.next_refinement = 0
        self.dropping = False
        self.models = None
        self.frame = Frame(unit.frame, header, 13 + self.sequence.sh_planes)
        self.phase = FRAME

    def on_index(self, unit):
        semantics.parse_index(self.payload_reader(unit), None if self.inside else self.gops)
        self.index_offset = unit.start
        self.phase = INDEXED

    def on_end(self, unit):
        semantics.parse_end(self.payload_reader(unit), self.sequence, self.frame_count,
                            self.unit_count, self.index_offset, self.inside)
        self.phase = ENDED

    # ---- 7.1.3 ----

    def refinement_unit(self, unit):
        """Steps 2 to 6; step 1 is in unit()."""
        try:
            self.check_payload_crc(unit)                                           # step 2
        except StreamError as error:
            return self.confined(error)
        require(unit.frame == self.frame.number, "MISMATCH", "7.1.2", unit.at("frame"))   # step 3, fatal
        try:
            r = unit.refinement
            expected = r == self.next_refinement and r < self.sequence.refinement_count
            require(expected, "UNEXPECTED_UNIT", "7.1.3", unit.at("refinement"))   # step 4
            planes, digests, models = self.decode_refinement(unit)                 # step 5
        except StreamError as error:
            return self.confined(error)
        for whole, part in zip(self.frame.planes, planes):                         # step 6
            whole.extend(part)
        self.frame.digests.append(digests)
        self.next_refinement += 1
        if models is not None:
            self.models = models

    def confined(self, error):
        self.errors.append(error)
        self.dropping = True

    def decode_refinement(self, unit):
        """Canonical planes, digests and models (None without Gaussians) of a refinement unit."""
        seq, header, r = self.sequence, self.frame.header, unit.refinement
        n_total = header.gaussian_count
        expected = (reconstruction.prefix_count(seq, n_total, r)
                    - reconstruction.prefix_count(seq, n_total, r - 1))
        dc_transform = self.dc_transform[header.dc_transform_id]
        sh_transform = self.sh_transform.get(header.sh_transform_id)
        body = semantics.parse_refinement(self.payload_reader(unit), seq, header, expected,
                                          sh_transform, self.codebook)
        planes = [[] for _ in self.frame.planes]
        by_identity = None
        if body.gaussian_count > 0:
            coded = plane_models.coded_planes(dc_transform.rank, body.sh_mode,
                                              sh_transform.rank if sh_transform else 0,
                                              body.vq_stage_count)
            models = plane_models.parse_models(body.models_section, coded, self.models)
            by_identity = {p.identity(): m for p, m in zip(coded, models)}
            left = body.gaussian_count
            for section in body.block_sections:
                n = min(left, 2 ** seq.block_log2)
                left -= n
                block_at = section.pos
                e = BlockDecoder(section, coded, models, 2 ** body.lanes_log2, n).decode()
                block = reconstruction.BlockValues(e, coded, models, body, seq, dc_transform,
                                                   sh_transform, self.codebook, block_at)
                for whole, part in zip(planes, block.canonical()):
                    whole.extend(part)
        digests = reconstruction.unit_digests(planes)
        digest = reconstruction.frame_digest(self.frame.digests + [digests])
        require(digest == body.refinement_digest, "DIGEST", "7.9", body.at("refinement_digest"))
        return planes, digests, by_identity
