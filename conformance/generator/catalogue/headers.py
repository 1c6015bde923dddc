"""Invalid vectors of bytes and headers: truncation, checksums, file_header and unit_header."""

from oracle import constants as c
from oracle.semantics import parse_unit_header
from ..faults import changed, flipped, in_bytes, inserted, invalid, kind
from ..synth.encoding import file_header, unit
from ..synth.units import Unit, offset_of, units_of
from ..vector import Vector

INTRA, VQ, DYNAMIC = "stream-several-gops", "codebook-two-stages", "temporal-gops-mixed"
LAYERS = "spatial-with-predicted-frames"


def cut(size):
    """The first bytes of the stream; a negative size counts from its end."""
    return in_bytes(lambda data: data[:size])


def cut_in(select, at):
    """The stream ends in a unit, after so many bytes of it."""
    def change(data):
        head, units = units_of(data)
        i = select(units)
        return data[:offset_of(head, units, i) + at]
    return in_bytes(change)


def replaced(at, new):
    return in_bytes(lambda data: data[:at] + new + data[at + len(new):])


def header(**values):
    """Another file_header, with its checksum."""
    def change(data):
        fields = {"profile": data[10], "level": data[11], **values}
        return file_header(**fields) + data[16:]
    return in_bytes(change)


def foreign(number, flags=1):
    """A unit of another type."""
    def make(units):
        header = parse_unit_header(unit(number, b"unknown", flags=0), 0, 0)
        return Unit(header, b"unknown").copy(flags=flags)
    return make


INCREMENT = kind(c.UT_INCREMENT)
END = kind(c.UT_END)

BYTES = [
    ("bytes-none", INTRA, "TRUNCATED", "SS-FH-001 SS-ER-006", "the stream has no bytes", cut(0)),
    ("bytes-signature-begun", INTRA, "TRUNCATED", "SS-FH-001", "three bytes, which are those of the signature", cut(3)),
    ("bytes-file-header-cut", INTRA, "TRUNCATED", "SS-FH-001", "the file_header ends after 15 bytes", cut(15)),
    ("bytes-without-units", INTRA, "TRUNCATED", "SS-BS-011 SS-EN-002", "the stream ends after its file_header",
     cut(16)),
    ("bytes-unit-header-cut", INTRA, "TRUNCATED", "SS-UH-001", "the stream ends in the header of its second unit",
     cut_in(kind(c.UT_GOP), 19)),
    ("bytes-payload-missing", INTRA, "TRUNCATED", "SS-BS-011", "the stream ends after the header of an increment",
     cut_in(INCREMENT, 20)),
    ("bytes-payload-cut", INTRA, "TRUNCATED", "SS-BS-005",
     "the stream ends in a payload; frames before it are output", cut_in(kind(c.UT_INCREMENT, nth=3), 60)),
    ("bytes-skipped-payload-cut", "stream-skipped-checksum", "TRUNCATED", "SS-UH-004",
     "the stream ends in the payload of a skipped unit",
     cut_in(lambda units: 1, 25)),
    ("bytes-frame-cut-off", INTRA, "TRUNCATED", "SS-BS-005",
     "the stream ends between a frame_header and its increment, so that this frame is lost",
     cut_in(kind(c.UT_INCREMENT, nth=-1), 0)),
    ("bytes-predicted-cut", DYNAMIC, "TRUNCATED", "SS-BS-005 SS-LO-003",
     "the stream ends in an increment of a P or B frame", cut_in(kind(c.UT_INCREMENT, nth=-1), 50)),
    ("bytes-without-end", INTRA, "TRUNCATED", "SS-BS-011", "the end unit is missing", cut(-36)),
    ("bytes-end-cut", INTRA, "TRUNCATED", "SS-EN-002", "the last byte is missing", cut(-1)),
    ("bytes-after-end", INTRA, "TRAILING_BYTES", "SS-EN-002", "one byte stands after the end unit",
     in_bytes(lambda data: data + b"\x00")),
    ("bytes-unit-after-end", INTRA, "TRAILING_BYTES", "SS-EN-002 SS-UH-004",
     "a unit that may be skipped stands after the end unit",
     in_bytes(lambda data: data + unit(200, b"late", flags=0))),
    ("bytes-signature-wrong", INTRA, "SIGNATURE", "SS-FH-001 SS-ER-006 SS-ER-007",
     "the first byte is that of another format", replaced(0, b"\x88")),
    ("bytes-signature-of-text", INTRA, "SIGNATURE", "SS-FH-001",
     "a transfer as text has changed the line end in the signature",
     in_bytes(lambda data: data[:4] + b"\x0a\x1a\x0a" + data[8:])),
    ("bytes-signature-wrong-and-cut", INTRA, "SIGNATURE", "SS-FH-001",
     "two bytes, of which the second is not that of the signature", in_bytes(lambda data: data[:1] + b"X")),
    ("bytes-file-header-check", INTRA, "CHECKSUM", "SS-FH-002", "a bit of header_crc is flipped",
     in_bytes(lambda data: data[:12] + bytes([data[12] ^ 1]) + data[13:])),
    ("bytes-level-changed", INTRA, "CHECKSUM", "SS-FH-002 SS-FH-005", "level is 5 and header_crc was not made again",
     replaced(11, b"\x05")),
    ("bytes-unit-header-check", INTRA, "CHECKSUM", "SS-UH-001", "a bit of header_check is flipped",
     flipped(kind(c.UT_FRAME), 6, 1)),
    ("bytes-unit-type-changed", INTRA, "CHECKSUM", "SS-UH-001", "a bit of unit_type is flipped",
     flipped(kind(c.UT_TRANSFORM), 0, 1)),
    ("bytes-payload-length-changed", INTRA, "CHECKSUM", "SS-UH-001", "a bit of payload_length is flipped",
     flipped(kind(c.UT_TRANSFORM), 12, 1)),
    ("bytes-skipped-header-check", "stream-skipped-checksum", "CHECKSUM", "SS-UH-001",
     "header_check of a unit that would be skipped is wrong",
     flipped(lambda units: 1, 6, 1)),
    ("bytes-payload-crc-changed", INTRA, "CHECKSUM", "SS-UH-009 SS-UH-001",
     "payload_crc and header_check are of another payload",
     changed(INCREMENT, raw=lambda u: check_of_other(u))),
]


def check_of_other(u):
    """Differences between the headers for two payloads of equal length."""
    other = u.copy(payload=bytes([u.payload[0] ^ 1]) + u.payload[1:]).bytes()
    return tuple((at, a ^ b) for at, (a, b) in enumerate(zip(u.bytes()[:20], other)) if a != b)


DAMAGED = [("sequence-parameters", c.UT_SEQUENCE, INTRA), ("gop-header", c.UT_GOP, INTRA),
           ("frame-header", c.UT_FRAME, INTRA),
           ("transform", c.UT_TRANSFORM, INTRA), ("codebook", c.UT_CODEBOOK, VQ),
           ("operating-points", c.UT_POINTS, INTRA), ("index", c.UT_INDEX, INTRA), ("end", c.UT_END, INTRA),
           ("increment", c.UT_INCREMENT, DYNAMIC), ("increment-of-profile-0", c.UT_INCREMENT, INTRA)]
BYTES += [("bytes-%s-damaged" % name, parent, "CHECKSUM", "SS-UH-009",
           "a bit of the payload of a unit of type %s is flipped" % name.replace("-", "_"),
           flipped(kind(number, nth=-1))) for name, number, parent in DAMAGED]

HEADER = [
    ("header-version-0", INTRA, "RESERVED", "SS-FH-004 SS-FH-003 SS-ER-006 SS-ER-007", "version_major is 0", header(major=0)),
    ("header-version-1", INTRA, "RESERVED", "SS-FH-003", "version_major is 1, that of drafts", header(major=1, minor=0)),
    ("header-version-2", INTRA, "RESERVED", "SS-FH-003", "version_major is 2, that of the final version",
     header(major=2, minor=0)),
    ("header-version-minor-0", INTRA, "RESERVED", "SS-FH-003", "version_minor of a release candidate is 0", header(minor=0)),
    ("header-version-minor-2", INTRA, "RESERVED", "SS-FH-003", "version_minor is that of the release candidate before",
     header(minor=2)),
    ("header-version-minor-4", INTRA, "RESERVED", "SS-FH-003", "version_minor is that of a later release candidate",
     header(minor=4)),
    ("header-profile-of-predicted", DYNAMIC, "OUT_OF_RANGE", "SS-ER-001 SS-FH-004",
     "profile is 0 in a stream of three temporal layers", header(profile=0)),
    ("header-profile-2", INTRA, "RESERVED", "SS-FH-004", "profile is 2", header(profile=2)),
    ("header-profile-255", INTRA, "RESERVED", "SS-FH-004", "profile is 255", header(profile=255)),
    ("header-level-0", INTRA, "RESERVED", "SS-FH-004", "level is 0", header(level=0)),
    ("header-level-5", INTRA, "RESERVED", "SS-FH-004", "level is 5", header(level=5)),
    ("header-unit-type-0", INTRA, "NUMBER", "SS-UH-002", "unit_type is 0", changed(kind(c.UT_TRANSFORM), kind=0)),
    ("header-flags-2", INTRA, "RESERVED_BITS", "SS-ER-002", "bit 1 of unit_flags is set", changed(INCREMENT, flags=3)),
    ("header-flags-128", INTRA, "RESERVED_BITS", "SS-ER-002", "bit 7 of unit_flags is set",
     changed(INCREMENT, flags=0x81)),
    ("header-reserved-zero", INTRA, "RESERVED_BITS", "SS-ER-002", "reserved_zero of a unit_header is 1",
     changed(INCREMENT, reserved=1)),
    ("header-skipped-flags", "stream-skipped-checksum", "RESERVED_BITS", "SS-UH-004 SS-ER-002",
     "a reserved flag of a unit that would be skipped is set",
     changed(lambda units: 1, flags=4)),
    ("header-skipped-reserved-zero", "stream-skipped-checksum", "RESERVED_BITS", "SS-UH-004 SS-ER-002",
     "reserved_zero of a unit that would be skipped is 255",
     changed(lambda units: 1, reserved=255)),
] + [
    ("header-unknown-type-%d" % number, INTRA, "RESERVED", "SS-UH-005",
     "a unit of unknown type %d is critical" % number,
     inserted(foreign(number), kind(c.UT_FRAME))) for number in (12, 127, 128, 255)
] + [
    ("header-spatial-layer-in-profile-0", INTRA, "OUT_OF_RANGE", "SS-UH-008", "spatial_layer is 1 in profile 0",
     changed(INCREMENT, s=1)),
    ("header-temporal-layer-in-profile-0", INTRA, "OUT_OF_RANGE", "SS-UH-008", "temporal_layer is 1 in profile 0",
     changed(kind(c.UT_FRAME), t=1)),
    ("header-spatial-layer-of-frame", LAYERS, "OUT_OF_RANGE", "SS-UH-007", "spatial_layer of a frame_header is 1",
     changed(kind(c.UT_FRAME, nth=1), s=1)),
    ("header-refinement-of-frame", DYNAMIC, "OUT_OF_RANGE", "SS-UH-007", "refinement of a frame_header is 1",
     changed(kind(c.UT_FRAME), r=1)),
    ("header-refinement-10", INTRA, "OUT_OF_RANGE", "SS-UH-007", "refinement of an increment is 10",
     changed(INCREMENT, r=10)),
    ("header-refinement-of-transform", INTRA, "OUT_OF_RANGE", "SS-UH-007", "refinement of a transform unit is 1",
     changed(kind(c.UT_TRANSFORM), r=1)),
    ("header-frame-of-parameters", INTRA, "OUT_OF_RANGE", "SS-UH-007", "frame of a sequence_parameters unit is 1",
     changed(kind(c.UT_SEQUENCE), frame=1)),
    ("header-frame-of-points", INTRA, "OUT_OF_RANGE", "SS-UH-007", "frame of an operating_points unit is 1",
     changed(kind(c.UT_POINTS), frame=1)),
    ("header-frame-of-index", INTRA, "OUT_OF_RANGE", "SS-UH-007", "frame of an index unit is 1",
     changed(kind(c.UT_INDEX), frame=1)),
    ("header-frame-of-end", INTRA, "OUT_OF_RANGE", "SS-UH-007", "frame of the end unit is 1", changed(END, frame=1)),
    ("header-spatial-layer-4", DYNAMIC, "OUT_OF_RANGE", "SS-UH-008", "spatial_layer of an increment is 4",
     changed(kind(c.UT_INCREMENT), s=4)),
    ("header-temporal-layer-4", DYNAMIC, "OUT_OF_RANGE", "SS-UH-008", "temporal_layer of an increment is 4",
     changed(kind(c.UT_INCREMENT, nth=-1), t=4)),
    ("header-refinement-10-of-increment", DYNAMIC, "OUT_OF_RANGE", "SS-UH-007", "refinement of an increment is 10",
     changed(kind(c.UT_INCREMENT), r=10)),
    ("header-spatial-layer-of-codebook", "codebook-defined-again", "OUT_OF_RANGE", "SS-UH-008 SS-UH-007",
     "spatial_layer of a codebook unit is 1",
     changed(kind(c.UT_CODEBOOK), s=1)),
    ("header-spatial-layer-not-in-sequence", DYNAMIC, "OUT_OF_RANGE", "SS-UH-008",
     "spatial_layer of an increment is 1 in a sequence of one spatial layer",
     changed(kind(c.UT_INCREMENT), s=1)),
    ("header-temporal-layer-not-in-sequence", DYNAMIC, "OUT_OF_RANGE", "SS-UH-008",
     "temporal_layer of an increment is 3 in a sequence of three temporal layers",
     changed(kind(c.UT_INCREMENT), t=3)),
]


# Every proper prefix is truncated; frames come out as far as they are there.
SWEEPS = [("bytes-every-prefix", "stream-copies-before-gops"), ("bytes-every-prefix-of-predicted", "stability-one-gaussian"),
          ("bytes-every-prefix-of-layers", "spatial-layers-2")]


def rows():
    yield from invalid("bytes", "bytes", BYTES)
    yield from invalid("header", "header", HEADER)
    for name, parent in SWEEPS:
        yield Vector("invalid", "bytes", name, None, "SS-BS-011 SS-BS-005 SS-ER-011", lambda data: data, "sweep", 0, parent,
                     "the stream is cut at every byte", sweep=True)
