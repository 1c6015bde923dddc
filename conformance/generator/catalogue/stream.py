"""Valid vectors of streams, units and refinements of profile 0."""

import itertools

from oracle import constants as c
from ..synth.given import GivenStream
from ..synth.units import stream_of, units_of
from ..vector import Vector


def one_frame(total=9, values=None, plans=None, seed=1, codes=None, tamper=None, level=1, sh=None, lanes_log2=0,
              attribute_step=(0,) * 5, **asked):
    """A stream of one frame with one increment; sh: None or the arguments of its sh transform."""
    s = GivenStream(seed, level, tamper=tamper, **asked)
    s.gop()
    s.transform()
    if sh is not None:
        s.transform(kind=1, **sh)
    s.frame(total, sh=c.NONE_ID if sh is None else 0)
    s.unit(values, plans, codes, lanes_log2, sh_mode=0 if sh is None else 1, attribute_step=attribute_step)
    return s.close()


def frames(sizes, gops=None, units=None, index=True, listed=True, seed=1, copies=False, **asked):
    """Frames of the given sizes; gops: frames of each GOP; units: increments of each frame."""
    s = GivenStream(seed, **asked)
    rest = list(zip(sizes, units or [s.seq.refinement_count] * len(sizes)))
    for number, count in enumerate(gops or [len(sizes)]):
        if number and copies:
            s.sequence()
        s.gop(count)
        s.transform()
        for size, unit_count in rest[:count]:
            s.frame(size)
            for _ in range(unit_count):
                s.unit()
        rest = rest[count:]
    if listed:
        s.operating_points()
    if index:
        s.index()
    return s.close()


def without_frames():
    return GivenStream().close()


def only_lists():
    """operating_points and index without entries that have frames."""
    s = GivenStream()
    s.operating_points()
    s.index()
    return s.close()


def points_none():
    s = GivenStream()
    s.operating_points([])
    return s.close()


def skipped_everywhere():
    s = GivenStream()
    kinds = itertools.cycle([12, 13, 127, 128, 255])

    def skip(**header):
        s.skipped(next(kinds), b"private"[:s.live.record.unit_count % 8], **header)

    skip()
    skip(frame=77, spatial=200, temporal=9, refinement=255)
    s.gop()
    skip(frame=2 ** 32 - 1)
    s.transform()
    skip()
    s.frame(4)
    skip(refinement=1)
    s.unit()
    skip()
    s.operating_points()
    skip()
    s.index()
    skip()
    return first_skipped(s.close())


def first_skipped(data):
    """A skipped unit before sequence_parameters as well."""
    head, units = units_of(data)
    return stream_of(head, [units[1]] + units)


def short_stream(s):
    s.gop()
    s.transform()
    s.frame(3)
    s.unit()
    return s


def skipped_with_wrong_checksum():
    s = GivenStream()
    s.skipped(200, b"a payload that nobody reads")
    s.out[-1] ^= 1
    return short_stream(s).close()


def critical_bits_off():
    head, units = units_of(frames([3], listed=False))
    for u in units:
        u.flags = int(u.kind == c.UT_INDEX)
    return stream_of(head, units)


def parameters_repeated():
    s = GivenStream(percent=[40, 100])
    s.sequence()
    s.gop(2)
    s.sequence()
    s.transform()
    for _ in range(2):
        s.frame(5)
        s.sequence()
        s.unit()
        s.sequence()
        s.unit()
        s.sequence()
    s.operating_points()
    s.sequence()
    s.index()
    s.sequence()
    return s.close()


def transforms_of_all_identifiers():
    s = GivenStream(sh_degree=1)
    s.gop(2)
    for identifier in range(16):
        s.transform(0, identifier, mean=[identifier, 0, -identifier])
        s.transform(1, 15 - identifier, mean=[identifier])
    for identifier in (0, 15):
        s.frame(5, identifier, identifier)
        s.unit(sh_mode=1)
    return s.close()


def definitions_again():
    """Each GOP defines the same identifiers with other values."""
    s = GivenStream()
    for mean in (100, -5000):
        s.gop(1)
        s.transform(mean=[mean])
        s.frame(4)
        s.unit()
    return s.close()


MOST = {"position_offset": [2.0 ** 40] * 3, "position_step": 2.0 ** 20, "log_scale_offset": 2.0 ** 40,
        "log_scale_step": 2.0 ** 20,
        "rotation_step": 1.0, "opacity_offset": 2.0 ** 40, "opacity_step": 2.0 ** 20, "dc_step": 2.0 ** 20,
        "sh_step": 2.0 ** 20,
        "ticks_per_second": 2 ** 32 - 1, "ticks_per_frame": 2 ** 32 - 1}
LEAST = {"position_offset": [-2.0 ** 40] * 3, "position_step": 2.0 ** -40, "log_scale_offset": -2.0 ** 40,
         "log_scale_step": 2.0 ** -40, "rotation_step": 2.0 ** -40, "opacity_offset": -2.0 ** 40,
         "opacity_step": 2.0 ** -40,
         "dc_step": 2.0 ** -40, "sh_step": 2.0 ** -40, "ticks_per_second": 1, "ticks_per_frame": 0}
TENTHS = list(range(10, 101, 10))

STREAM = [
    ("stream-without-frames", "SS-BS-001 SS-BS-011 SS-EN-001 SS-EN-002 SS-FH-001 SS-FH-002 SS-UH-001",
     "file_header, sequence_parameters and end: the shortest stream", without_frames),
    ("stream-lists-without-frames", "SS-IX-001 SS-PL-002", "operating_points and index in a stream without GOPs",
     only_lists),
    ("stream-points-none", "SS-PL-001", "An operating_points unit without entries", points_none),
    ("stream-one-frame",
     "SS-BS-001 SS-BS-002 SS-BS-006 SS-GH-001 SS-GH-002 SS-GH-003 SS-FR-001 SS-FR-003 SS-TF-001 SS-TF-002 "
     "SS-UH-009 SS-UH-002 SS-UH-007 SS-FH-004 SS-FH-003 SS-IN-001",
     "One frame in one GOP", one_frame),
    ("stream-one-gaussian", "SS-PA-006", "A frame with a single Gaussian", lambda: one_frame(1)),
    ("stream-empty-frame", "SS-IN-001 SS-DG-004 SS-PA-006",
     "A frame without Gaussians: its increments have flags and a digest alone",
     lambda: frames([0], percent=[50, 100])),
    ("stream-skipped-units", "SS-UH-004 SS-UH-005 SS-BS-001",
     "Units of unknown types between all others with any values in their headers",
     skipped_everywhere),
    ("stream-skipped-checksum", "SS-UH-004", "payload_crc of a skipped unit is wrong and not looked at",
     skipped_with_wrong_checksum),
    ("stream-critical-bits", "SS-UH-005",
     "The critical bit of known units is not that of the table, which a decoder does not examine",
     critical_bits_off),
    ("stream-parameters-repeated", "SS-SP-005", "Copies of sequence_parameters in every phase", parameters_repeated),
    ("stream-several-gops", "SS-GH-001 SS-IX-001 SS-IX-003 SS-IX-002 SS-BS-007 SS-BS-008",
     "Three GOPs of one to three frames with an index",
     lambda: frames([5, 0, 9, 1, 4, 4], [1, 3, 2])),
    ("stream-copies-before-gops", "SS-SP-005 SS-BS-012", "A copy of sequence_parameters before each GOP but the first",
     lambda: frames([5, 4, 9, 1], [1, 1, 2], copies=True)),
    ("stream-without-index", "SS-EN-001", "No index and no operating_points: index_offset is 0",
     lambda: frames([5, 4], index=False, listed=False)),
    ("stream-index-alone", "SS-IX-001", "An index without an operating_points unit",
     lambda: frames([5, 4], listed=False)),
    ("stream-frame-count-known", "SS-SP-006", "frame_count of sequence_parameters is stated",
     lambda: frames([3, 3, 3], [2, 1], frame_count=3)),
    ("stream-definitions-again", "SS-GH-004 SS-TF-003",
     "The second GOP defines the transform of the first one again, otherwise", definitions_again),
    ("stream-all-transforms", "SS-TF-002 SS-TF-003 SS-FR-003", "All sixteen identifiers of both kinds of transforms",
     transforms_of_all_identifiers),
    ("stream-steps-most", "SS-SP-003 SS-SP-007 SS-OUT-001", "All f32 elements and ticks are as large as they may be",
     lambda: one_frame(sh={}, sh_degree=1, **MOST)),
    ("stream-steps-least", "SS-SP-003 SS-SP-007 SS-OUT-001", "All f32 elements and ticks are as small as they may be",
     lambda: one_frame(sh={}, sh_degree=1, **LEAST)),
    ("stream-negative-zero", "SS-SP-003 SS-OUT-001", "Offsets are negative zeros",
     lambda: one_frame(position_offset=[-0.0] * 3, log_scale_offset=-0.0, opacity_offset=-0.0)),
    ("stream-level-2", "SS-LM-001 SS-LM-002 SS-LM-003", "A stream of level 2", lambda: one_frame(level=2)),
    ("stream-level-3", "SS-LM-001 SS-LM-002 SS-LM-003", "A stream of level 3", lambda: one_frame(level=3)),
    ("stream-level-4", "SS-LM-001 SS-LM-002 SS-LM-003", "A stream of level 4", lambda: one_frame(level=4)),
    ("stream-antialiased", "SS-SP-001", "The flag antialiased changes nothing", lambda: one_frame(sequence_flags=2)),
]
REFINEMENT = [
    ("refinement-%s" % name, "SS-SP-001 SS-RU-001", "%d refinements" % count,
     lambda count=count: frames([23], percent=TENTHS[-count:])) for name, count in (("seven", 7), ("eight", 8), ("nine", 9))
] + [
    ("refinement-six", "SS-SP-001 SS-RU-001", "Six refinements",
     lambda: frames([17], percent=[5, 10, 30, 60, 99, 100])),
    ("refinement-ten", "SS-SP-001 SS-RU-001 SS-OP-002 SS-OP-004 SS-OP-006", "Ten refinements in equal steps",
     lambda: frames([40], percent=TENTHS)),
    ("refinement-percent-least", "SS-SP-001 SS-RU-001", "Percentages 1 to 9 and 100: small units and a large last one",
     lambda: frames([60], percent=[1, 2, 3, 4, 5, 6, 7, 8, 9, 100])),
    ("refinement-ceiling", "SS-PA-006 SS-RU-001", "101 Gaussians and 10, 20, 30, 50, 100 percent: the example of 7.2",
     lambda: frames([101], percent=[10, 20, 30, 50, 100])),
    ("refinement-units-without-gaussians", "SS-IN-001 SS-RU-001",
     "One Gaussian in ten refinements: nine units are empty",
     lambda: frames([1, 2], percent=TENTHS)),
    ("refinement-frames-stop-early", "SS-OP-002 SS-OP-001",
     "Frames end at different refinements, which is no error",
     lambda: frames([10, 10, 10, 10], units=[1, 4, 2, 3], percent=[20, 40, 60, 100])),
    ("refinement-gaussian-count-changes", "SS-PA-006",
     "The number of Gaussians changes a hundredfold from frame to frame",
     lambda: frames([3, 300, 3, 0, 200], percent=[50, 100])),
]


def rows():
    for area, table in (("stream", STREAM), ("refinement", REFINEMENT)):
        for name, requirements, purpose, build in table:
            yield Vector("valid", area, name, purpose, requirements, build, "given", 1)
